//! The library in the stand-in engine: every entry point with its result checked, both looks, the life of a session.

#![forbid(unsafe_code)]

use glam::Vec3;
use relight::compare::Rgb8;
use tests::engine::abi::{polyVert_t, refEntity_t};
use tests::engine::files::Packs;
use tests::engine::{Engine, Message, Options, View};
use tests::gallery::tube;
use tests::maps::{self, ELSEWHERE, HERE, ROOMS};

/// An engine with the small game, its menu registered.
fn engine() -> Engine {
    Engine::start(Options {
        files: maps::files(),
        ..Options::default()
    })
    .expect("the library starts")
}

/// The same, in its map.
fn engine_in_map() -> Engine {
    let mut engine = engine();
    engine.start_map(ROOMS).expect("the map loads");
    engine
}

fn pixel(picture: &Rgb8, x: usize, y: usize) -> [u8; 3] {
    let at = (y * picture.width() + x) * 3;
    let p = picture.pixels();
    [p[at], p[at + 1], p[at + 2]]
}

/// Keeps a picture below `RELIGHT_PICTURES`, for whoever wants to see what a test saw.
fn dump(picture: &Rgb8, name: &str) {
    tests::data::keep_picture(picture, name);
}

fn near(a: [u8; 3], b: [u8; 3], tolerance: u8) -> bool {
    a.iter().zip(b).all(|(&a, b)| a.abs_diff(b) <= tolerance)
}

/// Something is there, neither black nor burnt out.
fn assert_plausible(picture: &Rgb8, what: &str) {
    let (luminance, colors) = (picture.mean_luminance(), picture.distinct_colors());
    assert!(
        (4.0..235.0).contains(&luminance),
        "{what}: mean luminance {luminance}"
    );
    assert!(colors > 30, "{what}: {colors} different colours");
}

fn text(characters: &[std::ffi::c_char]) -> String {
    characters
        .iter()
        .take_while(|&&c| c != 0)
        .map(|&c| char::from(c as u8))
        .collect()
}

#[test]
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

#[test]
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
    assert!(description.is_some_and(|d| !d.is_empty()));
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

#[test]
fn pictures_land_where_they_are_drawn() {
    let mut engine = engine();
    let red = engine.register_shader_no_mip("gfx/2d/red").unwrap();
    let quarters = engine.register_shader_no_mip("gfx/2d/quarters").unwrap();
    let tinted = engine.register_shader("gfx/2d/tinted").unwrap();
    assert!(red > 0 && quarters > 0 && tinted > 0);
    assert_eq!(engine.register_shader_no_mip("gfx/2d/red").unwrap(), red);
    assert_eq!(engine.register_shader("gfx/2d/nothing-here").unwrap(), 0);
    let whole = [0.0, 0.0, 1.0, 1.0];
    let picture = engine
        .picture_of(|e| {
            e.set_color(None)?;
            e.draw_stretch_pic([10.0, 20.0, 100.0, 50.0], whole, red)?;
            e.draw_stretch_pic([160.0, 120.0, 160.0, 120.0], whole, quarters)?;
            e.set_color(Some([0.0, 1.0, 0.0, 1.0]))?;
            e.draw_stretch_pic([10.0, 180.0, 40.0, 40.0], whole, tinted)?;
            e.set_color(None)?;
            // half of the picture's width
            e.draw_stretch_pic([200.0, 10.0, 100.0, 40.0], [0.5, 0.0, 1.0, 0.5], quarters)?;
            e.draw_stretch_pic([0.0, 0.0, 1.0, 1.0], whole, red)
        })
        .unwrap();
    assert!(near(pixel(&picture, 60, 45), [255, 0, 0], 1));
    for (x, y) in [(8, 45), (112, 45), (60, 18), (60, 72)] {
        assert!(near(pixel(&picture, x, y), [0; 3], 1), "{x} {y}");
    }
    // columns go right and rows go down
    assert!(near(pixel(&picture, 180, 140), [200, 200, 40], 2));
    assert!(near(pixel(&picture, 300, 140), [0, 200, 40], 2));
    assert!(near(pixel(&picture, 180, 220), [200, 0, 40], 2));
    assert!(near(pixel(&picture, 30, 200), [0, 255, 0], 1));
    dump(&picture, "pictures");
    let corner = pixel(&picture, 280, 30);
    assert!(near(corner, [0, 200, 40], 2), "{corner:?}");
    engine.assert_clean();
}

