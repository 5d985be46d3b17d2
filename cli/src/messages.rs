//! Prints warnings of the libraries to standard error, and keeps them and other messages for reports.

use std::collections::HashSet;
use std::sync::{LazyLock, Mutex, PoisonError};

use log::{Level, LevelFilter, Log, Metadata, Record};

/// Keeps each message once and prints the warnings, one a line: several views of a map load the same files again.
#[derive(Default)]
struct Messages {
    kept: Mutex<Kept>,
}

/// The messages so far.
#[derive(Default)]
struct Kept {
    known: HashSet<String>,
    /// Oldest first.
    lines: Vec<String>,
}

/// The logger of the process.
static MESSAGES: LazyLock<Messages> = LazyLock::new(Messages::default);

impl Messages {
    /// Whether a message is new.
    fn is_new(&self, message: &str) -> bool {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let new = !kept.known.contains(message) && kept.known.insert(message.to_owned());
        if new {
            kept.lines.push(message.to_owned());
        }
        new
    }
}

impl Log for Messages {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= Level::Info
    }

    fn log(&self, record: &Record<'_>) {
        let message = record.args().to_string();
        let new = self.enabled(record.metadata()) && self.is_new(&message);
        // the window library warns about the display's properties, which a user cannot change
        let ours = !record.target().starts_with("winit");
        if new && ours && record.level() <= Level::Warn {
            eprintln!("{message}");
        }
    }

    fn flush(&self) {}
}

/// Starts to print warnings.
pub fn print_warnings() {
    if log::set_logger(&*MESSAGES).is_ok() {
        log::set_max_level(LevelFilter::Info);
    }
}

/// The messages so far, oldest first.
pub fn kept() -> Vec<String> {
    let kept = MESSAGES.kept.lock().unwrap_or_else(PoisonError::into_inner);
    kept.lines.clone()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_kept_once() {
        let messages = Messages::default();
        assert!(messages.is_new("a.shader:1: no such directive"));
        assert!(messages.is_new("a.shader:2: no such directive"));
        assert!(!messages.is_new("a.shader:1: no such directive"));
    }
}
