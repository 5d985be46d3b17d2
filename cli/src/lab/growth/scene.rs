//! Made-up maps: a hall with what is counted in it.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, ShaderId, content_flags};
use relight::{FileError, MemoryFiles};
use renderer_vk::api::RefEntity;

use crate::view::{Camera, placed};

/// Game path of the map.
pub const MAP: &str = "maps/growth.bsp";

const SCRIPT: &str = "
growth/wall
{
    {
        map $lightmap
    }
    {
        map $whiteimage
        rgbGen const ( 0.6 0.6 0.6 )
        blendFunc filter
    }
}
growth/floor
{
    {
        map $whiteimage
        rgbGen exactVertex
    }
    {
        map $whiteimage
        rgbGen const ( 0.6 0.6 0.6 )
        blendFunc filter
    }
}
growth/lamp
{
    surfaceparm nolightmap
    q3map_surfacelight 3000
    {
        map $whiteimage
    }
}
growth/leaf
{
    surfaceparm trans
    cull none
    {
        map textures/growth/leaf.tga
        alphaFunc GE128
        depthWrite
        rgbGen exactVertex
    }
}
growth/layer
{
    surfaceparm nolightmap
    surfaceparm trans
    cull none
    {
        map $whiteimage
        blendFunc blend
        rgbGen const ( 0.8 0.9 1 )
        alphaGen const 0.1
    }
}
growth/mirror
{
    surfaceparm nolightmap
    portal
    {
        map $whiteimage
        blendFunc blend
        depthWrite
        alphaGen const 0.05
    }
}
";

/// Corners of the hall, units.
const LOW: Vec3 = Vec3::new(-1024.0, -768.0, 0.0);
const HIGH: Vec3 = Vec3::new(1024.0, 768.0, 512.0);

/// The camera, which sees most of the hall.
pub const CAMERA: Camera = Camera {
    origin: Vec3::new(-900.0, 0.0, 200.0),
    yaw: 0.0,
    pitch: 5.0,
};

/// Side of a lamp's square cell of the ceiling over that of its triangle.
const LAMP_CELL: f32 = 3.0;

/// Squares along a side of a surface of the floor, and the greatest height of its waves, units.
const TILE: usize = 64;
const WAVES: f32 = 12.0;

/// Columns along and across the hall, and their radius, units.
const COLUMNS: [usize; 2] = [6, 4];
const COLUMN: f32 = 40.0;

/// Height of a tree's crown above the floor, half its side, and the leaves in it: squares of this side. Units.
const CROWN: (f32, f32) = (140.0, 70.0);
const LEAVES: usize = 32;
const LEAF: f32 = 64.0;

/// Texels along a side of the image of leaves.
const LEAF_TEXELS: u16 = 64;

/// Distance of the first layer from the camera, and of one from the next, units.
const LAYERS: (f32, f32) = (32.0, 4.0);

/// Half the side of the box that entities show, units.
const BOX: f32 = 6.0;

/// What is in the hall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Made {
    /// Triangle lights.
    pub lights: usize,
    /// Triangles of the floor.
    pub triangles: usize,
    /// Translucent layers before the camera.
    pub layers: usize,
    /// Trees, of leaves with holes.
    pub trees: usize,
    /// Curved columns.
    pub columns: bool,
    /// Two mirrors that face each other, before and behind the camera.
    pub mirrors: bool,
}

impl Default for Made {
    fn default() -> Self {
        Self {
            lights: 16,
            triangles: 2048,
            layers: 0,
            trees: 0,
            columns: false,
            mirrors: false,
        }
    }
}

