//! Writes what `relight bake` made.

use std::path::Path;

use anyhow::{Result, anyhow};
use q3bsp::Bsp;
use relight::GameFiles;
use relight::bake::store::GameFile;
use relight::bake::store::pack::{RelitMap, relit_pack};
use relight::export::Output;

use super::loading::Source;

/// Whether an output is a pack.
pub fn is_pack(output: &Path) -> bool {
    let extension = output.extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("pk3"))
}

/// Writes a map with the files beside it, or a pack of them.
///
/// # Errors
/// A file cannot be written, or the pack cannot be made.
pub fn write(source: &Source, bsp: &Bsp, beside: &[GameFile], output: &Path) -> Result<()> {
    let mut out = Output::new(output);
    let bytes = bsp.write();
    if is_pack(output) {
        let aas = Path::new(&source.name).with_extension("aas");
        let aas = source.files.read(&aas.to_string_lossy())?;
        let pack = relit_pack(RelitMap {
            map: &source.name,
            original: &source.bytes,
            relit: &bytes,
            aas: aas.as_deref(),
            files: beside,
        });
        let pack = pack.map_err(|problem| anyhow!("{}: {problem}", output.display()))?;
        for note in &pack.notes {
            log::warn!("{}: {note}", source.name);
        }
        out.write_main(&pack.bytes)?;
    } else {
        let in_maps = output
            .parent()
            .and_then(Path::file_name)
            .is_some_and(|name| name.eq_ignore_ascii_case("maps"));
        for file in beside {
            // images lie beside the map, scripts in the folder of the game if the map is in its `maps`
            let name = match file.path.strip_prefix("maps/") {
                Some(name) => name.to_owned(),
                None if in_maps => format!("../{}", file.path),
                None => file.path.clone(),
            };
            out.write_beside(&name, &file.bytes)?;
        }
        out.write_main(&bytes)?;
    }
    out.finish()?;
    Ok(())
}
