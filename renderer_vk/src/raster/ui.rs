//! A user interface over the picture: triangles in window pixels, by the draw list of the overlay.

use std::collections::HashMap;

use glam::{Vec2, Vec3};
use shaders::types::constants as c;
use shaders::types::{Draw, Vertex};

use super::list::{DepthRange, DrawList};
use super::overlay::PLAIN;
use super::pipelines::State;
use super::shading::StageContext;
use crate::api::{UiFrame, UiMesh, UiTexture, UiVertex};
use crate::assets::compile::sampler;
use crate::gpu::{self, Device, Format, Image, ImageDesc, ImageUsage};

/// Textures of user interfaces, by their numbers. They outlive the game's registration.
#[derive(Default)]
pub struct UiTextures(HashMap<u64, Image>);

/// Meshes to draw, clipped.
#[derive(Clone, Debug, Default)]
pub struct UiMeshes(Vec<UiMesh>);

impl UiTextures {
    /// Uploads the textures of a frame and returns its meshes. Meshes keep the textures of their frame.
    ///
    /// # Errors
    /// The device has no memory for a texture.
    pub fn take(&mut self, device: &Device, frame: UiFrame) -> Result<UiMeshes, gpu::Error> {
        for texture in &frame.textures {
            if let Some(image) = upload(device, texture)? {
                self.0.insert(texture.id, image);
            }
        }
        let meshes = (frame.meshes.into_iter())
            .filter_map(|mesh| {
                let texture = self.0.get(&mesh.texture)?.texture_index();
                Some(UiMesh {
                    texture: u64::from(texture),
                    ..clipped(mesh)
                })
            })
            .collect();
        for id in &frame.dropped {
            self.0.remove(id);
        }
        Ok(UiMeshes(meshes))
    }
}

/// `None`: the bytes do not match the size.
fn upload(device: &Device, texture: &UiTexture) -> Result<Option<Image>, gpu::Error> {
    let UiTexture { width, height, .. } = *texture;
    let bytes = (width as usize)
        .checked_mul(height as usize)
        .and_then(|texels| texels.checked_mul(4));
    if bytes != Some(texture.rgba.len()) || texture.rgba.is_empty() {
        log::warn!(
            "user interface: {} bytes for a texture of {width} x {height}",
            texture.rgba.len()
        );
        return Ok(None);
    }
    let usage = ImageUsage::SAMPLED;
    let desc = ImageDesc::new("user interface", width, height, Format::Rgba8, usage);
    let image = Image::new(device, &desc)?;
    device.upload_image(&image, 0, 0, &texture.rgba)?;
    Ok(Some(image))
}

impl UiMeshes {
    /// Turns the meshes into draw calls.
    pub fn draw(&self, list: &mut DrawList, stages: StageContext<'_>) {
        list.clear();
        // white of the display is identity light before overbright bits
        let scale = stages.identity_light;
        let dimmed = |v: u8| (f32::from(v) * scale).round() as u8;
        for mesh in &self.0 {
            let base = list.vertices.len() as u32;
            let first = list.indices.len() as u32;
            list.vertices.extend(mesh.vertices.iter().map(|v| {
                let [r, g, b, a] = v.rgba;
                Vertex {
                    position: v.position.extend(0.0),
                    normal: Vec3::NEG_Z,
                    st: v.st,
                    lightmap: Vec2::ZERO,
                    color: u32::from_le_bytes([dimmed(r), dimmed(g), dimmed(b), a]),
                }
            }));
            list.indices.extend(mesh.indices.iter().map(|i| base + i));
            let draw = Draw {
                dynamic_vertices: 1,
                ..Draw::default()
            };
            // bindless indices fit into 32 bits
            let (shading, draw) =
                stages.translucent_image(mesh.texture as u32, sampler::CLAMP, draw);
            let state = State {
                blend: Some((c::BLEND_ONE, c::BLEND_ONE_MINUS_SRC_ALPHA)),
                shading,
                ..PLAIN
            };
            let span = (first, mesh.indices.len() as u32);
            let call = list.call(state, DepthRange::Normal, span, draw);
            list.calls.push(call);
        }
    }
}

