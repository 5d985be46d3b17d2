//! Words of reflection, as ioquake3's `opengl2` reads them.

use glam::{Vec2, Vec3};
use shaderscript::{
    GlossType, Library, NormalStage, Precedence, Reflection, Shader, SpecularStage,
};

fn read(body: &str, pbr: bool) -> (Shader, Vec<String>) {
    let text = format!("name\n{{\n{body}\n}}\n");
    let variable = |name: &str| match name {
        "r_pbr" => u8::from(pbr).to_string(),
        _ => String::new(),
    };
    let library = Library::of_engine([("a", text)], &variable, Precedence::First);
    let shader = library.find("name").unwrap().clone();
    let warnings = library.warnings_of(&shader).map(ToString::to_string);
    (shader.clone(), warnings.collect())
}

fn specular(body: &str, pbr: bool) -> SpecularStage {
    let (shader, warnings) = read(&format!("{{\nmap a\n{body}\n}}"), pbr);
    assert_eq!((shader.rejected, warnings), (None, vec![]), "{body}");
    shader.reflection.specular.unwrap_or_default()
}

#[test]
fn maps_are_not_drawn() {
    let (shader, warnings) = read(
        "{\nmap $lightmap\n}\n{\nstage diffuseMap\nmap wall\nblendFunc filter\nroughness 0.5\n}\n\
         {\nSTAGE NormalParallaxMap\nmap wall_n\nnormalScale 0.5 -2 0.1\nparallaxDepth 0.2\n}\n\
         {\nstage specularMap\nclampmap wall_s\nspecularScale 0.1 0.2 0.3 0.4\n}\n\
         {\nmap glow\nblendFunc add\n}\n{\nstage bumpMap\nmap second\n}\n{\nstage specularMap\nmap second\n}",
        false,
    );
    assert_eq!((shader.rejected, warnings), (None, vec![]));
    let names: Vec<_> = (shader.stages.iter().flat_map(|s| s.image.names()))
        .map(String::as_str)
        .collect();
    assert_eq!((names, shader.stages.len()), (vec!["wall", "glow"], 3));
    let normals = NormalStage {
        image: "wall_n".to_owned(),
        scale: Some(Vec2::new(0.5, -2.0)),
        heights: true,
        depth: Some(0.2),
    };
    let specular = SpecularStage {
        image: Some("wall_s".to_owned()),
        metallic: false,
        reflectance: Some(Vec3::new(0.1, 0.2, 0.3)),
        metal: None,
        gloss: Some(0.4),
    };
    let expected = Reflection {
        normals: Some(normals),
        specular: Some(specular),
    };
    assert_eq!(shader.reflection, expected);
    // nothing stated is nothing
    assert!(read("{\nmap a\n}", false).0.reflection.is_empty());
}

#[test]
fn words_of_one_meaning() {
    let smoothness = |body: &str, pbr| specular(body, pbr).gloss.unwrap();
    for pbr in [false, true] {
        assert_eq!(smoothness("roughness 0.25", pbr), 0.75);
        // the exponent whose peak (n + 2) / (2 pi) is the peak 1 / (pi alpha^2) of alpha = roughness^2
        for roughness in [0.2_f32, 0.5, 0.9] {
            let exponent = 2.0 / roughness.powi(4) - 2.0;
            let smoothness = smoothness(&format!("specularExponent {exponent}"), pbr);
            assert!((1.0 - smoothness - roughness).abs() < 1e-5);
        }
    }
    assert_eq!(smoothness("gloss 0.5", false), 0.5);
    assert!((smoothness("gloss 0.5", true) - (1.0 - 0.5_f32.powf(1.5))).abs() < 1e-6);
    assert_eq!(
        specular("specularReflectance 0.3", false).reflectance,
        Some(Vec3::splat(0.3))
    );
    assert_eq!(specular("specularReflectance 0.3", true).metal, Some(0.0));
    assert_eq!(specular("specularReflectance 0.7", true).metal, Some(1.0));
    let two = specular("specularScale 0.6 0.3", false);
    assert_eq!(
        (two.reflectance, two.gloss),
        (Some(Vec3::splat(0.6)), Some(0.3))
    );
    let two = specular("specularScale 0.6 0.3", true);
    assert_eq!(
        (two.metal, two.gloss, two.metallic),
        (Some(1.0), Some(0.3), true)
    );
    let four = specular("specularScale 0.6 0.3 1 1", true);
    assert_eq!((four.metal, four.gloss), (Some(0.3), Some(0.6)));
    // three numbers leave the smoothness
    let three = specular("gloss 0.9\nspecularScale 0.1 0.2 0.3", false);
    assert_eq!(three.gloss, Some(0.9));
}

