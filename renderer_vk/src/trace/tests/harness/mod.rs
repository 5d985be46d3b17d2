//! Scenes built in code, and their renderer.

mod gpu;
mod scene;
pub mod stage;

use glam::{Vec3, Vec4};
use shaders::types::Instance;

use crate::api::DynamicLight;
use crate::half::half;
use crate::scene::{Portal, TracedScene};
use crate::settings::{Look, Settings};

pub use gpu::Gpu;
pub(crate) use gpu::gpu_tests;
pub use relight::overbright::from_linear as encode;
pub use scene::Scene;

/// Settings of a reference picture without bounced light.
pub fn reference() -> Settings {
    Settings {
        rt: Look::Traced,
        rt_accumulate: true,
        rt_bounces: 0,
        rt_auto_exposure: false,
        rt_bloom: 0.0,
        ..Settings::full_size()
    }
}

/// The same with light of this many bounces.
pub fn bounced(bounces: u32) -> Settings {
    Settings {
        rt_bounces: bounces,
        ..reference()
    }
}

/// What the shaders make of a constant colour: it passes through a byte.
pub fn through_byte(encoded: f32) -> f32 {
    let byte = (encoded * 255.0 + 0.001).floor() / 255.0;
    crate::trace::frame_lights::decode(Vec3::splat(byte)).x
}

/// Corners of a rectangle that faces `edge_u x edge_v`.
pub fn rectangle(corner: Vec3, edge_u: Vec3, edge_v: Vec3) -> [Vec3; 4] {
    [
        corner,
        corner + edge_u,
        corner + edge_u + edge_v,
        corner + edge_v,
    ]
}

/// A white dynamic light in a view, or none.
pub fn switch_dlight(view: &mut TracedScene, origin: Vec3, radius: f32, on: bool) {
    view.dlights.clear();
    if on {
        view.dlights.push(DynamicLight {
            origin,
            radius,
            color: Vec3::ONE,
            ..DynamicLight::default()
        });
    }
}

/// A horizontal square around the z axis that faces up: its height, and half its side.
pub fn floor_at(z: f32, half: f32) -> [Vec3; 4] {
    let corner = Vec3::new(-half, -half, z);
    rectangle(corner, Vec3::X * (2.0 * half), Vec3::Y * (2.0 * half))
}

/// The same, facing down.
pub fn ceiling_at(z: f32, half: f32) -> [Vec3; 4] {
    let corner = Vec3::new(-half, -half, z);
    rectangle(corner, Vec3::Y * (2.0 * half), Vec3::X * (2.0 * half))
}

/// A square around the x axis that faces -x: its distance, and half its side.
pub fn wall_at(x: f32, half: f32) -> [Vec3; 4] {
    let corner = Vec3::new(x, -half, -half);
    rectangle(corner, Vec3::Z * (2.0 * half), Vec3::Y * (2.0 * half))
}

/// An entity in place.
pub fn identity() -> Instance {
    Instance {
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        color: [1.0; 4],
        ..Instance::default()
    }
}

/// L of a point that faces `normal` in the light of a triangle wholly above its horizon: Lambert's formula for the
/// irradiance of a polygon, divided by pi.
pub fn lambert(point: Vec3, normal: Vec3, triangle: [Vec3; 3], radiance: f32) -> f32 {
    // in double precision: for small triangles the terms nearly cancel
    let v = triangle.map(|p| (p.as_dvec3() - point.as_dvec3()).normalize());
    let sum: f64 = (0..3)
        .map(|i| {
            let (a, b) = (v[i], v[(i + 1) % 3]);
            let cross = a.cross(b);
            cross.length().atan2(a.dot(b)) * cross.normalize().dot(normal.as_dvec3())
        })
        .sum();
    (f64::from(radiance) * sum.abs() / (2.0 * std::f64::consts::PI)) as f32
}

/// Where a pixel's middle ray meets the plane z = 0.
fn floor_point(scene: &Scene, x: usize, y: usize) -> Vec3 {
    let def = &scene.def;
    let tan = (def.fov_x.to_radians() * 0.5).tan();
    let u = (x as f32 + 0.5) / def.width as f32 * 2.0 - 1.0;
    let v = (y as f32 + 0.5) / def.height as f32 * 2.0 - 1.0;
    let d = def.view_axis[0] - def.view_axis[1] * (u * tan) - def.view_axis[2] * (v * tan);
    def.view_origin + d * (-def.view_origin.z / d.z)
}

/// The same of each pixel, row by row.
pub fn floor_points(scene: &Scene) -> impl Iterator<Item = Vec3> {
    let [width, height] = [scene.def.width, scene.def.height].map(|side| side as usize);
    (0..width * height).map(move |i| floor_point(scene, i % width, i / width))
}

/// The plane through a point, as `xyz.p = w`.
pub fn plane(normal: Vec3, point: Vec3) -> Vec4 {
    normal.extend(normal.dot(point))
}

/// A mirror perpendicular to x; `normal`: along x, on its front.
pub fn mirror_at(x: f32, normal: Vec3) -> Portal {
    let origin = Vec3::new(x, 0.0, 0.0);
    Portal {
        plane: plane(normal, origin),
        mirror: true,
        surface_origin: origin,
        surface_axis: [normal, Vec3::Y, Vec3::Z],
        camera_origin: origin,
        camera_axis: [-normal, Vec3::Y, Vec3::Z],
        pvs_origin: origin,
        entity_origin: origin,
    }
}
