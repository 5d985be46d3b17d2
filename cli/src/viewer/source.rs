//! The map that the viewer shows: where it is read from, its light in the background, and changes of its files.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use notify::{RecommendedWatcher, RecursiveMode, Watcher};
use q3bsp::Bsp;
use relight::light::sweep;
use relight::{
    CalibrationCache, CalibrationOptions, GameFiles, Overlay, RelitWorld, calibrate_with,
};
use renderer_vk::{Settings, map_options};

use crate::chosen::ChosenMap;
use crate::game::Game;
use crate::scripts::load_scripts;
use crate::view::open_bytes;
use crate::watched::{Compiled, Files, SourceText};

/// Files that a map is made of.
const WATCHED: [&str; 12] = [
    "bsp",
    "lights",
    "materials",
    "shader",
    "mtr",
    "tga",
    "jpg",
    "jpeg",
    "png",
    "pk3",
    "pcx",
    "skin",
];

/// Changes are collected for this long: programs write files in several steps.
const SETTLING: Duration = Duration::from_millis(250);

/// Where the map comes from.
#[derive(Clone, Debug)]
pub struct Source {
    /// The map and its game.
    pub chosen: ChosenMap,
    /// A file of lights that replaces the one of the map.
    pub lights: Option<PathBuf>,
    /// What `relight watch` follows; other changes of compiled maps do not concern it.
    pub followed: Option<Followed>,
}

/// A map that is being made.
#[derive(Clone, Debug)]
pub struct Followed {
    /// Its files.
    pub files: Files,
    /// The newest compiled map.
    pub map: Option<Compiled>,
    /// The newest `.map`, whose entities light the compiled map.
    pub text: Option<Arc<SourceText>>,
}

impl Followed {
    /// Before anything is read.
    pub fn new(files: Files) -> Self {
        Self {
            files,
            map: None,
            text: None,
        }
    }

    fn open(&self, game: &Game) -> Result<(Arc<dyn GameFiles>, String)> {
        let map = self.map.as_ref().context("no compiled map yet")?;
        let bytes = match &self.text {
            None => map.bytes.to_vec(),
            Some(text) => {
                let mut bsp = Bsp::parse(&map.bytes)?;
                text.light(&mut bsp);
                bsp.write()
            }
        };
        let own = self.files.bsp.clone();
        let compiled = (map.place != own).then(|| map.place.clone());
        let places: Vec<PathBuf> = std::iter::once(own).chain(compiled).collect();
        open_bytes(bytes, &places, game)
    }
}

impl Source {
    /// Opens the files; also returns the map's game path.
    ///
    /// # Errors
    /// A folder or the map cannot be read.
    pub fn open(&self) -> Result<(Arc<dyn GameFiles>, String)> {
        let (files, name) = match &self.followed {
            Some(followed) => followed.open(&self.chosen.game)?,
            None => self.chosen.open()?,
        };
        let Some(path) = self.lights.as_ref().filter(|path| path.is_file()) else {
            return Ok((files, name));
        };
        let bytes =
            std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
        let mut front = relight::MemoryFiles::new();
        front.insert(&relight::light::lights_file(&name), bytes)?;
        // the renderer takes an `Arc`; no other thread gets it
        #[allow(clippy::arc_with_non_send_sync)]
        let files = Arc::new(Overlay { front, back: files });
        Ok((files, name))
    }

    /// Folders and files whose changes concern the map.
    fn watched(&self) -> Vec<(PathBuf, RecursiveMode)> {
        let mut watched = Vec::new();
        let Some(map) = &self.chosen.map else {
            return watched; // the sample has no files
        };
        for game in &self.chosen.game.paths {
            watched.push((game.clone(), RecursiveMode::Recursive));
        }
        let parent = |path: &Path| match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let map = match map.split_once(".pk3:") {
            Some((pack, _)) => PathBuf::from(format!("{pack}.pk3")),
            None => PathBuf::from(map),
        };
        for file in [&map]
            .into_iter()
            .filter(|map| map.is_file() || self.followed.is_some())
            .chain(&self.lights)
        {
            watched.push((parent(file), RecursiveMode::NonRecursive));
        }
        watched
    }

