//! Graphics and compute pipelines. All have the same layout: the bindless set and 128 bytes of push constants.

use ash::vk;
use shaders::Spirv;

use super::device::{Device, RenderPassKey};
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::image::Format;

/// Factor of a blend, of the colour and of the alpha channel alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)] // the names say it
pub enum BlendFactor {
    Zero,
    One,
    SrcColor,
    OneMinusSrcColor,
    DstColor,
    OneMinusDstColor,
    SrcAlpha,
    OneMinusSrcAlpha,
    DstAlpha,
    OneMinusDstAlpha,
    SrcAlphaSaturate,
}

impl BlendFactor {
    fn vk(self) -> vk::BlendFactor {
        use vk::BlendFactor as F;
        match self {
            Self::Zero => F::ZERO,
            Self::One => F::ONE,
            Self::SrcColor => F::SRC_COLOR,
            Self::OneMinusSrcColor => F::ONE_MINUS_SRC_COLOR,
            Self::DstColor => F::DST_COLOR,
            Self::OneMinusDstColor => F::ONE_MINUS_DST_COLOR,
            Self::SrcAlpha => F::SRC_ALPHA,
            Self::OneMinusSrcAlpha => F::ONE_MINUS_SRC_ALPHA,
            Self::DstAlpha => F::DST_ALPHA,
            Self::OneMinusDstAlpha => F::ONE_MINUS_DST_ALPHA,
            Self::SrcAlphaSaturate => F::SRC_ALPHA_SATURATE,
        }
    }
}

/// When a fragment passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum DepthTest {
    /// Always.
    Always,
    /// At the stored depth or nearer.
    #[default]
    LessEqual,
    /// At exactly the stored depth.
    Equal,
}

/// What a draw does with the stencil, where it passes all tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stencil {
    /// Passes everywhere; where depth passes too, adds one, up to 255.
    Increment,
    /// Passes everywhere; where depth passes too, takes one, down to 0.
    Decrement,
    /// Passes where the stencil is not 0, and leaves it.
    NotZero,
}

impl Stencil {
    fn vk(self) -> vk::StencilOpState {
        let (compare, pass) = match self {
            Self::Increment => (vk::CompareOp::ALWAYS, vk::StencilOp::INCREMENT_AND_CLAMP),
            Self::Decrement => (vk::CompareOp::ALWAYS, vk::StencilOp::DECREMENT_AND_CLAMP),
            Self::NotZero => (vk::CompareOp::NOT_EQUAL, vk::StencilOp::KEEP),
        };
        vk::StencilOpState {
            fail_op: vk::StencilOp::KEEP,
            pass_op: pass,
            depth_fail_op: vk::StencilOp::KEEP,
            compare_op: compare,
            compare_mask: 0xFF,
            write_mask: 0xFF,
            reference: 0,
        }
    }
}

/// Which channels of the colour attachment a draw writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ColorMask {
    /// Red.
    pub red: bool,
    /// Green.
    pub green: bool,
    /// Blue.
    pub blue: bool,
    /// Alpha.
    pub alpha: bool,
}

impl ColorMask {
    /// Every channel.
    pub const ALL: Self = Self {
        red: true,
        green: true,
        blue: true,
        alpha: true,
    };
    /// No channel.
    pub const NONE: Self = Self {
        red: false,
        green: false,
        blue: false,
        alpha: false,
    };

    fn vk(self) -> vk::ColorComponentFlags {
        use vk::ColorComponentFlags as C;
        [
            (self.red, C::R),
            (self.green, C::G),
            (self.blue, C::B),
            (self.alpha, C::A),
        ]
        .into_iter()
        .filter(|(on, _)| *on)
        .fold(C::empty(), |all, (_, channel)| all | channel)
    }
}

/// Which triangles are left out. The front is where the corners go counter-clockwise as they lie on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Cull {
    /// None.
    #[default]
    None,
    /// Front faces.
    Front,
    /// Back faces.
    Back,
}

