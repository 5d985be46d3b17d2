//! Broken game data: the renderer prints one line with the fault and its place, and the game goes on.

#![forbid(unsafe_code)]

use testkit::Random;
use tests::engine::{Engine, Options, View};
use tests::gallery::tube;
use tests::maps::{self, HERE, ROOMS};

fn engine_with(files: Vec<(&str, Vec<u8>)>) -> Engine {
    let mut all = maps::files();
    all.extend(
        files
            .into_iter()
            .map(|(name, bytes)| (name.to_string(), bytes)),
    );
    Engine::start(Options {
        files: all,
        ..Options::default()
    })
    .expect("broken files do not stop the start")
}

/// The one line about `file` among warnings and errors.
fn line_about(engine: &Engine, file: &str) -> String {
    let lines: Vec<String> = engine
        .messages()
        .into_iter()
        .map(|m| m.text)
        .filter(|t| t.contains(file))
        .collect();
    assert!(
        !lines.is_empty(),
        "no message about {file}: {:#?}",
        engine.messages()
    );
    lines[0].clone()
}

/// The game is alive: the small map still loads and shows something.
fn assert_goes_on(engine: &mut Engine) {
    engine.start_map(ROOMS).expect("the good map still loads");
    let picture = engine
        .picture(&View::new(HERE, 30.0))
        .expect("frames are drawn");
    assert!(picture.mean_luminance() > 4.0);
    engine.assert_clean();
}

#[test]
fn a_missing_map_drops_the_game() {
    let mut engine = engine_with(vec![]);
    let raised = engine.start_map("maps/nowhere.bsp").unwrap_err();
    assert_eq!(raised.level, 1);
    assert!(raised.message.contains("maps/nowhere.bsp"), "{raised}");
    assert_eq!(raised.message.trim_end().lines().count(), 1, "{raised}");
    assert_goes_on(&mut engine);
}

#[test]
fn cut_off_maps_drop_the_game() {
    let whole = maps::files().remove(0).1;
    let mut engine = engine_with(vec![]);
    for part in 0..16 {
        let length = whole.len() * part / 16;
        engine.insert_file("maps/cut.bsp", whole[..length].to_vec());
        let raised = engine
            .start_map("maps/cut.bsp")
            .expect_err("a map that is cut off does not load");
        assert_eq!(raised.level, 1);
        assert!(
            raised.message.contains("maps/cut.bsp"),
            "{length} bytes: {raised}"
        );
    }
    assert_goes_on(&mut engine);
}

#[test]
fn a_pack_that_the_engine_cannot_read_drops_the_game() {
    let mut engine = engine_with(vec![]);
    for file in [ROOMS, "textures/test/wall.tga", "scripts/test.shader"] {
        engine.set_damaged(Some(file));
        let raised = engine.start_map(ROOMS).expect_err(file);
        assert_eq!((raised.level, raised.message.as_str()), (1, "damaged pack"));
        engine.set_damaged(None);
        engine.start_map(ROOMS).expect("the file is whole again");
    }
    assert_goes_on(&mut engine);
}

#[test]
fn a_map_of_another_kind_is_named() {
    let mut other = maps::files().remove(0).1;
    other[4] = 99;
    let mut engine = engine_with(vec![
        ("maps/other.bsp", other),
        ("maps/text.bsp", b"no map at all".to_vec()),
    ]);
    for (map, what) in [("maps/other.bsp", "99"), ("maps/text.bsp", "")] {
        let raised = engine.start_map(map).unwrap_err();
        assert!(
            raised.message.contains(map) && raised.message.contains(what),
            "{raised}"
        );
    }
    assert_goes_on(&mut engine);
}

#[test]
fn bytes_turned_over_never_stop_the_process() {
    let whole = maps::files().remove(0).1;
    let mut engine = engine_with(vec![]);
    let mut random = Random::new(12345);
    let rounds = if testkit::is_set("RELIGHT_FULL") {
        400
    } else {
        40
    };
    for _ in 0..rounds {
        let mut bytes = whole.clone();
        for _ in 0..8 {
            // most damage in the header and the small lumps at the front
            let range = if random.below(2) == 0 {
                2048.min(bytes.len())
            } else {
                bytes.len()
            };
            let at = random.below(range);
            bytes[at] = random.bits() as u8;
        }
        engine.insert_file("maps/damaged.bsp", bytes);
        if engine.start_map("maps/damaged.bsp").is_ok() {
            engine
                .picture(&View::new(HERE, 30.0))
                .expect("what loads is drawn");
        }
    }
    assert_goes_on(&mut engine);
}

