//! A small game made by the tests: a map of two rooms, its materials and images, a model and a film. Its facts are
//! known exactly, and it needs none of OpenArena's files.

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, GridPoint};

/// The map's file.
pub const ROOMS: &str = "maps/rooms.bsp";
/// A place in the lit room, and one in the other, which cannot be seen from it.
pub const HERE: Vec3 = Vec3::new(-100.0, 0.0, 40.0);
/// A green flare in sight of [`HERE`].
pub const FLARE: Vec3 = Vec3::new(100.0, 0.0, 40.0);
/// See [`HERE`].
pub const ELSEWHERE: Vec3 = Vec3::new(1100.0, 0.0, 40.0);
/// What the light grid holds everywhere: ambient and directed.
pub const GRID: ([u8; 3], [u8; 3]) = ([40, 60, 80], [100, 50, 25]);

const SCRIPT: &str = "
flareShader
{
    {
        map textures/test/white.tga
        blendFunc add
        rgbGen vertex
    }
}
textures/test/lamp
{
    surfaceparm nomarks
    q3map_surfacelight 400
    {
        map textures/test/lamp.tga
        rgbGen identity
    }
}
textures/test/film
{
    {
        videoMap film.roq
    }
}
textures/test/scroll
{
    cull none
    {
        map textures/test/wall.tga
        blendFunc blend
        tcMod scroll 1 0
    }
}
gfx/2d/tinted
{
    nopicmip
    {
        map textures/test/white.tga
        rgbGen vertex
        alphaGen vertex
        blendFunc blend
    }
}
";

/// Every file of the small game.
pub fn files() -> Vec<(String, Vec<u8>)> {
    let checker = |dark: [u8; 3], light: [u8; 3]| {
        tga(32, 32, |x, y| {
            if (x / 8 + y / 8) % 2 == 0 {
                dark
            } else {
                light
            }
        })
    };
    let mut files = vec![
        (ROOMS, rooms()),
        ("scripts/test.shader", SCRIPT.into()),
        (
            "textures/test/wall.tga",
            checker([150, 140, 120], [200, 190, 170]),
        ),
        (
            "textures/test/floor.tga",
            checker([60, 90, 60], [120, 160, 110]),
        ),
        ("textures/test/lamp.tga", tga(8, 8, |_, _| [255, 240, 200])),
        ("textures/test/white.tga", tga(8, 8, |_, _| [255; 3])),
        ("gfx/2d/bigchars.tga", checker([0; 3], [255; 3])),
        ("gfx/2d/red.tga", tga(16, 16, |_, _| [255, 0, 0])),
        (
            "gfx/2d/quarters.tga",
            tga(16, 16, |x, y| {
                [if x < 8 { 200 } else { 0 }, if y < 8 { 200 } else { 0 }, 40]
            }),
        ),
        ("models/test.md3", model()),
        ("models/test.skin", b"body,textures/test/floor\n".to_vec()),
        ("video/film.roq", vec![0; 16]),
    ];
    files.push(("fonts/fontImage_12.dat", font()));
    files.push(("fonts/fontImage_0_12.tga", tga(256, 256, |_, _| [255; 3])));
    files
        .into_iter()
        .map(|(name, bytes)| (name.to_string(), bytes))
        .collect()
}

/// An uncompressed true-colour TGA, rows from the bottom; `pixel` counts rows from the top.
pub fn tga(width: u16, height: u16, pixel: impl Fn(u16, u16) -> [u8; 3]) -> Vec<u8> {
    let mut bytes = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    bytes.extend(width.to_le_bytes());
    bytes.extend(height.to_le_bytes());
    bytes.extend([24, 0]);
    for y in (0..height).rev() {
        for x in 0..width {
            let [r, g, b] = pixel(x, y);
            bytes.extend([b, g, r]);
        }
    }
    bytes
}

