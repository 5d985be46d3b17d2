//! One view as the game described it, gathered for drawing: what both looks read.
//!
//! The front end's calls fill a [`Scene`]; `RenderScene` turns what was added since the last one into a [`ViewScene`]:
//! instances, the vertices of everything that moves or deforms (evaluated on the CPU, in the space of their
//! instance), and the sorted list of visible surfaces that the classic look draws.

mod cull;
mod debug_polygons;
mod entities;
mod entity;
mod flares;
mod gather;
mod greyscale;
mod key_frames;
mod lighting;
mod look;
mod mesh;
mod models;
mod painted_shadows;
mod portal;
mod rigid;
mod shadow_volumes;
mod shapes;
mod sky;
mod statistics;
mod surfaces;
pub(crate) mod turned;
pub mod view;

use glam::{Vec3, Vec4};
use shaders::types::{Instance, Vertex};
use support::slice::{part, span};

use crate::Error;
use crate::api::{DynamicLight, EntityKind, PolyVert, RefDef, RefEntity};
use crate::assets::{Assets, Materials, Models, Skins};
use crate::settings::Settings;
use crate::stereo::Eye;
use crate::world::{VisibleSet, World, WorldData};
pub use debug_polygons::DebugPolygons;
pub use flares::ViewFlare;
#[cfg(test)]
pub use look::TracedPart;
pub use look::{ClassicPart, ClassicScene, LookPart, LookPartMut, TracedScene};
pub use rigid::{MeshId, RigidMesh, Shape};
pub use shadow_volumes::ShadowVolumes;
pub(crate) use shapes::perpendicular;
pub use sky::{CELLS as SKY_CELLS, Cells, FACES as SKY_FACES, SkyCoverage, VisibleSky};
pub use statistics::Statistics;
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
    /// A flat surface of the map, whose triangles tend to hide much.
    pub flat: bool,
    /// Square of how near a surface of the map comes to the eye, by its box, units²; of others 0.
    pub distance_squared: f32,
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
    /// How much of it is the same in the next frame.
    pub shape: Shape,
    /// Which paths of the traced look meet it: those of one of the numbers of [`turned`].
    pub paths: u8,
}

/// The triangles of a mesh, wherever they are kept; in the space of its instance.
#[derive(Clone, Copy, Debug)]
pub struct MeshGeometry<'a> {
    /// Vertices.
    pub vertices: &'a [Vertex],
    /// Indices, three a triangle: `vertices[index - base]`.
    pub indices: &'a [u32],
    /// What the indices count from.
    pub base: u32,
}

impl MeshGeometry<'_> {
    /// Triangles as indices into `vertices`; those that point elsewhere are left out.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let corner = |i: u32| {
            let local = i.checked_sub(self.base)?;
            ((local as usize) < self.vertices.len()).then_some(local)
        };
        let triangles = self.indices.as_chunks::<3>().0.iter();
        triangles.filter_map(move |&[a, b, c]| Some([corner(a)?, corner(b)?, corner(c)?]))
    }
}

/// An inline model of the map (`*n`) placed in this view.
#[derive(Clone, Copy, Debug)]
pub struct Submodel {
    /// Index of the BSP model.
    pub model: u32,
    /// Index into [`ViewScene::instances`].
    pub instance: u32,
}

/// What an entity put into a view, and what tells it from others: the traced look finds it again in the next frame,
/// since the engine's entities have no names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewEntity {
    /// What it is.
    pub kind: EntityKind,
    /// Handle of its model.
    pub model: i32,
    /// Handle of the skin that replaces the model's.
    pub skin: i32,
    /// Handle of the material that replaces all others.
    pub material: i32,
    /// Its `renderfx` bits.
    pub renderfx: u32,
    /// Key frame.
    pub frame: i32,
    /// Key frame before.
    pub old_frame: i32,
    /// Where it is.
    pub origin: Vec3,
    /// Its first instance in [`ViewScene::instances`].
    pub first_instance: u32,
    /// Number of instances.
    pub instance_count: u32,
    /// Its first mesh in [`ViewScene::meshes`].
    pub first_mesh: u32,
    /// Number of meshes.
    pub mesh_count: u32,
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

