//! Sessions of the stand-in engine in processes of their own, below the Vulkan layer of the crate `layer`, which limits
//! the device and makes calls fail. The program `session` plays them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use relight::compare::Rgb8;
use tempfile::TempDir;

use crate::data;
use crate::engine::is_validation;

/// The layer's name in its manifest.
const NAME: &str = "VK_LAYER_RELIGHT_test";
const VALIDATION: &str = "VK_LAYER_KHRONOS_validation";
/// A session that takes longer hangs.
const LIMIT: Duration = Duration::from_secs(300);

/// The folder with the layer's manifest.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let manifest = serde_json::json!({
            "file_format_version": "1.2.0",
            "layer": {
                "name": NAME,
                "type": "GLOBAL",
                "library_path": data::built("layer", "layer"),
                "api_version": "1.3.239",
                "implementation_version": "1",
                "device_extensions": [
                    { "name": "VK_KHR_present_id", "spec_version": "1" },
                    {
                        "name": "VK_KHR_present_wait",
                        "spec_version": "1",
                        "entrypoints": ["vkWaitForPresentKHR"],
                    },
                ],
                "description": "limits a device and makes calls fail, for tests",
            },
        });
        std::fs::write(folder.path().join("layer.json"), manifest.to_string())
            .expect("a file in it");
        folder
    });
    folder.path()
}

/// A session to be played.
#[derive(Clone, Debug, Default)]
pub struct Session {
    /// Files of the devices that the driver seems to have; none: the driver's own.
    pub profiles: Vec<PathBuf>,
    /// `FUNCTION NUMBER RESULT`: the call that fails.
    pub fault: Option<String>,
    /// Sizes that the window has one after the other, `WIDTHxHEIGHT`; 0x0 is minimised.
    pub sizes: Vec<&'static str>,
    /// Emulated `VK_KHR_present_wait`: refresh interval of the display in milliseconds, or `mute`: waits time out.
    pub display: Option<&'static str>,
    /// Arguments of the program `session`.
    pub arguments: Vec<String>,
}

/// What became of a session.
#[derive(Debug)]
pub struct Outcome {
    /// The program's standard output and error.
    pub text: String,
    /// Why the session failed; `None` if it ended as sessions may.
    pub failure: Option<String>,
    /// The message with which the renderer ended the game.
    pub ended: Option<String>,
    /// The messages after which the session began anew.
    pub errors: Vec<String>,
    /// Calls of each function, and the results that it may return.
    pub calls: BTreeMap<String, (u32, Vec<String>)>,
    /// With a display: for each acquired image, the number of pictures that were presented and not shown yet.
    pub queued: Vec<usize>,
    /// With a display: number of waits for it with a timeout above zero.
    pub waits: usize,
    /// Functions that the layer does not know.
    pub unknown: Vec<String>,
    /// Whether the fault occurred.
    pub struck: bool,
    /// Pictures by name.
    pub pictures: BTreeMap<String, Rgb8>,
}

impl Session {
    /// Plays it.
    ///
    /// # Panics
    /// When the program cannot be started.
    pub fn play(&self, program: &Path) -> Outcome {
        let folder = tempfile::tempdir().expect("a folder");
        let (log, output) = (folder.path().join("calls"), folder.path().join("output"));
        let file = std::fs::File::create(&output).expect("a file in it");
        let mut command = Command::new(program);
        command
            .arg(folder.path())
            .args(&self.arguments)
            .env("RELIGHT_LIBRARY", data::library())
            .env("VK_ADD_LAYER_PATH", self::folder())
            .env("RELIGHT_LAYER_LOG", &log)
            // What the program leaves behind, such as a copy of the library, goes with the folder.
            .env("TMPDIR", folder.path())
            // Mesa's own layer crashes where a call fails.
            .env("NODEVICE_SELECT", "1")
            .stdin(Stdio::null())
            .stderr(file.try_clone().expect("the same file"))
            .stdout(file);
        // The layer nearest to the application comes first. Above the validation layer it hides what it makes fail;
        // below it, the validation layer sees the limited device.
        if self.profiles.is_empty() {
            command.env("VK_INSTANCE_LAYERS", format!("{NAME}:{VALIDATION}"));
        } else {
            let files = std::env::join_paths(&self.profiles).expect("paths without colons");
            command
                .env("VK_INSTANCE_LAYERS", format!("{VALIDATION}:{NAME}"))
                .env("RELIGHT_LAYER_PROFILE", files);
        }
        if !self.sizes.is_empty() {
            command.env("RELIGHT_LAYER_SIZES", self.sizes.join(" "));
        }
        if let Some(display) = self.display {
            command.env("RELIGHT_LAYER_DISPLAY", display);
        }
        if let Some(fault) = &self.fault {
            command.env("RELIGHT_LAYER_FAULT", fault);
        }
        let status = run(&mut command);
        let text = std::fs::read_to_string(&output).unwrap_or_default();
        let mut outcome = read(
            text,
            status,
            &std::fs::read_to_string(&log).unwrap_or_default(),
        );
        for entry in std::fs::read_dir(folder.path())
            .expect("the folder")
            .flatten()
        {
            if let Some(name) = entry
                .file_name()
                .to_str()
                .and_then(|n| n.strip_suffix(".png"))
            {
                let image = image::open(entry.path()).expect("a picture").into_rgb8();
                let (width, height) = (image.width() as usize, image.height() as usize);
                let picture = Rgb8::new(width, height, image.into_raw()).expect("its size");
                outcome.pictures.insert(name.to_owned(), picture);
            }
        }
        outcome
    }
}

/// Runs the program to its end or to the limit; why it failed, if it did.
fn run(command: &mut Command) -> Option<String> {
    let mut child = command.spawn().expect("the program `session`");
    let start = Instant::now();
    loop {
        match child.try_wait().expect("the state of a child") {
            Some(status) => return (!status.success()).then(|| status.to_string()),
            None if start.elapsed() > LIMIT => {
                // It is gone if this fails.
                let _ = child.kill();
                let _ = child.wait();
                return Some(format!("it hung for {} s", LIMIT.as_secs()));
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

/// Reads the program's output and the layer's log.
fn read(text: String, failure: Option<String>, log: &str) -> Outcome {
    let after = |mark: &str| -> Vec<String> {
        let lines = text.lines().filter_map(|line| line.strip_prefix(mark));
        lines.map(str::to_owned).collect()
    };
    let bad = |line: &&str| {
        is_validation(line) || line.contains("a fault of its own") || line.contains("panicked")
    };
    let failure = failure.or_else(|| text.lines().find(bad).map(str::to_owned));
    let mut outcome = Outcome {
        failure,
        ended: after("ended: ").pop(),
        errors: after("error: "),
        calls: BTreeMap::new(),
        queued: Vec::new(),
        waits: 0,
        unknown: Vec::new(),
        struck: false,
        pictures: BTreeMap::new(),
        text,
    };
    for line in log.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["unknown", function] => outcome.unknown.push(function.to_owned()),
            ["struck", ..] => outcome.struck = true,
            ["queued", number] => outcome.queued.extend(number.parse::<usize>().ok()),
            ["waits"] => outcome.waits += 1,
            [function, number, results] => {
                let results = results.split(',').filter(|r| !r.is_empty());
                let call = outcome.calls.entry(function.to_owned()).or_default();
                call.0 = call.0.max(number.parse().unwrap_or(0));
                call.1 = results.map(str::to_owned).collect();
            }
            _ => {}
        }
    }
    outcome
}
