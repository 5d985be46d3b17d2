//! Gathers the game's scene into views, which both looks draw.
//!
//! The front end's calls fill a [`Scene`]. `RenderScene` turns what was added since the last view into a [`ViewScene`]:
//! instances, the vertices of moving and deformed geometry (evaluated on the CPU, in instance space), and the sorted
//! list of visible surfaces of the classic look.

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
pub use look::{ClassicPart, ClassicScene, LookPart, LookPartMut, TracedPart, TracedScene};
pub use rigid::{MeshId, RigidMesh, Shape, finite_bounds};
pub use shadow_volumes::ShadowVolumes;
pub(crate) use shapes::perpendicular;
pub use sky::{CELLS as SKY_CELLS, Cells, FACES as SKY_FACES, SkyCoverage, VisibleSky};
pub use statistics::Statistics;
pub use view::View;

/// Location of a surface's triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// A range of the world's static index buffer; indices count from the start of the static vertex buffer.
    Static {
        /// First index.
        first_index: u32,
        /// Number of indices.
        index_count: u32,
    },
    /// A range of [`ViewScene::indices`], which count from the start of [`ViewScene::vertices`].
    Dynamic {
        /// First index.
        first_index: u32,
        /// Number of indices.
        index_count: u32,
    },
}

/// A visible surface of the classic look.
#[derive(Clone, Copy, Debug)]
pub struct DrawSurface {
    /// Drawing order of the engine: sort value, creation order of the material, entity, fog, dynamic light. Surfaces of
    /// equal keys are drawn in the order of submission.
    pub sort_key: u64,
    /// Index of the material, after remapping.
    pub material: u32,
    /// Index into [`ViewScene::instances`].
    pub instance: u32,
    /// Fog volume plus one; 0: no fog.
    pub fog: u32,
    /// Bindless texture index of the lightmap page, or `NO_TEXTURE`.
    pub lightmap: u32,
    /// Bit i: `dlights[i]` reaches the surface (the first 32, as in the engine).
    pub dlights: u32,
    /// Location of its triangles.
    pub geometry: Geometry,
    /// A flat surface of the map; such surfaces are likely occluders.
    pub flat: bool,
    /// Squared distance from the camera to the bounding box of a surface of the map, units²; 0 for others.
    pub distance_squared: f32,
}

/// A moving mesh of this view: a surface of an entity, a polygon, or a deformed surface of the world.
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
    /// Index of the material, after remapping.
    pub material: u32,
    /// Index into [`ViewScene::instances`], whose flags limit the rays that hit the mesh.
    pub instance: u32,
    /// Fog volume plus one; 0: no fog.
    pub fog: u32,
    /// Index of the world surface from which this mesh was deformed.
    pub world_surface: Option<u32>,
    /// Part of the mesh that stays the same in the next frame.
    pub shape: Shape,
    /// Paths of the traced look that hit the mesh, as numbered in [`turned`].
    pub paths: u8,
}

/// The triangles of a mesh, in the space of its instance.
#[derive(Clone, Copy, Debug)]
pub struct MeshGeometry<'a> {
    /// Vertices.
    pub vertices: &'a [Vertex],
    /// Indices, three a triangle: `vertices[index - base]`.
    pub indices: &'a [u32],
    /// Number of the first vertex.
    pub base: u32,
}

impl MeshGeometry<'_> {
    /// Triangles as indices into `vertices`; omits those with an index out of range.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let corner = |i: u32| {
            let local = i.checked_sub(self.base)?;
            ((local as usize) < self.vertices.len()).then_some(local)
        };
        let triangles = self.indices.as_chunks::<3>().0.iter();
        triangles.filter_map(move |&[a, b, c]| Some([corner(a)?, corner(b)?, corner(c)?]))
    }
}

/// An inline model of the map (`*n`), placed in this view.
#[derive(Clone, Copy, Debug)]
pub struct Submodel {
    /// Index of the BSP model.
    pub model: u32,
    /// Index into [`ViewScene::instances`].
    pub instance: u32,
}

