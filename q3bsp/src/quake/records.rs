//! The records of Quake's formats, each in the widths that its versions store it with.

use crate::bytes::{Fields, Put};
use crate::format::Format;
use glam::Vec3;

/// A record whose layout depends on the format.
pub(super) trait Versioned: Sized {
    /// Bytes per record.
    fn stride(format: Format) -> usize;
    /// Decodes one record of exactly that many bytes.
    fn decode(fields: Fields<'_>, format: Format) -> Self;
    /// Appends exactly that many bytes. Values that a narrow field cannot hold are cut to it.
    fn encode(&self, format: Format, out: &mut Vec<u8>);
}

/// Whether indices have 32 bits where the first versions had 16.
fn wide(format: Format) -> bool {
    matches!(format, Format::Bsp2 | Format::TwoPsb | Format::Qbism)
}

/// Whether bounds of nodes and leafs are floating point.
fn float_bounds(format: Format) -> bool {
    matches!(format, Format::Bsp2 | Format::Qbism)
}

fn is_quake2(format: Format) -> bool {
    matches!(format, Format::Quake2 | Format::Qbism)
}

fn bounds(f: &mut Fields<'_>, format: Format) -> Vec3 {
    match float_bounds(format) {
        true => f.vec3(),
        false => Vec3::new(f32::from(f.i16()), f32::from(f.i16()), f32::from(f.i16())),
    }
}

fn put_bounds(out: &mut Vec<u8>, v: Vec3, format: Format) {
    match float_bounds(format) {
        true => out.put_vec3(v),
        false => v
            .to_array()
            .iter()
            .for_each(|&v| put_u16(out, v as i16 as u16)),
    }
}

fn put_u16(out: &mut Vec<u8>, value: u16) {
    out.extend_from_slice(&value.to_le_bytes());
}

/// An unsigned index of 16 or 32 bits.
fn unsigned(f: &mut Fields<'_>, wide: bool) -> u32 {
    if wide { f.u32() } else { u32::from(f.u16()) }
}

fn put_unsigned(out: &mut Vec<u8>, value: u32, wide: bool) {
    match wide {
        true => out.extend_from_slice(&value.to_le_bytes()),
        false => put_u16(out, value as u16),
    }
}

/// A signed number of 16 or 32 bits.
fn signed(f: &mut Fields<'_>, wide: bool) -> i32 {
    if wide { f.i32() } else { i32::from(f.i16()) }
}

fn put_signed(out: &mut Vec<u8>, value: i32, wide: bool) {
    match wide {
        true => out.put_i32(value),
        false => put_u16(out, value as i16 as u16),
    }
}

/// A plane: points p with `normal · p = dist`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QuakePlane {
    /// Unit normal.
    pub normal: Vec3,
    /// Distance from the origin along it, id units.
    pub dist: f32,
    /// 0 to 2 for the axes, 3 to 5 for planes nearest to an axis. Not used.
    pub kind: i32,
}

impl Versioned for QuakePlane {
    fn stride(_: Format) -> usize {
        20
    }
    fn decode(mut f: Fields<'_>, _: Format) -> Self {
        QuakePlane {
            normal: f.vec3(),
            dist: f.f32(),
            kind: f.i32(),
        }
    }
    fn encode(&self, _: Format, out: &mut Vec<u8>) {
        out.put_vec3(self.normal);
        out.put_f32(self.dist);
        out.put_i32(self.kind);
    }
}

/// An inner node of the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QuakeNode {
    /// Splitting plane.
    pub plane: i32,
    /// Front and back child: a node, or `-1 - leaf`.
    pub children: [i32; 2],
    /// Smallest corner, id units.
    pub mins: Vec3,
    /// Largest corner.
    pub maxs: Vec3,
    /// First face on the plane.
    pub first_face: u32,
    /// Number of them.
    pub num_faces: u32,
}

