//! Registration, frames and shutdown: lifetime of the window, the device and the assets.

use crate::abi::{QBool, STEREO_LEFT, STEREO_RIGHT, glconfig_t, is_true};
use crate::boundary::entry;
use crate::capture::{self, VideoFrame};
use crate::commands;
use crate::cvars::{self, Cvar, Cvars};
use crate::delivery::{Outbox, deliver, take_captures, take_captures_of_last_frame};
use crate::engine::{self, Engine, valid_game_path};
use crate::failure::Failure;
use crate::files::EngineFiles;
use crate::glconfig;
use crate::presets::Step;
use crate::session::{self, Front, with_renderer};
use crate::show_panel;
use crate::window::{self, Window};
use renderer_vk::{Eye, Look, Renderer, RendererOptions};
use std::ffi::{CStr, c_int};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Tests whether there is a usable Vulkan device, without a window.
///
/// # Errors
/// One sentence that names the missing item.
pub fn probe(engine: Engine) -> Result<(), String> {
    let device = wanted_device(&Cvars::register(engine));
    renderer_vk::probe(device.as_deref())
        .map(|_| ())
        .map_err(|e| e.to_string())
}

fn wanted_device(cvars: &Cvars) -> Option<String> {
    // -1 is what an engine archives under this name for the best device
    Some(cvars.string(Cvar::Device)).filter(|name| !name.is_empty() && name != "-1")
}

/// Our folder in the game's writable folder, for light calibrations and pipeline caches.
fn cache_folder(engine: Engine) -> Option<PathBuf> {
    let set = |name: &&CStr| !engine.cvar_text(name).is_empty();
    // newer engines have folders for data and state in place of one home
    let homes = [c"fs_homepath", c"fs_homestatepath", c"fs_homedatapath"];
    let home = engine.cvar_path(engine.cvar_get(homes.into_iter().find(set)?, c"", 0)?);
    let games = [c"fs_game", engine.front_end()?.base_game];
    let game = engine.cvar_text(games.into_iter().find(set)?);
    // a game folder is a single name; other values are not used as a path
    let plain = !game.contains(['/', '\\', ':']) && !game.contains("..");
    plain.then(|| home.join(game).join("relight"))
}

/// `re.BeginRegistration`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `out` must be null or have room for a `glconfig_t`. Without a
/// device or a window the call ends in the engine's `Error` and writes nothing.
pub unsafe extern "C" fn begin_registration(out: *mut glconfig_t) {
    entry(|| {
        session::abandon_if_taken();
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        let cvars = Cvars::register(engine);
        window::apply_safe_settings(engine);
        cvars::write_back_limits(&cvars);
        session::with(|session| cvars::apply(&cvars, &mut session.front.settings));
        commands::add(engine);

        let cache_folder = cache_folder(engine);
        let has_renderer = session::with(|session| session.renderer.is_some()).unwrap_or(false);
        if !has_renderer {
            start_renderer(engine, &cvars, cache_folder.as_deref())?;
        }
        let info = session::with(|session| {
            describe(session.renderer.as_ref()?, &mut session.front).into()
        })
        .flatten();
        if let (Some(config), false) = (info, out.is_null()) {
            // SAFETY: not null, so it has room for a `glconfig_t` by this function's contract.
            unsafe { out.write_unaligned(config) };
        }
        // The input code reads nothing of ours, but it is the engine's: no state is held.
        window::give_to_input_once(engine);
        window::input::install();

        session::with(|session| {
            let front = &mut session.front;
            front.kept = false;
            let Some(renderer) = &mut session.renderer else {
                return Ok(());
            };
            cvars::apply_at_registration(&cvars, &mut front.settings);
            front.cvars = Some(cvars);
            front.registered = true;
            let files = Arc::new(EngineFiles::new(engine, front.size));
            renderer.keep_calibrations(cache_folder);
            renderer
                .begin_registration(files, &front.settings)
                .map_err(|e| cannot_start(engine, e.to_string()))
        })
        .unwrap_or(Ok(()))
    });
}

