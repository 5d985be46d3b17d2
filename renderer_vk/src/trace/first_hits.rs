//! First hits of the camera's rays by the rasterizer (`rt_firstHits`): the draws of all geometry that these rays may hit,
//! to an image of geometries and triangles (a visibility buffer: Burns and Hunt, The Visibility Buffer, JCGT 2013).

use glam::{DMat3, Vec3};
use shaders::trace_types::constants::{MASK_FIRST_SOLID, MASK_NO_SHADOW, MASK_SKY, MASK_SOLID};
use shaders::trace_types::{AntialiasView, CameraView, FirstHitsStep, TraceView};

use super::accel::DrawnGeometry;
use super::frame_passes::FramePasses;
use super::geometry::StaticGeometry;
use super::input::Kind;
use super::passes::{Pass, Resource};
use crate::gpu::{
    Buffer, BufferUsage, DepthTest, Device, Error, Format, GraphicsDesc, GraphicsPipeline, Image,
    ImageDesc, ImageUsage, Rendering,
};
use crate::settings::Settings;

/// Format of the depth, which falls with the distance: floats have the same relative precision at all distances.
const DEPTH: Format = Format::D32F;

/// Whether frames with these settings may take first hits of the rasterizer. It has one eye, and one place for the samples
/// of all pixels: not with a lens, nor where each pixel draws its own place.
pub fn in_use(settings: &Settings) -> bool {
    settings.rt_first_hits
        && !settings.rt_dof
        && !(settings.rt_accumulate && settings.rt_antialiasing)
}

/// What the draws need, while they are in use.
struct Made {
    size: [u32; 2],
    /// `Rg32Uint`: index of the geometry plus 1, triangle.
    hits: Image,
    depth: Image,
    /// For triangles that stop every ray, and for those that a ray may pass.
    pipelines: [GraphicsPipeline; 2],
    map: Option<MapPositions>,
}

/// Positions of a map's vertices.
struct MapPositions {
    /// Serial number of its geometry.
    serial: u64,
    /// Address of the vertices.
    vertices: u64,
    positions: Buffer,
}

impl Made {
    fn new(device: &Device, size: [u32; 2]) -> Result<Self, Error> {
        let [width, height] = size;
        let image = |name, format, usage| {
            Image::new(device, &ImageDesc::new(name, width, height, format, usage))
        };
        let pipeline = |fragment| {
            let desc = GraphicsDesc {
                color: Some(Format::Rg32Uint),
                depth: Some(DEPTH),
                depth_test: DepthTest::GreaterEqual,
                ..GraphicsDesc::new(
                    "trace first hits",
                    &shaders::TRACE_FIRST_HITS_VERT,
                    fragment,
                )
            };
            GraphicsPipeline::new(device, &desc)
        };
        Ok(Self {
            size,
            hits: image(
                "trace first hits",
                Format::Rg32Uint,
                ImageUsage::COLOR | ImageUsage::STORAGE,
            )?,
            depth: image("trace first depth", DEPTH, ImageUsage::DEPTH)?,
            pipelines: [
                pipeline(&shaders::TRACE_FIRST_HITS_FRAG)?,
                pipeline(&shaders::TRACE_FIRST_HITS_FRAG_TESTED)?,
            ],
            map: None,
        })
    }

    /// Uploads the positions of a map unless that is done.
    fn place(&mut self, device: &Device, geometry: Option<&StaticGeometry>) -> Result<(), Error> {
        let serial = geometry.map(|geometry| geometry.serial);
        self.map.take_if(|map| Some(map.serial) != serial);
        if let Some(geometry) = geometry.filter(|_| self.map.is_none()) {
            let (name, usage) = ("trace first positions", BufferUsage::STORAGE);
            self.map = Some(MapPositions {
                serial: geometry.serial,
                vertices: geometry.vertices,
                positions: Buffer::with_data(device, name, usage, &geometry.positions)?,
            });
        }
        Ok(())
    }
}

/// Draws the first hits of a view.
#[derive(Default)]
pub struct FirstHits(Option<Made>);

impl FirstHits {
    /// Makes or drops what the draws need. `geometry`: the map, if the view shows it.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn prepare(
        &mut self,
        device: &Device,
        settings: &Settings,
        size: [u32; 2],
        geometry: Option<&StaticGeometry>,
    ) -> Result<(), Error> {
        let on = in_use(settings) && device.draws_to(Format::Rg32Uint) && device.draws_to(DEPTH);
        self.0.take_if(|made| !on || made.size != size);
        if on && self.0.is_none() {
            self.0 = Some(Made::new(device, size)?);
        }
        self.0
            .as_mut()
            .map_or(Ok(()), |made| made.place(device, geometry))
    }

    /// Whether [`record`](Self::record) finds the first hits of this frame.
    pub fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// Draws the geometry of a view, and writes the first hits.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn record(
        &self,
        passes: &mut FramePasses<'_>,
        drawn: &[DrawnGeometry],
        view: &TraceView,
    ) -> Result<(), Error> {
        let Some(made) = &self.0 else {
            return Ok(());
        };
        let step = FirstHitsStep {
            view: passes.view(),
            map_vertices: made.map.as_ref().map_or(0, |map| map.vertices),
            positions: (made.map.as_ref()).map_or(0, |map| map.positions.address()),
            to_picture: to_picture(&view.camera, &view.antialias, made.size),
            image: made.hits.storage_index(),
            ..FirstHitsStep::default()
        };
        made.draw(passes, drawn, &step)?;
        passes.wrote(Resource::DrawnHits);
        passes.record(Pass::FirstHits, &step)
    }
}

