//! The life of a session: configuration, cvars and commands, map changes, restarts, calls out of order.

use super::support::{engine, engine_in_map, for_every_engine, options};
use glam::Vec3;
use std::path::Path;
use tests::engine::abi::refEntity_t;
use tests::engine::{Engine, Tables, View};
use tests::maps::{HERE, ROOMS};

for_every_engine!(
    the_configuration_is_filled,
    cvars_and_commands_come_and_go,
    sessions_change_maps_and_restart,
    calls_outside_of_registration_are_harmless,
    latched_and_live_settings_take_effect,
    caches_lie_in_the_first_home_that_the_engine_has,
);

fn text(characters: &[std::ffi::c_char]) -> String {
    characters
        .iter()
        .take_while(|&&c| c != 0)
        .map(|&c| char::from(c as u8))
        .collect()
}

/// Whether the library is in memory.
#[cfg(unix)]
fn is_loaded(library: &Path) -> bool {
    let (Ok(file), Ok(maps)) = (
        library.canonicalize(),
        std::fs::read_to_string("/proc/self/maps"),
    ) else {
        return false;
    };
    maps.lines()
        .any(|line| line.ends_with(&*file.to_string_lossy()))
}

#[cfg(windows)]
fn is_loaded(library: &Path) -> bool {
    library
        .file_name()
        .is_some_and(|name| libloading::os::windows::Library::open_already_loaded(name).is_ok())
}

#[test]
fn the_library_stays_in_memory() {
    drop(engine());
    assert!(is_loaded(&tests::data::library()));
}

fn the_configuration_is_filled() {
    let engine = engine();
    let config = engine.config();
    assert_eq!((config.vidWidth, config.vidHeight), (320, 240));
    assert!((config.windowAspect - 4.0 / 3.0).abs() < 0.01);
    assert!(config.maxTextureSize >= 2048);
    assert_eq!(
        (
            config.driverType,
            config.hardwareType,
            config.stereoEnabled,
            config.smpActive
        ),
        (0, 0, 0, 0)
    );
    assert!(config.colorBits >= 24 && config.depthBits >= 24);
    assert!(!text(&config.renderer_string).is_empty());
    assert!(!text(&config.vendor_string).is_empty());
    assert!(!text(&config.version_string).is_empty());
    assert!(!text(&config.extensions_string).is_empty());
    engine.assert_clean();
}

fn cvars_and_commands_come_and_go() {
    let mut engine = engine();
    let cvars = engine.registered_cvars();
    for name in [
        "r_gamma",
        "r_mode",
        "r_picmip",
        "r_rt",
        "rt_printPerfStats",
        "rt_illumination",
        "rt_cullLights",
        "rt_numRandomDL",
        "rt_pause",
        "rt_accumulate",
        "rt_antialiasing",
        "rt_softshadows",
        "rt_dof",
        "rt_aperture",
        "rt_focallength",
        "rt_denoiser",
        "rt_taa",
        "rt_tracer",
        "rt_lights",
        "rt_bounces",
        "rt_maxDepth",
        "rt_lightSelection",
        "rt_exposure",
        "rt_bloom",
        "rt_scale",
        "rt_flashlight",
        "rt_debug",
        "r_vkValidation",
        "r_flares",
    ] {
        assert!(
            cvars.iter().any(|c| c.eq_ignore_ascii_case(name)),
            "{name} is not registered"
        );
    }
    let (flags, reset, description) = engine.describe_cvar("r_rt").unwrap();
    assert_eq!(
        (flags & 1, reset.as_str()),
        (1, "0"),
        "r_rt is archived and off by default"
    );
    // OpenArena's engine stores none
    let kept = !matches!(options().tables, Tables::OpenArena);
    assert_eq!(description.is_some_and(|d| !d.is_empty()), kept);
    let commands = engine.commands();
    for name in [
        "imagelist",
        "shaderlist",
        "skinlist",
        "modellist",
        "screenshot",
        "screenshotjpeg",
        "gfxinfo",
        "rt_screenshot",
        "rt_stats",
        "rt_benchmark",
    ] {
        assert!(commands.iter().any(|c| c == name), "{name} is no command");
    }
    for name in [
        "imagelist",
        "shaderlist",
        "skinlist",
        "modellist",
        "gfxinfo",
    ] {
        engine.take_messages();
        engine.command(name).unwrap();
        assert!(!engine.messages().is_empty(), "{name} prints nothing");
    }
    engine.shutdown(false).unwrap();
    assert!(engine.commands().is_empty());
    engine.begin_registration().unwrap();
    assert_eq!(engine.commands(), commands);
    engine.assert_clean();
}

