//! Failures of the engine's calls, in the engine's terms.

use crate::engine::error_level;
use renderer_vk::{Error, GpuError};
use std::ffi::c_int;

/// A failure that must be reported to the engine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// One of [`error_level`].
    pub level: c_int,
    /// Message for the player: what failed, where, and if possible what to do.
    pub message: String,
    /// The renderer is unusable: the next registration makes a new one.
    pub discard: bool,
}

impl Failure {
    /// Returns to the menu.
    pub fn drop(message: impl ToString) -> Self {
        Self {
            level: error_level::DROP,
            message: message.to_string(),
            discard: false,
        }
    }

    /// Ends the process.
    pub fn fatal(message: impl ToString) -> Self {
        Self {
            level: error_level::FATAL,
            message: message.to_string(),
            discard: false,
        }
    }
}

/// An error of the renderer in the engine's terms. After a device error, the renderer is discarded.
impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let discard = match &error {
            Error::Gpu(error) => !matches!(
                error,
                GpuError::Full { .. } | GpuError::Unsupported { .. } | GpuError::Usage { .. }
            ),
            _ => false,
        };
        Failure {
            discard,
            ..Failure::drop(error)
        }
    }
}
