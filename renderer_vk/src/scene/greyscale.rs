//! `r_greyscale` on what a view is drawn with besides images.
//!
//! Source: engine behaviour of `renderer_opengl1`: it takes the colour out of what each stage computes. Everything that
//! stages compute from is linear in these colours, so it is taken out of them.

use glam::Vec3;
use support::slice::{part_mut, span};

use super::ClassicScene;
use crate::assets::{desaturate, grey};

impl ClassicScene {
    /// Takes this share (0 to 1) of the colour out of entities, their light, polygons and dynamic lights. The map's
    /// vertices lost it when they were loaded.
    pub(super) fn take_color(&mut self, amount: f32) {
        for instance in &mut self.instances {
            let [r, g, b, a] = instance.color;
            let color = grey(Vec3::new(r, g, b), amount);
            instance.color = [color.x, color.y, color.z, a];
            instance.ambient = grey(instance.ambient, amount);
            instance.directed = grey(instance.directed, amount);
        }
        for light in &mut self.dlights {
            light.color = grey(light.color, amount);
        }
        for mesh in self.meshes.iter().filter(|m| m.world_surface.is_none()) {
            let range = span(mesh.first_vertex, mesh.vertex_count);
            for vertex in part_mut(&mut self.vertices, range) {
                let mut color = vertex.color.to_le_bytes();
                desaturate(&mut color, amount);
                vertex.color = u32::from_le_bytes(color);
            }
        }
    }
}