impl Made {
    /// The map, with its materials.
    ///
    /// # Errors
    /// None in practice: all paths are well-formed.
    pub fn files(&self) -> Result<MemoryFiles, FileError> {
        let mut map = MapBuilder::new();
        let solid = content_flags::SOLID;
        let wall = map.add_shader("growth/wall", 0, solid);
        let lamp = map.add_shader("growth/lamp", 0, solid);
        map.add_room(wall, LOW, HIGH);
        self.add_lamps(&mut map, lamp);
        let floor = map.add_shader("growth/floor", 0, solid);
        self.add_floor(&mut map, floor);
        if self.columns {
            add_columns(&mut map, wall);
        }
        if self.trees > 0 {
            let leaf = map.add_shader("growth/leaf", 0, 0);
            add_trees(&mut map, leaf, self.trees);
        }
        if self.layers > 0 {
            let layer = map.add_shader("growth/layer", 0, 0);
            for number in 0..self.layers {
                let (first, step) = LAYERS;
                let x = CAMERA.origin.x + first + step * number as f32;
                add_upright(&mut map, layer, x, false);
            }
        }
        if self.mirrors {
            let mirror = map.add_shader("growth/mirror", 0, solid);
            for (x, ahead) in [(HIGH.x - 8.0, false), (LOW.x + 8.0, true)] {
                add_upright(&mut map, mirror, x, ahead);
                let origin = format!("{x} 0 {}", (LOW.z + HIGH.z) * 0.5);
                map.add_entity(&[("classname", "misc_portal_surface"), ("origin", &origin)]);
            }
        }
        map.begin_model();
        map.add_box_faces(wall, Vec3::splat(-BOX), Vec3::splat(BOX), false);
        let mut files = MemoryFiles::new();
        files.insert("scripts/growth.shader", SCRIPT)?;
        files.insert("textures/growth/leaf.tga", leaf_image())?;
        // a surface without stored light would be shown as white, and not be lit
        let page = map.add_lightmap([128; 3]);
        let mut bsp = map.build();
        let walls = bsp.surfaces.iter_mut().filter(|s| s.shader == wall);
        walls.for_each(|surface| surface.lightmap = page);
        files.insert(MAP, bsp.write())?;
        Ok(files)
    }

    /// Triangles below the ceiling, evenly. Their area together does not depend on their number.
    fn add_lamps(&self, map: &mut MapBuilder, lamp: ShaderId) {
        let size = HIGH - LOW;
        let across = ((self.lights as f32 * size.y / size.x).sqrt().ceil() as usize).max(1);
        let along = self.lights.div_ceil(across).max(1);
        let cell = Vec2::new(size.x / along as f32, size.y / across as f32);
        let side = (size.x * size.y / self.lights.max(1) as f32).sqrt() / LAMP_CELL;
        for number in 0..self.lights {
            let at = Vec2::new((number % along) as f32, (number / along) as f32) + 0.5;
            let middle = (LOW.truncate() + at * cell).extend(HIGH.z - 1.0);
            // clockwise as seen from below
            let corners = [Vec2::ZERO, Vec2::X, Vec2::Y]
                .map(|c| middle + ((c - 1.0 / 3.0) * side.min(cell.min_element())).extend(0.0));
            map.add_polygon(lamp, &corners);
        }
    }

    /// A floor with waves of about the wanted number of triangles, in surfaces of at most 64 x 64 squares. Such meshes
    /// store light in their vertices.
    fn add_floor(&self, map: &mut MapBuilder, floor: ShaderId) {
        let squares = ((self.triangles as f32 / 2.0).sqrt().round() as usize).max(1);
        let step = (HIGH - LOW).truncate() / squares as f32;
        let vertex = |x: usize, y: usize| {
            let at = LOW.truncate() + step * Vec2::new(x as f32, y as f32);
            let phase = at / 96.0;
            let height = WAVES * (1.5 + 0.5 * (phase.x.sin() + phase.y.cos()));
            let slope = Vec2::new(phase.x.cos(), -phase.y.sin()) * (WAVES * 0.5 / 96.0);
            DrawVert {
                position: at.extend(LOW.z + height),
                st: at / 128.0,
                lightmap: Vec2::ZERO,
                normal: (-slope).extend(1.0).normalize(),
                color: [255; 4],
            }
        };
        for top in (0..squares).step_by(TILE) {
            for left in (0..squares).step_by(TILE) {
                let [columns, rows] = [left, top].map(|from| TILE.min(squares - from));
                let vertices: Vec<DrawVert> = (0..=rows)
                    .flat_map(|y| (0..=columns).map(move |x| (x, y)))
                    .map(|(x, y)| vertex(left + x, top + y))
                    .collect();
                let row = columns as i32 + 1;
                let indices: Vec<i32> = (0..rows as i32)
                    .flat_map(|y| (0..row - 1).map(move |x| y * row + x))
                    // clockwise as seen from above
                    .flat_map(|at| [at, at + row, at + 1, at + 1, at + row, at + row + 1])
                    .collect();
                map.add_soup(floor, &vertices, &indices);
            }
        }
    }
}

