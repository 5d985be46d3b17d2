//! Translucent layers.

use glam::Vec3;
use shaders::types::Stage;
use shaders::types::constants as c;

use super::dielectrics::square;
use super::harness::{
    Gpu, Scene, bounced, encode, gpu_tests, identity, rectangle, reference, stage, wall_at,
};
use crate::settings::Settings;
use crate::trace::frame_lights::decode;

gpu_tests! {
    any: [
        paints_of_one_body_are_mixed_as_displayed,
        one_to_eight_mixed_layers_are_exact_before_and_behind_glass,
        light_behind_a_veil_counts_in_proportion,
        light_over_a_layer_darkens_what_lies_behind_it,
        a_lit_picture_on_a_pane_is_a_haze,
        the_lightmap_of_what_has_none_is_white_and_lights_nothing,
        lit_layers_and_what_is_behind_them_are_all_lit,
        a_mark_shares_the_light_of_its_wall_without_noise,
        smoke_is_as_bright_as_the_light_around_it,
    ],
    each: [
        layers_are_composed_in_order_however_many_there_are,
        layers_in_one_plane_come_in_drawing_order,
        sprites_are_seen_from_behind,
        nothing_before_the_near_plane_is_drawn,
    ],
}

pub(super) const TRANSLUCENT: u32 = c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED;

/// A rectangle at distance x that fills the view of `scene()`.
pub(super) fn screen(x: f32) -> [Vec3; 4] {
    // faces -x
    wall_at(x, 200.0)
}

pub(super) fn scene() -> Scene {
    Scene::new(Vec3::ZERO, Vec3::X * 100.0, 40.0, 32)
}

/// A constant after the shaders' rounding to 8 bits.
fn byte(value: f32) -> f32 {
    (value * 255.0 + 0.001).floor() / 255.0
}

/// A constant colour in display values.
pub(super) fn displayed(color: [f32; 3]) -> Vec3 {
    Vec3::from(color.map(byte))
}

/// Constant layers (encoded colour, alpha), nearest first, over a background (encoded): blended in display values.
pub(super) fn over(layers: &[([f32; 3], f32)], background: [f32; 3]) -> Vec3 {
    let mixed = layers
        .iter()
        .rev()
        .fold(displayed(background), |below, (color, alpha)| {
            displayed(*color) * byte(*alpha) + below * (1.0 - byte(*alpha))
        });
    decode(mixed)
}

pub(super) fn close(a: Vec3, b: Vec3) -> bool {
    // stored colours are quantized to a part of their largest channel, with stochastic rounding in reference mode
    (a - b).abs().max_element() < 5.0e-4 + b.max_element() / 256.0
}

fn layers_are_composed_in_order_however_many_there_are(gpu: &mut Gpu) {
    let red = [0.9, 0.1, 0.1];
    let green = [0.1, 0.8, 0.2];
    let blue = [0.2, 0.1, 1.0];
    let back = [0.5, 0.6, 0.4];
    // in arbitrary order; half of them move
    let mut scene = scene();
    let wall = scene.material(&[stage::constant(back)], 0);
    scene.quad(screen(300.0), wall);
    let [r, g, b] = [(red, 0.5), (green, 0.25), (blue, 0.75)]
        .map(|(color, alpha)| scene.material(&[stage::blend(color, alpha)], TRANSLUCENT));
    scene.quad(screen(200.0), b);
    scene.mesh(screen(100.0), r, identity());
    scene.quad(screen(150.0), g);
    let exact = over(&[(red, 0.5), (green, 0.25), (blue, 0.75)], back);
    let mean = gpu.mean(&scene, &reference(), 2);
    assert!(close(mean, exact), "{mean} {exact}");
    // layers behind a wall are invisible
    scene.quad(screen(120.0), wall);
    let mean = gpu.mean(&scene, &reference(), 2);
    assert!(close(mean, over(&[(red, 0.5)], back)), "{mean}");

    // many layers, some of them additive
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 40.0, 8);
    let thin = scene.material(&[stage::blend(red, 0.05)], TRANSLUCENT);
    for i in 0..40 {
        scene.quad(screen(50.0 + 3.0 * i as f32), thin);
    }
    let wall = scene.material(&[stage::constant(back)], 0);
    scene.quad(screen(300.0), wall);
    let exact = over(&[(red, 0.05); 40], back);
    let mean = gpu.mean(&scene, &reference(), 1);
    assert!(close(mean, exact), "{mean} {exact}");
}

