//! Views in both looks: the map, what the game adds to it, what changes materials and lights while it plays.

use super::support::{dump, engine, engine_in_map, near, pixel, text_of};
use glam::Vec3;
use relight::compare::Rgb8;
use tests::engine::abi::{polyVert_t, refEntity_t};
use tests::engine::{Engine, Options, View};
use tests::gallery::tube;
use tests::maps::{self, ELSEWHERE, HERE, ROOMS};

/// Something is there, neither black nor burnt out.
fn assert_plausible(picture: &Rgb8, what: &str) {
    let (luminance, colors) = (picture.mean_luminance(), picture.distinct_colors());
    assert!(
        (4.0..235.0).contains(&luminance),
        "{what}: mean luminance {luminance}"
    );
    assert!(colors > 30, "{what}: {colors} different colours");
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
        // what is filtered over frames may move by a step of the display
        let again = green(&mut engine, false);
        assert!((again - shown).abs() <= 2, "r_rt {look}: {again} {shown}");
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
        let printed = text_of(&engine.take_messages());
        fitted += printed.matches("lights found in").count();
    }
    // each light is found once, and then put back
    assert_eq!(fitted, 1);
    for (first, again) in [(0, 2), (1, 3)] {
        let alike = relight::compare::compare(&shown[first], &shown[again]).unwrap();
        assert!(alike.ssim > 0.9, "{first}: {alike:?}");
    }
    engine.take_messages();
    engine.command("rt_lights").unwrap();
    let printed = text_of(&engine.take_messages());
    assert!(printed.contains("triangle lights"), "{printed}");
    engine.assert_clean();
}

#[test]
fn files_by_hand_are_named_when_they_are_used_and_when_they_are_not() {
    for pure in [false, true] {
        let mut engine = engine();
        let maps = engine.home().join("maps");
        std::fs::create_dir_all(&maps).unwrap();
        std::fs::write(maps.join("rooms.lights"), "ambient 40 1 1 1\n").unwrap();
        std::fs::write(maps.join("rooms.materials"), "rough * 2\n").unwrap();
        if pure {
            engine.read_packs_only();
        }
        engine.set("r_rt", "1");
        engine.set("rt_lights", "prior");
        engine.start_map(ROOMS).unwrap();
        engine.picture(&View::new(HERE, 30.0)).unwrap();
        let printed = text_of(&engine.take_messages());
        let used = printed.contains("lights as in maps/rooms.lights");
        let ignored = printed.contains("maps/rooms.lights is not used: this server");
        assert_eq!((used, ignored), (!pure, pure), "{printed}");
        let used = printed.contains("maps/rooms.materials: line 1: roughness is");
        let ignored = printed.contains("maps/rooms.materials is not used: this server");
        assert_eq!((used, ignored), (!pure, pure), "{printed}");
        engine.assert_clean();
    }
}

#[test]
fn files_of_materials_change_the_traced_look_while_playing() {
    let mut engine = engine();
    let maps = engine.home().join("maps");
    std::fs::create_dir_all(&maps).unwrap();
    let file = maps.join("rooms.materials");
    engine.set("rt_accumulate", "1");
    engine.set("rt_lights", "prior");
    engine.start_map(ROOMS).unwrap();
    let view = View::new(HERE, 30.0);
    let look = |engine: &mut Engine, traced: bool| {
        engine.set("r_rt", if traced { "1" } else { "0" });
        let frames = if traced { 24 } else { 1 };
        (0..frames).fold(None, |_, _| Some(engine.picture(&view).unwrap()))
    };
    let classic = look(&mut engine, false).unwrap();
    let plain = look(&mut engine, true).unwrap();
    let alike = |a: &Rgb8, b: &Rgb8| relight::compare::compare(a, b).unwrap().ssim;
    for (name, text) in [
        ("glass", "glass textures/test/wall 1.5 1 0.6 0.6"),
        ("mirror", "mirror textures/test/* 0.8 0.8 0.8"),
        ("metal", "metal textures/test/*\nrough textures/test/* 0.3"),
        ("emit", "emit textures/test/wall 300 1 0.2 0.2"),
    ] {
        std::fs::write(&file, text).unwrap();
        engine.command("rt_reload").unwrap();
        let changed = look(&mut engine, true).unwrap();
        dump(&changed, &format!("materials-{name}"));
        let ssim = alike(&plain, &changed);
        println!("{name}: {ssim}, {}", changed.mean_luminance());
        assert!(ssim < 0.9, "{name}: {ssim}");
        assert_eq!(look(&mut engine, false).unwrap(), classic, "{name}");
        // a choice of lights keeps the files, and their own lights
        engine.set("rt_lights", "calibrated");
        look(&mut engine, true);
        engine.set("rt_lights", "prior");
        engine.command("rt_reload").unwrap();
        let again = look(&mut engine, true).unwrap();
        let ssim = alike(&changed, &again);
        assert!(ssim > 0.9, "{name}: {ssim}");
    }
    std::fs::write(&file, "").unwrap();
    engine.command("rt_reload").unwrap();
    let back = look(&mut engine, true).unwrap();
    assert!(alike(&plain, &back) > 0.99, "{}", alike(&plain, &back));
    engine.assert_clean();
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
