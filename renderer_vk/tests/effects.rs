//! Effects of the classic look, drawn by a whole renderer without a window: shadows, flares, smooth edges, stereo.
//!
//! Without a device each test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

#[path = "common/cube.rs"]
mod cube;

use std::sync::Arc;

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use relight::MemoryFiles;
use renderer_vk::api::{EntityKind, Picture, RefDef, RefEntity, StretchedPicture};
use renderer_vk::{Anaglyph, Error, Eye, Look, ModelShadows, Renderer, RendererOptions, Settings};

/// Side of the picture, pixels.
const SIDE: u32 = 64;

/// Grey walls and a white flare.
const SCRIPT: &[u8] = b"
t/wall { { map $whiteimage
  rgbGen const ( 0.5 0.5 0.5 ) } }
t/body { { map $whiteimage
  rgbGen const ( 0.25 0.25 0.25 ) } }
flareShader { cull none
  { map $whiteimage
    blendFunc add
    rgbGen vertex } }
";

/// Shadow volumes and flares.
fn effects() -> Settings {
    Settings {
        flares: true,
        shadows: ModelShadows::Volumes,
        ..Settings::full_size()
    }
}

/// A renderer of small pictures in a room 512 units wide with a flare on its +x wall and a door beside it; `None`, with
/// a printed line, without a device.
struct Stage {
    renderer: Renderer,
    settings: Settings,
    box_model: i32,
    door: i32,
}

impl Stage {
    fn new(settings: Settings) -> Option<Self> {
        Self::made(settings, Renderer::new)
    }

    fn made(
        settings: Settings,
        make: impl FnOnce(RendererOptions) -> Result<Renderer, Error>,
    ) -> Option<Self> {
        let options = RendererOptions {
            validation: true,
            ..RendererOptions::headless(SIDE, SIDE)
        };
        let mut renderer = testkit::device(make(options))?;
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 0);
        map.add_room(wall, Vec3::splat(-256.0), Vec3::splat(256.0));
        map.add_flare(wall, Vec3::new(250.0, 0.0, 0.0), Vec3::NEG_X, Vec3::ONE);
        map.begin_model();
        map.add_box_faces(wall, Vec3::splat(-16.0), Vec3::splat(16.0), false);
        let mut files = MemoryFiles::new();
        files.insert("scripts/t.shader", SCRIPT).unwrap();
        files.insert("maps/t.bsp", map.build().write()).unwrap();
        files.insert("m/box.md3", cube::cube_model(16.0)).unwrap();
        renderer
            .begin_registration(Arc::new(files), &settings)
            .unwrap();
        renderer.load_world("maps/t.bsp").unwrap();
        let box_model = renderer.register_model("m/box.md3");
        let door = renderer.register_model("*1");
        assert!(box_model > 0 && door > 0);
        renderer.end_registration();
        Some(Self {
            renderer,
            settings,
            box_model,
            door,
        })
    }

    /// The picture of one frame with these entities.
    fn frame(&mut self, def: &RefDef, entities: &[RefEntity]) -> Picture {
        let renderer = &mut self.renderer;
        renderer.set_settings(&self.settings);
        renderer.begin_frame(def.time_ms);
        renderer.clear_scene();
        for entity in entities {
            renderer.add_entity(entity);
        }
        renderer.render_scene(def).unwrap();
        let picture = renderer.read_pixels().unwrap();
        renderer.end_frame().unwrap();
        picture
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        cube::check_validation(&self.renderer);
    }
}

fn def() -> RefDef {
    RefDef {
        width: 64,
        height: 64,
        fov_x: 90.0,
        fov_y: 90.0,
        view_origin: Vec3::new(-50.0, 0.0, 0.0),
        time_ms: 5000,
        ..RefDef::default()
    }
}

fn entity(model: i32, origin: Vec3) -> RefEntity {
    RefEntity {
        kind: EntityKind::Model,
        model,
        origin,
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        shader_rgba: [255; 4],
        ..RefEntity::default()
    }
}

fn red(picture: &Picture, x: usize, y: usize) -> u8 {
    picture.rgb[(y * picture.width as usize + x) * 3]
}

