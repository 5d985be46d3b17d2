//! `relight view`: a window with a map.

mod app;
mod files;
mod follow;
mod lights;
mod panels;
mod picked;
mod picture;
mod source;
mod state;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::chosen::{ChosenCamera, ChosenMap};
use crate::pictures::check_name;
use crate::render::parse_size;
use crate::settings::SettingArgs;
pub use app::WindowOptions;
pub use follow::State;
pub use source::{Followed, Source};
pub use state::{Shown, Start, Viewer};

/// Show a map in a window: fly and walk through it, compare looks, change settings and lights
///
/// Needs no engine. W A S D move, Q and E go down and up, Shift is faster, the mouse turns while a button is held, a
/// click names the surface; 1 to 5 switch the look, G walks, H hides the panel. The window reloads the map when its
/// files change.
///
/// Examples: relight view oa_dm1; relight view my.bsp --look split; relight view --sample
#[derive(Args, Debug)]
pub struct ViewArgs {
    #[command(flatten)]
    chosen: ChosenMap,
    #[command(flatten)]
    window: WindowArgs,
    /// Write what the window shows, panel included, once the look is ready, and end (PNG, or JPEG by the ending .jpg)
    #[arg(long, value_name = "PATH")]
    screenshot: Option<PathBuf>,
}

// No documentation comment: clap would show it in place of the subcommand's description.
// The window, and what it shows first.
#[derive(Args, Debug)]
pub struct WindowArgs {
    /// What is shown at first
    #[arg(
        long = "look",
        value_enum,
        value_name = "LOOK",
        default_value = "traced",
        id = "shown"
    )]
    look: Shown,
    /// Size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    #[command(flatten)]
    place: ChosenCamera,
    /// File of lights that is read and saved in place of the one beside the map
    #[arg(long = "lights-file", value_name = "FILE")]
    lights: Option<PathBuf>,
    /// Cache calibrations, swept light lists and pipelines in this folder; default: the user's cache folder
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Enable Vulkan's validation layer; any message is an error
    #[arg(long)]
    validate: bool,
    #[command(flatten)]
    set: SettingArgs,
}

/// The user's cache folder of this program; `None` if the environment names none.
pub fn cache_folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let folder = if cfg!(windows) {
        PathBuf::from(set("LOCALAPPDATA")?)
    } else {
        match set("XDG_CACHE_HOME") {
            Some(folder) => PathBuf::from(folder),
            None => PathBuf::from(set("HOME")?).join(".cache"),
        }
    };
    Some(folder.join("relight"))
}

impl WindowArgs {
    /// The start of a viewer of this map, and its window.
    ///
    /// # Errors
    /// There is no folder for what is cached.
    pub fn start(&self, source: Source) -> Result<(Start, WindowOptions)> {
        let cache = self.cache.clone().or_else(cache_folder);
        let cache = cache.context(
            "no folder for cached lights: neither XDG_CACHE_HOME nor HOME is set; name one with --cache DIR",
        )?;
        let start = Start {
            source,
            cache,
            shown: self.look,
            settings: self.set.change([], renderer_vk::Settings::full_size()),
            place: self.place.clone(),
        };
        let options = WindowOptions {
            size: self.size,
            device: self.device.clone(),
            validation: self.validate,
            screenshot: None,
        };
        Ok((start, options))
    }

    /// The file of lights that is read and saved in place of the one beside the map.
    pub fn lights(&self) -> Option<PathBuf> {
        self.lights.clone()
    }
}

/// Shows a window until it is closed; messages of a validation layer that was asked for are an error.
///
/// # Errors
/// As those of [`app::run`].
pub fn show(start: Start, options: WindowOptions) -> Result<()> {
    let validates = options.validation;
    let messages = app::run(start, options)?;
    match messages.first() {
        Some(first) if validates => bail!(
            "the validation layer has {} messages, the first: {first}",
            messages.len()
        ),
        _ => Ok(()),
    }
}

/// Runs the command.
pub fn run(args: &ViewArgs) -> Result<()> {
    if let Some(path) = &args.screenshot {
        check_name(path)?;
    }
    let source = Source {
        chosen: args.chosen.clone(),
        lights: args.window.lights(),
        followed: None,
    };
    let (start, options) = args.window.start(source)?;
    // errors of the map are reported before a window appears
    start.source.open()?;
    let options = WindowOptions {
        screenshot: args.screenshot.clone(),
        ..options
    };
    show(start, options)
}
