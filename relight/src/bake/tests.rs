//! Bakes of made-up maps against closed forms.

use super::store::internal;
use super::*;
use crate::files::MemoryFiles;
use crate::light::LightColor;
use crate::materials::Materials;
use crate::{Options, calibrate::CalibrationOptions};
use glam::Vec2;
use q3bsp::Bsp;
use q3bsp::builder::MapBuilder;
use support::random::Random;

const SCRIPT: &str = "
t/wall
{
    {
        map $lightmap
    }
    {
        map *white
        blendFunc filter
        rgbGen const ( 0.5 0.5 0.5 )
    }
}
t/lamp
{
    q3map_lightRGB 1 1 1
    q3map_surfacelight 2000
    {
        map *white
    }
}
t/sky
{
    surfaceparm sky
    q3map_skylight 100 3
    skyparms - 512 -
}
";

const MINS: Vec3 = Vec3::new(-256.0, -256.0, 0.0);
const MAXS: Vec3 = Vec3::new(256.0, 256.0, 256.0);

/// A room, each of its faces with a page of its own. `lights`: entities.
pub(super) fn room(lights: &[&[(&str, &str)]], add: impl Fn(&mut MapBuilder)) -> Bsp {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    let faces = map.add_box_faces(wall, MINS, MAXS, true);
    map.add_cell(MINS, MAXS);
    for face in faces {
        let page = map.add_lightmap([7, 8, 9]);
        map.set_lightmap(face, page);
    }
    for light in lights {
        map.add_entity(light);
    }
    add(&mut map);
    map.build()
}

pub(super) fn world(bsp: &Bsp) -> RelitWorld {
    let mut files = MemoryFiles::new();
    files
        .insert("scripts/test.shader", SCRIPT.to_owned())
        .unwrap();
    let (materials, faults) = Materials::load(&files);
    assert!(faults.is_empty(), "{faults:?}");
    let options = Options {
        calibrate: None,
        light_color: LightColor::Stored,
        ..Options::default()
    };
    let bsp = Bsp::parse(&bsp.write()).unwrap();
    let mut world = RelitWorld::from_bsp(&files, &materials, "test", bsp, options);
    world.measure_materials(&files);
    world
}

