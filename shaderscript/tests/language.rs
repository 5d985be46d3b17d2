//! Every directive of the language, from text to the typed tree.

use glam::{Vec2, Vec3};
use shaderscript::{
    AlphaFunc, AlphaGen, BlendFactor, Cull, Deform, DepthFunc, Fog, RgbGen, Script, Severity,
    Shader, Sky, Stage, StageImage, TcGen, TcMod, Wave, WaveFunction, parse_script, sort,
    surface_params as flags,
};

fn script(body: &str) -> Script {
    parse_script("test", format!("name\n{{\n{body}\n}}\n").as_bytes())
}

/// A definition without faults.
#[track_caller]
fn shader(body: &str) -> Shader {
    let script = script(body);
    assert_eq!(script.diagnostics, [], "{body}");
    script.shaders.into_iter().next().unwrap()
}

#[track_caller]
fn stage(body: &str) -> Stage {
    shader(&format!("{{\nmap a\n{body}\n}}")).stages.remove(0)
}

/// The one warning of a stage, and the stage.
#[track_caller]
fn warned(body: &str) -> (Stage, String) {
    let mut script = script(&format!("{{\nmap a\n{body}\n}}"));
    assert_eq!(
        script.diagnostics.len(),
        1,
        "{body}: {:?}",
        script.diagnostics
    );
    assert_eq!(script.diagnostics[0].severity, Severity::Warning);
    assert_eq!(script.shaders[0].rejected, None);
    (
        script.shaders[0].stages.remove(0),
        script.diagnostics[0].message.clone(),
    )
}

/// Why the definition is rejected.
#[track_caller]
fn rejected(body: &str) -> String {
    let script = script(body);
    assert_eq!(script.shaders.len(), 1, "{body}");
    script.shaders[0].rejected.clone().expect(body)
}

fn wave(function: WaveFunction) -> Wave {
    Wave {
        function,
        base: 1.0,
        amplitude: 2.0,
        phase: 0.25,
        frequency: 4.0,
    }
}

const STAGE: &str = "{\nmap a\n}";

#[test]
fn images() {
    let image = |body: &str| shader(&format!("{{\n{body}\n}}")).stages.remove(0).image;
    assert_eq!(
        image("map textures/a.tga"),
        StageImage::Map("textures/a.tga".into())
    );
    assert_eq!(image("MAP $LightMap"), StageImage::Lightmap);
    assert_eq!(image("map $whiteimage"), StageImage::White);
    assert_eq!(image("map *white"), StageImage::White);
    assert_eq!(
        image("clampMap $lightmap"),
        StageImage::ClampMap("$lightmap".into())
    );
    assert_eq!(image("videoMap v.roq"), StageImage::Video("v.roq".into()));
    assert_eq!(image("map a\nmap b"), StageImage::Map("b".into()));
    let animation = image("animMap 0.5 a b c");
    assert_eq!(animation.names(), ["a", "b", "c"]);
    // Two seconds each.
    for (time, frame) in [
        (-1.0, 0),
        (0.0, 0),
        (1.9, 0),
        (2.0, 1),
        (5.0, 2),
        (6.0, 0),
        (7e9, 2),
    ] {
        assert_eq!(animation.frame(time), frame, "{time}");
    }
    let ten = script("{\nanimMap 1 a b c d e f g h i j\n}");
    assert_eq!(ten.shaders[0].stages[0].image.names().len(), 8);
    assert!(ten.diagnostics[0].message.contains("10 images"));
}

