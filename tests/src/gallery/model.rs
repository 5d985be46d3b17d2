//! Small MD3 models made by scenes.

use glam::{Vec2, Vec3};

use super::File;

/// A vertex of a model.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Units; kept in steps of 1/64.
    pub position: Vec3,
    /// Kept as two angles of a byte each.
    pub normal: Vec3,
    /// Texture coordinates, the same in every frame.
    pub st: Vec2,
}

/// A surface: its name, its shader, its triangles and its vertices in each frame.
pub struct Surface {
    /// Skins name it.
    pub name: String,
    /// As stored in the file.
    pub shader: String,
    /// Three a triangle, clockwise seen from the front.
    pub indices: Vec<i32>,
    /// As many vertices in every frame.
    pub frames: Vec<Vec<Vertex>>,
}

/// A tag: its name, its origin and its axes in each frame.
pub struct Tag {
    /// `LerpTag` finds it by that.
    pub name: String,
    /// Origin, forward, left and up of each frame.
    pub frames: Vec<[Vec3; 4]>,
}

fn text(bytes: &mut Vec<u8>, text: &str, length: usize) {
    let mut field = text.as_bytes().to_vec();
    field.resize(length, 0);
    bytes.extend(field);
}

fn ints(bytes: &mut Vec<u8>, values: &[usize]) {
    values
        .iter()
        .for_each(|&v| bytes.extend((v as i32).to_le_bytes()));
}

fn floats(bytes: &mut Vec<u8>, values: impl IntoIterator<Item = f32>) {
    values
        .into_iter()
        .for_each(|v| bytes.extend(v.to_le_bytes()));
}

/// The bytes of a normal: azimuth and polar angle, 256 steps a turn.
fn angles(normal: Vec3) -> [u8; 2] {
    let step = |radians: f32| (radians / std::f32::consts::TAU * 256.0).round() as i32 as u8;
    let polar = normal.z.clamp(-1.0, 1.0).acos();
    [step(polar), step(normal.y.atan2(normal.x))]
}

const IDENTITY: &[u8; 4] = b"IDP3";

/// An MD3. Surfaces and tags have one number of frames.
pub fn md3(surfaces: &[Surface], tags: &[Tag]) -> Vec<u8> {
    let count = surfaces.first().map_or(1, |s| s.frames.len());
    let mut bytes = IDENTITY.to_vec();
    ints(&mut bytes, &[15]);
    text(&mut bytes, "gallery", 64);
    let frames = 108;
    let tag_place = frames + 56 * count;
    let surface_place = tag_place + 112 * tags.len() * count;
    let parts: Vec<Vec<u8>> = surfaces.iter().map(surface).collect();
    let end = surface_place + parts.iter().map(Vec::len).sum::<usize>();
    ints(&mut bytes, &[0, count, tags.len(), surfaces.len(), 0]);
    ints(&mut bytes, &[frames, tag_place, surface_place, end]);
    for frame in 0..count {
        let vertices = || surfaces.iter().flat_map(|s| &s.frames[frame]);
        let low = vertices().fold(Vec3::splat(f32::MAX), |m, v| m.min(v.position));
        let high = vertices().fold(Vec3::splat(f32::MIN), |m, v| m.max(v.position));
        let middle = (low + high) / 2.0;
        let radius = (high - middle).length();
        floats(&mut bytes, low.to_array());
        floats(&mut bytes, high.to_array());
        floats(&mut bytes, middle.to_array());
        floats(&mut bytes, [radius]);
        text(&mut bytes, "frame", 16);
    }
    for frame in 0..count {
        for tag in tags {
            text(&mut bytes, &tag.name, 64);
            floats(
                &mut bytes,
                tag.frames[frame].iter().flat_map(|v| v.to_array()),
            );
        }
    }
    bytes.extend(parts.concat());
    bytes
}

fn surface(surface: &Surface) -> Vec<u8> {
    let (frames, vertices) = (surface.frames.len(), surface.frames[0].len());
    let triangles = 108;
    let shaders = triangles + surface.indices.len() * 4;
    let st = shaders + 68;
    let positions = st + vertices * 8;
    let end = positions + vertices * frames * 8;
    let mut bytes = IDENTITY.to_vec();
    text(&mut bytes, &surface.name, 64);
    ints(
        &mut bytes,
        &[0, frames, 1, vertices, surface.indices.len() / 3],
    );
    ints(&mut bytes, &[triangles, shaders, st, positions, end]);
    for index in &surface.indices {
        bytes.extend(index.to_le_bytes());
    }
    text(&mut bytes, &surface.shader, 64);
    ints(&mut bytes, &[0]);
    floats(
        &mut bytes,
        surface.frames[0].iter().flat_map(|v| v.st.to_array()),
    );
    for vertex in surface.frames.iter().flatten() {
        for value in vertex.position.to_array() {
            bytes.extend(((value * 64.0).round() as i16).to_le_bytes());
        }
        bytes.extend(angles(vertex.normal));
    }
    bytes
}

/// A square of 64 units, `n` by `n` cells, that bulges by `bulge` units towards -x, with round normals.
pub fn dome(n: i32, bulge: f32) -> (Vec<i32>, Vec<Vertex>) {
    let vertices = (0..(n + 1) * (n + 1)).map(|at| {
        let (s, t) = (
            (at % (n + 1)) as f32 / n as f32,
            (at / (n + 1)) as f32 / n as f32,
        );
        let (x, y) = (s * 2.0 - 1.0, t * 2.0 - 1.0);
        Vertex {
            position: Vec3::new(-bulge * (1.0 - (x * x + y * y) / 2.0), -32.0 * x, -32.0 * y),
            normal: Vec3::new(-1.0, -x * 0.7, -y * 0.7).normalize(),
            st: Vec2::new(s, t),
        }
    });
    let indices = (0..n * n).flat_map(|cell| {
        let first = cell / n * (n + 1) + cell % n;
        let below = first + n + 1;
        [first, first + 1, below + 1, first, below + 1, below]
    });
    (indices.collect(), vertices.collect())
}

/// `g/dome.md3`: two frames, flat and bulging, with a tag `tag_tip` on the tip; its shader is `g/base`.
pub fn files() -> Vec<File> {
    let (indices, flat) = dome(6, 0.0);
    let (_, round) = dome(6, 24.0);
    let body = Surface {
        name: "body".into(),
        shader: "g/base".into(),
        indices,
        frames: vec![flat, round],
    };
    let tip = Tag {
        name: "tag_tip".into(),
        frames: vec![
            [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            [Vec3::new(-24.0, 0.0, 0.0), Vec3::Y, -Vec3::X, Vec3::Z],
        ],
    };
    vec![("g/dome.md3".to_string(), md3(&[body], &[tip]))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_read_back() {
        let model = q3model::Md3::parse(&files()[0].1).unwrap();
        assert_eq!((model.frames.len(), model.surfaces.len()), (2, 1));
        let tip = model.lerp_tag("tag_tip", 0, 1, 0.5).unwrap();
        assert_eq!(tip.origin, Vec3::new(-12.0, 0.0, 0.0));
    }
}
