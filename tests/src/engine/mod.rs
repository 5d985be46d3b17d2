//! A stand-in for the engine: it loads the renderer library, offers it the engine's services and drives it through
//! the life of a game, in a process that a test can look into.
//!
//! It has the tables of each supported engine ([`Tables`]). Towards a renderer it behaves as Debian's ioquake3 does:
//! console variables are live structures, temporary
//! memory is a stack, the hunk is thrown away whole, an error leaves the renderer by `longjmp` after it has been shut
//! down and registered anew from inside the call that raised it, the library is unloaded and loaded again by a video
//! restart. It is stricter where the real one would corrupt itself silently: see [`Engine::violations`].

pub mod abi;
pub mod allocations;
pub mod cvars;
mod exports;
pub mod files;
mod imports;
mod inspection;
mod lies;
pub mod memory;
mod quake3e;
mod surface;
mod tremulous;

use std::ffi::{CString, c_void};
use std::mem::MaybeUninit;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use libloading::Library;
use tempfile::TempDir;
use thiserror::Error;

use abi::{GetRefAPI, openarena, refEntity_t, refexport_t};
pub use exports::View;
use files::{Files, Packs};
use imports::{Film, State};
pub use imports::{Message, Tables};
pub use lies::Lies;
pub use quake3e::has_surfaces;

/// An error that the renderer raised through the engine's `Error`.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the renderer raised an error of level {level}: {message}")]
pub struct Raised {
    /// 0 ends the process, 1 drops the game.
    pub level: i32,
    /// Text of the message.
    pub message: String,
}

