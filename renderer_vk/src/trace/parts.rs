//! Sorts the meshes of a view by ray visibility and by lifetime.

use std::collections::HashMap;
use std::ops::Range;

use glam::{Mat3, Vec3};
use shaders::trace_types::constants::{
    MASK_FIRST_SOLID, MASK_FIRST_TRANSLUCENT, MASK_NO_SHADOW, MASK_SKY, MASK_SOLID,
    MASK_THIRD_SOLID, MASK_THIRD_TRANSLUCENT, MASK_TRANSLUCENT, TRIANGLE_PATHS_SHIFT,
};
use shaders::types::constants as c;
use shaders::types::{Instance, Triangle};
use support::slice::{self, part, span};

use super::cutout::Coverage;
use super::geometry::{rank_bits, sides};
use super::input::{Kind, MaterialInfo, MaterialTable};
use crate::scene::{DynamicMesh, MeshId, Shape, TracedScene, turned};

/// Least volume of an entity's axes that counts as invertible; flatter entities are omitted.
const FLAT: f32 = 1.0e-12;

/// Minimum number of triangles for which a deformed surface of the map has its own structure.
const SCRAP: u32 = 128;

/// Ray types that see a moving mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// Every ray.
    Always,
    /// Camera rays alone.
    FirstPerson,
    /// Mirror rays, shadow rays and bounce rays.
    ThirdPerson,
    /// All but shadow rays.
    NoShadow,
}

impl Seen {
    /// All values.
    pub const ALL: [Self; 4] = [
        Self::Always,
        Self::FirstPerson,
        Self::ThirdPerson,
        Self::NoShadow,
    ];

    /// By the `INSTANCE_*` bits of an instance.
    pub fn of(flags: u32) -> Self {
        if flags & c::INSTANCE_FIRST_PERSON != 0 {
            Self::FirstPerson
        } else if flags & c::INSTANCE_THIRD_PERSON != 0 {
            Self::ThirdPerson
        } else if flags & c::INSTANCE_NO_SHADOW != 0 {
            Self::NoShadow
        } else {
            Self::Always
        }
    }

    /// Instance mask in the top level.
    pub fn mask(self, kind: Kind) -> u8 {
        match (self, kind) {
            (_, Kind::Sky) => MASK_SKY,
            (Self::Always | Self::NoShadow, Kind::Translucent) => MASK_TRANSLUCENT,
            (Self::FirstPerson, Kind::Translucent) => MASK_FIRST_TRANSLUCENT,
            (Self::ThirdPerson, Kind::Translucent) => MASK_THIRD_TRANSLUCENT,
            (Self::Always, Kind::Passed) => MASK_NO_SHADOW,
            // no mask bit is for mirror rays alone: they share each bit with shadow rays
            (Self::ThirdPerson, Kind::Passed) => 0,
            (Self::Always, _) => MASK_SOLID,
            (Self::FirstPerson, _) => MASK_FIRST_SOLID,
            (Self::ThirdPerson, _) => MASK_THIRD_SOLID,
            (Self::NoShadow, _) => MASK_NO_SHADOW,
        }
    }
}

/// Source of a part's triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Source {
    /// A mesh of constant shape, by its number.
    Rigid(u64),
    /// A mesh whose vertices change each frame.
    Animated(MeshId),
}

/// Key of a bottom-level structure: one for each of its meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShapeMesh {
    /// Kind of its triangles.
    pub kind: Kind,
    /// Source of the triangles.
    pub source: Source,
    /// Index of its first vertex in the part.
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertices: u32,
    /// Number of indices.
    pub indices: u32,
    /// The subset of its triangles.
    pub share: Share,
}

/// Subset of a mesh's triangles in a part. The subset depends on the material, whose index distinguishes subsets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Share {
    /// All.
    #[default]
    Whole,
    /// Triangles of an alpha-tested material without holes.
    Solid(u32),
    /// Triangles that need the alpha test.
    Mixed(u32),
}

/// Key of the coverage of triangles: source, subset of vertices, material.
type SkinnedShape = (Source, u32, u32);

/// Maximum number of stored coverages; above it all are dropped and computed again.
const KEPT_COVERAGES: usize = 4096;

/// Key of a part's triangle records: shape and skin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SkinMesh {
    /// The shape.
    pub shape: ShapeMesh,
    /// Drawn material.
    pub material: u32,
    /// Fog volume plus one; 0: none.
    pub fog: u32,
    /// `Triangle.flags`.
    pub flags: u32,
}

