//! The scripts of OpenArena (0.8.5 data with the 0.8.8 patch), counted; and what holds for those of any other pack.
//!
//! The expected numbers were found by an independent reader of the same archives; see each test.

use shaderscript::{
    AlphaFunc, AlphaGen, BlendFactor, Cull, Deform, DepthFunc, Library, RgbGen, Shader, Stage,
    StageImage, TcGen, TcMod, WaveFunction, parse_script, sort, surface_params::SURF_SKY,
};
use std::{
    collections::{BTreeMap, HashSet},
    path::PathBuf,
};

/// One script file: archive, path in it, contents.
struct ScriptFile {
    pak: String,
    name: String,
    text: Vec<u8>,
}

/// Every script file of these archives, given lowest priority first; highest-priority archive first.
fn files_of(packs: &[PathBuf]) -> Vec<ScriptFile> {
    let mut files = Vec::new();
    for pack in packs.iter().rev() {
        testkit::for_each_file(std::slice::from_ref(pack), ".shader", |pak, name, text| {
            let name = name.to_ascii_lowercase();
            if name
                .strip_prefix("scripts/")
                .is_some_and(|rest| !rest.contains('/'))
            {
                let (pak, text) = (pak.to_owned(), text.to_vec());
                files.push(ScriptFile { pak, name, text });
            }
        });
    }
    files
}

/// The game's own script files; `None` when the game is not installed, or is another version than the one counted.
fn all_files() -> Option<Vec<ScriptFile>> {
    let game = testkit::game()?;
    if !game.exact() {
        testkit::skip("the packs are not those of OpenArena 0.8.8");
        return None;
    }
    Some(files_of(&game.packs))
}

/// The files that the engine reads: of equal names the one from the archive of highest priority.
fn effective_files(files: &[ScriptFile]) -> Vec<&ScriptFile> {
    let mut seen = HashSet::new();
    files.iter().filter(|f| seen.insert(&f.name)).collect()
}

fn library() -> Option<Library> {
    Some(library_of(&all_files()?))
}

fn library_of(files: &[ScriptFile]) -> Library {
    let effective = effective_files(files);
    Library::new(effective.into_iter().map(|f| (&f.name, &f.text)))
}

/// Counts `key(item)` over all items.
fn count<T, K: Ord>(
    items: impl IntoIterator<Item = T>,
    key: impl Fn(T) -> Option<K>,
) -> BTreeMap<K, usize> {
    let mut counts = BTreeMap::new();
    for key in items.into_iter().filter_map(key) {
        *counts.entry(key).or_insert(0) += 1;
    }
    counts
}

fn stages(library: &Library) -> impl Iterator<Item = &Stage> {
    library.effective().flat_map(|shader| &shader.stages)
}

#[track_caller]
fn expect<K: Ord + std::fmt::Debug>(found: &BTreeMap<K, usize>, expected: &[(K, usize)]) {
    for (key, number) in expected {
        assert_eq!(found.get(key), Some(number), "{key:?} in {found:?}");
    }
}

#[test]
fn files_and_definitions() {
    let Some(files) = all_files() else { return };
    assert_eq!(files.len(), 160);
    let effective = effective_files(&files);
    assert_eq!(effective.len(), 104);
    let paks = count(&effective, |f| Some(f.pak.as_str()));
    expect(
        &paks,
        &[
            ("pak6-patch088.pk3", 59),
            ("pak0.pk3", 30),
            ("pak6-patch085.pk3", 6),
            ("pak5-TA.pk3", 6),
            ("pak2-players.pk3", 3),
        ],
    );
    let all: usize = files
        .iter()
        .map(|f| {
            let script = parse_script(&f.name, &f.text);
            assert_eq!(script.dropped, None, "{} in {}", f.name, f.pak);
            script.shaders.len()
        })
        .sum();
    assert_eq!(all, 3508);
    let library = library().unwrap();
    assert_eq!(library.definitions().len(), 2223);
    assert_eq!(library.effective().count(), 1960);
    let names = count(library.definitions(), |s| Some(s.name.to_ascii_lowercase()));
    assert_eq!(names.values().filter(|&&n| n > 1).count(), 254);
}

#[test]
fn the_lowest_priority_archive_wins_between_files() {
    let Some(library) = library() else { return };
    // Observed in the engine: pak0's beams.shader beats the patch's oanew.shader.
    let shader = library.find("lightningBoltNew").unwrap();
    assert_eq!(shader.location.file, "scripts/beams.shader");
}

#[test]
fn rejections_are_only_for_missing_stages() {
    let Some(library) = library() else { return };
    let reasons = count(library.effective(), |s| s.rejected.clone());
    assert_eq!(
        reasons,
        BTreeMap::from([("no stages, and neither sky nor fog".to_owned(), 27)])
    );
}