impl Versioned for QuakeNode {
    fn stride(format: Format) -> usize {
        match format {
            Format::Bsp2 | Format::Qbism => 44,
            Format::TwoPsb => 32,
            Format::Quake2 => 28,
            _ => 24,
        }
    }
    fn decode(mut f: Fields<'_>, format: Format) -> Self {
        let wide_children = wide(format) || is_quake2(format);
        QuakeNode {
            plane: f.i32(),
            children: [signed(&mut f, wide_children), signed(&mut f, wide_children)],
            mins: bounds(&mut f, format),
            maxs: bounds(&mut f, format),
            first_face: unsigned(&mut f, wide(format)),
            num_faces: unsigned(&mut f, wide(format)),
        }
    }
    fn encode(&self, format: Format, out: &mut Vec<u8>) {
        out.put_i32(self.plane);
        for child in self.children {
            put_signed(out, child, wide(format) || is_quake2(format));
        }
        put_bounds(out, self.mins, format);
        put_bounds(out, self.maxs, format);
        put_unsigned(out, self.first_face, wide(format));
        put_unsigned(out, self.num_faces, wide(format));
    }
}

/// How a texture lies on a face.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Texinfo {
    /// Axis and offset of the horizontal coordinate, texels: `x y z offset`.
    pub s: [f32; 4],
    /// The same for the vertical coordinate.
    pub t: [f32; 4],
    /// Index into the textures of the file; 0 in Quake II, which names them.
    pub texture: u32,
    /// In Quake 1 for a face without a lightmap; in Quake II see [`super::quake2_flags`].
    pub flags: u32,
    /// Quake II: light emitted, for faces that emit any.
    pub value: i32,
    /// Quake II: name of the texture below `textures/`, without extension.
    pub name: [u8; 32],
    /// Quake II: next texinfo of an animation, or -1.
    pub next: i32,
}

impl Versioned for Texinfo {
    fn stride(format: Format) -> usize {
        if is_quake2(format) { 76 } else { 40 }
    }
    fn decode(mut f: Fields<'_>, format: Format) -> Self {
        let s = std::array::from_fn(|_| f.f32());
        let t = std::array::from_fn(|_| f.f32());
        if is_quake2(format) {
            Texinfo {
                s,
                t,
                texture: 0,
                flags: f.u32(),
                value: f.i32(),
                name: f.bytes(),
                next: f.i32(),
            }
        } else {
            Texinfo {
                s,
                t,
                texture: f.u32(),
                flags: f.u32(),
                value: 0,
                name: [0; 32],
                next: -1,
            }
        }
    }
    fn encode(&self, format: Format, out: &mut Vec<u8>) {
        for v in self.s.iter().chain(&self.t) {
            out.put_f32(*v);
        }
        if is_quake2(format) {
            out.extend_from_slice(&self.flags.to_le_bytes());
            out.put_i32(self.value);
            out.extend_from_slice(&self.name);
            out.put_i32(self.next);
        } else {
            out.extend_from_slice(&self.texture.to_le_bytes());
            out.extend_from_slice(&self.flags.to_le_bytes());
        }
    }
}

/// A polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Face {
    /// Plane.
    pub plane: u32,
    /// Not 0 when the face looks to the back of the plane.
    pub side: i32,
    /// First of its entries in the list of edges.
    pub first_edge: i32,
    /// Number of them, which is its number of corners.
    pub num_edges: i32,
    /// How its texture lies.
    pub texinfo: i32,
    /// Light styles of its lightmaps; 255 ends the list.
    pub styles: [u8; 4],
    /// Byte offset of its first lightmap in the lighting lump, or -1.
    pub light_offset: i32,
}

impl Versioned for Face {
    fn stride(format: Format) -> usize {
        if wide(format) { 28 } else { 20 }
    }
    fn decode(mut f: Fields<'_>, format: Format) -> Self {
        let wide = wide(format);
        // Quake counts texinfos without sign, Quake II with one.
        let texinfo = |f: &mut Fields<'_>| match is_quake2(format) || wide {
            true => signed(f, wide),
            false => i32::from(f.u16()),
        };
        Face {
            plane: unsigned(&mut f, wide),
            side: signed(&mut f, wide),
            first_edge: f.i32(),
            num_edges: signed(&mut f, wide),
            texinfo: texinfo(&mut f),
            styles: f.bytes(),
            light_offset: f.i32(),
        }
    }
    fn encode(&self, format: Format, out: &mut Vec<u8>) {
        let wide = wide(format);
        put_unsigned(out, self.plane, wide);
        put_signed(out, self.side, wide);
        out.put_i32(self.first_edge);
        put_signed(out, self.num_edges, wide);
        put_signed(out, self.texinfo, wide);
        out.extend_from_slice(&self.styles);
        out.put_i32(self.light_offset);
    }
}

