//! Work spread over the processor's cores. Threads end before the call does.
//!
//! Starting a thread takes 10 to 100 µs, so the caller begins alone, and starts as many threads as what is left pays for by
//! the time that its pieces took. All calls of the process share the cores: a call within another, or beside it, starts
//! threads on free cores alone. Results do not depend on the number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Pieces for each thread, taken as threads get free: items differ in cost.
const PIECES: usize = 32;

/// Least work of a thread that is started.
const WORTH_A_THREAD: Duration = Duration::from_micros(100);

/// How many threads work. Read from the system once, because the call takes as long as a small task.
fn threads() -> usize {
    static THREADS: OnceLock<usize> = OnceLock::new();
    *THREADS.get_or_init(|| std::thread::available_parallelism().map_or(1, usize::from))
}

/// Threads that calls have started and that work still.
static STARTED: AtomicUsize = AtomicUsize::new(0);

/// The right to start threads, given back when dropped.
struct Started(usize);

impl Started {
    /// At most `wanted`, as far as cores are free.
    fn take(wanted: usize) -> Started {
        let free = |started: usize| wanted.min((threads() - 1).saturating_sub(started));
        let mut before = STARTED.load(Ordering::Relaxed);
        loop {
            let count = free(before);
            let (now, order) = (before + count, Ordering::Relaxed);
            match STARTED.compare_exchange_weak(before, now, order, order) {
                Ok(_) => return Started(count),
                Err(changed) => before = changed,
            }
        }
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        STARTED.fetch_sub(self.0, Ordering::Relaxed);
    }
}

/// Threads to start for the pieces that are left, if each takes as long as those `done` in some time.
fn worth(left: usize, done: usize, took: Duration) -> usize {
    let whole = took.as_nanos() * left as u128 / done.max(1) as u128;
    let paid = whole / WORTH_A_THREAD.as_nanos();
    usize::try_from(paid).unwrap_or(usize::MAX).min(left)
}

/// Does pieces until threads are worth starting and cores are free. `None`: all are done.
fn begin_alone<P>(
    pieces: &mut impl ExactSizeIterator<Item = P>,
    mut compute: impl FnMut(P),
) -> Option<Started> {
    let begin = Instant::now();
    for done in 1.. {
        compute(pieces.next()?);
        let wanted = worth(pieces.len(), done, begin.elapsed());
        let started = Started::take(wanted);
        if started.0 > 0 {
            return Some(started);
        }
    }
    None
}

/// `f` of every item, in order. The result does not depend on the number of threads.
pub fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    let piece = items.len().div_ceil(threads() * PIECES).max(1);
    let mut chunks = items.chunks(piece).enumerate();
    let compute = |(number, chunk): (usize, &[T]), done: &mut Vec<R>| {
        let numbered = (number * piece..).zip(chunk);
        done.extend(numbered.map(|(i, item)| f(i, item)));
    };
    let mut first: Vec<R> = Vec::with_capacity(items.len());
    let Some(started) = begin_alone(&mut chunks, |chunk| compute(chunk, &mut first)) else {
        return first;
    };
    let queue = Mutex::new(chunks);
    let work = || {
        let mut pieces = Vec::new();
        let next = || queue.lock().ok().and_then(|mut queue| queue.next());
        while let Some(chunk) = next() {
            let mut done = Vec::with_capacity(chunk.1.len());
            compute(chunk, &mut done);
            pieces.push((chunk.0, done));
        }
        pieces
    };
    let mut pieces = std::thread::scope(|scope| {
        let others: Vec<_> = (0..started.0).map(|_| scope.spawn(work)).collect();
        let mut pieces = work();
        for other in others {
            match other.join() {
                Ok(more) => pieces.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        pieces
    });
    pieces.sort_by_key(|(number, _)| *number);
    first.extend(pieces.into_iter().flat_map(|(_, r)| r));
    first
}

/// Does `f` to every item.
pub fn each<T: Send>(items: &mut [T], f: impl Fn(&mut T) + Sync) {
    let piece = items.len().div_ceil(threads() * PIECES).max(1);
    let mut chunks = items.chunks_mut(piece);
    let compute = |chunk: &mut [T]| chunk.iter_mut().for_each(&f);
    let Some(started) = begin_alone(&mut chunks, compute) else {
        return;
    };
    let queue = Mutex::new(chunks);
    let work = || {
        let next = || queue.lock().ok().and_then(|mut queue| queue.next());
        while let Some(chunk) = next() {
            compute(chunk);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..started.0 {
            scope.spawn(work);
        }
        work();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_order() {
        let items: Vec<usize> = (0..1000).collect();
        let doubled = map(&items, |i, item| i + item);
        assert!(doubled.iter().enumerate().all(|(i, d)| *d == 2 * i));
        assert_eq!(doubled.len(), 1000);
        assert!(map(&[0u8; 0], |i, _| i).is_empty());
    }

    #[test]
    fn reaches_every_item_once() {
        let mut items: Vec<usize> = (0..1000).collect();
        each(&mut items, |item| *item += 1);
        assert!(items.iter().enumerate().all(|(i, item)| *item == i + 1));
        each(&mut [0u8; 0], |_| panic!("there is none"));
    }

    #[test]
    fn threads_are_started_for_work_that_pays_for_them() {
        let us = Duration::from_micros;
        assert_eq!(worth(500, 1, Duration::ZERO), 0);
        assert_eq!(worth(500, 2, us(2)), 5);
        assert_eq!(worth(3, 1, us(5000)), 3);
        assert_eq!(worth(0, 1, us(5000)), 0);
    }

    #[test]
    fn calls_within_calls_share_the_cores() {
        let most = AtomicUsize::new(0);
        let outer = [0u64; 64];
        let sums = map(&outer, |i, _| {
            let inner: Vec<u64> = (0..64).collect();
            let values = map(&inner, |_, k| {
                std::thread::sleep(Duration::from_micros(50));
                most.fetch_max(STARTED.load(Ordering::Relaxed), Ordering::Relaxed);
                k + i as u64
            });
            values.iter().sum::<u64>()
        });
        let exact = |i: u64| 64 * i + 63 * 32;
        assert!((0u64..).zip(&sums).all(|(i, sum)| *sum == exact(i)));
        assert!(most.load(Ordering::Relaxed) < threads());
    }
}
