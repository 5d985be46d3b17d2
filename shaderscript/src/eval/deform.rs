//! `deformVertexes`: vertices moved, turned to the viewer or replaced, before colours and texture coordinates.

use super::{
    noise::noise4,
    wave::{sine, wave, wave_with_offset},
};
use crate::shader::Deform;
use glam::{Vec2, Vec3};

/// What deformations see of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeformVertex {
    /// In entity space.
    pub position: Vec3,
    /// Unit, in entity space.
    pub normal: Vec3,
    /// Base texture coordinates.
    pub st: Vec2,
    /// Vertex colour.
    pub color: [u8; 4],
}

/// What deformations depend on besides the vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeformContext<'a> {
    /// Shader time in seconds.
    pub time: f64,
    /// Scene time in seconds: `bulge` ignores the entity's and the material's own times.
    pub frame_time: f64,
    /// The viewer's forward, left and up directions in entity space, of unit length in world space. In mirrors as
    /// the mirrored camera has them.
    pub view_axes: [Vec3; 3],
    /// The view is a mirror's: sprites are turned inside out, so that they still face the camera.
    pub mirrored: bool,
    /// Length of the entity's first axis when its axes are scaled, else 1. Sprites keep their size.
    pub axis_length: f32,
    /// For `projectionShadow`; without it that deformation does nothing.
    pub shadow: Option<ShadowProjection>,
    /// The scene's text strings, for `text0` to `text7`; bytes as the font image orders its characters. Missing ones
    /// are empty.
    pub texts: &'a [&'a [u8]],
}

impl Default for DeformContext<'_> {
    /// Time 0, the viewer's axes those of the entity, no shadow, no text.
    fn default() -> Self {
        DeformContext {
            time: 0.0,
            frame_time: 0.0,
            view_axes: [Vec3::X, Vec3::Y, Vec3::Z],
            mirrored: false,
            axis_length: 1.0,
            shadow: None,
            texts: &[],
        }
    }
}

/// Ground plane and light of a planar shadow, in entity space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowProjection {
    /// World up.
    pub up: Vec3,
    /// Height of the entity's origin above the plane, in world units.
    pub ground_distance: f32,
    /// Unit vector towards the light.
    pub light: Vec3,
}

/// Applies deformations in order.
///
/// `indices` are triangles into `vertices`. Deformations that rebuild quads (`autosprite`, `text`) replace both
/// lists; `autosprite2` reads the triangles to keep their winding. A last group of fewer than four vertices cannot
/// be a quad: it is dropped by `autosprite` and left alone by `autosprite2`.
pub fn deform(
    deforms: &[Deform],
    vertices: &mut Vec<DeformVertex>,
    indices: &mut Vec<u32>,
    context: &DeformContext,
) {
    for deform in deforms {
        match deform {
            Deform::Wave { spread, wave: w } => {
                for v in vertices.iter_mut() {
                    // Without a frequency the engine leaves the spread out.
                    let offset = if w.frequency == 0.0 {
                        0.0
                    } else {
                        v.position.element_sum() * spread
                    };
                    v.position += v.normal * wave_with_offset(w, context.time, offset);
                }
            }
            Deform::Normal {
                amplitude,
                frequency,
            } => {
                let t = context.time * f64::from(*frequency);
                for v in vertices.iter_mut() {
                    let p = v.position * 0.98;
                    let noise = |shift: f32| noise4(p.x + shift, p.y, p.z, t);
                    let bent =
                        v.normal + *amplitude * Vec3::new(noise(0.0), noise(100.0), noise(200.0));
                    v.normal = bent.normalize_or(v.normal);
                }
            }
            Deform::Bulge {
                width,
                height,
                speed,
            } => {
                let now = context.frame_time * f64::from(*speed);
                for v in vertices.iter_mut() {
                    let radians = f64::from(v.st.x * width) + now;
                    v.position += v.normal * sine(radians / std::f64::consts::TAU) * *height;
                }
            }
            Deform::Move { direction, wave: w } => {
                let offset = *direction * wave(w, context.time);
                for v in vertices.iter_mut() {
                    v.position += offset;
                }
            }
            Deform::AutoSprite => autosprite(vertices, indices, context),
            Deform::AutoSprite2 => autosprite2(vertices, indices, context.view_axes[0]),
            Deform::ProjectionShadow => {
                if let Some(shadow) = &context.shadow {
                    project(vertices, shadow);
                }
            }
            Deform::Text(number) => {
                // A text that the game did not set is empty.
                let text = context.texts.get(usize::from(*number)).copied();
                text_quads(text.unwrap_or_default(), vertices, indices, context);
            }
        }
    }
}