/// Half the side of the sun's picture, as a part of its distance.
pub const SUN_SIZE: f32 = 0.1;

/// The sun's disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Index of the material.
    pub material: u32,
    /// Unit vector towards it.
    pub direction: Vec3,
}

/// One view: what both looks read, and the part `L` that one look reads. `ViewScene` without `L` is a view of either
/// look, for code that serves both.
#[derive(Clone, Debug)]
pub struct ViewScene<L: ?Sized = dyn LookPart> {
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
    /// Dynamic lights.
    pub dlights: Vec<DynamicLight>,
    /// The world is part of the view.
    pub has_world: bool,
    /// The sun's disc, when it is to be drawn wherever a sky is in sight.
    pub sun: Option<Sun>,
    /// Flares in sight (`r_flares`).
    pub flares: Vec<ViewFlare>,
    /// What one look alone reads.
    pub look: L,
}

impl ClassicScene {
    /// The indices of a surface of the view. `static_indices` is the world's index array.
    pub fn indices_of<'a>(&'a self, surface: &DrawSurface, static_indices: &'a [u32]) -> &'a [u32] {
        let (source, first, count) = match surface.geometry {
            Geometry::Static {
                first_index,
                index_count,
            } => (static_indices, first_index, index_count),
            Geometry::Dynamic {
                first_index,
                index_count,
            } => (self.indices.as_slice(), first_index, index_count),
        };
        part(source, span(first, count))
    }
}

impl TracedScene {
    /// The vertices of a mesh, and its indices, which count from [`MeshGeometry::base`].
    pub fn mesh_geometry(&self, mesh: &DynamicMesh) -> MeshGeometry<'_> {
        if let Shape::Rigid(rigid) = mesh.shape {
            let rigid = self.look.rigid.get(rigid as usize);
            return MeshGeometry {
                vertices: rigid.map_or(&[], |r| &r.vertices),
                indices: rigid.map_or(&[], |r| &r.indices),
                base: 0,
            };
        }
        MeshGeometry {
            vertices: part(&self.vertices, span(mesh.first_vertex, mesh.vertex_count)),
            indices: part(&self.indices, span(mesh.first_index, mesh.index_count)),
            base: mesh.first_vertex,
        }
    }
}

impl<L: Default> ViewScene<L> {
    /// Nothing, seen by a camera.
    pub(crate) fn empty(def: &RefDef, view: View) -> Self {
        Self {
            def: *def,
            view,
            time: 0.0,
            instances: Vec::new(),
            vertices: Vec::new(),
            indices: Vec::new(),
            meshes: Vec::new(),
            dlights: Vec::new(),
            has_world: false,
            sun: None,
            flares: Vec::new(),
            look: L::default(),
        }
    }
}

/// What a scene is gathered from.
#[derive(Clone, Copy)]
pub struct GatherInput<'a> {
    /// The map, if one is loaded (also for views without it).
    pub world: Option<&'a WorldData>,
    /// Materials.
    pub materials: &'a Materials,
    /// Models.
    pub models: &'a Models,
    /// Skins.
    pub skins: &'a Skins,
    /// Settings.
    pub settings: &'a Settings,
}

impl<'a> GatherInput<'a> {
    /// From a registration.
    pub fn new(world: Option<&'a World>, assets: &'a Assets, settings: &'a Settings) -> Self {
        Self {
            world: world.map(|world| &world.data),
            materials: &assets.materials,
            models: &assets.models,
            skins: &assets.skins,
            settings,
        }
    }
}

/// A polygon that the game added.
#[derive(Clone, Copy, Debug)]
struct Poly {
    /// Index of the material, before remapping.
    material: u32,
    first_vertex: usize,
    vertex_count: usize,
}

/// What the game added since the last view, and memory that views reuse.
#[derive(Default)]
pub struct Scene {
    entities: Vec<RefEntity>,
    polys: Vec<Poly>,
    poly_vertices: Vec<PolyVert>,
    lights: Vec<DynamicLight>,
    visible: VisibleSet,
    portal_visible: VisibleSet,
    classic_pool: Vec<ClassicScene>,
    traced_pool: Vec<TracedScene>,
    /// Empty lists of views, for their memory.
    lists: Vec<Vec<ClassicScene>>,
    scratch: gather::Scratch,
    /// Memory of the views through portals.
    turned: Vec<Option<View>>,
    warned_not_finite: bool,
    eye: Eye,
}

