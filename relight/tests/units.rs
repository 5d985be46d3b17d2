//! The units of light, against the map compilers' own lightmaps.
//!
//! Where a map still holds all of its lights, direct light computed from them (shadow rays and all) must give the
//! lightmap's texels: of a map with its light entities kept, and of one that is lit by surfaces alone. Bounced
//! light is not computed, so somewhat less is right for the second.

use glam::Vec3;
use relight::light::{LightColor, LightRef};
use relight::materials::light::SurfaceClass;
use relight::{Materials, RelitWorld, SearchPath, WorldSurface};
use std::f32::consts::PI;
use testkit::Random;

/// Triangles that stop light, tried one after the other.
struct Occluders(Vec<([Vec3; 3], bool)>);

impl Occluders {
    fn new(world: &RelitWorld) -> Self {
        let mut triangles = Vec::new();
        for surface in &world.surfaces {
            let material = &world.materials[surface.material as usize];
            if material.is_sky() || material.class.class == SurfaceClass::Opaque {
                for triangle in
                    surface.first_index / 3..(surface.first_index + surface.num_indices) / 3
                {
                    triangles.push((world.triangle(triangle as usize), material.is_sky()));
                }
            }
        }
        Occluders(triangles)
    }

    /// Whether something lies between two points; sky does not count on the way to sky.
    fn between(&self, from: Vec3, to: Vec3, to_sky: bool) -> bool {
        let ray = to - from;
        self.0.iter().any(|([a, b, c], sky)| {
            // Möller and Trumbore 1997.
            let (e1, e2) = (b - a, c - a);
            let p = ray.cross(e2);
            let determinant = e1.dot(p);
            let s = from - a;
            let q = s.cross(e1);
            let (u, v, t) = (
                s.dot(p) / determinant,
                ray.dot(q) / determinant,
                e2.dot(q) / determinant,
            );
            !(*sky && to_sky) && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 1e-4 && t < 0.999
        })
    }
}

/// Barycentric coordinates of a point in a triangle, evenly.
fn barycentric(random: &mut Random) -> Vec3 {
    let (u, v) = random.in_triangle();
    Vec3::new(1.0 - u - v, u, v)
}

/// Direct light at a point, as the outgoing radiance of white.
fn direct(
    world: &RelitWorld,
    occluders: &Occluders,
    random: &mut Random,
    at: Vec3,
    normal: Vec3,
) -> Vec3 {
    let mut irradiance = Vec3::ZERO;
    for &entry in world.light_lists.row(world.bsp.cluster_at(at)) {
        match world.light_lists.light(entry) {
            LightRef::Triangle(index) => {
                let light = &world.lights[index as usize];
                for _ in 0..2 {
                    let b = barycentric(random);
                    let [p, q, r] = light.vertices;
                    let point = p * b.x + q * b.y + r * b.z;
                    let (distance, direction) = ((point - at).length(), (point - at).normalize());
                    let leaving = -light.normal().dot(direction);
                    let leaving = if light.two_sided {
                        leaving.abs()
                    } else {
                        leaving
                    };
                    let cosines = normal.dot(direction).max(0.0) * leaving.max(0.0);
                    let gained =
                        light.radiance * (cosines * light.area() / (distance * distance) / 2.0);
                    if gained.max_element() > 1e-5 && !occluders.between(at, point, light.is_sky) {
                        irradiance += gained;
                    }
                }
            }
            LightRef::Point(index) => {
                let light = &world.point_lights[index as usize];
                let (distance, direction) = (
                    (light.origin - at).length(),
                    (light.origin - at).normalize(),
                );
                let cosine = normal.dot(direction);
                if cosine > 0.0 && !occluders.between(at, light.origin, false) {
                    irradiance += light.intensity * (cosine / (distance * distance));
                }
            }
        }
    }
    for sun in &world.suns {
        let cosine = normal.dot(sun.direction);
        if cosine > 0.0 && !occluders.between(at, at + sun.direction * 65536.0, true) {
            irradiance += sun.irradiance * cosine;
        }
    }
    irradiance / PI + world.ambient
}

/// Median of computed over stored light, at texels that are neither black nor cut off.
fn median_ratio(map: &str) -> Option<f32> {
    let files = SearchPath::open(&[testkit::folder()?]).unwrap();
    let (materials, _) = Materials::load(&files);
    let options = relight::Options {
        light_color: LightColor::Stored,
        calibrate: None,
        ..Default::default()
    };
    let world = RelitWorld::load(&files, &materials, map, options).unwrap();
    let occluders = Occluders::new(&world);
    let lit = |s: &&WorldSurface| {
        s.lightmap >= 0
            && s.plane.is_some()
            && world.materials[s.material as usize].emission.is_none()
    };
    let surfaces: Vec<&WorldSurface> = world.surfaces.iter().filter(lit).collect();
    let mut random = Random::new(12345);
    let mut ratios = Vec::new();
    while ratios.len() < 200 {
        let surface = surfaces[(random.uniform() * surfaces.len() as f32) as usize];
        let triangle = (random.uniform() * (surface.num_indices / 3) as f32) as usize;
        let first = surface.first_index as usize + triangle * 3;
        let corners: Vec<_> = world.indices[first..first + 3]
            .iter()
            .map(|&i| world.vertices[i as usize])
            .collect();
        let b = barycentric(&mut random).to_array();
        let mix = |of: &dyn Fn(usize) -> Vec3| (0..3).map(|k| of(k) * b[k]).sum::<Vec3>();
        let texel = mix(&|k| corners[k].lightmap.extend(0.0)) * 128.0;
        let (x, y) = ((texel.x as usize).min(127), (texel.y as usize).min(127));
        let page = &world.bsp.lightmaps[surface.lightmap as usize].0;
        let stored = Vec3::from_array(std::array::from_fn(|k| {
            f32::from(page[(y * 128 + x) * 3 + k])
        }));
        if stored.max_element() > 254.0 || stored.max_element() < 2.0 {
            continue;
        }
        let normal = corners[0].normal;
        let at = mix(&|k| corners[k].position) + normal * 0.5;
        let computed = direct(&world, &occluders, &mut random, at, normal);
        ratios.push(computed.element_sum() / (stored.element_sum() * 4.0 / 255.0));
    }
    ratios.sort_by(f32::total_cmp);
    println!(
        "{map}: a quarter below {:.3}, half below {:.3}, three quarters below {:.3}",
        ratios[50], ratios[100], ratios[150]
    );
    Some(ratios[100])
}

#[test]
fn light_entities_give_what_the_compiler_stored() {
    if let Some(ratio) = median_ratio("maps/q3dm6ish.bsp") {
        assert!((0.95..1.1).contains(&ratio), "{ratio}");
    }
}

#[test]
fn emitting_surfaces_give_what_the_compiler_stored() {
    if let Some(ratio) = median_ratio("maps/oa_bases7.bsp") {
        assert!((0.7..1.05).contains(&ratio), "{ratio}");
    }
}
