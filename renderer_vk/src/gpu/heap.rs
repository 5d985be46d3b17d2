//! Returns memory that a driver's compiler has freed to the system.
//!
//! The C library keeps freed memory for later allocations in the same thread's arena. A software driver's compiler
//! allocates hundreds of megabytes for one large shader, in the arena of each compiling thread, and frees them
//! afterwards: without this call they remain with the process.

/// Returns free memory of the C library's heap to the system. Takes milliseconds: not for steady frames. No effect
/// without `malloc_trim`, a function of GNU's C library.
#[cfg(unix)]
pub fn give_back_freed_memory() {
    use libloading::os::unix::Library;
    use std::ffi::c_int;

    type Trim = unsafe extern "C" fn(usize) -> c_int;
    let process = Library::this();
    // SAFETY: where the symbol exists, it is the C library's, of this type.
    if let Ok(trim) = unsafe { process.get::<Trim>(b"malloc_trim\0") } {
        // SAFETY: callable at any time from any thread; it accesses only free memory.
        unsafe { trim(0) };
    }
}

/// On other systems, the C library manages freed memory.
#[cfg(not(unix))]
pub fn give_back_freed_memory() {}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::give_back_freed_memory;

    /// Anonymous memory of this process, megabytes.
    fn anonymous() -> u64 {
        let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
        let line = status.lines().find_map(|l| l.strip_prefix("RssAnon:"));
        let number = line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
        number.expect("kilobytes") >> 10
    }

    #[test]
    fn memory_freed_by_a_thread_returns_to_the_system() {
        let make = || {
            let mut blocks: Vec<Vec<u8>> = (0..64 << 10).map(|_| vec![1; 4 << 10]).collect();
            // a live block at the end prevents the C library from returning memory before it
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
