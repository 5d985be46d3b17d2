//! The commands of a pass.

use ash::vk;
use bytemuck::Pod;

use super::arena::UploadArena;
use super::bindless::PUSH_BYTES;
use super::buffer::Buffer;
use super::device::{Device, RenderPassKey};
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::image::{Image, ImageUsage, whole};
use super::pipeline::{ComputePipeline, GraphicsPipeline};
use super::ray_tracing::{RayTracingPipeline, SbtRegions};
use super::recorder::Recorder;

/// What [`Pass::begin_rendering`] draws to. The attachments keep their contents unless a clear value is given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rendering<'a> {
    /// Colour attachment.
    pub color: Option<&'a Image>,
    /// Depth attachment, of the same size.
    pub depth: Option<&'a Image>,
    /// Colour that the attachment is cleared to first.
    pub clear_color: Option<[f32; 4]>,
    /// Depth that the attachment is cleared to first.
    pub clear_depth: Option<f32>,
}

/// Where clip space lands. A negative height turns the picture upside down, as Vulkan 1.1 allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Left edge, pixels.
    pub x: f32,
    /// Top edge, pixels (bottom edge with a negative height).
    pub y: f32,
    /// Pixels.
    pub width: f32,
    /// Pixels.
    pub height: f32,
    /// Depth of the near plane, in [0, 1].
    pub min_depth: f32,
    /// Depth of the far plane, in [0, 1].
    pub max_depth: f32,
}

/// A pass that is being recorded; see [`Recorder::pass`]. Commands that contradict themselves (a range outside of a
/// buffer, a draw outside of rendering) are left out with a warning, because a frame must go on.
pub struct Pass<'a> {
    rec: &'a mut Recorder,
    query: Option<(vk::QueryPool, u32)>,
    /// Size of the attachments while drawing.
    rendering: Option<vk::Extent2D>,
    rays: Option<SbtRegions>,
    bound: Bound,
}

/// Which pipelines are bound.
#[derive(Clone, Copy, Default)]
struct Bound {
    graphics: bool,
    compute: bool,
}

impl<'a> Pass<'a> {
    pub(crate) fn new(rec: &'a mut Recorder, query: Option<(vk::QueryPool, u32)>) -> Self {
        Self {
            rec,
            query,
            rendering: None,
            rays: None,
            bound: Bound::default(),
        }
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.rec.device
    }

    /// Memory for data that this frame alone uses.
    pub fn arena(&mut self) -> &mut UploadArena {
        self.rec.arena()
    }

    pub(crate) fn recorder(&mut self) -> &mut Recorder {
        self.rec
    }

    fn vk(&self) -> &ash::Device {
        self.rec.device.vk()
    }

    pub(crate) fn cmd(&self) -> vk::CommandBuffer {
        self.rec.cmd
    }

    fn bind(&self, point: vk::PipelineBindPoint, pipeline: vk::Pipeline) {
        let bindless = &self.rec.device.0.bindless;
        // SAFETY: recording; the pipeline is alive (the graveyard keeps it for this frame).
        unsafe { self.vk().cmd_bind_pipeline(self.cmd(), point, pipeline) };
        // SAFETY: every pipeline has this layout; the set is update-after-bind.
        unsafe {
            self.vk().cmd_bind_descriptor_sets(
                self.cmd(),
                point,
                bindless.pipeline_layout,
                0,
                &[bindless.set],
                &[],
            );
        }
    }

    /// Binds a pipeline for the draws that follow.
    pub fn bind_graphics(&mut self, pipeline: &GraphicsPipeline) {
        self.bind(vk::PipelineBindPoint::GRAPHICS, pipeline.raw());
        self.bound.graphics = true;
    }

    /// Binds a pipeline for the dispatches that follow.
    pub fn bind_compute(&mut self, pipeline: &ComputePipeline) {
        self.bind(vk::PipelineBindPoint::COMPUTE, pipeline.raw());
        self.bound.compute = true;
    }

    /// Binds a pipeline for the ray launches that follow.
    pub fn bind_rays(&mut self, pipeline: &RayTracingPipeline) {
        self.bind(vk::PipelineBindPoint::RAY_TRACING_KHR, pipeline.raw());
        self.rays = Some(pipeline.regions());
    }