#[test]
fn raw_pictures_are_drawn_and_replaced() {
    let mut engine = engine();
    let flat = |color: [u8; 4]| color.repeat(32 * 32);
    let picture = engine.picture_of(|e| {
        e.draw_stretch_raw([40, 40, 100, 100], 32, &flat([0, 80, 160, 255]), 0, true)
    });
    assert!(near(pixel(&picture.unwrap(), 90, 90), [0, 80, 160], 1));
    // not dirty: what was uploaded before is shown
    let picture = engine
        .picture_of(|e| e.draw_stretch_raw([0, 0, 320, 240], 32, &flat([9, 9, 9, 255]), 0, false));
    assert!(near(pixel(&picture.unwrap(), 300, 200), [0, 80, 160], 1));
    engine
        .upload_cinematic(32, &flat([160, 0, 80, 255]), 0)
        .unwrap();
    let picture = engine
        .picture_of(|e| e.draw_stretch_raw([0, 0, 320, 240], 32, &flat([9, 9, 9, 255]), 0, false));
    assert!(near(pixel(&picture.unwrap(), 300, 200), [160, 0, 80], 1));
    engine.assert_clean();
    // a side that is no power of two drops the game
    let raised = engine
        .draw_stretch_raw([0, 0, 320, 240], 24, &[0; 24 * 24 * 4], 1, true)
        .unwrap_err();
    assert_eq!(raised.level, 1);
    assert!(raised.message.contains("24"), "{raised}");
}

#[test]
fn both_looks_show_the_room() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let classic = engine.picture(&view).unwrap();
    dump(&classic, "room-classic");
    assert_plausible(&classic, "classic");
    engine.set("r_rt", "1");
    let mut traced = engine.picture(&view).unwrap();
    for _ in 0..7 {
        traced = engine.picture(&view).unwrap();
    }
    dump(&traced, "room-traced");
    assert_plausible(&traced, "traced");
    assert_ne!(classic, traced, "r_rt changes nothing");
    engine.set("r_rt", "0");
    assert_eq!(
        engine.picture(&view).unwrap(),
        classic,
        "back in the classic look"
    );
    // solid is black at most: from the dark the room cannot be seen
    let turned = engine.picture(&View::new(HERE, 120.0)).unwrap();
    assert_ne!(turned, classic);
    engine.assert_clean();
}

#[test]
fn a_paused_view_stays_and_adds_up_while_the_game_goes_on() {
    let mut engine = engine_in_map();
    engine.set("r_rt", "1");
    engine.set("rt_accumulate", "1");
    let difference = |a: &Rgb8, b: &Rgb8| {
        let pairs = a.pixels().iter().zip(b.pixels());
        let sum: f64 = pairs.map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        sum / a.pixels().len() as f64
    };
    let mut time = 1000;
    let mut picture = |engine: &mut Engine, yaw: f32| {
        let mut view = View::new(HERE, yaw);
        time += 50;
        view.time = time;
        engine.picture(&view).unwrap()
    };
    let other = picture(&mut engine, 120.0);
    engine.set("rt_pause", "1");
    let first = picture(&mut engine, 30.0);
    let shown: Vec<Rgb8> = (0..6).map(|_| picture(&mut engine, 120.0)).collect();
    for later in &shown {
        assert!(difference(later, &first) < difference(&other, &first) * 0.5);
    }
    let step = |i: usize| difference(&shown[i], &shown[i + 1]);
    assert!(
        step(4) < step(0) * 0.7,
        "{} {}: it does not add up",
        step(0),
        step(4)
    );
    engine.set("rt_pause", "0");
    let resumed = picture(&mut engine, 120.0);
    assert!(difference(&resumed, &other) < difference(&resumed, &first) * 0.5);
    engine.assert_clean();
}

