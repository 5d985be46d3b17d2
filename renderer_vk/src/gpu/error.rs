//! What can go wrong between the renderer and the driver.

use ash::vk;

/// A failure of the GPU layer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The Vulkan loader library could not be opened or is older than 1.2.
    #[error("no usable Vulkan loader: {0}")]
    Loader(String),
    /// No device meets the requirements; the text names each device and what it lacks.
    #[error("no usable Vulkan device: {0}")]
    NoDevice(String),
    /// The window system did not give a surface, or an instance extension that it needs is absent.
    #[error("no Vulkan surface: {0}")]
    Surface(String),
    /// Memory for `what` is exhausted.
    #[error("out of GPU memory for `{what}` ({bytes} bytes): {reason}")]
    OutOfMemory {
        /// Name of the object that was to be made.
        what: String,
        /// Its size.
        bytes: u64,
        /// The allocator's words.
        reason: String,
    },
    /// The device stopped answering; every object of it is dead.
    #[error("the Vulkan device was lost in {0}")]
    DeviceLost(&'static str),
    /// A table that the device limits is full.
    #[error("the device allows {limit} {what}, all are in use")]
    Full {
        /// What is full.
        what: &'static str,
        /// How many the device allows.
        limit: u32,
    },
    /// The device or the format cannot do what was asked.
    #[error("{name}: {what} is not supported by {device}")]
    Unsupported {
        /// The object that was to be made.
        name: String,
        /// The missing ability.
        what: String,
        /// The device's name.
        device: String,
    },
    /// The caller asked for something that contradicts itself, such as a range outside a buffer.
    #[error("{name}: {what}")]
    Usage {
        /// The object concerned.
        name: String,
        /// The contradiction.
        what: String,
    },
    /// Any other error code of a Vulkan call.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The Vulkan function.
        call: &'static str,
        /// Its result.
        result: vk::Result,
    },
}

/// Turns a Vulkan result into an [`Error`] that names the call.
pub(crate) trait Context<T> {
    /// Names the call.
    fn context(self, call: &'static str) -> Result<T, Error>;
}

impl<T> Context<T> for Result<T, vk::Result> {
    fn context(self, call: &'static str) -> Result<T, Error> {
        self.map_err(|result| match result {
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost(call),
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                Error::OutOfMemory {
                    what: call.to_owned(),
                    bytes: 0,
                    reason: result.to_string(),
                }
            }
            result => Error::Vulkan { call, result },
        })
    }
}
