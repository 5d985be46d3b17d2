//! Draw commands of a pass.

use ash::vk;

use super::buffer::Buffer;
use super::error::Error;
use super::image::{Image, ImageUsage};
use super::pass::Pass;
use super::render_pass::{FramebufferKey, RenderPassKey};

/// Attachments of [`Pass::begin_rendering`]. Their contents are kept unless a clear value is given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rendering<'a> {
    /// Colour attachment.
    pub color: Option<&'a Image>,
    /// Depth attachment, of the same size.
    pub depth: Option<&'a Image>,
    /// Clear value of the colour attachment.
    pub clear_color: Option<[f32; 4]>,
    /// Clear value of the depth attachment.
    pub clear_depth: Option<f32>,
}

/// The images of a [`Rendering`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Attachments {
    color: vk::ImageView,
    depth: vk::ImageView,
    extent: vk::Extent2D,
}

impl Attachments {
    pub fn of(target: &Rendering<'_>) -> Self {
        let view = |image: Option<&Image>| image.map_or(vk::ImageView::null(), |i| i.0.target);
        let extent = target
            .color
            .or(target.depth)
            .map_or(vk::Extent2D::default(), |first| vk::Extent2D {
                width: first.width(),
                height: first.height(),
            });
        Self {
            color: view(target.color),
            depth: view(target.depth),
            extent,
        }
    }
}

/// Viewport transform. A negative height flips the picture vertically, as Vulkan 1.1 allows.
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
impl Pass<'_> {
    /// Begins rendering to attachments. Viewport and scissor cover their whole size.
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
        let mut views = [vk::ImageView::null(); 2];
        let mut clears = [vk::ClearValue::default(); 2];
        let mut count = 0;
        let attachments = [
            (target.color, ImageUsage::COLOR),
            (target.depth, ImageUsage::DEPTH),
        ];
        let attachments = attachments.iter();
        for (image, usage) in attachments.filter_map(|&(image, usage)| Some((image?, usage))) {
            if !image.usage().has(usage) {
                return Err(image.misuse("is not made to be drawn to in this way"));
            }
            if (image.width(), image.height()) != (width, height) {
                return Err(image.misuse("has another size than the other attachment"));
            }
            if image.samples() != first.samples() {
                return Err(image.misuse("has more or fewer samples than the other attachment"));
            }
            views[count] = image.0.target;
            clears[count] = if usage == ImageUsage::COLOR {
                vk::ClearValue {
                    color: vk::ClearColorValue {
                        // Not read where the attachment is loaded.
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
            };
            count += 1;
        }
        let pass = device.0.render_pass(RenderPassKey {
            color: target.color.map(|i| i.format().vk()),
            depth: target.depth.map(|i| i.format().vk()),
            samples: first.samples(),
            clear_color: target.color.is_some() && target.clear_color.is_some(),
            clear_depth: target.depth.is_some() && target.clear_depth.is_some(),
        })?;
        let extent = vk::Extent2D { width, height };
        let framebuffer = device.0.framebuffer(FramebufferKey {
            render_pass: pass,
            views,
            extent,
        })?;
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(pass)
            .framebuffer(framebuffer)
            .render_area(extent.into())
            .clear_values(&clears[..count]);
        // SAFETY: recording outside of a render pass; the framebuffer stays valid until this frame is over.
        unsafe {
            self.vk()
                .cmd_begin_render_pass(self.cmd(), &info, vk::SubpassContents::INLINE);
        }
        self.rendering = Some(extent);
        self.show_all(extent);
        Ok(())
    }

    /// Continues rendering that the previous pass left open.
    pub(crate) fn go_on(&mut self, attachments: Attachments) {
        self.rendering = Some(attachments.extent);
        self.stays_open = Some(attachments);
        self.show_all(attachments.extent);
    }

    /// Sets viewport and scissor to the attachments' whole size.
    fn show_all(&mut self, vk::Extent2D { width, height }: vk::Extent2D) {
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
    }

    /// Ends rendering; no effect outside of rendering.
    pub fn end_rendering(&mut self) {
        self.stays_open = None;
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

    /// Sets the scissor rectangle, clipped to the attachments.
    pub fn set_scissor(&mut self, x: i32, y: i32, width: u32, height: u32) {
        // Outside of rendering the extent is empty.
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
        let can = self.rendering.is_some() && self.bound.graphics.is_some();
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

    /// Draws with the bound indices.
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

    /// Draws `count` times with parameters from a buffer (`VkDrawIndexedIndirectCommand`, `stride` bytes apart).
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

    /// Clears a rectangle (x, y, width, height) of the stencil to 0. The depth attachment must have a stencil.
    pub fn clear_stencil_rect(&mut self, rect: [i32; 4]) {
        self.clear_rect(
            rect,
            vk::ClearAttachment {
                aspect_mask: vk::ImageAspectFlags::STENCIL,
                color_attachment: 0,
                clear_value: vk::ClearValue::default(),
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
}

/// Clips a rectangle to the attachments.
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
