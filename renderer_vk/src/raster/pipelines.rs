//! The pipelines of the classic look: one for each combination of state that a stage asks for, made when first used.

use std::collections::{HashMap, HashSet};

use shaders::types::constants as c;

use super::shading::Shading;
use super::target::TargetKind;
use crate::gpu::{
    self, BlendFactor, ColorMask, Cull, DepthTest, Device, GraphicsDesc, GraphicsPipeline,
};

/// Fixed-function state of a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct State {
    /// Source and destination factor, `BLEND_*`; `None` overwrites.
    pub blend: Option<(u32, u32)>,
    /// Depth comparison.
    pub depth: Depth,
    /// Whether depth is written.
    pub depth_write: bool,
    /// Faces that are not drawn.
    pub cull: CullFaces,
    /// Decal offset.
    pub offset: bool,
    /// Edges only.
    pub wireframe: bool,
    /// What the shaders do.
    pub shading: Shading,
}

/// Depth comparison of a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Depth {
    /// None.
    Always,
    /// Nearer or the same.
    LessEqual,
    /// The same.
    Equal,
}

/// Which faces are dropped. The engine's front faces wind clockwise on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CullFaces {
    /// None.
    None,
    /// Those that wind clockwise.
    Clockwise,
    /// Those that wind counter-clockwise.
    CounterClockwise,
}

/// The engine draws into a window without alpha, which reads as 1; the image here has one.
fn factor(blend: u32) -> BlendFactor {
    match blend {
        c::BLEND_ZERO | c::BLEND_ONE_MINUS_DST_ALPHA | c::BLEND_SRC_ALPHA_SATURATE => {
            BlendFactor::Zero
        }
        c::BLEND_DST_COLOR => BlendFactor::DstColor,
        c::BLEND_ONE_MINUS_DST_COLOR => BlendFactor::OneMinusDstColor,
        c::BLEND_SRC_ALPHA => BlendFactor::SrcAlpha,
        c::BLEND_ONE_MINUS_SRC_ALPHA => BlendFactor::OneMinusSrcAlpha,
        c::BLEND_SRC_COLOR => BlendFactor::SrcColor,
        c::BLEND_ONE_MINUS_SRC_COLOR => BlendFactor::OneMinusSrcColor,
        _ => BlendFactor::One,
    }
}

/// The pipelines made since the last call of [`keep`](Pipelines::keep), and those that it kept.
pub struct Pipelines {
    device: Device,
    offset: (f32, f32),
    made: HashMap<(TargetKind, State), GraphicsPipeline>,
}

impl Pipelines {
    /// None yet; `offset` is the decals' factor and units.
    pub fn new(device: &Device, offset: (f32, f32)) -> Self {
        Self {
            device: device.clone(),
            offset,
            made: HashMap::new(),
        }
    }

    /// Changes the decals' offset; pipelines made with another one are dropped.
    pub fn set_offset(&mut self, offset: (f32, f32)) {
        if self.offset != offset {
            self.offset = offset;
            self.made.retain(|(_, state), _| !state.offset);
        }
    }

    /// Drops the pipelines of all other states, those of earlier maps among them. Frames that still use one keep it.
    pub fn keep(&mut self, states: &HashSet<State>) {
        self.made.retain(|(_, state), _| states.contains(state));
    }

    /// Whether the pipeline of `state` is there.
    pub fn is_made(&self, target: TargetKind, state: State) -> bool {
        self.made.contains_key(&(target, state))
    }

    /// Makes the pipeline of `state` unless it is there.
    ///
    /// # Errors
    /// The device cannot make it.
    pub fn prepare(&mut self, target: TargetKind, state: State) -> Result<(), gpu::Error> {
        if self.is_made(target, state) {
            return Ok(());
        }
        let depth_alone = state.shading.mode == c::DRAW_DEPTH;
        // a driver makes a pipeline the sooner the less there is in its shaders
        let modified = state.shading.tc_mods != 0;
        let many = state.shading.has_stages() || modified || target.counted;
        let vertex = if depth_alone {
            &shaders::RASTER_DRAW_VERT_DEPTH
        } else if modified {
            &shaders::RASTER_DRAW_VERT_MODIFIED
        } else if many {
            &shaders::RASTER_DRAW_VERT_MANY
        } else {
            &shaders::RASTER_DRAW_VERT
        };
        let fragment = if target.counted {
            &shaders::RASTER_DRAW_FRAG_COUNT
        } else if many {
            &shaders::RASTER_DRAW_FRAG_MANY
        } else {
            &shaders::RASTER_DRAW_FRAG
        };
        let pipeline = GraphicsPipeline::new(
            &self.device,
            &GraphicsDesc {
                color: Some(target.color),
                depth: Some(target.depth),
                samples: target.samples,
                color_write: if depth_alone {
                    ColorMask::NONE
                } else {
                    target.mask
                },
                blend: state.blend.map(|(s, d)| (factor(s), factor(d))),
                depth_test: match state.depth {
                    Depth::Always => DepthTest::Always,
                    Depth::LessEqual => DepthTest::LessEqual,
                    Depth::Equal => DepthTest::Equal,
                },
                depth_write: state.depth_write,
                // gpu's front is counter-clockwise as it lies on the screen
                cull: match state.cull {
                    CullFaces::None => Cull::None,
                    CullFaces::Clockwise => Cull::Back,
                    CullFaces::CounterClockwise => Cull::Front,
                },
                polygon_offset: state.offset.then_some(self.offset),
                wireframe: state.wireframe && self.device.info().wireframe,
                constants: &state.shading.constants(),
                fragment: (!depth_alone).then_some(fragment),
                ..GraphicsDesc::new("raster", vertex, fragment)
            },
        )?;
        self.made.insert((target, state), pipeline);
        Ok(())
    }

    /// The pipeline of a prepared state.
    pub fn get(&self, target: TargetKind, state: State) -> Option<&GraphicsPipeline> {
        self.made.get(&(target, state))
    }
}