fn nothing_before_the_near_plane_is_drawn(gpu: &mut Gpu) {
    let [red, back] = [[0.9, 0.1, 0.1], [0.5, 0.6, 0.4]];
    // the harness has the engine's near plane, 4 units away
    for (distance, shows) in [(2.0, false), (3.9, false), (4.2, true)] {
        let empty = || {
            let mut scene = scene();
            let wall = scene.material(&[stage::constant(back)], 0);
            scene.quad(screen(300.0), wall);
            scene
        };
        let mut layered = empty();
        let pane = layered.material(&[stage::blend(red, 0.5)], TRANSLUCENT);
        layered.mesh(screen(distance), pane, identity());
        let mean = gpu.mean(&layered, &reference(), 2);
        let exact = if shows { &[(red, 0.5)][..] } else { &[] };
        assert!(
            close(mean, over(exact, back)),
            "layer at {distance}: {mean}"
        );
        let mut solid = empty();
        let plain = solid.material(&[stage::constant(red)], 0);
        solid.quad(screen(distance), plain);
        let mean = gpu.mean(&solid, &reference(), 2);
        let exact = over(&[], if shows { red } else { back });
        assert!(close(mean, exact), "wall at {distance}: {mean}");
    }
}

fn paints_of_one_body_are_mixed_as_displayed(gpu: &mut Gpu) {
    let (below, above, alpha) = ([0.2, 0.6, 0.1], [0.9, 0.1, 0.1], 63.0 / 255.0);
    let mixed = |i: usize| byte(below[i]) * (1.0 - alpha) + byte(above[i]) * alpha;
    let exact = decode(Vec3::from_array([0, 1, 2].map(mixed)));
    let stages = [stage::constant(below), stage::blend(above, 0.25)];
    // emissive, and lit by half
    let mut glowing = scene();
    let wall = glowing.material(&stages, 0);
    glowing.quad(screen(100.0), wall);
    let mut lit = scene();
    lit.ambient = Vec3::splat(0.5);
    let light = Stage {
        blend_src: c::BLEND_DST_COLOR,
        ..stage::light()
    };
    let wall = lit.material(&[stages[0], stages[1], light], 0);
    lit.quad(screen(100.0), wall);
    for (scene, wanted) in [(glowing, exact), (lit, exact * 0.5)] {
        let mean = gpu.mean(&scene, &reference(), 1);
        assert!(close(mean, wanted), "{mean} {wanted}");
    }
}

/// Layers along a path, from the camera on: the display-encoded sum so far.
#[derive(Clone, Copy)]
struct Displayed {
    /// Sum of all layers, and of each divided by the probability of its branch.
    sum: Vec3,
    weighed: Vec3,
    /// Part of the display value that the background keeps.
    cover: Vec3,
    /// Part of the light that a branch of a pane transmits, and the weight of the branch.
    passed: f32,
    weight: f32,
}

impl Displayed {
    const NOTHING: Displayed = Displayed {
        sum: Vec3::ZERO,
        weighed: Vec3::ZERO,
        cover: Vec3::ONE,
        passed: 1.0,
        weight: 1.0,
    };

    fn behind(self, own: Vec3, cover: Vec3) -> Displayed {
        let own = Vec3::from((decode(own) * self.passed).to_array().map(encode));
        Displayed {
            sum: self.sum + self.cover * own,
            weighed: self.weighed + self.cover * own * self.weight,
            cover: self.cover * cover,
            ..self
        }
    }

    /// Light of the whole, shared in proportion to the sum.
    fn light(self) -> Vec3 {
        let bounded = self.sum.min(Vec3::ONE);
        decode(bounded) / bounded * self.weighed
    }
}