#[test]
fn blending_and_depth() {
    use BlendFactor as F;
    assert_eq!(stage("").blend, None);
    assert!(stage("").depth_write);
    for (text, pair) in [
        ("add", (F::One, F::One)),
        ("filter", (F::DstColor, F::Zero)),
        ("blend", (F::SrcAlpha, F::OneMinusSrcAlpha)),
        ("GL_ZERO GL_SRC_COLOR", (F::Zero, F::SrcColor)),
        (
            "gl_one_minus_dst_color gl_one_minus_src_color",
            (F::OneMinusDstColor, F::OneMinusSrcColor),
        ),
        (
            "GL_DST_ALPHA GL_ONE_MINUS_DST_ALPHA",
            (F::DstAlpha, F::OneMinusDstAlpha),
        ),
        (
            "GL_ONE_MINUS_DST_ALPHA GL_DST_ALPHA",
            (F::OneMinusDstAlpha, F::DstAlpha),
        ),
        (
            "GL_ONE_MINUS_SRC_ALPHA GL_SRC_ALPHA",
            (F::OneMinusSrcAlpha, F::SrcAlpha),
        ),
        (
            "GL_SRC_ALPHA_SATURATE GL_ZERO",
            (F::SrcAlphaSaturate, F::Zero),
        ),
    ] {
        let stage = stage(&format!("blendFunc {text}"));
        assert_eq!(stage.blend, Some(pair), "{text}");
        assert!(!stage.depth_write);
    }
    let overwrite = stage("blendFunc GL_ONE GL_ZERO");
    assert_eq!((overwrite.blend, overwrite.depth_write), (None, true));
    for order in ["depthWrite\nblendFunc add", "blendFunc add\ndepthWrite"] {
        assert!(stage(order).depth_write, "{order}");
    }
    let (odd, message) = warned("blendFunc GL_SRC_COLOR GL_ONE");
    assert_eq!(odd.blend, Some((F::One, F::One)));
    assert!(message.contains("GL_SRC_COLOR"), "{message}");
    assert_eq!(warned("blendFunc GL_ONE").0.blend, None);
    assert_eq!(stage("depthFunc equal").depth_func, DepthFunc::Equal);
    assert_eq!(stage("depthFunc lequal").depth_func, DepthFunc::LessEqual);
    assert_eq!(warned("depthFunc less").0.depth_func, DepthFunc::LessEqual);
    assert_eq!(stage("alphaFunc gt0").alpha_func, Some(AlphaFunc::Gt0));
    assert_eq!(stage("alphaFunc LT128").alpha_func, Some(AlphaFunc::Lt128));
    assert_eq!(stage("alphaFunc GE128").alpha_func, Some(AlphaFunc::Ge128));
    assert_eq!(warned("alphaFunc GE192").0.alpha_func, None);
    assert!(stage("detail").detail);
}

#[test]
fn warnings_that_come_in_pairs() {
    let script = script("{\nmap a\nblendFunc a b\n}");
    assert_eq!(script.diagnostics.len(), 2);
    assert_eq!(
        script.diagnostics[0].to_string(),
        "test:5:1: warning: name: 'a' is no source factor, using GL_ONE"
    );
}

#[test]
fn colors() {
    for (text, rgb_gen) in [
        ("identity", RgbGen::Identity),
        ("identityLighting", RgbGen::IdentityLighting),
        ("entity", RgbGen::Entity),
        ("oneMinusEntity", RgbGen::OneMinusEntity),
        ("exactVertex", RgbGen::ExactVertex),
        ("oneMinusVertex", RgbGen::OneMinusVertex),
        ("lightingDiffuse", RgbGen::LightingDiffuse),
        (
            "wave triangle 1 2 .25 4",
            RgbGen::Wave(wave(WaveFunction::Triangle)),
        ),
        ("const ( 1 0.5 0 )", RgbGen::Const(Vec3::new(1.0, 0.5, 0.0))),
    ] {
        let stage = stage(&format!("rgbGen {text}"));
        assert_eq!(stage.rgb_gen, rgb_gen, "{text}");
        assert_eq!(stage.alpha_gen, AlphaGen::Identity, "{text}");
    }
    // Vertex colours bring their alpha unless an earlier line defines another one.
    assert_eq!(stage("rgbGen vertex").alpha_gen, AlphaGen::Vertex);
    // words of opengl2 for the same colours
    let lit = stage("rgbGen vertexLit");
    assert_eq!(
        (lit.rgb_gen, lit.alpha_gen),
        (RgbGen::Vertex, AlphaGen::Vertex)
    );
    let lit = stage("rgbGen exactVertexLit").rgb_gen;
    assert_eq!(lit, RgbGen::ExactVertex);
    assert_eq!(
        stage("alphaGen entity\nrgbGen vertex").alpha_gen,
        AlphaGen::Entity
    );
    assert_eq!(
        stage("rgbGen vertex\nalphaGen identity").alpha_gen,
        AlphaGen::Identity
    );
    // Defaults depend on blending.
    for (blend, rgb_gen) in [
        ("", RgbGen::IdentityLighting),
        ("blendFunc add", RgbGen::IdentityLighting),
        ("blendFunc blend", RgbGen::IdentityLighting),
        ("blendFunc filter", RgbGen::Identity),
        ("blendFunc GL_ZERO GL_ONE", RgbGen::Identity),
        ("blendFunc GL_ONE GL_ZERO", RgbGen::IdentityLighting),
    ] {
        assert_eq!(stage(blend).rgb_gen, rgb_gen, "{blend}");
    }
    assert_eq!(warned("rgbGen glow").0.rgb_gen, RgbGen::IdentityLighting);
    assert_eq!(
        warned("rgbGen wave square 1").0.rgb_gen,
        RgbGen::Wave(Wave {
            function: WaveFunction::Square,
            base: 1.0,
            amplitude: 0.0,
            phase: 0.0,
            frequency: 0.0,
        })
    );
    assert!(matches!(
        warned("rgbGen wave saw 1 2 3 4").0.rgb_gen,
        RgbGen::Wave(Wave {
            function: WaveFunction::Sin,
            ..
        })
    ));
    // A noise wave is for colours only.
    assert!(matches!(
        stage("rgbGen wave noise 0 1 0 1").rgb_gen,
        RgbGen::Wave(_)
    ));
    assert!(warned("alphaGen wave noise 0 1 0 1").1.contains("noise"));
}

