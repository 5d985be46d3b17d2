//! Made-up models of each format.
#![allow(dead_code, reason = "each test takes some of them")]

use glam::{Quat, Vec2, Vec3, Vec4};
use q3model::{
    BoneMatrix, Frame, Iqm, IqmJoint, IqmPose, IqmSurface, IqmVertex, Md3, Mdr, MdrSurface, MdrTag,
    MdrVertex, MdrWeight, PackedVertex, Surface, Tag,
};

pub fn md3() -> Md3 {
    let frame = |name: &str| Frame {
        mins: Vec3::splat(-1.0),
        maxs: Vec3::splat(1.0),
        local_origin: Vec3::ZERO,
        radius: 2.0,
        name: name.to_owned(),
    };
    let tag = |name: &str, x: f32, forward: Vec3| Tag {
        name: name.to_owned(),
        origin: Vec3::new(x, 0.0, 0.0),
        axis: [forward, Vec3::Z.cross(forward), Vec3::Z],
    };
    let surface = |name: &str| Surface {
        name: name.to_owned(),
        shaders: vec!["models/a.tga".to_owned()],
        triangles: vec![[0, 1, 2], [2, 1, 3]],
        st: vec![Vec2::ONE; 4],
        vertices: (0..8)
            .map(|at| PackedVertex::pack(Vec3::splat(at as f32), Vec3::Z))
            .collect(),
        num_verts: 4,
    };
    Md3 {
        name: "models/a.md3".to_owned(),
        frames: vec![frame("one"), frame("two")],
        tags: vec![
            tag("tag_head", 0.0, Vec3::X),
            tag("tag_weapon", 1.0, Vec3::X),
            tag("tag_head", 10.0, Vec3::Y),
            tag("tag_weapon", 3.0, Vec3::X),
        ],
        num_tags: 2,
        surfaces: vec![surface("body"), surface("hat")],
    }
}

pub fn moved(x: f32, y: f32, z: f32) -> BoneMatrix {
    let mut bone = BoneMatrix::IDENTITY;
    for (row, value) in bone.rows.iter_mut().zip([x, y, z]) {
        row.w = value;
    }
    bone
}

/// A quarter turn about z.
pub fn turned() -> BoneMatrix {
    BoneMatrix {
        rows: [-Vec4::Y, Vec4::X, Vec4::Z],
    }
}

pub fn mdr() -> Mdr {
    let frame = |name: &str| Frame {
        mins: Vec3::splat(-1.0),
        maxs: Vec3::splat(1.0),
        local_origin: Vec3::Z,
        radius: 2.0,
        name: name.to_owned(),
    };
    let weight = |bone, weight, x| MdrWeight {
        bone,
        weight,
        offset: Vec3::X * x,
    };
    let vertex = |first_weight, num_weights| MdrVertex {
        normal: Vec3::X,
        st: Vec2::new(0.25, 0.75),
        first_weight,
        num_weights,
    };
    let surface = |name: &str, corners: &[[u32; 3]]| MdrSurface {
        name: name.to_owned(),
        shader: "models/a".to_owned(),
        triangles: corners.to_vec(),
        vertices: vec![vertex(0, 1), vertex(1, 2), vertex(3, 0), vertex(3, 1)],
        weights: vec![
            weight(0, 1.0, 4.0),
            weight(0, 0.25, 4.0),
            weight(1, 0.75, 8.0),
            weight(1, 1.0, 0.0),
        ],
    };
    Mdr {
        name: "models/a.mdr".to_owned(),
        frames: vec![frame("one"), frame("two")],
        bones: vec![
            BoneMatrix::IDENTITY,
            moved(1.0, 2.0, 3.0),
            moved(10.0, 0.0, 0.0),
            turned(),
        ],
        num_bones: 2,
        lods: vec![
            vec![
                surface("body", &[[0, 1, 2], [2, 1, 3]]),
                surface("hat", &[[0, 1, 2]]),
            ],
            vec![surface("body", &[[0, 1, 2]])],
        ],
        tags: vec![
            MdrTag {
                name: "tag_head".to_owned(),
                bone: 1,
            },
            MdrTag {
                name: "tag_root".to_owned(),
                bone: 0,
            },
        ],
    }
}

pub fn pose(x: f32, turn: f32) -> IqmPose {
    IqmPose {
        translate: Vec3::new(x, 0.0, 0.0),
        rotate: Quat::from_rotation_z(turn),
        scale: Vec3::ONE,
    }
}

pub fn iqm() -> Iqm {
    let vertex = |x: f32, joints: [u8; 4], weights: [f32; 4]| IqmVertex {
        position: Vec3::X * x,
        normal: Vec3::X,
        st: Vec2::new(0.25, 0.75),
        color: [1, 2, 3, 4],
        joints,
        weights,
    };
    let joint = |name: &str, parent, x| IqmJoint {
        name: name.to_owned(),
        parent,
        pose: pose(x, 0.0),
    };
    let mut model = Iqm {
        surfaces: vec![
            IqmSurface {
                name: "body".to_owned(),
                material: "models/a".to_owned(),
                first_vertex: 0,
                num_vertices: 3,
                triangles: vec![[0, 1, 2], [2, 1, 0]],
            },
            IqmSurface {
                name: "hat".to_owned(),
                material: String::new(),
                first_vertex: 1,
                num_vertices: 3,
                triangles: vec![[0, 1, 2]],
            },
        ],
        vertices: vec![
            vertex(4.0, [0; 4], [1.0, 0.0, 0.0, 0.0]),
            vertex(12.0, [1, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
            vertex(12.0, [0, 1, 0, 0], [0.5, 0.5, 0.0, 0.0]),
            vertex(7.0, [0; 4], [0.0; 4]),
        ],
        joints: vec![joint("root", None, 0.0), joint("tag_arm", Some(0), 10.0)],
        bounds: vec![(Vec3::splat(-16.0), Vec3::splat(16.0)); 2],
        ..Iqm::default()
    };
    let quarter = std::f32::consts::FRAC_PI_2;
    model.set_frames(&[
        vec![pose(0.0, 0.0), pose(10.0, 0.0)],
        vec![pose(0.0, quarter), pose(10.0, quarter)],
    ]);
    model
}
