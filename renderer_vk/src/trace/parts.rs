//! The meshes of a view, sorted by what rays do with them and by how much of them outlives the frame.

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

/// Smallest volume of an entity's axes that an instance can be turned back from; flatter ones are left out.
const FLAT: f32 = 1.0e-12;

/// Triangles of a deformed surface of the map from which on it has a structure of its own.
const SCRAP: u32 = 128;

/// Who sees a mesh that moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// Every ray.
    Always,
    /// The eye alone.
    FirstPerson,
    /// Mirrors, shadows and bounced light.
    ThirdPerson,
    /// Everything but shadows.
    NoShadow,
}

impl Seen {
    /// All there are.
    pub const ALL: [Self; 4] = [
        Self::Always,
        Self::FirstPerson,
        Self::ThirdPerson,
        Self::NoShadow,
    ];

    /// By an instance's `INSTANCE_*` bits.
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

    /// Mask of a top-level instance.
    pub fn mask(self, kind: Kind) -> u8 {
        match (self, kind) {
            (_, Kind::Sky) => MASK_SKY,
            (Self::Always | Self::NoShadow, Kind::Translucent) => MASK_TRANSLUCENT,
            (Self::FirstPerson, Kind::Translucent) => MASK_FIRST_TRANSLUCENT,
            (Self::ThirdPerson, Kind::Translucent) => MASK_THIRD_TRANSLUCENT,
            (Self::Always, Kind::Passed) => MASK_NO_SHADOW,
            // no mask is of mirror rays alone: every one that they have is shared with shadow rays
            (Self::ThirdPerson, Kind::Passed) => 0,
            (Self::Always, _) => MASK_SOLID,
            (Self::FirstPerson, _) => MASK_FIRST_SOLID,
            (Self::ThirdPerson, _) => MASK_THIRD_SOLID,
            (Self::NoShadow, _) => MASK_NO_SHADOW,
        }
    }
}

/// What a part's triangles are made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Source {
    /// A mesh that keeps its shape, by its number.
    Rigid(u64),
    /// A mesh whose vertices are made anew each frame.
    Animated(MeshId),
}

/// What a bottom-level structure is known by: one for each of its meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShapeMesh {
    /// Kind of its triangles.
    pub kind: Kind,
    /// Where they come from.
    pub source: Source,
    /// First vertex, counted from the part's first.
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertices: u32,
    /// Number of indices.
    pub indices: u32,
    /// Which of its triangles.
    pub share: Share,
}

/// The triangles of a mesh that a part takes; which these are depends on the material, by whose index shares are told
/// apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Share {
    /// All.
    #[default]
    Whole,
    /// Of a cut-out those without holes.
    Solid(u32),
    /// Of a cut-out those that have to be tested.
    Mixed(u32),
}

/// A skin of a shape: what the coverage of triangles is known by.
type SkinnedShape = (Source, u32, u32);

/// Coverages that are kept at most; beyond that they are found anew, which takes a while and changes nothing.
const KEPT_COVERAGES: usize = 4096;

/// What a part's triangles are known by, beside their shape: the skin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SkinMesh {
    /// The shape.
    pub shape: ShapeMesh,
    /// Material that is drawn.
    pub material: u32,
    /// Fog volume plus one.
    pub fog: u32,
    /// `Triangle.flags`.
    pub flags: u32,
}

/// Meshes of one instance that rays treat alike.
#[derive(Clone, Debug)]
pub struct Part {
    /// Index of the instance.
    pub instance: u32,
    /// Who sees it.
    pub seen: Seen,
    /// Kind of its triangles.
    pub kind: Kind,
    /// Its vertices are made anew each frame.
    pub animated: bool,
    /// Of an animated part, its vertices in [`TracedScene::vertices`].
    pub vertices: Range<usize>,
    /// Its members in [`Parts::shapes`], [`Parts::skins`] and [`Parts::meshes`].
    pub members: Range<usize>,
    /// Place of its first mesh in drawing order.
    order: usize,
}

/// Meshes without a shape of their own, in world space.
pub struct Slot {
    /// Who sees them.
    pub seen: Seen,
    /// Kind of their triangles.
    pub kind: Kind,
    /// For hits; they index [`TracedScene::vertices`].
    pub triangles: Vec<Triangle>,
    /// The same triangles for builds; they index [`Parts::positions`].
    pub indices: Vec<[u32; 3]>,
}