#[test]
fn flares_show_where_nothing_hides_them_in_both_looks() {
    let mut engine = engine_in_map();
    let model = engine.register_model("models/test.md3").unwrap();
    engine.set("r_flares", "1");
    let mut view = View {
        width: 160,
        height: 120,
        ..View::new(HERE, 0.0)
    };
    let screen = refEntity_t {
        hModel: model,
        origin: [-40.0, 0.0, 40.0],
        ..refEntity_t::default()
    };
    for look in ["0", "1"] {
        engine.set("r_rt", look);
        // how green the middle is, long enough after a change
        let mut green = |engine: &mut Engine, hidden: bool| {
            let mut last = [0; 3];
            for _ in 0..3 {
                view.time += 1000;
                let picture = engine.picture_of(|e| {
                    e.clear_scene()?;
                    if hidden {
                        e.add_entity(&screen)?;
                    }
                    e.render_scene(&view)
                });
                last = pixel(&picture.unwrap(), 88, 62);
            }
            i32::from(last[1]) - i32::from(last[0])
        };
        let (shown, hidden) = (green(&mut engine, false), green(&mut engine, true));
        assert!(shown > hidden + 20, "r_rt {look}: {shown} {hidden}");
        assert_eq!(green(&mut engine, false), shown, "r_rt {look}");
    }
    engine.assert_clean();
}

#[test]
fn scenes_hold_what_was_added() {
    let mut engine = engine_in_map();
    let model = engine.register_model("models/test.md3").unwrap();
    let red = engine.register_shader("gfx/2d/red").unwrap();
    assert!(model > 0 && red > 0);
    let view = View::new(HERE, 0.0);
    for look in ["0", "1"] {
        engine.set("r_rt", look);
        engine.set("rt_accumulate", "1");
        let shown = |engine: &mut Engine, draw: &dyn Fn(&mut Engine)| {
            let mut last = None;
            for _ in 0..3 {
                last = Some(
                    engine
                        .picture_of(|e| {
                            e.clear_scene()?;
                            draw(e);
                            e.render_scene(&view)
                        })
                        .unwrap(),
                );
            }
            last.unwrap()
        };
        let empty = shown(&mut engine, &|_| ());
        let middle = |picture: &Rgb8| {
            let around: Vec<[u8; 3]> = (0..81)
                .map(|i| pixel(picture, 156 + i % 9, 116 + i / 9))
                .collect();
            around
                .iter()
                .map(|p| p.map(f64::from))
                .fold([0.0; 3], |s, p| [s[0] + p[0], s[1] + p[1], s[2] + p[2]])
        };
        let entity = refEntity_t {
            hModel: model,
            origin: [-40.0, 0.0, 40.0],
            ..refEntity_t::default()
        };
        let with_model = shown(&mut engine, &|e| e.add_entity(&entity).unwrap());
        assert_ne!(
            middle(&with_model),
            middle(&empty),
            "r_rt {look}: the model is not there"
        );
        let corner = |y: f32, z: f32| polyVert_t {
            xyz: [-40.0, y, 40.0 + z],
            st: [0.5, 0.5],
            modulate: [255; 4],
        };
        // seen from -x; two polygons in one call
        let square = [
            corner(9.0, 9.0),
            corner(-9.0, 9.0),
            corner(-9.0, -9.0),
            corner(9.0, -9.0),
        ];
        let higher = square.map(|mut v| {
            v.xyz[2] += 25.0;
            v
        });
        let with_poly = shown(&mut engine, &|e| {
            e.add_poly(red, &[square, higher].concat(), 4).unwrap();
        });
        let [r, g, b] = middle(&with_poly);
        assert!(
            r > 2.0 * g.max(b),
            "r_rt {look}: the polygon is {r} {g} {b}"
        );
        let sprite = refEntity_t {
            reType: 2,
            customShader: red,
            radius: 10.0,
            origin: [-40.0, 0.0, 40.0],
            ..refEntity_t::default()
        };
        let with_sprite = shown(&mut engine, &|e| e.add_entity(&sprite).unwrap());
        let [r, g, b] = middle(&with_sprite);
        assert!(r > 2.0 * g.max(b), "r_rt {look}: the sprite is {r} {g} {b}");
        let lit = shown(&mut engine, &|e| {
            e.add_light(Vec3::new(100.0, 0.0, 40.0), 300.0, Vec3::new(1.0, 0.2, 0.2))
                .unwrap();
        });
        assert!(
            lit.mean_luminance() > empty.mean_luminance(),
            "r_rt {look}: the dynamic light does not light"
        );
        let lit = shown(&mut engine, &|e| {
            e.add_additive_light(Vec3::new(100.0, 0.0, 40.0), 300.0, Vec3::ONE)
                .unwrap();
        });
        assert!(
            lit.mean_luminance() > empty.mean_luminance(),
            "r_rt {look}: the additive light does not light"
        );
        assert_eq!(
            shown(&mut engine, &|_| ()).mean_luminance().round(),
            empty.mean_luminance().round()
        );
    }
    engine.assert_clean();
}

