//! Depth before colour: what of the world hides all that lies behind it is drawn into the depth image first, so that of
//! surfaces behind each other only the one in sight is textured.
//!
//! The picture stays the same to the bit: positions are `invariant`, so such a surface still passes `LessEqual` wherever
//! it is in sight at the end, and what it would have overwritten is not drawn at all. It costs a vertex pass without
//! fragments: where vertices are processed in software, curves, which hide little for their many triangles, are left out.
//! So are views with a clip plane, where fragments decide what is there.

use shaders::types::Draw;
use shaders::types::constants as c;
use shaderscript::sort;
use support::slice::{part, span};

use super::list::{Call, DepthRange, DrawList};
use super::pipelines::{CullFaces, Depth, State};
use super::shading::Shading;
use crate::assets::Material;
use crate::scene::{DrawSurface, Geometry};

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

/// How depth alone is drawn.
pub(super) fn depth_alone(cull: CullFaces) -> State {
    State {
        blend: None,
        depth: Depth::LessEqual,
        depth_write: true,
        cull,
        offset: false,
        wireframe: false,
        shading: Shading {
            mode: c::DRAW_DEPTH,
            ..Shading::WHITE
        },
    }
}

/// A surface whose depth is drawn first.
#[derive(Clone, Copy)]
pub(super) struct Occluder {
    cull: CullFaces,
    instance: u32,
    distance_squared: f32,
    /// Of the map's indices.
    first_index: u32,
    index_count: u32,
}

impl DrawList {
    /// Takes note of the surfaces of a group that hide much. `plain` is how the group is drawn.
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

    /// Puts the depth of what was noted before all other calls: one call for all surfaces of a model that are culled
    /// alike, whatever their materials. The nearest come first, because GPUs reject whole blocks behind them at once.
    pub(super) fn put_depth_first(&mut self, indices: &[u32]) {
        let alike = |o: &Occluder| (o.cull, o.instance);
        // squares are not negative, so their bits have their order
        self.occluders
            .sort_unstable_by_key(|o| (alike(o), o.distance_squared.to_bits(), o.first_index));
        for run in self.occluders.chunk_by(|a, b| alike(a) == alike(b)) {
            let Some(&first) = run.first() else { continue };
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
