//! What the tests of several crates share: game data or a skipped test ([`game`], [`folder`]), a Vulkan device or a
//! skipped test ([`device()`]), the report of a skipped test ([`skip`]), a seeded random generator ([`Random`]), damage to files ([`poke_words`]), the
//! settings of property tests ([`cases`]), a cube ([`cube_triangles`]), and the timing of benchmarks ([`mod@bench`]).
//!
//! # Game data
//!
//! A game folder holds whatever its owner put there: more packages, a player's own maps. Tests that count therefore
//! take the game's own packs, named in [`PACKS`] with their sizes, through [`folder`] or [`Game::packs`]; they check
//! numbers only where [`Game::exact`] holds. Over the other packs, [`Game::others`], tests check what holds for any
//! file.
//!
//! `OPENARENA_DATA` names the installed folder, otherwise Debian's is taken. Without `pak0.pk3` in it, tests are
//! skipped; with `RELIGHT_REQUIRE_DATA=1` they fail.

#![forbid(unsafe_code)]

pub mod bench;
mod hostile;
mod skips;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use zip::ZipArchive;
use zip::result::ZipError;

pub use hostile::{cases, poke_words};
pub use skips::{Need, absent, assert_optional, device, is_set, skip};
pub use support::random::Random;

#[cfg(not(unix))]
use std::fs::hard_link as link;
#[cfg(unix)]
use std::os::unix::fs::symlink as link;

/// The packs of OpenArena 0.8.8 as Debian 12 installs them, with their sizes in bytes.
pub const PACKS: [(&str, u64); 9] = [
    ("pak0.pk3", 39_091_812),
    ("pak1-maps.pk3", 40_683_365),
    ("pak2-players-mature.pk3", 27_657_403),
    ("pak2-players.pk3", 76_715_786),
    ("pak4-textures.pk3", 98_912_964),
    ("pak5-TA.pk3", 3_026_745),
    ("pak6-misc.pk3", 25_918_589),
    ("pak6-patch085.pk3", 38_494_560),
    ("pak6-patch088.pk3", 73_194_614),
];

/// The triangles of a cube whose corners bits 0, 1, 2 of their number place, clockwise seen from outside.
pub fn cube_triangles() -> impl Iterator<Item = [u32; 3]> {
    let faces = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    (faces.into_iter()).flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
}

/// An installed OpenArena.
#[derive(Debug)]
pub struct Game {
    /// A folder of links to [`packs`](Self::packs) and nothing else, in the build's own folder.
    pub folder: PathBuf,
    /// The game's own packs, lowest priority first.
    pub packs: Vec<PathBuf>,
    /// The other packs of the installed folder, lowest priority first.
    pub others: Vec<PathBuf>,
    /// How the game's packs differ from [`PACKS`], a line each.
    pub differences: Vec<String>,
}

impl Game {
    /// Whether the game's packs are those whose contents the tests' numbers were counted in.
    pub fn exact(&self) -> bool {
        self.differences.is_empty()
    }

    /// The game's own packs, then the others.
    pub fn all_packs(&self) -> impl Iterator<Item = &PathBuf> {
        self.packs.iter().chain(&self.others)
    }

    fn open(installed: &Path) -> io::Result<Self> {
        let (packs, others, differences) = sort_packs(installed)?;
        let folder = links_to(&[installed])?.join("baseoa");
        make_links(&folder, &packs)?;
        Ok(Self {
            folder,
            packs,
            others,
            differences,
        })
    }

    /// Which packs tests use, a line.
    fn describe(&self) -> String {
        let names = |packs: &[PathBuf]| {
            let names: Vec<_> = packs.iter().map(|p| file_name(p)).collect();
            names.join(" ")
        };
        let mut text = format!("OpenArena's own packs: {}", names(&self.packs));
        if !self.others.is_empty() {
            text += &format!("; checked without numbers: {}", names(&self.others));
        }
        if !self.exact() {
            text += &format!("; numbers are not checked: {}", self.differences.join(", "));
        }
        text
    }
}

