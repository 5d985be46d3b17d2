//! Recording of the traced look's passes for one view.

use shaders::trace_types::{
    FilterStep, PassStep,
    constants::{PHOTON_ROW, RAY_TILE, VERTEX_ROW},
};

use super::pass_set::{PassSet, Pipeline};
use super::passes::{Pass, Resource, Size, Switch, TABLE};
use crate::gpu::{Access, Error, Recorder};

/// Facts about a view that select sizes and variants of its passes.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameFacts {
    /// Traced size, pixels.
    pub traced: [u32; 2],
    /// Size of the finished picture, pixels.
    pub output: [u32; 2],
    /// Cells of the light in fog; 0 where the view has none.
    pub fog_cells: [u32; 2],
    /// Number of flares.
    pub flares: u32,
    /// Number of photons; 0 where none are traced.
    pub photons: u32,
    /// One of 2 × 2 pixels gathers bounced and specular light.
    pub subsampled: bool,
    /// The map has fog.
    pub map_fog: bool,
    /// There is bounced light.
    pub bounces: bool,
    /// Materials are rough or have normal maps.
    pub gloss: bool,
    /// Heights of normal maps move textures.
    pub heights: bool,
    /// The time of pixels is measured.
    pub timed: bool,
    /// Random numbers of light are blue noise over the picture.
    pub blue_noise: bool,
    /// Bounces may hit the last frame's picture.
    pub screen: bool,
    /// Only some cells gather bounced light.
    pub adaptive: bool,
    /// Paths may end where they have found light.
    pub roulette: bool,
    /// Lights are drawn from a tree.
    pub light_tree: bool,
    /// The other eye's light is known.
    pub shared_eyes: bool,
    /// The last bounce adds light of further ones.
    pub ambient: bool,
    /// Pixels without history have more samples.
    pub more_samples: bool,
    /// The maximum of the colour range of antialiasing is smoothed over time.
    pub smooth_maximum: bool,
    /// Rays count the bodies that they meet.
    pub feedback: bool,
    /// Bounces take the light of vertices.
    pub vertex_light: bool,
    /// Most vertices, and triangles that may have some.
    pub vertices: [u32; 2],
    /// Scattered rays do not test the alpha of cut-outs.
    pub cut_outs: bool,
}

impl FrameFacts {
    fn is_on(&self, switch: Switch) -> bool {
        match switch {
            Switch::LitFog => self.fog_cells != [0; 2],
            Switch::MapFog => self.map_fog,
            Switch::Bounces => self.bounces,
            Switch::Gloss => self.gloss,
            Switch::Heights => self.heights,
            Switch::ScreenHits => self.screen,
            Switch::Adaptive => self.adaptive,
            Switch::Roulette => self.roulette,
            Switch::Caustics => self.photons > 0,
            Switch::Timed => self.timed,
            Switch::BlueNoise => self.blue_noise,
            Switch::LightTree => self.light_tree,
            Switch::SharedEyes => self.shared_eyes,
            Switch::Ambient => self.ambient,
            Switch::MoreSamples => self.more_samples,
            Switch::SmoothMaximum => self.smooth_maximum,
            Switch::Feedback => self.feedback,
            Switch::VertexLight => self.vertex_light,
            Switch::CutOuts => self.cut_outs,
        }
    }

    /// Invocations along both axes; [`Size::RayTiles`] is laid out as `pipeline` requires.
    fn invocations(&self, size: Size, pipeline: &Pipeline) -> [u32; 2] {
        let (traced, output) = (self.traced, self.output);
        match size {
            Size::Traced => traced,
            Size::RayTiles => ray_tiles(traced, pipeline),
            Size::Cells => traced.map(|n| n.div_ceil(2)),
            Size::Strata => traced.map(|n| n.div_ceil(3)),
            Size::FogCells => self.fog_cells,
            Size::Flares => [self.flares, 1],
            Size::Photons => [PHOTON_ROW, self.photons.div_ceil(PHOTON_ROW)],
            Size::Vertices => [VERTEX_ROW, self.vertices[0].div_ceil(VERTEX_ROW)],
            Size::VertexTriangles => [VERTEX_ROW, self.vertices[1].div_ceil(VERTEX_ROW)],
            Size::Output => output,
            Size::OutputHalf => output.map(|n| n.div_ceil(2)),
            Size::OutputQuarter => output.map(|n| n.div_ceil(4)),
            Size::Group => [1, 1],
        }
    }
}

/// One invocation for each slot of all tiles: in one row, or with the work groups of a tile adjacent.
fn ray_tiles(traced: [u32; 2], pipeline: &Pipeline) -> [u32; 2] {
    let [across, down] = traced.map(|n| n.div_ceil(RAY_TILE));
    match pipeline {
        Pipeline::Rays(_) => [across * down * RAY_TILE * RAY_TILE, 1],
        Pipeline::Compute(pipeline) => {
            let [x, y, _] = pipeline.local_size();
            let groups = RAY_TILE * RAY_TILE / (x * y);
            [across * groups * x, down * y]
        }
    }
}

