use super::*;
use shaderscript::{ImplicitKind, Shader, parse_script};

const RED: Vec3 = Vec3::new(0.8, 0.2, 0.1);
const BLUE: Vec3 = Vec3::new(0.1, 0.3, 0.6);

fn shader(stages: &str) -> Shader {
    let script = parse_script("test", format!("t\n{{\n{stages}\n}}\n").as_bytes());
    assert_eq!(script.diagnostics, []);
    script.shaders.into_iter().next().unwrap()
}

fn texel(color: Vec3, alpha: f32) -> StageSample {
    StageSample {
        texture: color.extend(alpha),
        ..StageSample::WHITE
    }
}

fn run(stages: &str, samples: &[StageSample]) -> LightLinear {
    compose(&shader(stages).stages, samples, false)
}

/// As the engine mixes them.
fn mixed(below: Vec3, above: Vec3, alpha: f32) -> Vec3 {
    below
        .map(from_linear)
        .lerp(above.map(from_linear), alpha)
        .map(to_linear)
}

#[track_caller]
fn near(found: LightLinear, lit: Vec3, emission: Vec3, through: Vec3) {
    assert!(
        found.lit.abs_diff_eq(lit, 1e-6)
            && found.emission.abs_diff_eq(emission, 1e-6)
            && found.through.abs_diff_eq(through, 1e-6),
        "{found:?} is not {lit} L + {emission} + {through} B"
    );
}

const LIGHTMAP: &str = "{\nmap $lightmap\nrgbGen identity\n}";

#[test]
fn lightmap_first() {
    let found = run(
        &format!("{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}"),
        &[StageSample::WHITE, texel(RED, 1.0)],
    );
    near(found, RED, Vec3::ZERO, Vec3::ZERO);
    let implicit = Shader::implicit("a", ImplicitKind::Lightmapped);
    let found = compose(
        &implicit.stages,
        &[StageSample::WHITE, texel(RED, 1.0)],
        false,
    );
    near(found, RED, Vec3::ZERO, Vec3::ZERO);
}

#[test]
fn lightmap_last() {
    for blend in ["filter", "GL_ZERO GL_SRC_COLOR"] {
        let found = run(
            &format!("{{\nmap a\n}}\n{{\nmap $lightmap\nblendFunc {blend}\n}}"),
            &[texel(RED, 1.0), StageSample::WHITE],
        );
        near(found, RED, Vec3::ZERO, Vec3::ZERO);
    }
    // The doubling blend leaves what is below half grey as it is.
    let found = run(
        "{\nmap a\n}\n{\nmap $lightmap\nblendFunc GL_DST_COLOR GL_SRC_COLOR\n}",
        &[texel(RED, 1.0), StageSample::WHITE],
    );
    near(found, RED / HALF, Vec3::ZERO, Vec3::ZERO);
}

#[test]
fn glow_after_the_lightmap_is_emission() {
    let found = run(
        &format!("{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}\n{{\nmap glow\nblendFunc add\n}}"),
        &[StageSample::WHITE, texel(RED, 1.0), texel(BLUE, 1.0)],
    );
    near(found, RED, BLUE, Vec3::ZERO);
}

#[test]
fn glow_before_the_lightmap_is_lit() {
    let found = run(
        "{\nmap a\n}\n{\nmap glow\nblendFunc add\n}\n{\nmap $lightmap\nblendFunc filter\n}",
        &[texel(RED, 1.0), texel(BLUE, 1.0), StageSample::WHITE],
    );
    near(found, RED + BLUE, Vec3::ZERO, Vec3::ZERO);
}

#[test]
fn decal_blends_over_the_lit_base() {
    let found = run(
        &format!("{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}\n{{\nmap decal\nblendFunc blend\n}}"),
        &[StageSample::WHITE, texel(RED, 1.0), texel(BLUE, 0.25)],
    );
    let tint = mixed(RED, BLUE, 0.25) / RED.lerp(BLUE, 0.25);
    near(found, 0.75 * RED * tint, 0.25 * BLUE * tint, Vec3::ZERO);
}

