//! A window of a front end: its Vulkan functions, without Vulkan types.

use std::ffi::{CString, c_void};

use ash::vk::{self, Handle};

use super::instance::SurfaceSource;

/// Makes a surface for an instance: `VkInstance` in, `VkSurfaceKHR` out, both as integers.
pub type CreateSurface = Box<dyn FnMut(u64) -> Result<u64, String>>;

/// A window to present to.
pub struct Window {
    get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    extensions: Vec<CString>,
    create: CreateSurface,
}

impl Window {
    /// `get_instance_proc_addr` is the loader's entry point, `extensions` the instance extensions that the window's
    /// surface needs.
    ///
    /// # Safety
    /// `get_instance_proc_addr` must be `vkGetInstanceProcAddr` of a Vulkan loader that stays in memory for as long
    /// as the renderer exists; `create` must return a surface made with the instance that it is given; the window
    /// must outlive the renderer.
    pub unsafe fn new(
        get_instance_proc_addr: *const c_void,
        extensions: Vec<CString>,
        create: CreateSurface,
    ) -> Option<Self> {
        if get_instance_proc_addr.is_null() {
            return None;
        }
        Some(Self {
            // SAFETY: the caller promises that the pointer is this function; it is not null.
            get_instance_proc_addr: unsafe {
                std::mem::transmute::<*const c_void, vk::PFN_vkGetInstanceProcAddr>(
                    get_instance_proc_addr,
                )
            },
            extensions,
            create,
        })
    }

    /// Passes the window to `with` as the source of a device's surface.
    pub(crate) fn source<T>(mut self, with: impl FnOnce(SurfaceSource<'_>) -> T) -> T {
        let mut create =
            |instance: vk::Instance| (self.create)(instance.as_raw()).map(vk::SurfaceKHR::from_raw);
        // SAFETY: the contract of `SurfaceSource::window` is that of `Window::new`, whose caller fulfilled it.
        with(unsafe {
            SurfaceSource::window(self.get_instance_proc_addr, self.extensions, &mut create)
        })
    }
}
