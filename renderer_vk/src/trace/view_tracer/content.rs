//! Hash of a view's content, which all accumulated frames share.

use std::hash::{DefaultHasher, Hash, Hasher};

use glam::Vec3;

use crate::scene::TracedScene;
use crate::settings::Settings;
use crate::trace::input::MaterialTable;

/// A number that changes whenever the mean picture changes: camera, scene, time, settings.
pub(super) fn content_hash(
    view: &TracedScene,
    materials: &dyn MaterialTable,
    settings: &Settings,
) -> u64 {
    let mut hasher = DefaultHasher::new();
    let mut floats = |values: &[f32]| {
        for value in values {
            value.to_bits().hash(&mut hasher);
        }
    };
    let vector = |v: Vec3| [v.x, v.y, v.z];
    let camera = &view.view;
    floats(&vector(camera.origin));
    for axis in camera.axis {
        floats(&vector(axis));
    }
    floats(&[camera.tan_x, camera.tan_y, view.time]);
    floats(&[camera.stereo.slope, camera.stereo.distance]);
    for light in &view.dlights {
        floats(&vector(light.origin));
        floats(&vector(light.color));
        floats(&[light.radius]);
    }
    for portal in &view.look.portals {
        floats(&portal.plane.to_array());
        floats(&vector(portal.camera_origin));
        for axis in portal.camera_axis {
            floats(&vector(axis));
        }
    }
    camera.viewport.hash(&mut hasher);
    bytemuck::cast_slice::<_, u8>(&view.instances).hash(&mut hasher);
    for mesh in &view.meshes {
        let geometry = view.mesh_geometry(mesh);
        bytemuck::cast_slice::<_, u8>(geometry.vertices).hash(&mut hasher);
        // keeping a mesh between frames does not change the picture
        for triangle in geometry.triangles() {
            triangle.hash(&mut hasher);
        }
        (mesh.material, mesh.instance, mesh.fog).hash(&mut hasher);
    }
    for submodel in &view.look.submodels {
        (submodel.model, submodel.instance).hash(&mut hasher);
    }
    view.has_world.hash(&mut hasher);
    view.look.potential.hash(&mut hasher);
    materials.generation().hash(&mut hasher);
    settings.accumulation_key(&mut hasher);
    hasher.finish()
}