/// A rectangle across the hall at `x`, which looks along +x (`ahead`) or -x.
fn add_upright(map: &mut MapBuilder, shader: ShaderId, x: f32, ahead: bool) {
    let corner = |y: f32, z: f32| Vec3::new(x, y, z);
    let mut corners = [
        corner(LOW.y, LOW.z),
        corner(LOW.y, HIGH.z),
        corner(HIGH.y, HIGH.z),
        corner(HIGH.y, LOW.z),
    ];
    if !ahead {
        corners.reverse();
    }
    map.add_quad(shader, corners);
}

/// Round columns from the floor to the ceiling, each a patch of four arcs.
fn add_columns(map: &mut MapBuilder, wall: ShaderId) {
    let size = HIGH - LOW;
    for number in 0..COLUMNS[0] * COLUMNS[1] {
        let at = Vec2::new(
            (number % COLUMNS[0]) as f32 + 0.5,
            (number / COLUMNS[0]) as f32 + 0.5,
        );
        let cell = Vec2::new(size.x / COLUMNS[0] as f32, size.y / COLUMNS[1] as f32);
        let middle = LOW.truncate() + at * cell;
        let points: Vec<DrawVert> = [LOW.z, (LOW.z + HIGH.z) * 0.5, HIGH.z]
            .into_iter()
            .flat_map(|z| (0..9u8).map(move |corner| (z, f32::from(corner) / 8.0, corner)))
            .map(|(z, turn, corner)| {
                let out = Vec2::from_angle(TAU * turn);
                // control points between arcs are at the corners of the square around the circle
                let reach = if corner % 2 == 0 { 1.0 } else { 2.0f32.sqrt() };
                DrawVert {
                    position: (middle + out * (COLUMN * reach)).extend(z),
                    st: Vec2::new(turn * 2.0, z / 128.0),
                    lightmap: Vec2::ZERO,
                    normal: out.extend(0.0),
                    color: [255; 4],
                }
            })
            .collect();
        map.add_patch(wall, 9, 3, &points);
    }
}

/// Crowns of trees in the hall, evenly: each a surface of leaves at random places and angles.
fn add_trees(map: &mut MapBuilder, leaf: ShaderId, count: usize) {
    let size = (HIGH - LOW).truncate();
    let across = ((count as f32 * size.y / size.x).sqrt().ceil() as usize).max(1);
    let along = count.div_ceil(across).max(1);
    let (height, half) = CROWN;
    let mut state = 1u32;
    // a linear congruential generator: the same trees on every machine
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    };
    for number in 0..count {
        let at = Vec2::new((number % along) as f32, (number / along) as f32) + 0.5;
        let middle = LOW.truncate() + at * size / Vec2::new(along as f32, across as f32);
        let middle = middle.extend(LOW.z + height);
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        for _ in 0..LEAVES {
            let center = middle + Vec3::new(random(), random(), random()) * (half - LEAF * 0.5);
            let up = Vec3::new(random(), random(), random());
            let normal = up.try_normalize().unwrap_or(Vec3::Z);
            let u = normal.any_orthonormal_vector();
            let v = normal.cross(u);
            let first = vertices.len() as i32;
            for corner in [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y] {
                let at = (corner - 0.5) * LEAF;
                vertices.push(DrawVert {
                    position: center + u * at.x + v * at.y,
                    st: corner,
                    lightmap: Vec2::ZERO,
                    normal,
                    color: [255; 4],
                });
            }
            indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
        map.add_soup(leaf, &vertices, &indices);
    }
}

