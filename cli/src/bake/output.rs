//! Where baked maps are written: files beside their images, or packs.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Result, anyhow, bail};
use clap::ValueEnum;
use q3bsp::Bsp;
use relight::bake::store::GameFile;
use relight::bake::store::pack::{RelitMap, RelitPack, pack_name};
use relight::export::Output;

use super::loading::Source;

/// What is written for a map.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The map, with its images beside it
    Bsp,
    /// A pack that replaces the map in a game: z_NAME_relit.pk3 in a folder
    Pk3,
}

/// Where the maps of a command go.
#[derive(Debug)]
pub enum Outputs {
    /// A file each, in the order of the maps.
    Files(Vec<(PathBuf, Format)>),
    /// One pack of all.
    Together(PathBuf, Mutex<RelitPack>),
}

impl Outputs {
    /// Those of maps with these names. A pack named for several maps holds all; a path without `.bsp` and `.pk3` is a folder that
    /// gets a file each.
    ///
    /// # Errors
    /// The output does not fit the format or the number of maps.
    pub fn of(maps: &[String], output: &Path, format: Option<Format>) -> Result<Outputs> {
        let by_name = output.extension().and_then(|extension| {
            let is = |name: &str| extension.eq_ignore_ascii_case(name);
            if is("pk3") {
                return Some(Format::Pk3);
            }
            is("bsp").then_some(Format::Bsp)
        });
        let by_name = by_name.filter(|_| !output.is_dir());
        if let (Some(named), Some(wanted)) = (by_name, format)
            && named != wanted
        {
            bail!("{}: not a file of this --format", output.display());
        }
        let format = by_name.or(format).unwrap_or(Format::Bsp);
        match by_name {
            Some(_) if maps.len() == 1 => {
                return Ok(Outputs::Files(vec![(output.to_owned(), format)]));
            }
            Some(Format::Pk3) => {
                return Ok(Outputs::Together(output.to_owned(), Mutex::default()));
            }
            Some(Format::Bsp) => bail!("{}: several maps need a folder", output.display()),
            None if output.is_file() => bail!("{}: neither .bsp nor .pk3", output.display()),
            None => {}
        }
        let mut taken = HashSet::new();
        let mut files = Vec::with_capacity(maps.len());
        for map in maps {
            let stem = Path::new(map).file_stem().unwrap_or_default();
            let stem = stem.to_string_lossy();
            let name = match format {
                Format::Bsp => format!("{stem}.bsp"),
                Format::Pk3 => pack_name(&stem),
            };
            if !taken.insert(name.clone()) {
                bail!("{map}: another map has this name; give them different outputs");
            }
            files.push((output.join(name), format));
        }
        Ok(Outputs::Files(files))
    }

    /// The output of the map with this number.
    pub fn of_map(&self, number: usize) -> Option<MapOutput<'_>> {
        match self {
            Outputs::Files(files) => {
                let (path, format) = files.get(number)?;
                Some(MapOutput::File(path, *format))
            }
            Outputs::Together(path, pack) => Some(MapOutput::Part(path, pack)),
        }
    }

    /// Writes the pack of all maps.
    ///
    /// # Errors
    /// It cannot be written; a file of its name is then as it was.
    pub fn finish(self) -> Result<()> {
        let Outputs::Together(path, pack) = self else {
            return Ok(());
        };
        write_pack(
            &path,
            &pack.into_inner().unwrap_or_else(PoisonError::into_inner),
        )
    }
}

/// Where one map goes.
#[derive(Debug)]
pub enum MapOutput<'a> {
    /// Into a file.
    File(&'a Path, Format),
    /// Into the pack with this path, with other maps.
    Part(&'a Path, &'a Mutex<RelitPack>),
}