#[test]
fn stages_per_definition() {
    let Some(library) = library() else { return };
    // One definition has a stage without an image, the second of three: the reference counts it with 3.
    expect(
        &count(library.effective(), |s| Some(s.stages.len())),
        &[
            (0, 64),
            (1, 619 + 1),
            (2, 472),
            (3, 659 - 1),
            (4, 101),
            (5, 36),
            (6, 8),
            (7, 1),
        ],
    );
}

#[test]
fn keywords_outside_stages() {
    let Some(library) = library() else { return };
    let shaders = || library.effective();
    expect(
        &count(shaders().flat_map(|s| &s.surface_params), |p| {
            Some(p.as_str())
        }),
        &[
            ("nomarks", 503),
            ("nolightmap", 393),
            ("trans", 374),
            ("nonsolid", 288),
            ("noimpact", 245),
            ("metalsteps", 214),
            ("nodlight", 114),
            ("sky", 71),
            ("fog", 45),
            ("water", 37),
            ("alphashadow", 34),
            ("nodraw", 26),
            ("nodamage", 22),
            ("lava", 17),
            ("pointlight", 13),
            ("lightfilter", 11),
            ("slime", 9),
            ("playerclip", 8),
            ("structural", 4),
            ("nosteps", 3),
            ("dust", 2),
            ("botclip", 2),
            ("antiportal", 1),
            ("lightgrid", 1),
        ],
    );
    assert_eq!(shaders().flat_map(|s| &s.surface_params).count(), 2446);
    // Without the one "cull front", which changes nothing.
    assert_eq!(shaders().filter(|s| s.cull == Cull::None).count(), 582);
    assert_eq!(shaders().filter(|s| s.cull == Cull::Back).count(), 0);
    expect(
        &count(shaders().flat_map(|s| &s.deforms), |d| {
            Some(match d {
                Deform::AutoSprite => "autosprite",
                Deform::AutoSprite2 => "autosprite2",
                Deform::Bulge { .. } => "bulge",
                Deform::Normal { .. } => "normal",
                Deform::ProjectionShadow => "projectionShadow",
                Deform::Text(_) => "text",
                Deform::Move { wave, .. } if wave.function == WaveFunction::Sawtooth => {
                    "move sawtooth"
                }
                Deform::Move { .. } => "move",
                Deform::Wave { wave, .. } if wave.function == WaveFunction::Sin => "wave sin",
                Deform::Wave { .. } => "wave",
            })
        }),
        &[
            ("autosprite", 170),
            ("autosprite2", 12),
            ("move sawtooth", 107),
            ("move", 8),
            ("wave sin", 71),
            ("wave", 3),
            ("bulge", 2),
            ("normal", 1),
            ("projectionShadow", 1),
        ],
    );
    assert_eq!(shaders().flat_map(|s| &s.deforms).count(), 375);
    assert_eq!(shaders().filter(|s| s.sky.is_some()).count(), 68);
    assert_eq!(shaders().filter(|s| s.fog.is_some()).count(), 56);
    assert_eq!(shaders().filter(|s| s.polygon_offset).count(), 70);
    assert_eq!(shaders().filter(|s| s.entity_mergable).count(), 1);
    assert_eq!(shaders().filter(|s| s.no_mipmaps).count(), 26);
    assert_eq!(shaders().filter(|s| s.portal).count(), 15);
    assert_eq!(shaders().filter(|s| s.clamp_time.is_some()).count(), 0);
    expect(
        &count(shaders().filter(|s| !s.portal), |s| {
            s.sort.map(|v| v as i32)
        }),
        // additive is 10.
        &[(10, 3 + 1), (16, 2), (2, 1), (11, 1), (12, 1), (8, 1)],
    );
}