/// The geometry that an entity added to a view. Engine entities have no names, so the traced look matches those of two
/// frames by the fields of this structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewEntity {
    /// Kind of the entity.
    pub kind: EntityKind,
    /// Handle of its model.
    pub model: i32,
    /// Handle of the skin that replaces the model's.
    pub skin: i32,
    /// Handle of the material that replaces all others.
    pub material: i32,
    /// Its `renderfx` bits.
    pub renderfx: u32,
    /// Current key frame.
    pub frame: i32,
    /// Previous key frame.
    pub old_frame: i32,
    /// Position, world space.
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

/// A portal or mirror of this view, with the transform to the view that it shows.
#[derive(Clone, Copy, Debug)]
pub struct Portal {
    /// Plane of the surface: `xyz.p = w`.
    pub plane: Vec4,
    /// A mirror reflects; a portal shows the view of its far camera.
    pub mirror: bool,
    /// A point of the plane, with its frame (axis 0: the normal).
    pub surface_origin: Vec3,
    /// See `surface_origin`.
    pub surface_axis: [Vec3; 3],
    /// The far camera: `x' = camera_origin + sum((x - surface_origin).surface_axis[i] * camera_axis[i])`.
    pub camera_origin: Vec3,
    /// See `camera_origin`.
    pub camera_axis: [Vec3; 3],
    /// Origin for the potentially visible set.
    pub pvs_origin: Vec3,
    /// Position of the entity that marks the surface.
    pub entity_origin: Vec3,
}

/// Half the side of the sun's quad over its distance.
pub const SUN_SIZE: f32 = 0.1;

/// The sun's disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Index of the material.
    pub material: u32,
    /// Unit vector towards the sun.
    pub direction: Vec3,
}

/// A view: data that both looks read, and the part `L` for one look. `ViewScene` without `L` is a view of either look.
#[derive(Clone, Debug)]
pub struct ViewScene<L: ?Sized = dyn LookPart> {
    /// The game's parameters of the view.
    pub def: RefDef,
    /// Camera, projection, viewport.
    pub view: View,
    /// Seconds.
    pub time: f32,
    /// Instances; `[0]` is the world.
    pub instances: Vec<Instance>,
    /// Vertices of moving meshes, in the space of their instances.
    pub vertices: Vec<Vertex>,
    /// Indices of moving meshes.
    pub indices: Vec<u32>,
    /// Moving meshes: in the traced look all of the view, in the classic look those not culled.
    pub meshes: Vec<DynamicMesh>,
    /// Dynamic lights.
    pub dlights: Vec<DynamicLight>,
    /// The view shows the world.
    pub has_world: bool,
    /// The sun's disc, if it is drawn where a sky is visible.
    pub sun: Option<Sun>,
    /// Visible flares (`r_flares`), before occlusion.
    pub flares: Vec<ViewFlare>,
    /// Data for one look.
    pub look: L,
}

impl ClassicScene {
    /// The indices of a surface. `static_indices`: the world's index array.
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
    /// The vertices and indices of a mesh.
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
    /// A view without content.
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

/// Input of gathering.
#[derive(Clone, Copy)]
pub struct GatherInput<'a> {
    /// The map, if one is loaded, even if the view does not show it.
    pub world: Option<&'a WorldData>,
    /// Materials.
    pub materials: &'a Materials,
    /// Models.
    pub models: &'a Models,
    /// Skins.
    pub skins: &'a Skins,
    /// Settings.
    pub settings: &'a Settings,
    /// Rays find the shadows of models in views of the classic look.
    pub traced_shadows: bool,
}

impl<'a> GatherInput<'a> {
    /// The input from the game's registered assets.
    pub fn new(world: Option<&'a World>, assets: &'a Assets, settings: &'a Settings) -> Self {
        Self {
            world: world.map(|world| &world.data),
            materials: &assets.materials,
            models: &assets.models,
            skins: &assets.skins,
            settings,
            traced_shadows: false,
        }
    }
}

