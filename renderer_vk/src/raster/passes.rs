//! Combines passes of a material into one draw.
//!
//! Most of the cost of a draw over the whole picture is the fill rate. So if a pass is blended over what the previous
//! pass has just drawn, one fragment shader evaluates both ([`Shading`](super::shading::Shading)) and rounds in between
//! as an image of 8 bits a channel does. The result differs only for surfaces of one material in exactly the same
//! place: separate passes blend over each other, combined ones show the last surface only.
//!
//! Of the opaque surfaces with several passes in OpenArena's maps, 98 % have up to four stages, the most that a draw
//! takes.

use shaders::types::DRAW_STAGES;
use shaders::types::constants as c;

use crate::assets::RasterPass;

/// Groups passes into draws, in order. `alone`: one pass a draw.
pub(super) fn draws(passes: &[RasterPass], alone: bool) -> impl Iterator<Item = &[RasterPass]> {
    let first = if alone { 0 } else { together(passes) };
    let (together, rest) = passes.split_at(first);
    let together = Some(together).filter(|passes| !passes.is_empty());
    together.into_iter().chain(rest.chunks(1))
}

/// Number of first passes that one draw can combine. The first must overwrite colour and write depth, so that the
/// following ones pass the depth test exactly where it did.
fn together(passes: &[RasterPass]) -> usize {
    let Some((first, rest)) = passes.split_first() else {
        return 0;
    };
    if first.blend.is_some() || !first.depth_test || !first.depth_write {
        return 1;
    }
    // later passes also draw in the first one's holes, unless they test for its depth
    let holes = first.alpha_func != c::ALPHAFUNC_NONE;
    let mut stages = first.stage_count as usize;
    let follows = |pass: &&RasterPass| {
        stages += pass.stage_count as usize;
        pass.stage_count == 1
            && pass.depth_test
            && (pass.depth_equal || !holes)
            && stages <= DRAW_STAGES
    };
    1 + rest.iter().take_while(follows).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::Combine;

    const SOLID: RasterPass = RasterPass {
        stages: [0, 0],
        stage_count: 1,
        combine: Combine::Modulate,
        blend: None,
        depth_write: true,
        depth_equal: false,
        depth_test: true,
        alpha_func: c::ALPHAFUNC_NONE,
    };
    const OVER: RasterPass = RasterPass {
        blend: Some((c::BLEND_DST_COLOR, c::BLEND_ZERO)),
        depth_write: false,
        ..SOLID
    };

    fn lengths(passes: &[RasterPass], alone: bool) -> Vec<usize> {
        draws(passes, alone).map(<[_]>::len).collect()
    }

    #[test]
    fn what_lies_over_a_solid_pass_is_drawn_with_it() {
        let pair = RasterPass {
            stage_count: 2,
            ..SOLID
        };
        assert_eq!(lengths(&[], false), [0; 0]);
        assert_eq!(lengths(&[SOLID], false), [1]);
        assert_eq!(lengths(&[SOLID, OVER, SOLID], false), [3]);
        assert_eq!(lengths(&[SOLID, OVER, SOLID], true), [1, 1, 1]);
        // as many stages as a draw takes
        assert_eq!(
            lengths(&[SOLID, OVER, OVER, OVER, OVER, OVER], false),
            [4, 1, 1]
        );
        assert_eq!(lengths(&[pair, OVER, OVER, OVER], false), [3, 1]);
    }

    #[test]
    fn what_needs_more_than_the_pass_before_is_drawn_alone() {
        let through_all = RasterPass {
            depth_test: false,
            ..OVER
        };
        let no_depth = RasterPass {
            depth_write: false,
            ..SOLID
        };
        let holes = RasterPass {
            alpha_func: c::ALPHAFUNC_GE128,
            ..SOLID
        };
        let equal = RasterPass {
            depth_equal: true,
            ..OVER
        };
        assert_eq!(lengths(&[OVER, OVER], false), [1, 1]);
        assert_eq!(lengths(&[no_depth, OVER], false), [1, 1]);
        assert_eq!(lengths(&[SOLID, through_all, OVER], false), [1, 1, 1]);
        assert_eq!(lengths(&[holes, OVER], false), [1, 1]);
        assert_eq!(lengths(&[holes, equal, OVER], false), [2, 1]);
    }
}
