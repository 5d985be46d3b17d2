//! Delivers captures to the engine: reads pictures back from the renderer, encodes them, and passes them to the engine
//! after the renderer's state is back in its cell.

use crate::capture::{self, Format, Shot, VideoFrame};
use crate::cvars::{Cvar, c_text};
use crate::engine::Engine;
use crate::failure::Failure;
use crate::session::{Front, with_renderer};
use renderer_vk::Renderer;
use renderer_vk::api::Picture;
use renderer_vk::settings::Preset;
use std::borrow::Cow;
use std::ffi::c_int;

/// Output for the engine, delivered once the frame has ended and the state is back in its cell.
#[derive(Default)]
pub struct Outbox {
    /// Path in the user's game folder, contents, and whether to print no message.
    pub files: Vec<(String, Vec<u8>, bool)>,
    /// The engine's buffer and the number of bytes of the frame.
    pub video: Option<(*mut u8, c_int)>,
    /// Lines for the console, without line ends.
    pub lines: Vec<String>,
    /// Console variables to set, and their values.
    pub variables: Vec<(&'static str, Cow<'static, str>)>,
    /// Commands for the engine.
    pub commands: Vec<&'static str>,
    /// Time of the game for the frame, milliseconds.
    pub front_end_ms: c_int,
    /// Time of the renderer for ending the frame, milliseconds.
    pub back_end_ms: c_int,
}

impl Outbox {
    /// Sets the variables of a preset.
    pub fn set(&mut self, preset: &Preset) {
        let values = preset.values();
        self.variables
            .extend(values.map(|(name, value)| (name, Cow::Borrowed(value))));
    }
}

/// Takes captures requested between two frames. They show the previous frame, which is on the screen. During a frame,
/// or before the first one, captures wait for the frame's end.
pub fn take_captures_of_last_frame(engine: Engine) -> Result<(), Failure> {
    let outbox = with_renderer(|renderer, front| {
        let mut outbox = Outbox::default();
        if front.frame_start.is_none() && front.has_picture {
            take_captures(renderer, front, &mut outbox)?;
        }
        Ok(outbox)
    })?;
    deliver(engine, outbox);
    Ok(())
}

/// Takes the requested captures of the picture drawn so far.
pub fn take_captures(
    renderer: &mut Renderer,
    front: &mut Front,
    outbox: &mut Outbox,
) -> Result<(), Failure> {
    let shots = std::mem::take(&mut front.captures.shots);
    let video = front.captures.video.take();
    // With drawing disabled, captures are omitted, too.
    if front.settings.skip_back_end {
        return Ok(());
    }
    if shots.is_empty() && video.is_none() {
        return Ok(());
    }
    let picture = renderer.read_pixels().map_err(Failure::from)?;
    for shot in shots {
        take_shot(&picture, &shot, screenshot_quality(front), outbox)?;
    }
    if let Some(frame) = video {
        let bytes = capture::video_frame(&picture, &frame, video_quality(front))?;
        outbox.video = keep_video(&frame, &bytes);
    }
    Ok(())
}

fn take_shot(
    picture: &Picture,
    shot: &Shot,
    quality: i32,
    outbox: &mut Outbox,
) -> Result<(), Failure> {
    let (path, bytes, silent) = match shot {
        Shot::Screen {
            format: Format::Tga,
            path,
            silent,
        } => (path, capture::tga(picture)?, *silent),
        Shot::Screen {
            format: Format::Jpeg,
            path,
            silent,
        } => (path, capture::jpeg(picture, quality)?, *silent),
        Shot::Level { path } => (path, capture::tga(&capture::level_shot(picture))?, false),
    };
    outbox.files.push((path.clone(), bytes, silent));
    Ok(())
}

/// Copies an encoded frame into the engine's buffer, so that no destructor is pending when the engine writes it.
fn keep_video(frame: &VideoFrame, bytes: &[u8]) -> Option<(*mut u8, c_int)> {
    let room = frame.width as usize * frame.height as usize * 4;
    let length = c_int::try_from(bytes.len()).ok()?;
    if frame.encode_buffer.is_null() || bytes.len() > room {
        return None;
    }
    // SAFETY: by the contract of `take_video_frame` the buffer has `width * height * 4` bytes, at least the length of
    // `bytes`, and is valid until the frame ends. The two do not overlap.
    unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), frame.encode_buffer, bytes.len()) };
    Some((frame.encode_buffer, length))
}

/// Writes files and prints lines. The state is in its cell meanwhile, because the engine may call exports.
pub fn deliver(engine: Engine, outbox: Outbox) {
    for (path, bytes, silent) in outbox.files {
        if !engine.write_file(&path, &bytes) {
            engine.say(&format!("{path} could not be written\n"));
        } else if !silent {
            engine.say(&format!("Wrote {path}\n"));
        }
    }
    set_variables(engine, outbox.variables);
    for command in outbox.commands {
        engine.append_command(&c_text(&format!("{command}\n")));
    }
    for line in outbox.lines {
        engine.say(&format!("{line}\n"));
    }
    if let Some((data, length)) = outbox.video {
        // SAFETY: `keep_video` just filled the engine's buffer with `length` bytes.
        unsafe { engine.write_avi_frame(data, length) };
    }
}

/// Sets console variables.
pub fn set_variables(
    engine: Engine,
    values: impl IntoIterator<Item = (&'static str, impl AsRef<str>)>,
) {
    for (name, value) in values {
        engine.cvar_set(&c_text(name), value.as_ref());
    }
}

/// Quality of screenshots in percent.
fn screenshot_quality(front: &Front) -> i32 {
    front
        .cvars
        .as_ref()
        .map_or(90, |cvars| cvars.integer(Cvar::ScreenshotJpegQuality))
}

/// Quality of video frames in percent.
fn video_quality(front: &Front) -> i32 {
    front
        .cvars
        .as_ref()
        .map_or(90, |cvars| cvars.integer(Cvar::AviMotionJpegQuality))
}
