//! Tests of the boundary with an error function that leaves by `longjmp`.

use crate::boundary::entry;
use crate::c_tests::{compile, scratch, source};
use crate::engine::{self, Table, error_level};
use crate::failure::Failure;
use crate::session;
use libloading::Library;
use std::ffi::{CStr, c_char, c_int};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

type Call = extern "C" fn();

/// The library's state is global: tests that install an engine run one at a time.
static TURN: Mutex<()> = Mutex::new(());

/// The C half of an engine, installed with an otherwise empty table.
pub struct TestEngine {
    library: Library,
    _turn: MutexGuard<'static, ()>,
}

impl TestEngine {
    /// Locks [`TURN`]; `None` without a C compiler.
    pub fn start(name: &str) -> Option<Self> {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = scratch(name);
        let file = folder.join("libtest_engine.so");
        compile(
            &source("test_engine.c"),
            &file,
            &["-shared", "-fPIC", "-O1", "-Wall", "-Werror"],
        )?;
        // SAFETY: our own C code without initialisers.
        let library = unsafe { Library::new(&file) }.unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        // SAFETY: the signatures are those of test_engine.c.
        unsafe {
            engine::install(Table {
                printf: Some(*library.get(b"test_printf\0").unwrap()),
                error: Some(*library.get(b"test_error\0").unwrap()),
                ..Table::EMPTY
            });
        }
        session::reset();
        let engine = Self {
            library,
            _turn: turn,
        };
        engine.set_inside_error(None);
        Some(engine)
    }

    fn function<F: Copy>(&self, name: &[u8]) -> F {
        // SAFETY: callers name a function of test_engine.c with its type.
        *unsafe { self.library.get::<F>(name) }.unwrap()
    }

    /// Whether the call ended in the engine's error.
    fn run(&self, call: Call) -> bool {
        let run: unsafe extern "C" fn(Call) -> c_int = self.function(b"test_run\0");
        // SAFETY: the calls of these tests leave nothing on their own stack that needs dropping.
        unsafe { run(call) != 0 }
    }

    fn set_inside_error(&self, call: Option<Call>) {
        let set: unsafe extern "C" fn(Option<Call>) = self.function(b"test_set_inside_error\0");
        // SAFETY: stores the pointer.
        unsafe { set(call) }
    }

    fn text(&self, name: &[u8]) -> String {
        let text: unsafe extern "C" fn() -> *const c_char = self.function(name);
        // SAFETY: returns a static NUL-terminated buffer.
        unsafe { CStr::from_ptr(text()) }
            .to_str()
            .unwrap()
            .to_string()
    }

    fn message(&self) -> String {
        self.text(b"test_message\0")
    }

    fn printed(&self) -> String {
        self.text(b"test_printed\0")
    }

    fn level(&self) -> c_int {
        let level: unsafe extern "C" fn() -> c_int = self.function(b"test_level\0");
        // SAFETY: no arguments.
        unsafe { level() }
    }
}

impl Drop for TestEngine {
    fn drop(&mut self) {
        // No code may print through a closed library.
        // SAFETY: it has no functions.
        unsafe { engine::install(Table::EMPTY) };
    }
}

static DROPPED: AtomicUsize = AtomicUsize::new(0);

/// Counts the runs of its destructor.
struct Witness;

impl Drop for Witness {
    fn drop(&mut self) {
        DROPPED.fetch_add(1, Ordering::SeqCst);
    }
}

extern "C" fn fails() {
    entry(|| {
        let _witness = Witness;
        let text = [
            String::from("maps/a.bsp: lump 3"),
            String::from("100% broken %s %n"),
        ];
        Err::<(), _>(Failure::drop(text.join(": ")))
    });
}

extern "C" fn panics() {
    entry::<c_int>(|| {
        let _witness = Witness;
        session::with(|_| {
            let _inner = Witness;
            panic!("index {} is out", 7)
        })
        .unwrap_or(Ok(0))
    });
}

extern "C" fn is_fatal() {
    entry(|| Err::<(), _>(Failure::fatal("x".repeat(10_000))));
}

extern "C" fn works() {
    entry(|| Ok(()));
}

#[test]
fn an_error_reaches_the_engine_after_every_destructor_ran() {
    let Some(engine) = TestEngine::start("error") else {
        return;
    };
    DROPPED.store(0, Ordering::SeqCst);
    assert!(engine.run(fails));
    assert_eq!(DROPPED.load(Ordering::SeqCst), 1);
    assert_eq!(engine.message(), "maps/a.bsp: lump 3: 100% broken %s %n");
    assert_eq!(engine.level(), error_level::DROP);
    assert!(!engine.run(works), "the next call works");
}

