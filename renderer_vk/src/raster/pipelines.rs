//! The pipelines of the classic look, one for each draw state, created at first use.

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
    /// Culled faces.
    pub cull: CullFaces,
    /// Decal offset.
    pub offset: bool,
    /// Draws edges only.
    pub wireframe: bool,
    /// Specialization of the shaders.
    pub shading: Shading,
}

impl State {
    /// White over what is not nearer, with its depth.
    pub const fn plain(cull: CullFaces) -> State {
        State {
            blend: None,
            depth: Depth::LessEqual,
            depth_write: true,
            cull,
            offset: false,
            wireframe: false,
            shading: Shading::WHITE,
        }
    }
}

/// Depth comparison of a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Depth {
    /// Always passes.
    Always,
    /// Nearer or equal.
    LessEqual,
    /// Equal.
    Equal,
}

/// Culled faces. The engine's front faces wind clockwise on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CullFaces {
    /// None.
    None,
    /// Faces that wind clockwise.
    Clockwise,
    /// Faces that wind counter-clockwise.
    CounterClockwise,
}

/// The engine's window has no alpha channel, so destination alpha is 1; the image here has one.
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

/// Pipelines created or kept since the last call of [`keep`](Pipelines::keep).
pub struct Pipelines {
    device: Device,
    offset: (f32, f32),
    made: HashMap<(TargetKind, State), GraphicsPipeline>,
}

impl Pipelines {
    /// No pipelines. `offset`: factor and units of the decals' depth offset.
    pub fn new(device: &Device, offset: (f32, f32)) -> Self {
        Self {
            device: device.clone(),
            offset,
            made: HashMap::new(),
        }
    }

    /// Sets the decals' depth offset; drops pipelines with another one.
    pub fn set_offset(&mut self, offset: (f32, f32)) {
        if self.offset != offset {
            self.offset = offset;
            self.made.retain(|(_, state), _| !state.offset);
        }
    }

    /// Drops the pipelines of all other states, such as those of earlier maps. Frames in flight keep those that they
    /// use.
    pub fn keep(&mut self, states: &HashSet<State>) {
        self.made.retain(|(_, state), _| states.contains(state));
    }

    /// Whether the pipeline of `state` exists.
    pub fn is_made(&self, target: TargetKind, state: State) -> bool {
        self.made.contains_key(&(target, state))
    }

    /// Creates the pipeline of `state` unless it exists.
    ///
    /// # Errors
    /// The device cannot make it.
    pub fn prepare(&mut self, target: TargetKind, state: State) -> Result<(), gpu::Error> {
        if self.is_made(target, state) {
            return Ok(());
        }
        let depth_alone = state.shading.mode == c::DRAW_DEPTH;
        // smaller shaders compile faster
        let modified = state.shading.tc_mods != 0;
        let several_inputs = state.shading.mode == c::DRAW_PIXEL_LIGHT;
        let many = state.shading.has_stages() || several_inputs || modified || target.counted;
        let mapped = state.shading.mapping != 0 && !target.counted;
        let hybrid = state.shading.is_hybrid() && !target.counted;
        let vertex = if depth_alone {
            &shaders::RASTER_DRAW_VERT_DEPTH
        } else if mapped {
            &shaders::RASTER_DRAW_VERT_MAPPED
        } else if hybrid {
            &shaders::RASTER_DRAW_VERT_HYBRID
        } else if modified {
            &shaders::RASTER_DRAW_VERT_MODIFIED
        } else if many {
            &shaders::RASTER_DRAW_VERT_MANY
        } else {
            &shaders::RASTER_DRAW_VERT
        };
        let fragment = if target.counted {
            &shaders::RASTER_DRAW_FRAG_COUNT
        } else if hybrid && mapped {
            &shaders::RASTER_DRAW_FRAG_HYBRID_MAPPED
        } else if hybrid {
            &shaders::RASTER_DRAW_FRAG_HYBRID
        } else if mapped {
            &shaders::RASTER_DRAW_FRAG_MAPPED
        } else if many {
            &shaders::RASTER_DRAW_FRAG_MANY
        } else {
            &shaders::RASTER_DRAW_FRAG
        };
        let pipeline = GraphicsPipeline::new(
            &self.device,
            &GraphicsDesc {
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
                // in `gpu`, front faces wind counter-clockwise on the screen
                cull: match state.cull {
                    CullFaces::None => Cull::None,
                    CullFaces::Clockwise => Cull::Back,
                    CullFaces::CounterClockwise => Cull::Front,
                },
                polygon_offset: state.offset.then_some(self.offset),
                wireframe: state.wireframe && self.device.info().wireframe,
                constants: &state.shading.constants(),
                fragment: (!depth_alone).then_some(fragment),
                ..target.desc("raster", vertex, fragment)
            },
        )?;
        self.made.insert((target, state), pipeline);
        Ok(())
    }

    /// The pipeline of a prepared state.
    pub fn get(&self, target: TargetKind, state: State) -> Option<&GraphicsPipeline> {
        let made = self.made.get(&(target, state));
        debug_assert!(made.is_some(), "no pipeline for {state:?}");
        made
    }
}
