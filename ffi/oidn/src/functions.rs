//! The functions of `OpenImageDenoise/oidn.h` that a filter needs.

use std::ffi::{c_char, c_int, c_void};

use libloading::Library;

/// A device or a filter of the library.
pub enum Raw {}

/// C's `bool`.
pub type Bool = bool;

macro_rules! functions {
    ($( $field:ident = $($symbol:literal)|+ : fn($($arg:ty),*) $(-> $ret:ty)?; )*) => {
        /// Functions of a library that is never closed.
        #[derive(Clone, Copy)]
        pub struct Functions { $( pub $field: unsafe extern "C" fn($($arg),*) $(-> $ret)? ),* }

        impl Functions {
            /// Finds each under the first of its names that exists.
            ///
            /// # Errors
            /// The first name of a function that is absent.
            pub fn of(library: &Library) -> Result<Self, &'static str> {
                $(
                    let names = [$($symbol),+];
                    let found = names.into_iter().find_map(|name| {
                        // SAFETY: the signature is the one of the header, of version 1 and of version 2.
                        unsafe { library.get::<unsafe extern "C" fn($($arg),*) $(-> $ret)?>(name.as_bytes()) }.ok()
                    });
                    let $field = *found.ok_or(names[0])?;
                )*
                Ok(Self { $($field),* })
            }
        }
    };
}

functions! {
    new_device = "oidnNewDevice": fn(c_int) -> *mut Raw;
    commit_device = "oidnCommitDevice": fn(*mut Raw);
    release_device = "oidnReleaseDevice": fn(*mut Raw);
    device_error = "oidnGetDeviceError": fn(*mut Raw, *mut *const c_char) -> c_int;
    new_filter = "oidnNewFilter": fn(*mut Raw, *const c_char) -> *mut Raw;
    // filter, name, address, format, width, height, and three strides that 0 leaves to the library
    set_image = "oidnSetSharedFilterImage": fn(*mut Raw, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);
    // version 2 has renamed it
    set_bool = "oidnSetFilterBool" | "oidnSetFilter1b": fn(*mut Raw, *const c_char, Bool);
    commit_filter = "oidnCommitFilter": fn(*mut Raw);
    execute_filter = "oidnExecuteFilter": fn(*mut Raw);
    release_filter = "oidnReleaseFilter": fn(*mut Raw);
}
