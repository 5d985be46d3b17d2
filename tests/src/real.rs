//! Debian's own ioquake3 with OpenArena's own packs, run by `scripts/engine` without a display, on one thread of
//! commands.

use std::collections::HashMap;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use relight::compare::Rgb8;

use crate::data;

/// One run of the engine.
pub struct Run {
    /// `opengl1`, `opengl2` or `vk`.
    pub renderer: &'static str,
    /// Window width in pixels.
    pub width: u32,
    /// Window height in pixels.
    pub height: u32,
    /// Console variables that are set before the renderer starts, at most 8.
    pub cvars: Vec<(String, String)>,
    /// Game files that lie above the game's packs.
    pub files: Vec<(String, Vec<u8>)>,
    /// Console commands; `quit` is added.
    pub commands: Vec<String>,
    /// Seconds after which the run has failed.
    pub limit: u32,
}

/// What a run left.
pub struct Outcome {
    /// 0 if the engine ended on command.
    pub status: Option<i32>,
    /// What it printed.
    pub log: String,
    /// Pictures that it made, by name.
    pub pictures: HashMap<String, Rgb8>,
}

/// Software rendering takes every core, so runs take turns, but for pairs: an engine loads on one core.
static TURN: Mutex<()> = Mutex::new(());

/// Whether the engine, the game and a display in memory are here; otherwise the test is reported as skipped.
pub fn available() -> bool {
    let engine = PathBuf::from("/usr/lib/ioquake3/ioquake3");
    if !engine.is_file() {
        let why = format!("{} is not installed", engine.display());
        testkit::absent(testkit::Need::Data, why);
        return false;
    }
    testkit::game().is_some() && data::tool("Xvfb").is_some() && data::tool("cc").is_some()
}

/// The game without what else lies beside it, as `scripts/engine` takes it: links to its own packs and its code.
fn base(game: &testkit::Game) -> PathBuf {
    let installation = std::env::var_os("GAME_DIR")
        .map_or_else(|| PathBuf::from("/usr/lib/openarena"), PathBuf::from);
    testkit::engine_base(game, &installation)
        .unwrap_or_else(|error| panic!("{}: {error}", installation.display()))
}

/// Commands that start `map` so that two runs draw the same frames, with the player flying where he was put.
///
/// Every frame is 25 ms of game time. The server sends the map's description at a pace of real time divided by
/// `timescale`, so with a large one the game starts in the same frame of every run.
pub fn start_map(map: &str) -> Vec<String> {
    [
        "set con_notifytime -1",
        "set com_maxfps 0",
        "set r_ignorehwgamma 1",
        "set cg_draw2D 0",
        "set cg_drawGun 0",
        "set g_spawnInvulnerability 0",
        &format!("devmap {map}"),
        "set fixedtime 25",
        "set timescale 1000",
        "wait 60",
        "noclip",
        "wait 8",
        "set timescale 1",
    ]
    .map(str::to_string)
    .to_vec()
}

/// Commands that put the camera to `x y z yaw`, draw `frames` frames and take the picture `name`.
pub fn picture(camera: &str, frames: u32, name: &str) -> Vec<String> {
    // `wait` counts twice a frame.
    vec![
        format!("setviewpos {camera}"),
        format!("wait {}", frames * 2),
        format!("screenshot {name}"),
        "wait 4".to_string(),
    ]
}

impl Run {
    /// Runs the engine to its end.
    ///
    /// # Panics
    /// When it cannot be started at all.
    pub fn go(&self) -> Outcome {
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        self.go_now()
    }

    /// Runs two engines beside each other to their ends.
    ///
    /// # Panics
    /// When one cannot be started at all.
    pub fn go_both(runs: [&Self; 2]) -> [Outcome; 2] {
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        std::thread::scope(|scope| {
            runs.map(|run| scope.spawn(|| run.go_now()))
                .map(|run| run.join().expect("a run that did not panic"))
        })
    }

    fn go_now(&self) -> Outcome {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (config, home, log) = (
            folder.path().join("run.cfg"),
            folder.path().join("home"),
            folder.path().join("log"),
        );
        let mut commands = self.commands.join("\n");
        commands.push_str("\nquit\n");
        std::fs::write(&config, commands).expect("the configuration is written");
        for (name, bytes) in &self.files {
            let path = home.join(".openarena/baseoa").join(name);
            let place = path
                .parent()
                .expect("a game file lies in the game's folder");
            std::fs::create_dir_all(place).expect("a folder in the temporary one");
            std::fs::write(&path, bytes).expect("a file in the temporary folder");
        }
        let mut script = Command::new(data::repository().join("scripts/engine"));
        if let Some(game) = testkit::game() {
            script.env("GAME_DIR", base(game));
        }
        script
            .arg("--config")
            .arg(&config)
            .arg("--home")
            .arg(&home)
            .arg("--log")
            .arg(&log);
        script.args([
            "--renderer",
            self.renderer,
            "--size",
            &format!("{}x{}", self.width, self.height),
        ]);
        script.args(["--limit", &self.limit.to_string()]);
        for (name, value) in &self.cvars {
            script.args(["--set", name, value]);
        }
        if self.renderer == "vk" {
            script.arg("--library").arg(data::library());
        }
        let status = script.status().expect("scripts/engine runs").code();
        let log = String::from_utf8_lossy(&std::fs::read(&log).unwrap_or_default()).into_owned();
        data::keep_text(&log, &format!("{}-{}", self.renderer, std::process::id()));
        let mut pictures = HashMap::new();
        for file in std::fs::read_dir(home.join(".openarena/baseoa/screenshots"))
            .into_iter()
            .flatten()
            .flatten()
        {
            let name = file.file_name().to_string_lossy().into_owned();
            let Some(stem) = name.strip_suffix(".tga") else {
                continue;
            };
            let bytes = std::fs::read(file.path()).expect("a file that was just listed");
            let image = relight::image::decode(&name, "tga", &bytes).expect("a picture");
            let pixels = image.pixels().flat_map(|[r, g, b, _]| [r, g, b]).collect();
            let picture =
                Rgb8::new(image.width as usize, image.height as usize, pixels).expect("its size");
            pictures.insert(stem.to_string(), picture);
        }
        Outcome {
            status,
            log,
            pictures,
        }
    }
}

impl Outcome {
    /// The picture of that name.
    ///
    /// # Panics
    /// With the end of the log when it was not made.
    pub fn picture(&self, name: &str) -> &Rgb8 {
        let Some(picture) = self.pictures.get(name) else {
            panic!("no picture {name}; the log ends:\n{}", self.log_end());
        };
        picture
    }

    /// Fails the test unless the engine ended by itself, without an error, a crash or a broken Vulkan rule, and
    /// with the renderer that it was given.
    ///
    /// # Panics
    /// With the end of the log.
    pub fn assert_clean(&self) {
        let bad = self.log.lines().find(|line| {
            if crate::engine::is_validation(line) {
                return true;
            }
            let line = line.to_ascii_lowercase();
            ["received signal", "error: ", "********", "panicked", "failed to load renderer"]
                .iter()
                .any(|b| line.contains(b))
                // The map's entities and scripts are the game's business.
                && !line.contains("warning")
        });
        assert!(
            bad.is_none(),
            "{}\nthe log ends:\n{}",
            bad.unwrap_or_default(),
            self.log_end()
        );
        assert_eq!(self.status, Some(0), "the log ends:\n{}", self.log_end());
    }

    /// The log's last lines.
    pub fn log_end(&self) -> String {
        let lines: Vec<&str> = self.log.lines().collect();
        lines[lines.len().saturating_sub(40)..].join("\n")
    }
}