/// Meshes of one instance with equal ray visibility and kind.
#[derive(Clone, Debug)]
pub struct Part {
    /// Index of the instance.
    pub instance: u32,
    /// Ray types that see it.
    pub seen: Seen,
    /// Kind of its triangles.
    pub kind: Kind,
    /// Its vertices change each frame.
    pub animated: bool,
    /// Range of an animated part's vertices in [`TracedScene::vertices`].
    pub vertices: Range<usize>,
    /// Its members in [`Parts::shapes`], [`Parts::skins`] and [`Parts::meshes`].
    pub members: Range<usize>,
    /// It belongs to a model, not to the map.
    pub of_model: bool,
    /// Drawing order of its first mesh.
    order: usize,
}

/// Meshes that live for one frame, in world space.
pub struct Slot {
    /// Ray types that see them.
    pub seen: Seen,
    /// Kind of their triangles.
    pub kind: Kind,
    /// Triangle records; they index [`TracedScene::vertices`].
    pub triangles: Vec<Triangle>,
    /// The same triangles as build input; they index [`Parts::positions`].
    pub indices: Vec<[u32; 3]>,
}

/// Properties that distinguish parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct PartKey {
    instance: u32,
    kind: Kind,
    animated: bool,
    /// Coplanar translucent layers keep their drawing order: one material per part.
    material: u32,
    /// The set of visible map surfaces changes; each surface is a part.
    world_surface: u32,
}

struct Member {
    key: PartKey,
    order: usize,
    mesh: usize,
    skin: SkinMesh,
}

/// Sorted meshes of a view. Its memory is reused.
pub struct Parts {
    /// Parts in drawing order.
    pub parts: Vec<Part>,
    /// Shapes of the members.
    pub shapes: Vec<ShapeMesh>,
    /// Skins of the members.
    pub skins: Vec<SkinMesh>,
    /// Indices of the members in [`TracedScene::meshes`].
    pub meshes: Vec<usize>,
    /// Meshes that live for one frame.
    pub slots: Vec<Slot>,
    /// Positions of the slots' triangles, in world space.
    pub positions: Vec<Vec3>,
    members: Vec<Member>,
    order: Vec<(f32, u32, usize)>,
    /// Coverage of the triangles of alpha-tested meshes, where some triangles need no test.
    coverages: HashMap<SkinnedShape, Option<Box<[Coverage]>>>,
    /// Generation of the materials when `coverages` was last cleared.
    generation: u64,
}

impl Default for Parts {
    fn default() -> Self {
        const KINDS: [Kind; 5] = [
            Kind::Opaque,
            Kind::Tested,
            Kind::Translucent,
            Kind::Sky,
            Kind::Passed,
        ];
        let slots = Seen::ALL.into_iter().flat_map(|seen| {
            KINDS.map(|kind| Slot {
                seen,
                kind,
                triangles: Vec::new(),
                indices: Vec::new(),
            })
        });
        Self {
            parts: Vec::new(),
            shapes: Vec::new(),
            skins: Vec::new(),
            meshes: Vec::new(),
            slots: slots.collect(),
            positions: Vec::new(),
            members: Vec::new(),
            order: Vec::new(),
            coverages: HashMap::new(),
            generation: 0,
        }
    }
}

/// Whether an instance's axes span a volume, so that its transform is invertible.
pub fn is_solid(axis: Mat3) -> bool {
    let volume = axis.determinant().abs();
    volume.is_finite() && volume > FLAT
}

/// The axes of an instance.
pub fn axes(instance: &Instance) -> Mat3 {
    let [x, y, z] = instance.axis;
    Mat3::from_cols(x, y, z)
}

/// `Triangle.flags` of a mesh.
fn triangle_flags(mesh: &DynamicMesh, instance: &Instance, kind: Kind, info: &MaterialInfo) -> u32 {
    // lightmap coordinates in the world's vertices are not part of the material
    let world = match mesh.world_surface {
        Some(_) => c::TRIANGLE_WORLD,
        None => 0,
    };
    let shape = match instance.flags & c::INSTANCE_SUSPENDED {
        0 if world == 0 => c::TRIANGLE_CURVED,
        0 => 0,
        _ => c::TRIANGLE_FACES_CAMERA,
    };
    let paths = u32::from(mesh.paths) << TRIANGLE_PATHS_SHIFT;
    world | shape | sides(kind) | rank_bits(info) | paths
}

/// Source, vertices and indices of a mesh with its own structure; `None` if it is used for one frame.
fn kept_source(view: &TracedScene, mesh: &DynamicMesh) -> Option<(Source, u32, u32)> {
    match mesh.shape {
        Shape::Rigid(rigid) => {
            let rigid = view.look.rigid.get(rigid as usize)?;
            let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
            let (vertices, indices) = (count(rigid.vertices.len()), count(rigid.indices.len()));
            Some((Source::Rigid(rigid.id), vertices, indices))
        }
        Shape::Animated(id) if !is_scrap(mesh) && is_whole(view, mesh) => {
            Some((Source::Animated(id), mesh.vertex_count, mesh.index_count))
        }
        Shape::Animated(_) | Shape::Changing => None,
    }
}

