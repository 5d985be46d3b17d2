//! Work spread over the processor's cores. Threads end before the call does.

use std::sync::{Mutex, OnceLock};

/// Pieces for each thread, taken as threads get free: items differ in cost.
const PIECES: usize = 32;

/// How many threads work. Read from the system once, because the call takes as long as a small task.
fn threads() -> usize {
    static THREADS: OnceLock<usize> = OnceLock::new();
    *THREADS.get_or_init(|| std::thread::available_parallelism().map_or(1, usize::from))
}

/// `f` of every item, in order. The result does not depend on the number of threads.
pub fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    let threads = threads();
    let piece = items.len().div_ceil(threads * PIECES).max(1);
    let queue = Mutex::new(items.chunks(piece).enumerate());
    let work = || {
        let mut done = Vec::new();
        loop {
            let taken = match queue.lock() {
                Ok(mut queue) => queue.next(),
                Err(_) => None,
            };
            let Some((number, chunk)) = taken else {
                return done;
            };
            let results: Vec<R> = chunk
                .iter()
                .enumerate()
                .map(|(i, item)| f(number * piece + i, item))
                .collect();
            done.push((number, results));
        }
    };
    if threads == 1 || items.len() <= piece {
        return items.iter().enumerate().map(|(i, t)| f(i, t)).collect();
    }
    let mut pieces = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
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
    pieces.into_iter().flat_map(|(_, r)| r).collect()
}

/// Does `f` to every item.
pub fn each<T: Send>(items: &mut [T], f: impl Fn(&mut T) + Sync) {
    let threads = threads();
    let piece = items.len().div_ceil(threads * PIECES).max(1);
    if threads == 1 || items.len() <= piece {
        return items.iter_mut().for_each(f);
    }
    let queue = Mutex::new(items.chunks_mut(piece));
    let work = || {
        let next = || queue.lock().ok().and_then(|mut queue| queue.next());
        while let Some(chunk) = next() {
            chunk.iter_mut().for_each(&f);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(work);
        }
        work();
    });
}

#[cfg(test)]
mod tests {
    #[test]
    fn keeps_the_order() {
        let items: Vec<usize> = (0..1000).collect();
        let doubled = super::map(&items, |i, item| i + item);
        assert!(doubled.iter().enumerate().all(|(i, d)| *d == 2 * i));
        assert_eq!(doubled.len(), 1000);
        assert!(super::map(&[0u8; 0], |i, _| i).is_empty());
    }

    #[test]
    fn reaches_every_item_once() {
        let mut items: Vec<usize> = (0..1000).collect();
        super::each(&mut items, |item| *item += 1);
        assert!(items.iter().enumerate().all(|(i, item)| *item == i + 1));
        super::each(&mut [0u8; 0], |_| panic!("there is none"));
    }
}
