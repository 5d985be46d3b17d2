//! The classic look: multi-stage materials with lightmaps, as the engine's renderer draws them. Also draws the 2D
//! overlay of both looks.
//!
//! Colours are display-encoded throughout: the target is RGBA8 without conversion, and stages blend in that encoding,
//! as in the engine.

mod aids;
mod cover;
mod depth_first;
mod expected;
mod flares;
mod groups;
mod hybrid;
mod light_reach;
mod list;
mod overdraw;
mod overlay;
mod passes;
mod per_stage;
mod pipelines;
mod present;
mod shading;
mod shadows;
pub(crate) mod sky;
mod surface_mapping;
mod target;
mod ui;

use std::collections::HashSet;

use glam::{Mat4, Vec3};
use shaders::types::{Instance, MaterialBuffers, RasterLight, RasterView};

pub use aids::{Aids, image_sheet};
pub use expected::{ExpectedWorld, expected_instance};
pub use flares::{FlareTest, Flares, window_to_clip};
pub use hybrid::{HybridImages, HybridSurfaces, reflects};
pub use list::{DrawList, Statics};
pub use overlay::{Overlay, Picture2d, overlay_instance};
pub use present::{Display, Present};
pub use shading::{PixelLights, StageContext};
pub use surface_mapping::SurfaceMapping;
pub use target::Target;
pub use ui::{UiMeshes, UiTextures};

use crate::api::DynamicLight;
use crate::gpu::{
    self, Buffer, Device, Format, Image, ImageDesc, ImageUsage, Pass, Recorder, Rendering, Viewport,
};
use crate::scene::{ShadowVolumes, View};
use cover::Cover;
use list::DepthRange;
use overdraw::Overdraw;
use pipelines::{Pipelines, State};
use shadows::Shadows;
use target::TargetKind;

/// Format of the frame's colour image, unless the window shows it unchanged: then it has the window's format.
pub const COLOR_FORMAT: Format = Format::Rgba8;

/// Format of the frame's colour image for a window that shows more than white: display values, 1 is white.
pub const WIDE_FORMAT: Format = Format::Rgba16F;

/// Downward shift of 3D views, pixels: one step of the subpixel grid of 1/256. An edge may run through pixel centres,
/// as under level cameras. In OpenGL, whose rows count from the bottom, such pixels belong to the triangle above the
/// edge, in Vulkan to the one below. The shift restores the former.
const EDGE_SHIFT: f32 = 1.0 / 256.0;

/// Parameters of a draw list.
pub struct ViewParameters<'a> {
    /// World to clip space.
    pub world_to_clip: Mat4,
    /// World to clip space of [`DepthRange::Near`], if different.
    pub near_world_to_clip: Option<Mat4>,
    /// Draws only the positive side of `xyz.p = w`; zero: both sides.
    pub clip_plane: [f32; 4],
    /// Camera position, world space.
    pub origin: Vec3,
    /// View direction.
    pub forward: Vec3,
    /// See [`RasterView::identity_light`].
    pub identity_light: f32,
    /// Materials.
    pub materials: MaterialBuffers,
    /// Address of the world's vertices, or 0.
    pub static_vertices: u64,
    /// Address of the tangents and light directions of the world's vertices ([`shaders::types::MappedVertex`]), or 0.
    pub mapped_vertices: u64,
    /// Address of the moving vertices; `None`: those of the list.
    pub dynamic_vertices: Option<u64>,
    /// Address of the fog volumes, or 0.
    pub fogs: u64,
    /// Instances of the view.
    pub instances: &'a [Instance],
    /// Dynamic lights.
    pub lights: &'a [DynamicLight],
    /// Lights also reach surfaces that face away.
    pub light_backs: bool,
    /// Left, top, width and height, pixels.
    pub viewport: [i32; 4],
    /// The part of the viewport that is drawn, if not all of it.
    pub part: Option<[i32; 4]>,
    /// Clears depth first (3D views; not the overlay).
    pub clear_depth: bool,
    /// Colour that clears the viewport first.
    pub clear_color: Option<[f32; 4]>,
    /// Shadow volumes with their view; ignored if the depth image has no stencil.
    pub shadows: Option<(&'a ShadowVolumes, &'a View)>,
}

/// A draw list with its view in the frame's memory.
pub struct Uploaded {
    views: ViewAddresses,
    index_buffer: Buffer,
    index_offset: u64,
    /// Address of the [`HybridView`](shaders::types::HybridView) that draws read; 0: none does.
    pub hybrid: u64,
}

/// Device addresses of the `RasterView`s of a view.
#[derive(Clone, Copy)]
struct ViewAddresses {
    /// For all depth ranges but [`DepthRange::Near`].
    all: u64,
    /// For [`DepthRange::Near`].
    near: u64,
}

impl ViewAddresses {
    /// Address for a depth range.
    fn of(self, range: DepthRange) -> u64 {
        match range {
            DepthRange::Near => self.near,
            _ => self.all,
        }
    }
}

/// Draws [`DrawList`]s.
pub struct Raster {
    device: Device,
    pipelines: Pipelines,
    shadows: Shadows,
    cover: Cover,
    overdraw: Overdraw,
    /// Buffer for the upload of the view's dynamic lights.
    lights: Vec<RasterLight>,
}