#[test]
fn alphas() {
    for (text, alpha_gen) in [
        ("identity", AlphaGen::Identity),
        ("entity", AlphaGen::Entity),
        ("oneMinusEntity", AlphaGen::OneMinusEntity),
        ("vertex", AlphaGen::Vertex),
        ("oneMinusVertex", AlphaGen::OneMinusVertex),
        ("lightingSpecular", AlphaGen::LightingSpecular),
        ("const 0.5", AlphaGen::Const(0.5)),
        ("portal 1024", AlphaGen::Portal { range: 1024.0 }),
        (
            "wave inverseSawtooth 1 2 .25 4",
            AlphaGen::Wave(wave(WaveFunction::InverseSawtooth)),
        ),
    ] {
        assert_eq!(
            stage(&format!("alphaGen {text}")).alpha_gen,
            alpha_gen,
            "{text}"
        );
    }
    assert_eq!(
        warned("alphaGen portal").0.alpha_gen,
        AlphaGen::Portal { range: 256.0 }
    );
    assert_eq!(warned("alphaGen fade").0.alpha_gen, AlphaGen::Identity);
}

#[test]
fn texture_coordinates() {
    assert_eq!(stage("").tc_gen, TcGen::Base);
    assert_eq!(
        shader("{\nmap $lightmap\n}").stages[0].tc_gen,
        TcGen::Lightmap
    );
    assert_eq!(
        shader("{\nmap $lightmap\ntcGen base\n}").stages[0].tc_gen,
        TcGen::Base
    );
    assert_eq!(stage("tcGen lightmap").tc_gen, TcGen::Lightmap);
    assert_eq!(stage("texGen environment").tc_gen, TcGen::Environment);
    assert_eq!(stage("tcGen texture").tc_gen, TcGen::Base);
    assert_eq!(
        stage("tcGen vector ( 1 0 0 ) ( 0 .5 0 )").tc_gen,
        TcGen::Vector(Vec3::X, Vec3::Y * 0.5)
    );
    assert_eq!(warned("tcGen sphere").0.tc_gen, TcGen::Base);
    for (text, tc_mod) in [
        (
            "turb 1 2 3 4",
            TcMod::Turbulent {
                base: 1.0,
                amplitude: 2.0,
                phase: 3.0,
                frequency: 4.0,
            },
        ),
        ("scale 2 -3", TcMod::Scale(Vec2::new(2.0, -3.0))),
        ("scroll 0 .1", TcMod::Scroll(Vec2::new(0.0, 0.1))),
        (
            "stretch sin 1 2 .25 4",
            TcMod::Stretch(wave(WaveFunction::Sin)),
        ),
        (
            "transform 1 2 3 4 5 6",
            TcMod::Transform {
                matrix: [[1.0, 2.0], [3.0, 4.0]],
                translate: Vec2::new(5.0, 6.0),
            },
        ),
        ("rotate -30", TcMod::Rotate(-30.0)),
        ("entityTranslate", TcMod::EntityTranslate),
        // Words after the last argument do not matter here.
        ("rotate 5 and more", TcMod::Rotate(5.0)),
    ] {
        assert_eq!(stage(&format!("tcMod {text}")).tc_mods, [tc_mod], "{text}");
    }
    // One that cannot be read ends the list.
    let broken = script("{\nmap a\ntcMod scale 1 1\ntcMod scale 2\ntcMod rotate 5\n}");
    assert_eq!(broken.shaders[0].stages[0].tc_mods.len(), 1);
    assert_eq!(broken.diagnostics.len(), 2);
    let five = "tcMod rotate 5\n".repeat(5);
    let (five, message) = warned(&five);
    assert_eq!(five.tc_mods.len(), 5);
    assert!(message.contains("more than 4"));
}