/// The world of a map without scripts.
pub(super) fn plain_world(bsp: Bsp) -> RelitWorld {
    let files = MemoryFiles::new();
    let (materials, _) = Materials::load(&files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    RelitWorld::from_bsp(&files, &materials, "maps/m.bsp", bsp, options)
}

/// Options for one point a texel, one ray to each light and no bounce.
pub(super) fn plain(world: &RelitWorld) -> BakeOptions {
    BakeOptions {
        pattern: 1,
        samples: 0,
        bounces: 0,
        ..BakeOptions::of(world)
    }
}

pub(super) fn baked(world: &RelitWorld, options: &BakeOptions) -> Baked {
    bake(world, &mut Rays::new(world), options, &mut |_, _| ()).unwrap()
}

/// Light of the room's floor, and the position above each texel.
fn floor(world: &RelitWorld, baked: &Baked) -> Vec<(Vec3, Light)> {
    let (index, floor) = (0usize..)
        .zip(&world.surfaces)
        .find(|(_, s)| {
            s.plane
                .is_some_and(|p| p.normal == Vec3::Z && p.dist == 0.0)
        })
        .unwrap();
    let page = baked
        .pages
        .iter()
        .find(|p| p.number == floor.light_page as usize)
        .unwrap();
    let triangles: Vec<_> = floor
        .triangles()
        .map(|t| coverage::PageTriangle::new(world.corners(t), [false; 3], page.side).unwrap())
        .collect();
    let texels = (0..page.side * page.side).map(|texel| {
        let place = Vec2::new((texel % page.side) as f32, (texel / page.side) as f32) + 0.5;
        let (on, normal) = triangles.iter().find_map(|t| t.at(place)).unwrap();
        assert_eq!(page.owners[texel], index as u32);
        (on + normal, page.light[texel])
    });
    texels.collect()
}

const POINT: [(&str, &str); 4] = [
    ("classname", "light"),
    ("origin", "40 -30 120"),
    ("light", "300"),
    ("_color", "1 0.5 0.25"),
];

#[test]
fn a_point_light_gives_what_the_compiler_computes() {
    let world = world(&room(&[&POINT], |_| ()));
    let baked = baked(&world, &plain(&world));
    assert_eq!((baked.pages.len(), baked.unlit), (6, 0));
    for (at, light) in floor(&world, &baked) {
        let offset = Vec3::new(40.0, -30.0, 120.0) - at;
        let stored = 7500.0 * 300.0 * offset.z / offset.length().powi(3);
        let expected = Vec3::new(1.0, 0.5, 0.25) * (stored * 4.0 / 255.0);
        let error = (light.value / expected - 1.0).abs().max_element();
        assert!(error < 1e-3, "{at}: {} {expected}", light.value);
        // without the least weight of the normal
        let towards = light.towards - Vec3::Z * LEAST_TOWARDS;
        assert!(towards.normalize().dot(offset.normalize()) > 0.9999);
    }
}

#[test]
fn a_box_casts_a_shadow() {
    let corners = [Vec3::new(0.0, -80.0, 40.0), Vec3::new(80.0, 20.0, 60.0)];
    let world = world(&room(&[&POINT], |map| {
        let wall = map.add_shader("t/wall", 0, 1);
        map.add_box_faces(wall, corners[0], corners[1], false);
    }));
    let baked = baked(&world, &plain(&world));
    let (mut dark, mut lit) = (0, 0);
    for (at, light) in floor(&world, &baked) {
        let inverse = (Vec3::new(40.0, -30.0, 120.0) - at).recip();
        let (a, b) = ((corners[0] - at) * inverse, (corners[1] - at) * inverse);
        let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
        if near < far - 0.02 {
            assert_eq!(light.value, Vec3::ZERO, "{at}");
            dark += 1;
        } else if near > far + 0.02 {
            assert!(light.value.x > 0.0, "{at}");
            lit += 1;
        }
    }
    assert!(dark > 500 && lit > 5000, "{dark} {lit}");
}

/// Height and half a side of a square lamp.
const LAMP: (f32, f32) = (200.0, 50.0);

fn lamp(map: &mut MapBuilder) {
    let (z, half) = LAMP;
    let lamp = map.add_shader("t/lamp", 0, 1);
    // clockwise seen from below
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    map.add_quad(lamp, corners.map(|(x, y)| Vec3::new(x * half, y * half, z)));
}

/// A room whose lamp has an edge along y below its middle.
fn half_shaded() -> RelitWorld {
    world(&room(&[], |map| {
        lamp(map);
        let wall = map.add_shader("t/wall", 0, 1);
        map.add_box_faces(
            wall,
            Vec3::new(-200.0, -250.0, 100.0),
            Vec3::new(0.0, 250.0, 104.0),
            false,
        );
    }))
}

#[test]
fn a_lamp_gives_the_integral_over_its_area_and_soft_shadows() {
    let (z, half) = LAMP;
    let open = world(&room(&[], lamp));
    let light = baked(&open, &plain(&open));
    for (at, light) in floor(&open, &light).iter().step_by(97) {
        let steps = 60;
        let sum: f32 = (0..steps * steps)
            .map(|i| {
                let part = |k: i32| ((k as f32 + 0.5) / steps as f32 * 2.0 - 1.0) * half;
                let offset = Vec3::new(part(i % steps), part(i / steps), z) - *at;
                let squared = offset.length_squared();
                offset.z * offset.z / (squared * squared)
            })
            .sum::<f32>()
            * (2.0 * half / steps as f32).powi(2);
        // radiance π s / 255, and irradiance over π
        let expected = 2000.0 / 255.0 * sum;
        assert!(
            (light.value.x / expected - 1.0).abs() < 0.01,
            "{at}: {} {expected}",
            light.value
        );
    }
    let shaded = half_shaded();
    let soft = BakeOptions {
        samples: 64,
        ..plain(&shaded)
    };
    let soft = baked(&shaded, &soft);
    let below = |light: &Baked, world: &RelitWorld| {
        let near: Vec<f32> = floor(world, light)
            .iter()
            .filter(|(at, _)| at.x.abs() < 5.0 && at.y.abs() < 60.0)
            .map(|(_, light)| light.value.x)
            .collect();
        near.iter().sum::<f32>() / near.len() as f32
    };
    let part = below(&soft, &shaded) / below(&light, &open);
    assert!((part - 0.5).abs() < 0.05, "{part}");
}

#[test]
fn points_of_a_texel_divide_a_lamp_among_their_rays() {
    let world = half_shaded();
    let of = |pattern, samples| {
        let options = BakeOptions {
            pattern,
            samples,
            ..plain(&world)
        };
        floor(&world, &baked(&world, &options))
    };
    let (fine, exact) = (of(2, 4), of(1, 64));
    // texels below the edge, where about half of the lamp is seen
    let mut parts = Vec::new();
    for ((at, light), (_, exact)) in fine.iter().zip(&exact) {
        if at.x.abs() < 15.0 && at.y.abs() < 120.0 {
            parts.push(light.value.x / exact.value.x);
        }
    }
    let count = parts.len() as f32;
    let mean = parts.iter().sum::<f32>() / count;
    let deviation = (parts.iter().map(|p| (p - mean).powi(2)).sum::<f32>() / count).sqrt();
    assert!(
        (mean - 1.0).abs() < 0.01 && deviation < 0.1,
        "{mean} {deviation}"
    );
}

#[test]
fn a_uniform_sky_gives_its_radiance() {
    let mut map = MapBuilder::new();
    let (wall, sky) = (
        map.add_shader("t/wall", 0, 1),
        map.add_shader("t/sky", 4, 1),
    );
    let faces = map.add_box_faces(sky, MINS, MAXS, true);
    map.add_cell(MINS, MAXS);
    let corners = [(-64.0, -64.0), (-64.0, 64.0), (64.0, 64.0), (64.0, -64.0)];
    let floor = map.add_quad(wall, corners.map(|(x, y)| Vec3::new(x, y, 100.0)));
    let page = map.add_lightmap([0; 3]);
    map.set_lightmap(floor, page);
    assert_eq!(faces.len(), 6);
    let world = world(&map.build());
    let radiance = world.lights[0].radiance.x;
    let baked = baked(&world, &plain(&world));
    for light in &baked.pages[0].light {
        assert!(
            (light.value.x / radiance - 1.0).abs() < 0.01,
            "{} {radiance}",
            light.value.x
        );
    }
}

#[test]
fn surfaces_reflect_their_part_of_even_light() {
    let world = world(&room(&[], |_| ()));
    let mut rays = Rays::new(&world);
    let count = world.indices.len() / 3;
    let lit = LitSurfaces {
        triangles: &vec![
            LitTriangle::Texels {
                first: 0,
                side: 1,
                corners: [Vec2::ZERO; 3],
            };
            count
        ],
        reflectances: &vec![Vec3::new(0.5, 0.25, 0.0); count],
        light: &[Vec3::splat(3.0)],
    };
    for normal in [Vec3::Z, Vec3::ZERO] {
        let point = Point::new(Vec3::new(10.0, 20.0, 30.0), normal);
        let found = rays.reflected(&[point], lit, 64, &mut |_| ()).unwrap();
        // over all directions, fluence over π is 4 times the radiance
        let whole = if normal == Vec3::ZERO { 4.0 } else { 1.0 };
        let expected = Vec3::new(1.5, 0.75, 0.0) * whole;
        assert!(
            (found[0].value - expected).length() < 1e-3,
            "{normal}: {}",
            found[0].value
        );
    }
}

#[test]
fn bounces_sum_to_the_series_of_a_closed_room() {
    // all light of a convex room stays in it: with reflectance r its mean grows by 1 / (1 - r)
    let world = world(&room(&[&POINT], |_| ()));
    let albedo = world.materials[0].albedo.x;
    assert!((0.1..0.9).contains(&albedo), "{albedo}");
    let whole = |bounces: u32| -> f32 {
        let options = BakeOptions {
            bounces,
            rays: 4,
            reflectance: Reflectance::Albedo,
            ..plain(&world)
        };
        let baked = baked(&world, &options);
        // all faces have as many texels; their areas differ
        let mut sum = 0.0;
        for page in &baked.pages {
            let surface = &world.surfaces[page.owners[0] as usize];
            let light: f32 = page.light.iter().map(|light| light.value.x).sum();
            sum += light / page.light.len() as f32 * world.surface_area(surface);
        }
        sum
    };
    let direct = whole(0);
    let mut expected = direct;
    for bounces in 1..=3 {
        expected += direct * albedo.powi(bounces);
        let found = whole(bounces as u32);
        assert!(
            (found / expected - 1.0).abs() < 0.02,
            "{bounces}: {found} {expected}"
        );
    }
}

#[test]
fn vertices_get_all_the_light_that_texels_get() {
    let corners = [(-64.0, -64.0), (-64.0, 64.0), (64.0, 64.0), (64.0, -64.0)];
    let bsp = room(&[&POINT], |map| {
        map.set_world_key("ambient", "20");
        let wall = map.add_shader("t/wall", 0, 1);
        let mut quad = |z: f32| map.add_quad(wall, corners.map(|(x, y)| Vec3::new(x, y, z)));
        let (by_texel, by_vertex) = (quad(60.0), quad(60.2));
        let page = map.add_lightmap([0; 3]);
        map.set_lightmap(by_texel, page);
        map.set_lightmap(by_vertex, q3bsp::lightmap_index::BY_VERTEX);
    });
    let world = world(&bsp);
    let options = BakeOptions {
        bounces: 2,
        rays: 36,
        dirt: Some(Dirt::DEFAULT),
        reflectance: Reflectance::Albedo,
        ..plain(&world)
    };
    let baked = baked(&world, &options);
    let by_texel = baked.pages.iter().find(|page| page.number == 6).unwrap();
    // the page covers the quad: its corner texels lie at the corners
    let side = by_texel.side;
    let texels =
        [0, side - 1, side * (side - 1), side * side - 1].map(|at| by_texel.light[at].value);
    assert_eq!(baked.vertices.len(), 4);
    for (_, _, light) in &baked.vertices {
        let error = |texel: &Vec3| (*light / *texel - 1.0).abs().max_element();
        let least = texels.iter().map(error).fold(f32::INFINITY, f32::min);
        assert!(least < 0.12, "{light}: {texels:?}");
    }
}

#[test]
fn the_light_grid_has_the_direction_and_the_light() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_room(wall, MINS, MAXS);
    map.add_entity(&POINT);
    map.set_world_key("ambient", "10");
    let world = world(&map.build());
    let baked = baked(&world, &plain(&world));
    let grid = baked.grid.unwrap();
    let layout = world.bsp.light_grid_layout(1 << 20).unwrap();
    let mut tested = 0;
    for (i, point) in grid.iter().enumerate() {
        let [nx, ny, _] = layout.counts;
        let at = layout.position(i % nx, i / nx % ny, i / nx / ny);
        let offset = Vec3::new(40.0, -30.0, 120.0) - at;
        let inside = at.cmpgt(MINS).all() && at.cmplt(MAXS).all();
        let stored = 7500.0 * 300.0 / offset.length_squared();
        if !inside || stored > 250.0 {
            continue;
        }
        tested += 1;
        assert!(
            f32::from(point.directed[0]).mul_add(-1.0, stored).abs() < 1.0,
            "{at}"
        );
        assert_eq!(point.ambient, [10; 3]);
        assert!(point.direction().dot(offset.normalize()) > 0.999, "{at}");
    }
    assert!(tested > 20, "{tested}");
}