/// Records the passes of a view.
pub struct FramePasses<'a> {
    set: &'a PassSet,
    /// Recorder of the commands.
    pub rec: &'a mut Recorder,
    view: u64,
    /// Sizes and variants.
    pub facts: FrameFacts,
    written: Written,
}

impl<'a> FramePasses<'a> {
    /// A list of passes that records to `rec`; `view`: device address of the `TraceView`.
    pub fn new(set: &'a PassSet, rec: &'a mut Recorder, view: u64, facts: FrameFacts) -> Self {
        let mut written = Written::default();
        written.add(&[Resource::Scene, Resource::Lights]);
        Self {
            set,
            rec,
            view,
            facts,
            written,
        }
    }

    /// Device address of the `TraceView`.
    pub fn view(&self) -> u64 {
        self.view
    }

    /// Records a pass.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses the pipeline.
    pub fn run(&mut self, pass: Pass) -> Result<(), Error> {
        self.run_numbered(pass, 0, 0)
    }

    /// Records run `number` of a pass that has several, for the pixel `part` of each cell where they take turns.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses the pipeline.
    pub fn run_numbered(&mut self, pass: Pass, number: u32, part: u32) -> Result<(), Error> {
        let step = PassStep {
            view: self.view,
            number,
            part,
        };
        self.record(pass, &step)
    }

    /// Records a filter step from `source` to `target`, addresses of texels or indices of images; `spacing`: distance
    /// of its taps, pixels.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses the pipeline.
    pub fn run_step(
        &mut self,
        pass: Pass,
        source: u64,
        target: u64,
        spacing: u32,
    ) -> Result<(), Error> {
        let step = FilterStep {
            view: self.view,
            source,
            target,
            spacing,
            padding: 0,
        };
        self.record(pass, &step)
    }

    /// Marks a resource as written by commands outside of the table of passes.
    pub fn wrote(&mut self, resource: Resource) {
        self.written.add(&[resource]);
    }

    /// Records a pass with its push constants.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses the pipeline.
    pub fn record<T: bytemuck::Pod>(&mut self, pass: Pass, push: &T) -> Result<(), Error> {
        let row = pass.row();
        if cfg!(debug_assertions) {
            let missing = self.written.first_missing(row.reads);
            debug_assert_eq!(missing, None, "not written before {pass:?} reads it");
            self.written.add(row.writes);
        }
        let switches = row.switches.iter().zip(0..);
        let on = switches.fold(0, |bits, ((_, switch), bit)| {
            bits | usize::from(self.facts.is_on(*switch)) << bit
        });
        let pipeline = self.set.get(pass, on)?;
        let [x, y] = self.facts.invocations(row.size, pipeline);
        match pipeline {
            Pipeline::Rays(pipeline) => {
                let access = Access::RAY_TRACING;
                let mut recorded = self.rec.pass(row.name, access, access)?;
                recorded.bind_rays(pipeline);
                recorded.push(push);
                recorded.trace_rays(x, y, 1);
            }
            Pipeline::Compute(pipeline) => {
                let mut recorded = self.rec.pass(row.name, Access::COMPUTE, Access::COMPUTE)?;
                recorded.bind_compute(pipeline);
                recorded.push(push);
                recorded.dispatch_invocations(x, y);
            }
        }
        Ok(())
    }
}

/// Bit mask of the resources that this frame has written.
#[derive(Clone, Copy, Debug, Default)]
struct Written(u64);

impl Written {
    fn add(&mut self, resources: &[Resource]) {
        for &resource in resources {
            self.0 &= !sharing(resource);
            self.0 |= 1 << resource as u32;
        }
    }

    fn first_missing(self, resources: &[Resource]) -> Option<Resource> {
        let missing = |r: &&Resource| self.0 >> **r as u32 & 1 == 0;
        resources.iter().find(missing).copied()
    }
}

/// Bit mask of the resources that share memory with one.
fn sharing(resource: Resource) -> u64 {
    let all = TABLE.iter().flat_map(|row| row.writes);
    all.filter(|other| other.memory() == resource.memory())
        .fold(0, |bits, other| bits | 1 << *other as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writing_shared_memory_destroys_what_was_there() {
        let mut written = Written::default();
        let (hits, sampled) = (Resource::PrimaryHits, Resource::SampledLights);
        written.add(&[hits, Resource::GBuffer]);
        assert_eq!(written.first_missing(&[hits, Resource::GBuffer]), None);
        written.add(&[sampled]);
        assert_eq!(written.first_missing(&[sampled, Resource::GBuffer]), None);
        assert_eq!(written.first_missing(&[sampled, hits]), Some(hits));
    }
}
