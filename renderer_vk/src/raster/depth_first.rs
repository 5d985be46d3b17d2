//! Depth before colour: what of the world hides all that lies behind it is drawn into the depth image first, so that of
//! surfaces behind each other only the one in sight is textured.
//!
//! The picture stays the same to the bit: positions are `invariant`, so such a surface still passes `LessEqual` wherever
//! it is in sight at the end, and what it would have overwritten is not drawn at all. It costs a vertex pass without
//! fragments. Left out are views with a clip plane, where fragments decide what is there.

use shaders::types::Draw;
use shaders::types::constants as c;
use shaderscript::sort;

use super::list::{Call, DepthRange, DrawList};
use super::pipelines::{Depth, State};
use super::shading::Shading;
use crate::assets::Material;

/// Whether the first pass of a material draws, and writes the depth of, everything that its surfaces cover.
pub(super) fn covers(material: &Material) -> bool {
    let all_of_it = material.passes.first().is_some_and(|pass| {
        pass.blend.is_none()
            && pass.depth_write
            && pass.depth_test
            && !pass.depth_equal
            && pass.alpha_func == c::ALPHAFUNC_NONE
    });
    all_of_it && material.sort <= sort::OPAQUE && !material.polygon_offset
}

/// Whether it cannot be seen when a material's surfaces are drawn before or after others of which that is true: of all of
/// them the nearest one is left in each pixel, with nothing of those behind it.
pub(super) fn order_free(material: &Material) -> bool {
    let Some((first, rest)) = material.passes.split_first() else {
        return material.sort <= sort::OPAQUE;
    };
    let hides = first.blend.is_none()
        && first.depth_write
        && first.depth_test
        && !first.depth_equal
        && material.sort <= sort::OPAQUE
        && !material.polygon_offset;
    // in the holes of the first pass the others would show, over what is drawn so far
    let holes = first.alpha_func != c::ALPHAFUNC_NONE;
    hides && (rest.iter()).all(|pass| pass.depth_test && (pass.depth_equal || !holes))
}

/// How the depth of a material's surfaces is drawn first, if it may be; `plain` is how they are drawn later on.
pub(super) fn state(material: &Material, plain: State) -> Option<State> {
    covers(material).then_some(State {
        blend: None,
        depth: Depth::LessEqual,
        depth_write: true,
        shading: Shading {
            mode: c::DRAW_DEPTH,
            ..Shading::WHITE
        },
        ..plain
    })
}

impl DrawList {
    /// Takes note of a group of unmoving surfaces with indices `span`. `plain` and `draw` are the group's.
    pub(super) fn note_depth(
        &mut self,
        material: &Material,
        plain: State,
        span: (u32, u32),
        draw: Draw,
    ) {
        let Some(state) = state(material, plain) else {
            return;
        };
        if let Some(last) = self.depth_first.last_mut() {
            let instance = self.draws.get(last.draw as usize).map(|d| d.instance);
            let continues = last.first_index + last.index_count == span.0;
            if continues && instance == Some(draw.instance) && last.state == state {
                last.index_count += span.1;
                return;
            }
        }
        self.depth_first.push(Call {
            state,
            range: DepthRange::Normal,
            first_index: span.0,
            index_count: span.1,
            draw: self.draws.len() as u32,
        });
        self.draws.push(draw);
    }

    /// Puts what was noted before all other calls.
    pub(super) fn put_depth_first(&mut self) {
        self.calls.splice(0..0, self.depth_first.drain(..));
    }
}