#[test]
fn a_panic_becomes_an_error_and_the_state_comes_back() {
    let Some(engine) = TestEngine::start("panic") else {
        return;
    };
    DROPPED.store(0, Ordering::SeqCst);
    assert!(engine.run(panics));
    assert_eq!(DROPPED.load(Ordering::SeqCst), 2);
    assert!(
        engine.message().contains("index 7 is out"),
        "{}",
        engine.message()
    );
    assert_eq!(engine.level(), error_level::DROP);
    assert_eq!(
        session::with(|session| session.renderer.is_none()),
        Some(true)
    );
}

#[test]
fn a_long_message_is_cut_to_what_the_engine_copies() {
    let Some(engine) = TestEngine::start("fatal") else {
        return;
    };
    assert!(engine.run(is_fatal));
    assert_eq!(engine.level(), error_level::FATAL);
    assert_eq!(engine.message().len(), 4095);
}

extern "C" fn shuts_down_inside() {
    // The engine's calls before its jump.
    for _ in 0..2 {
        // SAFETY: on the thread that installed the engine, from a frame that owns nothing.
        unsafe { crate::lifecycle::shutdown(0) };
    }
    DROPPED.fetch_add(100, Ordering::SeqCst);
}

#[test]
fn the_engine_may_shut_us_down_from_inside_its_error() {
    let Some(engine) = TestEngine::start("nested") else {
        return;
    };
    DROPPED.store(0, Ordering::SeqCst);
    engine.set_inside_error(Some(shuts_down_inside));
    assert!(engine.run(fails));
    assert_eq!(DROPPED.load(Ordering::SeqCst), 101);
    assert_eq!(
        session::with(|session| session.front.registered),
        Some(false)
    );
}

/// A service that leaves by `longjmp` while one of our calls has the state.
extern "C" fn taken_and_left() {
    session::with(|session| {
        session.front.size = (1, 1);
        let error = engine::current()
            .and_then(|engine| engine.error_function())
            .unwrap();
        // SAFETY: the test's error function; it leaves by longjmp, as a service of the engine may.
        unsafe { error(error_level::DROP, c"%s".as_ptr(), c"out of memory".as_ptr()) };
    });
}

#[test]
fn a_call_that_the_engine_gave_up_does_not_lock_the_state() {
    let Some(engine) = TestEngine::start("abandoned") else {
        return;
    };
    engine.set_inside_error(Some(shuts_down_inside));
    assert!(engine.run(taken_and_left));
    assert_eq!(engine.message(), "out of memory");
    assert_eq!(
        session::with(|session| session.front.size),
        Some((0, 0)),
        "a fresh state"
    );
}

extern "C" fn nested_calls() {
    entry(|| {
        session::with(|_| {
            assert!(
                session::with(|_| ()).is_none(),
                "a call inside a call finds nothing"
            );
            works();
        });
        Ok(())
    });
}

#[test]
fn a_call_inside_a_call_is_ignored() {
    let Some(engine) = TestEngine::start("reentrant") else {
        return;
    };
    assert!(!engine.run(nested_calls));
    assert!(session::with(|_| ()).is_some());
}

#[test]
fn other_threads_are_refused() {
    let Some(_engine) = TestEngine::start("threads") else {
        return;
    };
    let answer = std::thread::scope(|scope| scope.spawn(|| entry(|| Ok(7))).join().unwrap());
    assert_eq!(answer, 0);
    assert_eq!(entry(|| Ok(7)), 7);
}

#[test]
fn every_function_may_be_called_before_registration() {
    let Some(engine) = TestEngine::start("early") else {
        return;
    };
    extern "C" fn call_all() {
        // SAFETY: the test engine calls this on its thread, from C frames and this one, which owns nothing.
        unsafe { crate::ioq3::call_everything_for_tests() };
    }
    assert!(!engine.run(call_all), "{}", engine.message());
}

#[test]
fn log_records_reach_the_console_also_from_other_threads() {
    let Some(engine) = TestEngine::start("log") else {
        return;
    };
    crate::logging::install();
    let clear: unsafe extern "C" fn() = engine.function(b"test_clear_printed\0");
    // SAFETY: no arguments.
    unsafe { clear() };
    log::warn!("textures/%s.tga: odd");
    assert_eq!(engine.printed(), "WARNING: textures/%s.tga: odd\n");
    std::thread::scope(|scope| {
        scope.spawn(|| log::info!("from a thread"));
    });
    assert!(!engine.printed().contains("from a thread"));
    works();
    assert!(engine.printed().ends_with("from a thread\n"));
}