#[test]
fn nothing_but_light_changes_in_a_map() {
    let bsp = room(&[&POINT], |map| {
        let wall = map.add_shader("t/wall", 0, 1);
        let lone = map.add_quad(
            wall,
            [
                Vec3::new(0.0, 0.0, 50.0),
                Vec3::new(0.0, 64.0, 50.0),
                Vec3::new(64.0, 64.0, 50.0),
                Vec3::new(64.0, 0.0, 50.0),
            ],
        );
        map.set_lightmap(lone, q3bsp::lightmap_index::BY_VERTEX);
        for (k, vertex) in (0u8..).zip(map.vertices_mut(lone)) {
            vertex.color = [1, 2, 3, k * 50];
        }
    });
    let before = Bsp::parse(&bsp.write()).unwrap();
    let world = world(&bsp);
    let options = plain(&world);
    let baked = baked(&world, &options);
    let mut after = before.clone();
    let pages = baked.pages(&world, &after, options.encoding);
    let stored = baked.store_beside_pages(&world, &mut after, options.encoding);
    internal(&mut after, &pages).unwrap();
    assert_eq!(stored.vertices, 28);
    let after = Bsp::parse(&after.write()).unwrap();
    assert_ne!(after.lightmaps, before.lightmaps);
    let alphas = |bsp: &Bsp| bsp.vertices.iter().map(|v| v.color[3]).collect::<Vec<_>>();
    assert_eq!(alphas(&after), alphas(&before));
    let lone = &after.vertices[24..];
    assert!(lone.iter().all(|v| v.color[..3] != [1, 2, 3]), "{lone:?}");
    // with the old light in it, the new file is the old one
    let mut undone = after;
    undone.lightmaps.clone_from(&before.lightmaps);
    undone.light_grid.clone_from(&before.light_grid);
    for (vertex, old) in undone.vertices.iter_mut().zip(&before.vertices) {
        vertex.color = old.color;
    }
    assert_eq!(undone.write(), before.write());
}