/// What distinguishes one part from another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct PartKey {
    instance: u32,
    kind: Kind,
    animated: bool,
    /// Translucent layers in one plane keep the order in which they are drawn: one material to a part.
    material: u32,
    /// Which surfaces of the map are in sight changes; each is a part.
    world_surface: u32,
}

struct Member {
    key: PartKey,
    order: usize,
    mesh: usize,
    skin: SkinMesh,
}

/// A view's meshes in order. The memory is reused.
pub struct Parts {
    /// Parts in drawing order.
    pub parts: Vec<Part>,
    /// Shapes of the members.
    pub shapes: Vec<ShapeMesh>,
    /// Skins of the members.
    pub skins: Vec<SkinMesh>,
    /// Indices of the members in [`TracedScene::meshes`].
    pub meshes: Vec<usize>,
    /// Everything else.
    pub slots: Vec<Slot>,
    /// Positions of the slots' triangles, in world space.
    pub positions: Vec<Vec3>,
    members: Vec<Member>,
    order: Vec<(f32, u32, usize)>,
    /// Of cut-outs with triangles that need no test.
    coverages: HashMap<SkinnedShape, Option<Box<[Coverage]>>>,
    /// Of the materials, when `coverages` was last emptied.
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

/// Whether an instance can be turned back: its axes span a volume.
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
    // what is baked into the world's own vertices is not part of the material
    let world = if mesh.world_surface.is_some() {
        c::TRIANGLE_WORLD
    } else {
        0
    };
    let faces_eye = if instance.flags & c::INSTANCE_SUSPENDED != 0 {
        c::TRIANGLE_FACES_EYE
    } else {
        0
    };
    let paths = u32::from(mesh.paths) << TRIANGLE_PATHS_SHIFT;
    world | faces_eye | sides(kind) | rank_bits(info) | paths
}

/// Source, vertices and indices of a mesh that has a structure of its own.
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
        // in drawing order, so that of two translucent layers in one plane the later primitive is drawn later
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
        // Seen from anywhere, the faces of something pressed flat lie in one plane, and which of them a ray meets first
        // is left to the last bits of its distance: it would flicker.
        if !is_solid(axes(instance)) {
            return;
        }
        // Only paths of the eye that were turned by a portal meet what is turned to the eye as they see it: to all
        // tracers it is a translucent layer, whatever its stages are, because nothing else asks for those.
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

    /// Kinds and shares of a cut-out's triangles: those without holes need no test.
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

    /// The coverages of a skin's triangles, where it takes a share of them.
    pub fn coverages(&self, skin: &SkinMesh) -> Option<&[Coverage]> {
        if skin.shape.share == Share::Whole {
            return None;
        }
        let key = (skin.shape.source, skin.material, skin.shape.indices);
        self.coverages.get(&key)?.as_deref()
    }

    /// Puts the members of each part side by side.
    fn group(&mut self, view: &TracedScene) {
        self.parts.clear();
        self.shapes.clear();
        self.skins.clear();
        self.meshes.clear();
        self.members
            .sort_by(|a, b| a.key.cmp(&b.key).then(a.order.cmp(&b.order)));
        for members in self.members.chunk_by_mut(|a, b| a.key == b.key) {
            let Some(&Member { key, order, .. }) = members.first() else {
                continue;
            };
            let Some(instance) = slice::get(&view.instances, key.instance as usize) else {
                continue;
            };
            let first = self.meshes.len();
            // vertices of an animated part lie side by side in the view, those of a rigid one in its own memory
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
                order,
            });
        }
        self.parts.sort_by_key(|part| part.order);
    }

    /// Adds a mesh to those that are placed here. Triangles with a corner that is no number are left out.
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
                continue;
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

/// Coverage of each triangle of a model's surface in a material.
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

/// Whether a deformed surface of the map is so small that it is better built together with all others of its sort:
/// flames and lamps that turn to the eye come by hundreds, and each structure costs a build and an instance.
fn is_scrap(mesh: &DynamicMesh) -> bool {
    mesh.world_surface.is_some() && mesh.index_count < 3 * SCRAP
}

/// Whether a mesh's vertices are there and numbers: a structure that is fitted to them must not meet others.
fn is_whole(view: &TracedScene, mesh: &DynamicMesh) -> bool {
    let first = mesh.first_vertex as usize;
    let range = first..first.saturating_add(mesh.vertex_count as usize);
    let found = view.vertices.get(range);
    found.is_some_and(|v| v.iter().all(|v| v.position.is_finite()))
}
