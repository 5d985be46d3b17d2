//! Parallel construction of objects that take long to make, such as pipelines.

use std::num::NonZeroUsize;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Stack of a thread, bytes: drivers' compilers assume the stack of a main thread.
const STACK_SIZE: usize = 16 << 20;

/// A value that any thread can make, once.
pub struct Late<T, F> {
    made: OnceLock<T>,
    make: F,
}

impl<T, F: Fn() -> T> Late<T, F> {
    /// A value that is not made yet.
    pub fn new(make: F) -> Self {
        Self {
            made: OnceLock::new(),
            make,
        }
    }

    /// The value; makes it if no thread has.
    pub fn take(self) -> T {
        self.made.into_inner().unwrap_or_else(self.make)
    }
}

/// A [`Late`] of any type.
pub trait Make: Sync {
    /// Makes the value, unless another thread does.
    fn make(&self);
}

impl<T: Send + Sync, F: Fn() -> T + Sync> Make for Late<T, F> {
    fn make(&self) {
        self.made.get_or_init(&self.make);
    }
}

/// Makes all values, started in their order, on as many threads as the machine has cores, including the caller's. All
/// other threads end before the call returns.
pub fn make_all(things: &[&dyn Make]) {
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(thing) = things.get(next.fetch_add(1, Ordering::Relaxed)) {
            thing.make();
        }
    };
    let cores = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    thread::scope(|scope| {
        for _ in 1..cores.min(things.len()) {
            // if a thread cannot be started, the other threads do its work
            let builder = thread::Builder::new().stack_size(STACK_SIZE);
            if builder.spawn_scoped(scope, work).is_err() {
                break;
            }
        }
        work();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_value_is_made_once_by_any_thread() {
        let count = AtomicUsize::new(0);
        let make = |n: usize| {
            let count = &count;
            Late::new(move || {
                count.fetch_add(1, Ordering::Relaxed);
                n
            })
        };
        let things: Vec<_> = (0..100).map(make).collect();
        let (first, _) = things.split_at(60);
        make_all(&first.iter().map(|t| t as &dyn Make).collect::<Vec<_>>());
        assert_eq!(count.load(Ordering::Relaxed), 60);
        let made: Vec<usize> = things.into_iter().map(Late::take).collect();
        assert_eq!(made, (0..100).collect::<Vec<_>>());
        assert_eq!(count.load(Ordering::Relaxed), 100);
    }
}
