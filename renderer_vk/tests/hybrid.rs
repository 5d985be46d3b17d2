//! The hybrid look (`r_rt 2`), drawn by a whole renderer without a window: shadows of models beside their closed form, and
//! dynamic lights behind walls.
//!
//! Without a device each test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

#[path = "common/cube.rs"]
mod cube;

use std::sync::Arc;

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use relight::MemoryFiles;
use renderer_vk::api::{DynamicLight, EntityKind, Picture, RefDef, RefEntity};
use renderer_vk::{Look, Renderer, RendererOptions, Settings, TracerChoice};

/// Side of the picture, pixels.
const SIDE: usize = 192;
/// Value of the lightmaps, of 255, under a white texture.
const BAKED: u8 = 200;
/// Half the edge of the model.
const HALF: f32 = 16.0;
/// Reach of the rays to models, units.
const REACH: f32 = 128.0;

const SCRIPT: &[u8] = b"
t/lit { { map $lightmap } }
t/mirror { { map $lightmap }
  { map t/env.tga
    tcGen environment
    blendFunc add } }
t/body { { map $whiteimage
  rgbGen const ( 0.25 0.25 0.25 ) } }
";

/// Height of a reflecting floor over the other one.
const HEIGHT: f32 = 1.0;
/// Value of the lightmap of a reflecting floor.
const DARK: u8 = 20;
/// Value of the model.
const BODY: f32 = 63.0;

/// A room with a lightmapped floor at 0, and a wall across it that reaches from x = 60 to x = 64.
struct Stage {
    renderer: Renderer,
    settings: Settings,
    model: i32,
}

impl Stage {
    fn new(tracer: TracerChoice) -> Option<Self> {
        Self::with(tracer, false)
    }

    /// `mirror`: the floor reflects.
    fn with(tracer: TracerChoice, mirror: bool) -> Option<Self> {
        let options = RendererOptions {
            validation: true,
            ..RendererOptions::headless(SIDE as u32, SIDE as u32)
        };
        let mut renderer = testkit::device(Renderer::new(options))?;
        let settings = Settings {
            map_overbright_bits: 0,
            rt_tracer: tracer,
            ..Settings::full_size()
        };
        let mut map = MapBuilder::new();
        let lit = map.add_shader("t/lit", 0, 0);
        map.add_room(lit, Vec3::new(-256.0, -256.0, 0.0), Vec3::splat(256.0));
        map.add_box_faces(
            lit,
            Vec3::new(60.0, -256.0, 0.0),
            Vec3::new(64.0, 256.0, 256.0),
            false,
        );
        let page = map.add_lightmap([BAKED; 3]);
        for surface in 0..12 {
            map.set_lightmap(surface, page);
        }
        if mirror {
            let mirror = map.add_shader("t/mirror", 0, 0);
            let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
            let floor = map.add_quad(mirror, corners.map(|(x, y)| Vec3::new(x, y, 0.0) * 256.0));
            for vertex in map.vertices_mut(floor) {
                vertex.position.z = HEIGHT;
                vertex.normal = Vec3::Z;
            }
            let dark = map.add_lightmap([DARK; 3]);
            map.set_lightmap(floor, dark);
        }
        let mut files = MemoryFiles::new();
        files.insert("t/env.tga", white()).unwrap();
        files.insert("scripts/t.shader", SCRIPT).unwrap();
        files.insert("maps/t.bsp", map.build().write()).unwrap();
        files.insert("m/box.md3", cube::cube_model(HALF)).unwrap();
        renderer
            .begin_registration(Arc::new(files), &settings)
            .unwrap();
        renderer.load_world("maps/t.bsp").unwrap();
        let model = renderer.register_model("m/box.md3");
        assert!(model > 0);
        renderer.end_registration();
        Some(Self {
            renderer,
            settings,
            model,
        })
    }

