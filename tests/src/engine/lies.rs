//! What an engine may do wrong when it calls `GetRefAPI`.

use std::ffi::{c_int, c_void};
use std::ptr;
use std::rc::Rc;

use super::abi::{GetRefAPI, REF_API_VERSION};
use super::imports::{self, State, Tables};
use super::{Raised, call};

/// Changes the words of a table.
pub type EditTable = Rc<dyn Fn(&mut [usize])>;

/// What `GetRefAPI` gets in place of the truth. By default nothing is wrong.
#[derive(Clone, Default)]
pub struct Lies {
    /// Another version of the interface.
    pub version: Option<c_int>,
    /// No table.
    pub no_table: bool,
    /// Changes the words of the table and those behind it.
    pub table: Option<EditTable>,
    /// The call comes from a thread that calls nothing else.
    pub other_thread: bool,
}

/// Calls a renderer's `GetRefAPI`.
pub(super) fn get_ref_api(
    entry: GetRefAPI,
    tables: Tables,
    lies: &Lies,
) -> Result<*const c_void, Raised> {
    // The engine passes a structure on its stack and the renderer has to copy it; ours is overwritten below.
    let mut words = imports::words(tables);
    if let Some(change) = &lies.table {
        change(&mut words);
    }
    let version = lies.version.unwrap_or(REF_API_VERSION);
    let table = if lies.no_table {
        ptr::null_mut()
    } else {
        words.as_mut_ptr()
    };
    let exports = if lies.other_thread {
        in_another_thread(entry, version, table)
    } else {
        // SAFETY: the table outlives the call.
        call(move || unsafe { entry(version, table.cast()) })
    };
    // It must not be read any more, and calls through zeros crash.
    std::hint::black_box(&mut words).fill(0);
    exports
}

/// A value that another thread gets for good.
struct Moved<T>(T);

// SAFETY: one thread waits for the other, which alone uses the value.
unsafe impl<T> Send for Moved<T> {}

impl<T> Moved<T> {
    fn into_inner(self) -> T {
        self.0
    }
}

/// `GetRefAPI` on a thread of its own, which has the engine's state during the call.
fn in_another_thread(
    entry: GetRefAPI,
    version: c_int,
    table: *mut usize,
) -> Result<*const c_void, Raised> {
    let given: Moved<(Option<State>, *mut usize)> = Moved((imports::install(None), table));
    let back = std::thread::scope(|scope| {
        let work = move || {
            let (state, table) = given.into_inner();
            imports::install(state);
            // SAFETY: the table outlives the call.
            let exports = call(move || unsafe { entry(version, table.cast()) });
            Moved((imports::install(None), exports))
        };
        scope.spawn(work).join()
    });
    let (state, exports) = back.expect("the thread ends").into_inner();
    imports::install(state);
    exports
}
