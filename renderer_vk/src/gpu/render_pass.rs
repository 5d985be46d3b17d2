//! Render passes and framebuffers, made at first use and cached.

use ash::vk;

use super::device::{DeviceInner, lock};
use super::error::{Context, Error};

/// Key of a render pass: formats and whether the attachments are cleared.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct RenderPassKey {
    pub color: Option<vk::Format>,
    pub depth: Option<vk::Format>,
    pub samples: u32,
    pub clear_color: bool,
    pub clear_depth: bool,
}

/// Key of a framebuffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FramebufferKey {
    pub render_pass: vk::RenderPass,
    /// The attachments, then null.
    pub views: [vk::ImageView; 2],
    pub extent: vk::Extent2D,
}

impl DeviceInner {
    /// The render pass for `key`: attachments stay in the layout GENERAL.
    pub fn render_pass(&self, key: RenderPassKey) -> Result<vk::RenderPass, Error> {
        let mut passes = lock(&self.render_passes);
        if let Some(pass) = passes.get(&key) {
            return Ok(*pass);
        }
        let attachment = |format, clear: bool| {
            vk::AttachmentDescription::default()
                .format(format)
                .samples(vk::SampleCountFlags::from_raw(key.samples.max(1)))
                .load_op(if clear {
                    vk::AttachmentLoadOp::CLEAR
                } else {
                    vk::AttachmentLoadOp::LOAD
                })
                .store_op(vk::AttachmentStoreOp::STORE)
                // no effect without a stencil
                .stencil_load_op(vk::AttachmentLoadOp::LOAD)
                .stencil_store_op(vk::AttachmentStoreOp::STORE)
                .initial_layout(vk::ImageLayout::GENERAL)
                .final_layout(vk::ImageLayout::GENERAL)
        };
        let mut attachments = Vec::new();
        let mut next = 0;
        let mut reference = || {
            next += 1;
            vk::AttachmentReference {
                attachment: next - 1,
                layout: vk::ImageLayout::GENERAL,
            }
        };
        let mut color = Vec::new();
        if let Some(format) = key.color {
            attachments.push(attachment(format, key.clear_color));
            color.push(reference());
        }
        let depth = key.depth.map(|format| {
            attachments.push(attachment(format, key.clear_depth));
            reference()
        });
        let mut subpass = vk::SubpassDescription::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&color);
        if let Some(depth) = &depth {
            subpass = subpass.depth_stencil_attachment(depth);
        }
        let subpasses = [subpass];
        let info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses);
        // SAFETY: references lie within the attachments; pointers live here.
        let pass = unsafe { self.core.raw.create_render_pass(&info, None) }
            .context("vkCreateRenderPass")?;
        passes.insert(key, pass);
        Ok(pass)
    }

    /// The framebuffer for `key`. It exists as long as its views.
    pub fn framebuffer(&self, key: FramebufferKey) -> Result<vk::Framebuffer, Error> {
        let mut framebuffers = lock(&self.framebuffers);
        if let Some((_, made)) = framebuffers.iter().find(|(known, _)| *known == key) {
            return Ok(*made);
        }
        let count = (key.views.iter())
            .take_while(|view| **view != vk::ImageView::null())
            .count();
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(key.render_pass)
            .attachments(&key.views[..count])
            .width(key.extent.width)
            .height(key.extent.height)
            .layers(1);
        // SAFETY: the views match the render pass, which is made for their formats, and are alive.
        let made = unsafe { self.core.raw.create_framebuffer(&info, None) }
            .context("vkCreateFramebuffer")?;
        framebuffers.push((key, made));
        Ok(made)
    }
}