    /// Whether the map may use this file. The folder of a single file holds others, too.
    fn concerns(&self, path: &Path) -> bool {
        let is_map = |path: &Path| {
            path.extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("bsp"))
        };
        if self.followed.is_some() && is_map(path) {
            return false;
        }
        if self
            .chosen
            .game
            .paths
            .iter()
            .any(|game| path.starts_with(game))
        {
            return true;
        }
        let map = self.chosen.map.as_deref().unwrap_or_default();
        let map = map
            .split_once(".pk3:")
            .map_or(map.to_owned(), |(pack, _)| format!("{pack}.pk3"));
        let names = [
            PathBuf::from(relight::light::lights_file(&map)),
            PathBuf::from(relight::materials::by_hand::materials_file(&map)),
            PathBuf::from(map),
        ];
        let mut names = names.iter().chain(&self.lights);
        names.any(|name| name.file_name() == path.file_name())
    }
}

/// Progress of the search for the map's lights.
#[derive(Clone, Debug)]
pub enum Progress {
    /// The part that is done, 0 to 1.
    Part(f32),
    /// The lights are in the cache.
    Found,
    /// The map cannot be read, or its lights cannot be kept.
    Failed(String),
}

/// Search for the map's lights on another thread, so that the window stays usable. The renderer then reads them from
/// the cache.
pub struct Finder {
    receiver: Receiver<Progress>,
    /// Its newest progress.
    pub newest: Progress,
    begun: Instant,
}

impl Finder {
    /// Begins the search. `wake` is called after each progress. `settings`: those of the renderer.
    pub fn begin(
        source: Source,
        cache: CalibrationCache,
        settings: Settings,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let (sender, receiver) = channel();
        std::thread::spawn(move || {
            let newest = match find(&source, &cache, &settings, &sender, &wake) {
                Ok(()) => Progress::Found,
                Err(e) => Progress::Failed(format!("{e:#}")),
            };
            // the viewer may have ended
            let _ = sender.send(newest);
            wake();
        });
        Self {
            receiver,
            newest: Progress::Part(0.0),
            begun: Instant::now(),
        }
    }

    /// Takes over the newest progress; a search whose thread has ended without a result has failed.
    pub fn update(&mut self) -> &Progress {
        loop {
            match self.receiver.try_recv() {
                Ok(progress) => self.newest = progress,
                Err(std::sync::mpsc::TryRecvError::Empty) => break,
                Err(std::sync::mpsc::TryRecvError::Disconnected) => {
                    if let Progress::Part(_) = self.newest {
                        self.newest = Progress::Failed("the search for lights ended early".into());
                    }
                    break;
                }
            }
        }
        &self.newest
    }

    /// Estimated remaining time, seconds.
    pub fn left(&self) -> Option<f32> {
        let Progress::Part(part) = self.newest else {
            return None;
        };
        let spent = self.begun.elapsed().as_secs_f32();
        (part > 0.02).then(|| spent / part * (1.0 - part))
    }
}

fn find(
    source: &Source,
    cache: &CalibrationCache,
    settings: &Settings,
    sender: &Sender<Progress>,
    wake: &dyn Fn(),
) -> Result<()> {
    let (files, name) = source.open()?;
    let (materials, _) = load_scripts(&*files);
    let mut world = RelitWorld::load(&*files, &materials, &name, map_options(settings))?;
    world.measure_materials(&*files);
    let options = CalibrationOptions {
        cache: Some(cache.clone()),
        ..CalibrationOptions::default()
    };
    calibrate_with(&mut world, &options, &mut |part| {
        // a viewer that has ended needs no progress
        let _ = sender.send(Progress::Part(part));
        wake();
    });
    world.read_by_hand(&*files);
    sweep(&mut world, Some(cache));
    Ok(())
}

/// A kind of change on disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Changed {
    /// Lights by hand alone.
    Lights,
    /// The map, its materials or its images.
    Map,
}

/// Changes of the map's files.
pub struct Changes {
    /// Ends with the value.
    _watcher: Option<RecommendedWatcher>,
    receiver: Receiver<PathBuf>,
    collected: Option<(Changed, Instant)>,
}