#[test]
fn deformations() {
    for (text, deform) in [
        (
            "wave 100 sin 1 2 .25 4",
            Deform::Wave {
                spread: 0.01,
                wave: wave(WaveFunction::Sin),
            },
        ),
        (
            "normal 0.5 2",
            Deform::Normal {
                amplitude: 0.5,
                frequency: 2.0,
            },
        ),
        (
            "bulge 1 2 3",
            Deform::Bulge {
                width: 1.0,
                height: 2.0,
                speed: 3.0,
            },
        ),
        (
            "move 1 2 3 square 1 2 .25 4",
            Deform::Move {
                direction: Vec3::new(1.0, 2.0, 3.0),
                wave: wave(WaveFunction::Square),
            },
        ),
        ("autoSprite", Deform::AutoSprite),
        ("AUTOSPRITE2", Deform::AutoSprite2),
        ("projectionShadow", Deform::ProjectionShadow),
        ("text0", Deform::Text(0)),
        ("text7", Deform::Text(7)),
        ("text9", Deform::Text(0)),
    ] {
        let shader = shader(&format!("deformVertexes {text}\n{STAGE}"));
        assert_eq!(shader.deforms, [deform], "{text}");
    }
    let zero = script(&format!("deformVertexes wave 0 sin 1 2 .25 4\n{STAGE}"));
    assert!(matches!(
        zero.shaders[0].deforms[0],
        Deform::Wave { spread: 100.0, .. }
    ));
    let four = script(&format!(
        "{}{STAGE}",
        "deformVertexes autosprite\n".repeat(4)
    ));
    assert_eq!(four.shaders[0].deforms.len(), 3);
    assert_eq!(four.shaders[0].rejected, None);
    // The arguments of one too many are taken for keywords, as the engine takes them.
    let text = format!(
        "{}deformVertexes bulge 1 2 3\n{STAGE}",
        "deformVertexes autosprite\n".repeat(3)
    );
    assert!(rejected(&text).contains("unknown keyword '1'"));
}

#[test]
fn keywords_outside_stages() {
    let all = shader(&format!(
        "surfaceparm Trans\nsurfaceparm nomarks\ncull twosided\nsort seeThrough\npolygonOffset\nentityMergable\n\
         clampTime 2.5\ntesssize 64 and more\nlight 1\nnopicmip\n{STAGE}\nnomipmaps\n{STAGE}"
    ));
    assert_eq!(all.surface_flags, flags::SURF_NOMARKS);
    assert_eq!(all.content_flags, flags::CONTENTS_TRANSLUCENT);
    assert_eq!(all.surface_params, ["trans", "nomarks"]);
    assert_eq!(all.cull, Cull::None);
    assert_eq!(all.sort, Some(sort::SEE_THROUGH));
    assert!(all.polygon_offset && all.entity_mergable && all.no_picmip && all.no_mipmaps);
    assert_eq!(all.clamp_time, Some(2.5));
    assert_eq!(all.light.light, Some(1.0));
    // Image settings hold for what comes after them.
    let settings: Vec<_> = all
        .stages
        .iter()
        .map(|s| (s.no_mipmaps, s.no_picmip))
        .collect();
    assert_eq!(settings, [(false, true), (true, true)]);
    assert_eq!(all.shader_time(10.0, 1.0, 0.5), 2.5);
    assert_eq!(all.shader_time(3.0, 1.0, 0.5), 1.5);

    for (side, cull) in [
        ("back", Cull::Back),
        ("backsided", Cull::Back),
        ("disable", Cull::None),
    ] {
        assert_eq!(shader(&format!("cull {side}\n{STAGE}")).cull, cull);
    }
    assert_eq!(
        shader("skyParms env/a - -\n").sky,
        Some(Sky {
            outer: Some("env/a".into()),
            cloud_height: 512.0,
            inner: None
        })
    );
    assert_eq!(
        shader("skyParms - 300 in\n").sky,
        Some(Sky {
            outer: None,
            cloud_height: 300.0,
            inner: Some("in".into())
        })
    );
    assert!(script("skyParms a 512\n").shaders[0].sky.is_none());
    let short = script("skyParms a\n{\nmap g/a.tga\nanimMap 2\n}");
    let short = &short.shaders[0];
    assert!(short.sky.is_none() && short.rejected.is_none());
    assert_eq!(short.stages[0].image, StageImage::Map("g/a.tga".into()));
    assert_eq!(
        shader("surfaceparm fog\nfogParms ( .1 .2 .3 ) 400 old words").fog,
        Some(Fog {
            color: Vec3::new(0.1, 0.2, 0.3),
            depth: 400.0
        })
    );
}

