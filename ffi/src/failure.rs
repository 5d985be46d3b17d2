//! Why a call of the engine fails, as the engine has to hear it.

use crate::engine::error_level;
use renderer_vk::{Error, GpuError};
use std::ffi::c_int;

/// Why a call cannot do what the engine asked, in a way that the engine has to hear about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// One of [`error_level`].
    pub level: c_int,
    /// For the player: what failed, where, and if possible what to do.
    pub message: String,
    /// The renderer did not survive it: the next registration makes a new one.
    pub discard: bool,
}

impl Failure {
    /// Back to the menu.
    pub fn drop(message: impl ToString) -> Self {
        Self {
            level: error_level::DROP,
            message: message.to_string(),
            discard: false,
        }
    }

    /// The process has to end.
    pub fn fatal(message: impl ToString) -> Self {
        Self {
            level: error_level::FATAL,
            message: message.to_string(),
            discard: false,
        }
    }
}

/// An error of the renderer as the engine has to hear it. What the device did not survive takes the renderer with it.
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
