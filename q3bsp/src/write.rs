//! [`Bsp`] to bytes.

use crate::Bsp;
use crate::container::{Container, HEADER_BYTES, LumpRange};
use crate::error::Lump;
use crate::lumps::Record;

/// The order in which compilers write the lumps.
const USUAL_ORDER: [Lump; 17] = [
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
];

impl Bsp {
    /// The map as a file. A map that was parsed and not changed gives its bytes back exactly; one
    /// whose lumps kept their lengths keeps the layout; any other is laid out anew in the order it
    /// had, lumps aligned to 4 bytes, the compiler's banner kept.
    pub fn write(&self) -> Vec<u8> {
        let data = self.encode_lumps();
        let keeps_layout = self.container.file_length >= HEADER_BYTES
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

    fn write_in_place(&self, data: &[Vec<u8>; 17]) -> Vec<u8> {
        let mut file = vec![0; self.container.file_length];
        for gap in &self.container.gaps {
            copy_to(&mut file, gap.offset, &gap.bytes);
        }
        // The header comes before the lumps, because a hostile file's lumps may overlap it and were
        // read from the same bytes.
        copy_to(&mut file, 0, &header(&self.container.lumps));
        for (bytes, range) in data.iter().zip(&self.container.lumps) {
            if let Ok(offset) = usize::try_from(range.offset) {
                copy_to(&mut file, offset, bytes);
            }
        }
        file
    }

    fn write_anew(&self, data: &[Vec<u8>; 17]) -> Vec<u8> {
        let mut order = USUAL_ORDER;
        if self.container.file_length > 0 {
            order.sort_by_key(|lump| self.container.lumps[lump.index()].offset);
        }
        let mut file = vec![0; HEADER_BYTES];
        file.extend_from_slice(self.container.banner());
        let mut lumps = [LumpRange::default(); 17];
        for lump in order {
            file.resize(file.len().next_multiple_of(4), 0);
            let bytes = &data[lump.index()];
            let int = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
            lumps[lump.index()] = LumpRange {
                offset: int(file.len()),
                length: int(bytes.len()),
            };
            file.extend_from_slice(bytes);
        }
        copy_to(&mut file, 0, &header(&lumps));
        file
    }

    fn encode_lumps(&self) -> [Vec<u8>; 17] {
        let mut data = Lump::ALL.map(|lump| self.encode_lump(lump));
        for repair in &self.container.repairs {
            let stride = stride(repair.lump);
            let at = repair.element.saturating_mul(stride) + repair.field_offset;
            if let Some(slot) = data[repair.lump.index()].get_mut(at..at.saturating_add(4))
                && *slot == repair.replacement.to_le_bytes()
            {
                slot.copy_from_slice(&repair.original.to_le_bytes());
            }
        }
        data
    }

    fn encode_lump(&self, lump: Lump) -> Vec<u8> {
        let mut out = match lump {
            Lump::Entities => self.entities.clone(),
            Lump::Shaders => encode(&self.shaders),
            Lump::Planes => encode(&self.planes),
            Lump::Nodes => encode(&self.nodes),
            Lump::Leafs => encode(&self.leafs),
            Lump::LeafSurfaces => encode(&self.leaf_surfaces),
            Lump::LeafBrushes => encode(&self.leaf_brushes),
            Lump::Models => encode(&self.models),
            Lump::Brushes => encode(&self.brushes),
            Lump::BrushSides => encode(&self.brush_sides),
            Lump::DrawVerts => encode(&self.vertices),
            Lump::DrawIndexes => encode(&self.indices),
            Lump::Fogs => encode(&self.fogs),
            Lump::Surfaces => encode(&self.surfaces),
            Lump::LightGrid => encode(&self.light_grid),
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
        };
        out.extend_from_slice(&self.container.trailing[lump.index()]);
        out
    }
}

impl Container {
    /// Forgets the file a map came from, so that it is written in the usual order without banner,
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

fn stride(lump: Lump) -> usize {
    use crate::lumps::{
        Brush, BrushSide, DrawVert, Fog, GridPoint, Leaf, Model, Node, Plane, ShaderRef,
    };
    use crate::surface::Surface;
    match lump {
        Lump::Shaders => ShaderRef::STRIDE,
        Lump::Planes => Plane::STRIDE,
        Lump::Nodes => Node::STRIDE,
        Lump::Leafs => Leaf::STRIDE,
        Lump::LeafSurfaces | Lump::LeafBrushes | Lump::DrawIndexes => i32::STRIDE,
        Lump::Models => Model::STRIDE,
        Lump::Brushes => Brush::STRIDE,
        Lump::BrushSides => BrushSide::STRIDE,
        Lump::DrawVerts => DrawVert::STRIDE,
        Lump::Fogs => Fog::STRIDE,
        Lump::Surfaces => Surface::STRIDE,
        Lump::LightGrid => GridPoint::STRIDE,
        Lump::Entities | Lump::Lightmaps | Lump::Visibility => 1,
    }
}

fn header(lumps: &[LumpRange; 17]) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEADER_BYTES);
    out.extend_from_slice(b"IBSP");
    out.extend_from_slice(&46i32.to_le_bytes());
    for range in lumps {
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