#[test]
fn lights_that_calibration_found_give_the_stored_light_back() {
    let bsp = room(&[&POINT], |_| ());
    let first = world(&bsp);
    let options = plain(&first);
    let light = baked(&first, &options);
    let mut stored = first.bsp.clone();
    let pages = light.pages(&first, &stored, options.encoding);
    internal(&mut stored, &pages).unwrap();
    // as compilers do
    stored.entities = b"{ \"classname\" \"worldspawn\" }".to_vec();
    let mut again = world(&stored);
    assert_eq!(again.point_lights.len(), 0);
    let found = CalibrationOptions {
        samples: 3000,
        candidates: 800,
        bounces: 0,
        ..CalibrationOptions::default()
    };
    crate::calibrate(&mut again, &found);
    let options = BakeOptions {
        bounces: 0,
        ..plain(&again)
    };
    let light = baked(&again, &options);
    let new = light.pages(&again, &stored, options.encoding);
    let mut differences: Vec<f32> = new
        .iter()
        .zip(&pages)
        .flat_map(|(new, old)| new.texels.iter().zip(&old.texels))
        .map(|(new, old)| ((*new - *old) * 255.0).abs().max_element())
        .collect();
    differences.sort_by(f32::total_cmp);
    let median = differences[differences.len() / 2];
    assert!(median < 2.0, "{median}");
}