impl Parts {
    /// Sorts a view's meshes.
    pub fn collect(&mut self, view: &TracedScene, materials: &dyn MaterialTable) {
        for slot in &mut self.slots {
            slot.triangles.clear();
            slot.indices.clear();
        }
        self.positions.clear();
        self.members.clear();
        if self.generation != materials.generation() || self.coverages.len() > KEPT_COVERAGES {
            self.coverages.clear();
            self.generation = materials.generation();
        }
        // in drawing order, so that of two coplanar translucent layers the later primitive is drawn later
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        for (index, mesh) in view.meshes.iter().enumerate() {
            let (_, info) = materials.info(mesh.material);
            order.push((info.sort, info.order, index));
        }
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        for (place, &(_, _, index)) in order.iter().enumerate() {
            if let Some(mesh) = view.meshes.get(index) {
                let (material, info) = materials.info(mesh.material);
                self.add(view, mesh, (place, index), material, &info, materials);
            }
        }
        self.order = order;
        self.group(view);
    }

    fn add(
        &mut self,
        view: &TracedScene,
        mesh: &DynamicMesh,
        (order, index): (usize, usize),
        material: u32,
        info: &MaterialInfo,
        materials: &dyn MaterialTable,
    ) {
        let (Some(instance), Some(kind)) = (
            slice::get(&view.instances, mesh.instance as usize),
            Kind::in_light(info.flags, mesh.world_surface.is_some()),
        ) else {
            return;
        };
        let flags = triangle_flags(mesh, instance, kind, info);
        // The faces of an instance without volume are coplanar, and rounding decides which of them a ray hits first:
        // the instance would flicker.
        if !is_solid(axes(instance)) {
            return;
        }
        // Copies that face a portal's camera are visible only to primary rays that passed that portal: for all tracers
        // they are translucent layers, whatever their stages are, because no other ray searches for layers.
        if mesh.paths >= turned::PORTAL {
            let seen = Seen::ThirdPerson;
            self.add_changing(
                view,
                mesh,
                instance,
                (seen, Kind::Translucent),
                material,
                flags,
            );
            return;
        }
        let Some((source, vertices, indices)) = kept_source(view, mesh) else {
            let slot = (Seen::of(instance.flags), kind);
            self.add_changing(view, mesh, instance, slot, material, flags);
            return;
        };
        let shares = if kind == Kind::Tested && mesh.world_surface.is_none() {
            self.cut_out_shares(view, mesh, (source, material, indices), materials)
        } else {
            [Some((kind, Share::Whole)), None]
        };
        for (kind, share) in shares.into_iter().flatten() {
            self.members.push(Member {
                key: PartKey {
                    instance: mesh.instance,
                    kind,
                    animated: matches!(source, Source::Animated(_)),
                    material: if kind == Kind::Translucent {
                        material
                    } else {
                        0
                    },
                    world_surface: mesh.world_surface.unwrap_or(u32::MAX),
                },
                order,
                mesh: index,
                skin: SkinMesh {
                    shape: ShapeMesh {
                        kind,
                        source,
                        first_vertex: mesh.first_vertex,
                        vertices,
                        indices,
                        share,
                    },
                    material,
                    fog: mesh.fog,
                    flags,
                },
            });
        }
    }

    /// Kinds and subsets of an alpha-tested mesh: triangles without holes need no test.
    fn cut_out_shares(
        &mut self,
        view: &TracedScene,
        mesh: &DynamicMesh,
        skin: SkinnedShape,
        materials: &dyn MaterialTable,
    ) -> [Option<(Kind, Share)>; 2] {
        let (_, material, _) = skin;
        let known = self.coverages.entry(skin).or_insert_with(|| {
            let found = triangle_coverages(view, mesh, material, materials);
            found
                .iter()
                .any(|c| *c != Coverage::Mixed)
                .then(|| found.into())
        });
        let Some(known) = known else {
            return [Some((Kind::Tested, Share::Whole)), None];
        };
        let some = |coverage, kind, share| known.contains(&coverage).then_some((kind, share));
        [
            some(Coverage::Solid, Kind::Opaque, Share::Solid(material)),
            some(Coverage::Mixed, Kind::Tested, Share::Mixed(material)),
        ]
    }

    /// Coverage of a skin's triangles, if it takes a subset of them.
    pub fn coverages(&self, skin: &SkinMesh) -> Option<&[Coverage]> {
        if skin.shape.share == Share::Whole {
            return None;
        }
        let key = (skin.shape.source, skin.material, skin.shape.indices);
        self.coverages.get(&key)?.as_deref()
    }