/// Appends a camera-facing quad. `corners` are the texture coordinates of its first and third vertex.
fn push_quad(
    vertices: &mut Vec<DeformVertex>,
    indices: &mut Vec<u32>,
    center: Vec3,
    [left, up]: [Vec3; 2],
    normal: Vec3,
    color: [u8; 4],
    corners: [Vec2; 2],
) {
    let base = vertices.len() as u32;
    indices.extend([0, 1, 3, 3, 1, 2].map(|i| base + i));
    let [a, c] = corners;
    let places = [
        (left + up, a),
        (up - left, Vec2::new(c.x, a.y)),
        (-left - up, c),
        (left - up, Vec2::new(a.x, c.y)),
    ];
    vertices.extend(places.map(|(offset, st)| DeformVertex {
        position: center + offset,
        normal,
        st,
        color,
    }));
}

fn autosprite(vertices: &mut Vec<DeformVertex>, indices: &mut Vec<u32>, context: &DeformContext) {
    let old = std::mem::take(vertices);
    indices.clear();
    let [forward, mut left, mut up] = context.view_axes;
    if context.mirrored {
        left = -left;
    }
    if context.axis_length != 1.0 {
        let scale = if context.axis_length == 0.0 {
            0.0
        } else {
            1.0 / context.axis_length
        };
        left *= scale;
        up *= scale;
    }
    for quad in old.as_chunks::<4>().0 {
        let center = quad.iter().map(|v| v.position).sum::<Vec3>() * 0.25;
        // The engine's constant for 1 / sqrt 2.
        let radius = quad[0].position.distance(center) * 0.707;
        push_quad(
            vertices,
            indices,
            center,
            [left * radius, up * radius],
            -forward,
            quad[0].color,
            [Vec2::ZERO, Vec2::ONE],
        );
    }
}

fn autosprite2(vertices: &mut [DeformVertex], indices: &[u32], forward: Vec3) {
    for (number, quad) in vertices.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        let [a, b, c, d] = quad.map(|vertex| vertex.position);
        let [a, b, c, d] = [(0, a), (1, b), (2, c), (3, d)];
        let edges = [(a, b), (a, c), (a, d), (b, c), (b, d), (c, d)];
        // The two shortest edges are the ends. Strict comparisons keep the engine's choice among equals.
        let mut shortest = [(f32::INFINITY, edges[0]); 2];
        for edge in edges {
            let ((_, from), (_, to)) = edge;
            let length = from.distance_squared(to);
            if length < shortest[0].0 {
                shortest = [(length, edge), shortest[0]];
            } else if length < shortest[1].0 {
                shortest[1] = (length, edge);
            }
        }
        let middles = shortest.map(|(_, ((_, from), (_, to)))| 0.5 * (from + to));
        let minor = (middles[1] - middles[0]).cross(forward).normalize_or_zero();
        for ((length, ((a, _), (b, _))), middle) in shortest.into_iter().zip(middles) {
            let mut half = minor * (0.5 * length.sqrt());
            if follows(indices, number, a, b) {
                half = -half;
            }
            for (corner, position) in [(a, middle + half), (b, middle - half)] {
                if let Some(vertex) = quad.get_mut(corner) {
                    vertex.position = position;
                }
            }
        }
    }
}

