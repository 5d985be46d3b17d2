//! Things that take long to make, made by all cores at once.

use std::num::NonZeroUsize;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Room for a driver's compiler, which is written for the stack of a program's first thread.
const STACK_SIZE: usize = 16 << 20;

/// Something that can be made by any thread, once.
pub struct Late<T, F> {
    made: OnceLock<T>,
    make: F,
}

impl<T, F: Fn() -> T> Late<T, F> {
    /// Not made yet.
    pub fn new(make: F) -> Self {
        Self {
            made: OnceLock::new(),
            make,
        }
    }

    /// What was made; made now if it was not.
    pub fn take(self) -> T {
        self.made.into_inner().unwrap_or_else(self.make)
    }
}

/// A [`Late`] of any type.
pub trait Make: Sync {
    /// Makes it, unless another thread does.
    fn make(&self);
}

impl<T: Send + Sync, F: Fn() -> T + Sync> Make for Late<T, F> {
    fn make(&self) {
        self.made.get_or_init(&self.make);
    }
}

/// Makes all of them, begun in their order: on as many threads as the machine has cores, the caller's among them, and none
/// of the others outlives the call.
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
            // where a thread is refused, the others do its work
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
    fn everything_is_made_once_whoever_makes_it() {
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
