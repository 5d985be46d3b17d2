//! A small game made in memory: one map, its materials and its textures, all computed here. It shows what the
//! renderer does without any game's data: coloured triangle lights, a mirror, a patch, a cut-out grate, fog, sky.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, GridPoint, ShaderId, content_flags, surface_flags};

use crate::files::{FileError, MemoryFiles};

/// Game path of the sample's map.
pub const MAP: &str = "maps/sample.bsp";

/// Side of the square textures, texels.
const SIZE: usize = 64;

const SCRIPT: &str = r"
// The sample's materials: plain words, so that they double as an example of the language.
sample/brick
{
	{
		map $lightmap
	}
	{
		map sample/brick_image.tga
		blendFunc filter
	}
}
sample/lamp_warm
{
	q3map_lightimage sample/lamp_warm.tga
	q3map_surfacelight 900
	{
		map sample/lamp_warm.tga
	}
}
sample/lamp_red
{
	q3map_lightimage sample/lamp_red.tga
	q3map_surfacelight 2200
	{
		map sample/lamp_red.tga
	}
}
sample/lamp_blue
{
	q3map_lightimage sample/lamp_blue.tga
	q3map_surfacelight 2200
	{
		map sample/lamp_blue.tga
	}
}
sample/grate
{
	surfaceparm trans
	cull none
	{
		map sample/grate_image.tga
		alphaFunc GE128
		depthWrite
		rgbGen identity
	}
	{
		map $lightmap
		blendFunc filter
		depthFunc equal
	}
}
sample/mirror
{
	surfaceparm nolightmap
	portal
	{
		map sample/mirror_image.tga
		blendFunc blend
		depthWrite
	}
}
sample/mist
{
	surfaceparm trans
	surfaceparm nonsolid
	surfaceparm fog
	surfaceparm nolightmap
	fogParms ( 0.35 0.4 0.55 ) 260
}
sample/sky
{
	surfaceparm sky
	surfaceparm noimpact
	surfaceparm nolightmap
	q3map_sun 0.8 0.85 1 60 35 62
	skyParms - 384 -
	{
		map sample/clouds.tga
		tcMod scale 3 3
		tcMod scroll 0.01 0.02
	}
}
";

/// Repeatable noise in 0..1 for texel (x, y).
fn grain(x: usize, y: usize) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    (h >> 8) as f32 / (1 << 24) as f32
}

/// A 32-bit TGA, rows from the bottom as the engine reads them; `texel` is given column and row from the top.
fn tga(texel: impl Fn(usize, usize) -> [u8; 4]) -> Vec<u8> {
    let side = (SIZE as u16).to_le_bytes();
    let mut bytes = vec![
        0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, side[0], side[1], side[0], side[1], 32, 8,
    ];
    for y in (0..SIZE).rev() {
        for x in 0..SIZE {
            let [r, g, b, a] = texel(x, y);
            bytes.extend([b, g, r, a]);
        }
    }
    bytes
}

fn shade(color: [f32; 3], brightness: f32) -> [u8; 4] {
    let byte = |c: f32| (c * brightness).clamp(0.0, 255.0) as u8;
    [byte(color[0]), byte(color[1]), byte(color[2]), 255]
}