fn one_to_eight_mixed_layers_are_exact_before_and_behind_glass(gpu: &mut Gpu) {
    let back = [0.5, 0.6, 0.4];
    let color = |i: usize| [0.2 + 0.08 * i as f32, 0.9 - 0.1 * i as f32, 0.5];
    let one = |path: Displayed, i: usize| {
        let (own, alpha) = (displayed(color(i)), Vec3::splat(127.0 / 255.0));
        match i % 3 {
            0 => path.behind(own * alpha, 1.0 - alpha),
            1 => path.behind(own, Vec3::ONE),
            _ => path.behind(Vec3::ZERO, own),
        }
    };
    // every other count has a pane of glass in the middle, which reflects the layers before it and the black behind the
    // camera
    for count in 1..=8 {
        let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 2.0, 8);
        let wall = scene.material(&[stage::constant(back)], 0);
        scene.quad(screen(300.0), wall);
        let mut path = Displayed::NOTHING;
        let mut mirrored = None;
        for i in 0..count {
            let x = 50.0 + 20.0 * i as f32;
            let c = color(i);
            let stage = match i % 3 {
                0 => stage::blend(c, 0.5),
                1 => stage::add(c),
                _ => stage::filter(c),
            };
            let material = scene.material(&[stage], TRANSLUCENT);
            if i % 2 == 0 {
                scene.quad(screen(x), material);
            } else {
                scene.mesh(screen(x), material, identity());
            }
            path = one(path, i);
            if count % 2 == 0 && i == count / 2 {
                let pane =
                    scene.material(&[stage::filter([1.0; 3])], TRANSLUCENT | c::MATERIAL_GLASS);
                scene.materials[pane as usize].0.dielectric = shaders::types::Dielectric {
                    index: 1.5,
                    scale: 1.0,
                    ..Default::default()
                };
                scene.quad(screen(x + 10.0), pane);
                // at normal incidence a face reflects ((n - 1) / (n + 1))²; a sheet of two sides counts as one face. A
                // picture shows each branch in every other frame
                path.weight = 2.0;
                let back = Displayed {
                    passed: 0.04,
                    ..path
                };
                mirrored = Some((0..=i).rev().fold(back, one).light());
                path.passed = 0.96;
            }
        }
        let mut exact = path.behind(displayed(back), Vec3::ZERO).light();
        if let Some(mirrored) = mirrored {
            exact = (exact + mirrored) * 0.5;
        }
        let mean = gpu.mean(&scene, &reference(), 64);
        let difference = (mean / exact - 1.0).abs().max_element();
        assert!(difference < 1.0e-3, "{count} layers: {mean} {exact}");
    }
}

fn light_behind_a_veil_counts_in_proportion(gpu: &mut Gpu) {
    // a lit wall behind a glowing veil: equal to the blend in display values if the light is the engine's, and linear
    // in the light in general, so that means of noisy frames are means of the picture
    let (veil, alpha) = ([0.3, 0.2, 0.5], 0.25);
    let picture = |gpu: &mut Gpu, light: f32| {
        let mut scene = scene();
        scene.ambient = Vec3::splat(light);
        let wall = scene.diffuse(0.5);
        scene.quad(screen(300.0), wall);
        let veil = scene.material(&[stage::blend(veil, alpha)], TRANSLUCENT);
        scene.quad(screen(100.0), veil);
        gpu.mean(&scene, &reference(), 1)
    };
    let [dark, half, full] = [0.0, 0.5, 1.0].map(|light| picture(gpu, light));
    // the harness' surfaces have white vertices: there the engine shows full light
    let exact = over(&[(veil, alpha)], [encode(0.5); 3]);
    assert!(close(full, exact), "{full} {exact}");
    assert!(close(half, (dark + full) * 0.5), "{dark} {half} {full}");
    assert!(
        dark.max_element() < full.max_element() * 0.5,
        "{dark} {full}"
    );
}

fn light_over_a_layer_darkens_what_lies_behind_it(gpu: &mut Gpu) {
    // water whose stages multiply the background, followed by their lightmap: the light that the engine shows at the
    // water
    let (back, tint, stored) = ([0.9, 0.8, 0.5], [0.9, 0.7, 0.8], [153, 102, 204]);
    let mut scene = scene();
    let wall = scene.material(&[stage::constant(back)], 0);
    scene.quad(screen(300.0), wall);
    let water = scene.material(&[stage::filter(tint), stage::light_over()], TRANSLUCENT);
    scene.quad(screen(100.0), water);
    let [red, green, blue] = stored;
    for corner in scene.vertices.iter_mut().rev().take(4) {
        corner.color = u32::from_le_bytes([red, green, blue, 255]);
    }
    let exact = decode(
        displayed(back) * displayed(tint) * Vec3::from(stored.map(|c| f32::from(c) / 255.0)),
    );
    let mean = gpu.mean(&scene, &reference(), 1);
    assert!(close(mean, exact), "{mean} {exact}");
}