    /// Sorts members so that those of a part are contiguous.
    fn group(&mut self, view: &TracedScene) {
        self.parts.clear();
        self.shapes.clear();
        self.skins.clear();
        self.meshes.clear();
        self.members
            .sort_by(|a, b| a.key.cmp(&b.key).then(a.order.cmp(&b.order)));
        for members in self.members.chunk_by_mut(|a, b| a.key == b.key) {
            let Some(&Member { key, order, .. }) = slice::get(members, 0) else {
                continue;
            };
            let Some(instance) = slice::get(&view.instances, key.instance as usize) else {
                continue;
            };
            let first = self.meshes.len();
            // vertices of an animated part are contiguous in the view, those of a rigid mesh in its own buffer
            let base = members.iter().map(|m| m.skin.shape.first_vertex).min();
            let base = base.unwrap_or(0);
            let mut end = 0;
            for member in members {
                let shape = &mut member.skin.shape;
                shape.first_vertex = if key.animated {
                    shape.first_vertex - base
                } else {
                    end
                };
                end = end.max(shape.first_vertex.saturating_add(shape.vertices));
                self.meshes.push(member.mesh);
                self.shapes.push(member.skin.shape);
                self.skins.push(member.skin);
            }
            let base = base as usize;
            self.parts.push(Part {
                instance: key.instance,
                seen: Seen::of(instance.flags),
                kind: key.kind,
                animated: key.animated,
                vertices: base..base.saturating_add(end as usize),
                members: first..self.meshes.len(),
                of_model: key.world_surface == u32::MAX,
                order,
            });
        }
        self.parts.sort_by_key(|part| part.order);
    }

    /// Adds a mesh that is used for one frame, in world space. Omits triangles with a non-finite corner.
    fn add_changing(
        &mut self,
        view: &TracedScene,
        mesh: &DynamicMesh,
        instance: &Instance,
        (seen, kind): (Seen, Kind),
        material: u32,
        flags: u32,
    ) {
        let slots = &mut self.slots;
        let Some(slot) = slots.iter_mut().find(|s| s.seen == seen && s.kind == kind) else {
            debug_assert!(false, "no slot for {seen:?} {kind:?}");
            return;
        };
        let vertices = part(&view.vertices, span(mesh.first_vertex, mesh.vertex_count));
        let axis = axes(instance);
        let base = self.positions.len();
        let placed = vertices.iter().map(|v| axis * v.position + instance.origin);
        self.positions.extend(placed);
        let indices = part(&view.indices, span(mesh.first_index, mesh.index_count));
        for indices in indices.as_chunks::<3>().0 {
            let corners = indices.map(|i| {
                let local = i.checked_sub(mesh.first_vertex)? as usize;
                let position = self.positions.get(base.checked_add(local)?)?;
                let index = u32::try_from(base + local).ok()?;
                position.is_finite().then_some(index)
            });
            let [Some(a), Some(b), Some(c)] = corners else {
                continue; // a corner is not finite
            };
            slot.indices.push([a, b, c]);
            slot.triangles.push(Triangle {
                indices: *indices,
                material,
                instance: mesh.instance,
                fog: mesh.fog,
                lightmap: c::NO_TEXTURE,
                flags,
            });
        }
    }
}

/// Coverage of each triangle of a model's surface with a material.
fn triangle_coverages(
    view: &TracedScene,
    mesh: &DynamicMesh,
    material: u32,
    materials: &dyn MaterialTable,
) -> Vec<Coverage> {
    let geometry = view.mesh_geometry(mesh);
    let st = |i: u32| geometry.vertices.get(i as usize).map(|v| v.st);
    geometry
        .triangles()
        .map(|t| match t.map(st) {
            [Some(a), Some(b), Some(c)] => materials.coverage(material, [a, b, c]),
            _ => Coverage::Mixed,
        })
        .collect()
}

/// Whether a deformed surface of the map is so small that it shares a structure with others of its kind: a map may have
/// hundreds of flames and lamps that face the camera, and each structure costs a build and an instance.
fn is_scrap(mesh: &DynamicMesh) -> bool {
    mesh.world_surface.is_some() && mesh.index_count < 3 * SCRAP
}

/// Whether a mesh's vertices exist and are finite, as refits require.
fn is_whole(view: &TracedScene, mesh: &DynamicMesh) -> bool {
    let first = mesh.first_vertex as usize;
    let range = first..first.saturating_add(mesh.vertex_count as usize);
    let found = view.vertices.get(range);
    found.is_some_and(|v| v.iter().all(|v| v.position.is_finite()))
}
