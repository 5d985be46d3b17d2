//! One view as the game described it, gathered for drawing: what both looks read.
//!
//! The front end's calls fill a [`Scene`]; `RenderScene` turns what was added since the last one into a [`ViewScene`]:
//! instances, the vertices of everything that moves or deforms (evaluated on the CPU, in the space of their
//! instance), and the sorted list of visible surfaces that the classic look draws.

pub mod view;

use glam::{Vec3, Vec4};
use shaders::types::{Instance, Vertex};

use crate::api::{DynamicLight, RefDef};
pub use view::View;

/// Where a surface's triangles are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// In the world's static buffers: a range of the static index buffer, whose indices count from the start of the
    /// static vertex buffer.
    Static {
        /// First index.
        first_index: u32,
        /// Number of indices.
        index_count: u32,
    },
    /// In [`ViewScene::indices`], whose indices count from the start of [`ViewScene::vertices`].
    Dynamic {
        /// First index.
        first_index: u32,
        /// Number of indices.
        index_count: u32,
    },
}

/// One visible surface of the classic look.
#[derive(Clone, Copy, Debug)]
pub struct DrawSurface {
    /// The engine's order: sort value, material's creation order, entity, fog, dynamic light. Equal keys keep the
    /// order of submission.
    pub sort_key: u64,
    /// Index of the material (remapping already applied).
    pub material: u32,
    /// Index into [`ViewScene::instances`].
    pub instance: u32,
    /// Fog volume plus one; 0 none.
    pub fog: u32,
    /// Bindless texture index of the lightmap page, or `NO_TEXTURE`.
    pub lightmap: u32,
    /// Bit i: touched by `dlights[i]` (the first 32, as in the engine).
    pub dlights: u32,
    /// Its triangles.
    pub geometry: Geometry,
}

/// A mesh of this view that moves: an entity's surface, a polygon, a deformed surface of the world.
#[derive(Clone, Copy, Debug)]
pub struct DynamicMesh {
    /// First index in [`ViewScene::indices`].
    pub first_index: u32,
    /// Number of indices.
    pub index_count: u32,
    /// First vertex in [`ViewScene::vertices`].
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertex_count: u32,
    /// Index of the material (remapping already applied).
    pub material: u32,
    /// Index into [`ViewScene::instances`]; its flags say who sees the mesh.
    pub instance: u32,
    /// Fog volume plus one; 0 none.
    pub fog: u32,
    /// The index of the world surface that this mesh is the deformed copy of.
    pub world_surface: Option<u32>,
}

/// An inline model of the map (`*n`) placed in this view.
#[derive(Clone, Copy, Debug)]
pub struct Submodel {
    /// Index of the BSP model.
    pub model: u32,
    /// Index into [`ViewScene::instances`].
    pub instance: u32,
}

/// A portal or mirror plane of this view with the transform of what is seen through it.
#[derive(Clone, Copy, Debug)]
pub struct Portal {
    /// Plane of the surface: `xyz.p = w`.
    pub plane: Vec4,
    /// A mirror reflects; otherwise the far camera is seen.
    pub mirror: bool,
    /// A point of the plane and its frame (axis 0 = normal).
    pub surface_origin: Vec3,
    /// See `surface_origin`.
    pub surface_axis: [Vec3; 3],
    /// The far camera: `x' = camera_origin + sum((x - surface_origin).surface_axis[i] * camera_axis[i])`.
    pub camera_origin: Vec3,
    /// See `camera_origin`.
    pub camera_axis: [Vec3; 3],
    /// Origin for the potentially visible set.
    pub pvs_origin: Vec3,
    /// Where the entity that marks the surface is.
    pub entity_origin: Vec3,
}

/// What is needed to draw one view.
#[derive(Clone, Debug)]
pub struct ViewScene {
    /// The view as the game asked for it.
    pub def: RefDef,
    /// Camera, projection, viewport.
    pub view: View,
    /// Seconds.
    pub time: f32,
    /// `[0]` is the world.
    pub instances: Vec<Instance>,
    /// Vertices of what moves, in the space of their mesh's instance.
    pub vertices: Vec<Vertex>,
    /// Indices of what moves.
    pub indices: Vec<u32>,
    /// What moves. For the traced look these are all meshes of the view; for the classic look those not culled.
    pub meshes: Vec<DynamicMesh>,
    /// Inline models.
    pub submodels: Vec<Submodel>,
    /// Visible surfaces in drawing order (classic look only).
    pub surfaces: Vec<DrawSurface>,
    /// Static world surfaces that the tracer must not see in the static structure because `meshes` has their
    /// deformed copy are fixed per map (see `world::World::is_deformed`), so they are not listed here.
    pub dlights: Vec<DynamicLight>,
    /// Portals and mirrors in sight.
    pub portals: Vec<Portal>,
    /// The world is part of the view.
    pub has_world: bool,
    /// The sky surfaces in sight: index of the sky material and bounds of what is visible, for the sky pass.
    pub skies: Vec<VisibleSky>,
}

/// A visible sky material with the surfaces that show it.
#[derive(Clone, Debug)]
pub struct VisibleSky {
    /// Index of the material.
    pub material: u32,
    /// The triangles' corners in world space, three each.
    pub triangles: Vec<Vec3>,
}
