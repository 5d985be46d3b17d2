//! What a material is to light, decided from its directives alone.
//!
//! [`classify`] names the kind of surface; [`compose`] separates a stack of stages into what reflects incident
//! light, what glows, and how much of the background is seen through it. No name of a material or image decides
//! anything.

mod algebra;
mod baked;
mod dielectric;
mod glow;

pub use algebra::{LightLinear, StageSample, compose, compose_encoded, darkens_behind};
pub use baked::{BakedLight, baked_light};
pub use dielectric::{
    INDEX_GLASS, INDEX_SLIME, INDEX_WATER, LEAST_SLIME_TRANSMISSION, LIQUID_DEPTH, filters_light,
    is_gloss, is_haze, is_reflection, liquid_color, refraction_index, ripple_slope,
};
pub use glow::{glow_stages, is_glowing, stage_samples_white};

use shaderscript::surface_params::{
    CONTENTS_FOG, CONTENTS_LAVA, CONTENTS_SLIME, CONTENTS_TRANSLUCENT, CONTENTS_WATER,
    SURF_ALPHASHADOW, SURF_LIGHTFILTER, SURF_SKY,
};
use shaderscript::{AlphaGen, BlendFactor, Cull, Shader, Stage, TcGen, sort};

/// The kinds of surface that a light simulation distinguishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SurfaceClass {
    /// Stops light.
    Opaque,
    /// Stops light where its image is opaque; holes elsewhere.
    CutOut,
    /// Blended with what is behind: decals, glows, marks, grates.
    Translucent,
    /// A candidate for a mirror: drawn first, shows another view. Whether it is a mirror or a portal is known only
    /// when the game places an entity at it.
    Mirror,
    /// Seen through, with a reflection of its surroundings.
    Glass,
    /// Water, slime or lava that is seen through.
    Liquid,
    /// The sky.
    Sky,
    /// A candidate for a portal: as a mirror, but it fades in with distance, which only portals do.
    Portal,
    /// Boundary of a fog volume.
    Fog,
    /// Nothing is drawn.
    Invisible,
}

/// What [`classify`] finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LightClass {
    /// The kind.
    pub class: SurfaceClass,
    /// The map compiler took it for a source of light: it has `q3map_surfacelight` above 0, a sun, or sky light.
    pub emitter: bool,
    /// Some of what is drawn does not depend on incident light. True for every material without lightmap, vertex
    /// light or `lightingDiffuse`, so a glow alone is no light source to the map compiler.
    pub glowing: bool,
    /// What is behind it is seen through it; of a cut-out, not only through its holes.
    pub translucent: bool,
    /// It is water, slime or lava, seen through or not.
    pub liquid: bool,
    /// Both sides are drawn.
    pub two_sided: bool,
    /// The map compiler let light through it, though it is drawn: see [`is_passed`].
    pub passed: bool,
    /// Every stage only adds light to the background.
    pub additive: bool,
    /// Every stage only multiplies the background.
    pub filter: bool,
    /// Some stage is mapped by the reflected view direction: shiny.
    pub environment: bool,
}