#[test]
fn encoded_samples_add_up_as_the_engine_adds_them() {
    let stages = shader(&format!(
        "{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}\n{{\nmap detail\nblendFunc GL_DST_COLOR GL_SRC_COLOR\n}}\n{{\nmap b\nblendFunc blend\n}}"
    ))
    .stages;
    let samples = |decal: f32| {
        let grey = texel(Vec3::splat(0.5), 1.0);
        [
            StageSample::WHITE,
            texel(RED, 1.0),
            grey,
            texel(BLUE, decal),
        ]
    };
    let found = compose_encoded(&stages, &samples(0.0), false);
    near(found, RED, Vec3::ZERO, Vec3::ZERO);
    let found = compose_encoded(&stages, &samples(0.25), false);
    near(found, 0.75 * RED, 0.25 * BLUE, Vec3::ZERO);
    // In linear light the same stack shows the same where it is lit in full.
    let linear = samples(0.25).map(|s| StageSample {
        texture: s.texture.truncate().map(to_linear).extend(s.texture.w),
        ..s
    });
    let shown = compose(&stages, &linear, false).evaluate(Vec3::ONE, Vec3::ONE);
    let meant = found.evaluate(Vec3::ONE, Vec3::ONE).map(to_linear);
    assert!(shown.abs_diff_eq(meant, 1e-5), "{shown} {meant}");
}

#[test]
fn what_is_mirrored_brings_its_own_light() {
    // gloss under paint with holes, and a lightmap over both
    let shine = StageSample {
        mirrored: BLUE,
        ..texel(BLUE, 1.0)
    };
    let found = run(
        "{\nmap e\ntcGen environment\n}\n{\nmap a\nblendFunc blend\n}\n{\nmap $lightmap\nblendFunc filter\n}",
        &[shine, texel(RED, 0.75), StageSample::WHITE],
    );
    near(found, mixed(BLUE, RED, 0.75), Vec3::ZERO, Vec3::ZERO);
    assert!(found.reflected.abs_diff_eq(0.25 * BLUE, 1e-6));
    // multiplied by a body that is lit
    let found = run(
        "{\nmap a\nrgbGen lightingDiffuse\n}\n{\nmap e\ntcGen environment\nblendFunc gl_dst_color gl_one\n}",
        &[texel(RED, 1.0), shine],
    );
    assert!(found.reflected.abs_diff_eq(RED * BLUE, 1e-6));
}

#[test]
fn environment_base_lightmap() {
    let found = run(
        "{\nmap e\ntcGen environment\n}\n{\nmap a\nblendFunc blend\n}\n{\nmap $lightmap\nblendFunc filter\n}",
        &[texel(BLUE, 1.0), texel(RED, 0.75), StageSample::WHITE],
    );
    near(found, mixed(BLUE, RED, 0.75), Vec3::ZERO, Vec3::ZERO);
}

#[test]
fn additive_sprite_glows_over_the_background() {
    let found = run("{\nmap flame\nblendFunc add\n}", &[texel(RED, 1.0)]);
    near(found, Vec3::ZERO, RED, Vec3::ONE);
    let found = run(
        "{\nmap flame\nblendFunc GL_SRC_ALPHA GL_ONE\n}",
        &[texel(RED, 0.5)],
    );
    near(found, Vec3::ZERO, 0.5 * RED, Vec3::ONE);
}

#[test]
fn marks_only_darken() {
    for blend in ["filter", "GL_ZERO GL_SRC_COLOR"] {
        let found = run(
            &format!("{{\nmap mark\nblendFunc {blend}\n}}"),
            &[texel(RED, 1.0)],
        );
        near(found, Vec3::ZERO, Vec3::ZERO, RED);
    }
    let found = run(
        "{\nmap mark\nblendFunc GL_ZERO GL_ONE_MINUS_SRC_COLOR\n}",
        &[texel(RED, 1.0)],
    );
    near(found, Vec3::ZERO, Vec3::ZERO, Vec3::ONE - RED);
}

