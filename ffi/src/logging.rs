//! Passes log records of the renderer to the engine's console.
//!
//! Only the main thread may call the engine's print function. A record from another thread waits in a list until the
//! call that started the thread ends.

use crate::engine::print;
use crate::{engine, session};
use log::{Level, LevelFilter, Log, Metadata, Record};
use std::collections::VecDeque;
use std::ffi::c_int;
use std::panic;
use std::sync::{Mutex, Once, PoisonError};

struct EngineLog;

/// How many records a report has.
const KEPT: usize = 2000;

/// The newest records, oldest first, for reports.
static NEWEST: Mutex<VecDeque<String>> = Mutex::new(VecDeque::new());
/// Records of other threads, and the position of the last panic.
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

/// A record as a line of the console, with the engine's colour codes.
fn line_of(level: Level, text: &str) -> String {
    match level {
        Level::Error => format!("ERROR: {text}\n"),
        Level::Warn => format!("WARNING: {text}\n"),
        _ => format!("{text}\n"),
    }
}

impl Log for EngineLog {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        // Debug records, for example of the GPU allocator, would flood the developer console.
        metadata.level() <= Level::Debug
    }

    fn log(&self, record: &Record<'_>) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let level = level_of(record.level());
        let line = line_of(record.level(), &record.args().to_string());
        keep(&line);
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

/// Keeps a record for reports.
fn keep(line: &str) {
    let mut newest = NEWEST.lock().unwrap_or_else(PoisonError::into_inner);
    if newest.len() == KEPT {
        newest.pop_front();
    }
    newest.push_back(line.to_owned());
}

/// The newest records, oldest first.
pub fn newest() -> Vec<String> {
    let newest = NEWEST.lock().unwrap_or_else(PoisonError::into_inner);
    newest.iter().cloned().collect()
}

/// Starts passing records to the engine. May be called at every `GetRefAPI`.
pub fn install() {
    INSTALL.call_once(|| {
        // Fails only if this library already has another logger, which then stays.
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

/// Position of the last panic, as ` (file:line)`, or empty if it is not known.
pub fn take_panic_place() -> String {
    PANIC_PLACE
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .take()
        .unwrap_or_default()
}

/// Prints the waiting records of other threads.
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
    fn log_levels_map_to_engine_levels() {
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