/// A polygon added by the game.
#[derive(Clone, Copy, Debug)]
struct Poly {
    /// Index of the material, before remapping.
    material: u32,
    first_vertex: usize,
    vertex_count: usize,
}

/// Content that the game added since the last view, and buffers that later views reuse.
#[derive(Default)]
pub struct Scene {
    entities: Vec<RefEntity>,
    polys: Vec<Poly>,
    poly_vertices: Vec<PolyVert>,
    lights: Vec<DynamicLight>,
    /// The same with `r_dlightScale` and `r_dlightIntensity`, for lights that are evaluated per pixel.
    pixel_lights: Vec<DynamicLight>,
    visible: VisibleSet,
    portal_visible: VisibleSet,
    classic_pool: Vec<ClassicScene>,
    traced_pool: Vec<TracedScene>,
    /// Empty lists, kept for their allocations.
    lists: Vec<Vec<ClassicScene>>,
    scratch: gather::Scratch,
    /// Buffer of [`turned::views`].
    turned: Vec<Option<View>>,
    warned_not_finite: bool,
    eye: Eye,
}

impl Scene {
    /// Drops the added content (`ClearScene`).
    pub fn clear(&mut self) {
        self.entities.clear();
        self.polys.clear();
        self.poly_vertices.clear();
        self.lights.clear();
    }

    /// Sets the eye of the following views.
    pub fn set_eye(&mut self, eye: Eye) {
        self.eye = eye;
    }

    /// Adds an entity. Omits one with a non-finite position, with one warning.
    pub fn add_entity(&mut self, entity: &RefEntity) {
        if !entity.origin.is_finite() {
            if !std::mem::replace(&mut self.warned_not_finite, true) {
                log::warn!("an entity without a finite origin is left out");
            }
            return;
        }
        self.entities.push(*entity);
    }

    /// Adds polygons of `vertices_per_poly` corners each. Refuses handles below 1 with a warning.
    pub fn add_poly(&mut self, shader: i32, vertices: &[PolyVert], vertices_per_poly: usize) {
        let material = u32::try_from(shader).unwrap_or(0);
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

    /// Adds a dynamic light, unless its radius is 0.
    pub fn add_light(&mut self, light: DynamicLight) {
        let ends_somewhere = light.end.is_none_or(Vec3::is_finite);
        if light.radius > 0.0
            && light.origin.is_finite()
            && ends_somewhere
            && light.color.is_finite()
        {
            self.lights.push(light);
        }
    }

    /// Turns the added content into views of the classic look: at most one through a portal or mirror, then the main
    /// view. Return the views through [`recycle_classic`](Self::recycle_classic).
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

    /// Turns the added content into a view of the traced look. Return the view through
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

    /// Turns the added content into views of the classic look whose shadows are traced, and into the view that their
    /// rays traverse.
    ///
    /// # Errors
    /// As [`gather_classic`](Self::gather_classic).
    pub fn gather_hybrid(
        &mut self,
        input: &GatherInput<'_>,
        def: &RefDef,
    ) -> Result<(Vec<ClassicScene>, TracedScene), Error> {
        let input = &GatherInput {
            traced_shadows: true,
            ..*input
        };
        self.gather(input, |scene| {
            let views = gather::classic_views(scene, input, def);
            (views, gather::traced_view(scene, input, def))
        })
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

    /// Takes back drawn views, so that later ones reuse their buffers.
    pub fn recycle_classic(&mut self, mut views: Vec<ClassicScene>) {
        self.classic_pool.append(&mut views);
        self.lists.push(views);
    }

    /// Takes back a drawn view, so that a later one reuses its buffers.
    pub fn recycle_traced(&mut self, view: TracedScene) {
        self.traced_pool.push(view);
    }

    /// Ends the frame: drops content that was added and not drawn.
    pub fn end_frame(&mut self) {
        self.clear();
    }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod model_tests;