/// Decides what a material is to light. The first rule that holds counts:
///
/// 1. sky: `skyParms` or `surfaceparm sky`
/// 2. no stages: fog with `surfaceparm fog`, else invisible
/// 3. sort value of a portal: portal when a stage's alpha grows with distance (`alphaGen portal`), else mirror
/// 4. liquid: `surfaceparm water`, `slime` or `lava`, and the first stage blends
/// 5. glass: `surfaceparm trans`, the first stage blends, and some stage is an environment map
/// 6. cut-out: some stage writes depth, and every stage that does has an alpha test
/// 7. translucent: the first stage blends
/// 8. opaque
///
/// A material that the engine rejects is drawn as the default one: classify that instead.
pub fn classify(shader: &Shader) -> LightClass {
    let first_blends = shader.stages.first().is_some_and(|s| s.blend.is_some());
    let environment = shader.stages.iter().any(|s| s.tc_gen == TcGen::Environment);
    let liquid = shader.content_flags & (CONTENTS_WATER | CONTENTS_SLIME | CONTENTS_LAVA) != 0;
    let class = if shader.sky.is_some() || shader.surface_flags & SURF_SKY != 0 {
        SurfaceClass::Sky
    } else if shader.stages.is_empty() {
        if shader.content_flags & CONTENTS_FOG != 0 {
            SurfaceClass::Fog
        } else {
            SurfaceClass::Invisible
        }
    } else if shader.sort_value() <= sort::PORTAL {
        let fades = |s: &Stage| matches!(s.alpha_gen, AlphaGen::Portal { .. });
        if shader.stages.iter().any(fades) {
            SurfaceClass::Portal
        } else {
            SurfaceClass::Mirror
        }
    } else if liquid && first_blends {
        SurfaceClass::Liquid
    } else if shader.content_flags & CONTENTS_TRANSLUCENT != 0 && first_blends && environment {
        SurfaceClass::Glass
    } else if cut_out_stage(shader).is_some() {
        SurfaceClass::CutOut
    } else if first_blends {
        SurfaceClass::Translucent
    } else {
        SurfaceClass::Opaque
    };
    let blends_with = |test: fn((BlendFactor, BlendFactor)) -> bool| {
        !shader.stages.is_empty() && shader.stages.iter().all(|s| s.blend.is_some_and(test))
    };
    LightClass {
        class,
        emitter: is_emitter(shader),
        glowing: is_glowing(shader),
        // an alpha-tested first stage may also blend: points that pass the test still show the background
        translucent: match class {
            SurfaceClass::Translucent | SurfaceClass::Glass | SurfaceClass::Liquid => true,
            SurfaceClass::CutOut => first_blends,
            _ => false,
        },
        liquid,
        two_sided: shader.cull == Cull::None,
        passed: class == SurfaceClass::Opaque && !liquid && is_passed(shader),
        additive: blends_with(|(_, destination)| destination == BlendFactor::One),
        filter: blends_with(|(source, destination)| {
            matches!(
                (source, destination),
                (BlendFactor::DstColor | BlendFactor::Zero, BlendFactor::Zero)
                    | (BlendFactor::DstColor, BlendFactor::SrcColor)
                    | (
                        BlendFactor::Zero,
                        BlendFactor::SrcColor
                            | BlendFactor::OneMinusSrcColor
                            | BlendFactor::SrcAlpha
                            | BlendFactor::OneMinusSrcAlpha
                    )
            )
        }),
        environment,
    }
}

/// Whether light passes a material of one side: `surfaceparm trans` without `alphashadow` and `lightfilter`. Map compilers
/// give such a material no shadow. Cel-shading shells are such materials; with a shadow they would darken the surfaces that they
/// enclose. Two-sided materials keep their shadow, because its caster is visible.
fn is_passed(shader: &Shader) -> bool {
    shader.cull != Cull::None
        && shader.content_flags & CONTENTS_TRANSLUCENT != 0
        && shader.surface_flags & (SURF_ALPHASHADOW | SURF_LIGHTFILTER) == 0
}

/// Whether the map compiler took a material for a source of light.
pub fn is_emitter(shader: &Shader) -> bool {
    let positive = |value: f32| value > 0.0;
    shader.light.surface_light.is_some_and(positive)
        || shader
            .light
            .sky_light
            .is_some_and(|(value, _)| positive(value))
        || shader.suns.iter().any(|sun| positive(sun.intensity))
}

/// The stage whose alpha test cuts the holes of a cut-out: the first that writes depth, provided that every stage
/// that writes depth has an alpha test. `None` when there is no such stage.
pub fn cut_out_stage(shader: &Shader) -> Option<usize> {
    let mut writes = shader
        .stages
        .iter()
        .enumerate()
        .filter(|(_, stage)| stage.depth_write)
        .peekable();
    let (index, _) = *writes.peek()?;
    writes
        .all(|(_, stage)| stage.alpha_func.is_some())
        .then_some(index)
}

