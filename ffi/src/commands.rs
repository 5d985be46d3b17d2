//! Console commands.

pub mod benchmark;
mod panels;

use crate::boundary::entry;
use crate::capture::{Format, Shot, StillShot, free_path, still_arguments};
use crate::costs::Report;
use crate::cvars::Cvar;
use crate::delivery::{set_variables, take_captures_of_last_frame};
use crate::engine::{self, Engine, valid_path_to_write};
use crate::failure::Failure;
use crate::presets::{self, Trial};
use crate::session::{self, Front, with_renderer};
use crate::window;
use crate::window::modes::MODES;
use renderer_vk::Renderer;
use renderer_vk::settings::{Look, Preset};
use std::ffi::CStr;
use std::time::Instant;

/// A command, as the engine calls it.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract): the engine runs commands from its command buffer, on its main
/// thread, from C frames. There are no parameters; a command reads its words by [`engine::Engine::arguments`] and
/// prints a message for invalid ones.
type Function = unsafe extern "C" fn();

/// Message for file names that the engine does not write to.
const NOT_A_NAME: &str =
    "not a name for a file: use at most 63 characters and a path inside of the game's folder";

/// All commands. They exist only between `BeginRegistration` and `Shutdown`, because the engine stores our function
/// pointers.
static COMMANDS: &[(&CStr, Function)] = &[
    (c"imagelist", image_list),
    (c"shaderlist", shader_list),
    (c"skinlist", skin_list),
    (c"modellist", model_list),
    (c"modelist", mode_list),
    (c"screenshot", screenshot_tga),
    (c"screenshotJPEG", screenshot_jpeg),
    (c"gfxinfo", gfx_info),
    (c"minimize", minimize),
    (c"rt_timings", timings),
    (c"rt_lights", lights),
    (c"rt_stats", stats),
    (c"rt_screenshot", still),
    (c"rt_path", path),
    (c"rt_preset", preset),
    (c"rt_menu", panels::menu),
    (c"rt_reload", reload),
    (c"rt_photo", panels::photo),
    (c"rt_benchmark", benchmark::run),
    (c"report", report),
];

/// Adds all commands.
pub fn add(engine: Engine) {
    // An engine that began anew without `Shutdown` has the old ones.
    remove(engine);
    for &(name, function) in COMMANDS {
        engine.add_command(name, function);
    }
}

/// Removes all commands.
pub fn remove(engine: Engine) {
    for &(name, _) in COMMANDS {
        engine.remove_command(name);
    }
}

/// Runs a command that prints lines. The state is back in its cell when they are printed.
fn print_lines(make: impl FnOnce(&mut Renderer, &mut Front, &[String]) -> Vec<String>) {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        let arguments = engine.arguments();
        let lines = with_renderer(|renderer, front| Ok(make(renderer, front, &arguments)))?;
        for line in lines {
            engine.say(&format!("{line}\n"));
        }
        Ok(())
    });
}

unsafe extern "C" fn image_list() {
    print_lines(|renderer, _, _| renderer.image_list());
}

unsafe extern "C" fn shader_list() {
    // Any argument selects drawing order.
    print_lines(|renderer, _, arguments| renderer.shader_list(arguments.len() > 1));
}

unsafe extern "C" fn skin_list() {
    print_lines(|renderer, _, _| renderer.skin_list());
}

unsafe extern "C" fn model_list() {
    print_lines(|renderer, _, _| renderer.model_list());
}

unsafe extern "C" fn mode_list() {
    // Does not use the registration: it works before `BeginRegistration`.
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        engine.say("\n");
        for (number, (name, ..)) in MODES.iter().enumerate() {
            engine.say(&format!("Mode {number:2}: {name}\n"));
        }
        engine.say("\n");
        Ok(())
    });
}

unsafe extern "C" fn timings() {
    print_lines(|renderer, _, _| {
        let passes = renderer.timings();
        if passes.is_empty() {
            return vec!["no frame was timed yet: ask again after some frames".into()];
        }
        let total: f32 = passes.iter().map(|(_, ms)| ms).sum();
        let mut lines: Vec<_> = passes
            .iter()
            .map(|(name, ms)| format!("{ms:8.3} ms  {name}"))
            .collect();
        lines.push(format!("{total:8.3} ms  all passes"));
        lines
    });
}