/// Why the library could not be used at all.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The dynamic linker's reason.
    #[error("{0}: {1}")]
    Library(PathBuf, libloading::Error),
    /// `GetRefAPI` gave no table.
    #[error("GetRefAPI returned NULL; the renderer printed: {0}")]
    Refused(String),
    /// It raised an error.
    #[error(transparent)]
    Raised(#[from] Raised),
    /// No temporary folder.
    #[error("no home folder: {0}")]
    Home(#[from] std::io::Error),
}

/// How the engine is to be started.
#[derive(Default)]
pub struct Options {
    /// `set NAME VALUE` before the renderer is loaded.
    pub cvars: Vec<(String, String)>,
    /// Files above the packs.
    pub files: Vec<(String, Vec<u8>)>,
    /// The game's packs.
    pub packs: Packs,
    /// What the engine's clock stands at, in milliseconds, until [`Engine::set_clock`] moves it. A clock that runs
    /// by itself where there is none.
    pub clock: Option<i32>,
    /// The engine whose services are offered.
    pub tables: Tables,
    /// What it does wrong.
    pub lies: Lies,
}

/// One engine process at a time: the library has one state.
static PROCESS: Mutex<()> = Mutex::new(());

/// The running stand-in. Shut down when dropped.
pub struct Engine {
    library: Option<Library>,
    source: Source,
    tables: Tables,
    lies: Lies,
    home: TempDir,
    _process: MutexGuard<'static, ()>,
}

/// Where the renderer comes from.
#[derive(Clone)]
enum Source {
    /// A library to be loaded.
    Library(PathBuf),
    /// The test itself.
    Linked(GetRefAPI),
}

/// Whether a line comes from Vulkan's validation layers.
pub fn is_validation(line: &str) -> bool {
    let line = line.to_ascii_lowercase();
    [
        "validation:",
        "validation error",
        "validation warning",
        "vuid-",
        "sync-hazard",
    ]
    .iter()
    .any(|w| line.contains(w))
}

/// Calls the renderer. An error that it raises ends the call and comes back as a value.
///
/// The closure is `Copy`, so that nothing in the frames that such an error jumps over has a destructor.
fn call<R: Copy>(f: impl FnOnce() -> R + Copy) -> Result<R, Raised> {
    struct Slot<F, R> {
        f: F,
        result: MaybeUninit<R>,
    }
    unsafe extern "C" fn thunk<F: FnOnce() -> R + Copy, R: Copy>(slot: *mut c_void) {
        // SAFETY: `call` passes its slot, which is valid until the call is over.
        let slot = unsafe { &mut *slot.cast::<Slot<F, R>>() };
        slot.result.write((slot.f)());
    }
    fn thunk_of<F: FnOnce() -> R + Copy, R: Copy>(
        _: &Slot<F, R>,
    ) -> unsafe extern "C" fn(*mut c_void) {
        thunk::<F, R>
    }
    let mut slot = Slot {
        f,
        result: MaybeUninit::uninit(),
    };
    let thunk = thunk_of(&slot);
    // SAFETY: the thunk gets the slot that it was made for.
    let level = unsafe { imports::stand_in_call(thunk, (&raw mut slot).cast()) };
    if level == -1 {
        // SAFETY: the thunk returned, so it has written the result.
        return Ok(unsafe { slot.result.assume_init() });
    }
    let message = imports::with(|s| s.raised.take())
        .flatten()
        .map_or_else(String::new, |(_, m)| m);
    Err(Raised { level, message })
}

/// The functions of a renderer for another engine as those of one for ioquake3.
macro_rules! as_ioquake3 {
    ($from:expr) => {
        as_ioquake3!($from, $from.BeginRegistration, $from.AddRefEntityToScene)
    };
    ($from:expr, $begin:expr, $add_entity:expr) => {
        refexport_t {
            AddRefEntityToScene: $add_entity,
            Shutdown: $from.Shutdown,
            BeginRegistration: $begin,
            RegisterModel: $from.RegisterModel,
            RegisterSkin: $from.RegisterSkin,
            RegisterShader: $from.RegisterShader,
            RegisterShaderNoMip: $from.RegisterShaderNoMip,
            LoadWorld: $from.LoadWorld,
            SetWorldVisData: $from.SetWorldVisData,
            EndRegistration: $from.EndRegistration,
            ClearScene: $from.ClearScene,
            AddPolyToScene: $from.AddPolyToScene,
            LightForPoint: $from.LightForPoint,
            AddLightToScene: $from.AddLightToScene,
            AddAdditiveLightToScene: $from.AddAdditiveLightToScene,
            RenderScene: $from.RenderScene,
            SetColor: $from.SetColor,
            DrawStretchPic: $from.DrawStretchPic,
            DrawStretchRaw: $from.DrawStretchRaw,
            UploadCinematic: $from.UploadCinematic,
            BeginFrame: $from.BeginFrame,
            EndFrame: $from.EndFrame,
            MarkFragments: $from.MarkFragments,
            LerpTag: $from.LerpTag,
            ModelBounds: $from.ModelBounds,
            RegisterFont: $from.RegisterFont,
            RemapShader: $from.RemapShader,
            GetEntityToken: $from.GetEntityToken,
            inPVS: $from.inPVS,
            TakeVideoFrame: $from.TakeVideoFrame,
        }
    };
}

/// `AddRefEntityToScene` of Quake3e with a `shaderTime` in seconds.
///
/// # Safety
/// That of the renderer's function.
unsafe extern "C" fn add_entity_in_seconds(entity: *const refEntity_t) {
    let add = imports::with(|s| s.quake3e.map(|re| re.AddRefEntityToScene)).flatten();
    if let Some(add) = add {
        // SAFETY: the caller's promise.
        unsafe { add(entity, 0) }
    }
}

/// Keeps the table that `GetRefAPI` returned.
///
/// # Safety
/// The pointer must be to the table of a renderer for this engine.
unsafe fn keep_exports(tables: Tables, exports: *const c_void) {
    let (mut quake3e, mut tremulous) = (None, None);
    let exports = match tables {
        // SAFETY: a table of this type, by the caller's promise.
        Tables::Ioquake3 | Tables::WorldOfPadman => unsafe { exports.cast::<refexport_t>().read() },
        Tables::OpenArena => {
            // SAFETY: as above.
            let re = unsafe { exports.cast::<openarena::refexport_t>().read() };
            as_ioquake3!(re)
        }
        Tables::Quake3e | Tables::Quake3eCutOff => {
            // SAFETY: as above.
            let re = *quake3e.insert(unsafe { exports.cast::<abi::quake3e::refexport_t>().read() });
            as_ioquake3!(re, re.BeginRegistration, add_entity_in_seconds)
        }
        Tables::Tremulous => {
            // SAFETY: as above.
            let re =
                *tremulous.insert(unsafe { exports.cast::<abi::tremulous::refexport_t>().read() });
            as_ioquake3!(re, tremulous::begin_registration, re.AddRefEntityToScene)
        }
    };
    imports::with(|s| {
        s.exports = Some(exports);
        s.quake3e = quake3e;
        s.tremulous = tremulous;
    });
}

/// The library under the file name that this engine loads.
fn library_of(tables: Tables) -> PathBuf {
    static COPY: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    let library = crate::data::library();
    if tables != Tables::Quake3e {
        return library;
    }
    // A copy, because the same file under another name would be the library that is loaded already.
    let (_, copy) = COPY.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let copy = folder.path().join("quake3e_vk_x86_64.so");
        std::fs::copy(&library, &copy).expect("a copy of the library");
        (folder, copy)
    });
    copy.clone()
}

