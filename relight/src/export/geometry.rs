//! What of a map is drawn, joined by model and material.

use crate::materials::light::SurfaceClass;
use crate::world::coplanar::Stacked;
use crate::world::{RelitWorld, WorldMaterial, WorldSurface, WorldVertex};
use glam::{Vec2, Vec3};
use q3bsp::surface_flags;
use std::collections::{BTreeMap, HashMap};
use support::slice::item;

/// Texture coordinates beyond this many repetitions are moved back by whole ones: far out, floats have no fraction left.
const FAR: f32 = 256.0;

/// How far a surface that lies in one plane with others rises for each that lies below it, id units.
pub const RISE: f32 = 0.25;

/// What becomes of surfaces of a material.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawn {
    /// They are drawn.
    Yes,
    /// They are windows to the sky.
    Sky,
    /// They are not: no stage, the boundary of a fog, or flags that say so.
    No,
}

/// Whether a material is drawn. The map's flags hide it whatever its script contains.
pub fn drawn(material: &WorldMaterial) -> Drawn {
    let hidden = surface_flags::NODRAW | surface_flags::HINT | surface_flags::SKIP;
    if material.is_sky() {
        Drawn::Sky
    } else if material.surface_flags & hidden != 0
        || matches!(
            material.class.class,
            SurfaceClass::Invisible | SurfaceClass::Fog
        )
    {
        Drawn::No
    } else {
        Drawn::Yes
    }
}

/// Triangles of one model and material. Space and winding are the map's.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Index into the world's materials.
    pub material: u32,
    /// Vertices, each once. Coordinates in the lightmap are those of [`Atlas`](super::lightmaps::Atlas) where there is
    /// one, else of the page.
    pub vertices: Vec<WorldVertex>,
    /// Three corners a triangle.
    pub indices: Vec<u32>,
}

/// A brush model; 0 is the world.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// One per material, in the order of the world's materials.
    pub parts: Vec<Part>,
}

impl Part {
    /// The triangles that are `picked`, moved along their vertices' normals, and which vertex here each of theirs was.
    pub fn lifted(&self, by: f32, picked: &dyn Fn([WorldVertex; 3]) -> bool) -> (Part, Vec<usize>) {
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        let mut out = Part {
            material: self.material,
            vertices: Vec::new(),
            indices: Vec::new(),
        };
        let mut from = Vec::new();
        for corners in self.indices.as_chunks::<3>().0 {
            let triangle = corners.map(|i| item(&self.vertices, i as usize));
            if !picked(triangle) {
                continue;
            }
            for (&old, vertex) in corners.iter().zip(triangle) {
                let number = *numbers.entry(old).or_insert_with(|| {
                    from.push(old as usize);
                    out.vertices.push(WorldVertex {
                        position: vertex.position + vertex.normal.normalize_or_zero() * by,
                        ..vertex
                    });
                    out.vertices.len() as u32 - 1
                });
                out.indices.push(number);
            }
        }
        (out, from)
    }
}

/// Everything drawn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Geometry {
    /// One per model of the map.
    pub models: Vec<Mesh>,
    /// Windows to the sky, of all models, one per material; world space.
    pub sky: Vec<Part>,
    /// Triangles left out because they have no area.
    pub degenerate: usize,
}

impl Geometry {
    /// Number of triangles, sky apart.
    pub fn triangles(&self) -> usize {
        self.parts().map(|part| part.indices.len() / 3).sum()
    }

    /// Number of vertices, sky apart.
    pub fn vertices(&self) -> usize {
        self.parts().map(|part| part.vertices.len()).sum()
    }

    /// Least and largest texture coordinates of a material, sky apart; `None` where nothing has it.
    pub fn coordinates(&self, material: u32) -> Option<(Vec2, Vec2)> {
        let parts = self.parts().filter(|part| part.material == material);
        let all = parts.flat_map(|part| &part.vertices).map(|v| v.st);
        all.map(|st| (st, st))
            .reduce(|(least, most), (st, _)| (least.min(st), most.max(st)))
    }

    /// All parts, sky apart.
    pub fn parts(&self) -> impl Iterator<Item = &Part> {
        self.models.iter().flat_map(|model| &model.parts)
    }
}

/// Vertices of a part, each once by all that it holds.
#[derive(Default)]
struct Joiner {
    known: HashMap<[u32; 11], u32>,
    vertices: Vec<WorldVertex>,
    indices: Vec<u32>,
}

/// The bits of a vertex; -0 counts as 0.
fn key(v: &WorldVertex) -> [u32; 11] {
    let bits = |f: f32| (f + 0.0).to_bits();
    let [px, py, pz] = v.position.to_array().map(bits);
    let [nx, ny, nz] = v.normal.to_array().map(bits);
    let [s, t] = v.st.to_array().map(bits);
    let [ls, lt] = v.lightmap.to_array().map(bits);
    [
        px,
        py,
        pz,
        nx,
        ny,
        nz,
        s,
        t,
        ls,
        lt,
        u32::from_le_bytes(v.color),
    ]
}