/// Opens the window, unless it is open or disabled, and makes a renderer for it.
fn start_renderer(
    engine: Engine,
    cvars: &Cvars,
    cache_folder: Option<&Path>,
) -> Result<(), Failure> {
    if window::current().is_some_and(|window| window.stale) {
        window::close(engine, window::Closing::ForAnother);
    }
    let headless = cvars.flag(Cvar::Headless);
    let made = if headless {
        let size =
            window::headless_mode(cvars).map_or((640, 480), |mode| (mode.width, mode.height));
        make_renderer(cvars, size, None, cache_folder)
    } else {
        window::refresh_size();
        let window = match window::current() {
            Some(window) => Ok(window),
            None => window::open(engine, cvars),
        };
        window
            .map_err(|e| e.to_string())
            .and_then(|window| make_renderer(cvars, window.size, Some(window), cache_folder))
    };
    match made {
        Ok(renderer) => {
            let info = renderer.device_info();
            log::info!(
                "Relight on {}: {}",
                info.name,
                match (info.ray_tracing.is_some(), info.software) {
                    (true, false) => "this graphics driver has ray tracing",
                    (_, true) =>
                        "this driver draws on the processor: give rt_preset low before r_rt 1; a traced frame takes a second or more",
                    (false, false) =>
                        "this graphics driver has no ray tracing; using compute shaders",
                }
            );
            session::with(|session| {
                session.renderer = Some(renderer);
                session.front.has_picture = false;
                // fixed until the next start: the engine's own renderer reads them only here
                let settings = &mut session.front.settings;
                settings.fullscreen =
                    window::current().is_some_and(|window| window.is_fullscreen());
                settings.ignore_hw_gamma = cvars.flag(Cvar::IgnoreHwGamma);
            });
            Ok(())
        }
        Err(message) => {
            window::close(engine, window::Closing::Video);
            Err(cannot_start(engine, message))
        }
    }
}

/// The end of the game, with the way to play without this renderer.
fn cannot_start(engine: Engine, message: String) -> Failure {
    let other = (engine.front_end()).map_or("opengl1", |front| front.opengl[0]);
    Failure::fatal(format!(
        "Relight cannot start: {message}. Start the game with \"+set cl_renderer {other}\" to play without it."
    ))
}

fn make_renderer(
    cvars: &Cvars,
    (width, height): (u32, u32),
    window: Option<Window>,
    cache_folder: Option<&Path>,
) -> Result<Renderer, String> {
    let window = window
        .map(|window| window.source())
        .transpose()
        .map_err(|e| e.to_string())?;
    let options = RendererOptions {
        width,
        height,
        window,
        validation: cvars.flag(Cvar::VkValidation),
        device: wanted_device(cvars),
        // Off without a session.
        vsync: session::with(|session| session.front.settings.swap_interval != 0)
            .unwrap_or_default(),
        hdr: session::with(|session| session.front.settings.hdr).unwrap_or_default(),
        pipeline_cache: cache_folder.map(|folder| folder.join("pipelines.cache")),
    };
    Renderer::new(options).map_err(|e| e.to_string())
}

/// Sets the fields that depend on the window, and returns the structure for the game.
fn describe(renderer: &Renderer, front: &mut Front) -> glconfig_t {
    let size = renderer.size();
    let window = window::current();
    let screen = glconfig::Screen {
        size,
        aspect: window.map_or(size.0 as f32 / size.1 as f32, |window| window.aspect),
        refresh_rate: window.map_or(0, |window| window.refresh_rate()),
        fullscreen: front.settings.fullscreen,
        gamma: !front.settings.ignore_hw_gamma,
    };
    front.size = screen.size;
    glconfig::glconfig(renderer.device_info(), screen)
}

/// What a shutdown leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The window and the device: the map changes.
    KeepAll,
    /// The window.
    KeepWindow,
    /// Nothing; video may start again.
    Close,
    /// Nothing, for good.
    Leave,
}

/// `re.Shutdown` of engines that pass whether to close the window. May be called repeatedly, before any registration,
/// and from inside an error of the engine.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). Any number but 0 closes the window; the engine's input code,
/// which is notified first, must not use it afterwards. Buffers of [`take_video_frame`] are forgotten.
pub unsafe extern "C" fn shutdown(destroy_window: QBool) {
    entry(|| {
        end(if is_true(destroy_window) {
            Ending::Close
        } else {
            Ending::KeepAll
        });
        Ok(())
    });
}

