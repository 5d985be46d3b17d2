//! A bent tube as a model of every kind: one shape that key frames, bones and joints have to draw alike.

use glam::{Mat3, Quat, Vec2, Vec3};
use q3model::{
    BoneMatrix, Frame, Iqm, IqmJoint, IqmPose, IqmSurface, IqmVertex, Md3, Mdr, MdrSurface, MdrTag,
    MdrVertex, MdrWeight, PackedVertex, Surface, Tag,
};

/// Corners around the tube, the first twice: once for each end of the texture.
const SIDES: usize = 14;
const RINGS: usize = 9;
const RADIUS: f32 = 9.0;
const HEIGHT: f32 = 48.0;
/// Key frames: upright, bent, twisted.
pub const FRAMES: usize = 3;
/// Name of the tag at the upper end.
pub const TAG: &str = "tag_top";

/// Where the upper bone is in a frame: the axes of what hangs on it, and its place above the lower one.
fn bend(frame: usize) -> (Mat3, Vec3) {
    let middle = Vec3::Z * (HEIGHT / 2.0);
    match frame {
        0 => (Mat3::IDENTITY, middle),
        1 => (Mat3::from_rotation_x(0.9), middle),
        _ => (
            Mat3::from_rotation_z(1.2) * Mat3::from_rotation_y(-0.7),
            middle + Vec3::new(0.0, 6.0, 5.0),
        ),
    }
}

/// The lower bone: the same for all frames but the last, in which it leans.
fn lean(frame: usize) -> (Mat3, Vec3) {
    let turn = if frame == 2 { 0.3 } else { 0.0 };
    (Mat3::from_rotation_x(turn), Vec3::Z * (-HEIGHT / 2.0))
}

/// A vertex of the upright tube.
#[derive(Clone, Copy)]
struct Point {
    position: Vec3,
    normal: Vec3,
    st: Vec2,
    /// How much it hangs on the upper bone.
    upper: f32,
}

/// Vertices of the rings from `first` to `last`.
fn points(first: usize, last: usize) -> Vec<Point> {
    (first..=last)
        .flat_map(|ring| (0..=SIDES).map(move |side| (ring, side)))
        .map(|(ring, side)| {
            let (up, around) = (ring as f32 / (RINGS - 1) as f32, side as f32 / SIDES as f32);
            let angle = around * std::f32::consts::TAU;
            let normal = Vec3::new(angle.cos(), angle.sin(), 0.0);
            let upper = (up * 2.0 - 0.5).clamp(0.0, 1.0);
            Point {
                position: normal * RADIUS + Vec3::Z * (up - 0.5) * HEIGHT,
                normal,
                st: Vec2::new(1.0 - around * 2.0, 1.0 - up),
                upper,
            }
        })
        .collect()
}

/// Triangles between so many rings, clockwise seen from outside.
fn triangles(rings: usize) -> Vec<[u32; 3]> {
    let row = SIDES as u32 + 1;
    (0..rings as u32 - 1)
        .flat_map(|ring| (0..SIDES as u32).map(move |side| ring * row + side))
        .flat_map(|at| [[at, at + row, at + 1], [at + 1, at + row, at + row + 1]])
        .collect()
}

/// The parts of the model: their names, shaders and rings.
const PARTS: [(&str, &str, usize, usize); 2] = [
    ("lower", "g/base", 0, RINGS / 2),
    ("upper", "tube/upper", RINGS / 2, RINGS - 1),
];

fn bones(frame: usize) -> [BoneMatrix; 2] {
    let (low_turn, low) = lean(frame);
    let (turn, middle) = bend(frame);
    [
        matrix(low_turn, low),
        matrix(low_turn * turn, low + low_turn * middle),
    ]
}

fn matrix(turn: Mat3, place: Vec3) -> BoneMatrix {
    let rows = turn.transpose();
    BoneMatrix {
        rows: [
            rows.x_axis.extend(place.x),
            rows.y_axis.extend(place.y),
            rows.z_axis.extend(place.z),
        ],
    }
}

/// A vertex's place and normal in a frame.
fn posed(point: &Point, frame: usize) -> (Vec3, Vec3) {
    let mut sum = (Vec3::ZERO, Vec3::ZERO);
    let parts = bones(frame).into_iter().zip(bones(0));
    for ((bone, bound), weight) in parts.zip([1.0 - point.upper, point.upper]) {
        let back = bound.inverse_of_even();
        sum.0 += bone.point(back.point(point.position)) * weight;
        sum.1 += bone.direction(back.direction(point.normal)) * weight;
    }
    sum
}

fn frame(number: usize) -> Frame {
    let all = points(0, RINGS - 1);
    let places = all.iter().map(|p| posed(p, number).0);
    let mins = places.clone().fold(Vec3::INFINITY, Vec3::min);
    let maxs = places.clone().fold(Vec3::NEG_INFINITY, Vec3::max);
    let local_origin = (mins + maxs) / 2.0;
    Frame {
        mins,
        maxs,
        local_origin,
        radius: places.fold(0.0, |r: f32, p| r.max(p.distance(local_origin))),
        name: format!("frame{number}"),
    }
}