#[test]
fn faults_leave_the_material() {
    for body in [
        "{\nmap a\nstage\n}",
        "{\nmap a\nstage shinyMap\n}",
        "{\nmap a\nroughness\n}",
        "{\nmap a\nspecularScale 1\n}",
        "{\nmap a\nnormalScale\n}",
        "{\nstage normalMap\nmap n\n}\n{\nmap a\n}",
    ] {
        let (shader, warnings) = read(body, false);
        assert_eq!((shader.rejected, warnings.len()), (None, 1), "{body}");
        assert!(warnings[0].starts_with("a:"), "{warnings:?}");
        assert_eq!(shader.stages.len(), 1);
        assert!(shader.reflection.is_empty());
    }
    // what is not a word stays unknown
    assert!(read("{\nmap a\nshine 1\n}", false).0.rejected.is_some());
}

#[test]
fn a_roughness_is_the_same_with_every_meaning_of_gloss() {
    let types = [
        ("", GlossType::Smoothness),
        ("0", GlossType::Gloss),
        ("1", GlossType::Smoothness),
        ("2", GlossType::Roughness),
        ("3", GlossType::Shininess),
        ("9", GlossType::Gloss),
    ];
    for (text, gloss) in types {
        assert_eq!(GlossType::of_variable(text), gloss, "{text}");
        let variable = |name: &str| match name {
            "r_glossType" => text.to_owned(),
            _ => String::new(),
        };
        for roughness in [0.2_f32, 0.5, 0.9] {
            let script = format!("name\n{{\n{{\nmap a\nroughness {roughness}\n}}\n}}\n");
            let library = Library::of_engine([("a", script)], &variable, Precedence::First);
            let stated = library.find("name").unwrap().reflection.specular.clone();
            let read = gloss.roughness(stated.unwrap().gloss.unwrap());
            assert!((read - roughness).abs() < 1e-4, "{gloss:?}: {read}");
        }
    }
    // the formulas of `opengl2`
    let at_half = types.map(|(_, gloss)| gloss.roughness(0.5));
    let shiny = (2.0_f32 / 4097.0).powf(0.25);
    assert_eq!(at_half[1..5], [0.5_f32.powf(1.5), 0.5, 0.5, shiny]);
}

#[test]
fn heights_have_a_depth() {
    let normals = |words: &str| {
        let body = format!("{{\nmap a\n}}\n{{\n{words}\nmap n\n}}");
        let (shader, warnings) = read(&body, false);
        assert_eq!((shader.rejected, warnings), (None, vec![]), "{words}");
        let stage = shader.reflection.normals.unwrap();
        (stage.heights, stage.depth, stage.scale)
    };
    assert_eq!(normals("stage normalMap"), (false, None, None));
    assert_eq!(normals("stage bumpParallaxMap"), (true, None, None));
    let scale = Some(Vec2::new(1.0, 2.0));
    let both = normals("stage normalParallaxMap\nnormalScale 1 2 0.3");
    assert_eq!(both, (true, Some(0.3), scale));
    // the kind of a stage forgets what was stated before it
    let before = normals("parallaxDepth 0.3\nstage normalParallaxMap");
    assert_eq!(before, (true, None, None));
}