#[test]
fn stencil_shadows_darken_what_lies_behind_a_model() {
    let Some(mut stage) = Stage::new(Settings::full_size()) else {
        return;
    };
    let cube = entity(stage.box_model, Vec3::new(100.0, 0.0, -100.0));
    let plain = stage.frame(&def(), &[cube]);
    stage.settings.shadows = ModelShadows::Volumes;
    let shadowed = stage.frame(&def(), &[cube]);
    let empty = stage.frame(&def(), &[]);
    let mut dark = 0;
    for (a, b) in plain.rgb.iter().zip(&shadowed.rgb) {
        let shade = (f32::from(*a) * 0.6 + 0.5) as u8;
        assert!(*b == *a || b.abs_diff(shade) <= 1, "{a} became {b}");
        dark += usize::from(b != a);
    }
    assert!(dark > 60, "{dark}");
    // without a stencil again, and nothing is left of the shadow
    stage.settings.shadows = ModelShadows::Spot;
    assert!(stage.frame(&def(), &[cube]).rgb == plain.rgb);
    assert!(stage.frame(&def(), &[]).rgb == empty.rgb);
}

#[test]
fn flares_fade_in_where_they_can_be_seen_and_out_where_not() {
    let settings = Settings {
        flares: true,
        flare_coefficient: 1e6,
        ..Settings::full_size()
    };
    let Some(mut stage) = Stage::new(settings) else {
        return;
    };
    let middle = (32, 32);
    let at = |stage: &mut Stage, time_ms: i32, entities: &[RefEntity]| {
        let picture = stage.frame(&RefDef { time_ms, ..def() }, entities);
        red(&picture, middle.0, middle.1)
    };
    // 300 units away: half a side of 64 (40 / 640 + 8 / 300) pixels; seldom more than the rest to 255 shows
    let size: f32 = 64.0 * (40.0 / 640.0 + 8.0 / 300.0);
    let full = 255.0 * (1000.0 * size / (300.0 + 1000.0 * size)).powi(2);
    let expect = |shown: u8, behind: u8, fade: f32| {
        let wanted = (f32::from(behind) + full * fade).min(255.0);
        assert!((f32::from(shown) - wanted).abs() <= 2.0, "{shown} {wanted}");
    };
    stage.settings.flares = false;
    let wall = at(&mut stage, 1000, &[]);
    stage.settings.flares = true;
    // 7 times a second it could appear
    expect(at(&mut stage, 1000, &[]), wall, 0.007);
    expect(at(&mut stage, 1040, &[]), wall, 0.287);
    expect(at(&mut stage, 1300, &[]), wall, 1.0);
    // hidden by a door it goes the same way, over the door
    let door = entity(stage.door, Vec3::new(100.0, 0.0, 0.0));
    stage.settings.flares = false;
    let behind = at(&mut stage, 1300, &[door]);
    stage.settings.flares = true;
    expect(at(&mut stage, 1400, &[]), wall, 0.007);
    expect(at(&mut stage, 1900, &[]), wall, 1.0);
    expect(at(&mut stage, 1950, &[door]), behind, 0.993);
    expect(at(&mut stage, 2049, &[door]), behind, 0.3);
    expect(at(&mut stage, 2900, &[door]), behind, 0.0);
    // from behind there is none, nor where the eye is turned away
    let views = [
        (Vec3::new(255.0, 0.0, 0.0), [Vec3::X, Vec3::Y, Vec3::Z]),
        (Vec3::ZERO, [Vec3::NEG_X, Vec3::NEG_Y, Vec3::Z]),
    ];
    for (view_origin, view_axis) in views {
        let def = RefDef {
            view_origin,
            view_axis,
            time_ms: 4000,
            ..def()
        };
        let with = stage.frame(&def, &[]);
        stage.settings.flares = false;
        assert!(stage.frame(&def, &[]).rgb == with.rgb, "{view_origin}");
        stage.settings.flares = true;
    }
}

#[test]
fn several_samples_smooth_edges_along_with_shadows_and_flares() {
    let Some(mut stage) = Stage::new(effects()) else {
        return;
    };
    // turned, so that edges are not along the pixels
    let cube = RefEntity {
        axis: [Vec3::new(0.8, 0.6, 0.0), Vec3::new(-0.6, 0.8, 0.0), Vec3::Z],
        ..entity(stage.box_model, Vec3::new(100.0, 60.0, -60.0))
    };
    let shades = |picture: &Picture| {
        let mut seen: Vec<u8> = picture.rgb.clone();
        seen.sort_unstable();
        seen.dedup();
        seen.len()
    };
    let hard = stage.frame(&def(), &[cube]);
    stage.settings.multisample = 4;
    let smooth = stage.frame(&def(), &[cube]);
    assert!(shades(&smooth) > shades(&hard), "{}", shades(&smooth));
    let differing = hard.rgb.iter().zip(&smooth.rgb).filter(|(a, b)| a != b);
    assert!(differing.count() < hard.rgb.len() / 10);
    stage.settings.multisample = 0;
    assert!(stage.frame(&def(), &[cube]).rgb == hard.rgb);
}