fn a_lit_picture_on_a_pane_is_a_haze(gpu: &mut Gpu) {
    let (back, stored) = ([0.3, 0.4, 0.5], [153, 102, 204]);
    let texel = [90, 60, 30];
    let image = square(gpu, 1, &[texel[0], texel[1], texel[2], 255]);
    let mut scene = scene();
    scene.images.push(image.texture_index());
    let wall = scene.material(&[stage::constant(back)], 0);
    scene.quad(screen(300.0), wall);
    let pane = scene.material(&[stage::haze(0), stage::light_over()], TRANSLUCENT);
    scene.quad(screen(100.0), pane);
    let [red, green, blue] = stored;
    for corner in scene.vertices.iter_mut().rev().take(4) {
        corner.color = u32::from_le_bytes([red, green, blue, 255]);
    }
    let unit = |bytes: [u8; 3]| Vec3::from(bytes.map(|c| f32::from(c) / 255.0));
    // added in display values to the background, then both times the light that the map stores; nothing is in front of
    // the pane
    let exact = decode((displayed(back) + unit(texel)) * unit(stored));
    for depth in [0, 2] {
        let settings = Settings {
            rt_max_depth: depth,
            ..reference()
        };
        let mean = gpu.mean(&scene, &settings, 1);
        assert!(close(mean, exact), "{depth}: {mean} {exact}");
    }
}

fn the_lightmap_of_what_has_none_is_white_and_lights_nothing(gpu: &mut Gpu) {
    let color = [0.3, 0.5, 0.7];
    let mut white = stage::light();
    white.flags |= c::STAGE_NO_LIGHTMAP;
    let mut bright = scene();
    let shown = bright.material(&[white, stage::filter(color)], 0);
    bright.quad(screen(300.0), shown);
    let mean = gpu.mean(&bright, &reference(), 1);
    assert!(close(mean, decode(displayed(color))), "{mean}");
    // a wall that faces nothing else
    let mut dark = scene();
    let wall = dark.diffuse(0.8);
    dark.quad(screen(300.0), wall);
    let shown = dark.material(&[white, stage::filter(color)], 0);
    let mut facing = screen(-100.0);
    facing.reverse();
    dark.quad(facing, shown);
    let settings = bounced(1);
    assert_eq!(gpu.mean(&dark, &settings, 4), Vec3::ZERO);
}

fn layers_in_one_plane_come_in_drawing_order(gpu: &mut Gpu) {
    let (first, second, back) = ([0.9, 0.1, 0.1], [0.1, 0.8, 0.2], [0.5, 0.5, 0.5]);
    let mut scene = scene();
    let wall = scene.material(&[stage::constant(back)], 0);
    let a = scene.material(&[stage::blend(first, 0.5)], TRANSLUCENT);
    let b = scene.material(&[stage::blend(second, 0.5)], TRANSLUCENT);
    // b has the greater sort value, so that it is drawn later and is on top, in any order of the lists
    scene.materials[a as usize].1.sort = 4.0;
    scene.materials[b as usize].1.sort = 9.0;
    scene.quad(screen(100.0), b);
    scene.quad(screen(100.0), wall);
    scene.mesh(screen(100.0), a, identity());
    let exact = over(&[(second, 0.5), (first, 0.5)], back);
    let mean = gpu.mean(&scene, &reference(), 2);
    assert!(close(mean, exact), "{mean} {exact}");
}

fn lit_layers_and_what_is_behind_them_are_all_lit(gpu: &mut Gpu) {
    // two lit layers of one half over a lit wall: in the mean, all share the light of the displayed sum
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 40.0, 16);
    scene.ambient = Vec3::splat(0.8);
    let wall = scene.diffuse(0.5);
    scene.quad(screen(300.0), wall);
    let mut lit = stage::light();
    lit.alpha_gen = c::ALPHAGEN_CONST;
    lit.constant = [1.0, 1.0, 1.0, 0.5];
    lit.blend_src = c::BLEND_SRC_ALPHA;
    lit.blend_dst = c::BLEND_ONE_MINUS_SRC_ALPHA;
    let veil = scene.material(&[lit], TRANSLUCENT);
    scene.quad(screen(100.0), veil);
    scene.quad(screen(150.0), veil);
    let alpha = 127.0 / 255.0;
    let albedo = byte(encode(0.5));
    let shown = alpha + (1.0 - alpha) * alpha + (1.0 - alpha) * (1.0 - alpha) * albedo;
    let exact = 0.8 * decode(Vec3::splat(shown)).x;
    let mean = gpu.mean(&scene, &reference(), 64).x;
    assert!((mean / exact - 1.0).abs() < 0.005, "{mean} {exact}");
}