/// A convex cell of space.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QuakeLeaf {
    /// What fills it: in Quake -1 nothing, -2 stone, -3 water, -4 slime, -5 lava, -6 sky; in Quake II flags.
    pub contents: i32,
    /// Quake: byte offset of its row in the visibility lump, or -1. Quake II: its cluster, or -1.
    pub visibility: i32,
    /// Quake II: its area.
    pub area: i32,
    /// Smallest corner, id units.
    pub mins: Vec3,
    /// Largest corner.
    pub maxs: Vec3,
    /// First of its entries in the list of faces of leafs.
    pub first_face: u32,
    /// Number of them.
    pub num_faces: u32,
    /// Quake II: first of its entries in the list of brushes of leafs.
    pub first_brush: u32,
    /// Number of them.
    pub num_brushes: u32,
    /// Quake: volumes of the ambient sounds.
    pub ambient: [u8; 4],
}

impl Versioned for QuakeLeaf {
    fn stride(format: Format) -> usize {
        match format {
            Format::Bsp2 => 44,
            Format::TwoPsb => 32,
            Format::Qbism => 52,
            _ => 28,
        }
    }
    fn decode(mut f: Fields<'_>, format: Format) -> Self {
        let (two, wide) = (is_quake2(format), wide(format));
        let contents = f.i32();
        let visibility = if two { signed(&mut f, wide) } else { f.i32() };
        let area = if two { signed(&mut f, wide) } else { 0 };
        QuakeLeaf {
            contents,
            visibility,
            area,
            mins: bounds(&mut f, format),
            maxs: bounds(&mut f, format),
            first_face: unsigned(&mut f, wide),
            num_faces: unsigned(&mut f, wide),
            first_brush: if two { unsigned(&mut f, wide) } else { 0 },
            num_brushes: if two { unsigned(&mut f, wide) } else { 0 },
            ambient: if two { [0; 4] } else { f.bytes() },
        }
    }
    fn encode(&self, format: Format, out: &mut Vec<u8>) {
        let (two, wide) = (is_quake2(format), wide(format));
        out.put_i32(self.contents);
        put_signed(out, self.visibility, wide || !two);
        if two {
            put_signed(out, self.area, wide);
        }
        put_bounds(out, self.mins, format);
        put_bounds(out, self.maxs, format);
        put_unsigned(out, self.first_face, wide);
        put_unsigned(out, self.num_faces, wide);
        if two {
            put_unsigned(out, self.first_brush, wide);
            put_unsigned(out, self.num_brushes, wide);
        } else {
            out.extend_from_slice(&self.ambient);
        }
    }
}

/// An edge between two vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Edge(
    /// Start and end.
    pub [u32; 2],
);

impl Versioned for Edge {
    fn stride(format: Format) -> usize {
        if wide(format) { 8 } else { 4 }
    }
    fn decode(mut f: Fields<'_>, format: Format) -> Self {
        Edge(std::array::from_fn(|_| unsigned(&mut f, wide(format))))
    }
    fn encode(&self, format: Format, out: &mut Vec<u8>) {
        for vertex in self.0 {
            put_unsigned(out, vertex, wide(format));
        }
    }
}

/// The world or a brush model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QuakeModel {
    /// Smallest corner, id units.
    pub mins: Vec3,
    /// Largest corner.
    pub maxs: Vec3,
    /// Not used by the engines.
    pub origin: Vec3,
    /// Root of its tree, and in Quake of its three collision trees.
    pub head_nodes: [i32; 4],
    /// Quake: number of leafs that have rows in the visibility lump.
    pub visible_leafs: i32,
    /// First face.
    pub first_face: i32,
    /// Number of them.
    pub num_faces: i32,
}