/// The part of a mesh inside its rectangle. Triangles with an index beyond the vertices are dropped.
fn clipped(mesh: UiMesh) -> UiMesh {
    let [low, high] = mesh.clip;
    let inside = |v: &UiVertex| v.position.cmpge(low).all() && v.position.cmple(high).all();
    let valid = |i: &u32| (*i as usize) < mesh.vertices.len();
    if mesh.vertices.iter().all(inside) && mesh.indices.iter().all(valid) {
        return mesh;
    }
    let mut cut = UiMesh {
        vertices: Vec::new(),
        indices: Vec::new(),
        ..mesh
    };
    for corners in mesh.indices.chunks_exact(3) {
        let get = |n: usize| mesh.vertices.get(*corners.get(n)? as usize).copied();
        let (Some(a), Some(b), Some(c)) = (get(0), get(1), get(2)) else {
            continue;
        };
        let mut polygon = vec![a, b, c];
        for axis in 0..2 {
            polygon = half(&polygon, |v| v.position[axis] - low[axis]);
            polygon = half(&polygon, |v| high[axis] - v.position[axis]);
        }
        let first = cut.vertices.len() as u32;
        let triangles = 1..(polygon.len() as u32).saturating_sub(1);
        cut.indices
            .extend(triangles.flat_map(|n| [first, first + n, first + n + 1]));
        cut.vertices.extend(polygon);
    }
    cut
}

/// The part of a convex polygon where `distance` is not negative.
fn half(polygon: &[UiVertex], distance: impl Fn(&UiVertex) -> f32) -> Vec<UiVertex> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    let next = polygon.iter().cycle().skip(1);
    for (from, to) in polygon.iter().zip(next) {
        let (d, e) = (distance(from), distance(to));
        if d >= 0.0 {
            kept.push(*from);
        }
        if (d >= 0.0) != (e >= 0.0) {
            kept.push(between(from, to, d / (d - e)));
        }
    }
    kept
}

fn between(a: &UiVertex, b: &UiVertex, t: f32) -> UiVertex {
    let channel = |n: usize| {
        let (a, b) = (f32::from(a.rgba[n]), f32::from(b.rgba[n]));
        (a + (b - a) * t).round() as u8
    };
    UiVertex {
        position: a.position.lerp(b.position, t),
        st: a.st.lerp(b.st, t),
        rgba: [0, 1, 2, 3].map(channel),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(corners: [[f32; 2]; 3], clip: [[f32; 2]; 2]) -> UiMesh {
        let vertex = |p: [f32; 2]| UiVertex {
            position: p.into(),
            st: Vec2::from(p) * 0.01,
            rgba: [p[0] as u8, p[1] as u8, 0, 255],
        };
        UiMesh {
            texture: 0,
            clip: clip.map(Vec2::from),
            vertices: corners.map(vertex).to_vec(),
            indices: vec![0, 1, 2],
        }
    }

    fn area(mesh: &UiMesh) -> f32 {
        let corner = |i: &u32| mesh.vertices[*i as usize].position;
        let triangles = mesh.indices.chunks_exact(3);
        triangles
            .map(|t| {
                let [a, b, c] = [corner(&t[0]), corner(&t[1]), corner(&t[2])];
                ((b - a).perp_dot(c - a) * 0.5).abs()
            })
            .sum()
    }

    #[test]
    fn clipping_keeps_the_area_inside_and_interpolates() {
        let corners = [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]];
        // a square inside, a square half inside, one outside
        let of = |clip| clipped(mesh(corners, clip));
        assert!((area(&of([[10.0, 10.0], [30.0, 30.0]])) - 400.0).abs() < 0.01);
        assert!((area(&of([[0.0, 0.0], [100.0, 100.0]])) - 5000.0).abs() < 0.01);
        assert!((area(&of([[40.0, 40.0], [60.0, 60.0]])) - 200.0).abs() < 0.01);
        assert!(of([[200.0, 0.0], [300.0, 50.0]]).indices.is_empty());
        for vertex in of([[10.0, 10.0], [70.0, 60.0]]).vertices {
            let expected = vertex.position * 0.01;
            assert!(vertex.st.distance(expected) < 1e-5);
            assert!((f32::from(vertex.rgba[0]) - vertex.position.x).abs() <= 1.0);
        }
    }

    #[test]
    fn triangles_with_invalid_indices_are_dropped() {
        let mut broken = mesh([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]], [[0.0; 2], [9.0; 2]]);
        broken.indices.extend([0, 1, 7, 2]);
        let cut = clipped(broken);
        assert!((area(&cut) - 40.5).abs() < 0.01);
        assert!(
            cut.indices
                .iter()
                .all(|i| (*i as usize) < cut.vertices.len())
        );
    }
}