impl Raster {
    /// Creates the shared objects; pipelines are created at first use.
    pub fn new(device: &Device) -> Self {
        Self {
            device: device.clone(),
            pipelines: Pipelines::new(device, (-1.0, -2.0)),
            shadows: Shadows::default(),
            cover: Cover::default(),
            overdraw: Overdraw::default(),
            lights: Vec::new(),
        }
    }

    /// Whether the device can draw edges of triangles.
    pub fn draws_edges(&self) -> bool {
        self.device.info().wireframe
    }

    /// Sets the depth offset of decals.
    pub fn set_offset(&mut self, factor: f32, units: f32) {
        self.pipelines.set_offset((factor, units));
    }

    /// Begins a frame. `measure`: counts fragments (`r_measureOverdraw`).
    ///
    /// # Errors
    /// Out of memory.
    pub fn begin_frame(
        &mut self,
        recorder: &mut Recorder,
        measure: bool,
    ) -> Result<(), gpu::Error> {
        self.overdraw.begin(recorder, measure)
    }

    /// Number of fragments of the newest finished frame that was measured.
    pub fn fragments(&self) -> u32 {
        self.overdraw.fragments()
    }

    /// Drops pipelines that no call of the lists uses. Draws calls with new states to an image of one pixel, so that
    /// the driver compiles all it needs before the first frame that draws them. Waits for completion.
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn warm_up(
        &mut self,
        target: TargetKind,
        list: &mut DrawList,
        p: &ViewParameters<'_>,
    ) -> Result<(), gpu::Error> {
        let expected: HashSet<State> = list.calls.iter().map(|call| call.state).collect();
        self.pipelines.keep(&expected);
        let mut seen = HashSet::new();
        list.calls
            .retain(|call| !self.pipelines.is_made(target, call.state) && seen.insert(call.state));
        if list.calls.is_empty() {
            return Ok(());
        }
        let image = |format, usage| {
            let desc = ImageDesc {
                samples: target.samples,
                ..ImageDesc::new("warm-up", 1, 1, format, usage)
            };
            Image::new(&self.device, &desc)
        };
        let color = image(target.color, ImageUsage::COLOR)?;
        let depth = image(target.depth, ImageUsage::DEPTH)?;
        let target = Target {
            color: &color,
            depth: &depth,
            mask: target.mask,
        };
        let device = self.device.clone();
        device.immediate(|recorder| self.record(recorder, "warm-up", target, list, p))
    }

    /// Records a draw list as a pass called `name`.
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn record(
        &mut self,
        recorder: &mut Recorder,
        name: &str,
        target: Target<'_>,
        list: &DrawList,
        p: &ViewParameters<'_>,
    ) -> Result<(), gpu::Error> {
        let uploaded = self.upload(recorder, list, p)?;
        self.record_uploaded(recorder, name, target, list, p, &uploaded)
    }

