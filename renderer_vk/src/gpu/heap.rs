//! Gives the memory that a driver's compiler has freed back to the system.
//!
//! The C library keeps what was freed for the next request of the same thread's arena. A software driver's compiler
//! takes hundreds of megabytes for one large shader, in the arena of each thread that compiles, and frees them
//! when it is done: without this they stay with the process.

/// Gives free memory of the C library's heap back to the system. Takes milliseconds: not for use within a steady frame.
/// Without effect where the library has no such function (`malloc_trim` is the GNU one's).
#[cfg(unix)]
pub fn give_back_freed_memory() {
    use libloading::os::unix::Library;
    use std::ffi::c_int;

    type Trim = unsafe extern "C" fn(usize) -> c_int;
    let process = Library::this();
    // SAFETY: where the symbol exists, it is the C library's, of this type.
    if let Ok(trim) = unsafe { process.get::<Trim>(b"malloc_trim\0") } {
        // SAFETY: callable at any time from any thread; it touches free memory alone.
        unsafe { trim(0) };
    }
}

/// Elsewhere freed memory is left to the C library.
#[cfg(not(unix))]
pub fn give_back_freed_memory() {}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::give_back_freed_memory;

    /// Anonymous memory of this process, megabytes.
    fn anonymous() -> u64 {
        let status = std::fs::read_to_string("/proc/self/status").expect("Linux says");
        let line = status.lines().find_map(|l| l.strip_prefix("RssAnon:"));
        let number = line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
        number.expect("kilobytes") >> 10
    }

    #[test]
    fn what_a_thread_has_freed_goes_back_to_the_system() {
        let make = || {
            let mut blocks: Vec<Vec<u8>> = (0..64 << 10).map(|_| vec![1; 4 << 10]).collect();
            // what lies at the end keeps the C library from giving back what lies before it
            blocks.pop()
        };
        let last = std::thread::scope(|scope| scope.spawn(make).join());
        let before = anonymous();
        give_back_freed_memory();
        let after = anonymous();
        assert!(before > after + 128, "{before} MB, then {after} MB of 256");
        drop(last);
    }
}