impl Scene {
    /// Forgets what was added (`ClearScene`).
    pub fn clear(&mut self) {
        self.entities.clear();
        self.polys.clear();
        self.poly_vertices.clear();
        self.lights.clear();
    }

    /// Whose views follow.
    pub fn set_eye(&mut self, eye: Eye) {
        self.eye = eye;
    }

    /// Adds an entity. One whose place is not a number is left out, with one warning.
    pub fn add_entity(&mut self, entity: &RefEntity) {
        if !entity.origin.is_finite() {
            if !std::mem::replace(&mut self.warned_not_finite, true) {
                log::warn!("an entity without a finite origin is left out");
            }
            return;
        }
        self.entities.push(*entity);
    }

    /// Adds polygons of `vertices_per_poly` corners each. Handle 0 is refused with a warning.
    pub fn add_poly(&mut self, shader: i32, vertices: &[PolyVert], vertices_per_poly: usize) {
        let Ok(material) = u32::try_from(shader) else {
            return;
        };
        if material == 0 {
            log::warn!("a polygon without material is left out");
            return;
        }
        if vertices_per_poly < 3 {
            return;
        }
        for polygon in vertices.chunks_exact(vertices_per_poly) {
            if !polygon.iter().all(|v| v.position.is_finite()) {
                continue;
            }
            self.polys.push(Poly {
                material,
                first_vertex: self.poly_vertices.len(),
                vertex_count: polygon.len(),
            });
            self.poly_vertices.extend_from_slice(polygon);
        }
    }

    /// Adds a dynamic light; one without reach is nothing.
    pub fn add_light(&mut self, light: DynamicLight) {
        if light.radius > 0.0 && light.origin.is_finite() && light.color.is_finite() {
            self.lights.push(light);
        }
    }

    /// Turns what was added into views of the classic look and forgets it: at most one view through a portal or mirror,
    /// then the view that was asked for. Hand the views back with [`recycle_classic`](Self::recycle_classic).
    ///
    /// # Errors
    /// [`Error::EntityKind`] for an entity of a kind that is never drawn.
    pub fn gather_classic(
        &mut self,
        input: &GatherInput<'_>,
        def: &RefDef,
    ) -> Result<Vec<ClassicScene>, Error> {
        self.gather(input, |scene| gather::classic_views(scene, input, def))
    }

    /// Turns what was added into a view of the traced look and forgets it. Hand the view back with
    /// [`recycle_traced`](Self::recycle_traced).
    ///
    /// # Errors
    /// As [`gather_classic`](Self::gather_classic).
    pub fn gather_traced(
        &mut self,
        input: &GatherInput<'_>,
        def: &RefDef,
    ) -> Result<TracedScene, Error> {
        self.gather(input, |scene| gather::traced_view(scene, input, def))
    }

    fn gather<T>(
        &mut self,
        input: &GatherInput<'_>,
        views: impl FnOnce(&mut Self) -> T,
    ) -> Result<T, Error> {
        let undrawable = |e: &RefEntity| e.kind == EntityKind::Poly;
        if input.settings.draw_entities && self.entities.iter().any(undrawable) {
            self.clear();
            return Err(Error::EntityKind {
                kind: "polygon".into(),
            });
        }
        let views = views(self);
        self.clear();
        Ok(views)
    }

    /// Takes back views that are drawn, so that the next ones need no new memory.
    pub fn recycle_classic(&mut self, mut views: Vec<ClassicScene>) {
        self.classic_pool.append(&mut views);
        self.lists.push(views);
    }

    /// Takes back a view that is drawn, so that the next one needs no new memory.
    pub fn recycle_traced(&mut self, view: TracedScene) {
        self.traced_pool.push(view);
    }

    /// The frame is over: what was added and never drawn is forgotten.
    pub fn end_frame(&mut self) {
        self.clear();
    }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod model_tests;
