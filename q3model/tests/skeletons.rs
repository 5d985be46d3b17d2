//! Models with skeletons, sound and broken: the readers answer with a model or an error, never otherwise; poses are
//! what they should be.

use std::sync::LazyLock;

use glam::{Quat, Vec3};
use proptest::prelude::*;
use q3model::{Iqm, IqmPose, IqmVertex, Mdr};
use samples::{iqm, mdr, pose};
use survive::{survive_iqm, survive_mdr};

#[path = "common/samples.rs"]
mod samples;
#[path = "common/survive.rs"]
mod survive;

fn posed(model: &Iqm, new: usize, old: usize, back: f32) -> Vec<Vec3> {
    let mut matrices = Vec::new();
    model.pose(&model.skeleton(), new, old, back, &mut matrices);
    model
        .vertices
        .iter()
        .map(|v| v.skinned(&matrices).0)
        .collect()
}

fn near(a: Vec3, b: Vec3) -> bool {
    a.abs_diff_eq(b, 2e-3)
}

static MDR: LazyLock<Vec<u8>> = LazyLock::new(|| mdr().write(false));
static SMALL_MDR: LazyLock<Vec<u8>> = LazyLock::new(|| mdr().write(true));
static IQM: LazyLock<Vec<u8>> = LazyLock::new(|| iqm().write());

#[test]
fn written_models_read_back() {
    assert_eq!(Mdr::parse(&MDR).unwrap(), mdr());
    assert_eq!(Iqm::parse(&IQM).unwrap(), iqm());
    let plain = Iqm {
        joints: Vec::new(),
        channels: Vec::new(),
        num_frames: 0,
        numbers_per_frame: 0,
        frame_data: Vec::new(),
        bounds: vec![(Vec3::X * 4.0, Vec3::X * 12.0)],
        vertices: iqm()
            .vertices
            .into_iter()
            .map(|v| IqmVertex {
                joints: [0; 4],
                weights: [0.0; 4],
                color: [0; 4],
                ..v
            })
            .collect(),
        ..iqm()
    };
    assert_eq!(Iqm::parse(&plain.write()).unwrap(), plain);
    // absent bounds are computed
    let untold = Iqm {
        bounds: Vec::new(),
        ..plain.clone()
    };
    assert_eq!(Iqm::parse(&untold.write()).unwrap(), plain);
    assert!(!plain.is_animated());
    assert_eq!(posed(&plain, 0, 0, 0.0)[1], Vec3::X * 12.0);
}

#[test]
fn compression_halves_bones_and_keeps_them() {
    let model = Mdr::parse(&SMALL_MDR).unwrap();
    assert_eq!(MDR.len() - SMALL_MDR.len(), 2 * 16 + 4 * 24);
    assert!(model.frames.iter().all(|f| f.name.is_empty()));
    assert_eq!(model.lods, mdr().lods);
    for (bone, exact) in model.bones.iter().zip(mdr().bones) {
        for (row, exact) in bone.rows.iter().zip(exact.rows) {
            // whole numbers are exact: 1 is 32766 steps
            assert_eq!(*row, exact);
        }
    }
}

#[test]
fn mdr_vertices_follow_their_bones() {
    let model = mdr();
    let surface = &model.lods[0][0];
    let mut bones = Vec::new();
    let mut places = |new, old, back| -> Vec<(Vec3, Vec3)> {
        model.pose(new, old, back, &mut bones);
        surface
            .vertices
            .iter()
            .map(|v| surface.skinned(v, &bones))
            .collect()
    };
    let first = places(0, 0, 0.0);
    assert_eq!(first[0], (Vec3::X * 4.0, Vec3::X));
    // 0.25 (4, 0, 0) + 0.75 ((8, 0, 0) + (1, 2, 3))
    assert_eq!(first[1].0, Vec3::new(7.75, 1.5, 2.25));
    assert_eq!(first[2].0, Vec3::ZERO, "no weight, no place");
    let second = places(1, 0, 0.0);
    // 0.25 (14, 0, 0) + 0.75 (0, 8, 0); the normal keeps the length that mixing leaves
    assert_eq!(second[1].0, Vec3::new(3.5, 6.0, 0.0));
    assert_eq!(second[1].1, Vec3::new(0.25, 0.75, 0.0));
    let between = places(1, 0, 0.25);
    assert_eq!(
        between[1].0,
        second[1].0 * 0.75 + first[1].0 * 0.25,
        "bones are mixed element by element, so places are linear"
    );
}