    /// Sets the push constants from offset 0, for all stages; 128 bytes at most, a multiple of 4.
    pub fn push<T: Pod>(&mut self, constants: &T) {
        let bytes = bytemuck::bytes_of(constants);
        if bytes.len() > PUSH_BYTES as usize || !bytes.len().is_multiple_of(4) || bytes.is_empty() {
            self.refuse(&format!(
                "push constants of {} bytes (a multiple of 4 up to {PUSH_BYTES} is possible)",
                bytes.len()
            ));
            return;
        }
        let layout = self.rec.device.0.bindless.pipeline_layout;
        // SAFETY: the layout has 128 bytes for all stages, the size was checked.
        unsafe {
            self.vk()
                .cmd_push_constants(self.cmd(), layout, vk::ShaderStageFlags::ALL, 0, bytes);
        }
    }

    /// Waits within the pass: everything recorded so far happens before everything after, with memory visible.
    pub fn barrier(&mut self) {
        self.end_rendering();
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        // SAFETY: recording, outside of a render pass.
        unsafe {
            self.vk().cmd_pipeline_barrier(
                self.cmd(),
                all,
                all,
                vk::DependencyFlags::empty(),
                &memory,
                &[],
                &[],
            );
        }
    }

    // ---- drawing

    /// Starts drawing to images. Viewport and scissor are set to their whole size.
    ///
    /// # Errors
    /// No attachment, attachments of different sizes or without the usage; out of memory.
    pub fn begin_rendering(&mut self, target: &Rendering<'_>) -> Result<(), Error> {
        self.end_rendering();
        let device = self.rec.device.clone();
        let Some(first) = target.color.or(target.depth) else {
            return Err(Error::Usage {
                name: "begin_rendering".to_owned(),
                what: "no attachment".to_owned(),
            });
        };
        let (width, height) = (first.width(), first.height());
        let mut views = Vec::new();
        let mut clears = Vec::new();
        let attachments = [
            (target.color, ImageUsage::COLOR),
            (target.depth, ImageUsage::DEPTH),
        ];
        for (image, usage) in attachments {
            let Some(image) = image else { continue };
            if !image.usage().has(usage) {
                return Err(image.misuse("is not made to be drawn to in this way"));
            }
            if (image.width(), image.height()) != (width, height) {
                return Err(image.misuse("has another size than the other attachment"));
            }
            views.push(image.0.target);
            clears.push(if usage == ImageUsage::COLOR {
                vk::ClearValue {
                    color: vk::ClearColorValue {
                        float32: target.clear_color.unwrap_or_default(),
                    },
                }
            } else {
                vk::ClearValue {
                    depth_stencil: vk::ClearDepthStencilValue {
                        depth: target.clear_depth.unwrap_or(1.0).clamp(0.0, 1.0),
                        stencil: 0,
                    },
                }
            });
        }
        let pass = device.0.render_pass(RenderPassKey {
            color: target.color.map(|i| i.format().vk()),
            depth: target.depth.map(|i| i.format().vk()),
            clear_color: target.color.is_some() && target.clear_color.is_some(),
            clear_depth: target.depth.is_some() && target.clear_depth.is_some(),
        })?;
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass)
            .attachments(&views)
            .width(width)
            .height(height)
            .layers(1);
        // SAFETY: the views match the render pass by construction and are alive.
        let framebuffer = unsafe { device.vk().create_framebuffer(&info, None) }
            .context("vkCreateFramebuffer")?;
        // Only this frame uses it.
        device.0.bury(Garbage::Framebuffer(framebuffer));
        let extent = vk::Extent2D { width, height };
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(pass)
            .framebuffer(framebuffer)
            .render_area(extent.into())
            .clear_values(&clears);
        // SAFETY: recording outside of a render pass; the framebuffer lives until this frame is over.
        unsafe {
            self.vk()
                .cmd_begin_render_pass(self.cmd(), &info, vk::SubpassContents::INLINE);
        }
        self.rendering = Some(extent);
        #[allow(clippy::cast_precision_loss)]
        self.set_viewport(&Viewport {
            x: 0.0,
            y: 0.0,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        });
        self.set_scissor(0, 0, width, height);
        Ok(())
    }

    /// Stops drawing; without effect when nothing is drawn to.
    pub fn end_rendering(&mut self) {
        if self.rendering.take().is_some() {
            // SAFETY: a render pass is open.
            unsafe { self.vk().cmd_end_render_pass(self.cmd()) };
        }
    }

    /// Sets the viewport.
    pub fn set_viewport(&mut self, v: &Viewport) {
        // Zero, negative and non-finite widths are not allowed.
        let finite = |value: f32, other: f32| if value.is_finite() { value } else { other };
        let viewport = vk::Viewport {
            x: finite(v.x, 0.0).clamp(-32768.0, 32767.0),
            y: finite(v.y, 0.0).clamp(-32768.0, 32767.0),
            width: finite(v.width, 1.0).clamp(1.0, 16384.0),
            height: match finite(v.height, 1.0).clamp(-16384.0, 16384.0) {
                0.0 => 1.0,
                height => height,
            },
            min_depth: finite(v.min_depth, 0.0).clamp(0.0, 1.0),
            max_depth: finite(v.max_depth, 1.0).clamp(0.0, 1.0),
        };
        // SAFETY: recording; the values are within the limits that every device has.
        unsafe { self.vk().cmd_set_viewport(self.cmd(), 0, &[viewport]) };
    }

    /// Sets the rectangle outside of which nothing is drawn; it is cut to the attachments.
    pub fn set_scissor(&mut self, x: i32, y: i32, width: u32, height: u32) {
        let rect = cut([x, y], [width, height], self.rendering.unwrap_or_default());
        // SAFETY: recording; offsets are not negative and offset + extent does not overflow.
        unsafe { self.vk().cmd_set_scissor(self.cmd(), 0, &[rect]) };
    }

    /// Binds 32-bit indices that start at byte `offset`.
    pub fn bind_index_buffer(&mut self, buffer: &Buffer, offset: u64) {
        if buffer.check(offset, 0).is_err() {
            self.refuse("an index buffer that starts behind its end");
            return;
        }
        // SAFETY: the buffer is alive for this frame and the offset inside.
        unsafe {
            self.vk().cmd_bind_index_buffer(
                self.cmd(),
                buffer.0.raw,
                offset,
                vk::IndexType::UINT32,
            );
        }
    }

    fn can_draw(&self) -> bool {
        let can = self.rendering.is_some() && self.bound.graphics;
        if !can {
            self.refuse("a draw without attachments or pipeline");
        }
        can
    }

    /// Draws `vertices` vertices, which the vertex shader fetches by `gl_VertexIndex`.
    pub fn draw(&mut self, vertices: u32, instances: u32, first_vertex: u32, first_instance: u32) {
        if self.can_draw() {
            // SAFETY: a render pass is open and a pipeline is bound.
            unsafe {
                self.vk().cmd_draw(
                    self.cmd(),
                    vertices,
                    instances,
                    first_vertex,
                    first_instance,
                );
            }
        }
    }

    /// Draws by the bound indices.
    pub fn draw_indexed(
        &mut self,
        indices: u32,
        instances: u32,
        first_index: u32,
        vertex_offset: i32,
        first_instance: u32,
    ) {
        if self.can_draw() {
            // SAFETY: a render pass is open and a pipeline is bound.
            unsafe {
                self.vk().cmd_draw_indexed(
                    self.cmd(),
                    indices,
                    instances,
                    first_index,
                    vertex_offset,
                    first_instance,
                );
            }
        }
    }

    /// Draws `count` times by parameters in a buffer (`VkDrawIndexedIndirectCommand`, `stride` bytes apart).
    pub fn draw_indexed_indirect(&mut self, buffer: &Buffer, offset: u64, count: u32, stride: u32) {
        let size = u64::from(stride) * u64::from(count);
        if buffer.check(offset, size).is_err() || stride < 20 || !self.can_draw() {
            return;
        }
        if self.rec.device.0.abilities.multi_draw_indirect {
            // SAFETY: the parameters lie inside the buffer; a render pass is open and a pipeline bound.
            unsafe {
                self.vk().cmd_draw_indexed_indirect(
                    self.cmd(),
                    buffer.0.raw,
                    offset,
                    count,
                    stride,
                );
            }
        } else {
            for i in 0..count {
                let at = offset + u64::from(i) * u64::from(stride);
                // SAFETY: as above.
                unsafe {
                    self.vk()
                        .cmd_draw_indexed_indirect(self.cmd(), buffer.0.raw, at, 1, stride);
                }
            }
        }
    }

    /// Clears a rectangle (x, y, width, height) of the colour attachment.
    pub fn clear_color_rect(&mut self, rect: [i32; 4], color: [f32; 4]) {
        self.clear_rect(
            rect,
            vk::ClearAttachment {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                color_attachment: 0,
                clear_value: vk::ClearValue {
                    color: vk::ClearColorValue { float32: color },
                },
            },
        );
    }

    /// Clears a rectangle (x, y, width, height) of the depth attachment.
    pub fn clear_depth_rect(&mut self, rect: [i32; 4], depth: f32) {
        self.clear_rect(
            rect,
            vk::ClearAttachment {
                aspect_mask: vk::ImageAspectFlags::DEPTH,
                color_attachment: 0,
                clear_value: vk::ClearValue {
                    depth_stencil: vk::ClearDepthStencilValue {
                        depth: depth.clamp(0.0, 1.0),
                        stencil: 0,
                    },
                },
            },
        );
    }

    fn clear_rect(&mut self, [x, y, width, height]: [i32; 4], what: vk::ClearAttachment) {
        let Some(extent) = self.rendering else {
            self.refuse("a clear without attachments");
            return;
        };
        let size = |v: i32| u32::try_from(v).unwrap_or(0);
        let rect = cut([x, y], [size(width), size(height)], extent);
        if rect.extent.width == 0 || rect.extent.height == 0 {
            return;
        }
        let rects = [vk::ClearRect {
            rect,
            base_array_layer: 0,
            layer_count: 1,
        }];
        // SAFETY: a render pass is open; the rectangle was cut to its area.
        unsafe { self.vk().cmd_clear_attachments(self.cmd(), &[what], &rects) };
    }

    // ---- computing

    /// Launches workgroups.
    pub fn dispatch(&mut self, x: u32, y: u32, z: u32) {
        self.end_rendering();
        if !self.bound.compute {
            self.refuse("a dispatch without pipeline");
        } else if x > 0 && y > 0 && z > 0 {
            // SAFETY: a compute pipeline is bound, outside of a render pass.
            unsafe { self.vk().cmd_dispatch(self.cmd(), x, y, z) };
        }
    }

    /// Launches as many workgroups as three 32-bit numbers in a buffer say.
    pub fn dispatch_indirect(&mut self, buffer: &Buffer, offset: u64) {
        self.end_rendering();
        if !self.bound.compute || buffer.check(offset, 12).is_err() {
            self.refuse("an indirect dispatch without pipeline or parameters");
            return;
        }
        // SAFETY: a compute pipeline is bound, the parameters lie inside the buffer.
        unsafe {
            self.vk()
                .cmd_dispatch_indirect(self.cmd(), buffer.0.raw, offset);
        }
    }

    /// Launches ray generation.
    pub fn trace_rays(&mut self, width: u32, height: u32, depth: u32) {
        self.end_rendering();
        let (Some(functions), Some(regions)) = (&self.rec.device.0.ray_tracing, &self.rays) else {
            self.refuse("a ray launch without pipeline");
            return;
        };
        if width > 0 && height > 0 && depth > 0 {
            // SAFETY: the pipeline that the regions belong to is bound.
            unsafe {
                functions.cmd_trace_rays(
                    self.cmd(),
                    &regions.raygen,
                    &regions.miss,
                    &regions.hit,
                    &vk::StridedDeviceAddressRegionKHR::default(),
                    width,
                    height,
                    depth,
                );
            }
        }
    }

    // ---- copying

    /// Copies bytes between buffers, or between parts of one that do not overlap.
    pub fn copy_buffer(
        &mut self,
        source: &Buffer,
        source_offset: u64,
        target: &Buffer,
        target_offset: u64,
        size: u64,
    ) {
        self.end_rendering();
        if size == 0 {
            return;
        }
        let checks = source
            .check(source_offset, size)
            .and_then(|()| target.check(target_offset, size));
        if let Err(e) = checks {
            self.refuse(&e.to_string());
            return;
        }
        let region = vk::BufferCopy {
            src_offset: source_offset,
            dst_offset: target_offset,
            size,
        };
        // SAFETY: both ranges are inside; outside of a render pass.
        unsafe {
            self.vk()
                .cmd_copy_buffer(self.cmd(), source.0.raw, target.0.raw, &[region]);
        }
    }

    /// Fills bytes (offset and size multiples of 4) with a 32-bit value.
    pub fn fill_buffer(&mut self, buffer: &Buffer, offset: u64, size: u64, value: u32) {
        self.end_rendering();
        if size == 0 {
            return;
        }
        if buffer.check(offset, size).is_err() || !(offset | size).is_multiple_of(4) {
            self.refuse("a fill outside of the buffer or of odd bytes");
            return;
        }
        // SAFETY: the range is inside and aligned; outside of a render pass.
        unsafe {
            self.vk()
                .cmd_fill_buffer(self.cmd(), buffer.0.raw, offset, size, value);
        }
    }

    /// Changes the layout of an image that is not `GENERAL`, for a copy.
    fn change_layout(&self, image: &Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        if from == to {
            return;
        }
        let barrier = vk::ImageMemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
            .old_layout(from)
            .new_layout(to)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image.0.raw)
            .subresource_range(whole(image.0.aspect));
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        // SAFETY: recording, outside of a render pass; `from` is the layout that the image has.
        unsafe {
            self.vk().cmd_pipeline_barrier(
                self.cmd(),
                all,
                all,
                vk::DependencyFlags::empty(),
                &[],
                &[],
                &[barrier],
            );
        }
    }

    /// Runs a copy with an image in a layout that allows it.
    fn with_layout(
        &mut self,
        image: &Image,
        layout: vk::ImageLayout,
        copy: impl FnOnce(&Self, vk::ImageLayout),
    ) {
        let own = image.0.layout;
        let during = if own == vk::ImageLayout::GENERAL {
            own
        } else {
            layout
        };
        self.change_layout(image, own, during);
        copy(self, during);
        self.change_layout(image, during, own);
    }

    /// Copies level 0, as much as both images have.
    pub fn copy_image(&mut self, source: &Image, target: &Image) {
        self.end_rendering();
        if source.format().block() != target.format().block()
            || source.0.aspect != target.0.aspect
            || source.0.raw == target.0.raw
        {
            self.refuse("a copy between images whose texels differ, or of an image to itself");
            return;
        }
        let layers = |i: &Image| vk::ImageSubresourceLayers {
            aspect_mask: i.0.aspect,
            mip_level: 0,
            base_array_layer: 0,
            layer_count: 1,
        };
        let region = vk::ImageCopy {
            src_subresource: layers(source),
            dst_subresource: layers(target),
            extent: vk::Extent3D {
                width: source.width().min(target.width()),
                height: source.height().min(target.height()),
                depth: 1,
            },
            ..Default::default()
        };
        self.with_layout(
            source,
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            |pass, from| {
                let own = target.0.layout;
                let to = if own == vk::ImageLayout::GENERAL {
                    own
                } else {
                    vk::ImageLayout::TRANSFER_DST_OPTIMAL
                };
                pass.change_layout(target, own, to);
                // SAFETY: the region lies inside both images, which are in these layouts.
                unsafe {
                    pass.vk().cmd_copy_image(
                        pass.cmd(),
                        source.0.raw,
                        from,
                        target.0.raw,
                        to,
                        &[region],
                    );
                }
                pass.change_layout(target, to, own);
            },
        );
    }

    /// Copies a rectangle (x, y, width, height) of level 0 with scaling and conversion; a negative width or height
    /// mirrors. Rectangles must lie inside their images.
    pub fn blit_image(
        &mut self,
        source: &Image,
        source_rect: [i32; 4],
        target: &Image,
        target_rect: [i32; 4],
        linear: bool,
    ) {
        self.end_rendering();
        let corners = |image: &Image, [x, y, w, h]: [i32; 4]| {
            let (x1, y1) = (x.checked_add(w)?, y.checked_add(h)?);
            let inside = |v: i32, size: u32| u32::try_from(v).is_ok_and(|v| v <= size);
            let good = inside(x, image.width())
                && inside(x1, image.width())
                && inside(y, image.height())
                && inside(y1, image.height())
                && w != 0
                && h != 0;
            good.then_some([
                vk::Offset3D { x, y, z: 0 },
                vk::Offset3D { x: x1, y: y1, z: 1 },
            ])
        };
        let (Some(from_corners), Some(to_corners)) =
            (corners(source, source_rect), corners(target, target_rect))
        else {
            self.refuse("a blit outside of its images");
            return;
        };
        if source.0.raw == target.0.raw {
            self.refuse("a blit of an image to itself");
            return;
        }
        let layers = |i: &Image| vk::ImageSubresourceLayers {
            aspect_mask: i.0.aspect,
            mip_level: 0,
            base_array_layer: 0,
            layer_count: 1,
        };
        let region = vk::ImageBlit {
            src_subresource: layers(source),
            src_offsets: from_corners,
            dst_subresource: layers(target),
            dst_offsets: to_corners,
        };
        let filter = if linear {
            vk::Filter::LINEAR
        } else {
            vk::Filter::NEAREST
        };
        self.with_layout(
            source,
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            |pass, from| {
                let own = target.0.layout;
                let to = if own == vk::ImageLayout::GENERAL {
                    own
                } else {
                    vk::ImageLayout::TRANSFER_DST_OPTIMAL
                };
                pass.change_layout(target, own, to);
                // SAFETY: the corners lie inside the images, which are in these layouts.
                unsafe {
                    pass.vk().cmd_blit_image(
                        pass.cmd(),
                        source.0.raw,
                        from,
                        target.0.raw,
                        to,
                        &[region],
                        filter,
                    );
                }
                pass.change_layout(target, to, own);
            },
        );
    }

    /// Copies a rectangle (x, y, width, height) of level 0 into a buffer, rows without padding.
    pub fn copy_image_to_buffer(
        &mut self,
        source: &Image,
        [x, y, width, height]: [u32; 4],
        target: &Buffer,
        offset: u64,
    ) {
        self.end_rendering();
        let inside = |start: u32, size: u32, whole: u32| {
            size > 0 && start.checked_add(size).is_some_and(|end| end <= whole)
        };
        let bytes = source.format().bytes(width, height);
        if !inside(x, width, source.width())
            || !inside(y, height, source.height())
            || target.check(offset, bytes).is_err()
        {
            self.refuse("a read-back outside of the image or the buffer");
            return;
        }
        let region = vk::BufferImageCopy {
            buffer_offset: offset,
            image_subresource: vk::ImageSubresourceLayers {
                aspect_mask: source.0.aspect,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            },
            image_offset: vk::Offset3D {
                x: x.cast_signed(),
                y: y.cast_signed(),
                z: 0,
            },
            image_extent: vk::Extent3D {
                width,
                height,
                depth: 1,
            },
            ..Default::default()
        };
        self.with_layout(
            source,
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            |pass, layout| {
                // SAFETY: the rectangle and the range are inside; the image is in this layout.
                unsafe {
                    pass.vk().cmd_copy_image_to_buffer(
                        pass.cmd(),
                        source.0.raw,
                        layout,
                        target.0.raw,
                        &[region],
                    );
                }
            },
        );
    }

    /// Fills all levels of a colour image.
    pub fn clear_image(&mut self, image: &Image, color: [f32; 4]) {
        self.end_rendering();
        if image.0.aspect != vk::ImageAspectFlags::COLOR || image.format().block().0 != 1 {
            self.refuse("a colour clear of a depth or compressed image");
            return;
        }
        let value = vk::ClearColorValue { float32: color };
        self.with_layout(
            image,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            |pass, layout| {
                // SAFETY: the image is in this layout; outside of a render pass.
                unsafe {
                    pass.vk().cmd_clear_color_image(
                        pass.cmd(),
                        image.0.raw,
                        layout,
                        &value,
                        &[whole(image.0.aspect)],
                    );
                }
            },
        );
    }

    /// Makes levels 1 and up from level 0, each from the one before by linear filtering.
    pub fn generate_mips(&mut self, image: &Image) {
        self.end_rendering();
        if image.format().block().0 != 1 {
            self.refuse("mip levels of a compressed image");
            return;
        }
        // In GENERAL all levels can be source and target; barriers separate them.
        let own = image.0.layout;
        self.change_layout(image, own, vk::ImageLayout::GENERAL);
        for mip in 1..image.mips() {
            let offset = |m: u32| {
                let (w, h) = image.mip_size(m);
                vk::Offset3D {
                    x: w.cast_signed(),
                    y: h.cast_signed(),
                    z: 1,
                }
            };
            let layers = |m: u32| vk::ImageSubresourceLayers {
                aspect_mask: image.0.aspect,
                mip_level: m,
                base_array_layer: 0,
                layer_count: image.layers(),
            };
            let region = vk::ImageBlit {
                src_subresource: layers(mip - 1),
                src_offsets: [vk::Offset3D::default(), offset(mip - 1)],
                dst_subresource: layers(mip),
                dst_offsets: [vk::Offset3D::default(), offset(mip)],
            };
            let general = vk::ImageLayout::GENERAL;
            // SAFETY: levels differ and exist; the image is in GENERAL.
            unsafe {
                self.vk().cmd_blit_image(
                    self.cmd(),
                    image.0.raw,
                    general,
                    image.0.raw,
                    general,
                    &[region],
                    vk::Filter::LINEAR,
                );
            }
            self.barrier();
        }
        self.change_layout(image, vk::ImageLayout::GENERAL, own);
    }

    fn refuse(&self, what: &str) {
        log::warn!("GPU command left out: {what}");
    }
}

