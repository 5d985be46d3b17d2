//! `relight watch`: shows what is written, compiled or edited, and reports what becomes of it.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use anyhow::Result;
use relight::light::{ChangeableLights, LightsByHand};
use renderer_vk::MapLightChoice;

use super::lights::Editor;
use super::source::{Finder, Progress};
use super::state::{Viewer, Wake};
use crate::watched::{Compiled, Files, News, SourceText, Watched};

/// What has become of the newest version of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    /// No map has been read.
    Waits,
    /// It is compiled.
    Compiles(Instant),
    /// It is read; a picture follows.
    Reads,
    /// It is shown. Seconds from its being saved to the end of its first picture; `None` if it was there at the start.
    Shown(Option<f32>),
    /// It cannot be shown.
    Failed,
}

/// A followed map.
pub struct Follow {
    watched: Watched,
    paths: Vec<PathBuf>,
    /// The newest state.
    pub state: State,
    /// Why a version cannot be shown; lines of text.
    pub problem: Option<String>,
    /// What the compiler has found.
    pub note: Option<String>,
    /// Number of versions that have been shown.
    pub shown: u32,
    /// Seconds that reading the newest version took, without its first picture.
    pub read: f32,
    /// Seconds that the compiler took.
    compiled: Option<f32>,
    /// A version that the next picture shows, and when it was saved.
    pending: Option<Option<SystemTime>>,
    /// The search for the lights of an earlier version.
    finder: Option<Finder>,
    /// Changes of lights that are not saved, kept while another map or other lights are loaded.
    edits: Option<LightsByHand>,
}

impl Follow {
    /// Begins to follow files.
    pub fn begin(files: &Files, wake: &Wake) -> Self {
        let woken = Arc::clone(wake);
        let source = files.source.as_ref().map(|(path, _)| path.clone());
        Self {
            watched: Watched::begin(files.clone(), move || woken()),
            paths: source.into_iter().chain([files.bsp.clone()]).collect(),
            state: State::Waits,
            problem: None,
            note: None,
            shown: 0,
            read: 0.0,
            compiled: None,
            pending: None,
            finder: None,
            edits: None,
        }
    }

    /// The state in a line.
    pub fn line(&self) -> String {
        match self.state {
            State::Waits => "waiting for the map".to_owned(),
            State::Compiles(since) => format!("compiling {} s", since.elapsed().as_secs()),
            State::Reads => "reading".to_owned(),
            State::Shown(seconds) => {
                let after = seconds.map(|s| format!(" {s:.1} s after save"));
                let compiled = self.compiled.map(|s| format!(", compiled in {s:.1} s"));
                let leaks = self.note.as_ref().map(|_| ", leaks");
                format!(
                    "shown{}{}{}",
                    after.unwrap_or_default(),
                    compiled.unwrap_or_default(),
                    leaks.unwrap_or_default()
                )
            }
            State::Failed => {
                let problem = self.problem.as_deref().unwrap_or_default();
                format!("not shown: {}", problem.lines().next().unwrap_or_default())
            }
        }
    }

    /// The files in a line.
    pub fn files(&self) -> String {
        let names = self.paths.iter().map(|path| path.display().to_string());
        names.collect::<Vec<_>>().join(", ")
    }

    fn fails(&mut self, why: String) {
        self.problem = Some(why);
        self.state = State::Failed;
    }
}

impl Viewer {
    /// Takes over what has happened to the files of a followed map.
    pub(super) fn follow_watched(&mut self) {
        let Some(follow) = &mut self.follow else {
            return;
        };
        let news = follow.watched.take();
        // of several compiled maps the newest is shown
        let last = news.iter().rposition(|new| matches!(new, News::Map { .. }));
        for (number, new) in news.into_iter().enumerate() {
            match new {
                News::Map { map, text, saved } if Some(number) == last => {
                    self.show_compiled(map, text, saved);
                }
                News::Map { .. } => {}
                News::Entities { text, saved } => self.show_entities(text, saved),
                News::Compiles => self.with_follow(|follow| {
                    follow.state = State::Compiles(Instant::now());
                    follow.compiled = None;
                    follow.note = None;
                    follow.problem = None;
                }),
                News::Compiled { seconds, note } => self.with_follow(|follow| {
                    follow.compiled = Some(seconds);
                    follow.note = note;
                }),
                News::Failed(why) => self.with_follow(|follow| follow.fails(why)),
            }
        }
        self.follow_title();
    }

    fn with_follow(&mut self, change: impl FnOnce(&mut Follow)) {
        if let Some(follow) = &mut self.follow {
            change(follow);
        }
    }

