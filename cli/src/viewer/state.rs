//! What the viewer shows and does, independent of the window system: a frame of input in, a picture out.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::ValueEnum;
use glam::{UVec2, Vec2};
use gui::egui::{self, PlatformOutput, RawInput};
use gui::{Change, CostHistory, Gui, Motion, Screen};
use relight::light::ChangeableLights;
use relight::probe::Probe;
use relight::viewpoints::Viewpoint;
use relight::{GameFiles, Materials};
use renderer_vk::api::{Look, Picture, RefDef, RefEntity};
use renderer_vk::settings::{Given, Preset, flags, row};
use renderer_vk::{MapLightChoice, Renderer, Settings};
use shaderscript::Diagnostic;

use super::follow::Follow;
use super::lights::Editor;
use super::picked::Picked;
use super::source::{Changes, Finder, Source};
use crate::chosen::ChosenCamera;
use crate::view::Camera;

/// What the window shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Shown {
    /// As the engine's own renderer draws it.
    Classic,
    /// Ray traced in real time, denoised.
    Traced,
    /// The classic look on the left, the traced look on the right of an edge that can be moved.
    Split,
    /// Ray traced, the mean of all frames since the camera moved.
    Reference,
    /// The classic look with traced shadows of models and lights, and traced reflections.
    Hybrid,
}

impl Shown {
    /// Whether it shows the traced look, which needs the lights of the map.
    pub(super) fn is_traced(self) -> bool {
        !matches!(self, Self::Classic | Self::Hybrid)
    }
}

/// Options of a viewer.
pub struct Start {
    /// The map.
    pub source: Source,
    /// Folder of cached results.
    pub cache: PathBuf,
    /// What is shown first.
    pub shown: Shown,
    /// Settings at the start.
    pub settings: Settings,
    /// The first camera.
    pub place: ChosenCamera,
}

/// Wakes the window's loop from another thread.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Result of a frame.
pub struct Frame {
    /// What egui requests of the window.
    pub output: PlatformOutput,
    /// The next frame would be the same, unless something happens.
    pub at_rest: bool,
}

/// What is dragged over the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Handle {
    /// The camera turns.
    Camera,
    /// The edge of the split screen.
    Edge,
    /// The selected light, along an axis.
    Axis(usize),
    /// The selected light, parallel to the picture.
    Light,
}

/// The materials of a game and the diagnostics of its scripts.
pub type Scripts = (Materials, Vec<Diagnostic>);

/// The loaded map.
pub struct Map {
    /// Its game path.
    pub name: String,
    pub files: Arc<dyn GameFiles>,
    pub scripts: Arc<Scripts>,
    pub entities: Vec<RefEntity>,
    /// Cameras by name.
    pub cameras: Vec<(String, Camera)>,
    /// Made at the first use.
    pub probe: Option<Probe>,
}

/// Steps of the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// A picture with a message is shown next.
    Opens,
    /// The map is loaded in the next frame.
    Loads,
    /// A map is shown.
    Shows,
}

/// The viewer.
pub struct Viewer {
    pub(super) renderer: Renderer,
    pub(super) gui: Gui,
    pub(super) source: Source,
    pub(super) cache: PathBuf,
    pub(super) wake: Wake,
    stage: Stage,
    pub(super) shown: Shown,
    pub(super) settings: Settings,
    pub(super) motion: Motion,
    pub(super) place: ChosenCamera,
    pub(super) map: Option<Map>,
    pub(super) finder: Option<Finder>,
    /// The lights of the map are known to the renderer.
    pub(super) found: bool,
    pub(super) changes: Changes,
    /// `relight watch`.
    pub(super) follow: Option<Follow>,
    pub(super) editor: Option<Editor>,
    pub(super) lights_path: Option<PathBuf>,
    pub(super) picked: Option<Picked>,
    pub(super) costs: CostHistory,
    /// Mean time of a frame, seconds.
    pub(super) frame_seconds: f32,
    /// CPU time of the panels in the newest frame, milliseconds.
    pub(super) panel_ms: f32,
    /// Result of the newest action.
    pub(super) message: Option<String>,
    pub(super) panel: bool,
    pub(super) animates: bool,
    pub(super) filter: String,
    /// Place of the edge of the split screen, part of the view's width.
    pub(super) split: f32,
    /// Frames of a reference.
    pub(super) wanted_frames: u32,
    pub(super) dragged: Option<Handle>,
    time: f32,
    /// Rectangle of the view in the newest frame, points.
    pub(super) view_rect: egui::Rect,
    /// Frames shown since the look is complete.
    pub(super) complete_frames: u32,
    pub(super) title: Option<String>,
    /// The title of a followed map.
    pub(super) shown_title: Option<String>,
    opened: Instant,
    /// Seconds from the start to the first picture of the map.
    pub(super) first_picture: Option<f32>,
}

