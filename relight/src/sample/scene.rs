//! Shapes of the sample's map: plates, blocks and curves with their texture coordinates, brushes and places in the
//! lightmaps.

use std::cmp::Reverse;
use std::f32::consts::TAU;
use std::ops::Range;

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, LIGHTMAP_SIZE, ShaderId};

/// Side of a lightmap texel, id units.
const LUXEL: f32 = 16.0;
/// Size of a texture on a wall, id units.
const TEXTURE: f32 = 128.0;

/// Corners of a ring of a ball, rings of a ball, and the most rings of one surface.
const AROUND: usize = 64;
const RINGS: usize = 32;
const BAND: usize = 11;

/// Adds entities of a class, at an origin and with angles.
pub(super) fn add_places(map: &mut MapBuilder, places: &[(&str, &str, &str)]) {
    for (class, origin, angles) in places {
        map.add_entity(&[("classname", class), ("origin", origin), ("angles", angles)]);
    }
}

/// Where a surface's light is stored: a rectangle of a page.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Index of the surface.
    pub surface: usize,
    /// Page, counted from 0.
    pub page: usize,
    /// Left column and upper row.
    pub at: [usize; 2],
    /// Columns and rows.
    pub size: [usize; 2],
}

/// Faces of a block, in the order of [`MapBuilder::add_box_faces`]: -x +x -y +y -z +z.
pub(super) mod face {
    /// Towards -x.
    pub const WEST: u8 = 1;
    /// Towards +x.
    pub const EAST: u8 = 2;
    /// Towards -y.
    pub const SOUTH: u8 = 4;
    /// Towards +y.
    pub const NORTH: u8 = 8;
    /// Towards -z.
    pub const BELOW: u8 = 16;
    /// Towards +z.
    pub const ABOVE: u8 = 32;
    /// The four upright ones.
    pub const SIDES: u8 = WEST | EAST | SOUTH | NORTH;
}

/// A map under construction, with the places of its surfaces in the lightmaps.
pub(super) struct Scene {
    /// The map.
    pub map: MapBuilder,
    /// Places of the lit surfaces.
    pub places: Vec<Place>,
}

impl Scene {
    pub fn new() -> Scene {
        Scene {
            map: MapBuilder::new(),
            places: Vec::new(),
        }
    }

    /// Wants a rectangle of a lightmap for a surface of `width` × `height` units, whose vertices have lightmap
    /// coordinates in 0..1.
    pub fn light(&mut self, surface: usize, width: f32, height: f32) {
        let texels = |length: f32| ((length / LUXEL).ceil() as usize + 1).clamp(2, LIGHTMAP_SIZE);
        self.places.push(Place {
            surface,
            page: 0,
            at: [0, 0],
            size: [texels(width), texels(height)],
        });
    }

    /// Puts all places on pages, the tallest first in rows, and sets the lightmap coordinates of their vertices: from
    /// the middle of a texel to that of another.
    pub fn pack(&mut self) {
        self.places.sort_by_key(|place| {
            let [columns, rows] = place.size;
            (Reverse(rows), Reverse(columns), place.surface)
        });
        let (mut page, mut x, mut y, mut tallest) = (0, 0, 0, 0);
        for place in &mut self.places {
            let [columns, rows] = place.size;
            if x + columns > LIGHTMAP_SIZE {
                (x, y, tallest) = (0, y + tallest, 0);
            }
            if y + rows > LIGHTMAP_SIZE {
                (page, x, y, tallest) = (page + 1, 0, 0, 0);
            }
            (place.page, place.at) = (page, [x, y]);
            (x, tallest) = (x + columns, tallest.max(rows));

            let start = Vec2::from(place.at.map(|texel| texel as f32)) + 0.5;
            let extent = Vec2::from(place.size.map(|texels| texels as f32)) - 1.0;
            for vertex in self.map.vertices_mut(place.surface) {
                vertex.lightmap = (start + vertex.lightmap * extent) / LIGHTMAP_SIZE as f32;
            }
            self.map.set_lightmap(place.surface, page as i32);
        }
    }

