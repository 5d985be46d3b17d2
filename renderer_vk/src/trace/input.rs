//! Input of the traced look: plain descriptions of a map and of a view, so that the passes depend on no loader and
//! tests build scenes directly.

use glam::Vec2;
use shaders::trace_types::SkyRecord;
use shaders::types::constants as c;
use shaders::types::{Fog, MaterialBuffers, Vertex};
use support::slice::{part, span};

use super::cutout::Coverage;

/// How rays treat a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// Stops every ray.
    Opaque,
    /// Stops a ray where its alpha test passes.
    Tested,
    /// Camera rays composite its colour over the surface behind; casts no shadow unless its material filters light.
    Translucent,
    /// Shows the sky.
    Sky,
    /// Stops camera rays on its visible side; shadow and bounce rays ignore it.
    Passed,
}

impl Kind {
    /// The kind by a material's `MATERIAL_*` bits; `None` if rays ignore it. Fog brushes are volumes, not surfaces. A
    /// portal's surface stops the ray, because the portal's view replaces the geometry behind it. A blended layer on an
    /// alpha-tested wall is passed: the wall lies in the same plane, and a ray that stopped at the layer would miss it.
    pub fn of(flags: u32) -> Option<Self> {
        const PAINTED: u32 = c::MATERIAL_TRANSLUCENT | c::MATERIAL_POLYGON_OFFSET;
        if flags & (c::MATERIAL_INVISIBLE | c::MATERIAL_FOG) != 0 {
            None
        } else if flags & c::MATERIAL_SKY != 0 {
            Some(Self::Sky)
        } else if flags & c::MATERIAL_PORTAL != 0 {
            Some(Self::Opaque)
        } else if flags & PAINTED == PAINTED {
            Some(Self::Translucent)
        } else if flags & c::MATERIAL_CUT_OUT != 0 {
            Some(Self::Tested)
        } else if flags & c::MATERIAL_TRANSLUCENT != 0 {
            Some(Self::Translucent)
        } else {
            Some(Self::Opaque)
        }
    }

    /// As [`of`](Self::of), but one-sided opaque surfaces without shadow are [`Passed`](Self::Passed): those of the map
    /// (`world`) that the map compiler gave no shadow, and those of models that show back faces only, because the
    /// outline shell of a cel-shaded model would shadow the model inside.
    pub fn in_light(flags: u32, world: bool) -> Option<Self> {
        let passed = if world {
            c::MATERIAL_PASSED
        } else {
            c::MATERIAL_CULL_BACK
        };
        let kept = flags & (c::MATERIAL_TWO_SIDED | c::MATERIAL_PORTAL) != 0;
        match Self::of(flags) {
            Some(Self::Opaque) if flags & passed != 0 && !kept => Some(Self::Passed),
            kind => kind,
        }
    }

    /// Whether its triangles stop all rays without an any-hit test.
    pub fn is_untested(self) -> bool {
        matches!(self, Self::Opaque | Self::Sky)
    }

    /// The value of `KIND_*` in GLSL.
    pub fn index(self) -> u32 {
        use shaders::trace_types::constants as t;
        match self {
            Self::Opaque => t::KIND_OPAQUE,
            Self::Tested => t::KIND_TESTED,
            Self::Translucent => t::KIND_TRANSLUCENT,
            Self::Sky => t::KIND_SKY,
            Self::Passed => t::KIND_PASSED,
        }
    }
}

/// Facts about a material for the CPU side of the tracer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaterialInfo {
    /// `MATERIAL_*` bits.
    pub flags: u32,
    /// Sort value: surfaces are drawn in ascending order.
    pub sort: f32,
    /// Order among materials of one sort value.
    pub order: u32,
    /// Sky parameters of a sky.
    pub sky: Option<SkyRecord>,
}

/// Materials by index.
pub trait MaterialTable {
    /// The material drawn for `index` (after remapping), and its facts.
    fn info(&self, index: u32) -> (u32, MaterialInfo);
    /// Whether materials are rough or have normal maps. `frosted`: rough glass counts, too.
    fn has_gloss(&self, _frosted: bool) -> bool {
        false
    }
    /// Whether a rough material reflects more than most materials that are no metal.
    fn has_metal(&self) -> bool {
        false
    }
    /// Whether normal maps have heights.
    fn has_heights(&self) -> bool {
        false
    }
    /// Alpha coverage of a triangle by its texture coordinates.
    fn coverage(&self, _material: u32, _corners: [Vec2; 3]) -> Coverage {
        Coverage::Mixed
    }
    /// Solid part of the image of an alpha-tested material; `None` if it is unknown.
    fn mean_coverage(&self, _material: u32) -> Option<f32> {
        None
    }
    /// Device addresses of the material arrays.
    fn buffers(&self) -> MaterialBuffers;
    /// Bindless index of the clamped sampler with mip levels, for sky boxes.
    fn sky_sampler(&self) -> u32;
    /// A number that changes whenever a result of [`info`](Self::info) may have changed.
    fn generation(&self) -> u64;
}

/// A surface of constant shape of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StaticSurface {
    /// First index in [`StaticScene::indices`].
    pub first_index: u32,
    /// Number of indices.
    pub index_count: u32,
    /// Index of the material.
    pub material: u32,
    /// Fog volume plus one; 0: no fog.
    pub fog: u32,
    /// Bindless texture of the lightmap page, or `NO_TEXTURE`.
    pub lightmap: u32,
    /// BSP model: 0 is the world, others are placed by entities.
    pub model: u32,
    /// Number of the surface in the map.
    pub number: u32,
    /// Its triangles approximate a curve.
    pub curved: bool,
}

/// The map's geometry of constant shape.
#[derive(Clone, Debug)]
pub struct StaticScene<'a> {
    /// Vertices.
    pub vertices: &'a [Vertex],
    /// Device address of the same vertices.
    pub vertex_address: u64,
    /// Device address of their [`MappedVertex`](shaders::types::MappedVertex); 0: they have none.
    pub mapped_address: u64,
    /// Indices, three a triangle, clockwise from the front.
    pub indices: &'a [u32],
    /// Surfaces.
    pub surfaces: Vec<StaticSurface>,
    /// Fog volumes.
    pub fogs: &'a [Fog],
}

impl StaticScene<'_> {
    /// The triangles of a surface, as indices of vertices.
    pub fn triangles(&self, surface: &StaticSurface) -> &[[u32; 3]] {
        let indices = part(self.indices, span(surface.first_index, surface.index_count));
        indices.as_chunks::<3>().0
    }

    /// The vertices of a surface's triangles, three each.
    pub fn corners(&self, surface: &StaticSurface) -> impl Iterator<Item = &Vertex> {
        let indices = self.triangles(surface).as_flattened();
        indices
            .iter()
            .filter_map(|&i| self.vertices.get(i as usize))
    }
}