/// Whether vertex `b` directly follows vertex `a` in the two triangles of a quad.
///
/// The engine looks at neighbours in the list of six, across the triangles' border and without closing them. This
/// distinguishes the sides of the strip (3 0 2, 2 0 1) that map compilers make of a quad; a fan comes out twisted, in
/// the engine too.
fn follows(indices: &[u32], quad: usize, a: usize, b: usize) -> bool {
    // The last quad may be incomplete.
    let triangles = indices.get(quad * 6..quad * 6 + 6).unwrap_or_default();
    let vertex = |local: usize| (quad * 4 + local) as u32;
    triangles
        .windows(2)
        .any(|pair| pair == [vertex(a), vertex(b)])
}

fn project(vertices: &mut [DeformVertex], shadow: &ShadowProjection) {
    // A light near the horizon is raised, so that shadows do not run to infinity.
    let mut light = shadow.light;
    let mut height = light.dot(shadow.up);
    if height < 0.5 {
        light += shadow.up * (0.5 - height);
        height = light.dot(shadow.up);
    }
    if height <= 0.0 {
        return;
    }
    light /= height;
    for v in vertices {
        let above = v.position.dot(shadow.up) + shadow.ground_distance;
        v.position -= light * above;
    }
}

/// Replaces a quad by the characters of a text: half as high as the quad, centred on it, upright.
fn text_quads(
    text: &[u8],
    vertices: &mut Vec<DeformVertex>,
    indices: &mut Vec<u32>,
    context: &DeformContext,
) {
    let Some(quad) = vertices.first_chunk::<4>() else {
        return; // the script gives it to a surface that is no quad
    };
    let normal = quad[0].normal;
    let mut origin = quad.iter().map(|v| v.position).sum::<Vec3>() * 0.25;
    let heights = quad.iter().map(|v| v.position.z);
    let bottom = heights.clone().fold(f32::INFINITY, f32::min);
    let top = heights.fold(f32::NEG_INFINITY, f32::max);
    let half_height = (top - bottom) * 0.5;
    let height = Vec3::new(0.0, 0.0, half_height);
    let width = normal.cross(Vec3::NEG_Z) * (half_height * -0.75);
    let count = text.iter().position(|&c| c == 0).unwrap_or(text.len());
    origin += (count as f32 - 1.0) * width;
    vertices.clear();
    indices.clear();
    for &character in text.iter().take(count) {
        if character != b' ' {
            const CELL: f32 = 1.0 / 16.0;
            let corner = Vec2::new(f32::from(character & 15), f32::from(character >> 4)) * CELL;
            push_quad(
                vertices,
                indices,
                origin,
                [width, height],
                -context.view_axes[0],
                [255; 4],
                [corner, corner + CELL],
            );
        }
        origin -= 2.0 * width;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::{Wave, WaveFunction};

    /// Quad that faces -x: wide in y, high in z.
    fn quad(width: f32, height: f32) -> (Vec<DeformVertex>, Vec<u32>) {
        let vertices = [
            (1.0, 1.0, 0.0, 0.0),
            (-1.0, 1.0, 1.0, 0.0),
            (-1.0, -1.0, 1.0, 1.0),
            (1.0, -1.0, 0.0, 1.0),
        ]
        .map(|(y, z, s, t)| DeformVertex {
            position: Vec3::new(0.0, y * width / 2.0, z * height / 2.0),
            normal: Vec3::NEG_X,
            st: Vec2::new(s, t),
            color: [1, 2, 3, 4],
        });
        // Two triangles in the order in which map compilers strip a quad.
        (vertices.to_vec(), vec![3, 0, 2, 2, 0, 1])
    }

    fn run(deform_: Deform, context: &DeformContext) -> (Vec<DeformVertex>, Vec<u32>) {
        let (mut vertices, mut indices) = quad(8.0, 4.0);
        deform(&[deform_], &mut vertices, &mut indices, context);
        (vertices, indices)
    }

    fn at_time(time: f64) -> DeformContext<'static> {
        DeformContext {
            time,
            frame_time: time,
            ..DeformContext::default()
        }
    }

    fn sawtooth(frequency: f32) -> Wave {
        Wave {
            function: WaveFunction::Sawtooth,
            base: 1.0,
            amplitude: 4.0,
            phase: 0.0,
            frequency,
        }
    }

    #[track_caller]
    fn near(a: Vec3, b: Vec3) {
        assert!(a.abs_diff_eq(b, 1e-3), "{a} is not {b}");
    }

    #[test]
    fn wave_moves_along_the_normal_by_position() {
        let deform_ = |frequency| Deform::Wave {
            spread: 0.125,
            wave: sawtooth(frequency),
        };
        // First vertex: y + z = 6, 0.75 turns; plus 0.5 turns of time = 0.25.
        let (v, _) = run(deform_(1.0), &at_time(0.5));
        near(v[0].position, Vec3::new(-2.0, 4.0, 2.0));
        // Without frequency neither time nor place counts.
        let (v, _) = run(deform_(0.0), &at_time(0.5));
        near(v[0].position, Vec3::new(-1.0, 4.0, 2.0));
    }

    #[test]
    fn normal_turns_normals_only() {
        let context = at_time(0.25);
        let (v, _) = run(
            Deform::Normal {
                amplitude: 0.5,
                frequency: 2.0,
            },
            &context,
        );
        let p = Vec3::new(0.0, 4.0, 2.0) * 0.98;
        let expected = (Vec3::NEG_X
            + 0.5
                * Vec3::new(
                    noise4(p.x, p.y, p.z, 0.5),
                    noise4(100.0 + p.x, p.y, p.z, 0.5),
                    noise4(200.0 + p.x, p.y, p.z, 0.5),
                ))
        .normalize();
        near(v[0].normal, expected);
        near(v[0].position, Vec3::new(0.0, 4.0, 2.0));
    }

    #[test]
    fn bulge_travels_in_texture_space_with_scene_time() {
        let context = DeformContext {
            time: 99.0,
            frame_time: 0.5,
            ..DeformContext::default()
        };
        let (v, _) = run(
            Deform::Bulge {
                width: std::f32::consts::FRAC_PI_2,
                height: 3.0,
                speed: std::f32::consts::PI,
            },
            &context,
        );
        // s = 0: half of pi of time = a quarter turn, full height; s = 1: half a turn, nothing.
        assert!((v[0].position.x + 3.0).abs() < 0.02, "{}", v[0].position);
        assert!(v[1].position.x.abs() < 0.03, "{}", v[1].position);
    }

    #[test]
    fn move_shifts_everything() {
        let (v, _) = run(
            Deform::Move {
                direction: Vec3::new(1.0, 2.0, 3.0),
                wave: sawtooth(1.0),
            },
            &at_time(0.25),
        );
        near(v[0].position, Vec3::new(2.0, 8.0, 8.0));
        near(v[2].position, Vec3::new(2.0, 0.0, 4.0));
    }

    #[test]
    fn autosprite_faces_the_viewer() {
        let view = DeformContext {
            view_axes: [Vec3::Y, Vec3::NEG_X, Vec3::Z],
            ..DeformContext::default()
        };
        let (v, i) = run(Deform::AutoSprite, &view);
        let r = 20.0_f32.sqrt() * 0.707;
        near(v[0].position, Vec3::new(-r, 0.0, r));
        near(v[1].position, Vec3::new(r, 0.0, r));
        near(v[2].position, Vec3::new(r, 0.0, -r));
        near(v[3].position, Vec3::new(-r, 0.0, -r));
        near(v[0].normal, Vec3::NEG_Y);
        assert_eq!(v[2].st, Vec2::ONE);
        assert_eq!(v[1].st, Vec2::X);
        assert_eq!(v[3].color, [1, 2, 3, 4]);
        assert_eq!(i, [0, 1, 3, 3, 1, 2]);
        let mirrored = DeformContext {
            mirrored: true,
            axis_length: 2.0,
            ..view
        };
        let (v, _) = run(Deform::AutoSprite, &mirrored);
        near(v[0].position, Vec3::new(r / 2.0, 0.0, r / 2.0));
    }

    #[test]
    fn autosprite2_pivots_about_its_long_axis() {
        // Long in y; seen along -z it must lie flat: the short ends point along +-x.
        let view = DeformContext {
            view_axes: [Vec3::NEG_Z, Vec3::X, Vec3::Y],
            ..DeformContext::default()
        };
        let (v, _) = run(Deform::AutoSprite2, &view);
        for (vertex, y) in v.iter().zip([4.0, -4.0, -4.0, 4.0]) {
            assert!((vertex.position.y - y).abs() < 1e-4);
            assert!((vertex.position.x.abs() - 2.0).abs() < 1e-4);
            assert!(vertex.position.z.abs() < 1e-4);
        }
        // Both sides of the quad stay on their side.
        assert!(v[0].position.x * v[3].position.x < 0.0);
        assert!(v[0].position.x * v[1].position.x > 0.0);
        // It keeps facing the viewer: the winding's normal points against the view.
        let normal = |v: &[DeformVertex]| {
            (v[1].position - v[0].position).cross(v[3].position - v[0].position)
        };
        let (original, _) = quad(8.0, 4.0);
        let (seen_from_front, _) = run(Deform::AutoSprite2, &DeformContext::default());
        assert!(normal(&original).dot(Vec3::X) * normal(&seen_from_front).dot(Vec3::X) > 0.0);
        assert!(normal(&v).dot(Vec3::NEG_Z) * normal(&seen_from_front).dot(Vec3::X) > 0.0);
    }

    #[test]
    fn projection_shadow_lands_on_the_plane() {
        let context = DeformContext {
            shadow: Some(ShadowProjection {
                up: Vec3::Z,
                ground_distance: 10.0,
                light: Vec3::new(0.6, 0.0, 0.8),
            }),
            ..DeformContext::default()
        };
        let (v, _) = run(Deform::ProjectionShadow, &context);
        // Twelve above the ground: moved 12 * 0.6 / 0.8 sideways.
        near(v[0].position, Vec3::new(-9.0, 4.0, -10.0));
        // A flat light is raised to a height of one half.
        let low = DeformContext {
            shadow: context.shadow.map(|s| ShadowProjection {
                light: Vec3::X,
                ..s
            }),
            ..context
        };
        let (v, _) = run(Deform::ProjectionShadow, &low);
        near(v[0].position, Vec3::new(-24.0, 4.0, -10.0));
        assert_eq!(
            run(Deform::ProjectionShadow, &at_time(0.0)).0,
            quad(8.0, 4.0).0
        );
    }

    #[test]
    fn text_replaces_the_quad() {
        let texts: [&[u8]; 2] = [b"unused", b"A c"];
        let context = DeformContext {
            texts: &texts,
            ..DeformContext::default()
        };
        let (v, i) = run(Deform::Text(1), &context);
        assert_eq!((v.len(), i.len()), (8, 12));
        // 'A' is 0x41: row 4, column 1.
        assert_eq!(v[0].st, Vec2::new(1.0, 4.0) / 16.0);
        assert_eq!(v[2].st, Vec2::new(2.0, 5.0) / 16.0);
        // Normal -x, width = (-x cross -z) * -1.5 = (0, -1, 0) * -1.5 = (0, 1.5, 0); three characters.
        near(
            (v[0].position + v[2].position) / 2.0,
            Vec3::new(0.0, 3.0, 0.0),
        );
        near(
            (v[4].position + v[6].position) / 2.0,
            Vec3::new(0.0, -3.0, 0.0),
        );
        assert_eq!(v[0].position.z - v[2].position.z, 4.0);
        assert_eq!(run(Deform::Text(7), &context).0, []);
    }

    #[test]
    fn incomplete_quads_do_no_harm() {
        for deform_ in [Deform::AutoSprite, Deform::AutoSprite2, Deform::Text(0)] {
            let (mut vertices, _) = quad(8.0, 4.0);
            vertices.truncate(3);
            let mut indices = vec![0, 1, 2];
            deform(
                &[deform_],
                &mut vertices,
                &mut indices,
                &DeformContext::default(),
            );
            assert!(indices.iter().all(|&i| (i as usize) < vertices.len()));
        }
    }
}
