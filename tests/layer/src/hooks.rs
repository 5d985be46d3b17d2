//! The layer's function for each of [`CALLS`](crate::calls::CALLS).

use std::ffi::c_void;

use ash::vk;

use crate::calls::{Call, all_calls};
use crate::{chain, create, devices, display, faults, memory, window};

/// A function.
pub struct Hook(pub *const c_void);

// SAFETY: any thread may call a function.
unsafe impl Sync for Hook {}

/// The layer's function: one that hands on any arguments, or one of its own.
macro_rules! hook {
    ($name:ident $any:ident) => {
        $any::<{ Call::$name as usize }> as *const c_void
    };
    ($name:ident ($own:expr)) => {
        $own as *const c_void
    };
}

macro_rules! table {
    ($($name:ident $errors:literal $hook:tt;)*) => {
        /// All of them, in the order of [`Call`].
        pub static HOOKS: &[Hook] = &[$(Hook(hook!($name $hook))),*];
    };
}

all_calls!(table);

/// Functions of so many arguments, with the handle first. Calling conventions pass every argument of Vulkan in a
/// register or a place of its own of 64 bits, so that the type of an argument does not matter to who hands it on.
macro_rules! hooks {
    ($($hook:ident ($($argument:ident),*);)*) => {$(
        /// # Safety
        /// That of the function `CALL`.
        unsafe extern "system" fn $hook<const CALL: usize>(handle: usize, $($argument: u64),*) -> vk::Result {
            let Some(chain) = chain::at(handle) else {
                return vk::Result::ERROR_INITIALIZATION_FAILED;
            };
            let struck = faults::strike(CALL, Some(&chain));
            if let faults::Strike::Instead(result) = struck {
                return result;
            }
            // SAFETY: the pointer is this function of the next layer, with so many arguments of 64 bits or less.
            let next = unsafe {
                std::mem::transmute::<*const c_void, unsafe extern "system" fn(usize, $($argument: u64),*) -> vk::Result>(
                    chain.below(CALL),
                )
            };
            // SAFETY: the caller's arguments; a physical device of ours as the driver's.
            let result = unsafe { next(devices::real(handle), $($argument),*) };
            match struck {
                faults::Strike::After(struck) if result == vk::Result::SUCCESS => struck,
                _ => result,
            }
        }
    )*};
}

hooks! {
    hook1();
    hook2(b);
    hook3(b, c);
    hook4(b, c, d);
    hook5(b, c, d, e);
    hook6(b, c, d, e, f);
    hook7(b, c, d, e, f, g);
    hook8(b, c, d, e, f, g, h);
}
