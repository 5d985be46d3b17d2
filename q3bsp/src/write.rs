//! [`Bsp`] to bytes.

use crate::Bsp;
use crate::bytes::Record;
use crate::container::{Container, LumpRange, SLOTS};
use crate::error::Lump;
use crate::format::Format;
use crate::layers::{
    Advertisement, GridLayers, LayeredSide, LayeredSurface, LayeredVertex, Layers,
};
use crate::lumps::{
    Brush, BrushSide, DrawVert, Fog, GridPoint, Leaf, Model, Node, Plane, ShaderRef,
};
use crate::surface::Surface;

/// The order in which compilers write the lumps.
const USUAL_ORDER: [Lump; SLOTS] = [
    Lump::Shaders,
    Lump::Planes,
    Lump::Leafs,
    Lump::Nodes,
    Lump::Brushes,
    Lump::BrushSides,
    Lump::LeafSurfaces,
    Lump::LeafBrushes,
    Lump::Models,
    Lump::DrawVerts,
    Lump::Surfaces,
    Lump::Visibility,
    Lump::Lightmaps,
    Lump::LightGrid,
    Lump::Entities,
    Lump::Fogs,
    Lump::DrawIndexes,
    // or the advertisements, whose place in the directory is the same
    Lump::LightArray,
];

impl Bsp {
    /// The map as a file of its [`Format`]. A map that was parsed and not changed gives its bytes back exactly; one
    /// whose lumps kept their lengths keeps the layout; any other is laid out anew in the order it
    /// had, lumps aligned to 4 bytes, the compiler's banner kept.
    ///
    /// A format cannot hold what it has no place for: layers of light in `IBSP`, advertisements outside Quake Live.
    pub fn write(&self) -> Vec<u8> {
        let data = self.encode_lumps();
        let keeps_layout = self.container.header_length == self.format.header_bytes()
            && data
                .iter()
                .zip(&self.container.lumps)
                .all(|(bytes, range)| i32::try_from(bytes.len()) == Ok(range.length));
        if keeps_layout {
            self.write_in_place(&data)
        } else {
            self.write_anew(&data)
        }
    }

    fn write_in_place(&self, data: &[Vec<u8>; SLOTS]) -> Vec<u8> {
        let mut file = vec![0; self.container.file_length];
        for gap in &self.container.gaps {
            copy_to(&mut file, gap.offset, &gap.bytes);
        }
        // The header comes before the lumps, because a hostile file's lumps may overlap it and were
        // read from the same bytes.
        copy_to(&mut file, 0, &header(self.format, &self.container.lumps));
        for (bytes, range) in data.iter().zip(&self.container.lumps) {
            if let Ok(offset) = usize::try_from(range.offset) {
                copy_to(&mut file, offset, bytes);
            }
        }
        file
    }

    fn write_anew(&self, data: &[Vec<u8>; SLOTS]) -> Vec<u8> {
        let mut order = USUAL_ORDER.map(Lump::index);
        if self.container.file_length > 0 {
            order.sort_by_key(|&at| self.container.lumps.get(at).map_or(0, |r| r.offset));
        }
        let mut file = vec![0; self.format.header_bytes()];
        file.extend_from_slice(self.container.banner());
        let mut lumps = [LumpRange::default(); SLOTS];
        for at in order {
            // `order` is a permutation of the slots.
            let (Some(bytes), Some(range)) = (data.get(at), lumps.get_mut(at)) else {
                continue;
            };
            file.resize(file.len().next_multiple_of(4), 0);
            let int = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
            *range = LumpRange {
                offset: int(file.len()),
                length: int(bytes.len()),
            };
            file.extend_from_slice(bytes);
        }
        copy_to(&mut file, 0, &header(self.format, &lumps));
        file
    }

    fn encode_lumps(&self) -> [Vec<u8>; SLOTS] {
        let mut data: [Vec<u8>; SLOTS] = Default::default();
        for (&lump, out) in self.format.lumps().iter().zip(&mut data) {
            *out = self.encode_lump(lump);
        }
        for repair in &self.container.repairs {
            let stride = self.format.stride(repair.lump);
            let at = repair.element.saturating_mul(stride) + repair.field_offset;
            if let Some(slot) = data
                .get_mut(repair.lump.index())
                .and_then(|lump| lump.get_mut(at..at.saturating_add(4)))
                && *slot == repair.replacement.to_le_bytes()
            {
                slot.copy_from_slice(&repair.original.to_le_bytes());
            }
        }
        data
    }