/// Ends the registration. For functions that the engine calls as `Shutdown`, inside of [`entry`].
pub fn end(ending: Ending) {
    session::abandon_if_taken();
    let Some(engine) = engine::current() else {
        return;
    };
    // Captures of a frame that will not end show the part drawn so far.
    if let Ok(outbox) = with_renderer(|renderer, front| {
        // The buffer of a video frame may be invalid by now.
        front.captures.video = None;
        let mut outbox = Outbox::default();
        outbox.lines.extend(abandon_still(renderer, front));
        let back = matches!(ending, Ending::KeepAll | Ending::KeepWindow);
        commands::benchmark::unload(renderer, front, back, &mut outbox);
        take_captures(renderer, front, &mut outbox).map(|()| outbox)
    }) {
        deliver(engine, outbox);
    }
    // The engine would keep our function pointers after unloading the library.
    commands::remove(engine);
    match ending {
        Ending::KeepAll => window::input::end(),
        // this library may be unloaded next
        Ending::KeepWindow | Ending::Close | Ending::Leave => window::input::remove(),
    }
    let destroyed = session::with(|session| {
        session.front.registered = false;
        session.front.world_view = None;
        session.front.trial = None;
        // after a failure nothing can be measured
        if session.renderer.is_none() {
            session.front.benchmark = None;
        }
        session.front.clip_region = None;
        session.front.captures.clear();
        session.front.cinematics.clear();
        if let Some(renderer) = &mut session.renderer {
            show_panel::close(renderer, &mut session.front);
            renderer.shutdown_registration();
        }
        session.front.panel = None;
        session.front.kept = matches!(ending, Ending::KeepAll | Ending::KeepWindow);
        if ending == Ending::KeepAll {
            None
        } else {
            session.front.size = (0, 0);
            session.renderer.take()
        }
    });
    // The surface must be destroyed before its window.
    drop(destroyed);
    if matches!(ending, Ending::Close | Ending::Leave) {
        window::close(
            engine,
            if ending == Ending::Leave {
                window::Closing::Leave
            } else {
                window::Closing::Video
            },
        );
    }
    engine.free_all();
}

/// `re.EndRegistration`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract); there are no arguments.
pub unsafe extern "C" fn end_registration() {
    entry(|| {
        with_renderer(|renderer, _| {
            renderer.end_registration();
            Ok(())
        })
    });
}

/// `re.BeginFrame`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). An invalid `stereoFrame_t` counts as both eyes.
pub unsafe extern "C" fn begin_frame(stereo: c_int) {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        with_renderer(|renderer, front| {
            // with r_anaglyphMode the engine sends every frame twice
            let eye = match stereo {
                STEREO_LEFT => Eye::Left,
                STEREO_RIGHT => Eye::Right,
                _ => Eye::Both,
            };
            if eye == Eye::Right {
                renderer.begin_frame(engine.milliseconds());
                renderer.set_eye(eye);
                return Ok(());
            }
            if let Some(cvars) = &front.cvars {
                cvars::write_back_limits(cvars);
                cvars::apply(cvars, &mut front.settings);
            }
            if let Some(panel) = &front.panel {
                panel.put(&mut front.settings);
            }
            front.frame_start = Some(Instant::now());
            renderer.set_settings(&front.settings);
            renderer.begin_frame(engine.milliseconds());
            renderer.set_eye(eye);
            Ok(())
        })
    });
}

/// `re.EndFrame`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `front_end_ms` and `back_end_ms` must each be null or have room
/// for an integer. The buffer of a video frame of [`take_video_frame`] must still be valid: the frame's picture is
/// encoded into it here.
pub unsafe extern "C" fn end_frame(front_end_ms: *mut c_int, back_end_ms: *mut c_int) {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        // views held by rt_pause include the video pictures on their walls
        let held = with_renderer(|_, front| {
            Ok(front.settings.rt == Look::Traced && front.settings.rt_pause)
        })?;
        if !held {
            run_videos(engine)?;
        }
        let outbox = with_renderer(finish_frame)?;
        for (to, value) in [
            (front_end_ms, outbox.front_end_ms),
            (back_end_ms, outbox.back_end_ms),
        ] {
            if !to.is_null() {
                // SAFETY: not null, so it has room for an integer by this function's contract.
                unsafe { to.write_unaligned(value) };
            }
        }
        deliver(engine, outbox);
        session::with(|session| {
            if let Some(cvars) = &session.front.cvars {
                window::follow_fullscreen(engine, cvars);
            }
        });
        Ok(())
    });
}

fn milliseconds(duration: std::time::Duration) -> c_int {
    c_int::try_from(duration.as_millis()).unwrap_or(c_int::MAX)
}

/// Ends the frame on the GPU, and takes the requested captures before it is presented.
fn finish_frame(renderer: &mut Renderer, front: &mut Front) -> Result<Outbox, Failure> {
    let mut outbox = Outbox::default();
    let start = Instant::now();
    outbox.front_end_ms = front
        .frame_start
        .take()
        .map_or(0, |begin| milliseconds(start - begin));
    show_panel::draw(renderer, front, &mut outbox)?;
    take_captures(renderer, front, &mut outbox)?;
    let skipped = std::mem::take(&mut front.skip_present);
    renderer.set_hidden(skipped || window::current().is_some_and(|window| window.is_hidden()));
    let stats = renderer.end_frame().map_err(Failure::from)?;
    front.has_picture = true;
    outbox.back_end_ms = milliseconds(start.elapsed());
    outbox
        .lines
        .extend(crate::speeds::lines(&front.settings, &stats, renderer));
    finish_still(renderer, front, &mut outbox)?;
    go_on_with_trial(renderer, front, &mut outbox);
    commands::benchmark::go_on(renderer, front, &mut outbox)?;
    let answers = (front.questions).answer(renderer, &front.settings, Instant::now());
    outbox.lines.extend(answers.lines);
    let files = answers.files.into_iter();
    outbox
        .files
        .extend(files.map(|(path, bytes)| (path, bytes, false)));
    Ok(outbox)
}

