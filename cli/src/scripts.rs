//! Loads the scripts of a game.

use relight::{GameFiles, Materials};
use shaderscript::Diagnostic;

/// The materials of a game and all diagnostics of its scripts. Prints those about whole files, one a line.
pub fn load_scripts(files: &dyn GameFiles) -> (Materials, Vec<Diagnostic>) {
    let (materials, faults) = Materials::load(files);
    for fault in materials.faults_of_files() {
        log::warn!("{fault}");
    }
    (materials, faults)
}