/// A stage that the game fades by its alpha.
fn matter(color: [f32; 3], alpha: f32) -> Stage {
    Stage {
        flags: c::STAGE_MATTER | c::STAGE_WHITE,
        ..stage::blend(color, alpha)
    }
}

fn a_mark_shares_the_light_of_its_wall_without_noise(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 40.0, 16);
    scene.ambient = Vec3::splat(0.8);
    let wall = scene.diffuse(0.5);
    scene.quad(screen(300.0), wall);
    let blood = [0.8, 0.1, 0.3];
    let mark = scene.material(
        &[matter(blood, 0.5)],
        TRANSLUCENT | c::MATERIAL_POLYGON_OFFSET,
    );
    scene.mesh(screen(299.9), mark, identity());
    let alpha = 127.0 / 255.0;
    let albedo = byte(encode(0.5));
    let exact = 0.8 * decode(displayed(blood) * alpha + (1.0 - alpha) * albedo);
    // the background is lit by itself where it is not at the same wall
    for (place, noisy) in [(299.9, false), (200.0, true)] {
        scene
            .dynamic_vertices
            .iter_mut()
            .for_each(|v| v.position.x = place);
        let (pixels, _) = gpu.render(&scene, &reference(), 1);
        let off = pixels
            .iter()
            .filter(|p| (**p - exact).abs().max_element() > 4.0e-3);
        assert_eq!(off.count() > 0, noisy, "{place}: {exact}");
        let mean = gpu.mean(&scene, &reference(), 64);
        assert!(
            (mean - exact).abs().max_element() < 5.0e-3,
            "{place}: {mean} {exact}"
        );
    }
}

fn smoke_is_as_bright_as_the_light_around_it(gpu: &mut Gpu) {
    let back = [0.5, 0.6, 0.4];
    let grey = [0.7, 0.7, 0.6];
    let around = Vec3::new(0.6, 0.3, 0.1);
    let alpha = 127.0 / 255.0;
    for (flags, factor) in [
        (c::INSTANCE_UNLIT | c::INSTANCE_SUSPENDED, around),
        (c::INSTANCE_UNLIT, Vec3::ONE),
    ] {
        let mut scene = scene();
        let wall = scene.material(&[stage::constant(back)], 0);
        scene.quad(screen(300.0), wall);
        let puff = scene.material(&[matter(grey, 0.5)], TRANSLUCENT);
        let instance = shaders::types::Instance {
            ambient: around,
            flags,
            ..identity()
        };
        scene.mesh(screen(100.0), puff, instance);
        let exact = decode(displayed(grey) * factor * alpha + displayed(back) * (1.0 - alpha));
        let mean = gpu.mean(&scene, &reference(), 2);
        assert!(close(mean, exact), "{mean} {exact}");
    }
}

fn sprites_are_seen_from_behind(gpu: &mut Gpu) {
    let [back, front] = [[0.2, 0.3, 0.1], [0.6, 0.2, 0.4]];
    for (flags, seen) in [
        (c::INSTANCE_UNLIT | c::INSTANCE_SUSPENDED, displayed(front)),
        (c::INSTANCE_UNLIT, Vec3::ZERO),
    ] {
        let mut scene = scene();
        let wall = scene.material(&[stage::constant(back)], 0);
        scene.quad(screen(300.0), wall);
        let sprite = scene.material(&[stage::add(front)], c::MATERIAL_TRANSLUCENT);
        let away = rectangle(
            Vec3::new(100.0, -200.0, -200.0),
            Vec3::Y * 400.0,
            Vec3::Z * 400.0,
        );
        scene.mesh(
            away,
            sprite,
            shaders::types::Instance {
                flags,
                ..identity()
            },
        );
        let mean = gpu.mean(&scene, &reference(), 2);
        assert!(close(mean, decode(displayed(back) + seen)), "{mean}");
    }
}
