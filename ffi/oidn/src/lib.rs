//! Open Image Denoise, Intel's library of denoising filters, found at run time: versions 1.4 and 2.
//!
//! Nothing is linked, and nothing is needed to build: [`Oidn::load`] opens the library of the system or a given file.
//! The filter runs on the CPU, whose device every version has and which reads the caller's memory.

mod functions;

use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::ptr::{self, NonNull};

use functions::{Bool, Functions, Raw};

/// Colour or direction of a pixel.
pub type Texel = [f32; 3];

/// Why a picture was not denoised.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No library under any of its names.
    #[error("{tried}")]
    Absent {
        /// Each name with the system's reason.
        tried: String,
    },
    /// A file that cannot be loaded.
    #[error("{}: cannot be loaded: {reason}", file.display())]
    Unusable {
        /// The given file.
        file: PathBuf,
        /// The system's reason.
        reason: String,
    },
    /// A library without one of the functions.
    #[error("{library}: no function {function}; Open Image Denoise 1.4 or later is needed")]
    Function {
        /// Name or file of the library.
        library: String,
        /// Name of the function.
        function: &'static str,
    },
    /// An error that the library reports.
    #[error("Open Image Denoise: {0}")]
    Reported(String),
    /// Pictures whose sizes differ.
    #[error("a picture of {width}x{height} pixels comes with {texels} values")]
    Size {
        /// Pixels.
        width: usize,
        /// Pixels.
        height: usize,
        /// Values of the picture.
        texels: usize,
    },
}

/// What the surfaces in a picture are, of the picture's size, rows from the top.
#[derive(Clone, Copy, Debug)]
pub struct Guides<'a> {
    /// Reflectance, 0 to 1.
    pub albedo: &'a [Texel],
    /// Unit vectors in any space; zero where there is no surface.
    pub normal: &'a [Texel],
    /// They are free of noise: the filter then keeps all of their edges.
    pub clean: bool,
}

/// The loaded library.
pub struct Oidn {
    functions: Functions,
}

/// Names of the library, the newest first.
#[cfg(windows)]
const NAMES: [&str; 1] = ["OpenImageDenoise.dll"];
#[cfg(target_os = "macos")]
const NAMES: [&str; 3] = [
    "libOpenImageDenoise.2.dylib",
    "libOpenImageDenoise.1.dylib",
    "libOpenImageDenoise.dylib",
];
#[cfg(all(unix, not(target_os = "macos")))]
const NAMES: [&str; 3] = [
    "libOpenImageDenoise.so.2",
    "libOpenImageDenoise.so.1",
    "libOpenImageDenoise.so",
];

/// `OIDN_DEVICE_TYPE_CPU`, `OIDN_FORMAT_FLOAT3`.
const CPU: c_int = 1;
const FLOAT3: c_int = 3;

fn open(name: &std::ffi::OsStr) -> Result<libloading::Library, String> {
    // SAFETY: the initialisers of Open Image Denoise and of its scheduler are safe at load time.
    unsafe { libloading::Library::new(name) }.map_err(|error| error.to_string())
}

impl Oidn {
    /// Loads the given file, or the system's library. It stays loaded until the process ends.
    ///
    /// # Errors
    /// [`Error::Absent`], [`Error::Unusable`], [`Error::Function`].
    pub fn load(file: Option<&Path>) -> Result<Self, Error> {
        if let Some(file) = file {
            let library = open(file.as_os_str()).map_err(|reason| Error::Unusable {
                file: file.to_owned(),
                reason,
            })?;
            return Self::from_library(library, &file.display().to_string());
        }
        Self::first_of(&NAMES)
    }

    fn first_of(names: &[&str]) -> Result<Self, Error> {
        let mut tried = Vec::new();
        for name in names {
            match open(name.as_ref()) {
                Ok(library) => return Self::from_library(library, name),
                Err(reason) if reason.contains(name) => tried.push(reason),
                Err(reason) => tried.push(format!("{name}: {reason}")),
            }
        }
        Err(Error::Absent {
            tried: tried.join("; "),
        })
    }

    fn from_library(library: libloading::Library, name: &str) -> Result<Self, Error> {
        let functions = Functions::of(&library).map_err(|function| Error::Function {
            library: name.to_owned(),
            function,
        })?;
        // never closed: its threads run on
        std::mem::forget(library);
        Ok(Self { functions })
    }

    /// Denoises a picture of linear colours of any brightness, rows from the top.
    ///
    /// # Errors
    /// [`Error::Size`], or [`Error::Reported`] with the library's message.
    pub fn denoise(
        &self,
        (width, height): (usize, usize),
        color: &[Texel],
        guides: Option<Guides<'_>>,
    ) -> Result<Vec<Texel>, Error> {
        let inputs = [
            (c"color", Some(color)),
            (c"albedo", guides.map(|g| g.albedo)),
            (c"normal", guides.map(|g| g.normal)),
        ];
        let inputs = inputs.into_iter().filter_map(|(name, p)| Some((name, p?)));
        for (_, picture) in inputs.clone() {
            check_size((width, height), picture)?;
        }
        let mut output = vec![[0.0; 3]; color.len()];
        let device = Device::new(&self.functions)?;
        let filter = device.filter()?;
        for (name, picture) in inputs {
            // The library only reads pictures under these names.
            filter.image(name, picture.as_ptr().cast_mut(), (width, height));
        }
        filter.image(c"output", output.as_mut_ptr(), (width, height));
        filter.set(c"hdr", true);
        filter.set(c"cleanAux", guides.is_some_and(|g| g.clean));
        filter.run()?;
        Ok(output)
    }
}