/// Loads a renderer.
fn open_library(path: &Path) -> Result<(Library, GetRefAPI), LoadError> {
    let failed = |e| LoadError::Library(path.to_path_buf(), e);
    // SAFETY: the library's initializers are those of a Rust cdylib.
    let library = unsafe { Library::new(path) }.map_err(failed)?;
    // SAFETY: the symbol has this signature by the engine's interface.
    let entry = *unsafe { library.get::<GetRefAPI>(b"GetRefAPI\0") }.map_err(failed)?;
    Ok((library, entry))
}

/// `BeginRegistration` and what the engine registers right after it.
fn begin_registration(exports: refexport_t) -> Result<(), Raised> {
    let Some(config) = imports::with(|s| &raw mut *s.config) else {
        return Ok(());
    };
    // Renderers fill tables with random numbers when they start: the same ones each time.
    imports::seed_random_numbers();
    // SAFETY: the library is loaded; the structure stays where it is for as long as the engine exists.
    call(move || unsafe { (exports.BeginRegistration)(config) })?;
    imports::with(|s| s.registered = true);
    for name in [c"gfx/2d/bigchars", c"white", c"console"] {
        let name = name.as_ptr();
        // SAFETY: a literal.
        call(move || unsafe { (exports.RegisterShader)(name) })?;
    }
    Ok(())
}

/// Finds what a console command of the renderer's runs and sets its arguments; `set` is done at once.
fn prepare(text: &str) -> Option<unsafe extern "C" fn()> {
    let words: Vec<&str> = text.split_whitespace().collect();
    match words.as_slice() {
        [] => None,
        ["set" | "seta", name, value @ ..] => {
            imports::with(|s| s.cvars.set_by_user(name, &value.join(" ")));
            None
        }
        [name, ..] => {
            let arguments = words.iter().filter_map(|w| CString::new(*w).ok()).collect();
            let command = imports::with(|s| {
                s.arguments = arguments;
                s.commands.get(&name.to_ascii_lowercase()).copied()
            });
            let command = command.flatten();
            if command.is_none() {
                imports::violation(format!("unknown command {text:?}"));
            }
            command
        }
    }
}

impl Engine {
    /// Starts an engine with the library that cargo built, without a window, up to where menus are drawn.
    pub fn start(options: Options) -> Result<Self, LoadError> {
        Self::start_with(&library_of(options.tables), options)
    }

    /// The same with another library.
    pub fn start_with(library: &Path, options: Options) -> Result<Self, LoadError> {
        let mut engine = Self::load(library, options)?;
        engine.begin_registration()?;
        Ok(engine)
    }