    /// Uploads a draw list and its view.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn upload(
        &mut self,
        recorder: &mut Recorder,
        list: &DrawList,
        p: &ViewParameters<'_>,
    ) -> Result<Uploaded, gpu::Error> {
        let views = self.upload_view(recorder, list, p)?;
        let (index_buffer, index_offset) = recorder.arena().push_indices(&list.indices)?;
        Ok(Uploaded {
            views,
            index_buffer,
            index_offset,
            hybrid: 0,
        })
    }

    /// Records an uploaded draw list as a pass called `name`.
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn record_uploaded(
        &mut self,
        recorder: &mut Recorder,
        name: &str,
        target: Target<'_>,
        list: &DrawList,
        p: &ViewParameters<'_>,
        uploaded: &Uploaded,
    ) -> Result<(), gpu::Error> {
        let kind = TargetKind {
            counted: self.overdraw.address() != 0,
            ..target.kind()
        };
        for call in &list.calls {
            self.pipelines.prepare(kind, call.state)?;
        }
        let shadows = match p.shadows {
            Some((volumes, view)) if kind.depth.has_stencil() && !volumes.ranges.is_empty() => {
                let prepared = self
                    .shadows
                    .prepare(recorder, &self.device, kind, volumes)?;
                Some((prepared, volumes, view))
            }
            _ => None,
        };

        let rendering = Rendering {
            color: Some(target.color),
            depth: Some(target.depth),
            clear_color: None,
            clear_depth: None,
        };
        let [x, y, width, height] = clip_to(p.part.unwrap_or(p.viewport), target.color);
        if width == 0 || height == 0 {
            return Ok(());
        }
        // No later view reads this depth, so a new rendering may clear the whole image. Mesa's software driver would
        // treat the clear as a pass of its own and start its threads for it.
        let begins = !recorder.goes_on(&rendering) && !self.device.info().software;
        let cover_depth = p.clear_depth && !begins;
        if cover_depth {
            self.cover.prepare(&self.device, kind, cover::Kind::Depth)?;
        }
        if p.clear_color.is_some() {
            self.cover.prepare(&self.device, kind, cover::Kind::Color)?;
        }
        let rendering = Rendering {
            clear_depth: (p.clear_depth && begins).then_some(1.0),
            ..rendering
        };
        let mut pass = recorder.drawing(name, &rendering)?;
        pass.set_scissor(x, y, width as u32, height as u32);
        if let Some(color) = p.clear_color {
            self.cover.color(&mut pass, kind, color);
        }
        if cover_depth {
            self.cover.depth(&mut pass, kind, 1.0);
        }
        if shadows.is_some() {
            pass.clear_stencil_rect([x, y, width, height]);
        }
        pass.bind_index_buffer(&uploaded.index_buffer, uploaded.index_offset);
        self.draw_calls(&mut pass, kind, list, p, uploaded);
        if let Some((prepared, volumes, view)) = &shadows {
            self.shadows.draw(&mut pass, kind, prepared, volumes, view);
        }
        Ok(())
    }

    /// Uploads the data of a view and of its list.
    fn upload_view(
        &mut self,
        recorder: &mut Recorder,
        list: &DrawList,
        p: &ViewParameters<'_>,
    ) -> Result<ViewAddresses, gpu::Error> {
        self.lights.clear();
        self.lights.extend(p.lights.iter().map(raster_light));
        let arena = recorder.arena();
        let view = RasterView {
            world_to_clip: p.world_to_clip.to_cols_array_2d(),
            clip_plane: p.clip_plane,
            origin: p.origin,
            forward: p.forward,
            identity_light: p.identity_light,
            light_backs: p.light_backs.into(),
            materials: p.materials,
            static_vertices: p.static_vertices,
            mapped_vertices: p.mapped_vertices,
            dynamic_vertices: match p.dynamic_vertices {
                Some(address) => address,
                None => arena.push(&list.vertices)?,
            },
            instances: arena.push(p.instances)?,
            draws: arena.push(&list.draws)?,
            fogs: p.fogs,
            lights: arena.push(&self.lights)?,
        };
        let near = match p.near_world_to_clip {
            Some(matrix) => Some(arena.push(&[RasterView {
                world_to_clip: matrix.to_cols_array_2d(),
                ..view
            }])?),
            None => None,
        };
        let all = arena.push(&[view])?;
        Ok(ViewAddresses {
            all,
            near: near.unwrap_or(all),
        })
    }

    /// Records the calls of a list, whose pipelines exist, with state changes between them.
    fn draw_calls(
        &self,
        pass: &mut Pass<'_>,
        kind: TargetKind,
        list: &DrawList,
        p: &ViewParameters<'_>,
        uploaded: &Uploaded,
    ) {
        let views = uploaded.views;
        let overdraw = self.overdraw.address();
        // pipelines that count fragments read no shadows
        let second = if overdraw != 0 {
            overdraw
        } else {
            uploaded.hybrid
        };
        let mut state = None;
        let mut range = None;
        let mut pushed = 0;
        for call in &list.calls {
            if state != Some(call.state) {
                let Some(pipeline) = self.pipelines.get(kind, call.state) else {
                    continue;
                };
                pass.bind_graphics(pipeline);
                state = Some(call.state);
                // Mesa's software driver drops fragment push constants after a pipeline that uses none
                let shading = call.state.shading;
                if overdraw != 0 || shading.mapping != 0 || shading.is_hybrid() {
                    pushed = 0;
                }
            }
            // all pipelines share a layout, so push constants persist
            let wanted = views.of(call.range);
            if pushed != wanted {
                pass.push(&[wanted, second]);
                pushed = wanted;
            }
            if range != Some(call.range) {
                pass.set_viewport(&viewport(call.range, p));
                range = Some(call.range);
            }
            pass.draw_indexed(call.index_count, 1, call.first_index, 0, call.draw);
        }
    }
}

/// A dynamic light as shaders read it.
pub fn raster_light(light: &DynamicLight) -> RasterLight {
    RasterLight {
        origin: light.origin,
        radius: light.radius,
        color: light.color,
    }
}

/// The viewport of a depth range.
fn viewport(range: DepthRange, p: &ViewParameters<'_>) -> Viewport {
    let (min_depth, max_depth) = match range {
        DepthRange::Normal => (0.0, 1.0),
        DepthRange::Near | DepthRange::Crosshair => (0.0, 0.3),
        DepthRange::Sky => (1.0, 1.0),
        DepthRange::Front => (0.0, 0.0),
    };
    let [x, mut y, width, height] = p.viewport.map(|v| v as f32);
    if p.clear_depth {
        y += EDGE_SHIFT;
    }
    Viewport {
        x,
        y,
        width,
        height,
        min_depth,
        max_depth,
    }
}

/// Clips a rectangle to the image.
fn clip_to([x, y, width, height]: [i32; 4], image: &Image) -> [i32; 4] {
    let clip = |start: i32, size: i32, limit: u32| {
        let from = start.clamp(0, limit as i32);
        let to = start.saturating_add(size.max(0)).clamp(from, limit as i32);
        (from, to - from)
    };
    let (x, width) = clip(x, width, image.width());
    let (y, height) = clip(y, height, image.height());
    [x, y, width, height]
}