#[test]
fn mdr_tags_are_bones() {
    let model = mdr();
    let tag = model.lerp_tag("tag_head", 0, 1, 0.25).unwrap();
    assert_eq!(tag.origin, Vec3::new(0.75, 1.5, 2.25));
    assert!(near(tag.axis[0], Vec3::new(0.75, 0.25, 0.0).normalize()));
    assert!(near(tag.axis[1], Vec3::new(-0.25, 0.75, 0.0).normalize()));
    let last = model.lerp_tag("tag_root", 9, 9, 0.0).unwrap();
    assert_eq!(last.origin, Vec3::X * 10.0);
    assert_eq!(model.lerp_tag("Tag_Head", 0, 0, 0.0), None, "case counts");
}

#[test]
fn iqm_vertices_follow_their_joints() {
    let model = iqm();
    let bound = posed(&model, 0, 0, 0.0);
    for (place, vertex) in bound.iter().zip(&model.vertices) {
        assert!(near(*place, vertex.position), "{place}");
    }
    let turned = posed(&model, 1, 1, 0.0);
    assert!(near(turned[0], Vec3::Y * 4.0));
    // ten along the turned root, then two along the arm, which is turned once more
    assert!(near(turned[1], Vec3::new(-2.0, 10.0, 0.0)));
    assert!(near(turned[2], Vec3::new(-1.0, 11.0, 0.0)));
    assert_eq!(turned[3], Vec3::X * 7.0, "no weight, no movement");
    // rotations go round, they do not cut the corner
    let half = posed(&model, 0, 1, 0.5);
    let eighth = std::f32::consts::FRAC_PI_4;
    assert!(near(
        half[0],
        Vec3::new(eighth.cos(), eighth.sin(), 0.0) * 4.0
    ));
    let mut matrices = Vec::new();
    model.pose(&model.skeleton(), 1, 1, 0.0, &mut matrices);
    assert!(near(model.vertices[1].skinned(&matrices).1, -Vec3::X));
}

#[test]
fn iqm_tags_are_joints() {
    let model = iqm();
    let tag = model.lerp_tag("tag_arm", 0, 1, 1.0).unwrap();
    assert!(near(tag.origin, Vec3::Y * 10.0));
    assert!(near(tag.axis[0], -Vec3::X));
    assert_eq!(model.lerp_tag("body", 0, 0, 0.0), None);
    // in a model without poses joints are where they were bound
    let mut still = model;
    still.set_frames(&[]);
    let tag = still.lerp_tag("tag_arm", 5, 6, 0.5).unwrap();
    assert_eq!(tag.origin, Vec3::X * 10.0);
}

#[test]
fn scales_stretch_what_is_turned() {
    let pose = IqmPose {
        translate: Vec3::Z,
        rotate: Quat::from_rotation_z(std::f32::consts::FRAC_PI_2),
        scale: Vec3::new(2.0, 3.0, 4.0),
    };
    let matrix = pose.matrix();
    assert!(near(matrix.point(Vec3::X), Vec3::new(0.0, 3.0, 1.0)));
    assert!(near(matrix.point(Vec3::Y), Vec3::new(-2.0, 0.0, 1.0)));
}

#[test]
fn truncation_anywhere_is_an_error() {
    for bytes in [&*MDR, &*SMALL_MDR] {
        // tags come last: without them the header still counts two
        for length in 0..bytes.len() {
            assert!(!survive_mdr(&bytes[..length]), "{length} bytes were enough");
        }
    }
    for length in 0..IQM.len() {
        assert!(!survive_iqm(&IQM[..length]), "{length} bytes were enough");
    }
}

fn poke(bytes: &[u8], survive: fn(&[u8]) -> bool) {
    let values = [
        -1i32,
        0,
        1,
        0x7fff_ffff,
        i32::MIN,
        104,
        0x7fc0_0000,
        0x10_0000,
    ];
    testkit::poke_words(bytes, (0..bytes.len() - 3).step_by(4), &values, survive);
}

#[test]
fn every_word_may_be_anything() {
    poke(&MDR, survive_mdr);
    poke(&SMALL_MDR, survive_mdr);
    poke(&IQM, survive_iqm);
}