#[test]
fn models_of_every_kind_show_in_both_looks() {
    let mut files = maps::files();
    let models = [
        ("m/key.md3", tube::md3(2)),
        ("m/bone.mdr", tube::mdr(false)),
        ("m/small.mdr", tube::mdr(true)),
        ("m/joint.iqm", tube::iqm(false)),
    ];
    let names = models.each_ref().map(|(name, _)| *name);
    files.extend(models.map(|(name, bytes)| (name.to_string(), bytes)));
    let mut engine = Engine::start(Options {
        files,
        ..Options::default()
    })
    .expect("the library starts");
    engine.start_map(ROOMS).expect("the map loads");
    let view = View::new(HERE, 0.0);
    for look in ["0", "1"] {
        engine.set("r_rt", look);
        engine.set("rt_accumulate", "1");
        let shown = |engine: &mut Engine, entity: Option<refEntity_t>| {
            let mut frame = || {
                engine.picture_of(|e| {
                    e.clear_scene()?;
                    entity.iter().try_for_each(|entity| e.add_entity(entity))?;
                    e.render_scene(&view)
                })
            };
            frame().unwrap();
            frame().unwrap();
            frame().unwrap()
        };
        let empty = shown(&mut engine, None);
        let mut sizes = Vec::new();
        for name in names {
            let entity = refEntity_t {
                hModel: engine.register_model(name).unwrap(),
                origin: [-40.0, 0.0, 40.0],
                frame: 2,
                oldframe: 2,
                ..refEntity_t::default()
            };
            let picture = shown(&mut engine, Some(entity));
            dump(&picture, &format!("model-{look}-{}", sizes.len()));
            // what their shaders name is not there: they have the default image, dark with a bright edge
            let changed = (0..320 * 240).filter(|at| {
                let (x, y) = (at % 320, at / 320);
                !near(pixel(&picture, x, y), pixel(&empty, x, y), 60)
            });
            sizes.push(changed.count());
        }
        // frames, bones and joints: one and the same shape
        let first = sizes[0];
        assert!(
            first > 500 && sizes.iter().all(|size| size.abs_diff(first) < first / 20),
            "r_rt {look}: {names:?} have {sizes:?} pixels"
        );
    }
    engine.assert_clean();
}

#[test]
fn a_scene_without_a_world_draws_its_models() {
    let mut engine = engine();
    let model = engine.register_model("models/test.md3").unwrap();
    let entity = refEntity_t {
        hModel: model,
        origin: [60.0, 0.0, 0.0],
        ..refEntity_t::default()
    };
    let mut view = View::new(Vec3::ZERO, 0.0);
    view.flags = 1;
    for look in ["0", "1"] {
        engine.set("r_rt", look);
        let picture = engine
            .picture_of(|e| {
                e.clear_scene()?;
                e.add_entity(&entity)?;
                e.render_scene(&view)
            })
            .unwrap();
        assert!(
            pixel(&picture, 160, 120).iter().any(|&c| c > 10),
            "r_rt {look}"
        );
    }
    // without the flag there is nothing to show, which is the game's mistake
    engine.clear_scene().unwrap();
    view.flags = 0;
    engine.begin_frame(0).unwrap();
    let raised = engine.render_scene(&view).unwrap_err();
    assert_eq!(raised.level, 1, "{raised}");
}

#[test]
fn models_answer() {
    let mut engine = engine_in_map();
    let model = engine.register_model("models/test.md3").unwrap();
    assert_eq!(engine.register_model("models/test.md3").unwrap(), model);
    assert_eq!(engine.register_model("models/nothing.md3").unwrap(), 0);
    assert!(engine.register_skin("models/test.skin").unwrap() > 0);
    let tag = engine
        .lerp_tag(model, [0, 1], 0.25, "tag_top")
        .unwrap()
        .unwrap();
    assert_eq!(tag.origin, [0.0, 0.0, 20.0]);
    assert_eq!(
        tag.axis,
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    );
    assert_eq!(
        engine.lerp_tag(model, [0, 1], 0.0, "tag_none").unwrap(),
        None
    );
    assert_eq!(
        engine.model_bounds(model).unwrap(),
        (Vec3::new(0.0, -16.0, -16.0), Vec3::new(0.0, 16.0, 16.0))
    );
    // the map itself is inline model 0
    let world = engine.register_model("*0").unwrap();
    assert!(world > 0);
    let (low, high) = engine.model_bounds(world).unwrap();
    assert!(low.x <= -256.0 && high.x >= 1256.0, "{low} {high}");
    assert_eq!(engine.register_model("*77").unwrap(), 0);
    engine.assert_clean();
}