unsafe extern "C" fn stats() {
    print_lines(|renderer, front, arguments| {
        // The first argument is the name of the command.
        let Some(report) = Report::of(arguments.get(1..).unwrap_or_default()) else {
            return vec!["usage: rt_stats [json [FILE]]".into()];
        };
        if let Report::File(path) = &report
            && valid_path_to_write(path).is_none()
        {
            return vec![format!("rt_stats: {path}: {NOT_A_NAME}")];
        }
        front.questions.ask(report);
        // rays are counted from the next frame on; the report follows when the GPU has finished that frame
        renderer.count_rays(true);
        Vec::new()
    });
}

/// With an argument: sets the variable of the same name, which the console cannot set because the command hides it.
/// Without: lists the map's lights.
unsafe extern "C" fn lights() {
    let was_set = entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(false);
        };
        let arguments = engine.arguments();
        if let [_, word] = &arguments[..] {
            engine.cvar_set(c"rt_lights", word);
        }
        Ok(arguments.len() == 2)
    });
    if was_set {
        return;
    }
    print_lines(|renderer, _, _| {
        let Some(world) = renderer.world() else {
            return vec!["no map is loaded".into()];
        };
        let report = &world.relit.report;
        let mut lines: Vec<_> = report
            .emitters
            .iter()
            .map(|emitter| {
                format!(
                    "{:6} triangles  {:5} surfaces  {:12.0} square units  {}",
                    emitter.triangles, emitter.surfaces, emitter.area, emitter.name
                )
            })
            .collect();
        lines.push(format!(
            "{} triangle lights, {} point lights, {} suns; {} clusters list {:.1} lights each, {} at most",
            report.triangle_lights,
            report.point_lights,
            report.suns,
            report.clusters,
            report.mean_list_length,
            report.longest_list
        ));
        lines
    });
}

/// Reads the files of lights and materials beside the map again.
unsafe extern "C" fn reload() {
    print_lines(|renderer, _, _| match renderer.read_by_hand_again() {
        Ok(true) => vec!["rt_reload: read the map's files of lights and materials again".into()],
        Ok(false) => vec!["rt_reload: r_rt 1 reads these files when it first draws the map".into()],
        Err(e) => vec![format!("rt_reload: {e}")],
    });
}

unsafe extern "C" fn preset() {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        let arguments = engine.arguments();
        let name = arguments.get(1).map(String::as_str);
        let (chosen, lines) = with_renderer(|renderer, front| {
            front.trial = None;
            Ok(match (name, name.and_then(Preset::of)) {
                (_, Some(preset)) => (Some(preset), vec![format!("rt_preset {}", preset.name)]),
                (Some(auto), None) if auto.eq_ignore_ascii_case("auto") => {
                    begin_trial(renderer, front)
                }
                _ => (None, presets::lines(&front.settings)),
            })
        })?;
        if let Some(preset) = chosen {
            set_variables(engine, preset.values());
        }
        for line in lines {
            engine.say(&format!("{line}\n"));
        }
        Ok(())
    });
}

/// Begins `rt_preset auto`; the preset to begin with, and lines for the console.
fn begin_trial(renderer: &Renderer, front: &mut Front) -> (Option<&'static Preset>, Vec<String>) {
    if front.settings.rt != Look::Traced || renderer.world().is_none() {
        let line = "rt_preset auto measures the traced look: set r_rt 1 and start a map first";
        return (None, vec![line.into()]);
    }
    if front.benchmark.is_some() {
        let line = format!("rt_preset auto: {}", benchmark::IN_PROGRESS);
        return (None, vec![line]);
    }
    let refresh = window::current().map_or(0, |window| window.refresh_rate());
    let software = renderer.device_info().software;
    let (trial, first) = Trial::new(refresh, software, Instant::now());
    let line = match trial {
        Some(_) => format!(
            "rt_preset auto: measuring, beginning with {}; keep playing",
            first.name
        ),
        None => format!("rt_preset {}: this device draws in software", first.name),
    };
    front.trial = trial;
    (Some(first), vec![line])
}

