//! The scripts of a game, and what is wrong with them.

use relight::{GameFiles, Materials};
use shaderscript::Diagnostic;

/// The materials of a game and all faults of its scripts. Prints those that concern whole files, one a line.
pub fn load_scripts(files: &dyn GameFiles) -> (Materials, Vec<Diagnostic>) {
    let (materials, faults) = Materials::load(files);
    for fault in materials.faults_of_files() {
        log::warn!("{fault}");
    }
    (materials, faults)
}