#[test]
fn the_world_answers() {
    let mut engine = engine_in_map();
    // ambient and directed light: shifted by two overbright bits, brought back into range, scaled by
    // r_ambientScale 0.6 and r_directedScale 1
    let [ambient, directed, direction] = engine.light_for_point(HERE).unwrap().unwrap();
    assert!(
        (ambient - Vec3::new(127.0, 191.0, 255.0) * 0.6).length() < 2.0,
        "{ambient}"
    );
    assert!(
        (directed - Vec3::new(255.0, 127.0, 63.0)).length() < 2.0,
        "{directed}"
    );
    assert!((direction - Vec3::Z).length() < 0.02, "{direction}");

    assert!(engine.in_pvs(HERE, HERE + Vec3::Y * 50.0).unwrap());
    assert!(!engine.in_pvs(HERE, ELSEWHERE).unwrap());

    let mut tokens = Vec::new();
    while let Some(token) = engine.entity_token().unwrap() {
        tokens.push(token);
        assert!(tokens.len() < 1000, "the entities never end");
    }
    assert_eq!(tokens[..3], ["{", "classname", "worldspawn"]);
    assert!(tokens.contains(&"info_player_deathmatch".to_string()));
    assert_eq!(tokens.last().unwrap(), "}");
    assert_eq!(
        engine.entity_token().unwrap().as_deref(),
        Some("{"),
        "the end rewinds"
    );
    engine.assert_clean();
}

#[test]
fn marks_are_clipped_to_surfaces() {
    let mut engine = engine_in_map();
    // clockwise seen from where the mark comes from
    let square = |center: Vec3, r: f32| {
        [(-r, -r), (-r, r), (r, r), (r, -r)].map(|(x, y)| center + Vec3::new(x, y, 0.0))
    };
    let down = Vec3::Z * -20.0;
    let (points, fragments) = engine
        .mark_fragments(&square(Vec3::new(-100.0, 0.0, 0.0), 16.0), down, 384, 128)
        .unwrap();
    assert!(!fragments.is_empty());
    for fragment in &fragments {
        assert!(fragment.numPoints >= 3);
    }
    for p in &points {
        assert!(
            p.z.abs() < 0.1 && (p.x + 100.0).abs() < 16.1 && p.y.abs() < 16.1,
            "{p}"
        );
    }
    // over an edge of the floor the mark is cut
    let (points, _) = engine
        .mark_fragments(&square(Vec3::new(-256.0, 0.0, 0.0), 16.0), down, 384, 128)
        .unwrap();
    assert!(points.iter().all(|p| p.x >= -256.1), "{points:?}");
    // in the middle of the room there is nothing
    let (_, none) = engine
        .mark_fragments(&square(Vec3::new(0.0, 0.0, 128.0), 8.0), down, 384, 128)
        .unwrap();
    assert!(none.is_empty());
    // small buffers are not overrun
    for (max_points, max_fragments) in [(0, 0), (3, 1), (4, 1), (384, 0)] {
        engine
            .mark_fragments(
                &square(HERE * Vec3::new(1.0, 1.0, 0.0), 64.0),
                down,
                max_points,
                max_fragments,
            )
            .unwrap();
    }
    engine.assert_clean();
}

#[test]
fn fonts_have_their_glyphs() {
    let mut engine = engine();
    let font = engine.register_font("", 12).unwrap();
    let a = &font.glyphs[usize::from(b'A')];
    assert_eq!((a.height, a.top, a.xSkip, a.imageWidth), (12, 10, 9, 8));
    assert!((font.glyphScale - 0.5 * 48.0 / 12.0).abs() < 10.0 && font.glyphScale > 0.0);
    assert!(a.glyph > 0, "a glyph has no shader");
    engine.assert_clean();
}