/// What the vertices make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Topology {
    /// Three for a triangle.
    #[default]
    Triangles,
    /// Each with the two before it.
    TriangleStrip,
    /// Two for a line.
    Lines,
    /// One for a point.
    Points,
}

/// How to make a [`GraphicsPipeline`].
#[derive(Clone, Copy, Debug)]
pub struct GraphicsDesc<'a> {
    /// Label.
    pub name: &'a str,
    /// Vertex shader; there is no vertex input, it fetches by `gl_VertexIndex`.
    pub vertex: &'a Spirv,
    /// Fragment shader; `None` for depth alone.
    pub fragment: Option<&'a Spirv>,
    /// Format of the colour attachment.
    pub color: Option<Format>,
    /// Format of the depth attachment.
    pub depth: Option<Format>,
    /// Source and destination factor, added; `None`: the colour replaces.
    pub blend: Option<(BlendFactor, BlendFactor)>,
    /// Depth test, without effect when there is no depth attachment.
    pub depth_test: DepthTest,
    /// Whether passing fragments set the depth.
    pub depth_write: bool,
    /// What happens with the stencil; needs a depth attachment that has one. `None`: it does not take part.
    pub stencil: Option<Stencil>,
    /// Samples of a pixel of the attachments.
    pub samples: u32,
    /// Which faces are left out.
    pub cull: Cull,
    /// Slope factor and constant units of the depth offset, as OpenGL's `glPolygonOffset` takes them.
    pub polygon_offset: Option<(f32, f32)>,
    /// What the vertices make.
    pub topology: Topology,
    /// Draw the edges of triangles only (needs the device's `wireframe`).
    pub wireframe: bool,
    /// Channels that are written.
    pub color_write: ColorMask,
    /// Specialization constants: id and 32-bit value.
    pub constants: &'a [(u32, u32)],
}

impl<'a> GraphicsDesc<'a> {
    /// No attachments, no blend, no culling; depth is tested with `LessEqual` and written when there is an attachment.
    pub fn new(name: &'a str, vertex: &'a Spirv, fragment: &'a Spirv) -> Self {
        Self {
            name,
            vertex,
            fragment: Some(fragment),
            color: None,
            depth: None,
            blend: None,
            depth_test: DepthTest::LessEqual,
            depth_write: true,
            stencil: None,
            samples: 1,
            cull: Cull::None,
            polygon_offset: None,
            topology: Topology::Triangles,
            wireframe: false,
            color_write: ColorMask::ALL,
            constants: &[],
        }
    }
}

/// A raw pipeline with its end.
pub(crate) struct Pipeline {
    device: Device,
    raw: vk::Pipeline,
}

impl Pipeline {
    pub fn own(device: &Device, raw: vk::Pipeline, name: &str) -> Self {
        device.0.name(raw, name);
        Self {
            device: device.clone(),
            raw,
        }
    }

    pub fn raw(&self) -> vk::Pipeline {
        self.raw
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        self.device.0.bury(Garbage::Pipeline(self.raw));
    }
}

/// A shader module for the time of making a pipeline.
pub(crate) struct Module {
    device: Device,
    pub raw: vk::ShaderModule,
}

impl Module {
    pub fn new(device: &Device, code: &Spirv) -> Result<Self, Error> {
        let info = vk::ShaderModuleCreateInfo::default().code(code.words());
        // SAFETY: the words are a module that glslang made for this Vulkan version.
        let raw = unsafe { device.vk().create_shader_module(&info, None) }
            .context("vkCreateShaderModule")?;
        device.0.name(raw, code.name());
        Ok(Self {
            device: device.clone(),
            raw,
        })
    }
}

impl Drop for Module {
    fn drop(&mut self) {
        // SAFETY: modules may go once their pipelines are made.
        unsafe { self.device.vk().destroy_shader_module(self.raw, None) };
    }
}