unsafe extern "C" fn report() {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        let exists = |path: &str| engine.home_has(path);
        let Some(path) = free_path("reports/relight", "zip", &mut 0, exists) else {
            engine.say("report: all 10000 file names are taken\n");
            return Ok(());
        };
        let zip = with_renderer(|renderer, front| {
            crate::reports::zip(engine, renderer, front).map(Some)
        })?;
        engine.say(&match zip {
            Some(Ok(bytes)) if engine.write_file(&path, &bytes) => {
                format!(
                    "Wrote {path} in the game's own folder: send this file with your question. It holds no user name or \
                     address; its picture shows what was on the screen\n"
                )
            }
            Some(Ok(_)) => format!("{path} could not be written\n"),
            Some(Err(e)) => format!("{e}\n"),
            None => "report: the renderer is not running\n".to_owned(),
        });
        Ok(())
    });
}

/// The file of a camera path of a name.
fn path_file(name: &str) -> String {
    format!("paths/{}.txt", name.strip_suffix(".txt").unwrap_or(name))
}

unsafe extern "C" fn path() {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        let arguments = engine.arguments();
        let file = path_file(arguments.get(1).map_or("path", String::as_str));
        if valid_path_to_write(&file).is_none() {
            engine.say(&format!("rt_path: {file}: {NOT_A_NAME}\n"));
            return Ok(());
        }
        let done = with_renderer(|_, front| {
            let done = front.path.take();
            if done.is_none() {
                front.path = Some((file.clone(), String::new()));
            }
            Ok(done)
        })?;
        let Some((file, lines)) = done else {
            engine.say(&format!(
                "recording the camera to {file}; rt_path ends it\n"
            ));
            return Ok(());
        };
        let frames = lines.lines().count();
        engine.say(&if engine.write_file(&file, lines.as_bytes()) {
            format!("{file}: {frames} frames\n")
        } else {
            format!("{file} could not be written; its {frames} frames are lost\n")
        });
        Ok(())
    });
}

unsafe extern "C" fn gfx_info() {
    print_lines(|renderer, front, _| {
        let info = renderer.device_info();
        let strings = crate::config::DeviceStrings::new(info);
        let (width, height) = front.size;
        let settings = &front.settings;
        let refresh = window::current().map_or(0, |window| window.refresh_rate());
        let mode = front.cvars.as_ref().map_or(0, |c| c.integer(Cvar::Mode));
        let fullscreen = window::current().is_some_and(|window| window.is_fullscreen());
        let aids = if settings.anisotropy() > 1.0 {
            format!(
                "{:.0}x",
                settings.anisotropy().min(info.anisotropy.unwrap_or(1.0))
            )
        } else {
            "disabled".into()
        };
        vec![
            String::new(),
            format!("VENDOR: {}", strings.vendor),
            format!("RENDERER: {}", strings.renderer),
            format!("VERSION: {}", strings.version),
            format!("EXTENSIONS: {}", strings.extensions),
            format!("MAX_TEXTURE_SIZE: {}", info.max_image_size),
            String::new(),
            "PIXELFORMAT: color(32-bits) Z(32-bit float)".into(),
            format!(
                "MODE: {mode}, {width} x {height} {} hz:{}",
                if fullscreen { "fullscreen" } else { "windowed" },
                if refresh > 0 {
                    refresh.to_string()
                } else {
                    "N/A".into()
                }
            ),
            format!("LATENCY: {}", renderer.latency_method()),
            format!(
                "GAMMA: {} w/ {} overbright bits",
                if settings.ignore_hw_gamma {
                    "in textures"
                } else {
                    "applied to the picture"
                },
                settings.effective_overbright_bits()
            ),
            format!("texturemode: {}", settings.texture_mode.name()),
            format!("picmip: {}", settings.picmip),
            format!("anisotropic filtering: {aids}"),
            format!("look: {}", settings.rt.name()),
        ]
    });
}