/// `rt_preset auto`: measures the frame, and changes the settings after enough of them.
fn go_on_with_trial(renderer: &Renderer, front: &mut Front, outbox: &mut Outbox) {
    let Some(trial) = &mut front.trial else {
        return;
    };
    match trial.frame(Instant::now(), renderer.costs().traced_ms()) {
        Step::Measures => {}
        Step::Try(preset, ms) => {
            outbox.set(preset);
            let line = format!("a frame takes {ms:.1} ms; trying {}", preset.name);
            outbox.lines.push(line);
        }
        Step::Ends(preset, ms) => {
            outbox.set(preset);
            let cost = ms.map_or_else(String::new, |ms| format!("; a frame takes {ms:.1} ms"));
            outbox
                .lines
                .push(format!("rt_preset {}{cost}", preset.name));
            front.trial = None;
        }
    }
}

/// Drops an accumulated picture at the end of the game; returns a message for the player.
fn abandon_still(renderer: &Renderer, front: &mut Front) -> Option<String> {
    let shot = front.captures.still.take()?;
    let (done, wanted) = renderer.still_progress()?;
    Some(format!(
        "rt_screenshot: {} was not made: the map ended after {done} of {wanted} samples",
        shot.path
    ))
}

/// Reports the progress of an accumulated picture, and takes it when it is finished.
fn finish_still(
    renderer: &mut Renderer,
    front: &mut Front,
    outbox: &mut Outbox,
) -> Result<(), Failure> {
    let Some(shot) = &mut front.captures.still else {
        return Ok(());
    };
    match renderer.still_progress() {
        Some((done, wanted)) => outbox.lines.extend(shot.progress(done, wanted)),
        // its map was unloaded
        None => front.captures.still = None,
    }
    if let Some(still) = renderer.take_still().map_err(Failure::from)?
        && let Some(shot) = front.captures.still.take()
    {
        (outbox.files).push((shot.path, capture::tga(&still.picture)?, false));
    }
    Ok(())
}

/// Decodes the videos of materials. The engine calls `UploadCinematic` during the call, so that the state is in its
/// cell meanwhile.
fn run_videos(engine: Engine) -> Result<(), Failure> {
    let mut wanted = with_renderer(|renderer, front| {
        let mut wanted = front.cinematics.take_list();
        wanted.extend(renderer.videos().map(|(_, client)| client));
        Ok(wanted)
    })?;
    for &client in &wanted {
        let (state, name) = with_renderer(|renderer, front| {
            let state = front.cinematics.state(client);
            let mut unknown = renderer.videos().filter(|_| state.is_none());
            let name = unknown.find(|(_, known)| *known == client);
            Ok((state, name.map(|(name, _)| name.to_owned())))
        })?;
        let handle = match state {
            Some(handle) => handle,
            None => {
                // Another call may have dropped the video; the engine's services refuse the empty name.
                let name = name.unwrap_or_default();
                let handle = valid_game_path(&name).and_then(|name| engine.play_cinematic(&name));
                with_renderer(|renderer, front| {
                    front.cinematics.remember(client, handle);
                    if handle.is_none() {
                        renderer.drop_video(client);
                    }
                    Ok(())
                })?;
                handle
            }
        };
        if let Some(handle) = handle {
            engine.run_cinematic(handle);
        }
    }
    wanted.clear();
    session::with(|session| session.front.cinematics.keep_list(wanted));
    Ok(())
}

/// `re.TakeVideoFrame`. The engine's header names the first two parameters height and width, but the engine passes the
/// width first.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `encode_buffer` must be null or have room for `width * height *
/// 4` bytes and **outlive the call**: during a frame, [`end_frame`] fills it or [`shutdown`] drops it. A null buffer
/// or a side below 1 requests nothing. The capture buffer is not used.
pub unsafe extern "C" fn take_video_frame(
    width: c_int,
    height: c_int,
    _capture: *mut u8,
    encode_buffer: *mut u8,
    motion_jpeg: QBool,
) {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        with_renderer(|_, front| {
            if let (Ok(width @ 1..), Ok(height @ 1..), false) = (
                u32::try_from(width),
                u32::try_from(height),
                encode_buffer.is_null(),
            ) {
                front.captures.video = Some(VideoFrame {
                    width,
                    height,
                    encode_buffer,
                    motion_jpeg: is_true(motion_jpeg),
                });
            }
            Ok(())
        })?;
        take_captures_of_last_frame(engine)
    });
}