fn textures() -> Vec<(&'static str, Vec<u8>)> {
    let brick = |x: usize, y: usize| {
        let row = y / 16;
        let joint = y % 16 < 2 || (x + if row.is_multiple_of(2) { 0 } else { 16 }) % 32 < 2;
        let tone = 0.82 + 0.18 * grain(x, y);
        if joint {
            shade([120.0, 116.0, 110.0], tone)
        } else {
            shade([178.0, 120.0, 92.0], tone)
        }
    };
    let tile = |x: usize, y: usize| {
        let light = (x / 32 + y / 32).is_multiple_of(2);
        let tone = 0.88 + 0.12 * grain(x, y);
        shade(
            if light {
                [190.0, 186.0, 176.0]
            } else {
                [96.0, 104.0, 112.0]
            },
            tone,
        )
    };
    let plaster = |x: usize, y: usize| shade([196.0, 196.0, 190.0], 0.9 + 0.1 * grain(x, y));
    let metal = |x: usize, _: usize| shade([150.0, 156.0, 164.0], 0.8 + 0.2 * grain(x, 0));
    let grate = |x: usize, y: usize| {
        let bar = x % 16 < 5 || y % 16 < 5;
        let [r, g, b, _] = shade([120.0, 110.0, 96.0], 0.8 + 0.2 * grain(x, y));
        [r, g, b, if bar { 255 } else { 0 }]
    };
    let lamp = |color: [f32; 3]| {
        move |x: usize, y: usize| {
            let rim = x < 4 || y < 4 || x >= SIZE - 4 || y >= SIZE - 4;
            shade(color, if rim { 0.35 } else { 1.0 })
        }
    };
    let clouds = |x: usize, y: usize| {
        let wave = |a: usize, b: f32| (a as f32 / SIZE as f32 * TAU + b).sin();
        let cover =
            0.5 + 0.25 * wave(x, 0.0) * wave(y, 1.0) + 0.25 * wave(2 * x, 2.0) * wave(2 * y, 0.5);
        shade(
            [
                90.0 + 120.0 * cover,
                120.0 + 90.0 * cover,
                170.0 + 60.0 * cover,
            ],
            1.0,
        )
    };
    vec![
        ("sample/brick_image.tga", tga(brick)),
        ("sample/tile.tga", tga(tile)),
        ("sample/plaster.tga", tga(plaster)),
        ("sample/metal.tga", tga(metal)),
        ("sample/grate_image.tga", tga(grate)),
        ("sample/mirror_image.tga", tga(|_, _| [40, 48, 56, 24])),
        ("sample/lamp_warm.tga", tga(lamp([255.0, 226.0, 180.0]))),
        ("sample/lamp_red.tga", tga(lamp([255.0, 70.0, 40.0]))),
        ("sample/lamp_blue.tga", tga(lamp([60.0, 110.0, 255.0]))),
        ("sample/clouds.tga", tga(clouds)),
    ]
}

/// Direction to the sun of the script: 35 degrees round, 62 up.
const SUN: Vec3 = Vec3::new(0.384_57, 0.269_28, 0.882_95);

/// Where the lamps are, which way they look, their colour, and a quarter of their value times their area: the sample's
/// own simple lightmaps.
const LAMPS: [(Vec3, Vec3, Vec3, f32); 3] = [
    (
        Vec3::new(-96.0, 0.0, 254.0),
        Vec3::NEG_Z,
        Vec3::new(1.0, 0.76, 0.47),
        1_440_000.0,
    ),
    (
        Vec3::new(-318.0, -160.0, 120.0),
        Vec3::X,
        Vec3::new(1.0, 0.06, 0.02),
        1_584_000.0,
    ),
    (
        Vec3::new(-318.0, 160.0, 120.0),
        Vec3::X,
        Vec3::new(0.05, 0.16, 1.0),
        1_584_000.0,
    ),
];

/// Light of the lamps (unshadowed) and of the sun through the opening, at a point, as bytes of a lightmap: what a map
/// compiler would store, near enough for the lights to be fitted to it.
fn baked(position: Vec3, normal: Vec3) -> [u8; 3] {
    let mut sum = Vec3::splat(2.0);
    for (origin, direction, color, photons) in LAMPS {
        let to = origin - position;
        let distance = to.length().max(24.0);
        let cosines =
            (to.dot(normal) / distance).max(0.0) * (-to.dot(direction) / distance).max(0.0);
        sum += color * cosines * photons / (distance * distance);
    }
    let through = position + SUN * ((256.0 - position.z) / SUN.z);
    if (160.0..320.0).contains(&through.x) && through.y.abs() < 256.0 {
        sum += Vec3::new(0.8, 0.85, 1.0) * 60.0 * normal.dot(SUN).max(0.0);
    }
    // the engine shows four times of what is stored
    sum.min(Vec3::splat(255.0)).to_array().map(|c| c as u8)
}

struct Shaders {
    brick: ShaderId,
    tile: ShaderId,
    plaster: ShaderId,
    metal: ShaderId,
    grate: ShaderId,
    mirror: ShaderId,
    sky: ShaderId,
    mist: ShaderId,
    warm: ShaderId,
    red: ShaderId,
    blue: ShaderId,
}

fn shaders(map: &mut MapBuilder) -> Shaders {
    let solid = content_flags::SOLID;
    Shaders {
        brick: map.add_shader("sample/brick", 0, solid),
        tile: map.add_shader("sample/tile", 0, solid),
        plaster: map.add_shader("sample/plaster", 0, solid),
        metal: map.add_shader("sample/metal", 0, solid),
        grate: map.add_shader("sample/grate", 0, solid),
        mirror: map.add_shader("sample/mirror", 0, solid),
        sky: map.add_shader("sample/sky", surface_flags::SKY, solid),
        mist: map.add_shader("sample/mist", 0, content_flags::FOG),
        warm: map.add_shader("sample/lamp_warm", 0, solid),
        red: map.add_shader("sample/lamp_red", 0, solid),
        blue: map.add_shader("sample/lamp_blue", 0, solid),
    }
}