#[test]
fn shaders_are_remapped() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let before = engine.picture(&view).unwrap();
    engine
        .remap_shader("textures/test/wall", "textures/test/floor", Some("0"))
        .unwrap();
    let after = engine.picture(&view).unwrap();
    assert_ne!(before, after);
    engine
        .remap_shader("textures/test/wall", "textures/test/wall", None)
        .unwrap();
    assert_eq!(engine.picture(&view).unwrap(), before);
    engine
        .remap_shader("textures/no/such", "textures/test/floor", None)
        .unwrap();
    engine.assert_clean();
}

#[test]
fn films_play_on_walls() {
    let mut engine = engine_in_map();
    let mut view = View::new(
        ELSEWHERE * Vec3::new(1.0, 1.0, 0.0) + Vec3::new(-100.0, 0.0, 40.0),
        0.0,
    );
    view.angles.x = -89.0;
    engine.picture(&view).unwrap();
    let picture = engine.picture(&view).unwrap();
    dump(&picture, "film");
    let [r, g, b] = pixel(&picture, 160, 120);
    assert!(r > 100 && b > 100 && g < r / 2, "the film is {r} {g} {b}");
    engine.assert_clean();
}

#[test]
fn screenshots_are_files() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let shown = engine.picture(&view).unwrap();
    let frame = |engine: &mut Engine, command: &str| {
        engine.begin_frame(0).unwrap();
        engine.clear_scene().unwrap();
        engine.render_scene(&view).unwrap();
        engine.command(command).unwrap();
        engine.end_frame().unwrap();
    };
    frame(&mut engine, "screenshot");
    assert!(engine.read_file("screenshots/shot0000.tga").is_some());
    frame(&mut engine, "screenshot");
    assert!(engine.read_file("screenshots/shot0001.tga").is_some());
    frame(&mut engine, "screenshotJPEG good");
    let jpeg = engine.read_file("screenshots/good.jpg").unwrap();
    let jpeg = image_of(&jpeg, "jpg");
    let alike = relight::compare::compare(&shown, &jpeg).unwrap();
    assert!(alike.ssim > 0.95, "{alike:?}");
    frame(&mut engine, "screenshot levelshot");
    let levelshot = engine.read_file("levelshots/rooms.tga").unwrap();
    let levelshot = image_of(&levelshot, "tga");
    assert_eq!((levelshot.width(), levelshot.height()), (128, 128));
    engine.assert_clean();
}

#[test]
fn a_still_picture_is_made_beside_the_game() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let frame = |engine: &mut Engine, command: &str, yaw: f32| {
        engine.begin_frame(0).unwrap();
        engine.clear_scene().unwrap();
        engine.render_scene(&View::new(HERE, yaw)).unwrap();
        if !command.is_empty() {
            engine.command(command).unwrap();
        }
        engine.end_frame().unwrap();
    };
    let said = |engine: &mut Engine| text_of(&engine.take_messages());
    engine.take_messages();
    frame(&mut engine, "rt_screenshot 4", 30.0);
    assert!(
        said(&mut engine).contains("r_rt 0"),
        "it needs the traced look"
    );
    engine.set("r_rt", "1");
    engine.set("rt_accumulate", "1");
    let mut shown = engine.picture(&view).unwrap();
    for _ in 0..15 {
        shown = engine.picture(&view).unwrap();
    }
    engine.set("rt_accumulate", "0");
    for wrong in [
        "rt_screenshot",
        "rt_screenshot 0",
        "rt_screenshot 2 big",
        "rt_screenshot 2 0x9",
    ] {
        engine.take_messages();
        frame(&mut engine, wrong, 30.0);
        assert!(
            said(&mut engine).contains("rt_screenshot"),
            "{wrong} is taken"
        );
    }
    engine.take_messages();
    frame(&mut engine, "rt_screenshot 16 320x240", 30.0);
    frame(&mut engine, "rt_screenshot 1", 30.0);
    // the picture is of the view when it was asked for, whatever the game shows meanwhile
    for _ in 0..20 {
        frame(&mut engine, "", 120.0);
    }
    let lines = said(&mut engine);
    assert!(
        lines.contains("is being made") && lines.contains("of 16 samples"),
        "{lines}"
    );
    let file = engine
        .read_file("screenshots/shot0000.tga")
        .expect("the picture");
    let alike = relight::compare::compare(&shown, &image_of(&file, "tga")).unwrap();
    assert!(alike.ssim > 0.9, "{alike:?}");
    // larger than the window
    frame(&mut engine, "rt_screenshot 1 400x300", 30.0);
    frame(&mut engine, "", 30.0);
    frame(&mut engine, "", 30.0);
    let file = engine
        .read_file("screenshots/shot0001.tga")
        .expect("the picture");
    let large = image_of(&file, "tga");
    assert_eq!((large.width(), large.height()), (400, 300));
    engine.assert_clean();
}