/// Two rooms of 512x512x256 units, walls one lightmap value, a lamp in the ceiling of the first.
fn rooms() -> Vec<u8> {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("textures/test/wall", 0, 1);
    let lamp = map.add_shader("textures/test/lamp", 0, 1);
    let film = map.add_shader("textures/test/film", 0, 1);
    let page = map.add_lightmap([36, 40, 44]);
    let low = Vec3::new(-256.0, -256.0, 0.0);
    let high = Vec3::new(256.0, 256.0, 256.0);
    let far = Vec3::X * 1000.0;
    let here = map.add_room(wall, low, high);
    let elsewhere = map.add_room(wall, low + far, high + far);
    for surface in 0..12 {
        map.set_lightmap(surface, page);
    }
    for (center, shader) in [
        (Vec3::new(0.0, 0.0, 255.0), lamp),
        (Vec3::new(1000.0, 0.0, 255.0), film),
    ] {
        let (x, y) = (Vec3::X * 64.0, Vec3::Y * 64.0);
        // seen from below
        let surface = map.add_quad(
            shader,
            [
                center - x - y,
                center + x - y,
                center + x + y,
                center - x + y,
            ],
        );
        map.set_lightmap(surface, page);
    }
    // walls that decals can land on
    let brush = map.add_box_brush(wall, low - Vec3::Z * 16.0, Vec3::new(256.0, 256.0, 0.0));
    debug_assert!(brush >= 0);
    for (a, b) in [(here, elsewhere), (elsewhere, here)] {
        map.set_sees(a, b, false);
    }
    map.add_entity(&[
        ("classname", "info_player_deathmatch"),
        ("origin", "-100 0 40"),
        ("angle", "0"),
    ]);
    let curve: Vec<DrawVert> = (0..9)
        .map(|i| {
            let (column, row) = ((i % 3) as f32, (i / 3) as f32);
            DrawVert {
                position: Vec3::new(
                    200.0 - 20.0 * f32::from(i % 3 == 1),
                    100.0 - 100.0 * column,
                    20.0 + 60.0 * row,
                ),
                st: Vec2::new(column / 2.0, row / 2.0),
                lightmap: Vec2::splat(0.5),
                normal: -Vec3::X,
                color: [255; 4],
            }
        })
        .collect();
    let patch = map.add_patch(wall, 3, 3, &curve);
    map.set_lightmap(patch, page);
    // seen with r_flares alone
    map.add_flare(lamp, FLARE, Vec3::ZERO, Vec3::new(0.2, 1.0, 0.2));
    map.build_with_grid(Vec3::new(64.0, 64.0, 128.0), |_| GridPoint {
        ambient: GRID.0,
        directed: GRID.1,
        longitude: 0,
        latitude: 0,
    })
    .write()
}

