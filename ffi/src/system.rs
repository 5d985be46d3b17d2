//! The parts that differ between operating systems: the library's own file, paths in the engine's encoding, and the
//! process's memory.

#[cfg(unix)]
use std::ffi::OsStr;
use std::ffi::{CStr, OsString, c_char};
use std::ops::Range;
#[cfg(windows)]
use std::os::windows::ffi::OsStringExt;
use std::path::PathBuf;

/// The library's own file; `None` where the system does not name it.
#[cfg(unix)]
pub fn own_file() -> Option<PathBuf> {
    use std::ffi::{c_int, c_void};

    #[repr(C)]
    struct DlInfo {
        file_name: *const c_char,
        base: *mut c_void,
        symbol_name: *const c_char,
        symbol: *mut c_void,
    }
    unsafe extern "C" {
        fn dladdr(address: *const c_void, info: *mut DlInfo) -> c_int;
    }
    let mut info = DlInfo {
        file_name: std::ptr::null(),
        base: std::ptr::null_mut(),
        symbol_name: std::ptr::null(),
        symbol: std::ptr::null_mut(),
    };
    // SAFETY: the address is one of ours; the system fills the structure.
    let known = unsafe { dladdr(own_address(), &mut info) } != 0 && !info.file_name.is_null();
    // SAFETY: a string of the dynamic loader.
    known.then(|| unsafe { path_from(info.file_name) })
}

/// The library's own file; `None` where the system does not name it.
#[cfg(windows)]
pub fn own_file() -> Option<PathBuf> {
    /// Characters of the longest path, with its NUL.
    const LONGEST: u32 = 1 << 15;
    let mut name = vec![0u16; LONGEST as usize];
    // SAFETY: this library's module; the system writes up to `LONGEST` characters.
    let length =
        unsafe { kernel32::GetModuleFileNameW(pinned_module()?, name.as_mut_ptr(), LONGEST) };
    // 0: an error
    let name = name
        .get(..length as usize)
        .filter(|name| !name.is_empty())?;
    Some(OsString::from_wide(name).into())
}

/// Keeps the library loaded until the process ends. On other systems than Windows the linker's option `-z nodelete`
/// does.
pub fn pin() {
    #[cfg(windows)]
    if pinned_module().is_none() {
        log::warn!("Windows does not keep the renderer library loaded");
    }
}

/// The file system's name for a path that the engine passes to the C library's `fopen`: on Windows, text in the
/// process's code page, which is UTF-8 if the program's manifest states so; elsewhere any bytes. Null gives an empty
/// path.
///
/// # Safety
/// `text` must be null or point at a NUL-terminated string.
pub unsafe fn path_from(text: *const c_char) -> PathBuf {
    if text.is_null() {
        return PathBuf::new();
    }
    // SAFETY: not null, so NUL-terminated by this function's contract.
    let text = unsafe { CStr::from_ptr(text) };
    system_text(text.to_bytes()).into()
}

#[cfg(unix)]
fn system_text(bytes: &[u8]) -> OsString {
    use std::os::unix::ffi::OsStrExt;
    OsStr::from_bytes(bytes).into()
}

#[cfg(windows)]
fn system_text(bytes: &[u8]) -> OsString {
    const CP_ACP: u32 = 0;
    // No code page makes more characters of 16 bits than it has bytes.
    let mut name = vec![0u16; bytes.len()];
    let size = i32::try_from(bytes.len()).unwrap_or(0);
    // SAFETY: `size` readable bytes and room for as many characters.
    let length = unsafe {
        let (from, to) = (bytes.as_ptr().cast(), name.as_mut_ptr());
        kernel32::MultiByteToWideChar(CP_ACP, 0, from, size, to, size)
    };
    // 0: an error, or no text
    name.truncate(usize::try_from(length).unwrap_or(0));
    OsString::from_wide(&name)
}

/// Address ranges of the process that hold code; empty if the system does not list them.
#[cfg(unix)]
pub fn code() -> Vec<Range<usize>> {
    let maps = std::fs::read("/proc/self/maps").unwrap_or_default();
    code_in(&String::from_utf8_lossy(&maps))
}

/// The executable ranges of `/proc/self/maps`.
#[cfg(unix)]
fn code_in(maps: &str) -> Vec<Range<usize>> {
    let range = |line: &str| {
        let (addresses, rest) = line.split_once(' ')?;
        let (start, end) = addresses.split_once('-')?;
        let number = |text| usize::from_str_radix(text, 16).ok();
        let executable = rest.split(' ').next()?.contains('x');
        executable.then_some(number(start)?..number(end)?)
    };
    maps.lines().filter_map(range).collect()
}

/// Address ranges of the process that hold code.
#[cfg(windows)]
pub fn code() -> Vec<Range<usize>> {
    /// `PAGE_EXECUTE` and its variants.
    const EXECUTABLE: u32 = 0xf0;
    let mut found = Vec::new();
    let mut address = 0;
    // SAFETY: numbers and addresses, for which zero is a value.
    let mut region: kernel32::Region = unsafe { std::mem::zeroed() };
    // SAFETY: the system writes one structure, and accepts any address; past the last region it returns 0.
    while unsafe { kernel32::VirtualQuery(address, &mut region, size_of_val(&region)) } != 0 {
        let end = region.base.saturating_add(region.size);
        if region.protection & EXECUTABLE != 0 {
            found.push(region.base..end);
        }
        if end <= address {
            break;
        }
        address = end;
    }
    found
}