impl Versioned for QuakeModel {
    fn stride(format: Format) -> usize {
        if is_quake2(format) { 48 } else { 64 }
    }
    fn decode(mut f: Fields<'_>, format: Format) -> Self {
        let (mins, maxs, origin) = (f.vec3(), f.vec3(), f.vec3());
        let two = is_quake2(format);
        let mut head_nodes = [0; 4];
        for node in head_nodes.iter_mut().take(if two { 1 } else { 4 }) {
            *node = f.i32();
        }
        QuakeModel {
            mins,
            maxs,
            origin,
            head_nodes,
            visible_leafs: if two { 0 } else { f.i32() },
            first_face: f.i32(),
            num_faces: f.i32(),
        }
    }
    fn encode(&self, format: Format, out: &mut Vec<u8>) {
        for v in [self.mins, self.maxs, self.origin] {
            out.put_vec3(v);
        }
        let two = is_quake2(format);
        for node in self.head_nodes.iter().take(if two { 1 } else { 4 }) {
            out.put_i32(*node);
        }
        if !two {
            out.put_i32(self.visible_leafs);
        }
        out.put_i32(self.first_face);
        out.put_i32(self.num_faces);
    }
}

/// Quake II: a brush.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QuakeBrush {
    /// First side.
    pub first_side: i32,
    /// Number of sides.
    pub num_sides: i32,
    /// What fills it, in Quake II's flags.
    pub contents: u32,
}

impl Versioned for QuakeBrush {
    fn stride(_: Format) -> usize {
        12
    }
    fn decode(mut f: Fields<'_>, _: Format) -> Self {
        QuakeBrush {
            first_side: f.i32(),
            num_sides: f.i32(),
            contents: f.u32(),
        }
    }
    fn encode(&self, _: Format, out: &mut Vec<u8>) {
        out.put_i32(self.first_side);
        out.put_i32(self.num_sides);
        out.extend_from_slice(&self.contents.to_le_bytes());
    }
}

/// Quake II: a side of a brush.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QuakeBrushSide {
    /// Plane, normal outwards.
    pub plane: u32,
    /// How its texture lies, or -1.
    pub texinfo: i32,
}

impl Versioned for QuakeBrushSide {
    fn stride(format: Format) -> usize {
        if wide(format) { 8 } else { 4 }
    }
    fn decode(mut f: Fields<'_>, format: Format) -> Self {
        QuakeBrushSide {
            plane: unsigned(&mut f, wide(format)),
            texinfo: signed(&mut f, wide(format)),
        }
    }
    fn encode(&self, format: Format, out: &mut Vec<u8>) {
        put_unsigned(out, self.plane, wide(format));
        put_signed(out, self.texinfo, wide(format));
    }
}

impl Versioned for Vec3 {
    fn stride(_: Format) -> usize {
        12
    }
    fn decode(mut f: Fields<'_>, _: Format) -> Self {
        f.vec3()
    }
    fn encode(&self, _: Format, out: &mut Vec<u8>) {
        out.put_vec3(*self);
    }
}

/// Entries of the list of edges: negative ones are walked backwards.
impl Versioned for i32 {
    fn stride(_: Format) -> usize {
        4
    }
    fn decode(mut f: Fields<'_>, _: Format) -> Self {
        f.i32()
    }
    fn encode(&self, _: Format, out: &mut Vec<u8>) {
        out.put_i32(*self);
    }
}

/// Indices of faces and brushes that leafs list.
impl Versioned for u32 {
    fn stride(format: Format) -> usize {
        if wide(format) { 4 } else { 2 }
    }
    fn decode(mut f: Fields<'_>, format: Format) -> Self {
        unsigned(&mut f, wide(format))
    }
    fn encode(&self, format: Format, out: &mut Vec<u8>) {
        put_unsigned(out, *self, wide(format));
    }
}