#[test]
fn light_directives() {
    let Some(library) = library() else { return };
    expect(
        &count(library.effective().flat_map(|s| &s.unknown), |d| {
            Some(d.keyword.to_ascii_lowercase())
        }),
        &[
            ("qer_editorimage".into(), 809),
            ("q3map_surfacelight".into(), 540),
            ("q3map_lightimage".into(), 434),
            ("q3map_flare".into(), 314),
            ("q3map_sun".into(), 64),
            ("q3map_sunext".into(), 4),
            ("q3map_globaltexture".into(), 54),
            ("q3map_lightsubdivide".into(), 26),
            ("qer_trans".into(), 24),
            ("qer_nocarve".into(), 6),
            ("q3map_skylight".into(), 2),
            ("q3map_backsplash".into(), 2),
            ("q3map_lightrgb".into(), 1),
        ],
    );
    let lights = || library.effective().map(|s| &s.light);
    // One definition has two lines, one names an image instead of a number, one stands behind another directive.
    assert_eq!(lights().filter(|l| l.surface_light.is_some()).count(), 538);
    let range = lights()
        .filter_map(|l| l.surface_light)
        .fold((f32::MAX, f32::MIN), |(low, high), v| {
            (low.min(v), high.max(v))
        });
    assert_eq!(range, (10.0, 500_000.0));
    assert_eq!(lights().filter(|l| l.light_image.is_some()).count(), 434);
    assert_eq!(
        lights()
            .filter_map(|l| l.sky_light)
            .collect::<Vec<_>>()
            .len(),
        2
    );
    let suns = || library.effective().flat_map(|s| &s.suns);
    assert_eq!(suns().count(), 68);
    assert!(suns().all(|sun| sun.direction.is_normalized() && sun.intensity > 0.0));
    let emissive_skies = library
        .effective()
        .filter(|s| s.sky.is_some() || s.surface_flags & SURF_SKY != 0)
        .filter(|s| s.light.surface_light.is_some())
        .count();
    assert_eq!(emissive_skies, 60);
}

#[test]
fn keywords_in_stages() {
    let Some(library) = library() else { return };
    let all = || stages(&library);
    expect(
        &count(all(), |s| {
            Some(match &s.image {
                StageImage::Map(_) => "map",
                StageImage::ClampMap(_) => "clampmap",
                StageImage::Lightmap => "lightmap",
                StageImage::White => "white",
                StageImage::Video(_) => "video",
                StageImage::Animation { .. } => "animation",
            })
        }),
        &[
            ("clampmap", 363),
            ("lightmap", 825),
            ("white", 15 + 1),
            ("video", 1),
            ("animation", 90),
            // Of 2887 images, 4 are followed by another in the same stage and one is never reached.
            ("map", 2887 - 5),
        ],
    );
    expect(
        &count(all(), |s| match &s.image {
            StageImage::Animation { images, .. } => Some(images.len()),
            _ => None,
        }),
        &[(3, 2), (4, 18), (5, 7), (7, 10), (8, 53)],
    );
    use BlendFactor as F;
    let blends = count(all(), |s| s.blend.map(|b| format!("{b:?}")));
    let blend = |a: F, b: F| blends.get(&format!("{:?}", (a, b))).copied();
    assert_eq!(blend(F::One, F::One), Some(953 + 45));
    assert_eq!(blend(F::DstColor, F::Zero), Some(725 + 152));
    assert_eq!(blend(F::SrcAlpha, F::OneMinusSrcAlpha), Some(281 + 133));
    assert_eq!(blend(F::SrcAlpha, F::One), Some(238));
    assert_eq!(blend(F::DstColor, F::DstAlpha), Some(41));
    assert_eq!(blend(F::DstColor, F::OneMinusDstAlpha), Some(18));
    assert_eq!(blend(F::DstColor, F::OneMinusSrcAlpha), Some(17));
    assert_eq!(blend(F::One, F::OneMinusSrcAlpha), Some(16));
    assert_eq!(blend(F::One, F::SrcAlpha), Some(13));
    assert_eq!(blend(F::DstColor, F::SrcAlpha), Some(11));
    assert_eq!(blend(F::Zero, F::OneMinusSrcColor), Some(6));
    // One destination factor that does not exist becomes GL_ONE.
    assert_eq!(blend(F::DstColor, F::One), Some(64 + 1));
    // One stage is never reached.
    assert_eq!(blend(F::DstColor, F::SrcColor), Some(226 - 1));
    assert_eq!(blend(F::One, F::Zero), None);

    expect(
        &count(all(), |s| s.alpha_func.map(|f| format!("{f:?}"))),
        &[
            (format!("{:?}", AlphaFunc::Ge128), 156),
            (format!("{:?}", AlphaFunc::Gt0), 40),
            (format!("{:?}", AlphaFunc::Lt128), 1),
        ],
    );
    let depth_equal = |s: &&Stage| s.depth_func == DepthFunc::Equal;
    assert_eq!(all().filter(depth_equal).count(), 127);
    assert_eq!(all().filter(|s| s.detail).count(), 302 - 1);

    use WaveFunction as W;
    let rgb_wave = |f: W| {
        all()
            .filter(|s| matches!(s.rgb_gen, RgbGen::Wave(w) if w.function == f))
            .count()
    };
    for (function, number) in [
        (W::Sin, 132),
        (W::Sawtooth, 124),
        (W::Noise, 115),
        (W::InverseSawtooth, 61),
        (W::Square, 28),
        (W::Triangle, 13),
    ] {
        assert_eq!(rgb_wave(function), number, "{function:?}");
    }
    for (rgb_gen, number) in [
        (RgbGen::LightingDiffuse, 434),
        (RgbGen::Vertex, 125),
        (RgbGen::OneMinusVertex, 18),
        (RgbGen::Entity, 11),
    ] {
        assert_eq!(all().filter(|s| s.rgb_gen == rgb_gen).count(), number);
    }
    let constant = |s: &&Stage| matches!(s.rgb_gen, RgbGen::Const(_));
    assert_eq!(all().filter(constant).count(), 226);

    let alpha_wave = |f: W| {
        all()
            .filter(|s| matches!(s.alpha_gen, AlphaGen::Wave(w) if w.function == f))
            .count()
    };
    assert_eq!(alpha_wave(W::Sawtooth), 136);
    assert_eq!(alpha_wave(W::InverseSawtooth), 33);
    assert_eq!(alpha_wave(W::Sin), 29);
    let specular = |s: &&Stage| s.alpha_gen == AlphaGen::LightingSpecular;
    assert_eq!(all().filter(specular).count(), 166);
    let portal = |s: &&Stage| matches!(s.alpha_gen, AlphaGen::Portal { .. });
    assert_eq!(all().filter(portal).count(), 9);

    let environment = |s: &&Stage| s.tc_gen == TcGen::Environment;
    assert_eq!(all().filter(environment).count(), 264);
    let vector = |s: &&Stage| matches!(s.tc_gen, TcGen::Vector(..));
    assert_eq!(all().filter(vector).count(), 2);
    expect(
        &count(all().flat_map(|s| &s.tc_mods), |m| {
            Some(match m {
                TcMod::Turbulent { .. } => "turb",
                TcMod::Scale(_) => "scale",
                TcMod::Scroll(_) => "scroll",
                TcMod::Rotate(_) => "rotate",
                TcMod::Transform { .. } => "transform",
                TcMod::EntityTranslate => "entityTranslate",
                TcMod::Stretch(w) => match w.function {
                    W::Sin => "stretch sin",
                    W::Sawtooth => "stretch sawtooth",
                    W::InverseSawtooth => "stretch inversesawtooth",
                    _ => "stretch",
                },
            })
        }),
        &[
            ("scale", 444 - 1),
            ("scroll", 431),
            ("rotate", 403),
            ("turb", 101),
            ("stretch sin", 74),
            ("stretch sawtooth", 139),
            ("stretch inversesawtooth", 16),
            ("stretch", 1),
            ("transform", 2),
        ],
    );
}

