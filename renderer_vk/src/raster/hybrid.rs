//! The map's surfaces at half the picture's size, from which rays of the hybrid look start, and the draws that show what
//! those rays found (`shaders/raster/hybrid.glsl`).

use std::collections::HashMap;

use shaders::constant_ids::raster::draw as id;
use shaders::types::constants as c;
use shaders::types::{Draw, HybridView};
use support::slice;

use super::list::{Call, DepthRange, DrawList};
use super::pipelines::CullFaces;
use super::shading::Shading;
use super::{EDGE_SHIFT, Uploaded, ViewParameters, viewport};
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
    let is_lit = |place: &usize| {
        let stage = slice::get(stages, draw.stages[*place] as usize);
        shading.draws(*place)
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

/// [`Shading::mirrored`] of a draw: its stages whose environment image stands for a reflection.
pub(super) fn mirroring_stages(materials: &Materials, shading: &Shading, draw: &Draw) -> u32 {
    let stages = &materials.arrays().stages;
    let mirrors = |place: &usize| {
        let stage = slice::get(stages, draw.stages[*place] as usize);
        shading.draws(*place)
            && shading.shows_environment(*place)
            && stage.is_some_and(|stage| stage.flags & c::STAGE_REFLECTION != 0)
    };
    (0..draw.stages.len())
        .filter(mirrors)
        .fold(0, |bits, place| bits | 1 << place)
}

/// Images of the surfaces, half the size of the picture.
pub struct HybridImages {
    /// Normals and depths (`hybrid_surface.frag`).
    pub surfaces: Image,
    /// The same of the nearest reflecting surfaces, if there are any.
    pub mirrors: Option<Image>,
    depth: Image,
}

impl HybridImages {
    /// Images for a picture of a size in pixels. `mirrors`: some surfaces reflect.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn new(
        device: &Device,
        [width, height]: [u32; 2],
        mirrors: bool,
    ) -> Result<Self, gpu::Error> {
        let (width, height) = (width.div_ceil(2), height.div_ceil(2));
        let image = |name, format, usage| {
            Image::new(device, &ImageDesc::new(name, width, height, format, usage))
        };
        let usage = ImageUsage::COLOR | ImageUsage::STORAGE;
        Ok(Self {
            surfaces: image("hybrid surfaces", Format::Rgba32F, usage)?,
            mirrors: match mirrors {
                true => Some(image("hybrid mirrors", Format::Rgba32F, usage)?),
                false => None,
            },
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
            mirrors: self.mirrors.as_ref().map_or(0, Image::storage_index),
            identity_light: p.identity_light,
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

/// Draws surfaces of a list to [`HybridImages`].
pub struct HybridSurfaces {
    device: Device,
    pipelines: HashMap<Key, GraphicsPipeline>,
}

/// What the pipelines of surfaces differ in.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    cull: CullFaces,
    /// The view has a clip plane.
    clip: bool,
    /// For [`HybridImages::mirrors`].
    mirror: bool,
}

/// Whether a call draws a surface of the map that stops rays.
fn is_surface(list: &DrawList, call: &Call) -> bool {
    let draw = slice::get(&list.draws, call.draw as usize);
    let stage = call.state.shading.mode == c::DRAW_STAGE && !call.state.wireframe;
    let solid = call.state.blend.is_none() && call.state.depth_write;
    let of_map = draw.is_some_and(|draw| draw.dynamic_vertices == 0);
    stage && solid && of_map && call.range == DepthRange::Normal
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
        let surfaces = |call: &Call| is_surface(list, call);
        self.draw(recorder, images, None, list, (p, uploaded), surfaces)?;
        let mirrors = images.mirrors.as_ref();
        let Some(mirrors) = mirrors.filter(|_| list.calls.iter().any(reflects)) else {
            return Ok(());
        };
        self.draw(
            recorder,
            images,
            Some(mirrors),
            list,
            (p, uploaded),
            reflects,
        )
    }

    /// Draws the calls that `shows` selects: to the surfaces, or over their depth to `mirrors`.
    fn draw(
        &mut self,
        recorder: &mut Recorder,
        images: &HybridImages,
        mirrors: Option<&Image>,
        list: &DrawList,
        (p, uploaded): (&ViewParameters<'_>, &Uploaded),
        shows: impl Fn(&Call) -> bool,
    ) -> Result<(), gpu::Error> {
        let key = |call: &Call| Key {
            cull: call.state.cull,
            clip: p.clip_plane != [0.0; 4],
            mirror: mirrors.is_some(),
        };
        for call in list.calls.iter().filter(|call| shows(call)) {
            let key = key(call);
            if !self.pipelines.contains_key(&key) {
                let made = pipeline(&self.device, images, key)?;
                self.pipelines.insert(key, made);
            }
        }
        let rendering = Rendering {
            color: Some(mirrors.unwrap_or(&images.surfaces)),
            depth: Some(&images.depth),
            clear_color: Some([0.0; 4]),
            clear_depth: mirrors.is_none().then_some(1.0),
        };
        let mut pass = recorder.drawing("hybrid surfaces", &rendering)?;
        pass.bind_index_buffer(&uploaded.index_buffer, uploaded.index_offset);
        let (mut bound, mut range, mut pushed) = (None, None, 0);
        for call in list.calls.iter().filter(|call| shows(call)) {
            let key = key(call);
            if bound != Some(key) {
                let Some(pipeline) = self.pipelines.get(&key) else {
                    continue;
                };
                pass.bind_graphics(pipeline);
                bound = Some(key);
            }
            if range != Some(call.range) {
                pass.set_viewport(&half(viewport(call.range, p)));
                range = Some(call.range);
            }
            let view = uploaded.views.of(call.range);
            if pushed != view {
                pass.push(&[view, 0]);
                pushed = view;
            }
            pass.draw_indexed(call.index_count, 1, call.first_index, 0, call.draw);
        }
        Ok(())
    }
}

/// Whether a call shows a reflection.
pub fn reflects(call: &Call) -> bool {
    call.state.shading.mirrored != 0
}

/// A viewport of a picture of half the size.
fn half(v: Viewport) -> Viewport {
    Viewport {
        x: v.x * 0.5,
        y: v.y * 0.5,
        width: v.width * 0.5,
        height: v.height * 0.5,
        ..v
    }
}

fn pipeline(
    device: &Device,
    images: &HybridImages,
    key: Key,
) -> Result<GraphicsPipeline, gpu::Error> {
    let (vertex, fragment) = if key.mirror {
        (
            &shaders::RASTER_HYBRID_SURFACE_VERT_MIRROR,
            &shaders::RASTER_HYBRID_SURFACE_FRAG_MIRROR,
        )
    } else {
        (
            &shaders::RASTER_HYBRID_SURFACE_VERT,
            &shaders::RASTER_HYBRID_SURFACE_FRAG,
        )
    };
    GraphicsPipeline::new(
        device,
        &GraphicsDesc {
            color: Some(images.surfaces.format()),
            depth: Some(images.depth.format()),
            cull: match key.cull {
                CullFaces::None => Cull::None,
                CullFaces::Clockwise => Cull::Back,
                CullFaces::CounterClockwise => Cull::Front,
            },
            constants: &[(id::CLIP, key.clip.into())],
            ..GraphicsDesc::new("hybrid surfaces", vertex, fragment)
        },
    )
}