#[test]
fn damaged_maps_do_no_harm() {
    let whole = room(&[&POINT], |map| {
        let lamp = map.add_shader("t/lamp", 0, 1);
        map.add_quad(
            lamp,
            [
                Vec3::new(0.0, 0.0, 50.0),
                Vec3::new(0.0, 64.0, 50.0),
                Vec3::new(64.0, 64.0, 50.0),
                Vec3::new(64.0, 0.0, 50.0),
            ],
        );
    })
    .write();
    let strange = [
        f32::NAN.to_bits(),
        f32::INFINITY.to_bits(),
        1.0e30f32.to_bits(),
        (-1.0e-30f32).to_bits(),
        0,
        1,
        u32::MAX,
        i32::MAX as u32,
        0x8000_0000,
    ];
    // pages have no structure to damage
    let structure = whole.len() - 6 * 128 * 128 * 3;
    let mut random = Random::new(11);
    let mut baked_maps = 0;
    for _ in 0..24 {
        let mut bytes = whole.clone();
        for _ in 0..6 {
            // half of the damage in the vertices and surfaces at the end
            let at = 144 + random.below((bytes.len() - 148) / 4) * 4;
            let at = if random.uniform() < 0.5 {
                at % structure.max(152)
            } else {
                at
            };
            let word = strange[random.below(strange.len())];
            if let Some(slot) = bytes.get_mut(at..at + 4) {
                slot.copy_from_slice(&word.to_le_bytes());
            }
        }
        let Ok(bsp) = Bsp::parse(&bytes) else {
            continue;
        };
        let world = world(&bsp);
        let options = BakeOptions {
            bounces: 1,
            rays: 1,
            ..plain(&world)
        };
        let light = baked(&world, &options);
        let mut after = world.bsp.clone();
        let pages = light.pages(&world, &after, options.encoding);
        light.store_beside_pages(&world, &mut after, options.encoding);
        if internal(&mut after, &pages).is_ok() {
            Bsp::parse(&after.write()).unwrap();
            baked_maps += 1;
        }
    }
    assert!(baked_maps > 8, "{baked_maps}");
}