/// A rectangle cut to the attachments.
fn cut([x, y]: [i32; 2], [width, height]: [u32; 2], extent: vk::Extent2D) -> vk::Rect2D {
    let axis = |start: i32, size: u32, whole: u32| {
        let whole = i64::from(whole);
        let begin = i64::from(start).clamp(0, whole);
        let end = (i64::from(start) + i64::from(size)).clamp(begin, whole);
        // Both lie in 0..=whole, a u32; images are far smaller than i32::MAX.
        (
            i32::try_from(begin).unwrap_or(0),
            u32::try_from(end - begin).unwrap_or(0),
        )
    };
    let (x, width) = axis(x, width, extent.width);
    let (y, height) = axis(y, height, extent.height);
    vk::Rect2D {
        offset: vk::Offset2D { x, y },
        extent: vk::Extent2D { width, height },
    }
}

impl Drop for Pass<'_> {
    fn drop(&mut self) {
        self.end_rendering();
        if let Some((pool, query)) = self.query {
            // SAFETY: the query is reset by the command buffer that runs before this one.
            unsafe {
                self.vk().cmd_write_timestamp(
                    self.cmd(),
                    vk::PipelineStageFlags::BOTTOM_OF_PIPE,
                    pool,
                    query + 1,
                );
            }
        }
        if let Some(debug) = &self.rec.device.0.debug {
            // SAFETY: the label was opened by `Recorder::pass`.
            unsafe { debug.cmd_end_debug_utils_label(self.cmd()) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_are_cut_to_the_attachments() {
        let extent = vk::Extent2D {
            width: 64,
            height: 32,
        };
        let all = cut([-5, -5], [u32::MAX, u32::MAX], extent);
        assert_eq!((all.offset.x, all.offset.y), (0, 0));
        assert_eq!((all.extent.width, all.extent.height), (64, 32));
        let part = cut([60, 4], [10, 10], extent);
        assert_eq!((part.extent.width, part.extent.height), (4, 10));
        let none = cut([100, 100], [10, 10], extent);
        assert_eq!((none.extent.width, none.extent.height), (0, 0));
        assert_eq!((none.offset.x, none.offset.y), (64, 32));
    }
}
