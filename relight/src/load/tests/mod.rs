//! What the tests of the relit world share: a small game, a room, a lamp.

mod damage;
mod game;
mod lights;
mod shapes;

use super::*;
use crate::files::MemoryFiles;
use crate::materials::Materials;
use q3bsp::builder::MapBuilder;

const SCRIPT: &str = "
t/lamp
{
    q3map_lightimage t/orange.tga
    q3map_surfacelight 1000
    { map $lightmap }
}
t/both
{
    cull disable
    q3map_lightRGB 0 0 2
    q3map_surfacelight 510
    { map *white }
}
t/sprite
{
    deformVertexes autosprite
    q3map_surfacelight 100
    { map *white
      blendFunc add }
}
t/sky
{
    surfaceparm sky
    skyparms - 512 -
    q3map_sun 1 0.5 0 100 0 90
    q3map_surfacelight 255
    { map t/orange.tga }
}
t/glow
{
    { map $lightmap }
    { map t/orange.tga
      blendFunc filter }
    { map *white
      blendFunc add
      rgbGen const ( 0.5 0.5 0.5 ) }
}
t/faint
{
    { map $lightmap }
    { map *white
      blendFunc add
      rgbGen const ( 0.1 0.1 0.1 ) }
}
t/poster
{
    polygonOffset
    { map t/orange.tga }
}
t/wall
{
    { map $lightmap }
    { map t/orange.tga
      blendFunc filter }
}
t/haze
{
    surfaceparm fog
    fogparms ( 0.25 0.5 1 ) 300
}
t/gone
{
    q3map_surfacelight 50
    { map t/nowhere.tga }
}
";

/// One pixel, sRGB 255, 128, 0.
const ORANGE: &[u8] = &[
    0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0, 0, 128, 255,
];

fn game() -> MemoryFiles {
    // Tokens must be apart from braces.
    let script = SCRIPT.replace('{', "\n{\n").replace('}', "\n}\n");
    let mut files = MemoryFiles::new();
    files.insert("scripts/test.shader", script).unwrap();
    files.insert("t/orange.tga", ORANGE).unwrap();
    files
}

/// Lights by directives, without calibration.
fn by_directives() -> Options<'static> {
    Options {
        light_color: LightColor::Stored,
        calibrate: None,
        ..Options::default()
    }
}

fn relight(map: MapBuilder) -> RelitWorld {
    let files = game();
    let (materials, diagnostics) = Materials::load(&files);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let bsp = Bsp::parse(&map.build().write()).unwrap();
    RelitWorld::from_bsp(&files, &materials, "test", bsp, by_directives())
}

/// A square of 2 × 2 `half`, front to +z, at a height.
fn ceiling_lamp(half: f32, z: f32) -> [Vec3; 4] {
    // Clockwise seen from below: facing -z.
    [(-half, -half), (-half, half), (half, half), (half, -half)].map(|(x, y)| Vec3::new(y, x, z))
}
