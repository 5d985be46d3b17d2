//! A window of a front end: its Vulkan functions, without Vulkan types.

use std::any::Any;
use std::ffi::{CStr, CString, c_void};
use std::sync::Arc;

use ash::vk::{self, Handle};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::error::{Context, Error};
use super::instance::{SurfaceSource, system_loader};

/// Makes a surface for an instance: `VkInstance` in, `VkSurfaceKHR` out, both as integers.
pub type CreateSurface = Box<dyn FnMut(u64) -> Result<u64, String>>;

/// A window to present to.
pub struct Window {
    get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    extensions: Vec<CString>,
    create: CreateSurface,
    /// What must outlive the surface.
    owner: Option<Box<dyn Any>>,
}

impl Window {
    /// A window by its handles. The renderer keeps it until its surface is destroyed.
    ///
    /// # Errors
    /// There is no Vulkan loader, or Vulkan does not support the window system.
    pub fn of<W>(window: Arc<W>) -> Result<Self, Error>
    where
        W: HasDisplayHandle + HasWindowHandle + 'static,
    {
        let entry = system_loader()?;
        let display = (window.display_handle())
            .map_err(|e| Error::Surface(e.to_string()))?
            .as_raw();
        let extensions = ash_window::enumerate_required_extensions(display)
            .context("extensions of the window system")?
            .iter()
            // SAFETY: ash-window returns static names that end in NUL.
            .map(|name| unsafe { CStr::from_ptr(*name) }.to_owned())
            .collect();
        let (loader, shown) = (entry.clone(), Arc::clone(&window));
        let create = move |instance: u64| {
            let handle = shown.window_handle().map_err(|e| e.to_string())?.as_raw();
            let instance = vk::Instance::from_raw(instance);
            // SAFETY: the caller passes a live instance of this loader.
            let instance = unsafe { ash::Instance::load(loader.static_fn(), instance) };
            // SAFETY: the handles are those of a window that `owner` keeps; the instance has the extensions.
            unsafe { ash_window::create_surface(&loader, &instance, display, handle, None) }
                .map(Handle::as_raw)
                .map_err(|e| format!("the window's surface: {e}"))
        };
        Ok(Self {
            get_instance_proc_addr: entry.static_fn().get_instance_proc_addr,
            extensions,
            create: Box::new(create),
            owner: Some(Box::new((window, entry))),
        })
    }

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
            owner: None,
        })
    }

    /// What must outlive the device.
    pub(crate) fn take_owner(&mut self) -> Option<Box<dyn Any>> {
        self.owner.take()
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
