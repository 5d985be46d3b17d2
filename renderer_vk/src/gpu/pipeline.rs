//! Graphics and compute pipelines. All have the same layout: the bindless set and 128 bytes of push constants.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;
use shaders::Spirv;

use super::device::Device;
use super::draw_state::{BlendFactor, ColorMask, Cull, DepthTest, Stencil, Topology};
use super::dynamic_state::DynamicState;
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::image::Format;
use super::render_pass::RenderPassKey;
use super::spirv::without_clock;

/// Parameters of a [`GraphicsPipeline`].
#[derive(Clone, Copy, Debug)]
pub struct GraphicsDesc<'a> {
    /// Label.
    pub name: &'a str,
    /// Vertex shader; it fetches vertices by `gl_VertexIndex`, without vertex input.
    pub vertex: &'a Spirv,
    /// Fragment shader; `None` for depth alone.
    pub fragment: Option<&'a Spirv>,
    /// Format of the colour attachment.
    pub color: Option<Format>,
    /// Format of the depth attachment.
    pub depth: Option<Format>,
    /// Source and destination factor of additive blending; `None`: no blending.
    pub blend: Option<(BlendFactor, BlendFactor)>,
    /// Depth test; no effect without a depth attachment.
    pub depth_test: DepthTest,
    /// Depth writes.
    pub depth_write: bool,
    /// Stencil operation; requires a depth attachment with stencil. `None`: no stencil.
    pub stencil: Option<Stencil>,
    /// Samples per pixel of the attachments.
    pub samples: u32,
    /// Culled faces.
    pub cull: Cull,
    /// Slope factor and constant units of the depth offset, as in OpenGL's `glPolygonOffset`.
    pub polygon_offset: Option<(f32, f32)>,
    /// Primitive topology.
    pub topology: Topology,
    /// Draw the edges of triangles only (needs the device's `wireframe`).
    pub wireframe: bool,
    /// Written channels.
    pub color_write: ColorMask,
    /// Specialization constants: id and 32-bit value.
    pub constants: &'a [(u32, u32)],
}

impl<'a> GraphicsDesc<'a> {
    /// No attachments, blending or culling; depth is tested with `LessEqual` and written if there is an attachment.
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

    fn rasterization(&self) -> vk::PipelineRasterizationStateCreateInfo<'static> {
        // Without an offset both are 0 and the bias is off.
        let (slope, units) = self.polygon_offset.unwrap_or_default();
        vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(if self.wireframe {
                vk::PolygonMode::LINE
            } else {
                vk::PolygonMode::FILL
            })
            .cull_mode(self.cull.vk())
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .depth_bias_enable(self.polygon_offset.is_some())
            .depth_bias_slope_factor(slope)
            .depth_bias_constant_factor(units)
            .line_width(1.0)
    }

    fn depth_stencil(&self) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(self.depth.is_some())
            .depth_write_enable(self.depth.is_some() && self.depth_write)
            .depth_compare_op(self.depth_test.vk());
        let has_stencil = self.depth.is_some_and(Format::has_stencil);
        match self.stencil.filter(|_| has_stencil) {
            Some(stencil) => depth
                .stencil_test_enable(true)
                .front(stencil.vk())
                .back(stencil.vk()),
            None => depth,
        }
    }

    fn blending(&self) -> vk::PipelineColorBlendAttachmentState {
        let attachment = vk::PipelineColorBlendAttachmentState::default()
            .color_write_mask(self.color_write.vk());
        let Some((source, target)) = self.blend else {
            return attachment;
        };
        // SRC_ALPHA_SATURATE is 1 for the alpha channel, so that one pair of factors serves both.
        attachment
            .blend_enable(true)
            .src_color_blend_factor(source.vk())
            .dst_color_blend_factor(target.vk())
            .color_blend_op(vk::BlendOp::ADD)
            .src_alpha_blend_factor(source.vk())
            .dst_alpha_blend_factor(target.vk())
            .alpha_blend_op(vk::BlendOp::ADD)
    }
}