impl MapOutput<'_> {
    /// The file.
    pub fn path(&self) -> &Path {
        match self {
            MapOutput::File(path, _) | MapOutput::Part(path, _) => path,
        }
    }

    /// Whether the file is complete with this map alone.
    pub fn is_own(&self) -> bool {
        matches!(self, MapOutput::File(..))
    }

    /// Game path of the map that is written: a pack replaces the map, and a `.bsp` file has the name of the output.
    pub fn map_name(&self, source: &str) -> String {
        match self {
            MapOutput::File(path, Format::Bsp) => {
                let stem = path.file_stem().unwrap_or_default();
                format!("maps/{}.bsp", stem.to_string_lossy())
            }
            _ => source.to_owned(),
        }
    }

    /// Writes a map with the files beside it.
    ///
    /// # Errors
    /// A file cannot be read or written; files of these names are then as they were.
    pub fn write(&self, source: &Source, bsp: &Bsp, beside: &[GameFile]) -> Result<()> {
        let bytes = bsp.write();
        match self {
            MapOutput::Part(_, pack) => {
                let mut pack = pack.lock().unwrap_or_else(PoisonError::into_inner);
                add(&mut pack, source, &bytes, beside)
            }
            MapOutput::File(path, Format::Pk3) => {
                let mut pack = RelitPack::default();
                add(&mut pack, source, &bytes, beside)?;
                write_pack(path, &pack)
            }
            MapOutput::File(path, Format::Bsp) => write_map(path, &bytes, beside),
        }
    }
}

/// Adds a map to a pack.
fn add(pack: &mut RelitPack, source: &Source, relit: &[u8], beside: &[GameFile]) -> Result<()> {
    let aas = Path::new(&source.name).with_extension("aas");
    let aas = source.files.read(&aas.to_string_lossy())?;
    pack.add(RelitMap {
        map: &source.name,
        original: &source.bytes,
        relit,
        aas: aas.as_deref(),
        files: beside,
    });
    Ok(())
}

fn write_pack(path: &Path, pack: &RelitPack) -> Result<()> {
    let bytes = pack.archive();
    let bytes = bytes.map_err(|problem| anyhow!("{}: {problem}", path.display()))?;
    for note in pack.notes() {
        log::warn!("{}: {note}", path.display());
    }
    let mut out = Output::new(path);
    out.write_main(&bytes)?;
    out.finish()?;
    Ok(())
}

/// Writes a map and the files beside it.
fn write_map(path: &Path, bytes: &[u8], beside: &[GameFile]) -> Result<()> {
    let mut out = Output::new(path);
    let in_maps = path
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
    out.write_main(bytes)?;
    out.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(maps: &[&str], output: &str, format: Option<Format>) -> Result<Vec<String>> {
        let maps: Vec<String> = maps.iter().map(|map| (*map).to_owned()).collect();
        Ok(match Outputs::of(&maps, Path::new(output), format)? {
            Outputs::Files(files) => files
                .iter()
                .map(|(path, _)| path.to_string_lossy().into_owned())
                .collect(),
            Outputs::Together(path, _) => vec![format!("all in {}", path.display())],
        })
    }

    #[test]
    fn a_pack_holds_all_maps_and_a_folder_a_file_each() {
        let pack = Some(Format::Pk3);
        assert_eq!(of(&["a"], "x.pk3", None).unwrap(), ["x.pk3"]);
        assert_eq!(of(&["a"], "no/dir", None).unwrap(), ["no/dir/a.bsp"]);
        assert_eq!(of(&["a", "b"], "x.PK3", None).unwrap(), ["all in x.PK3"]);
        let files = of(&["a.bsp", "p.pk3:maps/b.bsp"], "no/dir", None).unwrap();
        assert_eq!(files, ["no/dir/a.bsp", "no/dir/b.bsp"]);
        let packs = of(&["a", "b"], "no/dir", pack).unwrap();
        assert_eq!(packs, ["no/dir/z_a_relit.pk3", "no/dir/z_b_relit.pk3"]);
        assert!(of(&["a", "b"], "x.bsp", None).is_err());
        assert!(of(&["a"], "x.bsp", pack).is_err());
        assert!(of(&["a", "c/a.bsp"], "no/dir", None).is_err());
    }
}
