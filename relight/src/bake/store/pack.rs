//! Packs that replace the light of a map: `z_NAME_relit.pk3`.

use super::aas::{self, AasError};
use super::{GameFile, map_name};
use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;

/// A pack of relit maps.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RelitPack {
    files: BTreeMap<String, Vec<u8>>,
    notes: Vec<String>,
}

/// A relit map for a pack.
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

/// File name of the pack of a map: engines read packs in the order of their names, and later ones count.
pub fn pack_name(map: &str) -> String {
    format!("z_{}_relit.pk3", map_name(map))
}

impl RelitPack {
    /// Adds a relit map, what its light needs, and its file for bots with the checksum of the new map.
    pub fn add(&mut self, map: RelitMap<'_>) {
        let name = map_name(map.map);
        match map.aas.map(|aas| aas::adapt(aas, map.original, map.relit)) {
            Some(Ok(adapted)) => {
                self.files.insert(format!("maps/{name}.aas"), adapted);
            }
            Some(Err(problem @ (AasError::Format | AasError::OtherMap))) => {
                self.notes.push(format!(
                    "bots do not work on the relit map: {name}.aas: {problem}"
                ));
            }
            None => {}
        }
        let relit = map.relit.to_owned();
        self.files.insert(format!("maps/{name}.bsp"), relit);
        for file in map.files {
            self.files.insert(file.path.clone(), file.bytes.clone());
        }
    }

    /// Game paths of its files.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// What people who use it need to know.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        let pure = "a server with sv_pure 1 accepts a player's pack only if it has the same one";
        self.notes.iter().map(String::as_str).chain([pure])
    }

    /// The archive. Equal files give equal bytes.
    ///
    /// # Errors
    /// It cannot be written: a file is larger than an archive holds.
    pub fn archive(&self) -> Result<Vec<u8>, String> {
        archive(&self.files).map_err(|problem| problem.to_string())
    }
}

/// A zip archive in the order of the names, without times.
fn archive(files: &BTreeMap<String, Vec<u8>>) -> zip::result::ZipResult<Vec<u8>> {
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
        let mut pack = RelitPack::default();
        pack.add(map);
        let other = RelitMap {
            map: "maps/n.bsp",
            aas: None,
            files: &[],
            ..map
        };
        pack.add(other);
        let bytes = pack.archive().unwrap();
        assert_eq!(bytes, pack.archive().unwrap());
        assert_eq!(pack_name("maps/m.bsp"), "z_m_relit.pk3");
        let names: Vec<&str> = pack.files().collect();
        assert_eq!(names, ["maps/m.bsp", "maps/m/lm_0000.tga", "maps/n.bsp"]);
        assert_eq!(pack.notes().count(), 2);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("z.pk3");
        std::fs::write(&path, &bytes).unwrap();
        let opened = Pk3::open(&path).unwrap();
        assert_eq!(opened.read("maps/m.bsp").unwrap().unwrap(), b"new");
        assert_eq!(opened.all_names().count(), 3);
    }
}