#[test]
fn costs_are_told_in_lines_and_as_json() {
    let mut engine = engine_in_map();
    engine.set("r_rt", "1");
    let view = View::new(HERE, 30.0);
    engine.picture(&view).unwrap();
    engine.command("rt_stats").unwrap();
    engine.command("rt_stats json stats/frame").unwrap();
    engine.take_messages();
    for _ in 0..5 {
        engine.picture(&view).unwrap();
    }
    let lines = text_of(&engine.take_messages());
    for part in [
        "trace_primary",
        "rays",
        "all passes",
        "screen images",
        "textures",
    ] {
        assert!(lines.contains(part), "no {part} in {lines}");
    }
    let json = engine.read_file("stats/frame.json").expect("the file");
    let json = String::from_utf8(json).unwrap();
    let primary = json.lines().find(|l| l.contains("\"trace_primary\""));
    let primary = primary.expect("the pass");
    let rays = primary
        .split("\"rays\": ")
        .nth(1)
        .and_then(|t| t.split(',').next());
    let rays: u64 = rays.and_then(|r| r.parse().ok()).expect("a number");
    assert!(rays >= 320 * 240, "{rays}");
    engine.assert_clean();
}

#[test]
fn lights_of_the_map_can_be_chosen_while_playing() {
    let mut engine = engine_in_map();
    engine.set("r_rt", "1");
    engine.set("rt_accumulate", "1");
    let view = View::new(HERE, 30.0);
    let mut shown = Vec::new();
    engine.take_messages();
    let mut fitted = 0;
    for choice in ["prior", "calibrated", "prior", "calibrated"] {
        engine.command(&format!("rt_lights {choice}")).unwrap();
        assert_eq!(engine.cvar("rt_lights").as_deref(), Some(choice));
        for _ in 0..7 {
            engine.picture(&view).unwrap();
        }
        shown.push(engine.picture(&view).unwrap());
        let said = text_of(&engine.take_messages());
        fitted += said.matches("lights fitted").count();
    }
    // each light is found once, and then put back
    assert_eq!(fitted, 1);
    for (first, again) in [(0, 2), (1, 3)] {
        let alike = relight::compare::compare(&shown[first], &shown[again]).unwrap();
        assert!(alike.ssim > 0.9, "{first}: {alike:?}");
    }
    engine.take_messages();
    engine.command("rt_lights").unwrap();
    let said = text_of(&engine.take_messages());
    assert!(said.contains("triangle lights"), "{said}");
    engine.assert_clean();
}

fn text_of(messages: &[Message]) -> String {
    messages
        .iter()
        .map(|message| message.text.as_str())
        .collect()
}

fn image_of(bytes: &[u8], extension: &str) -> Rgb8 {
    let image = relight::image::decode("a picture", extension, bytes).unwrap();
    let pixels = image.pixels().flat_map(|[r, g, b, _]| [r, g, b]).collect();
    Rgb8::new(image.width as usize, image.height as usize, pixels).unwrap()
}

#[test]
fn video_frames_reach_the_writer() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let shown = engine.picture(&view).unwrap();
    let (mut capture, mut encode) = (vec![0; 320 * 240 * 8], vec![0; 320 * 240 * 8]);
    for jpeg in [false, true] {
        engine.begin_frame(0).unwrap();
        engine.clear_scene().unwrap();
        engine.render_scene(&view).unwrap();
        engine
            .take_video_frame(320, 240, &mut capture, &mut encode, jpeg)
            .unwrap();
        engine.end_frame().unwrap();
    }
    let frames = engine.take_video();
    assert_eq!(frames.len(), 2);
    // blue first, rows from the bottom
    assert_eq!(frames[0].len(), 320 * 240 * 3);
    let rgb: Vec<u8> = frames[0]
        .chunks_exact(320 * 3)
        .rev()
        .flatten()
        .copied()
        .collect();
    let rgb: Vec<u8> = rgb
        .chunks_exact(3)
        .flat_map(|p| [p[2], p[1], p[0]])
        .collect();
    assert_eq!(Rgb8::new(320, 240, rgb).unwrap(), shown);
    assert_eq!(frames[1][..2], [0xFF, 0xD8]);
    let alike = relight::compare::compare(&shown, &image_of(&frames[1], "jpg")).unwrap();
    assert!(alike.ssim > 0.9, "{alike:?}");
    engine.assert_clean();
}

