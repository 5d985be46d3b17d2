//! Loading of the viewer's map, and what follows changes of its files and the search for its lights.

use std::sync::Arc;

use anyhow::{Context, Result};
use q3bsp::Bsp;
use relight::CalibrationCache;

use super::lights::{Editor, lights_path};
use super::source::{Changed, Finder, Progress};
use super::state::{FOV, Map, Scripts, Viewer};
use crate::scripts::load_scripts;
use crate::view::{self, Camera};

impl Viewer {
    /// Loads the map.
    ///
    /// # Errors
    /// It cannot be read, or the device is out of memory.
    pub(super) fn load(&mut self) -> Result<()> {
        self.load_with(None)
    }

    /// Loads the map with the scripts and images of the one that is shown: only the map itself has changed.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub(super) fn load_again(&mut self) -> Result<()> {
        let scripts = self.map.as_ref().map(|map| Arc::clone(&map.scripts));
        self.load_with(scripts)
    }

    fn load_with(&mut self, scripts: Option<Arc<Scripts>>) -> Result<()> {
        let (files, name) = self.source.open()?;
        // a map that cannot be read leaves the one that is shown
        let bytes = files.read(&name)?.unwrap_or_default();
        Bsp::parse(&bytes).with_context(|| name.clone())?;
        let (renderer, settings) = (&mut self.renderer, &self.settings);
        let own = Arc::clone(&files);
        let ((bsp, entities), scripts) = match scripts {
            Some(scripts) => (view::load_again(renderer, own, &name, settings)?, scripts),
            None => {
                let scripts = Arc::new(load_scripts(&*files));
                (view::load(renderer, own, &name, settings)?, scripts)
            }
        };
        let mut cameras = Vec::new();
        if let Some(camera) = Camera::of_map(&bsp) {
            cameras.push(("intermission".to_owned(), camera));
        }
        let spawns = Camera::spawns(&bsp);
        cameras.extend(
            (0..)
                .zip(&spawns)
                .map(|(n, camera)| (format!("spawn {n}"), *camera)),
        );
        let chosen = std::mem::take(&mut self.place).find(&bsp)?;
        let relit = &self.renderer.world().context("no map")?.relit;
        let overview = Camera::overview(relit, self.renderer.size(), FOV);
        if let Some(camera) = overview {
            cameras.push(("overview".to_owned(), camera));
        }
        let kept = (self.map.is_some()).then_some(Camera::from(self.motion.camera));
        let first = cameras.first().map(|(_, camera)| *camera);
        let camera = kept.or(chosen).or(first);
        self.motion.camera = camera.unwrap_or_default().into();
        let chosen = &self.source.chosen;
        self.lights_path = lights_path(
            self.source.lights.as_ref(),
            chosen.map.as_deref(),
            &name,
            &chosen.game.paths,
        );
        if self.follow.is_none() {
            self.title = Some(format!("{} – Relight", view::map_name(&name)));
        }
        self.map = Some(Map {
            name,
            files,
            scripts,
            entities,
            cameras,
            probe: None,
        });
        self.picked = None;
        self.keep_edits();
        self.found = false;
        self.keep_finder();
        Ok(())
    }

    /// Loads the map again after a change; the picture before stays if that fails.
    pub(super) fn reload(&mut self) {
        if self.follow.is_some() && self.map.is_none() {
            return; // there is none yet
        }
        match self.load() {
            Ok(()) => self.message = Some("reloaded: files have changed".to_owned()),
            Err(e) => self.message = Some(format!("not reloaded: {e:#}")),
        }
    }

    /// Begins the search for lights, or takes over its result.
    pub(super) fn follow_finder(&mut self) {
        if self.map.is_none() || self.found || !self.shown.is_traced() || !self.needs_finder() {
            return;
        }
        let finder = self.finder.get_or_insert_with(|| {
            let wake = Arc::clone(&self.wake);
            Finder::begin(
                self.source.clone(),
                CalibrationCache::new(&self.cache),
                self.settings.clone(),
                move || wake(),
            )
        });
        match finder.update() {
            Progress::Part(_) => return,
            Progress::Found => {}
            Progress::Failed(why) => {
                // the renderer then searches by itself
                self.message = Some(why.clone());
            }
        }
        self.found = true;
        // other lights are changed from now on
        self.keep_edits();
    }

    /// Reloads what has changed on disk; whether changes are being collected.
    pub(super) fn follow_files(&mut self) -> bool {
        let (changed, collecting) = self.changes.take();
        let own = self.editor.as_ref().is_some_and(Editor::is_changed);
        match changed {
            None => {}
            Some(Changed::Lights) if own => {
                self.message =
                    Some("the file of lights has changed on disk; yours are not saved".to_owned());
            }
            Some(Changed::Lights) => self.reload_lights(),
            Some(Changed::Map) => self.reload(),
        }
        collecting
    }

    /// Reads the lights by hand again.
    fn reload_lights(&mut self) {
        let read = || -> Result<_> {
            let (files, name) = self.source.open()?;
            let path = relight::light::lights_file(&name);
            let bytes = files.read(&path)?.unwrap_or_default();
            let text = String::from_utf8_lossy(&bytes).into_owned();
            Ok((relight::light::LightsByHand::parse(&text), path))
        };
        match read() {
            Ok(((file, wrong), path)) => {
                let same = (self.editor.as_ref()).is_some_and(|editor| editor.file() == file);
                if same {
                    return; // saved here
                }
                let changed = self.renderer.light_by_hand(&file);
                self.editor = None;
                self.message = Some(match (changed, wrong.first()) {
                    (Err(e), _) => e.to_string(),
                    (Ok(_), Some(wrong)) => format!("{path}: {wrong}"),
                    (Ok(changed), None) => match changed.unknown.first() {
                        Some(name) => format!("{path}: material {name} is not in the map"),
                        None => "lights reloaded".to_owned(),
                    },
                });
            }
            Err(e) => self.message = Some(format!("{e:#}")),
        }
    }
}