impl Joiner {
    fn index(&mut self, vertex: WorldVertex) -> u32 {
        *self.known.entry(key(&vertex)).or_insert_with(|| {
            self.vertices.push(vertex);
            (self.vertices.len() - 1) as u32
        })
    }

    fn finish(self, material: u32) -> Part {
        Part {
            material,
            vertices: self.vertices,
            indices: self.indices,
        }
    }
}

/// Joins what is drawn. `place` gives the coordinates that a surface's vertices have in the light's image, from those
/// in its page.
pub fn gather(world: &RelitWorld, place: &dyn Fn(&WorldSurface, Vec2) -> Vec2) -> Geometry {
    let mut parts: BTreeMap<(u32, u32), Joiner> = BTreeMap::new();
    let mut sky: BTreeMap<u32, Joiner> = BTreeMap::new();
    let mut degenerate = 0;
    let stacked = world.stacked();
    for (number, surface) in world.surfaces.iter().enumerate() {
        let Some(material) = world.material_of(surface) else {
            continue;
        };
        if surface.num_indices == 0 {
            continue;
        }
        let origin = world
            .models
            .get(surface.model as usize)
            .map_or(Vec3::ZERO, |model| model.origin);
        let (joiner, origin) = match drawn(material) {
            Drawn::No => continue,
            Drawn::Sky => (sky.entry(surface.material).or_default(), origin),
            Drawn::Yes => (
                parts.entry((surface.model, surface.material)).or_default(),
                Vec3::ZERO,
            ),
        };
        let shift = far_shift(world, surface, material);
        let indices = world.indices_of(surface);
        let rises = rises(world, indices, item(&stacked, number));
        for corners in indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|i| item(&world.vertices, i as usize));
            if (b.position - a.position).cross(c.position - a.position) == Vec3::ZERO {
                degenerate += 1;
                continue;
            }
            let corner = [0, 1, 2].map(|i| {
                let v = [a, b, c][i];
                // Only corners that lie on another surface rise.
                let rise = rises.get(&corners[i]).copied().unwrap_or_default();
                joiner.index(WorldVertex {
                    position: v.position + origin + rise,
                    st: v.st - shift,
                    lightmap: place(surface, v.lightmap),
                    ..v
                })
            });
            joiner.indices.extend(corner);
        }
    }
    let mut geometry = Geometry {
        models: vec![Mesh::default(); world.models.len().max(1)],
        sky: sky.into_iter().map(|(m, j)| j.finish(m)).collect(),
        degenerate,
    };
    for ((model, material), joiner) in parts {
        if let Some(mesh) = geometry.models.get_mut(model as usize)
            && !joiner.indices.is_empty()
        {
            mesh.parts.push(joiner.finish(material));
        }
    }
    geometry.sky.retain(|part| !part.indices.is_empty());
    geometry
}

/// How far each vertex of a surface rises from what the surface lies on; none where it lies on nothing.
fn rises(world: &RelitWorld, indices: &[u32], stacked: Stacked) -> BTreeMap<u32, Vec3> {
    if stacked.below == 0 {
        return BTreeMap::new();
    }
    let place = |i: u32| item(&world.vertices, i as usize).position;
    let triangles = indices.as_chunks::<3>().0.iter();
    let triangles = triangles.map(|&numbers| (numbers, numbers.map(place)));
    let mut rises = stacked.directions(triangles);
    for rise in rises.values_mut() {
        *rise *= RISE * stacked.below as f32;
    }
    rises
}

/// Joins triangles of models, without those that have no area or non-finite coordinates; also returns how
/// many these are. The part's material is 0.
pub fn join(triangles: impl Iterator<Item = [WorldVertex; 3]>) -> (Part, usize) {
    let mut joiner = Joiner::default();
    let mut degenerate = 0;
    for corners in triangles {
        let [a, b, c] = corners.map(|v| v.position);
        let front = (b - a).cross(c - a);
        if front == Vec3::ZERO || !front.is_finite() {
            degenerate += 1;
            continue;
        }
        let corners = corners.map(|v| joiner.index(v));
        joiner.indices.extend(corners);
    }
    (joiner.finish(0), degenerate)
}

/// Whole repetitions that a surface's texture coordinates are moved back by: none unless they are far out.
fn far_shift(world: &RelitWorld, surface: &WorldSurface, material: &WorldMaterial) -> Vec2 {
    let vertices = world.vertices_of(surface);
    let Some(least) = vertices.iter().map(|v| v.st).reduce(Vec2::min) else {
        return Vec2::ZERO;
    };
    // Whole repetitions of the coordinates are whole ones of the image only where it repeats and nothing scales.
    let plain = material.resolved.shader.stages.iter().all(|stage| {
        stage.tc_mods.is_empty() && !matches!(stage.image, shaderscript::StageImage::ClampMap(_))
    });
    let back = |v: f32| {
        if plain && v.abs() > FAR {
            v.floor()
        } else {
            0.0
        }
    };
    Vec2::new(back(least.x), back(least.y))
}
