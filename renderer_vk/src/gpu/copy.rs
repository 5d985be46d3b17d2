//! Copy commands of a pass: buffers, images, read-backs.

use ash::vk;

use super::buffer::Buffer;
use super::image::{Image, layout_change, rectangle, whole};
use super::pass::Pass;

/// Level 0 of an image's first layer.
fn first_level(image: &Image) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: image.0.copied(),
        mip_level: 0,
        base_array_layer: 0,
        layer_count: 1,
    }
}

impl Pass<'_> {
    /// Copies bytes between buffers, or between disjoint ranges of one buffer.
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
        // SAFETY: the range is inside of the buffer and aligned; outside of a render pass.
        unsafe {
            self.vk()
                .cmd_fill_buffer(self.cmd(), buffer.0.raw, offset, size, value);
        }
    }

    /// Changes the layout of an image whose layout is not `GENERAL`, for a copy.
    fn change_layout(&self, image: &Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        if from == to {
            return;
        }
        self.record_barrier(&[], &[layout_change(image.0.raw, image.0.aspect, from, to)]);
    }

    /// Runs a copy with an image in a layout that allows copies.
    fn with_layout(
        &self,
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

    /// Runs a copy between two images, both in layouts that allow copies.
    fn between(
        &self,
        source: &Image,
        target: &Image,
        copy: impl FnOnce(&Self, vk::ImageLayout, vk::ImageLayout),
    ) {
        let (read, written) = (
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        );
        self.with_layout(source, read, |pass, from| {
            pass.with_layout(target, written, |pass, to| copy(pass, from, to));
        });
    }

    /// Copies the common rectangle of level 0.
    pub fn copy_image(&mut self, source: &Image, target: &Image) {
        self.end_rendering();
        if source.format().block() != target.format().block()
            || source.0.aspect != target.0.aspect
            || source.samples() != target.samples()
            || source.0.raw == target.0.raw
        {
            self.refuse("a copy between images whose texels differ, or of an image to itself");
            return;
        }
        let region = vk::ImageCopy {
            src_subresource: first_level(source),
            dst_subresource: first_level(target),
            extent: vk::Extent3D {
                width: source.width().min(target.width()),
                height: source.height().min(target.height()),
                depth: 1,
            },
            ..Default::default()
        };
        self.between(source, target, |pass, from, to| {
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
        });
    }

    /// Resolves a multisampled colour image to an image of the same size and format.
    pub fn resolve_image(&mut self, source: &Image, target: &Image) {
        self.end_rendering();
        let fits = source.samples() > 1
            && target.samples() == 1
            && source.format() == target.format()
            && source.0.aspect == vk::ImageAspectFlags::COLOR
            && (source.width(), source.height()) == (target.width(), target.height())
            && target.0.layout == vk::ImageLayout::GENERAL;
        if !fits {
            self.refuse("a resolve between images that do not fit each other");
            return;
        }
        let region = vk::ImageResolve {
            src_subresource: first_level(source),
            dst_subresource: first_level(target),
            extent: vk::Extent3D {
                width: source.width(),
                height: source.height(),
                depth: 1,
            },
            ..Default::default()
        };
        let general = vk::ImageLayout::GENERAL;
        // SAFETY: samples, formats and sizes were checked; render targets stay in GENERAL; outside of a render pass.
        unsafe {
            self.vk().cmd_resolve_image(
                self.cmd(),
                source.0.raw,
                general,
                target.0.raw,
                general,
                &[region],
            );
        }
    }

    /// Copies a rectangle (x, y, width, height) of level 0 with scaling and conversion; a negative width or height
    /// mirrors. Rectangles must lie inside of their images.
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
        if source.0.raw == target.0.raw || source.samples().max(target.samples()) > 1 {
            self.refuse("a blit of an image to itself or with several samples");
            return;
        }
        let region = vk::ImageBlit {
            src_subresource: first_level(source),
            src_offsets: from_corners,
            dst_subresource: first_level(target),
            dst_offsets: to_corners,
        };
        let filter = if linear {
            vk::Filter::LINEAR
        } else {
            vk::Filter::NEAREST
        };
        self.between(source, target, |pass, from, to| {
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
        });
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
            || source.samples() > 1
            || target.check(offset, bytes).is_err()
        {
            self.refuse("a read-back outside of the image or the buffer");
            return;
        }
        let (image_offset, image_extent) = rectangle([x, y, width, height]);
        let region = vk::BufferImageCopy {
            buffer_offset: offset,
            image_subresource: first_level(source),
            image_offset,
            image_extent,
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

    /// Generates levels 1 and up, each from the previous one with a linear filter.
    pub fn generate_mips(&mut self, image: &Image) {
        self.end_rendering();
        if image.format().block().0 != 1 {
            self.refuse("mip levels of a compressed image");
            return;
        }
        // In GENERAL, levels can be both source and target; barriers separate the copies.
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
}