fn sessions_change_maps_and_restart() {
    let mut engine = engine();
    let view = View::new(HERE, 30.0);
    engine.start_map(ROOMS).unwrap();
    let first = engine.picture(&view).unwrap();
    for round in 0..3 {
        engine.start_map(ROOMS).unwrap();
        assert_eq!(
            engine.picture(&view).unwrap(),
            first,
            "after map change {round}"
        );
        engine.set("r_rt", "1");
        engine.picture(&view).unwrap();
        engine.set("r_rt", "0");
        engine.restart_video().unwrap();
        assert_eq!(engine.config().vidWidth, 320);
        engine.load_world(ROOMS).unwrap();
        engine.end_registration().unwrap();
        assert_eq!(
            engine.picture(&view).unwrap(),
            first,
            "after restart {round}"
        );
    }
    engine.set("r_customwidth", "400");
    engine.set("r_customheight", "304");
    engine.restart_video().unwrap();
    assert_eq!(
        (engine.config().vidWidth, engine.config().vidHeight),
        (400, 304)
    );
    let picture = engine.picture_of(|_| Ok(())).unwrap();
    assert_eq!((picture.width(), picture.height()), (400, 304));
    engine.assert_clean();
    // a world is not loaded over another
    engine.load_world(ROOMS).unwrap();
    assert_eq!(engine.load_world(ROOMS).unwrap_err().level, 1);
}

fn calls_outside_of_registration_are_harmless() {
    let mut engine = Engine::load_named(options()).unwrap();
    // before BeginRegistration and after Shutdown alike
    for _ in 0..2 {
        engine.shutdown(false).unwrap();
        engine.shutdown(false).unwrap();
        engine.clear_scene().unwrap();
        engine.set_world_vis_data(&[]).unwrap();
        engine.add_entity(&refEntity_t::default()).unwrap();
        engine.add_light(HERE, 100.0, Vec3::ONE).unwrap();
        engine.set_color(None).unwrap();
        engine.draw_stretch_pic([0.0; 4], [0.0; 4], 0).unwrap();
        engine.begin_frame(0).unwrap();
        engine.end_frame().unwrap();
        engine.render_scene(&View::new(HERE, 0.0)).unwrap();
        engine.begin_registration().unwrap();
        engine.end_registration().unwrap();
        assert!(engine.end_frame_timed().is_ok());
        engine.shutdown(true).unwrap();
    }
    engine.assert_clean();
}

fn latched_and_live_settings_take_effect() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let normal = engine.picture(&view).unwrap();
    let before = engine.cvar("r_picmip").unwrap();
    engine.set("r_picmip", "5");
    assert_eq!(
        engine.picture(&view).unwrap(),
        normal,
        "a latched value waits"
    );
    engine.start_map(ROOMS).unwrap();
    let blurred = engine.picture(&view).unwrap();
    assert_ne!(blurred, normal);
    engine.set("r_picmip", &before);
    engine.start_map(ROOMS).unwrap();
    let again = engine.picture(&view).unwrap();
    assert_eq!(again, normal);
    engine.set("r_fullbright", "1");
    engine.set("r_lightmap", "1");
    assert_ne!(engine.picture(&view).unwrap(), normal, "r_lightmap is live");
    engine.assert_clean();
}

fn caches_lie_in_the_first_home_that_the_engine_has() {
    // newer engines leave fs_homepath empty
    for name in ["fs_homepath", "fs_homestatepath", "fs_homedatapath"] {
        let folder = tempfile::tempdir().unwrap();
        // longer than the short paths of Windows
        let home = (0..6).fold(folder.path().to_owned(), |path, _| {
            path.join("h".repeat(60))
        });
        let mut options = options();
        let base = match options.tables {
            Tables::Quake3e | Tables::Tremulous => "fs_basegame",
            _ => "com_basegame",
        };
        for (name, value) in [(name, home.to_str().unwrap()), (base, "base")] {
            options.cvars.push((name.to_owned(), value.to_owned()));
        }
        drop(Engine::start(options).unwrap());
        assert!(
            home.join("base/relight/pipelines.cache").is_file(),
            "{name}"
        );
    }
}
