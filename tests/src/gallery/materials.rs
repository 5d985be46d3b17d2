//! What belongs to a whole shader.

use super::Scene;

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    Vec::new()
}
