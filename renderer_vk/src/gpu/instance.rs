//! The Vulkan instance, its validation messages and the window's surface.

use std::ffi::{CStr, CString, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::{ext, khr, vk};

use super::error::{Context, Error};

/// Makes the surface of a window for an instance, or returns an error message.
pub type CreateSurface<'a> = &'a mut dyn FnMut(vk::Instance) -> Result<vk::SurfaceKHR, String>;

/// Target of presentation.
pub enum SurfaceSource<'a> {
    /// None: no window; the loader is the system's `libvulkan`.
    Headless,
    /// A window of the caller, with its Vulkan loader. Made by [`SurfaceSource::window`].
    Window(WindowSource<'a>),
}

/// The Vulkan data of a window; see [`SurfaceSource::window`].
pub struct WindowSource<'a> {
    get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    extensions: Vec<CString>,
    create: CreateSurface<'a>,
}

impl<'a> SurfaceSource<'a> {
    /// A window by the loader's entry point, the instance extensions that its surfaces need, and a function that makes
    /// the surface. The device owns the surface and must be dropped before the window is destroyed.
    ///
    /// # Safety
    /// `get_instance_proc_addr` must be the entry point of a Vulkan loader that stays in memory for as long as the
    /// device exists, and `create` must return a surface made with the instance that it is given.
    pub unsafe fn window(
        get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
        extensions: Vec<CString>,
        create: CreateSurface<'a>,
    ) -> Self {
        Self::Window(WindowSource {
            get_instance_proc_addr,
            extensions,
            create,
        })
    }
}

/// Messages of the validation layer, in the order of their arrival.
pub(crate) type Messages = Mutex<Vec<String>>;

/// Owner of the instance and of its debug messenger and surface.
pub(crate) struct Instance {
    pub raw: ash::Instance,
    pub debug_utils: bool,
    pub messages: Arc<Messages>,
    pub surface: Option<(khr::surface::Instance, vk::SurfaceKHR)>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    // Last: the loader must outlive all other fields.
    _entry: ash::Entry,
}

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

impl Instance {
    /// Makes the instance and, with a window, its surface.
    pub fn new(app_name: &str, validation: bool, source: SurfaceSource<'_>) -> Result<Self, Error> {
        let (entry, mut extensions, window) = load(source)?;
        check_version(&entry)?;
        // SAFETY: no instance is needed for this call.
        let available = unsafe { entry.enumerate_instance_extension_properties(None) }
            .context("vkEnumerateInstanceExtensionProperties")?;
        for wanted in &extensions {
            if !has(&available, wanted) {
                return Err(Error::Surface(format!(
                    "the Vulkan loader lacks {}, which the window needs",
                    wanted.to_string_lossy()
                )));
            }
        }
        let debug_utils = has(&available, ext::debug_utils::NAME);
        if debug_utils && extensions.iter().all(|e| **e != *ext::debug_utils::NAME) {
            extensions.push(ext::debug_utils::NAME.to_owned());
        }
        // colour spaces of more than white, which a window may offer
        let color_spaces = ext::swapchain_colorspace::NAME;
        if window.is_some() && has(&available, color_spaces) {
            extensions.push(color_spaces.to_owned());
        }
        let validates = validation && has_validation_layer(&entry)?;
        let synchronization = validates && validates_synchronization(&entry);
        if synchronization {
            extensions.push(ext::validation_features::NAME.to_owned());
        }
        let messages = Arc::new(Messages::default());
        let mut debug_info = messenger_info(&messages);
        let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        // No NUL is left.
        let app_name = CString::new(app_name.replace('\0', "")).unwrap_or_default();
        let app = vk::ApplicationInfo::default()
            .application_name(&app_name)
            .engine_name(c"Relight")
            .api_version(vk::API_VERSION_1_2);
        let layers = [VALIDATION_LAYER.as_ptr()];
        let pointers: Vec<_> = extensions.iter().map(|e| e.as_ptr()).collect();
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&app)
            .enabled_extension_names(&pointers)
            .enabled_layer_names(if validates { &layers } else { &[] });
        if synchronization {
            info = info.push_next(&mut features);
        }
        let listens = debug_utils && validates;
        if listens {
            // Receives messages of the layer during the instance's creation and destruction.
            info = info.push_next(&mut debug_info);
        }
        // SAFETY: every pointer in `info` is valid in this function, names are NUL-terminated.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
                Error::NoDevice("the loader found no driver".to_owned())
            }
            result => Error::Vulkan {
                call: "vkCreateInstance",
                result,
            },
        })?;
        let mut instance = Self {
            raw,
            debug_utils,
            messages,
            surface: None,
            messenger: None,
            _entry: entry.clone(),
        };
        if listens {
            let functions = ext::debug_utils::Instance::new(&entry, &instance.raw);
            let info = messenger_info(&instance.messages);
            // SAFETY: the instance is alive; the user data is the `Arc` held beside the messenger.
            let messenger = unsafe { functions.create_debug_utils_messenger(&info, None) }
                .context("vkCreateDebugUtilsMessengerEXT")?;
            instance.messenger = Some((functions, messenger));
        }
        if let Some(create) = window {
            let surface = create(instance.raw.handle()).map_err(Error::Surface)?;
            let functions = khr::surface::Instance::new(&entry, &instance.raw);
            instance.surface = Some((functions, surface));
        }
        Ok(instance)
    }
}