/// The installed game, or `None` with a report of a skipped test. The first call of a process prints which packs tests use,
/// past the capture of the test harness.
///
/// # Panics
/// When the game is absent and `RELIGHT_REQUIRE_DATA=1`, and when its folder cannot be read.
pub fn game() -> Option<&'static Game> {
    static GAME: OnceLock<Option<Game>> = OnceLock::new();
    let installed = installed();
    let found = GAME.get_or_init(|| {
        if !installed.join(PACKS[0].0).is_file() {
            return None;
        }
        let game = Game::open(&installed)
            .unwrap_or_else(|error| panic!("{}: {error}", installed.display()));
        // Nothing is lost without a reader.
        let _ = writeln!(io::stderr(), "{}", game.describe());
        Some(game)
    });
    if found.is_none() {
        let why = format!("{} has no {}", installed.display(), PACKS[0].0);
        absent(Need::Data, why);
    }
    found.as_ref()
}

/// [`Game::folder`] of the installed game.
pub fn folder() -> Option<PathBuf> {
    game().map(|game| game.folder.clone())
}

/// A folder that the engine takes as `fs_basepath`: `baseoa` with the game's own packs and the game code (the
/// libraries) that lies in `installation/baseoa`.
///
/// # Errors
/// When a folder cannot be read or a link cannot be made.
pub fn engine_base(game: &Game, installation: &Path) -> io::Result<PathBuf> {
    let base = links_to(&[&game.folder, installation])?.join("engine");
    let mut files = game.packs.clone();
    for entry in fs::read_dir(installation.join("baseoa"))? {
        let path = entry?.path();
        if path.extension() == Some(OsStr::new(std::env::consts::DLL_EXTENSION)) {
            files.push(path);
        }
    }
    make_links(&base.join("baseoa"), &files)?;
    Ok(base)
}

/// Calls `visit` with pack, name and bytes of every file whose name ends in `extension` in any case, pack by pack.
/// Returns how many there were. What cannot be read is left out with a line that names it.
pub fn for_each_file(
    packs: &[PathBuf],
    extension: &str,
    mut visit: impl FnMut(&str, &str, &[u8]),
) -> usize {
    let mut count = 0;
    for pack in packs {
        let opened = File::open(pack)
            .map_err(Into::into)
            .and_then(ZipArchive::new);
        let mut archive = match opened {
            Ok(archive) => archive,
            Err(error) => {
                println!("{}: {error}", pack.display());
                continue;
            }
        };
        for at in 0..archive.len() {
            match read(&mut archive, at, extension) {
                Ok(Some((name, bytes))) => {
                    visit(&file_name(pack), &name, &bytes);
                    count += 1;
                }
                Ok(None) => {}
                Err(error) => println!("{}, file {at}: {error}", pack.display()),
            }
        }
    }
    count
}

/// Name and bytes of the file at that place of the archive, if its name ends so.
fn read(
    archive: &mut ZipArchive<File>,
    at: usize,
    extension: &str,
) -> Result<Option<(String, Vec<u8>)>, ZipError> {
    let mut file = archive.by_index(at)?;
    let name = file.name()?.into_owned();
    if !name.to_ascii_lowercase().ends_with(extension) {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(Some((name, bytes)))
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn installed() -> PathBuf {
    std::env::var_os("OPENARENA_DATA").map_or_else(
        || PathBuf::from("/usr/share/games/openarena/baseoa"),
        PathBuf::from,
    )
}

/// The game's own packs in `folder`, the others, and how the former differ from [`PACKS`].
fn sort_packs(folder: &Path) -> io::Result<(Vec<PathBuf>, Vec<PathBuf>, Vec<String>)> {
    let mut packs = Vec::new();
    let mut differences = Vec::new();
    for (name, size) in PACKS {
        let path = folder.join(name);
        match fs::metadata(&path) {
            Ok(found) if found.len() == size => {}
            Ok(found) => differences.push(format!("{name} has {} bytes, not {size}", found.len())),
            Err(_) => {
                differences.push(format!("{name} is absent"));
                continue;
            }
        }
        packs.push(path);
    }
    let mut others = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let is_pack = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("pk3"));
        if is_pack && path.is_file() && !packs.contains(&path) {
            others.push(path);
        }
    }
    others.sort();
    Ok((packs, others, differences))
}

