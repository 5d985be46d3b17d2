//! Bytes to [`Bsp`]: the directory and the records. What they refer to is checked in `validate`.

use crate::bytes::{Fields, Record};
use crate::container::{Container, Gap, LumpEntry, LumpRange, SLOTS};
use crate::error::{Error, Lump, Warning};
use crate::format::{Format, announced};
use crate::layers::{GridLayers, LayeredSide, LayeredSurface, LayeredVertex};
use crate::lumps::{GridPoint, Lightmap, ShaderRef};
#[cfg(feature = "quake")]
use crate::quake::QuakeMap;
use crate::{Bsp, Visibility};

impl Bsp {
    /// Reads and validates a map of any [`Format`].
    ///
    /// # Errors
    /// Whatever the engine refuses (wrong format, odd lump sizes, missing world) and every reference
    /// that leads out of its lump, which the engine would follow. Oddities that the engine tolerates
    /// are in [`Bsp::warnings`].
    pub fn parse(bytes: &[u8]) -> Result<Bsp, Error> {
        let format = announced(bytes)?;
        if format.is_quake() {
            #[cfg(feature = "quake")]
            return QuakeMap::parse(bytes)?.to_bsp();
            #[cfg(not(feature = "quake"))]
            return Err(left_out(format));
        }
        let lumps = directory(bytes, format)?;
        let mut bsp = Bsp {
            format,
            container: Container {
                lumps,
                file_length: bytes.len(),
                header_length: format.header_bytes(),
                ..Container::default()
            },
            ..Bsp::default()
        };
        bsp.find_gaps(bytes);
        match bsp.read_lumps(bytes).and_then(|()| bsp.validate()) {
            Ok(()) => Ok(bsp),
            Err(error) => Err(bsp.located(error)),
        }
    }

    fn read_lumps(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let lumps = self.container.lumps;
        let data = |lump: Lump| {
            // Every lump read below has a place in the directory.
            let range = lumps.get(lump.index()).copied().unwrap_or_default();
            lump_bytes(bytes, range)
        };
        self.entities = data(Lump::Entities).to_vec();
        self.shaders = records(Lump::Shaders, data(Lump::Shaders))?;
        self.planes = records(Lump::Planes, data(Lump::Planes))?;
        self.nodes = records(Lump::Nodes, data(Lump::Nodes))?;
        self.leafs = records(Lump::Leafs, data(Lump::Leafs))?;
        self.leaf_surfaces = records(Lump::LeafSurfaces, data(Lump::LeafSurfaces))?;
        self.leaf_brushes = records(Lump::LeafBrushes, data(Lump::LeafBrushes))?;
        self.models = records(Lump::Models, data(Lump::Models))?;
        self.brushes = records(Lump::Brushes, data(Lump::Brushes))?;
        self.indices = records(Lump::DrawIndexes, data(Lump::DrawIndexes))?;
        self.fogs = records(Lump::Fogs, data(Lump::Fogs))?;

        let (points, rest) = if self.format.has_layers() {
            self.read_layers(&data)?
        } else {
            self.brush_sides = records(Lump::BrushSides, data(Lump::BrushSides))?;
            self.vertices = records(Lump::DrawVerts, data(Lump::DrawVerts))?;
            self.surfaces = records(Lump::Surfaces, data(Lump::Surfaces))?;
            let (points, rest) = split_records(data(Lump::LightGrid), GridPoint::STRIDE);
            (records(Lump::LightGrid, points)?, rest)
        };
        self.light_grid = points;
        self.keep_trailing(Lump::LightGrid, rest, "the partial point is ignored");
        if self.format == Format::Rbsp {
            let shaders = std::mem::take(&mut self.shaders);
            self.shaders = shaders.into_iter().map(ShaderRef::read_as_raven).collect();
        }
        if self.format == Format::QuakeLive {
            self.advertisements = records(Lump::Advertisements, data(Lump::Advertisements))?;
        }

        let page_bytes = self.format.lightmap_size() * self.format.lightmap_size() * 3;
        let (pages, rest) = split_records(data(Lump::Lightmaps), page_bytes);
        self.lightmaps = pages
            .chunks_exact(page_bytes)
            .map(|page| Lightmap(page.into()))
            .collect();
        self.keep_trailing(Lump::Lightmaps, rest, "the partial page is ignored");

        let (visibility, rest, oddity) = Visibility::decode(data(Lump::Visibility));
        self.visibility = visibility;
        self.container.set_trailing(Lump::Visibility, rest);
        self.warnings.extend(oddity);
        Ok(())
    }