impl Changes {
    /// Watches the files of a map. Failures are warnings: the viewer works without. `wake` is called after a change.
    pub fn watch(source: &Source, wake: impl Fn() + Send + 'static) -> Self {
        let (sender, receiver) = channel();
        let watched = source.clone();
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            let Ok(event) = event else {
                return;
            };
            if event.kind.is_access() {
                return;
            }
            for path in event.paths {
                if watched.concerns(&path) && sender.send(path).is_ok() {
                    wake();
                }
            }
        });
        let mut watcher = watcher
            .inspect_err(|e| log::warn!("changes of files are not noticed: {e}"))
            .ok();
        if let Some(watcher) = &mut watcher {
            for (path, mode) in source.watched() {
                if let Err(e) = watcher.watch(&path, mode) {
                    log::warn!("{}: changes are not noticed: {e}", path.display());
                }
            }
        }
        Self {
            _watcher: watcher,
            receiver,
            collected: None,
        }
    }

    /// What has changed, once the files are at rest; `true`: a change is being collected.
    pub fn take(&mut self) -> (Option<Changed>, bool) {
        for path in self.receiver.try_iter() {
            if let Some(changed) = kind(&path) {
                let most = self
                    .collected
                    .map_or(changed, |(before, _)| before.max(changed));
                self.collected = Some((most, Instant::now()));
            }
        }
        let settled = |(_, since): &mut (Changed, Instant)| since.elapsed() >= SETTLING;
        let changed = self.collected.take_if(settled).map(|(changed, _)| changed);
        (changed, self.collected.is_some())
    }
}

fn kind(path: &Path) -> Option<Changed> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "lights" => Some(Changed::Lights),
        other => WATCHED.contains(&other).then_some(Changed::Map),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight::sample::Sample;

    fn chosen(map: Option<String>) -> ChosenMap {
        ChosenMap {
            sample: map.is_none().then_some(Sample::Hall),
            map,
            game: Game { paths: Vec::new() },
        }
    }

    #[test]
    fn changes_are_noticed_once_files_are_at_rest() {
        let folder = tempfile::tempdir().unwrap();
        let map = folder.path().join("room.bsp");
        std::fs::write(&map, "x").unwrap();
        let source = Source {
            chosen: chosen(Some(map.display().to_string())),
            lights: None,
            followed: None,
        };
        let mut changes = Changes::watch(&source, || ());
        assert_eq!(changes.take(), (None, false));
        let wait = |changes: &mut Changes| {
            for _ in 0..200 {
                if let (Some(changed), _) = changes.take() {
                    return Some(changed);
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            None
        };
        std::fs::write(folder.path().join("room.lights"), "point").unwrap();
        // the map uses neither
        std::fs::write(folder.path().join("notes.txt"), "y").unwrap();
        std::fs::write(folder.path().join("shot.png"), "y").unwrap();
        assert_eq!(wait(&mut changes), Some(Changed::Lights));
        std::fs::write(folder.path().join("room.lights"), "point").unwrap();
        std::fs::write(&map, "z").unwrap();
        assert_eq!(wait(&mut changes), Some(Changed::Map));
        // a map outside of a game has them in memory, so that they are read with the map
        std::fs::write(folder.path().join("room.materials"), "rough").unwrap();
        assert_eq!(wait(&mut changes), Some(Changed::Map));
        assert_eq!(changes.take(), (None, false));
    }

    #[test]
    fn lights_of_another_file_replace_those_of_the_map() {
        let folder = tempfile::tempdir().unwrap();
        let lights = folder.path().join("mine.lights");
        std::fs::write(&lights, "without suns").unwrap();
        let source = Source {
            chosen: chosen(None),
            lights: Some(lights),
            followed: None,
        };
        let (files, name) = source.open().unwrap();
        let path = name.replace(".bsp", ".lights");
        assert_eq!(files.read(&path).unwrap().unwrap(), b"without suns");
    }

    #[test]
    fn lights_are_found_on_another_thread() {
        let folder = tempfile::tempdir().unwrap();
        let source = Source {
            chosen: chosen(None),
            lights: None,
            followed: None,
        };
        let cache = CalibrationCache::new(folder.path());
        let mut finder = Finder::begin(source, cache, Settings::default(), || ());
        loop {
            match finder.update() {
                Progress::Part(part) => assert!((0.0..=1.0).contains(part)),
                Progress::Found => break,
                Progress::Failed(why) => panic!("{why}"),
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(std::fs::read_dir(folder.path()).unwrap().count() > 0);
    }
}
