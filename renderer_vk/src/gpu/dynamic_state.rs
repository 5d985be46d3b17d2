//! Dynamic state: on devices that support it, pipelines that differ only in this state are shared. A software driver
//! takes milliseconds to compile one, and the materials of a map need half as many.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, Weak};

use ash::{ext, vk};

use super::device::lock;
use super::draw_state::{BlendFactor, ColorMask, Cull, DepthTest, Stencil, Topology};
use super::image::Format;
use super::pipeline::{GraphicsDesc, Pipeline};

/// State of a draw that is not part of a pipeline if the device supports it as dynamic state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DynamicState {
    pub cull: Cull,
    pub depth_test: DepthTest,
    pub depth_write: bool,
    pub blend: Option<(BlendFactor, BlendFactor)>,
}

impl DynamicState {
    /// The dynamic states of a pipeline.
    pub const STATES: [vk::DynamicState; 5] = [
        vk::DynamicState::CULL_MODE_EXT,
        vk::DynamicState::DEPTH_COMPARE_OP_EXT,
        vk::DynamicState::DEPTH_WRITE_ENABLE_EXT,
        vk::DynamicState::COLOR_BLEND_ENABLE_EXT,
        vk::DynamicState::COLOR_BLEND_EQUATION_EXT,
    ];

    pub fn of(desc: &GraphicsDesc<'_>) -> Self {
        Self {
            cull: desc.cull,
            depth_test: desc.depth_test,
            depth_write: desc.depth.is_some() && desc.depth_write,
            blend: desc.blend,
        }
    }
}

/// Commands that set the state.
pub(crate) struct DynamicStateCommands {
    base: ext::extended_dynamic_state::Device,
    blending: ext::extended_dynamic_state3::Device,
}

impl DynamicStateCommands {
    /// Loads the commands of a device with both extensions and their features.
    pub fn new(instance: &ash::Instance, device: &ash::Device) -> Self {
        Self {
            base: ext::extended_dynamic_state::Device::new(instance, device),
            blending: ext::extended_dynamic_state3::Device::new(instance, device),
        }
    }

    /// Records the parts of `wanted` that differ from the last recorded state of this pass.
    pub fn record(&self, cmd: vk::CommandBuffer, wanted: DynamicState, last: Option<DynamicState>) {
        let (source, target) = wanted
            .blend
            .unwrap_or((BlendFactor::One, BlendFactor::Zero));
        let equation = vk::ColorBlendEquationEXT::default()
            .src_color_blend_factor(source.vk())
            .dst_color_blend_factor(target.vk())
            .src_alpha_blend_factor(source.vk())
            .dst_alpha_blend_factor(target.vk());
        if last.map(|t| t.cull) != Some(wanted.cull) {
            // SAFETY: recording, and the feature is on.
            unsafe { self.base.cmd_set_cull_mode(cmd, wanted.cull.vk()) };
        }
        if last.map(|t| t.depth_test) != Some(wanted.depth_test) {
            let test = wanted.depth_test.vk();
            // SAFETY: as above.
            unsafe { self.base.cmd_set_depth_compare_op(cmd, test) };
        }
        if last.map(|t| t.depth_write) != Some(wanted.depth_write) {
            let write = wanted.depth_write;
            // SAFETY: as above.
            unsafe { self.base.cmd_set_depth_write_enable(cmd, write) };
        }
        if last.map(|t| t.blend) != Some(wanted.blend) {
            let on = [wanted.blend.is_some().into()];
            // SAFETY: as above.
            unsafe { self.blending.cmd_set_color_blend_enable(cmd, 0, &on) };
            // SAFETY: as above.
            unsafe {
                self.blending
                    .cmd_set_color_blend_equation(cmd, 0, &[equation]);
            }
        }
    }
}

/// Everything that determines a pipeline besides its [`DynamicState`].
#[derive(PartialEq, Eq, Hash)]
struct Key {
    /// Names identify modules.
    shaders: [Option<&'static str>; 2],
    formats: [Option<Format>; 2],
    stencil: Option<Stencil>,
    samples: u32,
    polygon_offset: Option<[u32; 2]>,
    topology: Topology,
    wireframe: bool,
    color_write: ColorMask,
    constants: Box<[(u32, u32)]>,
}

impl Key {
    fn of(desc: &GraphicsDesc<'_>) -> Self {
        Self {
            shaders: [Some(desc.vertex.name()), desc.fragment.map(|f| f.name())],
            formats: [desc.color, desc.depth],
            stencil: desc.stencil,
            samples: desc.samples,
            polygon_offset: desc.polygon_offset.map(|(f, u)| [f.to_bits(), u.to_bits()]),
            topology: desc.topology,
            wireframe: desc.wireframe,
            color_write: desc.color_write,
            constants: desc.constants.into(),
        }
    }
}

/// The pipelines that exist, by key.
#[derive(Default)]
pub(crate) struct Shared(Mutex<HashMap<Key, Weak<Pipeline>>>);

impl Shared {
    /// The existing pipeline with this key, or the result of `make`.
    pub fn get<E>(
        &self,
        desc: &GraphicsDesc<'_>,
        make: impl FnOnce() -> Result<Pipeline, E>,
    ) -> Result<Arc<Pipeline>, E> {
        let key = Key::of(desc);
        if let Some(made) = lock(&self.0).get(&key).and_then(Weak::upgrade) {
            return Ok(made);
        }
        let made = Arc::new(make()?);
        let mut all = lock(&self.0);
        all.retain(|_, pipeline| pipeline.strong_count() > 0);
        all.insert(key, Arc::downgrade(&made));
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blending_culling_and_depth_tests_are_no_part_of_a_pipeline() {
        let plain = GraphicsDesc::new("a", &shaders::RASTER_DRAW_VERT, &shaders::RASTER_DRAW_FRAG);
        let other = GraphicsDesc {
            name: "b",
            blend: Some((BlendFactor::One, BlendFactor::One)),
            cull: Cull::Back,
            depth_test: DepthTest::Always,
            depth_write: false,
            ..plain
        };
        assert!(Key::of(&plain) == Key::of(&other));
        let differ = [
            GraphicsDesc {
                fragment: None,
                ..plain
            },
            GraphicsDesc {
                vertex: &shaders::RASTER_DRAW_VERT_DEPTH,
                ..plain
            },
            GraphicsDesc {
                color: Some(Format::Rgba8),
                ..plain
            },
            GraphicsDesc {
                depth: Some(Format::D32F),
                ..plain
            },
            GraphicsDesc {
                stencil: Some(Stencil::NotZero),
                ..plain
            },
            GraphicsDesc {
                samples: 4,
                ..plain
            },
            GraphicsDesc {
                polygon_offset: Some((0.0, 0.0)),
                ..plain
            },
            GraphicsDesc {
                topology: Topology::Lines,
                ..plain
            },
            GraphicsDesc {
                wireframe: true,
                ..plain
            },
            GraphicsDesc {
                color_write: ColorMask::NONE,
                ..plain
            },
            GraphicsDesc {
                constants: &[(0, 1)],
                ..plain
            },
        ];
        for desc in differ {
            assert!(Key::of(&plain) != Key::of(&desc), "{desc:?}");
        }
    }
}
