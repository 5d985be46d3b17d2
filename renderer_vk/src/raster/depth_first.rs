//! Depth prepass: draws the depth of occluders of the world before colour, so that only visible fragments are textured.
//!
//! The picture is bit-identical: positions are `invariant`, so an occluder still passes `LessEqual` where it is
//! visible, and what it would have overwritten is not drawn. The cost is a vertex pass without fragments. Curves have
//! many triangles and hide little, so they are omitted where vertices are processed in software. Views with a clip
//! plane have no prepass, because fragments decide visibility there.

use shaders::types::Draw;
use shaders::types::constants as c;
use shaderscript::sort;
use support::slice::{self, part, span};

use super::list::{Call, DepthRange, DrawList};
use super::pipelines::{CullFaces, State};
use super::shading::Shading;
use crate::assets::Material;
use crate::scene::{DrawSurface, Geometry};

/// Whether the first pass of a material writes colour and depth on all of its surfaces.
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

/// Whether the drawing order of a material's surfaces among others of such materials is invisible: each pixel shows
/// only the nearest of them.
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
    // later passes also draw in the first one's holes, over what is drawn so far
    let holes = first.alpha_func != c::ALPHAFUNC_NONE;
    hides && (rest.iter()).all(|pass| pass.depth_test && (pass.depth_equal || !holes))
}

/// State of a draw of depth only.
pub(super) fn depth_alone(cull: CullFaces) -> State {
    State {
        shading: Shading {
            mode: c::DRAW_DEPTH,
            ..Shading::WHITE
        },
        ..State::plain(cull)
    }
}

/// A surface of the prepass.
#[derive(Clone, Copy)]
pub(super) struct Occluder {
    cull: CullFaces,
    instance: u32,
    distance_squared: f32,
    /// First index in the map's indices.
    first_index: u32,
    index_count: u32,
}

impl DrawList {
    /// Collects the occluders of a group. `plain`: state of the group's draws.
    pub(super) fn note_depth(
        &mut self,
        material: &Material,
        plain: State,
        surfaces: &[DrawSurface],
    ) {
        if !covers(material) {
            return;
        }
        for surface in surfaces.iter().filter(|s| s.flat || self.curves_hide) {
            if let Geometry::Static {
                first_index,
                index_count,
            } = surface.geometry
            {
                self.occluders.push(Occluder {
                    cull: plain.cull,
                    instance: surface.instance,
                    distance_squared: surface.distance_squared,
                    first_index,
                    index_count,
                });
            }
        }
    }

    /// Inserts the depth prepass before all other calls: one call for all surfaces of a model with the same culling,
    /// whatever their materials. The nearest come first, so that GPUs reject whole blocks behind them.
    pub(super) fn put_depth_first(&mut self, indices: &[u32]) {
        let alike = |o: &Occluder| (o.cull, o.instance);
        // the bits of non-negative floats sort like the floats
        self.occluders
            .sort_unstable_by_key(|o| (alike(o), o.distance_squared.to_bits(), o.first_index));
        for run in self.occluders.chunk_by(|a, b| alike(a) == alike(b)) {
            let Some(&first) = slice::get(run, 0) else {
                continue;
            };
            let first_index = self.indices.len() as u32;
            for occluder in run {
                let own = part(indices, span(occluder.first_index, occluder.index_count));
                self.indices.extend_from_slice(own);
            }
            let draw = self.draws.len() as u32;
            self.draws.push(Draw {
                instance: first.instance,
                ..Draw::default()
            });
            self.depth_first.push(Call {
                state: depth_alone(first.cull),
                range: DepthRange::Normal,
                first_index,
                index_count: self.indices.len() as u32 - first_index,
                draw,
            });
        }
        self.calls.splice(0..0, self.depth_first.drain(..));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_is_drawn_first() {
        let mut list = DrawList::new(true);
        for (instance, distance_squared, first_index) in
            [(0, 9.0, 0), (1, 0.0, 3), (0, 0.0, 6), (0, 4.0, 9)]
        {
            list.occluders.push(Occluder {
                cull: CullFaces::None,
                instance,
                distance_squared,
                first_index,
                index_count: 3,
            });
        }
        let indices: Vec<u32> = (100..112).collect();
        list.put_depth_first(&indices);
        let drawn: Vec<&[u32]> = (list.calls.iter())
            .map(|c| &list.indices[c.first_index as usize..][..c.index_count as usize])
            .collect();
        let near_to_far = [106, 107, 108, 109, 110, 111, 100, 101, 102];
        assert_eq!(drawn, [&near_to_far[..], &[103, 104, 105]]);
    }
}