/// Where the links to files of `sources` lie: a folder of their own beside the running program's build products.
fn links_to(sources: &[&Path]) -> io::Result<PathBuf> {
    let mut key = DefaultHasher::new();
    for source in sources {
        fs::canonicalize(source)?.hash(&mut key);
    }
    // <target>/<profile>/deps/<test> or <target>/<profile>/<program>
    let program = std::env::current_exe()?;
    let folder = program.parent().unwrap_or(Path::new("."));
    let profile = match folder.parent() {
        Some(profile) if folder.ends_with("deps") => profile,
        _ => folder,
    };
    Ok(profile
        .join("testkit")
        .join(format!("{:016x}", key.finish())))
}

/// Makes `folder` hold links to `files` and nothing else. Other processes may do the same at the same time.
fn make_links(folder: &Path, files: &[PathBuf]) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let wanted = files
            .iter()
            .find(|f| f.file_name() == Some(&entry.file_name()));
        let right = wanted.is_some_and(|file| {
            fs::canonicalize(entry.path())
                .is_ok_and(|found| fs::canonicalize(file).is_ok_and(|file| file == found))
        });
        if !right {
            match fs::remove_file(entry.path()) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
    }
    for file in files {
        let name = file.file_name().unwrap_or_default();
        match link(fs::canonicalize(file)?, folder.join(name)) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An empty folder of this process.
    fn empty(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("testkit-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    fn names(packs: &[PathBuf]) -> Vec<String> {
        packs.iter().map(|p| file_name(p)).collect()
    }

    #[test]
    fn packs_of_others_are_told_apart() {
        let installed = empty("others");
        for (name, size) in PACKS {
            let file = File::create(installed.join(name)).unwrap();
            file.set_len(size).unwrap();
        }
        let (packs, others, differences) = sort_packs(&installed).unwrap();
        assert_eq!((packs.len(), others.len()), (PACKS.len(), 0));
        assert_eq!(differences, [""; 0]);

        for name in ["a.pk3", "z_oacmp.PK3", "autoexec.cfg"] {
            File::create(installed.join(name)).unwrap();
        }
        let (packs, others, differences) = sort_packs(&installed).unwrap();
        assert_eq!(names(&packs), PACKS.map(|(name, _)| name));
        assert_eq!(names(&others), ["a.pk3", "z_oacmp.PK3"]);
        assert_eq!(differences, [""; 0]);

        File::create(installed.join("pak0.pk3")).unwrap();
        fs::remove_file(installed.join("pak5-TA.pk3")).unwrap();
        let (packs, _, differences) = sort_packs(&installed).unwrap();
        assert_eq!(packs.len(), PACKS.len() - 1);
        assert_eq!(
            differences,
            [
                "pak0.pk3 has 0 bytes, not 39091812",
                "pak5-TA.pk3 is absent"
            ]
        );
        fs::remove_dir_all(installed).unwrap();
    }

    #[test]
    fn the_folder_of_links_holds_what_is_asked_for() {
        let (installed, links) = (empty("installed"), empty("links"));
        let files: Vec<PathBuf> = ["a.pk3", "b.pk3", "c.pk3"]
            .map(|n| installed.join(n))
            .into();
        for file in &files {
            fs::write(file, file_name(file)).unwrap();
        }
        make_links(&links, &files[..2]).unwrap();
        make_links(&links, &files[..2]).unwrap();
        assert_eq!(
            fs::read_to_string(links.join("b.pk3")).unwrap(),
            files[1].file_name().unwrap().to_str().unwrap()
        );
        make_links(&links, &files[1..]).unwrap();
        let mut found: Vec<String> = fs::read_dir(&links)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        found.sort();
        assert_eq!(found, ["b.pk3", "c.pk3"]);
        fs::remove_dir_all(installed).unwrap();
        fs::remove_dir_all(links).unwrap();
    }
}