#[test]
fn a_script_without_its_last_brace_is_named() {
    let broken = b"textures/test/open\n{\n {\n  map textures/test/wall.tga\n }\n".to_vec();
    let mut engine = engine_with(vec![("scripts/broken.shader", broken)]);
    line_about(&engine, "broken.shader");
    assert_goes_on(&mut engine);
}

#[test]
fn words_that_no_shader_knows_are_named_with_their_line() {
    let odd =
        b"textures/test/odd\n{\n {\n  map textures/test/wall.tga\n  fancyThing 3\n }\n}\n".to_vec();
    let mut engine = engine_with(vec![("scripts/odd.shader", odd)]);
    engine.register_shader("textures/test/odd").unwrap();
    let line = line_about(&engine, "odd.shader");
    assert!(
        line.contains('5') && line.to_lowercase().contains("fancything"),
        "{line}"
    );
    assert_goes_on(&mut engine);
}

#[test]
fn pictures_of_the_wrong_kind_are_named() {
    let mut huge = maps::tga(4, 4, |_, _| [9; 3]);
    huge[12..16].copy_from_slice(&[255; 4]);
    let mut engine = engine_with(vec![
        ("gfx/2d/text.tga", b"this is no picture".to_vec()),
        ("gfx/2d/empty.tga", vec![]),
        ("gfx/2d/huge.tga", huge),
        ("gfx/2d/broken.jpg", vec![0xFF, 0xD8, 0xFF, 0xE0, 1, 2, 3]),
    ]);
    for name in ["text.tga", "huge.tga", "broken.jpg"] {
        engine.take_messages();
        let stem = name.split('.').next().unwrap();
        assert_eq!(
            engine
                .register_shader_no_mip(&format!("gfx/2d/{stem}"))
                .unwrap(),
            0
        );
        line_about(&engine, name);
    }
    assert_eq!(engine.register_shader_no_mip("gfx/2d/empty").unwrap(), 0);
    assert_goes_on(&mut engine);
}

#[test]
fn broken_models_are_refused() {
    let whole = maps::files()
        .into_iter()
        .find(|(n, _)| n == "models/test.md3")
        .unwrap()
        .1;
    let mut engine = engine_with(vec![(
        "models/garbage.md3",
        b"IDP3 and nothing more".to_vec(),
    )]);
    assert_eq!(engine.register_model("models/garbage.md3").unwrap(), 0);
    line_about(&engine, "models/garbage.md3");
    for part in 0..8 {
        let name = format!("models/cut{part}.md3");
        engine.insert_file(&name, whole[..whole.len() * part / 8].to_vec());
        assert_eq!(engine.register_model(&name).unwrap(), 0, "{part} eighths");
    }
    // handles that were never given out
    for handle in [-1, 77777, i32::MIN, i32::MAX] {
        engine.model_bounds(handle).unwrap();
        assert_eq!(
            engine.lerp_tag(handle, [0, 0], 0.0, "tag_top").unwrap(),
            None
        );
        engine
            .draw_stretch_pic([0.0, 0.0, 8.0, 8.0], [0.0, 0.0, 1.0, 1.0], handle)
            .unwrap();
    }
    assert_goes_on(&mut engine);
}

