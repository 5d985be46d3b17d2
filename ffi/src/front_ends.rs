//! The list of front ends, and of engines that have none. This is the only place outside of the front ends that names
//! engines.

use crate::engine::FrontEnd;
use crate::{ioq3, openarena, quake3e, tremulous};

/// The supported engines, in the order of recognition.
pub static FRONT_ENDS: &[&FrontEnd] = &[
    &ioq3::FRONT_END,
    &openarena::FRONT_END,
    &quake3e::FRONT_END,
    &tremulous::FRONT_END,
];

/// An engine with a supported engine's version number and other tables.
#[derive(Debug)]
pub struct Unsupported {
    /// Name for the message.
    pub name: &'static str,
    /// As [`FrontEnd::marker`].
    pub marker: &'static str,
    /// `cl_renderer` of its own OpenGL renderer.
    pub opengl: &'static str,
}

/// Engines that are known by their executable's text.
pub static UNSUPPORTED: &[Unsupported] = &[
    Unsupported {
        name: "iortcw (single player)",
        marker: "s%_ps_reredner",
        opengl: "opengl1",
    },
    Unsupported {
        name: "iortcw (multiplayer)",
        marker: "s%_pm_reredner",
        opengl: "opengl1",
    },
    Unsupported {
        name: "lilium-voyager (Elite Force)",
        marker: "reredner_mhyovmuilil",
        opengl: "opengl1",
    },
];