/// The stage whose image shows best what the surface is made of: its albedo.
///
/// Lightmaps and stages without an image file are passed over, then environment maps, then stages that only add.
/// Among the rest the first wins; when nothing is left the search is repeated with the last exclusions lifted.
pub fn base_stage(shader: &Shader) -> Option<usize> {
    let has_image = |s: &Stage| !s.image.names().is_empty();
    let mapped = |s: &Stage| has_image(s) && s.tc_gen != TcGen::Environment;
    let adds = |s: &Stage| matches!(s.blend, Some((_, BlendFactor::One)));
    let position = |test: &dyn Fn(&Stage) -> bool| shader.stages.iter().position(test);
    position(&|s| mapped(s) && !adds(s))
        .or_else(|| position(&mapped))
        .or_else(|| position(&has_image))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Materials, SearchPath};
    use glam::Vec3;
    use shaderscript::parse_script;

    pub(super) fn shader(body: &str) -> Shader {
        parse_script("test", format!("t\n{{\n{body}\n}}\n").as_bytes())
            .shaders
            .into_iter()
            .next()
            .unwrap()
    }

    fn class(body: &str) -> SurfaceClass {
        classify(&shader(body)).class
    }

    #[test]
    fn every_class_from_directives() {
        const BASE: &str = "{\nmap $lightmap\n}\n{\nmap a\nblendFunc filter\n}";
        const BLEND: &str = "{\nmap a\nblendFunc blend\n}";
        const ENVIRONMENT: &str = "{\nmap e\ntcGen environment\nblendFunc add\n}";
        assert_eq!(class(BASE), SurfaceClass::Opaque);
        assert_eq!(class(BLEND), SurfaceClass::Translucent);
        assert_eq!(class("{\nmap a\nalphaFunc GE128\n}"), SurfaceClass::CutOut);
        assert_eq!(
            class("{\nmap a\nblendFunc blend\ndepthWrite\nalphaFunc GT0\n}"),
            SurfaceClass::CutOut
        );
        // An alpha test above a stage that already fills depth cuts nothing.
        assert_eq!(
            class("{\nmap a\n}\n{\nmap b\nalphaFunc GE128\n}"),
            SurfaceClass::Opaque
        );
        assert_eq!(class("skyParms a 512 -"), SurfaceClass::Sky);
        assert_eq!(
            class(&format!("surfaceparm sky\n{BASE}")),
            SurfaceClass::Sky
        );
        assert_eq!(
            class("surfaceparm fog\nfogParms ( 1 1 1 ) 100"),
            SurfaceClass::Fog
        );
        assert_eq!(class("surfaceparm nodraw"), SurfaceClass::Invisible);
        assert_eq!(class(&format!("portal\n{BLEND}")), SurfaceClass::Mirror);
        assert_eq!(
            class("sort portal\n{\nmap a\nblendFunc blend\nalphaGen portal 512\n}"),
            SurfaceClass::Portal
        );
        assert_eq!(
            class(&format!("surfaceparm water\n{BLEND}")),
            SurfaceClass::Liquid
        );
        assert_eq!(
            class(&format!("surfaceparm lava\n{BASE}")),
            SurfaceClass::Opaque
        );
        assert_eq!(
            class(&format!("surfaceparm trans\n{BLEND}\n{ENVIRONMENT}")),
            SurfaceClass::Glass
        );
        assert_eq!(
            class(&format!("{BLEND}\n{ENVIRONMENT}")),
            SurfaceClass::Translucent
        );
        assert!(classify(&shader(&format!("{BASE}\n{ENVIRONMENT}"))).environment);
    }

    #[test]
    fn light_passes_one_sided_surfaces_that_the_compiler_let_it_pass() {
        let passed = |body: &str| classify(&shader(body)).passed;
        let image = "{\nmap a\n}";
        let trans = |more: &str| passed(&format!("surfaceparm trans\n{more}\n{image}"));
        assert!(trans("") && trans("cull back") && trans("q3map_invert"));
        assert!(!passed(image) && !passed(&format!("cull back\n{image}")));
        assert!(!trans("cull none"));
        assert!(!trans("surfaceparm alphashadow") && !trans("surfaceparm lightfilter"));
        assert!(!trans("surfaceparm water") && !trans("sort portal"));
        let cut_out = "surfaceparm trans\n{\nmap a\nalphaFunc GE128\n}";
        assert!(!passed(cut_out), "it has its own shadow");
    }

    #[test]
    fn emitters_are_what_the_compiler_lit_with() {
        let emits = |body: &str| classify(&shader(body)).emitter;
        assert!(emits("q3map_surfacelight 300\n{\nmap a\n}"));
        assert!(!emits("q3map_surfacelight 0\n{\nmap a\n}"));
        assert!(!emits("q3map_surfacelight bright\n{\nmap a\n}"));
        assert!(emits("skyParms - 512 -\nq3map_sun 1 1 1 100 0 90"));
        assert!(emits("skyParms - 512 -\nq3map_skylight 50 3"));
        assert!(!emits("{\nmap a\nblendFunc add\n}"));
    }

    #[test]
    fn additive_and_filter_need_every_stage() {
        let class = |body: &str| classify(&shader(body));
        assert!(
            class("{\nmap a\nblendFunc add\n}\n{\nmap b\nblendFunc GL_SRC_ALPHA GL_ONE\n}")
                .additive
        );
        assert!(!class("{\nmap a\nblendFunc add\n}\n{\nmap b\nblendFunc blend\n}").additive);
        assert!(class("{\nmap a\nblendFunc filter\n}").filter);
        assert!(class("{\nmap a\nblendFunc GL_ZERO GL_ONE_MINUS_SRC_COLOR\n}").filter);
        assert!(!class("{\nmap a\n}").filter);
    }

    #[test]
    fn base_stage_is_the_albedo() {
        let base = |body: &str| base_stage(&shader(body));
        assert_eq!(
            base("{\nmap $lightmap\n}\n{\nmap a\nblendFunc filter\n}"),
            Some(1)
        );
        assert_eq!(
            base("{\nmap e\ntcGen environment\n}\n{\nmap a\nblendFunc blend\n}"),
            Some(1)
        );
        assert_eq!(base("{\nmap glow\nblendFunc add\n}"), Some(0));
        assert_eq!(base("{\nmap e\ntcGen environment\n}"), Some(0));
        assert_eq!(base("{\nmap $lightmap\n}"), None);
    }

    /// What holds for any material.
    fn check(shader: &Shader) {
        let name = &shader.name;
        let samples = stage_samples_white(&shader.stages);
        let composed = compose(&shader.stages, &samples, true);
        if classify(shader).class == SurfaceClass::Opaque {
            assert_eq!(composed.through, Vec3::ZERO, "{name}");
        }
        let has_image = shader.image_names().next().is_some();
        assert_eq!(base_stage(shader).is_some(), has_image, "{name}");
        assert_eq!(baked_light(&shader.stages).len(), shader.stages.len());
        let glows = glow_stages(shader, true);
        assert!(glows.iter().all(|&stage| stage < shader.stages.len()));
        assert!(refraction_index(shader).is_none_or(|index| index > 1.0));
    }

    #[test]
    fn materials_of_the_game_keep_the_rules() {
        let Some(folder) = testkit::folder() else {
            return;
        };
        let files = SearchPath::open(&[folder]).unwrap();
        let (materials, _) = Materials::load(&files);
        let shaders = materials.library().definitions();
        assert!(shaders.len() > 1000, "{}", shaders.len());
        for shader in shaders {
            check(shader);
            let samples = stage_samples_white(&shader.stages);
            let composed = compose(&shader.stages, &samples, true);
            let sum = composed.lit + composed.emission;
            assert!(sum.is_finite(), "{}", shader.name);
        }
    }

    #[test]
    fn random_materials_keep_the_rules() {
        const GENERAL: [&str; 6] = [
            "surfaceparm trans",
            "surfaceparm water",
            "surfaceparm slime",
            "sort portal",
            "cull none",
            "deformVertexes wave 1 sin 0 1 0 1",
        ];
        const STAGE: [&str; 18] = [
            "map a",
            "map $lightmap",
            "clampMap b",
            "animMap 1 a b",
            "blendFunc add",
            "blendFunc blend",
            "blendFunc filter",
            "blendFunc GL_DST_COLOR GL_SRC_COLOR",
            "blendFunc GL_ONE_MINUS_DST_COLOR GL_ONE_MINUS_SRC_ALPHA",
            "alphaFunc GE128",
            "depthWrite",
            "tcGen environment",
            "tcGen lightmap",
            "rgbGen wave sin 1e30 1 0 1",
            "rgbGen vertex",
            "alphaGen const 2",
            "tcMod scroll 1 0",
            "tcMod transform 1 0 0 1 .5 .5",
        ];
        let mut random = testkit::Random::new(1);
        let mut lines = |of: &[&str], most| {
            let count = random.below(most);
            let line = |_| of[random.below(of.len())];
            (0..count).map(line).collect::<Vec<_>>().join("\n")
        };
        for _ in 0..3000 {
            let stages = [(); 3].map(|()| format!("{{\n{}\n}}", lines(&STAGE, 6)));
            check(&shader(&(lines(&GENERAL, 3) + "\n" + &stages.join("\n"))));
        }
    }
}
