//! Broken models: the reader answers with a model or an error, never otherwise.

use glam::{Vec2, Vec3};
use proptest::prelude::*;
use q3model::{Md3, PackedVertex, Skin};
use samples::md3 as sample;
use std::sync::LazyLock;
use survive::{survive_md3 as survive, survive_skin};

#[path = "common/samples.rs"]
mod samples;
#[path = "common/survive.rs"]
mod survive;

static SAMPLE: LazyLock<Vec<u8>> = LazyLock::new(|| sample().write());

#[test]
fn written_models_read_back() {
    assert_eq!(Md3::parse(&SAMPLE).unwrap(), sample());
}

#[test]
fn tags_are_mixed_and_clamped() {
    let model = sample();
    let tag = model.lerp_tag("tag_head", 0, 1, 0.25).unwrap();
    assert_eq!(tag.origin, Vec3::new(2.5, 0.0, 0.0));
    assert!(tag.axis[0].abs_diff_eq(Vec3::new(3.0, 1.0, 0.0).normalize(), 1e-6));
    assert!(tag.axis.iter().all(|a| (a.length() - 1.0).abs() < 1e-6));
    assert_eq!(
        model.lerp_tag("tag_head", 99, 99, 0.5).unwrap().origin.x,
        10.0
    );
    assert_eq!(
        model.lerp_tag("tag_head", -1, -1, 0.5).unwrap().origin.x,
        0.0
    );
    assert_eq!(model.lerp_tag("Tag_Head", 0, 0, 0.0), None, "case counts");
}

#[test]
fn truncation_anywhere_is_an_error() {
    for length in 0..SAMPLE.len() {
        assert!(!survive(&SAMPLE[..length]), "{length} bytes were enough");
    }
}

#[test]
fn every_word_may_be_anything() {
    let words = (0..SAMPLE.len() - 3).step_by(4);
    let values = [-1i32, 0, 1, 0x7fff_ffff, i32::MIN, 108, 0x7fc0_0000];
    testkit::poke_words(&SAMPLE, words, &values, survive);
}

#[test]
fn loops_of_surfaces_end() {
    let mut model = sample();
    model.surfaces.truncate(1);
    let mut bytes = model.write();
    let surface = bytes.len() - 64 - 32 - 68 - 24 - 108;
    assert_eq!(&bytes[surface..surface + 4], b"IDP3");
    bytes[84..88].copy_from_slice(&1_000_000_000i32.to_le_bytes());
    bytes[surface + 104..surface + 108].copy_from_slice(&0i32.to_le_bytes());
    let error = Md3::parse(&bytes).unwrap_err().to_string();
    assert!(error.starts_with("offset of surface 1 is "), "{error}");
}

#[test]
fn big_surfaces_are_read() {
    let mut model = sample();
    let surface = &mut model.surfaces[0];
    surface.num_verts = 5000;
    surface.st = vec![Vec2::ZERO; 5000];
    surface.vertices = vec![PackedVertex::default(); 10_000];
    surface.triangles = vec![[4999, 0, 1]; 4000];
    assert_eq!(Md3::parse(&model.write()).unwrap(), model);
}

#[test]
fn packing_keeps_directions() {
    for direction in [
        Vec3::X,
        Vec3::NEG_Y,
        Vec3::NEG_Z,
        Vec3::new(1.0, -2.0, 0.5).normalize(),
    ] {
        let packed = PackedVertex::pack(Vec3::new(1.5, -2.25, 1e9), direction);
        assert!(packed.normal().dot(direction) > 0.999, "{direction}");
        assert_eq!(packed.position().y, -2.25);
        assert!(packed.position().z < 512.0);
    }
}

#[test]
fn skins_are_tolerant() {
    let skin = Skin::parse(
        b"Head,models/head.tga\r\n// body,no\ntag_head,\n\"Two Words\" , \"a b\"\n/* x */ last,\n\0after,nul",
    );
    let found: Vec<(&str, &str)> = skin
        .surfaces
        .iter()
        .map(|s| (s.surface.as_str(), s.shader.as_str()))
        .collect();
    assert_eq!(found[0], ("head", "models/head.tga"));
    assert_eq!(found[1].0, "two words");
    assert_eq!(skin.shader_for("after"), None);
    assert_eq!(skin.shader_for("tag_head"), None);
    assert_eq!(skin.shader_for("head"), Some("models/head.tga"));
}

proptest! {
    #![proptest_config(testkit::cases(256))]

    #[test]
    fn several_pokes_at_once(pokes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20)) {
        let mut bytes = SAMPLE.clone();
        for (at, value) in pokes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        survive(&bytes);
    }

    #[test]
    fn skins_may_be_anything(text in prop::collection::vec(prop::sample::select(&b"ab,\" \n/*t_g"[..]), 0..200)) {
        survive_skin(&text);
    }
}