/// With vertices per frame, `parts` of two. Each part has `g/base`, its own shader and `g/env` as skins 0, 1 and 2.
pub fn md3(parts: usize) -> Vec<u8> {
    let tag = |number: usize| {
        let [_, upper] = bones(number);
        Tag {
            name: TAG.into(),
            origin: upper.point(Vec3::Z * (HEIGHT / 2.0)),
            axis: upper.axes(),
        }
    };
    let surface = |(name, shader, first, last): (&str, &str, usize, usize)| {
        let all = points(first, last);
        let in_frame = |number: usize| {
            all.iter()
                .map(move |p| posed(p, number))
                .map(|(position, normal)| PackedVertex::pack(position, normal))
        };
        Surface {
            name: name.into(),
            shaders: ["g/base", shader, "g/env"].map(Into::into).to_vec(),
            triangles: triangles(last - first + 1),
            st: all.iter().map(|p| p.st).collect(),
            vertices: (0..FRAMES).flat_map(in_frame).collect(),
            num_verts: all.len(),
        }
    };
    Md3 {
        name: "tube".into(),
        frames: (0..FRAMES).map(frame).collect(),
        tags: (0..FRAMES).map(tag).collect(),
        num_tags: 1,
        surfaces: PARTS.into_iter().take(parts).map(surface).collect(),
    }
    .write()
}

/// With bones per frame. Its coarser level is the lower part alone.
pub fn mdr(compressed: bool) -> Vec<u8> {
    let surface = |(name, shader, first, last): (&str, &str, usize, usize)| {
        let mut surface = MdrSurface {
            name: name.into(),
            shader: shader.into(),
            triangles: triangles(last - first + 1),
            ..MdrSurface::default()
        };
        for point in points(first, last) {
            let first_weight = surface.weights.len() as u32;
            for (bone, weight) in [(0, 1.0 - point.upper), (1, point.upper)] {
                if weight > 0.0 {
                    let bound = bones(0)[bone as usize].inverse_of_even();
                    surface.weights.push(MdrWeight {
                        bone,
                        weight,
                        offset: bound.point(point.position),
                    });
                }
            }
            surface.vertices.push(MdrVertex {
                normal: point.normal,
                st: point.st,
                first_weight,
                num_weights: surface.weights.len() as u32 - first_weight,
            });
        }
        surface
    };
    let parts = PARTS.map(surface).to_vec();
    Mdr {
        name: "tube".into(),
        frames: (0..FRAMES).map(frame).collect(),
        bones: (0..FRAMES).flat_map(bones).collect(),
        num_bones: 2,
        lods: vec![parts.clone(), parts[..1].to_vec()],
        tags: vec![MdrTag {
            name: TAG.into(),
            bone: 1,
        }],
    }
    .write(compressed)
}

/// With joints. `stretched`: the upper joint is also scaled, evenly and not, and vertices have colours.
pub fn iqm(stretched: bool) -> Vec<u8> {
    let pose = |(turn, place): (Mat3, Vec3), scale: Vec3| IqmPose {
        translate: place,
        rotate: Quat::from_mat3(&turn),
        scale,
    };
    let joint = |name: &str, parent, pose| IqmJoint {
        name: name.into(),
        parent,
        pose,
    };
    let scale = |frame: usize| match (stretched, frame) {
        (true, 1) => Vec3::splat(1.5),
        (true, 2) => Vec3::new(1.2, 0.7, 1.4),
        _ => Vec3::ONE,
    };
    let mut model = Iqm {
        joints: vec![
            joint("root", None, pose(lean(0), Vec3::ONE)),
            joint(TAG, Some(0), pose(bend(0), Vec3::ONE)),
        ],
        ..Iqm::default()
    };
    for (name, shader, first, last) in PARTS {
        let all = points(first, last);
        model.surfaces.push(IqmSurface {
            name: name.into(),
            material: shader.into(),
            first_vertex: model.vertices.len(),
            num_vertices: all.len(),
            triangles: triangles(last - first + 1),
        });
        model.vertices.extend(all.iter().map(|point| {
            let (joints, weights) = if point.upper >= 1.0 {
                ([1, 0, 0, 0], [1.0, 0.0, 0.0, 0.0])
            } else {
                let weights = [1.0 - point.upper, point.upper, 0.0, 0.0];
                ([0, 1, 0, 0], weights)
            };
            let shade = |v: f32| (v.clamp(0.0, 1.0) * 255.0) as u8;
            let color = if stretched {
                [
                    shade(point.upper),
                    shade(0.5 + point.normal.x * 0.5),
                    shade(0.5 + point.normal.y * 0.5),
                    shade(0.3 + point.upper * 0.7),
                ]
            } else {
                [0; 4]
            };
            IqmVertex {
                position: point.position,
                normal: point.normal,
                st: point.st,
                color,
                joints,
                weights,
            }
        }));
    }
    let frames: Vec<_> = (0..FRAMES)
        .map(|number| {
            vec![
                pose(lean(number), Vec3::ONE),
                pose(bend(number), scale(number)),
            ]
        })
        .collect();
    model.set_frames(&frames);
    model.bounds = (0..FRAMES)
        .map(|number| {
            let frame = frame(number);
            (frame.mins, frame.maxs)
        })
        .collect();
    model.write()
}

/// The same, bound with joints that lean and are scaled unevenly, so that nothing undoes their matrices exactly.
pub fn skewed_iqm() -> Vec<u8> {
    let mut model = Iqm::parse(&iqm(true)).expect("a model of one's own");
    for (joint, scale) in model.joints.iter_mut().zip([1.2, 0.8]) {
        joint.pose.rotate *= Quat::from_rotation_x(0.4) * Quat::from_rotation_y(0.3);
        joint.pose.scale = Vec3::new(scale, 1.0, 1.1);
    }
    model.write()
}

/// The same without poses, joints and bounds.
pub fn rigid_iqm() -> Vec<u8> {
    let model = Iqm::parse(&iqm(true)).expect("a model of one's own");
    Iqm {
        joints: Vec::new(),
        channels: Vec::new(),
        num_frames: 0,
        frame_data: Vec::new(),
        numbers_per_frame: 0,
        bounds: Vec::new(),
        ..model
    }
    .write()
}