/// A rectangle seen from the side that `normal` points to, with half sizes along two axes.
fn rectangle(center: Vec3, right: Vec3, up: Vec3) -> [Vec3; 4] {
    // clockwise from the front: the normal is right × up
    [
        center - right - up,
        center - right + up,
        center + right + up,
        center + right - up,
    ]
}

/// Gives every surface of `surfaces` a lightmap page computed at its points.
fn light(map: &mut MapBuilder, surfaces: &[usize]) {
    for &surface in surfaces {
        let [a, b, .., d] = map.vertices_mut(surface) else {
            debug_assert!(false, "surface {surface} is no rectangle");
            continue;
        };
        // the page covers the rectangle: find the position of a texel from three corners
        let (origin, normal) = (a.position, a.normal);
        let (u, v) = (b.lightmap - a.lightmap, d.lightmap - a.lightmap);
        let (edge_u, edge_v) = (b.position - a.position, d.position - a.position);
        let start = a.lightmap;
        let determinant = u.x * v.y - u.y * v.x;
        let page = map.add_lightmap_with(|x, y| {
            let at = Vec2::new((x as f32 + 0.5) / 128.0, (y as f32 + 0.5) / 128.0) - start;
            let s = (at.x * v.y - at.y * v.x) / determinant;
            let t = (u.x * at.y - u.y * at.x) / determinant;
            baked(origin + edge_u * s + edge_v * t, normal)
        });
        map.set_lightmap(surface, page);
    }
}

fn patch(map: &mut MapBuilder, shader: ShaderId) -> usize {
    // a half pipe along y in front of the far wall: 5 x 3 control points, facing the room
    let profile = [
        Vec2::new(300.0, 0.0),
        Vec2::new(230.0, 0.0),
        Vec2::new(230.0, 70.0),
        Vec2::new(230.0, 140.0),
        Vec2::new(300.0, 140.0),
    ];
    let mut points = Vec::new();
    for row in 0..3 {
        for (column, p) in profile.iter().enumerate() {
            let y = -120.0 + 100.0 * row as f32;
            let position = Vec3::new(p.x, y, p.y);
            points.push(DrawVert {
                position,
                st: Vec2::new(column as f32 * 0.5, row as f32 * 0.8),
                lightmap: Vec2::new(column as f32 / 4.0, row as f32 / 2.0),
                normal: Vec3::NEG_X,
                color: [255; 4],
            });
        }
    }
    map.add_patch(shader, 5, 3, &points)
}