#[test]
fn each_eye_draws_its_channels_from_its_place() {
    let Some(mut stage) = Stage::new(Settings::full_size()) else {
        return;
    };
    let cube = entity(stage.box_model, Vec3::new(0.0, 0.0, 0.0));
    let both = stage.frame(&def(), &[cube]);
    stage.settings.anaglyph = Anaglyph::RedCyan;
    // far apart, and meeting far behind the cube
    stage.settings.stereo_separation = 64.0;
    stage.settings.convergence = 320.0;
    let renderer = &mut stage.renderer;
    renderer.set_settings(&stage.settings);
    for eye in [Eye::Left, Eye::Right] {
        renderer.begin_frame(5000);
        renderer.set_eye(eye);
        renderer.clear_scene();
        renderer.add_entity(&cube);
        renderer.render_scene(&def()).unwrap();
    }
    let picture = renderer.read_pixels().unwrap();
    renderer.end_frame().unwrap();
    // where the cube's front begins and ends in the middle row
    let span = |picture: &Picture, channel: usize| {
        let row = 32 * picture.width as usize;
        let shade = |x: usize| picture.rgb[(row + x) * 3 + channel];
        let face = shade(32);
        let first = (0..32).rev().find(|x| shade(*x) != face).unwrap();
        let last = (32..64).find(|x| shade(*x) != face).unwrap();
        (first, last)
    };
    let (left, right) = span(&both, 0);
    let [red, green, blue] = [0, 1, 2].map(|channel| span(&picture, channel));
    // to the left eye what is before the meeting distance lies to the right
    assert!(red.0 > left && red.1 > right, "{red:?} {left} {right}");
    assert!(green.0 < left && green.1 < right, "{green:?}");
    assert_eq!(green, blue);
    // alone again
    stage.settings.anaglyph = Anaglyph::None;
    assert!(stage.frame(&def(), &[cube]).rgb == both.rgb);
}

#[test]
fn a_device_with_nothing_optional_draws_all_but_what_needs_it() {
    let settings = Settings {
        shadows: ModelShadows::Volumes,
        anisotropic_filter: true,
        max_anisotropy: 16.0,
        ..Settings::full_size()
    };
    let Some(mut rich) = Stage::new(settings.clone()) else {
        return;
    };
    let mut poor = Stage::made(settings, Renderer::with_required_only).unwrap();
    let info = poor.renderer.device_info();
    assert!(info.ray_tracing.is_none() && !info.ray_query && !info.wireframe);
    assert_eq!(info.anisotropy, None);
    let cube = |stage: &Stage| entity(stage.box_model, Vec3::new(100.0, 60.0, -60.0));
    let pictures = [&mut rich, &mut poor].map(|stage| stage.frame(&def(), &[cube(stage)]));
    assert!(pictures[0].rgb == pictures[1].rgb);
    let plain = &pictures[1];
    // lines, counts and flares need what such a device has not: nothing comes of them, and nothing fails
    poor.settings.flares = true;
    poor.settings.show_tris = true;
    poor.settings.show_normals = true;
    poor.settings.measure_overdraw = true;
    for _ in 0..3 {
        assert!(poor.frame(&def(), &[cube(&poor)]).rgb == plain.rgb);
    }
    poor.settings.multisample = 4;
    poor.frame(&def(), &[cube(&poor)]);
    // rays find their way without the device's help
    poor.settings.rt = Look::Traced;
    for _ in 0..2 {
        poor.frame(&def(), &[cube(&poor)]);
    }
}

#[test]
fn no_descriptor_is_written_while_drawing() {
    let Some(mut stage) = Stage::new(effects()) else {
        return;
    };
    let before = stage.renderer.descriptor_writes();
    let picture = stage.renderer.register_shader("t/wall", true);
    assert!(before > 0 && picture > 0);
    let mut counts = Vec::new();
    for frame in 0..6 {
        // what moves, turns and comes anew each time
        let mut entities = vec![entity(stage.door, Vec3::Z * 8.0 * frame as f32)];
        for number in 0..=frame {
            let place = Vec3::new(100.0, 60.0 - 24.0 * number as f32, -60.0);
            entities.push(entity(stage.box_model, place));
        }
        let def = RefDef {
            time_ms: 1000 + frame * 25,
            ..def()
        };
        let corner = StretchedPicture {
            position: Vec2::ZERO,
            size: Vec2::splat(9.0),
            st1: Vec2::ZERO,
            st2: Vec2::ONE,
        };
        stage.renderer.stretch_pic(&corner, picture);
        stage.frame(&def, &entities);
        counts.push(stage.renderer.descriptor_writes());
    }
    // the first frames make what they are drawn to
    let last = counts[2];
    assert!(
        counts.iter().skip(2).all(|count| *count == last),
        "{counts:?}"
    );
}