    /// A flat rectangle around `center`, seen from the side that `right` × `up` points to; half sizes along two axes.
    /// Texture coordinates are those of the world's axes.
    pub fn plate(
        &mut self,
        shader: ShaderId,
        center: Vec3,
        right: Vec3,
        up: Vec3,
        lit: bool,
    ) -> usize {
        // clockwise from the front
        let corners = [
            center - right - up,
            center - right + up,
            center + right + up,
            center + right - up,
        ];
        let surface = self.map.add_quad(shader, corners);
        let upright = right.cross(up).normalize_or_zero().abs();
        // the first corner is the lower left one of the surface and of its place
        let unit = [Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X];
        for (vertex, unit) in self.map.vertices_mut(surface).iter_mut().zip(unit) {
            let p = vertex.position;
            vertex.st = match upright.to_array() {
                [x, ..] if x > 0.9 => Vec2::new(p.y, -p.z),
                [_, y, _] if y > 0.4 => Vec2::new(p.x, -p.z),
                _ => Vec2::new(p.x, p.y),
            } / TEXTURE;
            vertex.lightmap = unit;
        }
        if lit {
            self.light(surface, right.length() * 2.0, up.length() * 2.0);
        }
        surface
    }

    /// Texture coordinates of a [`plate`](Self::plate) that show the whole image once, upright.
    pub fn whole_image(&mut self, surface: usize) {
        let corners = [
            Vec2::new(0.0, 1.0),
            Vec2::ZERO,
            Vec2::new(1.0, 0.0),
            Vec2::ONE,
        ];
        for (vertex, st) in self.map.vertices_mut(surface).iter_mut().zip(corners) {
            vertex.st = st;
        }
    }

    /// A flat disc around `center`; `right` and `up` as for [`plate`](Self::plate). It shows the whole image once.
    pub fn disc(&mut self, shader: ShaderId, center: Vec3, right: Vec3, up: Vec3) -> usize {
        const CORNERS: usize = 24;
        // clockwise from the front
        let rim: Vec<Vec2> = (0..CORNERS)
            .map(|at| Vec2::from_angle(-TAU * at as f32 / CORNERS as f32))
            .collect();
        let corners: Vec<Vec3> = (rim.iter())
            .map(|at| center + right * at.x + up * at.y)
            .collect();
        let surface = self.map.add_polygon(shader, &corners);
        for (vertex, at) in self.map.vertices_mut(surface).iter_mut().zip(&rim) {
            vertex.st = Vec2::new(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y);
            vertex.lightmap = *at * 0.5 + 0.5;
        }
        surface
    }

    /// The faces of a box that `faces` names (of [`face`]), and its brush.
    pub fn block(&mut self, shader: ShaderId, mins: Vec3, maxs: Vec3, faces: u8) {
        let (center, half) = ((mins + maxs) * 0.5, (maxs - mins) * 0.5);
        let [x, y, z] = [Vec3::X * half.x, Vec3::Y * half.y, Vec3::Z * half.z];
        let plates = [
            (face::WEST, -x, -y, z),
            (face::EAST, x, y, z),
            (face::SOUTH, -y, x, z),
            (face::NORTH, y, -x, z),
            (face::BELOW, -z, -x, y),
            (face::ABOVE, z, x, y),
        ];
        for (_, out, right, up) in plates.into_iter().filter(|(bit, ..)| faces & bit != 0) {
            self.plate(shader, center + out, right, up, true);
        }
        self.map.add_box_brush(shader, mins, maxs);
    }

