//! `r_greyscale` for the colours of a view; images have it from loading.
//!
//! Source: engine behaviour of `renderer_opengl1`, which desaturates the result of each stage. Stages are linear in the
//! colours of their inputs, so the inputs are desaturated here.

use glam::Vec3;
use support::slice::{part_mut, span};

use super::ClassicScene;
use crate::assets::{desaturate, grey};

impl ClassicScene {
    /// Desaturates entities, their light, polygons and dynamic lights by `amount` (0 to 1). The map's vertices were
    /// desaturated when the map was loaded.
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
