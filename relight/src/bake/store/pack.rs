//! Packs that replace the light of a map: `z_NAME_relit.pk3`.

use super::aas::{self, AasError};
use super::{GameFile, map_name};
use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;

/// A pack.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RelitPack {
    /// File name: engines read packs in the order of their names, and later ones count.
    pub name: String,
    /// The archive. Equal files give equal bytes.
    pub bytes: Vec<u8>,
    /// Game paths of its files.
    pub files: Vec<String>,
    /// What people who use it need to know.
    pub notes: Vec<String>,
}

/// A relit map as a pack.
#[derive(Debug, Clone, Copy)]
pub struct RelitMap<'a> {
    /// Game path of the map.
    pub map: &'a str,
    /// The file that it replaces.
    pub original: &'a [u8],
    /// The new file.
    pub relit: &'a [u8],
    /// The original's file for bots, if it has one.
    pub aas: Option<&'a [u8]>,
    /// Images and scripts of the new light.
    pub files: &'a [GameFile],
}

/// Writes the pack of a relit map: the map, what its light needs, and its file for bots with the checksum of the new map.
///
/// # Errors
/// The archive cannot be written: a file is larger than an archive holds.
pub fn relit_pack(map: RelitMap<'_>) -> Result<RelitPack, String> {
    let name = map_name(map.map);
    let mut files: BTreeMap<String, &[u8]> = BTreeMap::new();
    let mut notes = vec![
        "a server with sv_pure 1 accepts a player's pack only if it has the same one".to_owned(),
    ];
    let bots = map.aas.map(|aas| aas::adapt(aas, map.original, map.relit));
    match &bots {
        Some(Ok(adapted)) => {
            files.insert(format!("maps/{name}.aas"), adapted);
        }
        Some(Err(problem @ (AasError::Format | AasError::OtherMap))) => {
            notes.push(format!(
                "bots do not work on the relit map: {name}.aas: {problem}"
            ));
        }
        None => {}
    }
    files.insert(format!("maps/{name}.bsp"), map.relit);
    for file in map.files {
        files.insert(file.path.clone(), &file.bytes);
    }
    let bytes = archive(&files).map_err(|problem| problem.to_string())?;
    Ok(RelitPack {
        name: format!("z_{name}_relit.pk3"),
        bytes,
        files: files.into_keys().collect(),
        notes,
    })
}

/// A zip archive in the order of the names, without times.
fn archive(files: &BTreeMap<String, &[u8]>) -> zip::result::ZipResult<Vec<u8>> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (path, bytes) in files {
        let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
        archive.start_file(path.as_str(), options)?;
        archive.write_all(bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::{GameFiles, Pk3};

    #[test]
    fn a_pack_has_the_map_and_what_it_needs() {
        let image = GameFile {
            path: "maps/m/lm_0000.tga".to_owned(),
            bytes: vec![1, 2, 3],
        };
        let map = RelitMap {
            map: "maps/m.bsp",
            original: b"old",
            relit: b"new",
            aas: Some(b"no such file"),
            files: &[image],
        };
        let pack = relit_pack(map).unwrap();
        assert_eq!(pack, relit_pack(map).unwrap());
        assert_eq!(pack.name, "z_m_relit.pk3");
        assert_eq!(pack.files, ["maps/m.bsp", "maps/m/lm_0000.tga"]);
        assert_eq!(pack.notes.len(), 2, "{:?}", pack.notes);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(&pack.name);
        std::fs::write(&path, &pack.bytes).unwrap();
        let opened = Pk3::open(&path).unwrap();
        assert_eq!(opened.read("maps/m.bsp").unwrap().unwrap(), b"new");
        assert_eq!(opened.all_names().count(), 2);
    }
}