/// The system's Vulkan loader.
///
/// # Errors
/// There is none.
pub fn system_loader() -> Result<ash::Entry, Error> {
    // SAFETY: opening the loader runs its initializers; the library is a Vulkan loader by its name.
    unsafe { ash::Entry::load() }.map_err(|e| {
        Error::Loader(format!(
            "{e}; is a Vulkan driver with its loader installed?"
        ))
    })
}

/// The loader, the instance extensions of the window, and the function that makes its surface.
fn load(
    source: SurfaceSource<'_>,
) -> Result<(ash::Entry, Vec<CString>, Option<CreateSurface<'_>>), Error> {
    match source {
        SurfaceSource::Headless => Ok((system_loader()?, Vec::new(), None)),
        SurfaceSource::Window(window) => {
            let functions = ash::StaticFn {
                get_instance_proc_addr: window.get_instance_proc_addr,
            };
            // SAFETY: the maker of the source promised a loader's entry point that stays in memory.
            let entry = unsafe { ash::Entry::from_static_fn(functions) };
            Ok((entry, window.extensions, Some(window.create)))
        }
    }
}

fn check_version(entry: &ash::Entry) -> Result<(), Error> {
    // SAFETY: no instance is needed for this call.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .context("vkEnumerateInstanceVersion")?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < vk::API_VERSION_1_2 {
        return Err(Error::Loader(format!(
            "it offers Vulkan {}.{}, 1.2 is needed",
            vk::api_version_major(version),
            vk::api_version_minor(version)
        )));
    }
    Ok(())
}

fn has(list: &[vk::ExtensionProperties], name: &CStr) -> bool {
    list.iter()
        .any(|e| e.extension_name_as_c_str().is_ok_and(|n| n == name))
}

/// Whether the validation layer is installed; logs a warning if it is not.
fn has_validation_layer(entry: &ash::Entry) -> Result<bool, Error> {
    // SAFETY: no instance is needed for this call.
    let found = unsafe { entry.enumerate_instance_layer_properties() }
        .context("vkEnumerateInstanceLayerProperties")?
        .iter()
        .any(|l| l.layer_name_as_c_str().is_ok_and(|n| n == VALIDATION_LAYER));
    if !found {
        log::warn!(
            "Vulkan validation was asked for, but {} is not installed",
            VALIDATION_LAYER.to_string_lossy()
        );
    }
    Ok(found)
}

/// Whether the installed validation layer supports synchronization validation.
fn validates_synchronization(entry: &ash::Entry) -> bool {
    // SAFETY: no instance is needed; the layer was found.
    let of_layer = unsafe { entry.enumerate_instance_extension_properties(Some(VALIDATION_LAYER)) };
    // A layer that does not say what it supports counts as without.
    has(
        &of_layer.unwrap_or_default(),
        ext::validation_features::NAME,
    )
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((functions, surface)) = self.surface.take() {
            // SAFETY: the surface came from this instance and its swapchains are gone with the device.
            unsafe { functions.destroy_surface(surface, None) };
        }
        if let Some((functions, messenger)) = self.messenger.take() {
            // SAFETY: made from this instance, destroyed once.
            unsafe { functions.destroy_debug_utils_messenger(messenger, None) };
        }
        // SAFETY: every object made from the instance is gone; this is the only owner.
        unsafe { self.raw.destroy_instance(None) };
    }
}

fn messenger_info(messages: &Arc<Messages>) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(
            vk::DebugUtilsMessageSeverityFlagsEXT::ERROR
                | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
        )
        // Without PERFORMANCE: it warns about copies in the layout GENERAL, which is the rule here.
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(messages).cast_mut().cast())
}

/// Stores and logs one message of the validation layer.
///
/// # Safety
/// Called by the loader with valid data; `user_data` is the [`Messages`] of a live [`Instance`].
unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    if data.is_null() || user_data.is_null() {
        return vk::FALSE;
    }
    // SAFETY: the loader passes valid data for the length of the call.
    let data = unsafe { &*data };
    // SAFETY: a message, when present, is NUL-terminated.
    let text = unsafe { data.message_as_c_str() }
        .map_or_else(String::new, |t| t.to_string_lossy().into_owned());
    if severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) {
        log::error!("{text}");
    } else {
        log::warn!("{text}");
    }
    // SAFETY: the instance holds the `Arc` until after the messenger is destroyed.
    let messages = unsafe { &*user_data.cast::<Messages>() };
    messages
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .push(text);
    vk::FALSE
}