    /// A curve of `columns` × `rows` control points (odd numbers), given by column and row with their texture
    /// coordinates; the normal is right × up of columns and rows. `size`: about its width and height, units.
    pub fn curve(
        &mut self,
        shader: ShaderId,
        [columns, rows]: [usize; 2],
        size: Vec2,
        point: impl Fn(usize, usize) -> (Vec3, Vec2),
    ) -> usize {
        let points: Vec<DrawVert> = (0..columns * rows)
            .map(|at| {
                let (column, row) = (at % columns, at / columns);
                let (position, st) = point(column, row);
                DrawVert {
                    position,
                    st,
                    lightmap: Vec2::new(
                        column as f32 / (columns - 1).max(1) as f32,
                        row as f32 / (rows - 1).max(1) as f32,
                    ),
                    normal: Vec3::Z,
                    color: [255; 4],
                }
            })
            .collect();
        let surface = self.map.add_patch(shader, columns, rows, &points);
        self.light(surface, size.x, size.y);
        surface
    }

    /// An upright round column with its axis at `foot`.
    pub fn column(&mut self, shader: ShaderId, foot: Vec3, radius: f32, height: f32) {
        const SEGMENTS: usize = 12;
        let around = TAU * radius;
        self.curve(
            shader,
            [SEGMENTS * 2 + 1, 3],
            Vec2::new(around, height),
            |column, row| {
                // seen from outside, columns run counter-clockwise from above and rows upwards
                let at = circle(0.0, TAU, SEGMENTS, column) * radius;
                let (x, z) = (
                    column as f32 / (SEGMENTS * 2) as f32,
                    height * row as f32 * 0.5,
                );
                (foot + at.extend(z), Vec2::new(x * 2.0, -z / TEXTURE))
            },
        );
        let half = Vec3::new(radius, radius, 0.0) * 0.9;
        self.map
            .add_box_brush(shader, foot - half, foot + half + Vec3::Z * height);
    }

    /// A ball of flat triangles, in bands: engines refuse surfaces of more than 1000 vertices.
    pub fn ball(&mut self, shader: ShaderId, center: Vec3, radius: f32) {
        for first in (0..RINGS).step_by(BAND) {
            let rings = first..(first + BAND).min(RINGS);
            self.band(shader, center, radius, rings);
        }
    }

    /// Rings of a ball.
    fn band(&mut self, shader: ShaderId, center: Vec3, radius: f32, rings: Range<usize>) {
        let vertices: Vec<DrawVert> = (rings.start..=rings.end)
            .flat_map(|ring| (0..=AROUND).map(move |at| (ring, at)))
            .map(|(ring, at)| {
                let down = TAU * 0.5 * ring as f32 / RINGS as f32;
                let turn = TAU * at as f32 / AROUND as f32;
                let normal =
                    Vec3::new(down.sin() * turn.cos(), down.sin() * turn.sin(), down.cos());
                DrawVert {
                    position: center + normal * radius,
                    st: Vec2::new(at as f32 / AROUND as f32, ring as f32 / RINGS as f32),
                    lightmap: Vec2::ZERO,
                    normal,
                    color: [255; 4],
                }
            })
            .collect();
        let mut indices = Vec::new();
        for (row, ring) in (0..).zip(rings) {
            for at in 0..AROUND as i32 {
                let first = row * (AROUND as i32 + 1) + at;
                let below = first + AROUND as i32 + 1;
                // the triangles at the poles have no area
                if ring > 0 {
                    indices.extend([first, first + 1, below + 1]);
                }
                if ring + 1 < RINGS {
                    indices.extend([first, below + 1, below]);
                }
            }
        }
        self.map.add_soup(shader, &vertices, &indices);
    }
}

/// Control point `index` of the unit circle from angle `start` over `sweep`, in `segments` quadratic pieces: even ones lie
/// on the circle, odd ones where the tangents of their neighbours meet.
pub(super) fn circle(start: f32, sweep: f32, segments: usize, index: usize) -> Vec2 {
    let step = sweep / segments as f32;
    let angle = start + step * 0.5 * index as f32;
    let radius = if index % 2 == 1 {
        1.0 / (step * 0.5).cos()
    } else {
        1.0
    };
    Vec2::from_angle(angle) * radius
}