/// Specialization constants in Vulkan's form.
pub(crate) struct Constants {
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl Constants {
    pub fn new(constants: &[(u32, u32)]) -> Self {
        Self {
            entries: (0u32..)
                .zip(constants)
                .map(|(i, (id, _))| vk::SpecializationMapEntry {
                    constant_id: *id,
                    offset: i * 4,
                    size: 4,
                })
                .collect(),
            data: constants
                .iter()
                .flat_map(|(_, value)| value.to_ne_bytes())
                .collect(),
        }
    }

    pub fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default()
            .map_entries(&self.entries)
            .data(&self.data)
    }
}

/// A pipeline for draws.
pub struct GraphicsPipeline(Pipeline);

impl GraphicsPipeline {
    /// Compiles a pipeline.
    ///
    /// # Errors
    /// Wireframe on a device without it; the driver's refusal.
    pub fn new(device: &Device, desc: &GraphicsDesc<'_>) -> Result<Self, Error> {
        if desc.wireframe && !device.0.info.wireframe {
            return Err(Error::Unsupported {
                name: desc.name.to_owned(),
                what: "wireframe (fillModeNonSolid)".to_owned(),
                device: device.0.info.name.clone(),
            });
        }
        let constants = Constants::new(desc.constants);
        let constants = constants.info();
        let vertex = Module::new(device, desc.vertex)?;
        let fragment = desc
            .fragment
            .map(|code| Module::new(device, code))
            .transpose()?;
        let stage = |module: &Module, flags| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(flags)
                .module(module.raw)
                .name(c"main")
        };
        let mut stages =
            vec![stage(&vertex, vk::ShaderStageFlags::VERTEX).specialization_info(&constants)];
        if let Some(fragment) = &fragment {
            stages.push(
                stage(fragment, vk::ShaderStageFlags::FRAGMENT).specialization_info(&constants),
            );
        }
        let input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(match desc.topology {
                Topology::Triangles => vk::PrimitiveTopology::TRIANGLE_LIST,
                Topology::TriangleStrip => vk::PrimitiveTopology::TRIANGLE_STRIP,
                Topology::Lines => vk::PrimitiveTopology::LINE_LIST,
                Topology::Points => vk::PrimitiveTopology::POINT_LIST,
            });
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let (slope, units) = desc.polygon_offset.unwrap_or_default();
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(if desc.wireframe {
                vk::PolygonMode::LINE
            } else {
                vk::PolygonMode::FILL
            })
            .cull_mode(match desc.cull {
                Cull::None => vk::CullModeFlags::NONE,
                Cull::Front => vk::CullModeFlags::FRONT,
                Cull::Back => vk::CullModeFlags::BACK,
            })
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .depth_bias_enable(desc.polygon_offset.is_some())
            .depth_bias_slope_factor(slope)
            .depth_bias_constant_factor(units)
            .line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(desc.samples.max(1)));
        let stencil = desc
            .stencil
            .filter(|_| desc.depth.is_some_and(Format::has_stencil));
        let mut depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(desc.depth.is_some())
            .depth_write_enable(desc.depth.is_some() && desc.depth_write)
            .depth_compare_op(match desc.depth_test {
                DepthTest::Always => vk::CompareOp::ALWAYS,
                DepthTest::LessEqual => vk::CompareOp::LESS_OR_EQUAL,
                DepthTest::Equal => vk::CompareOp::EQUAL,
            });
        if let Some(stencil) = stencil {
            depth = depth
                .stencil_test_enable(true)
                .front(stencil.vk())
                .back(stencil.vk());
        }
        let mut attachment = vk::PipelineColorBlendAttachmentState::default()
            .color_write_mask(desc.color_write.vk());
        if let Some((source, target)) = desc.blend {
            // SRC_ALPHA_SATURATE means 1 for the alpha channel, so one pair serves both.
            attachment = attachment
                .blend_enable(true)
                .src_color_blend_factor(source.vk())
                .dst_color_blend_factor(target.vk())
                .color_blend_op(vk::BlendOp::ADD)
                .src_alpha_blend_factor(source.vk())
                .dst_alpha_blend_factor(target.vk())
                .alpha_blend_op(vk::BlendOp::ADD);
        }
        let attachments = [attachment];
        let mut blend = vk::PipelineColorBlendStateCreateInfo::default();
        if desc.color.is_some() {
            blend = blend.attachments(&attachments);
        }
        let states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
        let render_pass = device.0.render_pass(RenderPassKey {
            color: desc.color.map(Format::vk),
            depth: desc.depth.map(Format::vk),
            samples: desc.samples.max(1),
            clear_color: false,
            clear_depth: false,
        })?;
        let infos = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(device.0.bindless.pipeline_layout)
            .render_pass(render_pass)];
        // SAFETY: everything that the description points to lives here; the modules declare the common layout.
        let made = unsafe {
            device
                .vk()
                .create_graphics_pipelines(device.0.pipeline_cache, &infos, None)
        };
        Ok(Self(one(
            device,
            made,
            "vkCreateGraphicsPipelines",
            desc.name,
        )?))
    }

    pub(crate) fn raw(&self) -> vk::Pipeline {
        self.0.raw
    }
}