    /// The picture of a look with the model at these places, and with these lights.
    fn picture(&mut self, look: Look, models: &[Vec3], lights: &[DynamicLight]) -> Picture {
        self.settings.rt = look;
        let renderer = &mut self.renderer;
        renderer.set_settings(&self.settings);
        renderer.begin_frame(5000);
        renderer.clear_scene();
        for &origin in models {
            renderer.add_entity(&RefEntity {
                kind: EntityKind::Model,
                model: self.model,
                origin,
                axis: [Vec3::X, Vec3::Y, Vec3::Z],
                shader_rgba: [255; 4],
                ..RefEntity::default()
            });
        }
        for light in lights {
            renderer.add_light(*light);
        }
        renderer.render_scene(&def()).unwrap();
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

/// An uncompressed TGA image of one white pixel.
fn white() -> Vec<u8> {
    let mut tga = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 32, 8];
    tga.extend([255; 4]);
    tga
}

/// Looks down at 45 degrees.
fn def() -> RefDef {
    RefDef {
        width: SIDE as i32,
        height: SIDE as i32,
        fov_x: 70.0,
        fov_y: 70.0,
        view_origin: Vec3::new(-120.0, 0.0, 110.0),
        view_axis: [
            Vec3::new(1.0, 0.0, -1.0).normalize(),
            Vec3::Y,
            Vec3::new(1.0, 0.0, 1.0).normalize(),
        ],
        time_ms: 5000,
        ..RefDef::default()
    }
}

/// The camera's ray through a pixel.
fn ray(x: f32, y: f32) -> Vec3 {
    let def = def();
    let [forward, left, up] = def.view_axis;
    let tan = (35.0f32).to_radians().tan();
    let at = |v: f32| (v + 0.5) / SIDE as f32 * 2.0 - 1.0;
    forward - left * at(x) * tan - up * at(y) * tan
}

/// Distance at which a ray enters the model.
fn enters(origin: Vec3, direction: Vec3, model: Vec3) -> Option<f32> {
    let near = (model - HALF - origin) / direction;
    let far = (model + HALF - origin) / direction;
    let enter = near.min(far).max_element();
    (enter > 0.0 && enter <= near.max(far).min_element()).then_some(enter)
}

/// The part of the hemisphere above a point of the floor, weighted by the cosine, that the model occludes.
fn occlusion(point: Vec3, model: Vec3) -> f32 {
    const STEPS: usize = 64;
    let mut hits = 0;
    for i in 0..STEPS {
        for j in 0..STEPS {
            let u = (i as f32 + 0.5) / STEPS as f32;
            let angle = (j as f32 + 0.5) / STEPS as f32 * std::f32::consts::TAU;
            let direction = (Vec2::from_angle(angle) * u.sqrt()).extend((1.0 - u).sqrt());
            hits += u32::from(enters(point, direction, model).is_some_and(|t| t < REACH));
        }
    }
    hits as f32 / (STEPS * STEPS) as f32
}

/// The form factor of a square of half edge `half` at `height` above a point below its middle (Howell, B-4).
fn square_above(half: f32, height: f32) -> f32 {
    let x = half / height;
    let root = (1.0 + x * x).sqrt();
    4.0 / std::f32::consts::TAU * 2.0 * (x / root) * (x / root).atan()
}

fn red(picture: &Picture, x: usize, y: usize) -> f32 {
    f32::from(picture.rgb[(y * SIDE + x) * 3])
}

#[test]
fn the_expected_occlusion_is_the_form_factor_below_the_model() {
    for height in [8.0, 24.0, 60.0] {
        let found = occlusion(Vec3::ZERO, Vec3::Z * (height + HALF));
        let exact = square_above(HALF, height);
        assert!((found - exact).abs() < 0.01, "{height}: {found}, {exact}");
    }
}

fn check_model_shadow(tracer: TracerChoice) {
    let Some(mut stage) = Stage::new(tracer) else {
        return;
    };
    let model = Vec3::new(-20.0, 0.0, 36.0);
    let classic = stage.picture(Look::Classic, &[model], &[]);
    let shown = stage.picture(Look::Hybrid, &[model], &[]);
    let camera = def().view_origin;
    let (mut below, mut sum, mut count) = (0, 0.0, 0);
    let (mut squares, mut worst) = (0.0, 0.0f32);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (px, py) = (x as f32, y as f32);
            let direction = ray(px, py);
            let point = camera - direction * (camera.z / direction.z);
            let around =
                [-3.0, 0.0, 3.0].map(|dx| [-3.0, 0.0, 3.0].map(|dy| ray(px + dx, py + dy)));
            let near_model = |d: &Vec3| enters(camera, *d, model).is_some();
            if direction.z >= 0.0 || point.x > 50.0 || point.abs().max_element() > 240.0 {
                continue;
            }
            if around.iter().flatten().any(near_model) {
                continue;
            }
            let wanted = occlusion(point, model);
            let (before, after) = (red(&classic, x, y), red(&shown, x, y));
            assert_eq!(before, f32::from(BAKED));
            if point.distance(model) > REACH + 40.0 {
                assert_eq!(before, after, "{point}");
            }
            let error = after - before * (1.0 - wanted);
            squares += error * error;
            worst = worst.max(error.abs());
            sum += error;
            count += 1;
            below += i32::from(wanted > 0.25);
        }
    }
    let mean = sum / count as f32;
    let rms = (squares / count as f32).sqrt();
    // by 32 directions
    assert!(worst < 16.0 && rms < 4.0, "{tracer:?}: {worst} {rms}");
    assert!(below > 100 && mean.abs() < 0.6, "{below} {mean}");
    // the model itself is as before
    let middle = (0..SIDE * SIDE)
        .filter(|i| enters(camera, ray((i % SIDE) as f32, (i / SIDE) as f32), model).is_some());
    let mut inside = 0;
    for i in middle {
        let same = red(&classic, i % SIDE, i / SIDE) == red(&shown, i % SIDE, i / SIDE);
        inside += usize::from(same);
    }
    assert!(inside > 300, "{inside}");
}

