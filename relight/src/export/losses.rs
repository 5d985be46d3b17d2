//! What of materials no format here can say.

use shaderscript::{AlphaGen, Deform, RgbGen, Shader, StageImage, TcMod};

/// End of the message about a stage with animated images.
pub const FILM: &str = "its images follow each other; the first is shown";
/// End of the message about a stage with a wave for its colour or alpha.
pub const PULSE: &str = "its brightness changes; the mean is shown";
/// End of the message about a stage with a wave in its texture coordinates.
pub const WOBBLE: &str = "its texture wobbles";

/// Adds what no format here can say of a material.
pub fn report_losses(shader: &Shader, lost: &mut Vec<String>) {
    for deform in &shader.deforms {
        lost.push(
            match deform {
                Deform::AutoSprite | Deform::AutoSprite2 => "turns to the viewer",
                Deform::Text(_) => "shows text",
                Deform::ProjectionShadow => "is a flat shadow",
                Deform::Normal { .. } => "its normals move",
                Deform::Wave { .. } | Deform::Bulge { .. } | Deform::Move { .. } => {
                    "its vertices move"
                }
            }
            .to_owned(),
        );
    }
    for (i, stage) in shader.stages.iter().enumerate() {
        if stage
            .tc_mods
            .iter()
            .any(|m| matches!(m, TcMod::Turbulent { .. }))
        {
            lost.push(format!("stage {i}: {WOBBLE}"));
        }
        if stage.image.names().len() > 1 {
            lost.push(format!("stage {i}: {FILM}"));
        }
        if matches!(stage.image, StageImage::Video(_)) {
            lost.push(format!("stage {i}: a film"));
        }
        if matches!(stage.rgb_gen, RgbGen::Wave(_)) || matches!(stage.alpha_gen, AlphaGen::Wave(_))
        {
            lost.push(format!("stage {i}: {PULSE}"));
        }
    }
    lost.dedup();
}
