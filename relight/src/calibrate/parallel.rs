//! Work spread over the processor's cores. Threads end before the call does.

/// `f` of every item, in order. The result does not depend on the number of threads.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    // Several pieces for each thread, taken as threads get free: items differ in cost.
    let piece = items.len().div_ceil(threads * 8).max(1);
    let queue = std::sync::Mutex::new(items.chunks(piece).enumerate());
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
}