#[test]
fn a_model_shadows_the_floor_by_its_solid_angle() {
    check_model_shadow(TracerChoice::Auto);
}

#[test]
fn every_tracer_finds_the_same_shadow() {
    for tracer in [
        TracerChoice::Compute,
        TracerChoice::Grid,
        TracerChoice::Query,
        TracerChoice::Pipeline,
    ] {
        check_model_shadow(tracer);
    }
}

#[test]
fn without_models_and_lights_the_picture_is_the_classic_one() {
    let Some(mut stage) = Stage::new(TracerChoice::Auto) else {
        return;
    };
    let classic = stage.picture(Look::Classic, &[], &[]);
    assert!(classic.rgb == stage.picture(Look::Hybrid, &[], &[]).rgb);
}

#[test]
fn a_light_behind_a_wall_does_not_shine_through_it() {
    let Some(mut stage) = Stage::new(TracerChoice::Auto) else {
        return;
    };
    let light = |x: f32| DynamicLight {
        origin: Vec3::new(x, 0.0, 40.0),
        radius: 300.0,
        color: Vec3::new(0.5, 0.4, 0.3),
        additive: true,
        ..DynamicLight::default()
    };
    for pixels in [0, 1] {
        stage.settings.dlight_mode = pixels;
        let dark = stage.picture(Look::Classic, &[], &[]);
        // through the wall
        let leaks = stage.picture(Look::Classic, &[], &[light(100.0)]);
        assert!(leaks.rgb != dark.rgb);
        let hidden = stage.picture(Look::Hybrid, &[], &[light(100.0)]);
        assert!(hidden.rgb == dark.rgb);
        // on this side
        let lit = stage.picture(Look::Classic, &[], &[light(20.0)]);
        let seen = stage.picture(Look::Hybrid, &[], &[light(20.0)]);
        assert!(lit.rgb != dark.rgb);
        assert!(lit.rgb == seen.rgb);
        // a model between the light and the camera's side of the floor
        let model = [Vec3::new(-30.0, 0.0, 30.0)];
        let open = stage.picture(Look::Classic, &model, &[light(40.0)]);
        let shadowed = stage.picture(Look::Hybrid, &model, &[light(40.0)]);
        let without = stage.picture(Look::Hybrid, &model, &[]);
        let (mut whole, mut none) = (0, 0);
        for i in (0..open.rgb.len()).step_by(3) {
            assert!(shadowed.rgb[i] <= open.rgb[i]);
            whole += u32::from(shadowed.rgb[i] > without.rgb[i]);
            none += u32::from(open.rgb[i] > dark.rgb[i] && shadowed.rgb[i] == without.rgb[i]);
        }
        assert!(whole > 1000 && none > 300, "{whole} {none}");
    }
}

fn check_reflection(tracer: TracerChoice) {
    let Some(mut stage) = Stage::with(tracer, true) else {
        return;
    };
    let model = Vec3::new(-20.0, 0.0, 36.0);
    let classic = stage.picture(Look::Classic, &[model], &[]);
    let shown = stage.picture(Look::Hybrid, &[model], &[]);
    let camera = def().view_origin;
    let point = |direction: Vec3| camera - direction * ((camera.z - HEIGHT) / direction.z);
    let mirrors = |direction: Vec3| {
        enters(
            point(direction),
            direction * Vec3::new(1.0, 1.0, -1.0),
            model,
        )
        .is_some()
    };
    let (mut boxes, mut walls) = (0, 0);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let around = [-3.0, 0.0, 3.0]
                .map(|dx| [-3.0, 0.0, 3.0].map(|dy| ray(x as f32 + dx, y as f32 + dy)));
            let around = around.as_flattened();
            let floor = |d: &Vec3| d.z < 0.0 && point(*d).x < 50.0;
            let in_front = |d: &Vec3| enters(camera, *d, model).is_some();
            if !around.iter().all(floor) || around.iter().any(in_front) {
                continue;
            }
            // the environment image is white
            assert_eq!(red(&classic, x, y), 255.0);
            let direction = ray(x as f32, y as f32);
            let mirrored = mirrors(direction);
            if around.iter().any(|d| mirrors(*d) != mirrored) {
                continue;
            }
            let baked = f32::from(DARK) * (1.0 - occlusion(point(direction), model));
            let wanted = baked + if mirrored { BODY } else { f32::from(BAKED) };
            let error = red(&shown, x, y) - wanted;
            assert!(error.abs() < 4.0, "{x} {y} {mirrored}: {error}");
            if mirrored {
                boxes += 1;
            } else {
                walls += 1;
            }
        }
    }
    assert!(boxes > 200 && walls > 5000, "{boxes} {walls}");
}

#[test]
fn an_environment_image_on_the_floor_shows_the_scene() {
    for tracer in [
        TracerChoice::Auto,
        TracerChoice::Query,
        TracerChoice::Pipeline,
    ] {
        check_reflection(tracer);
    }
}
