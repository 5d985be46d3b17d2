//! What glass, liquids and shiny stages are to a ray: refraction, waves, and which stages stand for a reflection.

use std::f32::consts::TAU;

use glam::Vec3;

use super::{SurfaceClass, classify, glow_stages};
use shaderscript::surface_params::{CONTENTS_LAVA, CONTENTS_SLIME, SURF_LIGHTFILTER};
use shaderscript::{AlphaGen, BlendFactor, Deform, RgbGen, Shader, Stage, TcGen, TcMod};

/// Refraction index of window glass.
pub const INDEX_GLASS: f32 = 1.5;
/// Refraction index of water.
pub const INDEX_WATER: f32 = 1.33;
/// Refraction index of slime: that of a strong solution, between water and glass.
pub const INDEX_SLIME: f32 = 1.4;
/// Distance in a liquid after which white light has the colour of the liquid's surface, units.
pub const LIQUID_DEPTH: f32 = 1024.0;
/// Slime of a lower mean transmission than this is opaque: it shows its stages. Water remains a dielectric.
pub const LEAST_SLIME_TRANSMISSION: f32 = 0.15;

/// Colour of white light after [`LIQUID_DEPTH`] in a liquid: that of its surface, its brightest channel 1. No channel
/// vanishes.
pub fn liquid_color(surface: Vec3) -> Vec3 {
    const LEAST: f32 = 0.05;
    let color = surface / surface.max_element().max(1.0e-6);
    color.clamp(Vec3::splat(LEAST), Vec3::ONE)
}

/// Index of refraction of what lies behind a surface, or `None` where light is not refracted: everything but glass and
/// liquids that are seen through. Lava glows and is never seen through, whatever its stages blend.
pub fn refraction_index(shader: &Shader) -> Option<f32> {
    match classify(shader).class {
        SurfaceClass::Glass => Some(INDEX_GLASS),
        SurfaceClass::Liquid if shader.content_flags & CONTENTS_LAVA != 0 => None,
        SurfaceClass::Liquid if shader.content_flags & CONTENTS_SLIME != 0 => Some(INDEX_SLIME),
        SurfaceClass::Liquid => Some(INDEX_WATER),
        _ => None,
    }
}

/// Whether light that passes a surface takes on its colour: glass, materials with `surfaceparm lightfilter`, and those
/// that only multiply the background. Decals lie on something that stops the light.
pub fn filters_light(shader: &Shader) -> bool {
    let found = classify(shader);
    match found.class {
        SurfaceClass::Glass => true,
        SurfaceClass::Translucent => {
            let has_filter = shader.surface_flags & SURF_LIGHTFILTER != 0;
            !shader.polygon_offset && (has_filter || found.filter)
        }
        _ => false,
    }
}

/// Mean slope of the ripples on a liquid: that of its own `deformVertexes wave` where it has one, a light breeze where
/// its images move, none where nothing does. Never so steep that a ripple would be a wave.
pub fn ripple_slope(shader: &Shader) -> f32 {
    const BREEZE: f32 = 0.03;
    const STEEPEST: f32 = 0.08;
    let waves = shader
        .deforms
        .iter()
        .filter_map(|deform| match deform {
            // turns per unit along x + y + z; the steepest way over the surface is diagonal
            Deform::Wave { spread, wave } => {
                Some((TAU * spread * wave.amplitude * std::f32::consts::SQRT_2).abs())
            }
            _ => None,
        })
        .fold(0.0, f32::max);
    let moves = |stage: &Stage| stage.tc_mods.iter().any(changes_with_time);
    let breeze = if waves > 0.0 || shader.stages.iter().any(moves) {
        BREEZE
    } else {
        0.0
    };
    if waves.is_finite() {
        waves.max(breeze).min(STEEPEST)
    } else {
        breeze
    }
}

/// Whether texture coordinates move by themselves.
fn changes_with_time(tc_mod: &TcMod) -> bool {
    match tc_mod {
        TcMod::Scale(_) | TcMod::Transform { .. } => false,
        TcMod::Scroll(speed) => *speed != glam::Vec2::ZERO,
        TcMod::Rotate(degrees) => *degrees != 0.0,
        TcMod::Turbulent { .. } | TcMod::Stretch(_) | TcMod::EntityTranslate => true,
    }
}

/// Degrees a second up to which a picture of an environment may turn and still stand for the surroundings.
const SLOW_TURN: f32 = 10.0;

/// Pictures a second, likewise, that it may move by.
const SLOW_SCROLL: f32 = 0.05;