    /// The title of the window shows the state, seconds of a compiler included.
    fn follow_title(&mut self) {
        if let Some(follow) = &self.follow {
            let name = follow.paths.first().and_then(|path| path.file_name());
            let name = name.unwrap_or_default().to_string_lossy();
            let title = format!("{name} – {} – Relight", follow.line());
            if self.shown_title.as_ref() != Some(&title) {
                self.shown_title = Some(title.clone());
                self.title = Some(title);
            }
        }
    }

    /// Loads a compiled map; the picture before stays if that fails.
    fn show_compiled(
        &mut self,
        map: Compiled,
        text: Option<Arc<SourceText>>,
        saved: Option<SystemTime>,
    ) {
        let begin = Instant::now();
        let before = self.source.followed.clone();
        if let Some(followed) = &mut self.source.followed {
            followed.map = Some(map);
            followed.text = text;
        }
        let loaded = self.load_again();
        if loaded.is_err() {
            self.source.followed = before;
        }
        self.loaded(loaded, begin, saved);
    }

    /// Lights the map by other entities: at once, or by loading it again.
    fn show_entities(&mut self, text: Arc<SourceText>, saved: SystemTime) {
        if let Some(followed) = &mut self.source.followed {
            followed.text = Some(Arc::clone(&text));
        }
        if self.map.is_none() {
            return; // the compiled map will be shown with them
        }
        let begin = Instant::now();
        self.keep_edits();
        self.with_follow(|follow| follow.compiled = None);
        let changed = match self.renderer.light_by_entities(text.entities()) {
            Ok(true) => Ok(()),
            Ok(false) => self.load_again(),
            Err(e) => Err(e.into()),
        };
        self.loaded(changed, begin, Some(saved));
    }

    fn loaded(&mut self, loaded: Result<()>, begin: Instant, saved: Option<SystemTime>) {
        self.message = None;
        self.complete_frames = 0;
        self.with_follow(|follow| match loaded {
            Ok(()) => {
                follow.pending = Some(saved);
                follow.read = begin.elapsed().as_secs_f32();
                follow.problem = None;
                // a compiler may still be at work on a newer text
                if !matches!(follow.state, State::Compiles(_)) || follow.compiled.is_some() {
                    follow.state = State::Reads;
                }
            }
            Err(e) => follow.fails(format!("{e:#}")),
        });
    }

    /// After a picture: a version that was read is now shown.
    pub(super) fn note_shown(&mut self) {
        let drawn = self.renderer.world().is_some() && (self.complete_frames > 0);
        self.with_follow(|follow| {
            if !drawn {
                return;
            }
            let Some(saved) = follow.pending.take() else {
                return;
            };
            follow.shown += 1;
            if follow.state == State::Reads {
                let after = |saved: SystemTime| saved.elapsed().unwrap_or_default().as_secs_f32();
                follow.state = State::Shown(saved.map(after));
            }
        });
        self.follow_title();
    }

    /// Whether the map's lights are searched in its lightmaps: not before its first picture, and not if a `.map` states
    /// them.
    pub(super) fn needs_finder(&mut self) -> bool {
        if self.source.followed.is_none() {
            return true;
        }
        // that of the map before cannot be ended
        let old = self
            .follow
            .as_mut()
            .and_then(|follow| follow.finder.as_mut());
        if old.is_some_and(|finder| matches!(finder.update(), Progress::Part(_))) {
            return false;
        }
        self.with_follow(|follow| follow.finder = None);
        let world = self.renderer.world();
        let Some(followed) = &self.source.followed else {
            return true;
        };
        followed.files.source.is_none()
            && self.settings.rt_lights == MapLightChoice::Calibrated
            && self.complete_frames > 1
            && world.is_some_and(|world| !world.relit.bsp.lightmaps.is_empty())
    }

    /// Forgets the list of lights; changes that are not saved are made again when there is a list again.
    pub(super) fn keep_edits(&mut self) {
        let editor = self.editor.take().filter(Editor::is_changed);
        if let (Some(follow), Some(editor)) = (&mut self.follow, editor) {
            follow.edits = Some(editor.file());
        }
    }

    /// Keeps a search for lights until it ends.
    pub(super) fn keep_finder(&mut self) {
        let finder = self.finder.take();
        if let Some(follow) = &mut self.follow
            && follow.finder.is_none()
        {
            follow.finder = finder;
        }
    }

    /// Makes kept changes of lights again.
    pub(super) fn restore_edits(&mut self) {
        let edits = self.follow.as_mut().and_then(|follow| follow.edits.take());
        let Some(edits) = edits else {
            return;
        };
        if let Err(e) = self.renderer.light_by_hand(&edits) {
            self.message = Some(e.to_string());
        }
        let world = self.renderer.world();
        if let (Some(editor), Some(world)) = (&mut self.editor, world) {
            editor.show(&ChangeableLights::of(&world.relit));
        }
    }
}
