//! The map's surfaces at half the picture's size, from which rays of the hybrid look start, and the draws that show what
//! those rays found (`shaders/raster/hybrid.glsl`).

use std::collections::HashMap;

use shaders::constant_ids::raster::draw as id;
use shaders::types::constants as c;
use shaders::types::{Draw, HybridView};
use support::slice;

use super::list::{DepthRange, DrawList};
use super::pipelines::CullFaces;
use super::shading::Shading;
use super::{EDGE_SHIFT, Uploaded, ViewParameters};
use crate::assets::Materials;
use crate::gpu::{
    self, Cull, Device, Format, GraphicsDesc, GraphicsPipeline, Image, ImageDesc, ImageUsage,
    Recorder, Rendering, Viewport,
};

/// [`Shading::shadowed`] of a dynamic light.
pub(super) const DYNAMIC_LIGHT: u32 = 1 << 4;

/// [`Shading::shadowed`] of a draw of the map: its stages that show baked light, which are the lightmap, or vertex colours
/// on surfaces without one.
pub(super) fn lit_stages(
    materials: &Materials,
    shading: &Shading,
    draw: &Draw,
    lightmap: u32,
) -> u32 {
    let stages = &materials.arrays().stages;
    let drawn = |place: usize| place == 0 || shading.combines(place);
    let is_lit = |place: &usize| {
        let stage = slice::get(stages, draw.stages[*place] as usize);
        drawn(*place)
            && stage.is_some_and(|stage| match lightmap {
                c::NO_TEXTURE => {
                    [c::RGBGEN_VERTEX, c::RGBGEN_EXACT_VERTEX].contains(&stage.rgb_gen)
                }
                _ => stage.image_count == 0 && stage.flags & c::STAGE_WHITE == 0,
            })
    };
    (0..draw.stages.len())
        .filter(is_lit)
        .fold(0, |bits, place| bits | 1 << place)
}

/// Images of the surfaces, half the size of the picture.
pub struct HybridImages {
    /// Normals and depths (`hybrid_surface.frag`).
    pub surfaces: Image,
    depth: Image,
}

impl HybridImages {
    /// Images for a picture of a size in pixels.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn new(device: &Device, width: u32, height: u32) -> Result<Self, gpu::Error> {
        let (width, height) = (width.div_ceil(2), height.div_ceil(2));
        let image = |name, format, usage| {
            Image::new(device, &ImageDesc::new(name, width, height, format, usage))
        };
        let usage = ImageUsage::COLOR | ImageUsage::STORAGE;
        Ok(Self {
            surfaces: image("hybrid surfaces", Format::Rgba32F, usage)?,
            depth: image(
                "hybrid depth",
                device.depth_format(false),
                ImageUsage::DEPTH,
            )?,
        })
    }

    /// The parts of a [`HybridView`] that depend on size and camera.
    pub fn view(&self, p: &ViewParameters<'_>) -> HybridView {
        let [x, y, width, height] = p.viewport.map(f64::from);
        let inverse = p.world_to_clip.as_dmat4().inverse();
        let eye = inverse * glam::DVec4::Z;
        let eye = eye.truncate() / eye.w;
        // the point of a texel of this image at depth 1 of clip space, relative to the eye
        let ray = |texel_x: f64, texel_y: f64| {
            let at_x = ((texel_x + 0.5) * 2.0 - x) / width.max(1.0) * 2.0 - 1.0;
            let at_y =
                ((texel_y + 0.5) * 2.0 - y - f64::from(EDGE_SHIFT)) / height.max(1.0) * 2.0 - 1.0;
            let point = inverse * glam::DVec4::new(at_x, at_y, 0.0, 1.0);
            point.truncate() - eye * point.w
        };
        let corner = ray(0.0, 0.0);
        HybridView {
            surfaces: self.surfaces.storage_index(),
            width: self.surfaces.width(),
            height: self.surfaces.height(),
            eye: eye.as_vec3(),
            corner: corner.as_vec3(),
            right: (ray(1.0, 0.0) - corner).as_vec3(),
            down: (ray(0.0, 1.0) - corner).as_vec3(),
            ..HybridView::default()
        }
    }
}

/// Draws the map's surfaces of a list to [`HybridImages`].
pub struct HybridSurfaces {
    device: Device,
    /// By culling, and whether the view has a clip plane.
    pipelines: HashMap<(CullFaces, bool), GraphicsPipeline>,
}

impl HybridSurfaces {
    /// Pipelines are made at first use.
    pub fn new(device: &Device) -> Self {
        Self {
            device: device.clone(),
            pipelines: HashMap::new(),
        }
    }

    /// Records the surfaces of an uploaded list.
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn record(
        &mut self,
        recorder: &mut Recorder,
        images: &HybridImages,
        list: &DrawList,
        p: &ViewParameters<'_>,
        uploaded: &Uploaded,
    ) -> Result<(), gpu::Error> {
        let clip = p.clip_plane != [0.0; 4];
        let shows = |call: &&super::list::Call| {
            let own = slice::get(&list.draws, call.draw as usize);
            let stage = call.state.shading.mode == c::DRAW_STAGE && !call.state.wireframe;
            let solid = call.state.blend.is_none() && call.state.depth_write;
            let of_map = own.is_some_and(|draw| draw.dynamic_vertices == 0);
            stage && solid && of_map && call.range == DepthRange::Normal
        };
        for call in list.calls.iter().filter(shows) {
            let key = (call.state.cull, clip);
            if !self.pipelines.contains_key(&key) {
                let made = pipeline(&self.device, images, key)?;
                self.pipelines.insert(key, made);
            }
        }
        let rendering = Rendering {
            color: Some(&images.surfaces),
            depth: Some(&images.depth),
            clear_color: Some([0.0; 4]),
            clear_depth: Some(1.0),
        };
        let mut pass = recorder.drawing("hybrid surfaces", &rendering)?;
        let [x, y, width, height] = p.viewport.map(|v| v as f32 * 0.5);
        pass.set_viewport(&Viewport {
            x,
            y: y + EDGE_SHIFT * 0.5,
            width,
            height,
            min_depth: 0.0,
            max_depth: 1.0,
        });
        pass.bind_index_buffer(&uploaded.index_buffer, uploaded.index_offset);
        let mut bound = None;
        for call in list.calls.iter().filter(shows) {
            let key = (call.state.cull, clip);
            if bound != Some(key) {
                let Some(pipeline) = self.pipelines.get(&key) else {
                    continue;
                };
                pass.bind_graphics(pipeline);
                pass.push(&[uploaded.views.all, 0]);
                bound = Some(key);
            }
            pass.draw_indexed(call.index_count, 1, call.first_index, 0, call.draw);
        }
        Ok(())
    }
}

fn pipeline(
    device: &Device,
    images: &HybridImages,
    (cull, clip): (CullFaces, bool),
) -> Result<GraphicsPipeline, gpu::Error> {
    GraphicsPipeline::new(
        device,
        &GraphicsDesc {
            color: Some(images.surfaces.format()),
            depth: Some(images.depth.format()),
            cull: match cull {
                CullFaces::None => Cull::None,
                CullFaces::Clockwise => Cull::Back,
                CullFaces::CounterClockwise => Cull::Front,
            },
            constants: &[(id::CLIP, clip.into())],
            ..GraphicsDesc::new(
                "hybrid surfaces",
                &shaders::RASTER_HYBRID_SURFACE_VERT,
                &shaders::RASTER_HYBRID_SURFACE_FRAG,
            )
        },
    )
}
