//! Errors of the GPU layer.

use ash::vk;

/// A failure of the GPU layer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The Vulkan loader library could not be opened or is older than 1.2.
    #[error("no usable Vulkan loader: {0}")]
    Loader(String),
    /// No device meets the requirements; the text names each device and its missing features.
    #[error("no usable Vulkan device: {0}")]
    NoDevice(String),
    /// The window system provided no surface, or a required instance extension is absent.
    #[error("no Vulkan surface: {0}")]
    Surface(String),
    /// The allocator has no memory for `what`.
    #[error("out of GPU memory for `{what}` ({bytes} bytes): {reason}")]
    OutOfMemory {
        /// Name of the object to be made.
        what: String,
        /// Its size.
        bytes: u64,
        /// Message of the allocator.
        reason: String,
    },
    /// The device was lost; none of its objects is usable.
    #[error("the Vulkan device was lost in {0}")]
    DeviceLost(&'static str),
    /// A table of limited size is full.
    #[error("the device allows {limit} {what}, all are in use")]
    Full {
        /// Name of the table.
        what: &'static str,
        /// Limit of the device.
        limit: u32,
    },
    /// The device or the format does not support the request.
    #[error("{name}: {what} is not supported by {device}")]
    Unsupported {
        /// Name of the object to be made.
        name: String,
        /// The missing feature.
        what: String,
        /// The device's name.
        device: String,
    },
    /// The caller passed inconsistent arguments, such as a range outside of a buffer.
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

/// Converts a Vulkan result to an [`Error`] that names the call.
pub(crate) trait Context<T> {
    /// Names the call.
    fn context(self, call: &'static str) -> Result<T, Error>;
}

impl<T> Context<T> for Result<T, vk::Result> {
    fn context(self, call: &'static str) -> Result<T, Error> {
        self.map_err(|result| match result {
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost(call),
            result => Error::Vulkan { call, result },
        })
    }
}
