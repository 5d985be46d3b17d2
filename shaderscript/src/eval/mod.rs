//! Evaluation of materials at a moment: waves, noise, colours, texture coordinates, deformed vertices.
//!
//! All functions follow the engine's own arithmetic, including the resolution of its 1024-entry tables, so that the
//! classic look can be compared with it; the GLSL versions are tested against these. Times are seconds in `f64`:
//! after hours of play a 32-bit float no longer resolves a frame.
//!
//! Positions, normals and directions are in the entity's own space (world space for the world).

mod color;
mod deform;
mod noise;
mod texcoord;
mod wave;

pub use color::{
    ColorContext, DiffuseLight, alpha_gen, diffuse, rgb_gen, specular_alpha, vertex_color,
};
pub use deform::{DeformContext, DeformVertex, ShadowProjection, deform};
pub use noise::{NOISE_SIZE, noise_permutation, noise_values, noise4};
pub use texcoord::{apply_tc_mods, environment, tex_coord};
pub use wave::{TABLE_SIZE, shape, shape_index, sine, wave};

use crate::shader::Shader;

impl Shader {
    /// Time that the material's animations see, in seconds.
    ///
    /// `time` is the scene's, `entity_time` the entity's own start time (`shaderTime`), `offset` the one that a
    /// remapping set.
    pub fn shader_time(&self, time: f64, entity_time: f64, offset: f64) -> f64 {
        let time = time - entity_time - offset;
        match self.clamp_time {
            Some(clamp) => time.min(f64::from(clamp)),
            None => time,
        }
    }
}

/// Byte of a colour channel, truncated and clamped as the engine's conversions do together.
fn byte(value: f32) -> u8 {
    // A float-to-integer `as` saturates and takes NaN to 0.
    value as u8
}