#[test]
fn broken_skeletons_are_refused_or_drawn() {
    let mut engine = engine_with(vec![]);
    engine.start_map(ROOMS).unwrap();
    let view = View::new(HERE, 0.0);
    let mut random = Random::new(12345);
    let kinds = [
        ("mdr", tube::mdr(false)),
        ("mdr", tube::mdr(true)),
        ("iqm", tube::iqm(true)),
    ];
    for (number, (kind, whole)) in kinds.into_iter().enumerate() {
        for part in 0..8 {
            let name = format!("models/cut{number}-{part}.{kind}");
            engine.insert_file(&name, whole[..whole.len() * part / 8].to_vec());
            assert_eq!(engine.register_model(&name).unwrap(), 0, "{part} eighths");
            // what is not there at all is no more than missing
            if part > 0 {
                line_about(&engine, &name);
            }
        }
        let mut models = Vec::new();
        for part in 0..60 {
            let mut bytes = whole.clone();
            // from one byte, which many bear, to eight
            for _ in 0..1 + part % 8 {
                let at = random.below(bytes.len());
                bytes[at] = random.bits() as u8;
            }
            let name = format!("models/poked{number}-{part}.{kind}");
            engine.insert_file(&name, bytes);
            models.push(engine.register_model(&name).unwrap());
        }
        assert!(models.iter().any(|model| *model > 0));
        for look in ["0", "1"] {
            engine.set("r_rt", look);
            let picture = engine.picture_of(|e| {
                e.clear_scene()?;
                for &model in &models {
                    e.model_bounds(model)?;
                    e.lerp_tag(model, [-3, i32::MAX], 0.5, tube::TAG)?;
                    e.add_entity(&tests::engine::abi::refEntity_t {
                        hModel: model,
                        frame: 2,
                        oldframe: 1,
                        backlerp: 0.5,
                        origin: [-40.0, 0.0, 40.0],
                        ..Default::default()
                    })?;
                }
                e.render_scene(&view)
            });
            picture.unwrap();
        }
        engine.set("r_rt", "0");
    }
    engine.assert_clean();
}

#[test]
fn long_and_empty_names_are_refused() {
    let mut engine = engine_with(vec![]);
    let long = "x".repeat(300);
    for name in ["", long.as_str(), "../../etc/passwd", "\\\\"] {
        assert_eq!(engine.register_shader(name).unwrap(), 0);
        assert_eq!(engine.register_model(name).unwrap(), 0);
        engine.register_skin(name).unwrap();
        engine.register_font(name, 12).unwrap();
        engine.remap_shader(name, name, Some("nonsense")).unwrap();
    }
    assert_goes_on(&mut engine);
}

#[test]
fn numbers_out_of_range_are_harmless() {
    let mut engine = engine_with(vec![]);
    engine.start_map(ROOMS).unwrap();
    let shader = engine.register_shader("gfx/2d/red").unwrap();
    for odd in [f32::NAN, f32::INFINITY, f32::MAX, -1.0e30] {
        engine
            .picture_of(|e| {
                e.draw_stretch_pic([odd, 0.0, odd, 10.0], [0.0, odd, 1.0, 1.0], shader)?;
                e.set_color(Some([odd; 4]))?;
                e.clear_scene()?;
                let entity = tests::engine::abi::refEntity_t {
                    reType: 2,
                    customShader: shader,
                    radius: odd,
                    origin: [odd, 0.0, 0.0],
                    ..Default::default()
                };
                e.add_entity(&entity)?;
                e.add_light(glam::Vec3::splat(odd), odd, glam::Vec3::ONE)?;
                let mut view = View::new(glam::Vec3::splat(odd), odd);
                e.render_scene(&view)?;
                view = View::new(HERE, 0.0);
                view.fov = odd;
                e.render_scene(&view)
            })
            .unwrap();
        engine.set_color(None).unwrap();
        engine.light_for_point(glam::Vec3::splat(odd)).unwrap();
        engine.in_pvs(glam::Vec3::splat(odd), HERE).unwrap();
        engine
            .mark_fragments(&[glam::Vec3::splat(odd); 4], glam::Vec3::splat(odd), 16, 4)
            .unwrap();
    }
    // entity kinds and frames that do not exist
    let model = engine.register_model("models/test.md3").unwrap();
    engine
        .picture_of(|e| {
            e.clear_scene()?;
            for frame in [-5, 2, i32::MAX, i32::MIN] {
                let entity = tests::engine::abi::refEntity_t {
                    hModel: model,
                    frame,
                    oldframe: frame,
                    ..Default::default()
                };
                e.add_entity(&entity)?;
            }
            e.render_scene(&View::new(HERE, 0.0))
        })
        .unwrap();
    assert_goes_on(&mut engine);
}