#[test]
fn drawing_order() {
    for (body, value) in [
        ("{\nmap a\n}", sort::OPAQUE),
        ("{\nmap a\nblendFunc add\n}", sort::BLEND),
        ("{\nmap a\nblendFunc add\ndepthWrite\n}", sort::SEE_THROUGH),
        ("{\nmap a\n}\n{\nmap b\nblendFunc add\n}", sort::OPAQUE),
        ("polygonOffset\n{\nmap a\nblendFunc add\n}", sort::DECAL),
        ("polygonOffset\nsort 12.5\n{\nmap a\n}", 12.5),
        ("portal\n{\nmap a\n}", sort::PORTAL),
        ("portal\nsort nearest\n{\nmap a\n}", sort::NEAREST),
        ("sort 0\n{\nmap a\n}", sort::OPAQUE),
        ("skyParms - 512 -\nsort nearest\n{\nmap a\n}", sort::SKY),
        ("surfaceparm fog", sort::FOG),
    ] {
        assert_eq!(shader(body).sort_value(), value, "{body}");
    }
}

#[test]
fn directives_of_other_programs() {
    let light = shader(&format!(
        "qer_editorimage textures/e.tga\nq3map_surfacelight 1500\nq3map_lightimage textures/l.tga\n\
         q3map_lightRGB 1 .5 .25\nq3map_lightSubdivide 64\nq3map_skyLight 70 4\nq3map_backsplash 5 23\n\
         q3map_bounceScale 1.5\nq3map_flareShader flare\nq3map_whatever a \"b c\" // d\n{STAGE}"
    ));
    assert_eq!(light.light.editor_image.as_deref(), Some("textures/e.tga"));
    assert_eq!(light.light.surface_light, Some(1500.0));
    assert_eq!(light.light.light_image.as_deref(), Some("textures/l.tga"));
    assert_eq!(light.light.light_rgb, Some(Vec3::new(1.0, 0.5, 0.25)));
    assert_eq!(light.light.light_subdivide, Some(64.0));
    assert_eq!(light.light.sky_light, Some((70.0, 4)));
    assert_eq!(light.light.backsplash, Some((5.0, 23.0)));
    assert_eq!(light.light.bounce_scale, Some(1.5));
    assert_eq!(light.light.flare.as_deref(), Some("flare"));
    let last = light.unknown.last().unwrap();
    assert_eq!((last.keyword.as_str(), last.line), ("q3map_whatever", 12));
    assert_eq!(last.arguments, ["a", "b c"]);
    assert_eq!(light.unknown.len(), 10);
    let brightness = |lines: &str| shader(&format!("{lines}{STAGE}")).light.lightmap_brightness;
    assert_eq!(brightness(""), None);
    assert_eq!(brightness("q3map_lightmapBrightness 0.25\n"), Some(0.25));
    let twice = "q3map_lightmapGamma 0.5\nq3map_lightmapBrightness 0.5\n";
    assert_eq!(brightness(twice), Some(0.25));
    assert_eq!(brightness("q3map_lightmapBrightness -2\n"), Some(1.0));
}

#[test]
fn directives_behind_others_on_a_line_have_no_effect() {
    let value = |body: &str| shader(body).light.surface_light;
    // a carriage return alone ends no line
    let behind = "surfaceparm nomarks\r q3map_surfacelight 15000\n";
    assert_eq!(value(&format!("{behind}{STAGE}")), None);
    assert_eq!(value(&format!("{STAGE} q3map_surfacelight 15000\n")), None);
    let own = "surfaceparm nomarks\r\nq3map_surfacelight 15000 q3map_lightimage a\n";
    let own = shader(&format!("{own}{STAGE}"));
    assert_eq!(own.light.surface_light, Some(15_000.0));
    assert_eq!(own.light.light_image, None);
    // nor do they where the engine rejects the definition
    let salvaged = |body: &str| {
        let script = script(&format!("{STAGE}\nshiny yes\n{body}"));
        assert!(script.shaders[0].rejected.is_some());
        script.shaders[0].light.surface_light
    };
    assert_eq!(salvaged(behind), None);
    assert_eq!(salvaged("q3map_surfacelight 15000\n"), Some(15_000.0));
}

