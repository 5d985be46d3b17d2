//! Light at vertices of the map's triangles, which bounces take where they hit the map (`rt_bounceCache`): Willberger,
//! Musterle, Bergmann, Deferred Hybrid Path Tracing, Ray Tracing Gems, 2019, section 26.2.
//!
//! The first frame that uses it computes it. Triangles get a grid of vertices, which is refined by the direct light; then
//! sweeps sample the light of lamps, and that of the surfaces which rays meet by the light that the sweep before has found
//! there (Jacobi's method). The first sweeps replace bounced light, the others average it.

use std::cmp::Ordering;

use shaders::trace_types::constants as t;
use shaders::trace_types::{LightGrid, VertexLightView, VertexSum};

use super::frame_passes::FramePasses;
use super::geometry::StaticGeometry;
use super::light_selection::{is_lit, uses_tree};
use super::lights::MapLights;
use super::passes::Pass;
use super::photons;
use crate::gpu::{Access, Buffer, BufferDesc, BufferUsage, Device, Error, Memory};
use crate::settings::Settings;

/// Times that the grids are refined.
const SPLITS: u32 = 4;
/// Sweeps that replace bounced light, with a quarter of the samples: at a reflectance of 0.8, 0.4 % of the light is missing
/// after them.
const FIRST_SWEEPS: u32 = 24;
/// Sweeps whose bounced light is averaged.
const AVERAGED_SWEEPS: u32 = 12;
/// Least and most vertices of a map: 0.5 and 4 MiB of light.
const LEAST_VERTICES: u32 = 1 << 17;
const MOST_VERTICES: u32 = 1 << 20;
/// Vertices for each triangle, within these bounds.
const OF_TRIANGLE: u32 = 6;

/// Whether bounces of frames with these settings take light of vertices. With photons, lights do not reach the surfaces
/// behind refracting bodies.
pub fn in_use(settings: &Settings) -> bool {
    settings.rt_bounce_cache > 0
        && settings.rt_bounces > 0
        && is_lit(settings)
        && !photons::in_use(settings)
}

/// What the light depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Source {
    /// Serial number of the geometry.
    geometry: u64,
    samples: u32,
    light_scale: f32,
    soft_shadows: bool,
}

/// Buffers that only the frame which computes the light uses.
struct Work {
    owners: Buffer,
    sums: Buffer,
    used: Buffer,
}

/// The light of a map's vertices.
struct Made {
    source: Source,
    capacity: u32,
    grids: Buffer,
    light: Buffer,
    /// Dropped once the light is computed.
    work: Option<Work>,
    view: VertexLightView,
}

/// The light at vertices of the map, if frames use it.
#[derive(Default)]
pub struct VertexLight {
    made: Option<Made>,
}

impl VertexLight {
    /// Makes the buffers if frames need them and they are of another map or other lights; drops them otherwise.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        device: &Device,
        settings: &Settings,
        map: Option<(&StaticGeometry, &MapLights)>,
    ) -> Result<(), Error> {
        let Some((geometry, lights)) = map.filter(|_| in_use(settings)) else {
            self.made = None;
            return Ok(());
        };
        let source = Source {
            geometry: geometry.serial,
            samples: settings.rt_bounce_cache,
            light_scale: settings.rt_light_scale,
            soft_shadows: settings.rt_soft_shadows,
        };
        self.made.take_if(|made| made.source != source);
        match &mut self.made {
            Some(made) => made.work = None,
            none => *none = Some(Made::new(device, source, geometry)?),
        }
        if let Some(made) = &mut self.made {
            made.view.changing = u32::from(lights.have_changing(uses_tree(settings)));
        }
        Ok(())
    }

    /// Computes the light again: lights have changed.
    pub fn forget(&mut self) {
        self.made = None;
    }

    /// Whether bounces take the light.
    pub fn is_on(&self) -> bool {
        self.made.is_some()
    }

    /// Most vertices, and triangles that may have some.
    pub fn sizes(&self) -> [u32; 2] {
        let sizes = |made: &Made| [made.capacity, made.view.grid_count];
        self.made.as_ref().map_or([0; 2], sizes)
    }

    /// Parameters of the passes.
    pub fn view(&self) -> VertexLightView {
        self.made
            .as_ref()
            .map_or_else(VertexLightView::default, |made| made.view)
    }

    /// Records the passes that compute the light, in the first frame that uses it.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn record(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        let Some(made) = &self.made else {
            return Ok(());
        };
        let Some(work) = &made.work else {
            return Ok(());
        };
        let access = Access::TRANSFER;
        for buffer in [&made.grids, &made.light, &work.owners, &work.used] {
            let mut pass = passes.rec.pass("trace_vertices", access, access)?;
            pass.fill_buffer(buffer, 0, buffer.size(), 0);
        }
        for split in 0..=SPLITS {
            passes.run_numbered(Pass::VertexSplit, split, 0)?;
            passes.run_numbered(Pass::VertexTest, 0, t::VERTICES_TEST)?;
            passes.run_numbered(Pass::VertexGather, split, t::VERTICES_DIRECT)?;
            passes.run_numbered(Pass::VertexWrite, 0, 0)?;
        }
        for sweep in 0..FIRST_SWEEPS + AVERAGED_SWEEPS {
            let part = match sweep.cmp(&FIRST_SWEEPS) {
                Ordering::Less => t::VERTICES_RESTART | t::VERTICES_QUICK,
                Ordering::Equal => t::VERTICES_RESTART,
                Ordering::Greater => 0,
            };
            passes.run_numbered(Pass::VertexGather, sweep, part)?;
            passes.run_numbered(Pass::VertexWrite, 0, 0)?;
        }
        Ok(())
    }
}

impl Made {
    fn new(device: &Device, source: Source, geometry: &StaticGeometry) -> Result<Self, Error> {
        let [grid_count, world_count] = geometry.world_triangles;
        let capacity =
            (grid_count.saturating_mul(OF_TRIANGLE)).clamp(LEAST_VERTICES, MOST_VERTICES);
        let make = |name, count: u32, bytes: usize| {
            let desc = BufferDesc {
                name,
                size: u64::from(count.max(1)) * bytes as u64,
                usage: BufferUsage::STORAGE,
                memory: Memory::Device,
            };
            Buffer::new(device, &desc)
        };
        let grids = make("trace vertex grids", grid_count, size_of::<LightGrid>())?;
        let light = make("trace vertex light", capacity, size_of::<u32>())?;
        let work = Work {
            owners: make("trace vertex owners", capacity, size_of::<u32>())?,
            sums: make("trace vertex sums", capacity, size_of::<VertexSum>())?,
            used: make("trace vertices used", 1, size_of::<u32>())?,
        };
        let view = VertexLightView {
            triangles: geometry.triangles(),
            vertices: geometry.vertices,
            grids: grids.address(),
            light: light.address(),
            owners: work.owners.address(),
            sums: work.sums.address(),
            used: work.used.address(),
            grid_count,
            world_count,
            capacity,
            samples: source.samples,
            ..VertexLightView::default()
        };
        Ok(Self {
            source,
            capacity,
            grids,
            light,
            work: Some(work),
            view,
        })
    }
}
