//! Which stages of a material glow: found by evaluating its stack, not by what blend functions are called.

use super::algebra::{StageSample, compose};
use glam::{Vec3, Vec4};
use shaderscript::{AlphaGen, RgbGen, Shader, Stage, Wave};

/// White samples for every stage of a material, with its constant colours put in and every wave at its brightest.
pub fn stage_samples_white(stages: &[Stage]) -> Vec<StageSample> {
    // Most that a wave reaches; all shapes stay within -1..1.
    let peak = |w: &Wave| (w.base + w.amplitude.abs()).clamp(0.0, 1.0);
    stages
        .iter()
        .map(|stage| {
            let color = match &stage.rgb_gen {
                RgbGen::Const(color) => *color,
                RgbGen::Wave(w) => Vec3::splat(peak(w)),
                _ => Vec3::ONE,
            };
            let alpha = match &stage.alpha_gen {
                AlphaGen::Const(alpha) => *alpha,
                AlphaGen::Wave(w) => peak(w),
                _ => 1.0,
            };
            StageSample {
                color: color.extend(alpha),
                ..StageSample::WHITE
            }
        })
        .collect()
}

/// Whether some of what a material draws does not depend on incident light, whatever its images show.
pub fn is_glowing(shader: &Shader) -> bool {
    !glow_stages(shader, true).is_empty()
}

/// The stages whose own image reaches the emission: without them the surface would glow less.
///
/// Found by evaluating the stack with half-transparent grey images, once with each stage's image black.
pub fn glow_stages(shader: &Shader, vertex_light: bool) -> Vec<usize> {
    // Grey and half alpha, so that no factor hides a stage by being exactly 0 or 1.
    let grey = |mut sample: StageSample| {
        sample.texture = Vec4::new(0.5, 0.5, 0.5, 0.5);
        sample
    };
    // The alpha test is left out: it depends on the images.
    let stages: Vec<Stage> = shader
        .stages
        .iter()
        .map(|stage| Stage {
            alpha_func: None,
            ..stage.clone()
        })
        .collect();
    let samples: Vec<StageSample> = stage_samples_white(&stages).into_iter().map(grey).collect();
    let full = compose(&stages, &samples, vertex_light).emission;
    (0..stages.len())
        .filter(|&i| {
            let mut without = samples.clone();
            if let Some(sample) = without.get_mut(i) {
                sample.texture = Vec4::new(0.0, 0.0, 0.0, 0.5);
            }
            let emission = compose(&stages, &without, vertex_light).emission;
            (full - emission).max_element() > 1e-6
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use shaderscript::parse_script;

    #[test]
    fn glow_is_what_reaches_the_emission() {
        let glow = |stages: &str| {
            let script = parse_script("test", format!("t\n{{\n{stages}\n}}\n").as_bytes());
            assert_eq!(script.diagnostics, []);
            glow_stages(script.shaders.first().unwrap(), true)
        };
        let base = "{\nmap $lightmap\nrgbGen identity\n}\n{\nmap a\nblendFunc filter\n}";
        assert_eq!(glow(base), [0; 0]);
        assert_eq!(
            glow(&format!("{base}\n{{\nmap glow\nblendFunc add\n}}")),
            [2]
        );
        assert_eq!(
            glow(
                "{\nmap a\n}\n{\nmap glow\nblendFunc add\n}\n{\nmap $lightmap\nblendFunc filter\n}"
            ),
            [0; 0]
        );
        assert_eq!(glow("{\nmap a\n}"), [0]);
        assert_eq!(glow("{\nmap a\nrgbGen vertex\n}"), [0; 0]);
        assert_eq!(
            glow("{\nmap a\nblendFunc add\nrgbGen const ( 0 0 0 )\n}"),
            [0; 0]
        );
    }
}