unsafe extern "C" fn minimize() {
    entry(|| {
        if let Some(window) = window::current() {
            window.minimize();
        }
        Ok(())
    });
}

unsafe extern "C" fn screenshot_tga() {
    entry(|| screenshot(Format::Tga));
}

unsafe extern "C" fn screenshot_jpeg() {
    entry(|| screenshot(Format::Jpeg));
}

/// `maps/q3dm1.bsp` → `q3dm1`.
fn map_base_name(world: &str) -> &str {
    let file = world.rsplit(['/', '\\']).next().unwrap_or(world);
    file.rsplit_once('.').map_or(file, |(base, _)| base)
}

unsafe extern "C" fn still() {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        let arguments = engine.arguments();
        // The first argument is the name of the command.
        let line = match still_arguments(arguments.get(1..).unwrap_or_default()) {
            None => Some("usage: rt_screenshot SAMPLES [WIDTHxHEIGHT]".into()),
            Some((samples, size)) => begin_still(engine, samples, size)?,
        };
        if let Some(line) = line {
            engine.say(&format!("{line}\n"));
        }
        Ok(())
    });
}

/// Requests an accumulated picture. Returns an error message, if there is one.
fn begin_still(
    engine: Engine,
    samples: u32,
    size: Option<(u32, u32)>,
) -> Result<Option<String>, Failure> {
    let exists = |path: &str| engine.home_has(path);
    with_renderer(|renderer, front| {
        if front.benchmark.is_some() {
            return Ok(Some(format!("rt_screenshot: {}", benchmark::IN_PROGRESS)));
        }
        if let Err(reason) = renderer.request_still(samples, size, false) {
            return Ok(Some(format!("rt_screenshot: {reason}")));
        }
        let path = front.captures.next_path(Format::Tga, exists);
        let wrong = path.is_none().then(|| {
            renderer.cancel_still();
            "rt_screenshot: all 10000 file names are taken".to_owned()
        });
        front.captures.still = path.map(StillShot::new);
        Ok(wrong)
    })
}

/// Captures the frame on the screen, or the one being drawn.
fn screenshot(format: Format) -> Result<(), Failure> {
    let Some(engine) = engine::current() else {
        return Ok(());
    };
    let arguments = engine.arguments();
    let argument = arguments.get(1).map_or("", String::as_str);
    if argument == "levelshot" {
        let path = with_renderer(|renderer, _| {
            Ok(renderer
                .world_name()
                .map(|world| format!("levelshots/{}.tga", map_base_name(world))))
        })?;
        match path {
            Some(path) => return take(engine, Shot::Level { path }),
            None => engine.say("levelshot: no map is loaded\n"),
        }
        return Ok(());
    }
    let silent = argument == "silent";
    // A name is used only without further arguments; otherwise the picture gets a number.
    let path = if arguments.len() == 2 && !argument.is_empty() && !silent {
        Some(format!("screenshots/{argument}.{}", format.extension()))
    } else {
        let exists = |path: &str| engine.home_has(path);
        session::with(|session| session.front.captures.next_path(format, exists)).flatten()
    };
    let Some(path) = path else {
        engine.say("screenshot: all 10000 file names are taken\n");
        return Ok(());
    };
    let shot = Shot::Screen {
        format,
        path,
        silent,
    };
    take(engine, shot)
}

fn take(engine: Engine, shot: Shot) -> Result<(), Failure> {
    let (Shot::Screen { path, .. } | Shot::Level { path }) = &shot;
    if valid_path_to_write(path).is_none() {
        engine.say(&format!("screenshot: {path}: {NOT_A_NAME}\n"));
        return Ok(());
    }
    session::with(|session| {
        if session.front.registered {
            session.front.captures.shots.push(shot);
        }
    });
    take_captures_of_last_frame(engine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_shots_are_named_after_the_map() {
        assert_eq!(map_base_name("maps/q3dm1.bsp"), "q3dm1");
        assert_eq!(map_base_name("maps\\a.b.bsp"), "a.b");
        assert_eq!(map_base_name("plain"), "plain");
    }
}
