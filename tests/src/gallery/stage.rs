//! What a scene makes its calls on.

use std::fmt::Display;
use std::ops::{Deref, DerefMut};
use std::path::{Path, PathBuf};

use glam::Vec3;
use relight::compare::Rgb8;

use super::{Scene, textures};
use crate::engine::abi::refEntity_t;
use crate::engine::files::Packs;
use crate::engine::{Engine, LoadError, Options, Raised, View};

/// Milliseconds that the clock stands at when a scene begins: neither 0 nor round, so that a time forgotten or
/// rounded shows.
pub const CLOCK: i32 = 12_345;

/// The stand-in engine with one of the renderers, and the outcomes gathered so far. Everything that [`Engine`] can do
/// is done on it directly.
pub struct Stage {
    engine: Engine,
    size: (i32, i32),
    clock: i32,
    folder: PathBuf,
    prefix: String,
    facts: String,
}

impl Stage {
    /// Starts the renderer in `library` for a scene, with console variables beside the scene's own; outcomes go to
    /// `folder`, which exists.
    pub fn start(
        beside: &[(&str, &str)],
        library: &Path,
        scene: &Scene,
        folder: &Path,
    ) -> Result<Self, LoadError> {
        let (width, height) = scene.size;
        let text = |(name, value): (&str, &str)| (name.to_string(), value.to_string());
        let mut cvars: Vec<(String, String)> = vec![
            ("r_customwidth".into(), width.to_string()),
            ("r_customheight".into(), height.to_string()),
        ];
        // As the engine has them, where the stand-in's own tests want them otherwise.
        cvars.push(text(("r_ignorehwgamma", "0")));
        cvars.push(text(("r_picmip", "0")));
        cvars.extend(scene.cvars.iter().chain(beside).copied().map(text));
        let mut files = textures::files();
        files.extend((scene.files)());
        let packs = match scene.packs.then(testkit::folder).flatten() {
            Some(folder) => Packs::open(&folder)?,
            None => Packs::default(),
        };
        let engine = Engine::start_with(
            library,
            Options {
                cvars,
                files,
                packs,
                clock: Some(CLOCK),
                ..Options::default()
            },
        )?;
        Ok(Self {
            engine,
            size: scene.size,
            clock: CLOCK,
            folder: folder.to_path_buf(),
            prefix: scene.name.to_string(),
            facts: String::new(),
        })
    }

    /// A camera that fills the window, 90 degrees wide, turned left by `yaw` degrees. Its time is the clock's.
    pub fn view(&self, origin: Vec3, yaw: f32) -> View {
        let mut view = View::new(origin, yaw);
        (view.width, view.height) = self.size;
        view.time = self.clock;
        view
    }

    /// Width and height of the window in pixels.
    pub fn size(&self) -> (i32, i32) {
        self.size
    }

    /// What the clock stands at, milliseconds.
    pub fn clock(&self) -> i32 {
        self.clock
    }

    /// Moves the clock to `milliseconds` after the scene's beginning.
    pub fn set_time(&mut self, milliseconds: i32) {
        self.clock = CLOCK + milliseconds;
        self.engine.set_clock(self.clock);
    }

    /// Draws a frame and keeps what it looks like under a name that is unique in the scene. The frame is drawn twice
    /// before, since some of what a renderer does takes effect a frame later.
    pub fn keep(
        &mut self,
        name: &str,
        mut draw: impl FnMut(&mut Engine) -> Result<(), Raised>,
    ) -> Result<(), Raised> {
        for _ in 0..2 {
            self.engine.begin_frame(0)?;
            draw(&mut self.engine)?;
            self.engine.end_frame()?;
        }
        self.keep_once(name, draw)
    }

    /// The same without the frames before.
    pub fn keep_once(
        &mut self,
        name: &str,
        draw: impl FnOnce(&mut Engine) -> Result<(), Raised>,
    ) -> Result<(), Raised> {
        let picture = self.engine.picture_of(|engine| {
            draw(engine)?;
            // The reference reads the picture back before it has drawn the last run of 2D pictures; another shader
            // ends that run. In the engine itself screenshots are requested between frames.
            for name in ["gfx/2d/bigchars", "white"] {
                let shader = engine.register_shader(name)?;
                engine.draw_stretch_pic([0.0; 4], [0.0; 4], shader)?;
            }
            Ok(())
        })?;
        self.keep_picture(name, &picture);
        Ok(())
    }

    /// Keeps the world in a view, and what `add` adds to it.
    pub fn keep_view(
        &mut self,
        name: &str,
        view: &View,
        add: impl Fn(&mut Engine) -> Result<(), Raised>,
    ) -> Result<(), Raised> {
        self.keep(name, |engine| {
            engine.clear_scene()?;
            add(engine)?;
            engine.render_scene(view)
        })
    }

    /// Keeps the world with these entities.
    pub fn keep_entities(
        &mut self,
        name: &str,
        view: &View,
        all: &[refEntity_t],
    ) -> Result<(), Raised> {
        self.keep_view(name, view, |e| {
            all.iter().try_for_each(|entity| e.add_entity(entity))
        })
    }

    /// Keeps a picture that came otherwise than by a screenshot.
    ///
    /// # Panics
    /// When it cannot be written.
    pub fn keep_picture(&mut self, name: &str, picture: &Rgb8) {
        let file = self.folder.join(format!("{}.{name}.png", self.prefix));
        let (width, height) = (picture.width() as u32, picture.height() as u32);
        image::RgbImage::from_raw(width, height, picture.pixels().to_vec())
            .expect("its size")
            .save(&file)
            .unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    }

    /// Keeps an answer of the renderer: numbers and words, compared one by one. Labels are unique in the scene.
    pub fn fact(&mut self, label: &str, value: impl Display) {
        let value = value.to_string().replace('\n', " ");
        self.facts.push_str(&format!("{label}\t{value}\n"));
    }

    /// Ends the scene and writes its facts down.
    pub(super) fn finish(self) -> std::io::Result<()> {
        let file = self.folder.join(format!("{}.txt", self.prefix));
        std::fs::write(file, &self.facts)
    }
}

impl Deref for Stage {
    type Target = Engine;
    fn deref(&self) -> &Engine {
        &self.engine
    }
}

impl DerefMut for Stage {
    fn deref_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }
}