/// Copies bytes of this process through the kernel, because they may be unmapped. Returns how many were readable.
#[cfg(unix)]
pub fn read_memory(address: usize, to: &mut [u8]) -> usize {
    use std::os::unix::fs::FileExt;
    std::fs::File::open("/proc/self/mem")
        .and_then(|memory| memory.read_at(to, address as u64))
        .unwrap_or(0)
}

/// Copies bytes of this process through the kernel, because they may be unmapped. Returns how many were readable.
#[cfg(windows)]
pub fn read_memory(address: usize, to: &mut [u8]) -> usize {
    let mut read = 0;
    // SAFETY: room for as many bytes; the system accepts any address.
    unsafe {
        let process = kernel32::GetCurrentProcess();
        kernel32::ReadProcessMemory(process, address, to.as_mut_ptr(), to.len(), &mut read);
    }
    read.min(to.len())
}

/// An address in this library.
fn own_address() -> *const std::ffi::c_void {
    crate::GetRefAPI as *const _
}

/// The handle of this library, which stays loaded until the process ends.
#[cfg(windows)]
fn pinned_module() -> Option<kernel32::Module> {
    const GET_MODULE_HANDLE_EX_FLAG_PIN: u32 = 1;
    const GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS: u32 = 4;
    let flags = GET_MODULE_HANDLE_EX_FLAG_PIN | GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS;
    let mut module = std::ptr::null_mut();
    // SAFETY: with FROM_ADDRESS the name is an address, which is one of ours; the system writes the handle.
    let known =
        unsafe { kernel32::GetModuleHandleExW(flags, own_address().cast(), &mut module) } != 0;
    known.then_some(module)
}

/// Functions of Windows.
#[cfg(windows)]
#[allow(non_snake_case)] // Windows' names
mod kernel32 {
    use std::ffi::{c_char, c_int, c_void};

    /// `HANDLE`, of modules and processes.
    pub type Module = *mut c_void;

    /// `MEMORY_BASIC_INFORMATION`.
    #[repr(C)]
    pub struct Region {
        pub base: usize,
        _allocation: usize,
        _allocation_protection: u32,
        pub size: usize,
        _state: u32,
        pub protection: u32,
        _kind: u32,
    }

    #[link(name = "kernel32")]
    unsafe extern "system" {
        pub fn GetModuleHandleExW(flags: u32, name: *const u16, module: *mut Module) -> c_int;
        pub fn GetModuleFileNameW(module: Module, name: *mut u16, size: u32) -> u32;
        pub fn MultiByteToWideChar(
            code_page: u32,
            flags: u32,
            text: *const c_char,
            bytes: c_int,
            wide: *mut u16,
            size: c_int,
        ) -> c_int;
        pub fn VirtualQuery(address: usize, region: *mut Region, size: usize) -> usize;
        pub fn GetCurrentProcess() -> Module;
        pub fn ReadProcessMemory(
            process: Module,
            address: usize,
            to: *mut u8,
            size: usize,
            read: *mut usize,
        ) -> c_int;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_own_file_is_this_program() {
        assert_eq!(own_file(), std::env::current_exe().ok());
    }

    #[test]
    fn paths_keep_what_the_engine_passes() {
        // SAFETY: literals.
        let path = |text: &CStr| unsafe { path_from(text.as_ptr()) };
        assert_eq!(path(c""), PathBuf::new());
        assert_eq!(path(c"a/b c"), PathBuf::from("a/b c"));
        #[cfg(unix)]
        assert_eq!(path(c"\xe9").as_os_str().as_encoded_bytes(), b"\xe9");
        // in western Europe's code page, which `./test windows` sets
        #[cfg(windows)]
        assert_eq!(path(c"\xe9\x80"), PathBuf::from("\u{e9}\u{20ac}"));
    }

    #[test]
    #[cfg(unix)]
    fn executable_mappings_are_code() {
        let maps = "\
55d0a0000000-55d0a0001000 r--p 00000000 fe:01 1234   /usr/lib/ioquake3/ioquake3
55d0a0001000-55d0a0003000 r-xp 00001000 fe:01 1234   /usr/lib/ioquake3/ioquake3
nonsense
7ffd00000000-7ffd00021000 rw-p 00000000 00:00 0      [stack]
ffffffffff600000-ffffffffff601000 --xp 00000000 00:00 0 [vsyscall]";
        assert_eq!(
            code_in(maps),
            [
                0x55d0_a000_1000..0x55d0_a000_3000,
                0xffff_ffff_ff60_0000..0xffff_ffff_ff60_1000
            ]
        );
        assert!(code_in("").is_empty());
    }

    #[test]
    #[cfg(any(target_os = "linux", windows))]
    fn own_code_and_stack_are_readable() {
        let function = read_memory as *const ();
        let code = code();
        assert!(code.iter().any(|range| range.contains(&function.addr())));
        let words = [1usize, 2, 3];
        assert!(
            !code
                .iter()
                .any(|range| range.contains(&words.as_ptr().addr()))
        );
        let mut bytes = [0; 3 * size_of::<usize>()];
        let length = read_memory(words.as_ptr().addr(), &mut bytes);
        assert_eq!(length, bytes.len());
        let (copy, _) = bytes.as_chunks();
        assert_eq!([copy[0], copy[1], copy[2]].map(usize::from_ne_bytes), words);
        assert_eq!(read_memory(0, &mut bytes), 0);
    }
}
