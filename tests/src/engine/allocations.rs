//! Counts what Rust code takes from the heap. The library is linked into the test for that: a library of its own has
//! an allocator of its own, which other code cannot inspect.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    /// Blocks taken since counting began; `None`: not counting.
    static TAKEN: Cell<Option<u64>> = const { Cell::new(None) };
}

/// The system's allocator, counting for a thread that asks.
pub struct Counting;

/// Counts a block. With `RELIGHT_VERBOSE=1` prints where it was allocated.
fn note(size: usize) {
    // A thread that ends has no counter any more.
    let taken = TAKEN.try_with(|taken| taken.take()).ok().flatten();
    if let Some(so_far) = taken {
        if testkit::is_set("RELIGHT_VERBOSE") {
            let trace = std::backtrace::Backtrace::force_capture();
            eprintln!("{size} bytes are taken by\n{trace}");
        }
        let _ = TAKEN.try_with(|taken| taken.set(Some(so_far + 1)));
    }
}

// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: the same contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: the same contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size);
        // SAFETY: the same contract.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the same contract.
        unsafe { System.dealloc(block, layout) }
    }
}

/// Blocks that `f` takes from the heap on this thread, in a process whose allocator is [`Counting`].
pub fn count<R>(f: impl FnOnce() -> R) -> (u64, R) {
    TAKEN.with(|taken| taken.set(Some(0)));
    let result = f();
    (TAKEN.with(|taken| taken.take()).unwrap_or(0), result)
}