/// Whether a picture of an environment moves in a way that reflections do not.
fn moves_as_effect(tc_mod: &TcMod) -> bool {
    match tc_mod {
        TcMod::Rotate(degrees) => degrees.abs() > SLOW_TURN,
        TcMod::Scroll(speed) => speed.length() > SLOW_SCROLL,
        other => changes_with_time(other),
    }
}

/// Whether a stage stands for a reflection of the surroundings: a picture of an environment, placed by the reflected
/// view direction, on a body that is drawn by another stage. One that turns or drifts slowly imitates a shine that
/// wanders as its bearer moves, and real surroundings do that by themselves. A picture that moves faster or pulses is an
/// effect (the glow of a power-up), and so is one that nothing lies under: they show what they show. One that multiplies
/// the body and leaves nothing else of it shades it: as a reflection it would make a mirror of cloth and skin.
pub fn is_reflection(shader: &Shader, stage: &Stage) -> bool {
    let is_picture = |s: &Stage| s.tc_gen == TcGen::Environment && !s.image.names().is_empty();
    let rests = !stage.tc_mods.iter().any(moves_as_effect)
        && !matches!(stage.rgb_gen, RgbGen::Wave(_))
        && !matches!(stage.alpha_gen, AlphaGen::Wave(_));
    let shades = matches!(
        stage.blend,
        Some((
            BlendFactor::Zero | BlendFactor::DstColor,
            BlendFactor::Zero | BlendFactor::SrcColor
        ))
    );
    let has_body = shader.stages.iter().any(|s| s.tc_gen != TcGen::Environment);
    is_picture(stage) && stage.image.names().len() == 1 && rests && !shades && has_body
}

/// Whether the picture of a reflection, the stage of this index, shows the light at its surface as a texture does: where
/// light is what it comes to, because the stage is lit itself or a lightmap multiplies it. Its author made it as bright as
/// the place is lit, as metal is that is not polished all over. Glass and liquids do nothing but mirror, and a picture that
/// no light reaches stands for a mirror, too.
pub fn is_gloss(shader: &Shader, index: usize, vertex_light: bool) -> bool {
    is_lit_reflection(shader, index, vertex_light) && refraction_index(shader).is_none()
}

/// Whether the picture of a reflection, the stage of this index, is a haze over what is seen through glass, too: where it
/// would be gloss on a body the engine adds it, as bright as the place is lit, to what lies behind. A liquid mirrors so much
/// that nothing of its picture is left to show.
pub fn is_haze(shader: &Shader, index: usize, vertex_light: bool) -> bool {
    is_lit_reflection(shader, index, vertex_light) && refraction_index(shader) == Some(INDEX_GLASS)
}

