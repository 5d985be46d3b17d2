//! What Quake3e alone asks of its renderer: a window that the engine makes, codes of `Shutdown`, times in
//! milliseconds, lights along lines.

use super::support::options;
use glam::Vec3;
use tests::engine::abi::refEntity_t;
use tests::engine::{Engine, Options, Tables, View, has_surfaces};
use tests::maps::{HERE, ROOMS};

fn quake3e(cvars: &[(&str, &str)]) -> Engine {
    let cvars = cvars
        .iter()
        .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
    Engine::start(Options {
        tables: Tables::Quake3e,
        cvars: cvars.collect(),
        ..options()
    })
    .expect("the library starts")
}

#[test]
fn the_window_is_the_engines_and_outlives_what_the_code_of_shutdown_keeps() {
    if !has_surfaces() {
        testkit::skip("the Vulkan loader has no extension for surfaces of the engine's window");
        return;
    }
    let mut engine = quake3e(&[("r_headless", "0"), ("r_device", "-1")]);
    let scale = "scale 1 320x240";
    assert_eq!(engine.take_window_events(), ["open", "surface", scale]);
    assert_eq!(engine.config().displayFrequency, 60);
    assert_eq!(engine.kept_size().unwrap(), (320, 240));
    engine.start_map(ROOMS).unwrap();
    let view = View::new(HERE, 30.0);
    let first = engine.picture(&view).unwrap();
    // a map change keeps everything
    assert_eq!(engine.take_window_events(), ["FreeAll", "FreeAll", scale]);
    let mut restart = |code: i32, events: &[&str]| {
        engine.restart_video_with(code).unwrap();
        engine.load_world(ROOMS).unwrap();
        engine.end_registration().unwrap();
        assert_eq!(engine.picture(&view).unwrap(), first, "after code {code}");
        assert_eq!(engine.take_window_events(), events, "after code {code}");
    };
    // the device, the window, nothing
    restart(0, &["FreeAll", scale]);
    restart(1, &["FreeAll", "surface", scale]);
    restart(2, &["close 0", "FreeAll", "open", "surface", scale]);
    restart(3, &["close 1", "FreeAll", "open", "surface", scale]);
    engine.throttle().unwrap();
    assert_eq!(
        engine.picture(&view).unwrap(),
        first,
        "a frame that is not shown"
    );
    engine.assert_clean();
}

#[test]
fn variables_have_the_engines_defaults() {
    let engine = quake3e(&[]);
    for (name, default) in [
        ("r_picmip", "0"),
        ("r_subdivisions", "1"),
        ("r_lodbias", "-2"),
    ] {
        let (_, reset, _) = engine.describe_cvar(name).unwrap();
        assert_eq!(reset, default, "{name}");
    }
    // the engine's own: no flags of ours
    let (flags, ..) = engine.describe_cvar("r_swapInterval").unwrap();
    assert_eq!(flags, 0);
    engine.assert_clean();
}

#[test]
fn times_of_entities_may_be_milliseconds() {
    let mut engine = quake3e(&[]);
    engine.start_map(ROOMS).unwrap();
    let model = engine.register_model("models/test.md3").unwrap();
    let shader = engine.register_shader("textures/test/scroll").unwrap();
    let entity = refEntity_t {
        hModel: model,
        customShader: shader,
        origin: (HERE + Vec3::X * 60.0).to_array(),
        shaderTime: 0.75,
        ..refEntity_t::default()
    };
    let mut picture = |milliseconds: Option<i32>| {
        engine
            .picture_of(|engine| {
                engine.clear_scene()?;
                match milliseconds {
                    Some(time) => engine.add_entity_in_milliseconds(&entity, time)?,
                    None => engine.add_entity(&entity)?,
                }
                engine.render_scene(&View::new(HERE, 0.0))
            })
            .unwrap()
    };
    let seconds = picture(None);
    assert_eq!(picture(Some(750)), seconds);
    assert_ne!(picture(Some(640)), seconds);
    engine.assert_clean();
}

#[test]
fn extended_scripts_are_read() {
    let mut options = options();
    let script = |image: &str| format!("test/extended\n{{\n{{\nmap {image}\n}}\n}}\n").into_bytes();
    options.tables = Tables::Quake3e;
    options
        .files
        .push(("scripts/more.shaderx".to_owned(), script("$whiteimage")));
    let condition =
        "test/size\n{\nif ( $vid_width == 320 && $r_testValue >= 2 )\n{\nmap $whiteimage\n}\n}\n";
    for (name, text) in [
        ("scripts/size.shaderx", condition.as_bytes()),
        // the extended definition counts, and of ordinary ones that of the file with the highest priority
        (
            "scripts/more.shader",
            b"test/extended\n{\n{\nmap none\n}\n}\n",
        ),
    ] {
        options.files.push((name.to_owned(), text.to_vec()));
    }
    options
        .cvars
        .push(("r_testValue".to_owned(), "2".to_owned()));
    let mut engine = Engine::start(options).expect("the library starts");
    for name in ["test/extended", "test/size"] {
        assert!(engine.register_shader(name).unwrap() > 0, "{name}");
    }
    engine.set("r_testValue", "1");
    engine.start_map(ROOMS).unwrap();
    assert_eq!(engine.register_shader("test/size").unwrap(), 0);
    engine.assert_clean();
}

#[test]
fn lights_along_lines_light_in_both_looks() {
    let mut engine = quake3e(&[]);
    engine.start_map(ROOMS).unwrap();
    let ends = [
        HERE + Vec3::new(60.0, -80.0, 0.0),
        HERE + Vec3::new(60.0, 80.0, 0.0),
    ];
    for look in ["0", "1"] {
        engine.set("r_rt", look);
        let mut brightness = |lit: bool| {
            let picture = engine.picture_of(|engine| {
                engine.clear_scene()?;
                if lit {
                    engine.add_linear_light(ends, 200.0, Vec3::ONE)?;
                }
                engine.render_scene(&View::new(HERE, 0.0))
            });
            picture.unwrap().mean_luminance()
        };
        let dark = brightness(false);
        assert!(brightness(true) > dark + 5.0, "r_rt {look}: {dark}");
    }
    engine.assert_clean();
}

#[test]
fn menus_are_not_lit_by_vertices() {
    let mut engine = quake3e(&[("r_vertexLight", "1")]);
    for (allowed, covered) in [(false, "1"), (true, "0")] {
        engine.vertex_lighting(allowed).unwrap();
        assert_eq!(engine.cvar("r_uifullscreen").as_deref(), Some(covered));
    }
    engine.assert_clean();
}