/// A model of two frames: a square of 32 units, moved up by 16 in the second, with one tag that moves along.
fn model() -> Vec<u8> {
    let mut bytes = Vec::new();
    let text = |bytes: &mut Vec<u8>, s: &str, len: usize| {
        bytes.extend(s.bytes());
        bytes.resize(bytes.len() + len - s.len(), 0);
    };
    let int = |bytes: &mut Vec<u8>, values: &[i32]| {
        values.iter().for_each(|v| bytes.extend(v.to_le_bytes()))
    };
    let float = |bytes: &mut Vec<u8>, values: &[f32]| {
        values.iter().for_each(|v| bytes.extend(v.to_le_bytes()))
    };
    let (frames, tags) = (108, 108 + 2 * 56);
    let surface = tags + 2 * 112;
    // triangles, shaders, texture coordinates, vertices of two frames
    let (triangles, shaders, st, vertices) = (108, 108 + 24, 108 + 24 + 68, 108 + 24 + 68 + 32);
    let surface_end = vertices + 2 * 4 * 8;
    int(&mut bytes, &[i32::from_le_bytes(*b"IDP3"), 15]);
    text(&mut bytes, "models/test.md3", 64);
    int(
        &mut bytes,
        &[0, 2, 1, 1, 0, frames, tags, surface, surface + surface_end],
    );
    for z in [0.0, 16.0] {
        float(
            &mut bytes,
            &[
                0.0,
                -16.0,
                z - 16.0,
                0.0,
                16.0,
                z + 16.0,
                0.0,
                0.0,
                0.0,
                40.0,
            ],
        );
        text(&mut bytes, "frame", 16);
    }
    for z in [0.0, 16.0] {
        text(&mut bytes, "tag_top", 64);
        float(
            &mut bytes,
            &[
                0.0,
                0.0,
                z + 16.0,
                1.0,
                0.0,
                0.0,
                0.0,
                1.0,
                0.0,
                0.0,
                0.0,
                1.0,
            ],
        );
    }
    int(&mut bytes, &[i32::from_le_bytes(*b"IDP3")]);
    text(&mut bytes, "body", 64);
    int(
        &mut bytes,
        &[0, 2, 1, 4, 2, triangles, shaders, st, vertices, surface_end],
    );
    int(&mut bytes, &[0, 1, 2, 0, 2, 3]);
    text(&mut bytes, "textures/test/floor", 64);
    int(&mut bytes, &[0]);
    float(&mut bytes, &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    for z in [0i16, 16] {
        for (y, up) in [(16i16, 16i16), (-16, 16), (-16, -16), (16, -16)] {
            for value in [0, y * 64, (z + up) * 64] {
                bytes.extend(value.to_le_bytes());
            }
            // towards -x: latitude 128 of 256 turns in the low byte's polar angle 64
            bytes.extend([64, 128]);
        }
    }
    bytes
}

/// A font of 256 glyphs of 8x12 pixels.
fn font() -> Vec<u8> {
    let mut bytes = Vec::new();
    for i in 0..256u32 {
        for value in [12i32, 10, -2, 8, 9, 8, 12] {
            bytes.extend(value.to_le_bytes());
        }
        let (column, row) = ((i % 16) as f32 / 16.0, (i / 16) as f32 / 16.0);
        for value in [column, row, column + 0.05, row + 0.05] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend(0i32.to_le_bytes());
        let mut name = b"fonts/fontImage_0_12.tga".to_vec();
        name.resize(32, 0);
        bytes.extend(name);
    }
    bytes.extend(0.5f32.to_le_bytes());
    let mut name = b"fonts/fontImage_12.dat".to_vec();
    name.resize(64, 0);
    bytes.extend(name);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight::MemoryFiles;

    #[test]
    fn the_small_game_is_valid() {
        let all = files();
        let mut memory = MemoryFiles::new();
        for (name, bytes) in &all {
            memory.insert(name, bytes.clone()).unwrap();
        }
        let read = |name: &str| &all.iter().find(|(n, _)| n == name).unwrap().1;
        let map = q3bsp::Bsp::parse(read(ROOMS)).unwrap();
        let leafs = [HERE, ELSEWHERE].map(|p| map.cluster_at(p));
        assert!(leafs[0] >= 0 && leafs[1] >= 0 && leafs[0] != leafs[1]);
        assert!(!map.cluster_sees(leafs[0], leafs[1]) && map.cluster_sees(leafs[0], leafs[0]));
        assert!(map.light_grid().is_some());
        let model = q3model::Md3::parse(read("models/test.md3")).unwrap();
        assert_eq!(
            model.lerp_tag("tag_top", 0, 1, 0.5).unwrap().origin,
            Vec3::new(0.0, 0.0, 24.0)
        );
        let (image, _) = relight::image::load(&memory, "gfx/2d/quarters")
            .unwrap()
            .unwrap();
        assert_eq!(image.pixels().next().unwrap(), [200, 200, 40, 255]);
        assert_eq!(read("fonts/fontImage_12.dat").len(), 20548);
    }
}