/// A pipeline for dispatches.
pub struct ComputePipeline(Pipeline);

impl ComputePipeline {
    /// Compiles a pipeline; `constants` are specialization constants, id and 32-bit value.
    ///
    /// # Errors
    /// The driver's refusal.
    pub fn new(
        device: &Device,
        name: &str,
        code: &Spirv,
        constants: &[(u32, u32)],
    ) -> Result<Self, Error> {
        let constants = Constants::new(constants);
        let constants = constants.info();
        let module = Module::new(device, code)?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.raw)
            .name(c"main")
            .specialization_info(&constants);
        let infos = [vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(device.0.bindless.pipeline_layout)];
        // SAFETY: as for graphics.
        let made = unsafe {
            device
                .vk()
                .create_compute_pipelines(device.0.pipeline_cache, &infos, None)
        };
        Ok(Self(one(device, made, "vkCreateComputePipelines", name)?))
    }

    pub(crate) fn raw(&self) -> vk::Pipeline {
        self.0.raw
    }
}

/// The one pipeline of a creation call.
pub(crate) fn one(
    device: &Device,
    made: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
    call: &'static str,
    name: &str,
) -> Result<Pipeline, Error> {
    match made {
        Ok(pipelines) => match pipelines.first() {
            Some(raw) => Ok(Pipeline::own(device, *raw, name)),
            None => Err(Error::Vulkan {
                call,
                result: vk::Result::ERROR_UNKNOWN,
            }),
        },
        Err((_, result)) => {
            log::error!("pipeline `{name}` was refused");
            Err(result).context(call)
        }
    }
}

/// Marks a saved pipeline cache; the number is the form's version.
const CACHE_MAGIC: &[u8; 8] = b"RLPCACH1";

/// FNV-1a.
pub fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// A driver's cache with a mark and a hash before it: drivers check whose cache it is, not whether it is whole.
pub(crate) fn cache_to_bytes(data: &[u8]) -> Vec<u8> {
    let mut bytes = CACHE_MAGIC.to_vec();
    bytes.extend(hash(data).to_le_bytes());
    bytes.extend(data);
    bytes
}

/// The driver's part of a saved cache, if it is whole.
pub(crate) fn cache_from_bytes(bytes: &[u8]) -> Option<&[u8]> {
    let rest = bytes.strip_prefix(CACHE_MAGIC)?;
    let (sum, data) = rest.split_at_checked(8)?;
    (sum == hash(data).to_le_bytes()).then_some(data)
}

/// Whether bytes are a whole cache as [`Device::pipeline_cache_data`] gives it. Whose it is, the driver knows.
pub fn is_pipeline_cache(bytes: &[u8]) -> bool {
    cache_from_bytes(bytes).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_pipeline_cache_is_not_given_to_the_driver() {
        let good = cache_to_bytes(&[1, 2, 3, 4]);
        assert_eq!(cache_from_bytes(&good), Some(&[1u8, 2, 3, 4][..]));
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 0x40;
            assert_eq!(cache_from_bytes(&bad), None, "byte {at}");
            assert_eq!(cache_from_bytes(&good[..at]), None, "cut at {at}");
        }
    }
}