    /// The same with the library linked into the test, so that both share an allocator.
    ///
    /// # Safety
    /// `entry` must be a renderer's `GetRefAPI`.
    pub unsafe fn start_linked(entry: *const (), options: Options) -> Result<Self, LoadError> {
        // SAFETY: the caller's promise.
        let entry = unsafe { std::mem::transmute::<*const (), GetRefAPI>(entry) };
        let mut engine = Self::load_from(Source::Linked(entry), options)?;
        engine.begin_registration()?;
        Ok(engine)
    }

    /// Loads the library under the file name that its engine loads; nothing is registered yet.
    pub fn load_named(options: Options) -> Result<Self, LoadError> {
        Self::load(&library_of(options.tables), options)
    }

    /// Loads the library and calls `GetRefAPI`; nothing is registered yet.
    pub fn load(library: &Path, options: Options) -> Result<Self, LoadError> {
        Self::load_from(Source::Library(library.to_path_buf()), options)
    }

    fn load_from(source: Source, options: Options) -> Result<Self, LoadError> {
        let process = PROCESS.lock().unwrap_or_else(PoisonError::into_inner);
        let home = tempfile::tempdir()?;
        let mut state = State {
            tables: options.tables,
            exports: None,
            quake3e: None,
            tremulous: None,
            // SAFETY: numbers and characters alone, for which zero is a value.
            config: Box::new(unsafe { std::mem::zeroed() }),
            cvars: cvars::Cvars::default(),
            commands: Default::default(),
            arguments: Vec::new(),
            buffer: Default::default(),
            files: Files::new(&options.files, options.packs, home.path().to_path_buf()),
            memory: memory::Memory::default(),
            lists: Vec::new(),
            messages: Vec::new(),
            raised: None,
            handling: false,
            damaged: None,
            registered: false,
            started: Instant::now(),
            clock: options.clock,
            visibility: None,
            everything_visible: vec![0xFF; 8192],
            video: Vec::new(),
            films: Vec::new(),
            film: Film::default(),
            windows: Vec::new(),
            window_events: Vec::new(),
        };
        let defaults = [
            ("r_headless", "1"),
            ("r_mode", "-1"),
            ("r_customwidth", "320"),
            ("r_customheight", "240"),
            ("r_vkValidation", "1"),
            ("r_fullscreen", "0"),
            ("r_ignorehwgamma", "1"),
            ("version", options.tables.version()),
        ];
        for (name, value) in defaults {
            state.cvars.set_by_user(name, value);
        }
        for (name, value) in &options.cvars {
            state.cvars.set_by_user(name, value);
        }
        imports::install(Some(state));
        let mut engine = Self {
            library: None,
            source,
            tables: options.tables,
            lies: options.lies,
            home,
            _process: process,
        };
        engine.load_library()?;
        Ok(engine)
    }

    /// Loads the library and calls `GetRefAPI`, also if both were done before.
    pub fn load_library(&mut self) -> Result<(), LoadError> {
        let get_ref_api = match &self.source {
            Source::Linked(entry) => *entry,
            Source::Library(path) => {
                let (library, entry) = open_library(path)?;
                self.library = Some(library);
                entry
            }
        };
        let exports = lies::get_ref_api(get_ref_api, self.tables, &self.lies)?;
        if exports.is_null() {
            let printed = self.messages().into_iter().map(|m| m.text).collect();
            return Err(LoadError::Refused(printed));
        }
        // SAFETY: not NULL, so it is the renderer's table.
        unsafe { keep_exports(self.tables, exports) };
        Ok(())
    }

    /// Loads another library for a moment and calls its `GetRefAPI`. Returns whether it serves this engine.
    pub fn load_beside(&mut self, library: &Path) -> Result<bool, LoadError> {
        let (_library, entry) = open_library(library)?;
        Ok(!lies::get_ref_api(entry, self.tables, &self.lies)?.is_null())
    }

    /// `BeginRegistration`, and the console's own shaders.
    pub fn begin_registration(&mut self) -> Result<(), Raised> {
        begin_registration(self.exports())
    }