/// A raw pipeline; dropping it buries it.
pub(crate) struct Pipeline {
    device: Device,
    raw: vk::Pipeline,
}

impl Pipeline {
    pub fn own(device: &Device, raw: vk::Pipeline, name: &str) -> Self {
        device.0.name(raw, name);
        device.0.compiled.fetch_add(1, Ordering::Relaxed);
        device.0.live_pipelines.fetch_add(1, Ordering::Relaxed);
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

/// A shader module during the compilation of a pipeline.
pub(crate) struct Module {
    device: Device,
    pub raw: vk::ShaderModule,
}

impl Module {
    pub fn new(device: &Device, code: &Spirv) -> Result<Self, Error> {
        let words = match device.info().shader_clock {
            true => code.words().into(),
            false => without_clock(code.words()),
        };
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are a module that glslang made for this Vulkan version, without what the device lacks.
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
        // SAFETY: modules may be destroyed once their pipelines are made.
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

/// A graphics pipeline, with the state that may be dynamic.
pub struct GraphicsPipeline {
    pipeline: Arc<Pipeline>,
    state: DynamicState,
}

impl GraphicsPipeline {
    /// Compiles a pipeline; with dynamic state, reuses one that differs only in blending, culling and depth tests.
    ///
    /// # Errors
    /// Wireframe on a device without it; an error of the driver.
    pub fn new(device: &Device, desc: &GraphicsDesc<'_>) -> Result<Self, Error> {
        let pipeline = if device.0.dynamic_state.is_some() {
            device
                .0
                .shared_pipelines
                .get(desc, || Self::compile(device, desc))?
        } else {
            Arc::new(Self::compile(device, desc)?)
        };
        Ok(Self {
            pipeline,
            state: DynamicState::of(desc),
        })
    }

    fn compile(device: &Device, desc: &GraphicsDesc<'_>) -> Result<Pipeline, Error> {
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
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(desc.topology.vk());
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let raster = desc.rasterization();
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(desc.samples.max(1)));
        let depth = desc.depth_stencil();
        let attachments = [desc.blending()];
        let mut blend = vk::PipelineColorBlendStateCreateInfo::default();
        if desc.color.is_some() {
            blend = blend.attachments(&attachments);
        }
        let mut states = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        if device.0.dynamic_state.is_some() {
            states.extend(DynamicState::STATES);
        }
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
        // SAFETY: all pointers of the description are to live data; the modules declare the common layout.
        let made = unsafe {
            device
                .vk()
                .create_graphics_pipelines(device.0.pipeline_cache, &infos, None)
        };
        one(device, made, "vkCreateGraphicsPipelines", desc.name)
    }

    pub(crate) fn raw(&self) -> vk::Pipeline {
        self.pipeline.raw
    }

    pub(crate) fn state(&self) -> DynamicState {
        self.state
    }
}

/// A compute pipeline.
pub struct ComputePipeline {
    pipeline: Pipeline,
    local_size: [u32; 3],
}

impl ComputePipeline {
    /// Compiles a pipeline; `constants` are specialization constants, id and 32-bit value.
    ///
    /// # Errors
    /// An error of the driver.
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
        // SAFETY: as for graphics pipelines.
        let made = unsafe {
            device
                .vk()
                .create_compute_pipelines(device.0.pipeline_cache, &infos, None)
        };
        Ok(Self {
            pipeline: one(device, made, "vkCreateComputePipelines", name)?,
            local_size: code.local_size().map(|n| n.max(1)),
        })
    }

    /// Invocations of a work group along each axis.
    pub fn local_size(&self) -> [u32; 3] {
        self.local_size
    }

    pub(crate) fn raw(&self) -> vk::Pipeline {
        self.pipeline.raw
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
            log::error!("the driver did not compile pipeline `{name}`");
            Err(result).context(call)
        }
    }
}
