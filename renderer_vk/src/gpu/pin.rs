//! Keeps the driver loaded until the process ends.
//!
//! The Vulkan loader unloads a driver with its last instance. Some drivers (seen: NVIDIA 580) allocate static
//! thread-local storage of the process at each load and do not free it, so that the loader fails to load any driver
//! after about thirty times. Such a driver consists of several libraries; pinning only one of them would run its
//! destructors twice. Engines unload the renderer at every `vid_restart`, so that long sessions reach the limit.

use ash::vk;

/// Pins the library of `function` and every loaded Vulkan driver: libraries that export the entry point of the loader's
/// driver interface. No effect on systems without `/proc`, where drivers may be unloaded.
#[cfg(unix)]
pub(crate) fn pin_drivers(function: vk::PFN_vkQueueSubmit) {
    use libloading::os::unix::{Library, RTLD_NOW};
    use std::collections::BTreeSet;
    use std::os::unix::ffi::OsStrExt;

    /// Opens only libraries that are already loaded.
    const RTLD_NOLOAD: i32 = 4;
    const ENTRY_POINT: &[u8] = b"vk_icdGetInstanceProcAddr\0";

    let Ok(maps) = std::fs::read("/proc/self/maps") else {
        return; // no `/proc`
    };
    let own = mapped_file(&maps, function as usize as u64);
    let files: BTreeSet<&[u8]> = mappings(&maps).map(|(_, _, file)| file).collect();
    for file in files {
        let path = std::ffi::OsStr::from_bytes(file);
        // SAFETY: the library is in memory already, so no initializer runs.
        let Ok(library) = (unsafe { Library::open(Some(path), RTLD_NOW | RTLD_NOLOAD) }) else {
            continue; // not a library
        };
        // SAFETY: the symbol is looked up, never called.
        let driver = unsafe { library.get::<*const ()>(ENTRY_POINT) }.is_ok();
        if driver || own == Some(file) {
            std::mem::forget(library); // never closed
        }
    }
}

/// On other systems the loader manages drivers. Windows has no such limit: it allocates the thread-local storage of a
/// library when it loads it.
#[cfg(not(unix))]
pub(crate) fn pin_drivers(_function: vk::PFN_vkQueueSubmit) {}

/// The mapped files of a process's memory map, with first and last address. Lines of the map are `from-to permissions
/// offset device inode path`, with hexadecimal addresses.
#[cfg(unix)]
fn mappings(maps: &[u8]) -> impl Iterator<Item = (u64, u64, &[u8])> {
    let hexadecimal =
        |digits: &[u8]| u64::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok();
    maps.split(|&b| b == b'\n').filter_map(move |line| {
        let mut range = line.split(|&b| b == b' ').next()?.split(|&b| b == b'-');
        let (from, to) = (hexadecimal(range.next()?)?, hexadecimal(range.next()?)?);
        let path = line.get(line.iter().position(|&b| b == b'/')?..)?;
        Some((from, to, path))
    })
}

/// The file that is mapped at `address`.
#[cfg(unix)]
fn mapped_file(maps: &[u8], address: u64) -> Option<&[u8]> {
    mappings(maps)
        .find(|(from, to, _)| (*from..*to).contains(&address))
        .map(|(_, _, file)| file)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::mapped_file;

    #[test]
    fn finds_the_file_by_an_address_in_it() {
        let maps = b"00400000-0045c000 r-xp 00000000 fe:00 1 /usr/bin/a\n\
            7f0000000000-7f0000001000 rw-p 00000000 00:00 0\n\
            7f0000001000-7f0000003000 r-xp 00001000 fe:00 2    /usr/lib/a driver.so\n";
        assert_eq!(
            mapped_file(maps, 0x7f00_0000_2fff),
            Some(&b"/usr/lib/a driver.so"[..])
        );
        assert_eq!(mapped_file(maps, 0x40_0000), Some(&b"/usr/bin/a"[..]));
        assert_eq!(mapped_file(maps, 0x7f00_0000_0800), None);
        assert_eq!(mapped_file(maps, 0x7f00_0000_3000), None);
        assert_eq!(mapped_file(b"nonsense\n-\n", 1), None);
    }

    #[test]
    fn finds_this_program() {
        let maps = std::fs::read("/proc/self/maps").expect("Linux has it");
        let here = finds_this_program as fn() as usize as u64;
        let exe = std::env::current_exe().expect("a path");
        use std::os::unix::ffi::OsStrExt;
        assert_eq!(mapped_file(&maps, here), Some(exe.as_os_str().as_bytes()));
    }
}
