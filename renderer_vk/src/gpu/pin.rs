//! Keeps the driver in memory for as long as the process lives.
//!
//! The Vulkan loader unloads a driver with its last instance. Some drivers (seen: NVIDIA 580) take a piece of the
//! process's static thread-local storage each time they are loaded and do not give it back, so that after about thirty
//! times the loader finds no driver any more; and they consist of several libraries of which one, left loaded alone,
//! is torn down twice. An engine unloads the renderer at every `vid_restart`, so a long session gets there.

use ash::vk;

/// Pins the library that `function` lives in and every Vulkan driver in memory: what exports the entry point that the
/// loader's interface demands of drivers. Without effect where the system does not tell what is in memory (it is asked
/// through `/proc`): then nothing is lost but the driver's place there.
#[cfg(unix)]
pub(crate) fn pin_drivers(function: vk::PFN_vkQueueSubmit) {
    use libloading::os::unix::{Library, RTLD_NOW};
    use std::collections::BTreeSet;
    use std::os::unix::ffi::OsStrExt;

    /// Finds what is loaded; loads nothing.
    const RTLD_NOLOAD: i32 = 4;
    const ENTRY_POINT: &[u8] = b"vk_icdGetInstanceProcAddr\0";

    let Ok(maps) = std::fs::read("/proc/self/maps") else {
        return;
    };
    let own = mapped_file(&maps, function as usize as u64);
    let files: BTreeSet<&[u8]> = mappings(&maps).map(|(_, _, file)| file).collect();
    for file in files {
        let path = std::ffi::OsStr::from_bytes(file);
        // SAFETY: the library is in memory already, so no initializer runs.
        let Ok(library) = (unsafe { Library::open(Some(path), RTLD_NOW | RTLD_NOLOAD) }) else {
            continue; // no library
        };
        // SAFETY: the symbol is looked for, never called.
        let driver = unsafe { library.get::<*const ()>(ENTRY_POINT) }.is_ok();
        if driver || own == Some(file) {
            std::mem::forget(library); // never closed
        }
    }
}

/// Elsewhere drivers are left to the loader.
#[cfg(not(unix))]
pub(crate) fn pin_drivers(_function: vk::PFN_vkQueueSubmit) {}

/// The files of a process's memory map with where they are mapped, from and to. The map has lines of `from-to permissions
/// offset device inode path`, the addresses in hexadecimal.
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
        let maps = std::fs::read("/proc/self/maps").expect("Linux tells");
        let here = finds_this_program as fn() as usize as u64;
        let exe = std::env::current_exe().expect("a path");
        use std::os::unix::ffi::OsStrExt;
        assert_eq!(mapped_file(&maps, here), Some(exe.as_os_str().as_bytes()));
    }
}
