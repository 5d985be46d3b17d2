//! Input maps of a conversion, and output files.

use std::collections::HashSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::view::no_maps;
use anyhow::{Context, Result, bail};
use relight::export::Format;
use relight::{GameFiles, MemoryFiles, Overlay, Pk3, SearchPath};

use crate::beside::beside;

/// A map.
pub enum Input {
    /// By a path in the game's files.
    Game(String),
    /// A file.
    File(PathBuf),
    /// A map in a pack.
    Packed(Arc<Pk3>, String),
}

impl fmt::Display for Input {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Input::Game(path) => f.write_str(path),
            Input::File(path) => write!(f, "{}", path.display()),
            Input::Packed(pack, path) => write!(f, "{}:{path}", pack.name()),
        }
    }
}

impl Input {
    /// Reads the map's file.
    pub fn read(&self, files: &SearchPath) -> Result<Vec<u8>> {
        let found = match self {
            Input::File(path) => {
                return std::fs::read(path).with_context(|| path.display().to_string());
            }
            Input::Game(path) => files.read(path)?,
            Input::Packed(pack, path) => pack.read(path)?,
        };
        found.with_context(|| format!("{self}: no such map"))
    }

    /// The game's files, preceded by those beside the map's own file.
    ///
    /// # Errors
    /// A file beside it cannot be read.
    pub fn files<'a>(&self, game: &'a SearchPath) -> Result<Overlay<&'a SearchPath>> {
        let front = match self {
            Input::File(path) => beside(path)?,
            Input::Game(_) | Input::Packed(..) => MemoryFiles::new(),
        };
        Ok(Overlay { front, back: game })
    }

    /// Game path of the map, existing or not.
    pub fn game_path(&self) -> String {
        match self {
            Input::File(_) => format!("maps/{}.bsp", self.name()),
            Input::Game(path) | Input::Packed(_, path) => path.clone(),
        }
    }

    /// Name of the map: its file name without extension.
    fn name(&self) -> String {
        let path = match self {
            Input::File(path) => path,
            Input::Game(path) | Input::Packed(_, path) => Path::new(path.as_str()),
        };
        path.file_stem()
            .map_or_else(|| "map".to_owned(), |s| s.to_string_lossy().into_owned())
    }

    /// Name of its pack, without extension.
    fn pack(&self) -> Option<String> {
        match self {
            Input::Packed(pack, _) => Path::new(pack.name())
                .file_stem()
                .map(|s| s.to_string_lossy().into_owned()),
            _ => None,
        }
    }
}

/// The maps of the command line. Packs outside of the game's folders are added to `files`, above the game.
pub fn find(files: &mut SearchPath, games: &[PathBuf], asked: &[String]) -> Result<Vec<Input>> {
    let mut inputs = Vec::new();
    let mut packs: Vec<(String, Arc<Pk3>)> = Vec::new();
    let mut open = |files: &mut SearchPath, name: &str| -> Result<Arc<Pk3>> {
        if let Some((_, pack)) = packs.iter().find(|(n, _)| n == name) {
            return Ok(Arc::clone(pack));
        }
        let path = Path::new(name);
        let pack = Arc::new(Pk3::open(path)?);
        if !games.iter().any(|game| is_in(path, game)) {
            files.add_pk3(path)?;
        }
        packs.push((name.to_owned(), Arc::clone(&pack)));
        Ok(pack)
    };
    for name in asked {
        let lower = name.to_ascii_lowercase();
        if let Some((pack, inside)) = split_packed(name) {
            let pack = open(files, pack)?;
            if !pack.exists(inside) {
                bail!("{}: no {inside} in it", pack.name());
            }
            inputs.push(Input::Packed(pack, inside.to_owned()));
        } else if lower.ends_with(".pk3") {
            let pack = open(files, name)?;
            let mut maps = pack.list("maps", ".bsp");
            maps.sort();
            if maps.is_empty() {
                bail!(no_maps(name, &pack));
            }
            inputs.extend(
                maps.into_iter()
                    .map(|map| Input::Packed(Arc::clone(&pack), format!("maps/{map}"))),
            );
        } else if Path::new(name).is_file() {
            inputs.push(Input::File(PathBuf::from(name)));
        } else {
            let path = match (lower.ends_with(".bsp"), name.contains('/')) {
                (true, true) => name.clone(),
                (true, false) => format!("maps/{name}"),
                _ => format!("maps/{name}.bsp"),
            };
            if !files.exists(&path) {
                bail!("{name}: neither a file nor a map of the game");
            }
            inputs.push(Input::Game(path));
        }
    }
    Ok(inputs)
}

/// Splits `pack.pk3:maps/x.bsp`.
fn split_packed(name: &str) -> Option<(&str, &str)> {
    let at = name.to_ascii_lowercase().find(".pk3:")?;
    Some((name.get(..at + 4)?, name.get(at + 5..)?))
}

fn is_in(path: &Path, folder: &Path) -> bool {
    let real = |p: &Path| p.canonicalize().ok();
    let parent = real(path).and_then(|p| p.parent().map(Path::to_owned));
    parent.is_some() && parent == real(folder)
}

/// Output of each map. One map is written to `output` itself, unless that is a folder or lacks the format's extension;
/// several maps are written into it, those of several packs into a folder for each pack.
pub fn outputs(inputs: &[Input], output: &Path, format: Format) -> Result<Vec<PathBuf>> {
    let extension = format.extension();
    let is_file = output
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case(extension));
    if let [one] = inputs {
        return Ok(vec![if is_file && !output.is_dir() {
            output.to_owned()
        } else {
            output.join(format!("{}.{extension}", one.name()))
        }]);
    }
    if output.is_file() {
        bail!("{}: several maps need a folder", output.display());
    }
    let packs: HashSet<_> = inputs.iter().map(Input::pack).collect();
    let mut taken = HashSet::new();
    inputs
        .iter()
        .map(|input| {
            let mut folder = output.to_owned();
            if packs.len() > 1 {
                folder.extend(input.pack());
            }
            let path = folder.join(format!("{}.{extension}", input.name()));
            if !taken.insert(path.clone()) {
                bail!("{input}: another map has this name; give them different outputs");
            }
            Ok(path)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_in_packs() {
        assert_eq!(
            split_packed("a/b.PK3:maps/x.bsp"),
            Some(("a/b.PK3", "maps/x.bsp"))
        );
        assert_eq!(split_packed("b.pk3"), None);
        assert_eq!(split_packed("x.bsp"), None);
    }

    #[test]
    fn one_map_is_a_file_and_several_are_a_folder() {
        let game = |name: &str| Input::Game(format!("maps/{name}.bsp"));
        let format = Format::Obj;
        let one = outputs(&[game("a")], Path::new("x.obj"), format).unwrap();
        assert_eq!(one, [PathBuf::from("x.obj")]);
        let one = outputs(&[game("a")], Path::new("x"), format).unwrap();
        assert_eq!(one, [PathBuf::from("x/a.obj")]);
        let two = outputs(&[game("a"), game("b")], Path::new("x"), format).unwrap();
        assert_eq!(two, ["x/a.obj", "x/b.obj"].map(PathBuf::from));
        let twice = [game("a"), Input::File(PathBuf::from("y/a.bsp"))];
        assert!(outputs(&twice, Path::new("x"), format).is_err());
    }
}