fn check_size((width, height): (usize, usize), picture: &[Texel]) -> Result<(), Error> {
    let texels = picture.len();
    if texels == 0 || width.checked_mul(height) != Some(texels) {
        return Err(Error::Size {
            width,
            height,
            texels,
        });
    }
    Ok(())
}

/// A device of the library.
struct Device<'a> {
    functions: &'a Functions,
    raw: NonNull<Raw>,
}

impl<'a> Device<'a> {
    fn new(functions: &'a Functions) -> Result<Self, Error> {
        // SAFETY: a type of device that the header names.
        let raw = unsafe { (functions.new_device)(CPU) };
        let raw = NonNull::new(raw).ok_or_else(|| reported(functions, ptr::null_mut()))?;
        let device = Self { functions, raw };
        // SAFETY: the device lives.
        unsafe { (functions.commit_device)(raw.as_ptr()) };
        device.check()?;
        Ok(device)
    }

    fn filter(&self) -> Result<Filter<'_>, Error> {
        // SAFETY: the device is committed; the name ends in zero.
        let raw = unsafe { (self.functions.new_filter)(self.raw.as_ptr(), c"RT".as_ptr()) };
        let raw = NonNull::new(raw).ok_or_else(|| reported(self.functions, self.raw.as_ptr()))?;
        Ok(Filter { device: self, raw })
    }

    /// The first error since the last call, if any.
    fn check(&self) -> Result<(), Error> {
        match error_of(self.functions, self.raw.as_ptr()) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        // SAFETY: the last reference; filters borrow the device.
        unsafe { (self.functions.release_device)(self.raw.as_ptr()) };
    }
}

/// A filter of a device.
struct Filter<'a> {
    device: &'a Device<'a>,
    raw: NonNull<Raw>,
}

impl Filter<'_> {
    /// Names memory of `width * height` texels, which must live until the filter has run.
    fn image(&self, name: &CStr, texels: *mut Texel, (width, height): (usize, usize)) {
        // SAFETY: the filter lives, the name ends in zero. The library keeps the address until the filter runs, in
        // `Oidn::denoise`, which holds all pictures and has checked their sizes.
        unsafe {
            (self.device.functions.set_image)(
                self.raw.as_ptr(),
                name.as_ptr(),
                texels.cast::<c_void>(),
                FLOAT3,
                width,
                height,
                0,
                0,
                0,
            );
        }
    }

    fn set(&self, name: &CStr, value: Bool) {
        // SAFETY: the filter lives, the name ends in zero. A version without this parameter ignores it.
        unsafe { (self.device.functions.set_bool)(self.raw.as_ptr(), name.as_ptr(), value) };
    }

    fn run(&self) -> Result<(), Error> {
        // SAFETY: the filter lives.
        unsafe { (self.device.functions.commit_filter)(self.raw.as_ptr()) };
        self.device.check()?;
        // SAFETY: the filter is committed, and its pictures live: see `image`.
        unsafe { (self.device.functions.execute_filter)(self.raw.as_ptr()) };
        self.device.check()
    }
}

impl Drop for Filter<'_> {
    fn drop(&mut self) {
        // SAFETY: the last reference.
        unsafe { (self.device.functions.release_filter)(self.raw.as_ptr()) };
    }
}

/// The error of a device, or of the thread without one; `None` without an error.
fn error_of(functions: &Functions, device: *mut Raw) -> Option<Error> {
    let mut message: *const c_char = ptr::null();
    // SAFETY: a live device or null, and a place for an address.
    let code = unsafe { (functions.device_error)(device, &raw mut message) };
    if code == 0 {
        return None;
    }
    if message.is_null() {
        return Some(Error::Reported(format!("error {code}")));
    }
    // SAFETY: a text that ends in zero and lives until the next call about this device.
    let message = unsafe { CStr::from_ptr(message) };
    Some(Error::Reported(message.to_string_lossy().into_owned()))
}

/// The error after a call that must have failed.
fn reported(functions: &Functions, device: *mut Raw) -> Error {
    let unknown = || Error::Reported("no device or filter, without a reason".to_owned());
    error_of(functions, device).unwrap_or_else(unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absent_library_is_named_with_the_reason() {
        let absent = Oidn::first_of(&["libno-such-denoiser.so.1", "libno-such-denoiser.so"]);
        let text = absent.err().expect("absent").to_string();
        for name in ["libno-such-denoiser.so.1", "libno-such-denoiser.so: "] {
            assert!(text.contains(name), "{text}");
        }
        let file = Path::new("/nowhere/libOpenImageDenoise.so");
        let text = Oidn::load(Some(file)).err().expect("absent").to_string();
        assert!(
            text.starts_with("/nowhere/libOpenImageDenoise.so: "),
            "{text}"
        );
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_library_of_something_else_is_refused() {
        // the C library
        let other = Oidn::load(Some(Path::new("libc.so.6")));
        let text = other.err().expect("no filter in it").to_string();
        assert!(
            text.contains("libc.so.6: no function oidnNewDevice"),
            "{text}"
        );
    }

    #[test]
    fn pictures_of_other_sizes_are_refused() {
        let picture = [[0.25; 3]; 64];
        assert!(check_size((8, 8), &picture).is_ok());
        for size in [(8, 9), (0, 0), (usize::MAX, 2)] {
            assert!(check_size(size, &picture).is_err(), "{size:?}");
        }
        assert!(check_size((0, 0), &[]).is_err());
    }
}