fn is_lit_reflection(shader: &Shader, index: usize, vertex_light: bool) -> bool {
    (shader.stages.get(index)).is_some_and(|stage| is_reflection(shader, stage))
        && !glow_stages(shader, vertex_light).contains(&index)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::materials::light::tests::shader;

    #[test]
    fn indices_are_those_of_the_kind() {
        const BLEND: &str = "{\nmap a\nblendFunc blend\n}";
        let index = |body: &str| refraction_index(&shader(&format!("{body}\n{BLEND}")));
        assert_eq!(index("surfaceparm water"), Some(INDEX_WATER));
        assert_eq!(index("surfaceparm slime"), Some(INDEX_SLIME));
        assert_eq!(index("surfaceparm lava"), None);
        assert_eq!(index(""), None);
        let environment = "{\nmap e\ntcGen environment\nblendFunc add\n}";
        let glass = shader(&format!("surfaceparm trans\n{BLEND}\n{environment}"));
        assert_eq!(refraction_index(&glass), Some(INDEX_GLASS));
        // nothing is seen through it
        assert_eq!(
            refraction_index(&shader("surfaceparm water\n{\nmap a\n}")),
            None
        );
    }

    #[test]
    fn light_takes_on_the_colour_of_what_multiplies() {
        let filters = |body: &str| filters_light(&shader(body));
        const FILTER: &str = "{\nmap a\nblendFunc filter\n}";
        const BLEND: &str = "{\nmap a\nblendFunc blend\n}";
        assert!(filters(FILTER));
        assert!(!filters(BLEND));
        assert!(filters(&format!("surfaceparm lightfilter\n{BLEND}")));
        assert!(!filters(&format!("polygonOffset\n{FILTER}")));
        assert!(!filters("{\nmap a\nblendFunc add\n}"));
    }

    #[test]
    fn ripples_come_from_what_moves() {
        let slope = |body: &str| ripple_slope(&shader(body));
        assert_eq!(slope("surfaceparm water\n{\nmap a\n}"), 0.0);
        let breeze = slope("{\nmap a\ntcMod scroll 1 0\n}");
        assert!(breeze > 0.0);
        let waves = slope("deformVertexes wave 64 sin 0 .4 0 .5\n{\nmap a\n}");
        assert!(waves > breeze && waves < 0.08, "{waves}");
        assert!(slope("deformVertexes wave 8 sin 0 900 0 .5\n{\nmap a\n}") <= 0.08);
    }

    #[test]
    fn reflections_have_a_body_and_rest() {
        const BODY: &str = "{\nmap a\nrgbGen lightingDiffuse\n}";
        let reflects = |body: &str| {
            let shader = shader(body);
            shader.stages.iter().any(|s| is_reflection(&shader, s))
        };
        let add = "{\nmap e\ntcGen environment\nblendFunc add\n}";
        assert!(reflects(&format!("{add}\n{BODY}")));
        assert!(!reflects(add));
        assert!(!reflects(BODY));
        let moving = |mods: &str| {
            let stage = format!("{{\nmap e\ntcGen environment\n{mods}\nblendFunc add\n}}");
            reflects(&format!("{stage}\n{BODY}"))
        };
        // laid over the body by its own colour it is a shine; what only multiplies it is no light of its own
        for (blend, shines) in [
            ("gl_dst_color gl_dst_alpha", true),
            ("gl_dst_color gl_one", true),
            ("blend", true),
            ("gl_dst_color gl_src_color", false),
            ("filter", false),
            ("gl_zero gl_src_color", false),
        ] {
            let picture = format!("{{\nmap e\ntcGen environment\nblendFunc {blend}\n}}");
            assert_eq!(reflects(&format!("{BODY}\n{picture}")), shines, "{blend}");
        }
        assert!(moving("tcMod scale .5 .5"));
        assert!(moving("tcMod rotate -4"));
        assert!(moving("tcMod scroll 0 .02"));
        assert!(!moving("tcMod rotate 30"));
        assert!(!moving("tcMod rotate 4\ntcMod scroll 1 .1"));
        assert!(!moving("tcMod turb 0 .1 0 .1"));
        assert!(!reflects(&format!(
            "{{\nmap e\ntcGen environment\nblendFunc add\nrgbGen wave sin 0 1 0 1\n}}\n{BODY}"
        )));
    }

    #[test]
    fn what_is_lit_has_gloss() {
        let gloss = |body: &str| {
            let shader = shader(body);
            let index = (shader.stages.iter()).position(|s| is_reflection(&shader, s));
            index.is_some_and(|index| is_gloss(&shader, index, true))
        };
        const BODY: &str = "{\nmap a\nblendFunc add\n}";
        const LIGHT: &str = "{\nmap $lightmap\nblendFunc filter\n}";
        let picture = |lines: &str| format!("{{\nmap e\ntcGen environment\n{lines}\n}}");
        let bare = picture("");
        assert!(gloss(&format!("{bare}\n{BODY}\n{LIGHT}")));
        // no light comes to what is added above the lightmap, or where there is none
        assert!(!gloss(&format!("{bare}\n{BODY}")));
        let added = picture("blendFunc add");
        assert!(!gloss(&format!("{{\nmap a\n}}\n{LIGHT}\n{added}")));
        let lit = picture("blendFunc add\nrgbGen lightingDiffuse");
        let model = "{\nmap a\nrgbGen lightingDiffuse\n}";
        assert!(gloss(&format!("{model}\n{lit}")));
        assert!(!gloss(&format!("{model}\n{added}")));
        // glass has no gloss, but a haze where it is lit
        let haze = |body: &str| {
            let shader = shader(body);
            let index = (shader.stages.iter()).position(|s| is_reflection(&shader, s));
            index.is_some_and(|index| is_haze(&shader, index, true))
        };
        let glass = format!("surfaceparm trans\n{added}\n{BODY}\n{LIGHT}");
        assert!(!gloss(&glass) && haze(&glass));
        assert!(!haze(&format!("surfaceparm trans\n{added}\n{BODY}")));
        assert!(!haze(&format!(
            "surfaceparm water\n{added}\n{BODY}\n{LIGHT}"
        )));
        assert!(!haze(&format!("{bare}\n{BODY}\n{LIGHT}")));
        // an effect is no reflection
        assert!(!gloss(&format!(
            "{}\n{BODY}\n{LIGHT}",
            picture("tcMod scroll 1 1")
        )));
    }
}
