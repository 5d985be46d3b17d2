//! Classifies the triangles of alpha-tested materials: only triangles with holes need the alpha test at a hit. Large
//! parts of a grate, a plant or a banner are solid or empty throughout, and any-hit tests dominate the cost of such
//! rays.

use glam::Vec2;
use relight::materials::light;
use shaders::types::constants as c;

use crate::assets::Assets;

/// Alpha coverage of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coverage {
    /// Every point passes the alpha test.
    Solid,
    /// No point passes.
    Hole,
    /// Some points pass, or the coverage is unknown.
    #[default]
    Mixed,
}

impl Coverage {
    /// Coverage by the smallest and greatest alpha in the triangle and the test (`ALPHAFUNC_*`).
    fn of(alpha_func: u32, (low, high): (u8, u8)) -> Self {
        let passes = |alpha: u8| match alpha_func {
            c::ALPHAFUNC_GT0 => alpha > 0,
            c::ALPHAFUNC_LT128 => alpha < 128,
            c::ALPHAFUNC_GE128 => alpha >= 128,
            _ => true,
        };
        // every test is one threshold: if both ends pass, all values between them pass
        match (passes(low), passes(high)) {
            (true, true) => Self::Solid,
            (false, false) => Self::Hole,
            _ => Self::Mixed,
        }
    }
}

/// Coverage of a triangle of a material by its texture coordinates. Mixed unless one constant image with an alpha
/// channel decides: animated, transformed or generated coordinates and alphas change from frame to frame.
pub fn coverage(assets: &Assets, material: u32, corners: [Vec2; 3]) -> Coverage {
    let material = assets.materials.get(material);
    let Some(index) = light::cut_out_stage(&material.shader) else {
        return Coverage::Mixed;
    };
    // a deformation may change texture coordinates
    if !material.shader.deforms.is_empty() {
        return Coverage::Mixed;
    }
    // each stage that writes depth has its own holes
    let writes = material.shader.stages.iter().filter(|s| s.depth_write);
    if writes.count() != 1 {
        return Coverage::Mixed;
    }
    let stage = assets.materials.stages(material).get(index);
    let Some(stage) = stage.filter(|s| {
        s.image_count == 1
            && s.tc_gen == c::TCGEN_BASE
            && s.tc_mod_count == 0
            && s.alpha_gen == c::ALPHAGEN_IDENTITY
            // these replace the image's alpha
            && ![
                c::RGBGEN_VERTEX,
                c::RGBGEN_EXACT_VERTEX,
                c::RGBGEN_ENTITY,
                c::RGBGEN_ONE_MINUS_ENTITY,
            ]
            .contains(&s.rgb_gen)
    }) else {
        return Coverage::Mixed;
    };
    let Some((texture, clamped)) = assets.materials.image(stage) else {
        return Coverage::Mixed;
    };
    (assets.textures.alpha_range(texture, corners, clamped)).map_or(Coverage::Mixed, |range| {
        Coverage::of(stage.alpha_func, range)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_solid_or_a_hole_on_one_side_of_the_threshold() {
        for (func, low, high, coverage) in [
            (c::ALPHAFUNC_GE128, 128, 255, Coverage::Solid),
            (c::ALPHAFUNC_GE128, 0, 127, Coverage::Hole),
            (c::ALPHAFUNC_GE128, 127, 128, Coverage::Mixed),
            (c::ALPHAFUNC_GT0, 0, 0, Coverage::Hole),
            (c::ALPHAFUNC_GT0, 1, 255, Coverage::Solid),
            (c::ALPHAFUNC_LT128, 0, 127, Coverage::Solid),
            (c::ALPHAFUNC_LT128, 128, 200, Coverage::Hole),
        ] {
            assert_eq!(Coverage::of(func, (low, high)), coverage);
        }
    }
}