#[test]
fn light_seen_twice_counts_once() {
    let found = run(
        &format!("{LIGHTMAP}\n{{\nmap $lightmap\nblendFunc filter\n}}"),
        &[],
    );
    near(found, Vec3::ONE, Vec3::ZERO, Vec3::ZERO);
    let glass = run("{\nmap $lightmap\nblendFunc filter\n}", &[]);
    near(glass, Vec3::ZERO, Vec3::ZERO, Vec3::ONE);
}

#[test]
fn model_and_vertex_light() {
    let model = Shader::implicit("a", ImplicitKind::EntityLit);
    near(
        compose(&model.stages, &[texel(RED, 1.0)], false),
        RED,
        Vec3::ZERO,
        Vec3::ZERO,
    );
    let vertex = Shader::implicit("a", ImplicitKind::Vertex);
    let colored = StageSample {
        texture: RED.extend(1.0),
        color: BLUE.extend(1.0),
        ..StageSample::WHITE
    };
    near(
        compose(&vertex.stages, &[colored], true),
        RED,
        Vec3::ZERO,
        Vec3::ZERO,
    );
    near(
        compose(&vertex.stages, &[colored], false),
        Vec3::ZERO,
        RED * BLUE,
        Vec3::ZERO,
    );
}

#[test]
fn every_factor() {
    let base = "{\nmap a\n}";
    let alpha = 0.25;
    for (source, destination, expected) in [
        ("GL_ONE", "GL_ZERO", BLUE),
        ("GL_ZERO", "GL_ONE", RED),
        ("GL_ONE_MINUS_DST_COLOR", "GL_ONE", RED + BLUE * (1.0 - RED)),
        (
            "GL_SRC_ALPHA",
            "GL_ONE_MINUS_SRC_ALPHA",
            mixed(RED, BLUE, 0.25),
        ),
        (
            "GL_ONE_MINUS_SRC_ALPHA",
            "GL_SRC_ALPHA",
            0.75 * BLUE + 0.25 * RED,
        ),
        ("GL_DST_ALPHA", "GL_ONE_MINUS_DST_ALPHA", BLUE),
        ("GL_ONE_MINUS_DST_ALPHA", "GL_DST_ALPHA", RED),
        ("GL_SRC_ALPHA_SATURATE", "GL_ONE", RED),
        (
            "GL_ONE",
            "GL_ONE_MINUS_SRC_COLOR",
            BLUE + RED * (1.0 - BLUE),
        ),
    ] {
        let found = run(
            &format!("{base}\n{{\nmap b\nblendFunc {source} {destination}\n}}"),
            &[texel(RED, 1.0), texel(BLUE, alpha)],
        );
        near(found, Vec3::ZERO, expected, Vec3::ZERO);
        assert_eq!(found.evaluate(Vec3::ONE, Vec3::ONE), found.emission);
    }
}

#[test]
fn failed_alpha_tests_draw_nothing() {
    let found = run(
        "{\nmap a\n}\n{\nmap b\nalphaFunc GE128\nblendFunc add\n}",
        &[texel(RED, 1.0), texel(BLUE, 0.4)],
    );
    near(found, Vec3::ZERO, RED, Vec3::ZERO);
}

#[test]
fn light_over_what_is_seen_through_darkens_what_lies_behind() {
    let darkens = |body: &str| {
        let script = parse_script("test", format!("t\n{{\n{body}\n}}\n").as_bytes());
        darkens_behind(&script.shaders.first().unwrap().stages, true)
    };
    const LIGHT: &str = "{\nmap $lightmap\nblendFunc filter\n}";
    const WATER: &str = "{\nmap a\nblendFunc GL_DST_COLOR GL_ONE\n}";
    const WALL: &str = "{\nmap a\n}";
    assert!(darkens(&format!("{WATER}\n{LIGHT}")));
    assert!(darkens("{\nmap a\nblendFunc filter\nrgbGen exactVertex\n}"));
    assert!(!darkens(WATER));
    // nothing is seen through a wall, and what is added or mixed leaves the rest alone
    assert!(!darkens(&format!("{WALL}\n{LIGHT}")));
    assert!(!darkens("{\nmap $lightmap\nblendFunc add\n}"));
    assert!(!darkens("{\nmap a\nblendFunc blend\nrgbGen vertex\n}"));
}