#[test]
fn suns() {
    let sky =
        shader("skyParms - 512 -\nq3map_sun 2 1 0 100 90 0\nq3map_sunExt 1 1 1 50 0 30 2.5 16");
    assert_eq!(sky.suns.len(), 2);
    assert_eq!(sky.sun, Some(sky.suns[1]));
    let [first, second] = [sky.suns[0], sky.suns[1]];
    assert!(first.direction.abs_diff_eq(Vec3::Y, 1e-6));
    assert_eq!(first.compiler_color(), Vec3::new(1.0, 0.5, 0.0));
    assert!((first.engine_light().length() - 100.0).abs() < 1e-3);
    assert_eq!((first.deviance_degrees, first.samples), (0.0, 1));
    let expected = Vec3::new(0.75_f32.sqrt(), 0.0, 0.5);
    assert!(second.direction.abs_diff_eq(expected, 1e-6));
    assert_eq!((second.deviance_degrees, second.samples), (2.5, 16));
}

#[test]
fn what_the_engine_rejects() {
    assert!(rejected(&format!("{STAGE}\nshiny yes")).contains("'shiny'"));
    assert!(rejected("{\nmap a\nglossy\n}").contains("'glossy'"));
    assert!(rejected("{\nmap\n}").contains("map without"));
    assert!(rejected("fogParms (1 1 1) 5\n{\nmap a\n}").contains("'('"));
    assert!(rejected("").contains("no stages"));
    assert!(rejected("surfaceparm trans").contains("no stages"));
    // A surplus word is the next keyword.
    assert!(rejected("cull none none\n{\nmap a\n}").contains("'none'"));
    let nine = STAGE.to_owned() + "\n";
    assert!(rejected(&nine.repeat(9)).contains("more than 8"));
    assert_eq!(shader(&nine.repeat(8)).stages.len(), 8);
}

#[test]
fn a_rejected_definition_keeps_what_came_before_and_its_light() {
    let script = script(&format!(
        "q3map_lightimage l\n{STAGE}\n{{\nmap b\nbad word\n{{\n}}\n}}\nq3map_surfacelight 300\nq3map_sun 1 1 1 100 0 \
         90\n{STAGE}"
    ));
    let shader = &script.shaders[0];
    assert!(shader.rejected.is_some());
    assert_eq!(shader.stages.len(), 1);
    assert_eq!(shader.light.surface_light, Some(300.0));
    assert_eq!(shader.suns.len(), 1);
    assert_eq!(
        script.diagnostics[0].to_string(),
        "test:9:1: error: name: unknown stage keyword 'bad'; the engine rejects the definition"
    );
}

#[test]
fn a_flood_of_faults_is_cut_short() {
    let script = script(&format!("{}{STAGE}\nbad", "surfaceparm odd\n".repeat(1000)));
    assert_eq!(script.diagnostics.len(), 66);
    assert!(script.diagnostics[64].message.contains("not listed"));
    assert_eq!(script.diagnostics[65].severity, Severity::Error);
}

#[test]
fn line_ends_of_every_kind() {
    for end in ["\n", "\r\n", "\r"] {
        let text = [
            "name",
            "{",
            "surfaceparm trans",
            "{",
            "map a",
            "rgbGen vertex",
            "}",
            "}",
            "",
        ]
        .join(end);
        let script = parse_script("f", text.as_bytes());
        assert_eq!(script.diagnostics, []);
        assert_eq!(script.shaders[0].stages[0].rgb_gen, RgbGen::Vertex);
        assert_eq!(script.shaders[0].stages[0].line, 4);
    }
}

#[test]
fn a_later_image_of_a_stage_replaces_the_first_which_is_still_needed() {
    let shader = shader("{\nclampmap b\nmap $lightmap\nanimMap 2 c d\nanimMap 2 e\nmap f\n}");
    assert_eq!(shader.stages[0].image, StageImage::Map("f".into()));
    assert_eq!(shader.image_names().collect::<Vec<_>>(), ["f"]);
    let needed: Vec<_> = shader.needed_images().collect();
    assert_eq!(needed, ["b", "c", "d", "e", "f"]);
}
