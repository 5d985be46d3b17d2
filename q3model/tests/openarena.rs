//! All models and skins of an installed OpenArena, counted; and what holds for those of any other pack beside them.

use q3model::{Md3, Skin};
use std::collections::BTreeSet;

#[test]
fn every_model_is_read_and_survives_writing() {
    let Some(game) = testkit::game() else { return };
    let (mut most_frames, mut most_surfaces, mut most_tags) = (0, 0, 0);
    let mut beyond_the_engine = BTreeSet::new();
    let mut names = BTreeSet::new();
    let models = testkit::for_each_file(&game.packs, ".md3", |pak, name, bytes| {
        let model = match Md3::parse(bytes) {
            Ok(model) => model,
            Err(error) => panic!("{pak}/{name}: {error}"),
        };
        names.insert(name.to_ascii_lowercase());
        most_frames = most_frames.max(model.frames.len());
        most_surfaces = most_surfaces.max(model.surfaces.len());
        most_tags = most_tags.max(model.num_tags);
        if model
            .surfaces
            .iter()
            .any(|s| s.num_verts >= 1000 || s.triangles.len() >= 2000)
        {
            beyond_the_engine.insert(name.to_owned());
        }
        check_model(&model, &format!("{pak}/{name}"));
        for tag in model.frame_tags(0) {
            let last = model.frames.len() as i32;
            let between = model.lerp_tag(&tag.name, 0, last, 0.5).unwrap();
            assert!(
                between.axis.iter().all(|a| (a.length() - 1.0).abs() < 1e-4),
                "{pak}/{name}"
            );
        }
    });
    if !game.exact() {
        return;
    }
    // Some are in several paks.
    assert_eq!((models, names.len()), (331, 293));
    assert_eq!((most_frames, most_surfaces, most_tags), (325, 24, 4));
    assert!(beyond_the_engine.iter().eq([
        "models/map/forklift.md3",
        "models/mapobjects/gargoyle/gargoyle.md3"
    ]));
}

#[test]
fn every_skin_is_read() {
    let Some(game) = testkit::game() else { return };
    let mut names = BTreeSet::new();
    let mut entries = 0;
    let mut empty = Vec::new();
    let skins = testkit::for_each_file(&game.packs, ".skin", |_, name, bytes| {
        names.insert(name.to_ascii_lowercase());
        let skin = Skin::parse(bytes);
        entries += skin.surfaces.len();
        if skin.surfaces.is_empty() {
            empty.push(name.to_owned());
        }
        check_skin(&skin, name);
    });
    if !game.exact() {
        return;
    }
    assert_eq!((skins, names.len()), (306, 276));
    println!("{entries} entries; without any: {empty:?}");
}

/// What holds for any model and skin, whoever made it. What is no model is refused, with a line that names it.
#[test]
fn models_and_skins_of_other_packs_are_read() {
    let Some(game) = testkit::game() else { return };
    let models =
        testkit::for_each_file(&game.others, ".md3", |pack, name, bytes| {
            match Md3::parse(bytes) {
                Ok(model) => check_model(&model, &format!("{pack}/{name}")),
                Err(error) => println!("{pack}/{name} is refused: {error}"),
            }
        });
    let skins = testkit::for_each_file(&game.others, ".skin", |_, name, bytes| {
        check_skin(&Skin::parse(bytes), name);
    });
    println!("{models} models, {skins} skins");
}

fn check_model(model: &Md3, name: &str) {
    for surface in &model.surfaces {
        assert_eq!(surface.st.len(), surface.num_verts);
        assert_eq!(
            surface.vertices.len(),
            surface.num_verts * model.frames.len()
        );
        for normal in surface.vertices.iter().map(|v| v.normal()) {
            assert!((normal.length() - 1.0).abs() < 1e-4);
        }
    }
    // Compared as text, because NaN is not equal to itself.
    let again = Md3::parse(&model.write()).unwrap();
    assert_eq!(format!("{again:?}"), format!("{model:?}"), "{name}");
}

fn check_skin(skin: &Skin, name: &str) {
    for entry in &skin.surfaces {
        for text in [&entry.surface, &entry.shader] {
            assert!(!text.contains([',', '\n', '"']), "{name}: {entry:?}");
        }
        assert!(skin.shader_for(&entry.surface).is_some());
    }
}