#[test]
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

#[test]
fn calls_outside_of_registration_are_harmless() {
    let mut engine = Engine::load(
        &tests::data::library(),
        Options {
            files: maps::files(),
            ..Options::default()
        },
    )
    .unwrap();
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

#[test]
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

#[test]
fn maps_of_the_game_in_both_looks() {
    let Some(data) = tests::data::game_data() else {
        return;
    };
    let packs = Packs::open(&data).unwrap();
    let few = ["oa_dm1", "am_galmevish", "oa_ctf2"]
        .map(str::to_string)
        .to_vec();
    let full = tests::data::is_set("RELIGHT_FULL");
    let mut engine = Engine::start(Options {
        packs: packs.clone(),
        ..Options::default()
    })
    .unwrap();
    let maps = if full { map_names(&engine) } else { few };
    for map in maps {
        let file = format!("maps/{map}.bsp");
        engine.take_messages();
        engine
            .start_map(&file)
            .unwrap_or_else(|e| panic!("{map}: {e}"));
        let view = View::new(spawn(&mut engine), 0.0);
        for look in ["0", "1"] {
            engine.set("r_rt", look);
            let mut pictures: Vec<Rgb8> = Vec::new();
            for yaw in [0.0, 90.0, 180.0, 270.0] {
                let view = View {
                    angles: Vec3::new(0.0, yaw, 0.0),
                    ..view
                };
                pictures.push(engine.picture(&view).unwrap());
            }
            let brightest = pictures
                .iter()
                .map(Rgb8::mean_luminance)
                .fold(0.0, f64::max);
            let colors = pictures.iter().map(Rgb8::distinct_colors).max().unwrap();
            println!("{map} r_rt {look}: mean luminance up to {brightest:.1}, colours {colors}");
            assert!(
                (3.0..240.0).contains(&brightest),
                "{map}, r_rt {look}: luminance {brightest}"
            );
            assert!(colors > 200, "{map}, r_rt {look}: {colors} colours");
        }
        engine.set("r_rt", "0");
        engine.assert_clean();
    }
}

fn map_names(engine: &Engine) -> Vec<String> {
    let mut names: Vec<String> = engine
        .list_files("maps", ".bsp")
        .iter()
        .map(|n| n.trim_end_matches(".bsp").to_string())
        .collect();
    names.sort();
    names
}

/// Where the first player may start, eyes included.
fn spawn(engine: &mut Engine) -> Vec3 {
    let mut tokens = Vec::new();
    while let Some(token) = engine.entity_token().unwrap() {
        tokens.push(token);
    }
    let start = tokens
        .split(|t| t == "}")
        .find(|e| {
            e.iter()
                .any(|t| t == "info_player_deathmatch" || t == "info_player_start")
        })
        .expect("a map has a start");
    let at = start
        .iter()
        .position(|t| t == "origin")
        .expect("a start has a place")
        + 1;
    let numbers: Vec<f32> = start[at]
        .split_whitespace()
        .map(|n| n.parse().unwrap())
        .collect();
    Vec3::from_slice(&numbers) + Vec3::Z * 40.0
}

#[test]
fn collision_surfaces_are_added_to_the_picture() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 0.0);
    let plain = engine.picture(&view).unwrap();
    engine.set("r_debugSurface", "1");
    let shown = engine.picture(&view).unwrap();
    dump(&shown, "debug-surface");
    let [before, after] = [&plain, &shown].map(|picture| pixel(picture, 160, 120));
    assert_eq!(
        after,
        [255, before[1], before[2]],
        "red is added to {before:?}"
    );
    // 10 of 50 units are 32 pixels; the outline is white
    let aside = pixel(&shown, 160 + 40, 120);
    assert_eq!(aside, pixel(&plain, 160 + 40, 120));
    let edge = (188..196).any(|x| pixel(&shown, x, 120) == [255; 3]);
    assert!(edge, "there is no outline");
    engine.assert_clean();
}
