//! Log records of the renderer go to the engine's console.
//!
//! The engine's print function belongs to the main thread. A record from another thread waits in a list until the call
//! that started the thread ends.

use crate::engine::print;
use crate::{engine, session};
use log::{Level, LevelFilter, Log, Metadata, Record};
use std::ffi::c_int;
use std::panic;
use std::sync::{Mutex, Once, PoisonError};

struct EngineLog;

/// Records of other threads, and where the newest panic happened.
static WAITING: Mutex<Vec<(c_int, String)>> = Mutex::new(Vec::new());
static PANIC_PLACE: Mutex<Option<String>> = Mutex::new(None);
static INSTALL: Once = Once::new();

fn level_of(level: Level) -> c_int {
    match level {
        Level::Error => print::ERROR,
        Level::Warn => print::WARNING,
        Level::Info => print::ALL,
        Level::Debug | Level::Trace => print::DEVELOPER,
    }
}

/// A record as a line of the console; the engine colours it.
fn line_of(level: Level, text: &str) -> String {
    match level {
        Level::Error => format!("ERROR: {text}\n"),
        Level::Warn => format!("WARNING: {text}\n"),
        _ => format!("{text}\n"),
    }
}

impl Log for EngineLog {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        // Traces of the GPU allocator and the like would drown the developer console.
        metadata.level() <= Level::Debug
    }

    fn log(&self, record: &Record<'_>) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let level = level_of(record.level());
        let line = line_of(record.level(), &record.args().to_string());
        if session::on_main_thread() {
            if let Some(engine) = engine::current() {
                engine.print(level, &line);
            }
        } else {
            WAITING
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push((level, line));
        }
    }

    fn flush(&self) {}
}

/// Sends records to the engine from now on. Safe to call at every `GetRefAPI`.
pub fn install() {
    INSTALL.call_once(|| {
        // Fails only if someone in this library set another logger before: then that one stays.
        let _ = log::set_logger(&EngineLog);
        log::set_max_level(LevelFilter::Debug);
        panic::set_hook(Box::new(|info| {
            let place = info
                .location()
                .map(|l| format!(" ({}:{})", l.file(), l.line()));
            *PANIC_PLACE.lock().unwrap_or_else(PoisonError::into_inner) = place;
        }));
    });
}

/// Where the newest panic happened, as ` (file:line)`, or nothing.
pub fn take_panic_place() -> String {
    PANIC_PLACE
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .take()
        .unwrap_or_default()
}

/// Prints what other threads logged.
pub fn flush() {
    let waiting = std::mem::take(&mut *WAITING.lock().unwrap_or_else(PoisonError::into_inner));
    if let Some(engine) = engine::current() {
        for (level, line) in waiting {
            engine.print(level, &line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_become_the_engines() {
        assert_eq!(level_of(Level::Error), 3);
        assert_eq!(level_of(Level::Warn), 2);
        assert_eq!(level_of(Level::Info), 0);
        assert_eq!(level_of(Level::Debug), 1);
        assert_eq!(
            line_of(Level::Warn, "maps/a.bsp: odd"),
            "WARNING: maps/a.bsp: odd\n"
        );
    }
}
