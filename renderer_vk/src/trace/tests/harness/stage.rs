//! Stages of materials.

use shaders::types::Stage;
use shaders::types::constants as c;

fn plain() -> Stage {
    Stage {
        rgb_gen: c::RGBGEN_IDENTITY,
        alpha_gen: c::ALPHAGEN_IDENTITY,
        constant: [1.0; 4],
        blend_src: c::BLEND_ONE,
        blend_dst: c::BLEND_ZERO,
        flags: c::STAGE_WHITE,
        ..Stage::default()
    }
}

/// The lightmap alone.
pub fn light() -> Stage {
    Stage {
        flags: 0,
        ..plain()
    }
}

/// White times a constant colour (encoded).
pub fn constant(color: [f32; 3]) -> Stage {
    Stage {
        rgb_gen: c::RGBGEN_CONST,
        constant: [color[0], color[1], color[2], 1.0],
        ..plain()
    }
}

/// Multiplies the background by a constant colour (encoded).
pub fn filter(color: [f32; 3]) -> Stage {
    Stage {
        blend_src: c::BLEND_DST_COLOR,
        blend_dst: c::BLEND_ZERO,
        ..constant(color)
    }
}

/// Blends a constant colour (encoded) over the background.
pub fn blend(color: [f32; 3], alpha: f32) -> Stage {
    Stage {
        alpha_gen: c::ALPHAGEN_CONST,
        constant: [color[0], color[1], color[2], alpha],
        blend_src: c::BLEND_SRC_ALPHA,
        blend_dst: c::BLEND_ONE_MINUS_SRC_ALPHA,
        ..constant(color)
    }
}

/// Adds a constant colour (encoded) to the background.
pub fn add(color: [f32; 3]) -> Stage {
    Stage {
        blend_src: c::BLEND_ONE,
        blend_dst: c::BLEND_ONE,
        ..constant(color)
    }
}

/// An image of the scene, by its bindless index.
pub fn image(first: u32) -> Stage {
    Stage {
        image_first: first,
        image_count: 1,
        flags: c::STAGE_DEPTH_WRITE,
        ..plain()
    }
}

/// Multiplies the background by the light.
pub fn light_over() -> Stage {
    Stage {
        blend_src: c::BLEND_DST_COLOR,
        blend_dst: c::BLEND_ZERO,
        ..light()
    }
}

/// A reflection as [`shine`], with an image that is also lit if [`light_over`] follows.
pub fn gloss(first: u32) -> Stage {
    let shine = shine(first);
    Stage {
        flags: shine.flags | c::STAGE_GLOSS,
        ..shine
    }
}

/// A reflection as [`shine`], with an image that is also a haze if [`light_over`] follows.
pub fn haze(first: u32) -> Stage {
    let shine = shine(first);
    Stage {
        flags: shine.flags | c::STAGE_HAZE,
        ..shine
    }
}

/// A reflection added to the background, scaled by the brightness of an image of the scene, by its bindless index.
pub fn shine(first: u32) -> Stage {
    Stage {
        flags: c::STAGE_REFLECTION,
        tc_gen: c::TCGEN_ENVIRONMENT,
        blend_src: c::BLEND_ONE,
        blend_dst: c::BLEND_ONE,
        ..image(first)
    }
}