impl Made {
    fn draw(
        &self,
        passes: &mut FramePasses<'_>,
        drawn: &[DrawnGeometry],
        step: &FirstHitsStep,
    ) -> Result<(), Error> {
        let rendering = Rendering {
            color: Some(&self.hits),
            depth: Some(&self.depth),
            clear_color: Some([0.0; 4]),
            clear_depth: Some(0.0),
        };
        let mut pass = passes.rec.drawing("trace_first_draws", &rendering)?;
        let [width, height] = self
            .size
            .map(|side| i32::try_from(side).unwrap_or(i32::MAX));
        // the weapon is in front of everything that it intersects
        for first_person in [false, true] {
            let mask = match first_person {
                false => MASK_SOLID | MASK_SKY | MASK_NO_SHADOW,
                true => MASK_FIRST_SOLID,
            };
            let met =
                |draw: &&DrawnGeometry| draw.mask & mask != 0 && draw.kind != Kind::Translucent;
            if !drawn.iter().any(|draw| met(&draw)) {
                continue;
            }
            if first_person {
                pass.clear_depth_rect([0, 0, width, height], 0.0);
            }
            for (pipeline, untested) in self.pipelines.iter().zip([true, false]) {
                pass.bind_graphics(pipeline);
                pass.push(&FirstHitsStep {
                    first_person: first_person.into(),
                    ..*step
                });
                let of_kind = |draw: &&DrawnGeometry| draw.kind.is_untested() == untested;
                for draw in drawn.iter().filter(met).filter(of_kind) {
                    pass.draw(draw.triangles.saturating_mul(3), 1, 0, draw.record);
                }
            }
        }
        Ok(())
    }
}

/// [`FirstHitsStep::to_picture`]: the inverse of `camera_ray` (`shaders/trace/camera.glsl`), so that the middle of a pixel
/// is the place of its ray.
fn to_picture(camera: &CameraView, antialias: &AntialiasView, size: [u32; 2]) -> [Vec3; 3] {
    let columns = [camera.forward, -camera.left, -camera.up].map(Vec3::as_dvec3);
    let rows = DMat3::from_cols(columns[0], columns[1], columns[2])
        .inverse()
        .transpose();
    let [jitter_x, jitter_y] = antialias.jitter.into();
    let shift = |jitter: f32, side: u32| 2.0 * f64::from(jitter) / f64::from(side.max(1));
    let aside = shift(jitter_x, size[0]) + f64::from(camera.stereo_shift);
    let across = rows.y_axis - rows.x_axis * aside;
    let down = rows.z_axis - rows.x_axis * shift(jitter_y, size[1]);
    [across, down, rows.x_axis].map(|row| row.as_vec3())
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    #[test]
    fn the_place_of_a_pixel_s_ray_is_its_middle() {
        let camera = CameraView {
            forward: Vec3::new(0.6, 0.0, -0.8),
            left: Vec3::new(0.0, 1.5, 0.0),
            up: Vec3::new(0.8, 0.0, 0.6) * 0.7,
            stereo_shift: 0.02,
            ..CameraView::default()
        };
        let antialias = AntialiasView {
            jitter: Vec2::new(0.31, -0.42),
            ..AntialiasView::default()
        };
        let size = [40, 30];
        let rows = to_picture(&camera, &antialias, size);
        for pixel in [Vec2::ZERO, Vec2::new(39.0, 29.0), Vec2::new(7.0, 21.0)] {
            let sides = Vec2::new(40.0, 30.0);
            // as in camera_ray
            let mut at = (pixel + 0.5 + antialias.jitter) / sides * 2.0 - 1.0;
            at.x += camera.stereo_shift;
            let point = (camera.forward - camera.left * at.x - camera.up * at.y) * 500.0;
            let [x, y, depth] = rows.map(|row| row.dot(point));
            let place = (Vec2::new(x, y) / depth + 1.0) * 0.5 * sides;
            assert!((place - (pixel + 0.5)).length() < 1e-4, "{pixel} {place}");
            assert!((depth - 500.0).abs() < 0.01);
        }
    }
}