/// Frames after which a denoised picture is calm enough for a screenshot.
const CALM: u32 = 16;

impl Viewer {
    /// A viewer whose map is loaded in its first frames.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn new(
        mut renderer: Renderer,
        start: Start,
        wake: Box<dyn Fn() + Send + Sync>,
    ) -> Result<Self> {
        let wake: Wake = Arc::from(wake);
        let mut settings = start.settings;
        if renderer.device_info().software && settings == Settings::full_size() {
            // a processor traces a picture of full size in seconds
            if let Some(low) = Preset::of("low") {
                low.put(&mut settings)?;
            }
        }
        renderer.keep_calibrations(Some(start.cache.clone()));
        // the built-in materials draw the panels until the map is loaded
        let none = Arc::new(relight::MemoryFiles::new());
        renderer.begin_registration(none, &settings)?;
        let woken = Arc::clone(&wake);
        let changes = Changes::watch(&start.source, move || woken());
        let follow = start.source.followed.as_ref();
        let follow = follow.map(|followed| Follow::begin(&followed.files, &wake));
        Ok(Self {
            renderer,
            gui: Gui::new(),
            source: start.source,
            cache: start.cache,
            wake,
            stage: Stage::Opens,
            shown: start.shown,
            settings,
            motion: Motion::new(Viewpoint::default()),
            place: start.place,
            map: None,
            finder: None,
            found: false,
            changes,
            follow,
            editor: None,
            lights_path: None,
            picked: None,
            costs: CostHistory::default(),
            frame_seconds: 0.0,
            panel_ms: 0.0,
            message: None,
            panel: true,
            animates: true,
            filter: String::new(),
            split: 0.5,
            wanted_frames: 1024,
            dragged: None,
            time: 0.0,
            view_rect: egui::Rect::NOTHING,
            complete_frames: 0,
            title: None,
            shown_title: None,
            opened: Instant::now(),
            first_picture: None,
        })
    }

    /// egui's state, for the window's events.
    pub fn context(&self) -> &egui::Context {
        self.gui.context()
    }

    /// A new title of the window.
    pub fn take_title(&mut self) -> Option<String> {
        self.title.take()
    }

    /// Changes the size of the picture, pixels; 0 while the window is minimised.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn resize(&mut self, width: u32, height: u32) -> Result<()> {
        self.renderer.set_hidden(width == 0 || height == 0);
        if width > 0 && height > 0 {
            self.renderer.resize(width, height)?;
        }
        Ok(())
    }

    /// Whether the picture is what was requested: the look is complete, and calm or averaged.
    pub fn is_ready(&self) -> bool {
        let calm = match self.shown {
            Shown::Classic | Shown::Hybrid => 2,
            Shown::Traced | Shown::Split => CALM,
            Shown::Reference => self.wanted_frames,
        };
        self.complete_frames >= calm
    }

    /// What the window shows.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn picture(&mut self) -> Result<Picture> {
        Ok(self.renderer.read_pixels()?)
    }

    /// The files of a map that is being made.
    pub fn followed(&self) -> Option<&Follow> {
        self.follow.as_ref()
    }

    /// Hides the panel.
    pub fn hide_panel(&mut self) {
        self.panel = false;
    }

    /// Ends; returns the messages of the validation layer.
    pub fn end(self) -> Vec<String> {
        self.renderer.validation_messages()
    }

    /// Runs a frame: input, motion, panels, picture.
    ///
    /// # Errors
    /// The map cannot be read at the start, or the device is lost or out of memory.
    pub fn frame(&mut self, input: RawInput, passed: Duration) -> Result<Frame> {
        match self.stage {
            Stage::Opens => self.stage = Stage::Loads,
            // loads what it is sent
            Stage::Loads if self.follow.is_some() => self.stage = Stage::Shows,
            Stage::Loads => {
                self.load()?;
                self.stage = Stage::Shows;
            }
            Stage::Shows => {}
        }
        let seconds = passed.as_secs_f32();
        self.frame_seconds += (seconds - self.frame_seconds) * 0.1;
        self.follow_watched();
        let collecting = self.follow_files();
        self.follow_finder();
        let begin = Instant::now();
        let mut changes = Vec::new();
        let mut gui = std::mem::take(&mut self.gui);
        let (ui, output) = gui.run(input, |context| {
            changes.clear();
            self.panels(context, &mut changes);
        });
        self.gui = gui;
        self.panel_ms = begin.elapsed().as_secs_f32() * 1000.0;
        self.change(&changes)?;
        let moved = self.advance(seconds);
        self.draw(ui)?;
        self.note_shown();
        let wants = self.gui.context().has_requested_repaint();
        let waits = self.follow.is_some() && self.map.is_none();
        let rests = waits || self.is_ready() && (!self.animates || self.shown == Shown::Reference);
        Ok(Frame {
            output,
            at_rest: rests && !moved && !collecting && !wants && changes.is_empty(),
        })
    }

    /// Whether the traced look can be shown. A map that is being made has the light of its directives and entities until
    /// the search for its lights has ended.
    pub(super) fn can_trace(&self) -> bool {
        self.found || self.follow.is_some()
    }

    /// The list of lights, once they are found and traced.
    pub(super) fn prepare_editor(&mut self) {
        if self.editor.is_none() && self.renderer.is_ready_to_trace() {
            self.prepare_probe();
            let before = self.renderer.lights_before_hand();
            let now = self
                .renderer
                .world()
                .map(|w| ChangeableLights::of(&w.relit));
            self.editor = before
                .zip(now)
                .map(|(before, now)| Editor::new(before, now));
            self.restore_edits();
        }
    }

    /// Shows the changes of the list of lights.
    pub(super) fn apply_lights(&mut self) {
        let Some(editor) = &self.editor else {
            return;
        };
        match self.renderer.light_by_hand(&editor.file()) {
            Ok(changed) => {
                self.message = Some(format!("lights changed in {:.2} s", changed.seconds));
            }
            Err(e) => self.message = Some(e.to_string()),
        }
    }

    /// Sets settings.
    fn change(&mut self, changes: &[Change]) -> Result<()> {
        let mut latched = false;
        for change in changes {
            let Some(row) = row(change.name) else {
                continue;
            };
            if change.name == "rt_accumulate" {
                self.shown = match change.value == "0" {
                    true => Shown::Traced,
                    false => Shown::Reference,
                };
            }
            row.put(&mut self.settings, &Given::parse(&change.value))?;
            latched |= row.spec.flags & flags::LATCH != 0;
        }
        if latched {
            self.reload();
        }
        Ok(())
    }

    /// Moves the camera and the time; whether the camera moves.
    fn advance(&mut self, seconds: f32) -> bool {
        if self.animates && self.shown != Shown::Reference {
            self.time += seconds;
        }
        if self.motion.walks {
            self.prepare_probe();
        }
        let context = self.gui.context();
        if context.wants_keyboard_input() {
            return false;
        }
        let probe = self.map.as_ref().and_then(|map| map.probe.as_ref());
        context.input(|input| self.motion.advance(input, seconds, probe))
    }

    pub(super) fn prepare_probe(&mut self) {
        if let (Some(map), Some(world)) = (&mut self.map, self.renderer.world()) {
            map.probe.get_or_insert_with(|| Probe::new(&world.relit));
        }
    }

    /// The view's rectangle, pixels.
    fn view_pixels(&self) -> Option<(UVec2, UVec2)> {
        let scale = self.gui.context().pixels_per_point();
        let (width, height) = self.renderer.size();
        let limit = UVec2::new(width, height);
        let pixels = |p: egui::Pos2| {
            (Vec2::new(p.x, p.y) * scale)
                .round()
                .max(Vec2::ZERO)
                .as_uvec2()
        };
        let low = pixels(self.view_rect.min).min(limit);
        let high = pixels(self.view_rect.max).min(limit);
        (high.cmpgt(low + 8)).all().then(|| (low, high - low))
    }

    /// The view of the newest frame.
    pub(super) fn view(&self) -> Option<RefDef> {
        let (corner, size) = self.view_pixels()?;
        Some(RefDef {
            x: corner.x as i32,
            y: corner.y as i32,
            time_ms: (self.time * 1000.0) as i32,
            ..Camera::from(self.motion.camera).ref_def((size.x, size.y), FOV)
        })
    }

    /// Projection of the view to the window, points.
    pub(super) fn screen(&self) -> Option<Screen> {
        let def = self.view()?;
        let rect = self.view_rect;
        let corner = Vec2::new(rect.left(), rect.top());
        Some(Screen::of(
            &def,
            corner,
            Vec2::new(rect.width(), rect.height()),
        ))
    }

    /// Names the surface at a place of the window, points.
    pub(super) fn pick(&mut self, at: Vec2) {
        self.prepare_probe();
        let Some(screen) = self.screen() else {
            return;
        };
        let (Some(map), Some(world)) = (&self.map, self.renderer.world()) else {
            return;
        };
        let Some(probe) = &map.probe else {
            return;
        };
        let (camera, ray) = (&self.motion.camera, screen.ray(at));
        let [forward, ..] = camera.axis();
        // what lies before the near plane is not drawn
        let near = camera.origin + ray * (self.settings.znear / ray.dot(forward));
        let met = probe.surface(near, ray);
        self.picked =
            met.and_then(|met| Picked::new(&world.relit, probe, met, &*map.files, &map.scripts));
    }

    /// Draws the looks, then the panels.
    fn draw(&mut self, ui: renderer_vk::api::UiFrame) -> Result<()> {
        let traces = self.shown.is_traced() && self.can_trace();
        let drawn = match self.shown {
            Shown::Hybrid => Look::Hybrid,
            _ => Look::Classic,
        };
        self.settings.rt = if traces { Look::Traced } else { drawn };
        self.settings.rt_accumulate = self.shown == Shown::Reference;
        match self.found || self.follow.is_none() {
            true => self.renderer.set_settings(&self.settings),
            false => self.renderer.set_settings(&Settings {
                rt_lights: MapLightChoice::Prior,
                ..self.settings.clone()
            }),
        }
        self.renderer.begin_frame((self.time * 1000.0) as i32);
        let def = self.view();
        // after a failed reload there may be none
        let loaded = self.renderer.world().is_some();
        if let (Some(def), Some(map), true) = (def, &self.map, loaded) {
            let mut view = |def: &RefDef| {
                self.renderer.clear_scene();
                for entity in &map.entities {
                    self.renderer.add_entity(entity);
                }
                self.renderer.render_scene(def)
            };
            if traces {
                view(&RefDef {
                    look: Some(Look::Traced),
                    ..def
                })?;
            }
            if !traces || self.shown == Shown::Split {
                let width = (def.width as f32 * self.split) as i32;
                let part = traces.then_some([def.x, def.y, width, def.height]);
                view(&RefDef {
                    look: Some(drawn),
                    part,
                    ..def
                })?;
            }
            let complete = traces || !self.shown.is_traced();
            self.complete_frames = match (complete, self.shown) {
                (false, _) => 0,
                (true, Shown::Reference) => self.renderer.accumulated_frames(),
                (true, _) => self.complete_frames.saturating_add(1),
            };
            let opened = self.opened;
            self.first_picture
                .get_or_insert_with(|| opened.elapsed().as_secs_f32());
        }
        self.renderer.draw_ui(ui)?;
        self.renderer.end_frame()?;
        if traces {
            self.prepare_editor();
        }
        self.costs.add(&self.renderer.timings());
        Ok(())
    }
}

/// Horizontal field of view, degrees.
pub const FOV: f32 = 90.0;