#[test]
fn loops_end() {
    let mut bytes = MDR.clone();
    let lods_at = i32::from_le_bytes(bytes[88..92].try_into().unwrap()) as usize;
    // a billion levels, each where the last one was
    bytes[84..88].copy_from_slice(&1_000_000_000i32.to_le_bytes());
    bytes[lods_at + 8..lods_at + 12].copy_from_slice(&0i32.to_le_bytes());
    let error = Mdr::parse(&bytes).unwrap_err().to_string();
    assert!(
        error.starts_with("offset of level of detail 1 is "),
        "{error}"
    );
}

#[test]
fn frames_without_numbers_take_no_memory() {
    let mut model = iqm();
    let still = vec![pose(0.0, 0.0), pose(10.0, 0.0)];
    model.set_frames(&[still.clone(), still]);
    model.bounds.clear();
    assert_eq!(model.numbers_per_frame, 0);
    let mut bytes = model.write();
    bytes[92..96].copy_from_slice(&i32::MAX.to_le_bytes());
    let model = Iqm::parse(&bytes).unwrap();
    assert_eq!(model.num_frames, i32::MAX as usize);
    assert!(near(posed(&model, 1 << 30, 5, 0.5)[0], Vec3::X * 4.0));
}

#[test]
fn weights_may_be_bytes_and_joints_integers() {
    let model = iqm();
    let mut bytes = IQM.clone();
    let arrays_at = i32::from_le_bytes(IQM[52..56].try_into().unwrap()) as usize;
    // positions, texture coordinates, normals, joints, weights, colours
    let mut replace = |array: usize, format: i32, data: &[u8]| {
        let record = arrays_at + array * 20;
        let offset = bytes.len() as i32;
        bytes[record + 8..record + 12].copy_from_slice(&format.to_le_bytes());
        bytes[record + 16..record + 20].copy_from_slice(&offset.to_le_bytes());
        bytes.extend_from_slice(data);
    };
    let joints: Vec<u8> = model
        .vertices
        .iter()
        .flat_map(|v| v.joints.map(i32::from))
        .flat_map(i32::to_le_bytes)
        .collect();
    replace(3, 4, &joints);
    let weights: Vec<u8> = model
        .vertices
        .iter()
        .flat_map(|v| v.weights.map(|w| (w * 255.0) as u8))
        .collect();
    replace(4, 1, &weights);
    let length = bytes.len() as i32;
    bytes[20..24].copy_from_slice(&length.to_le_bytes());
    let read = Iqm::parse(&bytes).unwrap();
    for (found, expected) in read.vertices.iter().zip(&model.vertices) {
        assert_eq!(found.joints, expected.joints);
        for (found, expected) in found.weights.iter().zip(expected.weights) {
            assert!((found - expected).abs() < 1.0 / 255.0);
        }
    }
    assert_eq!(read.vertices[0].weights[0], 1.0);
    // a joint that no weight asks for may be anything; one that is asked for has to be there
    let first = bytes.len() - weights.len() - joints.len();
    bytes[first + 12] = 99;
    assert!(Iqm::parse(&bytes).is_ok());
    bytes[first] = 99;
    let error = Iqm::parse(&bytes).unwrap_err().to_string();
    assert_eq!(error, "joint of vertex 0 is 99, outside its 2 joints");
}

#[test]
fn formats_that_engines_refuse_are_refused() {
    let arrays_at = i32::from_le_bytes(IQM[52..56].try_into().unwrap()) as usize;
    let mut bytes = IQM.clone();
    // doubles
    bytes[arrays_at + 8..arrays_at + 12].copy_from_slice(&8i32.to_le_bytes());
    let error = Iqm::parse(&bytes).unwrap_err().to_string();
    assert!(
        error.starts_with("format of vertex array 0 is 8"),
        "{error}"
    );
    let mut bytes = IQM.clone();
    // no positions
    bytes[arrays_at..arrays_at + 4].copy_from_slice(&100i32.to_le_bytes());
    let error = Iqm::parse(&bytes).unwrap_err().to_string();
    assert!(
        error.starts_with("number of arrays of positions"),
        "{error}"
    );
}

proptest! {
    #![proptest_config(testkit::cases(256))]

    #[test]
    fn several_pokes_at_once(
        which in 0..3usize,
        pokes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
    ) {
        let file = [&MDR, &SMALL_MDR, &IQM][which];
        let survive = if which < 2 { survive_mdr } else { survive_iqm };
        let mut bytes = file.to_vec();
        for (at, value) in pokes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        survive(&bytes);
    }
}
