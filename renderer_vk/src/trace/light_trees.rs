//! The trees from which lights are drawn with `rt_lightSelection 2`: one over the constant lights of a map, uploaded
//! once; one over its lights that move or change, refitted and uploaded each frame.

use std::time::Instant;

use shaders::trace_types::LightView;

use super::light_tree::{Emission, LightTree};
use crate::gpu::{Buffer, BufferUsage, Device, Error, Recorder};

/// The trees of a map.
pub struct LightTrees {
    nodes: Buffer,
    count: u32,
    changing: LightTree,
    /// Wall time of building both, milliseconds.
    pub build_ms: f64,
    /// Bytes of the nodes of both.
    pub bytes: u64,
}

impl LightTrees {
    /// Builds the trees; each light with its number.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        constant: &[(u32, Emission)],
        changing: &[(u32, Emission)],
    ) -> Result<Self, Error> {
        let before = Instant::now();
        let nodes = LightTree::new(constant).shader_nodes();
        let changing = LightTree::new(changing);
        let moving = changing.shader_nodes();
        let build_ms = before.elapsed().as_secs_f64() * 1000.0;
        let bytes = size_of_val(nodes.as_slice()) + size_of_val(moving.as_slice());
        Ok(Self {
            nodes: Buffer::with_data(device, "trace light tree", BufferUsage::STORAGE, &nodes)?,
            count: u32::try_from(nodes.len()).unwrap_or(0),
            changing,
            build_ms,
            bytes: bytes as u64,
        })
    }

    /// Puts the trees into the parameters of a frame. `present`: state of the lights that move or change, see
    /// [`LightTree::refitted`].
    ///
    /// # Errors
    /// Out of memory.
    pub fn add_to(
        &self,
        rec: &mut Recorder,
        present: &[(usize, u32, Emission)],
        lights: &mut LightView,
    ) -> Result<(), Error> {
        (lights.tree, lights.tree_nodes) = (self.nodes.address(), self.count);
        let moving = self
            .changing
            .refitted(present.iter().copied())
            .shader_nodes();
        if !moving.is_empty() {
            lights.changing_tree = rec.arena().push(&moving)?;
            lights.changing_tree_nodes = u32::try_from(moving.len()).unwrap_or(0);
        }
        Ok(())
    }
}
