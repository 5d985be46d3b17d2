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
        // every test is one threshold: if both ends pass, all values between them pass
        match (passes(alpha_func, low), passes(alpha_func, high)) {
            (true, true) => Self::Solid,
            (false, false) => Self::Hole,
            _ => Self::Mixed,
        }
    }
}

/// Whether an alpha passes a test (`ALPHAFUNC_*`).
fn passes(alpha_func: u32, alpha: u8) -> bool {
    match alpha_func {
        c::ALPHAFUNC_GT0 => alpha > 0,
        c::ALPHAFUNC_LT128 => alpha < 128,
        c::ALPHAFUNC_GE128 => alpha >= 128,
        _ => true,
    }
}

/// The image whose alpha decides about the holes of a material.
struct Deciding {
    texture: u32,
    clamped: bool,
    alpha_func: u32,
}

/// `None` unless one constant image with an alpha channel decides: animated, transformed or generated coordinates and
/// alphas change from frame to frame.
fn deciding(assets: &Assets, material: u32) -> Option<Deciding> {
    let material = assets.materials.get(material);
    let index = light::cut_out_stage(&material.shader)?;
    // a deformation may change texture coordinates
    if !material.shader.deforms.is_empty() {
        return None;
    }
    // each stage that writes depth has its own holes
    let writes = material.shader.stages.iter().filter(|s| s.depth_write);
    if writes.count() != 1 {
        return None;
    }
    let stage = assets.materials.stages(material).get(index);
    let stage = stage.filter(|s| {
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
    })?;
    let (texture, clamped) = assets.materials.image(stage)?;
    Some(Deciding {
        texture,
        clamped,
        alpha_func: stage.alpha_func,
    })
}

/// Coverage of a triangle of a material by its texture coordinates. Mixed unless one constant image decides.
pub fn coverage(assets: &Assets, material: u32, corners: [Vec2; 3]) -> Coverage {
    let Some(image) = deciding(assets, material) else {
        return Coverage::Mixed;
    };
    let range = (assets.textures).alpha_range(image.texture, corners, image.clamped);
    range.map_or(Coverage::Mixed, |range| {
        Coverage::of(image.alpha_func, range)
    })
}

/// Solid part of the image of an alpha-tested material; `None` unless one constant image decides.
pub fn mean_coverage(assets: &Assets, material: u32) -> Option<f32> {
    let image = deciding(assets, material)?;
    let solid = |alpha| passes(image.alpha_func, alpha);
    assets.textures.alpha_share(image.texture, solid)
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