    fn encode_lump(&self, lump: Lump) -> Vec<u8> {
        let layered = self.format.has_layers();
        let layers = &self.layers;
        let mut out = match lump {
            Lump::Entities => self.entities.clone(),
            Lump::Shaders if self.format == Format::Rbsp => {
                let stored: Vec<ShaderRef> = self.shaders.iter().map(ShaderRef::to_raven).collect();
                encode(&stored)
            }
            Lump::Shaders => encode(&self.shaders),
            Lump::Planes => encode(&self.planes),
            Lump::Nodes => encode(&self.nodes),
            Lump::Leafs => encode(&self.leafs),
            Lump::LeafSurfaces => encode(&self.leaf_surfaces),
            Lump::LeafBrushes => encode(&self.leaf_brushes),
            Lump::Models => encode(&self.models),
            Lump::Brushes => encode(&self.brushes),
            Lump::BrushSides if layered => {
                encode_with(&self.brush_sides, &layers.side_surfaces, || -1, LayeredSide)
            }
            Lump::BrushSides => encode(&self.brush_sides),
            Lump::DrawVerts if layered => encode_with(
                &self.vertices,
                &layers.vertices,
                Default::default,
                LayeredVertex,
            ),
            Lump::DrawVerts => encode(&self.vertices),
            Lump::DrawIndexes => encode(&self.indices),
            Lump::Fogs => encode(&self.fogs),
            Lump::Surfaces if layered => encode_with(
                &self.surfaces,
                &layers.surfaces,
                Default::default,
                LayeredSurface,
            ),
            Lump::Surfaces => encode(&self.surfaces),
            Lump::LightGrid if layered => match self.stored_grid() {
                Some((points, _)) => encode(points),
                None => encode(&Layers::gather_grid(&self.light_grid).0),
            },
            Lump::LightArray => match self.stored_grid() {
                Some((_, indices)) => encode(indices),
                None => encode(&Layers::gather_grid(&self.light_grid).1),
            },
            Lump::LightGrid => encode(&self.light_grid),
            Lump::Advertisements => encode(&self.advertisements),
            Lump::Lightmaps => {
                let mut out = Vec::new();
                for page in &self.lightmaps {
                    out.extend_from_slice(&page.0);
                }
                out
            }
            Lump::Visibility => {
                let mut out = Vec::new();
                if let Some(visibility) = &self.visibility {
                    visibility.encode(&mut out);
                }
                out
            }
            // The lumps that only Quake's formats have.
            _ => Vec::new(),
        };
        if let Some(trailing) = self.container.trailing.get(lump.index()) {
            out.extend_from_slice(trailing);
        }
        out
    }

    /// The stored form of the light grid, while it is equal to [`Bsp::light_grid`].
    fn stored_grid(&self) -> Option<(&[GridLayers], &[u16])> {
        (self.layers.spread_grid() == self.light_grid)
            .then_some((&self.layers.grid_points, &self.layers.grid_indices))
    }
}

impl Container {
    /// Drops the layout of the map's file, so that it is written in the usual order without banner,
    /// odd bytes or repaired values.
    pub fn forget(&mut self) {
        *self = Container::default();
    }
}

fn encode<T: Record>(records: &[T]) -> Vec<u8> {
    let mut out = Vec::with_capacity(records.len() * T::STRIDE);
    for record in records {
        record.encode(&mut out);
    }
    out
}

/// Encodes records that are kept in two lists; the second one may be shorter.
fn encode_with<A: Copy, B: Copy, T: Record>(
    records: &[A],
    more: &[B],
    missing: impl Fn() -> B,
    join: impl Fn(A, B) -> T,
) -> Vec<u8> {
    let mut out = Vec::with_capacity(records.len() * T::STRIDE);
    for (at, &record) in records.iter().enumerate() {
        let with = more.get(at).copied().unwrap_or_else(&missing);
        join(record, with).encode(&mut out);
    }
    out
}

impl Format {
    /// Bytes per record of a lump.
    pub(crate) fn stride(self, lump: Lump) -> usize {
        let layered = self.has_layers();
        match lump {
            Lump::Shaders => ShaderRef::STRIDE,
            Lump::Planes => Plane::STRIDE,
            Lump::Nodes => Node::STRIDE,
            Lump::Leafs => Leaf::STRIDE,
            Lump::LeafSurfaces | Lump::LeafBrushes | Lump::DrawIndexes => i32::STRIDE,
            Lump::Models => Model::STRIDE,
            Lump::Brushes => Brush::STRIDE,
            Lump::BrushSides if layered => LayeredSide::STRIDE,
            Lump::BrushSides => BrushSide::STRIDE,
            Lump::DrawVerts if layered => LayeredVertex::STRIDE,
            Lump::DrawVerts => DrawVert::STRIDE,
            Lump::Fogs => Fog::STRIDE,
            Lump::Surfaces if layered => LayeredSurface::STRIDE,
            Lump::Surfaces => Surface::STRIDE,
            Lump::LightGrid if layered => GridLayers::STRIDE,
            Lump::LightGrid => GridPoint::STRIDE,
            Lump::LightArray => u16::STRIDE,
            Lump::Advertisements => Advertisement::STRIDE,
            _ => 1,
        }
    }
}

fn header(format: Format, lumps: &[LumpRange; SLOTS]) -> Vec<u8> {
    let (ident, version) = format.magic();
    let mut out = Vec::with_capacity(format.header_bytes());
    out.extend_from_slice(ident);
    out.extend_from_slice(&version.to_le_bytes());
    for range in lumps.iter().take(format.lumps().len()) {
        out.extend_from_slice(&range.offset.to_le_bytes());
        out.extend_from_slice(&range.length.to_le_bytes());
    }
    out
}

fn copy_to(file: &mut [u8], offset: usize, bytes: &[u8]) {
    if let Some(slot) = file.get_mut(offset..offset.saturating_add(bytes.len())) {
        slot.copy_from_slice(bytes);
    }
}