#[test]
fn odd_constructs_are_tolerated() {
    let Some(library) = library() else { return };
    let find = |name: &str| -> &Shader { library.find(name).unwrap() };
    // Quoted names lose their quotes; names with a backslash match only a backslash.
    assert!(library.definitions().iter().all(|s| !s.name.contains('"')));
    // A name with an extension is never requested.
    assert!(library.find("textures/castle/terrain.vertex").is_none());
    // The name of an image as the power of a light, and a number in another line.
    assert_eq!(
        find("textures/gothic_button/timbutton").light.surface_light,
        Some(20.0)
    );
    // A stage without an image ends the list.
    assert_eq!(find("models/mapobjects/torch/torchnew").stages.len(), 1);
    // Several images in a stage: the last one counts.
    for name in ["textures/e8/e8jumpspawn02b", "textures/e8/e8jumpspawn02c"] {
        assert!(find(name).rejected.is_none());
    }
    assert_eq!(
        find("textures/sfx/proto_zzztblu3").stages[0].depth_func,
        DepthFunc::Equal
    );
    let warnings = library
        .diagnostics()
        .iter()
        .filter(|d| d.severity == shaderscript::Severity::Warning)
        .map(ToString::to_string)
        .collect::<Vec<_>>();
    assert!(
        warnings
            .iter()
            .any(|w| w.contains("unknown cull side 'front'"))
    );
    assert!(warnings.iter().any(|w| w.contains("no destination factor")));
}

/// What holds for any material, whoever wrote it: those of the game alone, and with all other packs above them.
#[test]
fn every_material_can_be_evaluated() {
    let Some(game) = testkit::game() else { return };
    check_materials(&library_of(&files_of(&game.packs)));
    let all: Vec<PathBuf> = game.all_packs().cloned().collect();
    check_materials(&library_of(&files_of(&all)));
}

fn check_materials(library: &Library) {
    for shader in library.definitions() {
        let value = shader.sort_value();
        assert!(
            (sort::PORTAL..=sort::NEAREST).contains(&value),
            "{}",
            shader.name
        );
        let passes = shaderscript::collapse(shader);
        let drawn: usize = passes
            .iter()
            .map(|p| 1 + usize::from(p.second.is_some()))
            .sum();
        assert_eq!(drawn, shader.stages.len());
    }
}