/// An uncompressed TGA image of green discs without a background: four along each side, 50 % of the area.
fn leaf_image() -> Vec<u8> {
    let [low, high] = LEAF_TEXELS.to_le_bytes();
    let mut bytes = vec![
        0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, low, high, low, high, 32, 0x28,
    ];
    let cell = f32::from(LEAF_TEXELS / 4);
    for y in 0..LEAF_TEXELS {
        for x in 0..LEAF_TEXELS {
            let at = (Vec2::new(f32::from(x), f32::from(y)) + 0.5) / cell;
            // pi r^2 = 0.5
            let solid = (at.fract() - 0.5).length() < 0.3989;
            bytes.extend([60, 160, 80, if solid { 255 } else { 0 }]);
        }
    }
    bytes
}

/// Entities of the brush model in the hall, evenly, `model` being its handle.
pub fn entities(count: usize, model: i32) -> impl Iterator<Item = RefEntity> {
    let side = (count as f64).cbrt().ceil().max(1.0) as usize;
    let inner = (HIGH - LOW) - 100.0;
    (0..count).map(move |number| {
        let at = [number % side, number / side % side, number / side / side];
        let part = Vec3::from_array(at.map(|n| (n as f32 + 0.5) / side as f32));
        let origin = LOW + 50.0 + inner * part;
        placed(model, origin)
    })
}

#[cfg(test)]
mod tests {
    use relight::GameFiles;

    use super::*;

    fn map(made: &Made) -> q3bsp::Bsp {
        let files = made.files().unwrap();
        q3bsp::Bsp::parse(&files.read(MAP).unwrap().unwrap()).unwrap()
    }

    #[test]
    fn a_map_holds_what_is_counted() {
        for lights in [1, 2, 7, 100, 1000] {
            let made = Made {
                lights,
                ..Made::default()
            };
            let map = map(&made);
            let of = |name: &str| {
                let named = map.surfaces.iter();
                named.filter(|s| map.shader(s.shader).name == name).count()
            };
            assert_eq!(of("growth/lamp"), lights);
        }
        for trees in [1, 12] {
            let made = Made {
                trees,
                ..Made::default()
            };
            let map = map(&made);
            let crowns = map.surfaces.iter();
            let crowns = crowns.filter(|s| map.shader(s.shader).name == "growth/leaf");
            assert_eq!(crowns.count(), trees);
        }
        let image = relight::image::decode("leaf.tga", "tga", &leaf_image()).unwrap();
        let solid = image.rgba.chunks_exact(4).filter(|t| t[3] > 127).count();
        let texels = image.rgba.len() / 4;
        assert!((solid as f64 / texels as f64 - 0.5).abs() < 0.02, "{solid}");
        for triangles in [2u16, 2048, 10_000, 50_000] {
            let made = Made {
                triangles: usize::from(triangles),
                ..Made::default()
            };
            let map = map(&made);
            let soups = map.surfaces.iter().filter(|s| s.num_verts > 4);
            let found: i32 = match triangles {
                2 => 2,
                _ => soups.map(|s| s.num_indices / 3).sum(),
            };
            assert!(
                (f64::from(found) / f64::from(triangles) - 1.0).abs() < 0.02,
                "{found}"
            );
        }
        let made = Made {
            layers: 3,
            columns: true,
            mirrors: true,
            ..Made::default()
        };
        let marks = map(&made).entities();
        assert_eq!(
            marks
                .iter()
                .filter(|e| e.classname() == "misc_portal_surface")
                .count(),
            2
        );
        assert!(map(&made).cluster_at(CAMERA.origin) >= 0);
        let lit = map(&made)
            .surfaces
            .iter()
            .filter(|s| s.lightmap == 0)
            .count();
        assert_eq!(lit, 6 + 6 + 24, "walls, the model and the columns");
    }

    #[test]
    fn entities_are_inside_of_the_hall() {
        for count in [0, 1, 10, 1000] {
            let all: Vec<_> = entities(count, 3).collect();
            assert_eq!(all.len(), count);
            let inside = |e: &RefEntity| e.origin.cmpgt(LOW).all() && e.origin.cmplt(HIGH).all();
            assert!(all.iter().all(|e| inside(e) && e.model == 3));
        }
    }
}