fn build_map() -> q3bsp::Bsp {
    let mut map = MapBuilder::new();
    let s = shaders(&mut map);
    map.set_world_key("message", "Relight sample");
    let mut lit = Vec::new();

    // the hall: 640 x 512 x 256, with an opening to the sky above its far end
    let (mins, maxs) = (
        Vec3::new(-320.0, -256.0, 0.0),
        Vec3::new(320.0, 256.0, 256.0),
    );
    let x = |half: f32| Vec3::new(half, 0.0, 0.0);
    let y = |half: f32| Vec3::new(0.0, half, 0.0);
    let z = |half: f32| Vec3::new(0.0, 0.0, half);
    lit.push(map.add_quad(
        s.tile,
        rectangle(Vec3::ZERO, y(-256.0), x(320.0)).map(|p| p + z(mins.z)),
    ));
    lit.push(map.add_quad(
        s.plaster,
        rectangle(Vec3::new(-80.0, 0.0, maxs.z), y(256.0), x(240.0)),
    ));
    map.add_quad(
        s.sky,
        rectangle(Vec3::new(240.0, 0.0, maxs.z), y(256.0), x(80.0)),
    );
    lit.push(map.add_quad(
        s.brick,
        rectangle(Vec3::new(mins.x, 0.0, 128.0), y(256.0), z(128.0)),
    ));
    lit.push(map.add_quad(
        s.brick,
        rectangle(Vec3::new(maxs.x, 0.0, 128.0), y(-256.0), z(128.0)),
    ));
    lit.push(map.add_quad(
        s.brick,
        rectangle(Vec3::new(0.0, mins.y, 128.0), x(-320.0), z(128.0)),
    ));
    lit.push(map.add_quad(
        s.brick,
        rectangle(Vec3::new(0.0, maxs.y, 128.0), x(320.0), z(128.0)),
    ));

    // lamps: a panel under the ceiling, two on the wall behind the camera
    map.add_quad(
        s.warm,
        rectangle(Vec3::new(-96.0, 0.0, 254.0), y(40.0), x(40.0)),
    );
    map.add_quad(
        s.red,
        rectangle(Vec3::new(-318.0, -160.0, 120.0), y(20.0), z(36.0)),
    );
    map.add_quad(
        s.blue,
        rectangle(Vec3::new(-318.0, 160.0, 120.0), y(20.0), z(36.0)),
    );

    // a pillar and a block
    for (low, high) in [
        (Vec3::new(20.0, -150.0, 0.0), Vec3::new(68.0, -102.0, 256.0)),
        (Vec3::new(-30.0, 110.0, 0.0), Vec3::new(50.0, 190.0, 64.0)),
    ] {
        lit.extend(map.add_box_faces(s.metal, low, high, false));
        map.add_box_brush(s.metal, low, high);
    }
    // the grate hangs under the lamp and throws its shadow on the floor
    lit.push(map.add_quad(
        s.grate,
        rectangle(Vec3::new(-96.0, 0.0, 128.0), y(-64.0), x(64.0)),
    ));
    // the mirror on the left wall
    map.add_quad(
        s.mirror,
        rectangle(Vec3::new(130.0, 254.0, 120.0), x(90.0), z(80.0)),
    );
    lit.push(patch(&mut map, s.metal));

    let quads: Vec<usize> = lit.iter().copied().take(lit.len() - 1).collect();
    light(&mut map, &quads);
    let patch_page = map.add_lightmap([22, 20, 18]);
    if let Some(&surface) = lit.last() {
        map.set_lightmap(surface, patch_page);
    }

    // mist in the far right corner, with a top that one looks down on
    let fog_box = (Vec3::new(60.0, -256.0, 0.0), Vec3::new(320.0, -120.0, 90.0));
    let fog = map.add_fog_brush(s.mist, fog_box.0, fog_box.1, 5);
    let top = Vec3::new(
        (fog_box.0.x + fog_box.1.x) * 0.5,
        (fog_box.0.y + fog_box.1.y) * 0.5,
        fog_box.1.z,
    );
    let half = (fog_box.1 - fog_box.0) * 0.5;
    let surface = map.add_quad(s.mist, rectangle(top, y(-half.y), x(half.x)));
    map.set_fog(surface, fog);

    map.add_cell(mins, maxs);
    map.add_entity(&[
        ("classname", "info_player_intermission"),
        ("origin", "-270 -60 190"),
        ("angles", "18 12 0"),
    ]);
    map.add_entity(&[
        ("classname", "info_player_deathmatch"),
        ("origin", "-200 0 30"),
        ("angle", "0"),
    ]);
    map.add_entity(&[
        ("classname", "misc_portal_surface"),
        ("origin", "130 250 120"),
    ]);
    map.build_with_grid(Vec3::new(64.0, 64.0, 128.0), |p| {
        let light = baked(p, Vec3::Z);
        GridPoint {
            ambient: light,
            directed: light,
            longitude: 0,
            latitude: 0,
        }
    })
}

/// The sample as game files: script, textures, map.
///
/// # Errors
/// None in practice: all paths are well-formed.
pub fn files() -> Result<MemoryFiles, FileError> {
    let mut files = MemoryFiles::new();
    files.insert("scripts/sample.shader", SCRIPT)?;
    for (path, bytes) in textures() {
        files.insert(path, bytes)?;
    }
    files.insert(MAP, build_map().write())?;
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::GameFiles;

    #[test]
    fn the_map_is_valid_and_its_faces_look_inwards() {
        let files = files().unwrap();
        let bsp = q3bsp::Bsp::parse(&files.read(MAP).unwrap().unwrap()).unwrap();
        assert_eq!(bsp.fogs.len(), 1);
        let middle = Vec3::new(0.0, 0.0, 128.0);
        assert_eq!(bsp.cluster_at(middle), 0);
        // the six sides of the hall and its sky face the middle
        for surface in bsp.surfaces.iter().take(7) {
            let vertex = &bsp.vertices[surface.first_vert as usize];
            assert!(
                (middle - vertex.position).dot(vertex.normal) > 0.0,
                "{surface:?}"
            );
        }
    }
}