    /// Reads the lumps whose records have layers. Returns the light grid as one without styles has it, and the bytes
    /// that are no whole point.
    fn read_layers<'a>(
        &mut self,
        data: &dyn Fn(Lump) -> &'a [u8],
    ) -> Result<(Vec<GridPoint>, &'a [u8]), Error> {
        let layers = &mut self.layers;
        for LayeredSide(side, surface) in records(Lump::BrushSides, data(Lump::BrushSides))? {
            self.brush_sides.push(side);
            layers.side_surfaces.push(surface);
        }
        for LayeredVertex(vertex, more) in records(Lump::DrawVerts, data(Lump::DrawVerts))? {
            self.vertices.push(vertex);
            layers.vertices.push(more);
        }
        for LayeredSurface(surface, more) in records(Lump::Surfaces, data(Lump::Surfaces))? {
            self.surfaces.push(surface);
            layers.surfaces.push(more);
        }
        let (points, rest) = split_records(data(Lump::LightGrid), GridLayers::STRIDE);
        layers.grid_points = records(Lump::LightGrid, points)?;
        layers.grid_indices = records(Lump::LightArray, data(Lump::LightArray))?;
        let beyond = |&index: &u16| usize::from(index) >= layers.grid_points.len();
        let count = layers.grid_indices.iter().filter(|i| beyond(i)).count();
        if count > 0 {
            self.warnings.push(Warning {
                lump: Lump::LightArray,
                element: layers.grid_indices.iter().position(beyond),
                field: "number of indices beyond the lightgrid (this is the first)".into(),
                value: count as i64,
                action: "taken as points in walls".into(),
            });
        }
        Ok((self.layers.spread_grid(), rest))
    }

    /// The error with its place in the file this map was read from.
    fn located(&self, error: Error) -> Error {
        let Some((lump, element)) = error.place() else {
            return error;
        };
        let range = self.container.lumps.get(lump.index());
        let start = range.and_then(|r| u64::try_from(r.offset).ok());
        let offset = start.map(|start| start + (element * self.format.stride(lump)) as u64);
        match offset {
            Some(offset) => Error::At {
                offset,
                error: Box::new(error),
            },
            None => error,
        }
    }

    fn keep_trailing(&mut self, lump: Lump, rest: &[u8], action: &'static str) {
        if !rest.is_empty() {
            self.container.set_trailing(lump, rest);
            self.warnings.push(Warning {
                lump,
                element: None,
                field: "number of bytes after the last record".into(),
                value: rest.len() as i64,
                action: action.into(),
            });
        }
    }

    /// Collects the bytes that no lump claims, and notes lumps that share bytes.
    fn find_gaps(&mut self, bytes: &[u8]) {
        let lumps = self.format.lumps();
        let mut ranges: Vec<(usize, usize, Lump)> = lumps
            .iter()
            .filter_map(|&lump| {
                let range = self.container.lumps.get(lump.index())?;
                let start = usize::try_from(range.offset).ok()?;
                let length = usize::try_from(range.length).ok()?;
                (length > 0).then_some((start, start + length, lump))
            })
            .collect();
        ranges.sort_by_key(|&(start, end, _)| (start, end));
        let mut covered = self.container.header_length;
        for (start, end, lump) in ranges {
            if start < covered {
                self.warnings.push(Warning {
                    lump,
                    element: None,
                    field: "offset".into(),
                    value: start as i64,
                    action: "inside the header or another lump; read all the same".into(),
                });
            } else {
                self.push_gap(bytes, covered, start);
            }
            covered = covered.max(end);
        }
        self.push_gap(bytes, covered, bytes.len());
    }

    fn push_gap(&mut self, bytes: &[u8], start: usize, end: usize) {
        match bytes.get(start..end) {
            Some(gap) if !gap.is_empty() => self.container.gaps.push(Gap {
                offset: start,
                bytes: gap.to_vec(),
            }),
            _ => {}
        }
    }
}

/// The directory of a map file of any [`Format`], in its order.
///
/// # Errors
/// Another format, or a lump outside the file.
pub fn lump_entries(bytes: &[u8]) -> Result<Vec<LumpEntry>, Error> {
    let format = announced(bytes)?;
    if format.is_quake() {
        #[cfg(feature = "quake")]
        return Ok(QuakeMap::parse(bytes)?.lump_entries());
        #[cfg(not(feature = "quake"))]
        return Err(left_out(format));
    }
    let ranges = directory(bytes, format)?;
    let entry = |(&lump, range)| LumpEntry {
        lump,
        range,
        stride: format.stride(lump),
    };
    Ok(format.lumps().iter().zip(ranges).map(entry).collect())
}

/// That a file has a format whose reader was not compiled.
#[cfg(not(feature = "quake"))]
fn left_out(format: Format) -> Error {
    Error::WrongFormat {
        found: format!("{format}, which needs the feature `quake`"),
    }
}

/// Reads the header and checks that every lump lies inside the file.
fn directory(bytes: &[u8], format: Format) -> Result<[LumpRange; SLOTS], Error> {
    let needed = format.header_bytes();
    let header = bytes.get(..needed).ok_or(Error::TooShort {
        found: bytes.len(),
        needed,
    })?;
    let mut fields = Fields::new(header);
    let _ident_and_version: [u8; 8] = fields.bytes();
    let mut lumps = [LumpRange::default(); SLOTS];
    for (&lump, range) in format.lumps().iter().zip(&mut lumps) {
        *range = LumpRange::read(&mut fields, lump, bytes.len())?;
    }
    Ok(lumps)
}

/// The bytes of a lump whose range was checked.
fn lump_bytes(bytes: &[u8], range: LumpRange) -> &[u8] {
    let start = usize::try_from(range.offset).unwrap_or(0);
    let length = usize::try_from(range.length).unwrap_or(0);
    bytes.get(start..start + length).unwrap_or(&[])
}

/// Cuts off what is no whole record.
fn split_records(data: &[u8], stride: usize) -> (&[u8], &[u8]) {
    data.split_at(data.len() - data.len() % stride)
}

fn records<T: Record>(lump: Lump, data: &[u8]) -> Result<Vec<T>, Error> {
    if !data.len().is_multiple_of(T::STRIDE) {
        return Err(Error::LumpLength {
            lump,
            length: data.len(),
            stride: T::STRIDE,
        });
    }
    Ok(data
        .chunks_exact(T::STRIDE)
        .map(|record| T::decode(Fields::new(record)))
        .collect())
}
