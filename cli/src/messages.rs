//! Prints warnings of the libraries to standard error.

use std::collections::HashSet;
use std::sync::{LazyLock, Mutex, PoisonError};

use log::{LevelFilter, Log, Metadata, Record};

/// Prints each warning once, one a line: several views of a map load the same files again.
#[derive(Default)]
struct Messages {
    printed: Mutex<Printed>,
}

/// The messages so far.
#[derive(Default)]
struct Printed {
    known: HashSet<String>,
    /// In the order in which they were printed.
    lines: Vec<String>,
}

/// The logger of the process.
static MESSAGES: LazyLock<Messages> = LazyLock::new(Messages::default);

impl Messages {
    /// Whether a message was not printed before.
    fn is_new(&self, message: &str) -> bool {
        let mut printed = self.printed.lock().unwrap_or_else(PoisonError::into_inner);
        let new = !printed.known.contains(message) && printed.known.insert(message.to_owned());
        if new {
            printed.lines.push(message.to_owned());
        }
        new
    }
}

impl Log for Messages {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= log::Level::Warn
    }

    fn log(&self, record: &Record<'_>) {
        let message = record.args().to_string();
        if self.enabled(record.metadata()) && self.is_new(&message) {
            eprintln!("{message}");
        }
    }

    fn flush(&self) {}
}

/// Starts to print warnings.
pub fn print_warnings() {
    if log::set_logger(&*MESSAGES).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
}

/// The warnings that were printed, oldest first.
pub fn printed() -> Vec<String> {
    let printed = MESSAGES
        .printed
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    printed.lines.clone()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_printed_once() {
        let messages = Messages::default();
        assert!(messages.is_new("a.shader:1: no such directive"));
        assert!(messages.is_new("a.shader:2: no such directive"));
        assert!(!messages.is_new("a.shader:1: no such directive"));
    }
}