    /// `Shutdown`, with the window or without.
    pub fn shutdown(&mut self, destroy_window: bool) -> Result<(), Raised> {
        let code = if destroy_window {
            self.tables.close_code()
        } else {
            0
        };
        self.shutdown_with(code)
    }

    /// `Shutdown` with the engine's own code.
    pub fn shutdown_with(&mut self, code: i32) -> Result<(), Raised> {
        let exports = self.exports();
        imports::with(|s| s.registered = false);
        // SAFETY: the library is loaded.
        call(move || unsafe { (exports.Shutdown)(code) })?;
        let left = imports::with(|s| s.commands.len()).unwrap_or(0);
        if left > 0 {
            imports::violation(format!("{left} commands were left after Shutdown"));
        }
        Ok(())
    }

    /// Starts a local map as the engine does: `Shutdown` twice, registration, loading screens, the world.
    pub fn start_map(&mut self, name: &str) -> Result<(), Raised> {
        self.shutdown(false)?;
        self.shutdown(false)?;
        imports::with(|s| s.memory.clear_hunk());
        self.load_collision_model(name);
        self.begin_registration()?;
        let picture = self.register_shader_no_mip("menu/art/unknownmap")?;
        for _ in 0..3 {
            self.begin_frame(0)?;
            self.draw_stretch_pic([0.0, 0.0, 320.0, 240.0], [0.0, 0.0, 1.0, 1.0], picture)?;
            self.end_frame()?;
        }
        self.load_world(name)?;
        self.end_registration()
    }

    /// Restarts the video: the hunk goes first, then the renderer, its library with it, and both come back.
    pub fn restart_video(&mut self) -> Result<(), LoadError> {
        self.restart_video_with(self.tables.close_code())
    }

    /// The same with the engine's own code for `Shutdown`.
    pub fn restart_video_with(&mut self, code: i32) -> Result<(), LoadError> {
        imports::with(|s| s.memory.clear_hunk());
        self.shutdown_with(code)?;
        self.library = None;
        imports::with(|s| s.exports = None);
        self.load_library()?;
        self.begin_registration()?;
        Ok(())
    }

    /// Reads the map's visibility, which the engine's collision code hands out.
    fn load_collision_model(&mut self, name: &str) {
        let visibility = imports::with(|s| s.files.read(name))
            .flatten()
            .and_then(|bytes| {
                let int = |at: usize| -> Option<usize> {
                    let four = bytes.get(at..at.checked_add(4)?)?;
                    usize::try_from(i32::from_le_bytes(four.try_into().ok()?)).ok()
                };
                // lump 16
                let (offset, length) = (int(8 + 16 * 8)?, int(8 + 16 * 8 + 4)?);
                let lump = bytes.get(offset..offset.checked_add(length)?)?;
                let (clusters, row) = (int(offset)?, int(offset + 4)?);
                let rows = lump.get(8..8 + clusters.checked_mul(row)?)?.to_vec();
                Some((clusters, row, rows))
            });
        imports::with(|s| s.visibility = visibility);
    }

    /// Runs a console command, then what it appended to the command buffer.
    pub fn command(&mut self, text: &str) -> Result<(), Raised> {
        let mut next = Some(text.to_string());
        while let Some(text) = next {
            if let Some(command) = prepare(&text) {
                // SAFETY: a command of the renderer, whose library is loaded.
                call(move || unsafe { command() })?;
            }
            next = imports::with(|s| s.buffer.pop_front()).flatten();
        }
        Ok(())
    }

    /// The functions of a renderer for Quake3e.
    ///
    /// # Panics
    /// With another engine's tables.
    fn quake3e(&self) -> abi::quake3e::refexport_t {
        imports::with(|s| s.quake3e)
            .flatten()
            .expect("Quake3e's tables")
    }

    fn exports(&self) -> refexport_t {
        imports::with(|s| s.exports)
            .flatten()
            .expect("the library is loaded")
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        if imports::with(|s| s.exports.is_some()) == Some(true) {
            let _ = self.shutdown(true);
        }
        self.library = None;
        imports::install(None);
    }
}
