//! Scenes built in code: triangles, materials, lights and moving geometry, and their upload.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use relight::light::{EmissionSource, Falloff, LightLists, PointLight, SunLight, TriangleLight};
use shaders::trace_types::SkyRecord;
use shaders::types::constants as c;
use shaders::types::{Fog, Instance, Material, MaterialBuffers, Stage, TcMod, Vertex};
use support::Aabb;

use super::{encode, identity, rectangle, stage};
use crate::api::{DynamicLight, EntityKind, RefDef};
use crate::assets::is_glossy;
use crate::gpu::{Buffer, BufferUsage, Device};
use crate::scene::{
    DynamicMesh, Portal, RigidMesh, Shape, Submodel, TracedPart, TracedScene, View, ViewEntity,
};
use crate::trace::geometry::StaticGeometry;
use crate::trace::input::{MaterialInfo, MaterialTable, StaticScene, StaticSurface};
use crate::trace::lights::{MapLightSource, MapLights};
use crate::trace::surroundings::Surroundings;
use crate::trace::tracer::Tracer;

/// A scene built in code.
pub struct Scene {
    pub materials: Vec<(Material, MaterialInfo)>,
    pub stages: Vec<Stage>,
    pub images: Vec<u32>,
    pub vertices: Vec<Vertex>,
    pub indices: Vec<u32>,
    pub surfaces: Vec<StaticSurface>,
    pub lights: Vec<TriangleLight>,
    /// Rays can hit every triangle light: an opaque surface of the map.
    pub lights_are_hittable: bool,
    pub points: Vec<PointLight>,
    pub suns: Vec<SunLight>,
    pub ambient: Vec3,
    pub light_cutoff: f32,
    pub fogs: Vec<Fog>,
    /// Boxes around surfaces that filter light.
    pub filters: Vec<Aabb>,
    pub instances: Vec<Instance>,
    pub dynamic_vertices: Vec<Vertex>,
    pub dynamic_indices: Vec<u32>,
    pub meshes: Vec<DynamicMesh>,
    pub rigid: Vec<Arc<RigidMesh>>,
    pub submodels: Vec<Submodel>,
    pub entities: Vec<ViewEntity>,
    pub portals: Vec<Portal>,
    pub dlights: Vec<DynamicLight>,
    /// The map's tree with its light lists; without it, all lights reach all points.
    pub tree: Option<(q3bsp::Bsp, LightLists)>,
    /// Mean coverage of alpha-tested materials.
    pub coverages: HashMap<u32, f32>,
    /// `rt_gridCells`.
    pub grid_cells: u32,
    pub def: RefDef,
}

impl Scene {
    /// An empty scene with a camera: at `camera`, looking at `target`, `fov` degrees wide, square.
    pub fn new(camera: Vec3, target: Vec3, fov: f32, size: i32) -> Self {
        let forward = (target - camera).normalize();
        let aside = if forward.z.abs() > 0.99 {
            Vec3::Y
        } else {
            Vec3::Z.cross(forward).normalize()
        };
        Self {
            materials: Vec::new(),
            stages: Vec::new(),
            images: Vec::new(),
            vertices: Vec::new(),
            indices: Vec::new(),
            surfaces: Vec::new(),
            lights: Vec::new(),
            lights_are_hittable: false,
            points: Vec::new(),
            suns: Vec::new(),
            ambient: Vec3::ZERO,
            light_cutoff: 0.0,
            fogs: Vec::new(),
            filters: Vec::new(),
            instances: vec![Instance {
                flags: c::INSTANCE_UNLIT,
                ..identity()
            }],
            dynamic_vertices: Vec::new(),
            dynamic_indices: Vec::new(),
            meshes: Vec::new(),
            rigid: Vec::new(),
            submodels: Vec::new(),
            entities: Vec::new(),
            portals: Vec::new(),
            dlights: Vec::new(),
            tree: None,
            coverages: HashMap::new(),
            grid_cells: 0,
            def: RefDef {
                width: size,
                height: size,
                fov_x: fov,
                fov_y: fov,
                view_origin: camera,
                view_axis: [forward, aside, forward.cross(aside)],
                ..RefDef::default()
            },
        }
    }

    /// A hall with two walls for shadows in it, seen from `height` units above its middle.
    pub fn hall(height: f32, albedo: f32, size: i32) -> Self {
        let camera = Vec3::new(-180.0, 0.0, height);
        let mut scene = Self::new(camera, Vec3::new(100.0, 0.0, -20.0), 70.0, size);
        let grey = scene.diffuse(albedo);
        let far = Vec3::new(200.0, 150.0, 120.0);
        scene.room(Vec3::new(-200.0, -150.0, -80.0), far, grey);
        let corner = Vec3::new(40.0, -20.0, -80.0);
        for side in [Vec3::X, Vec3::Y] {
            scene.quad(rectangle(corner, Vec3::Z * 120.0, side * 40.0), grey);
        }
        scene
    }

    pub fn material(&mut self, stages: &[Stage], flags: u32) -> u32 {
        let reflects = |stage: &Stage| stage.flags & c::STAGE_REFLECTION != 0;
        let flags = if stages.iter().any(reflects) {
            flags | c::MATERIAL_REFLECTS
        } else {
            flags
        };
        let first = self.stages.len() as u32;
        self.stages.extend(stages);
        let index = self.materials.len() as u32;
        let sort = if flags & c::MATERIAL_TRANSLUCENT != 0 {
            9.0
        } else {
            3.0
        };
        self.materials.push((
            Material {
                stage_first: first,
                stage_count: stages.len() as u32,
                flags,
                clamp_time: 1.0e30,
                plain_image: c::NO_TEXTURE,
                lit_scale: 1.0,
                ..Material::default()
            },
            MaterialInfo {
                flags,
                sort,
                order: index,
                sky: None,
            },
        ));
        index
    }

    /// A lit, diffuse material of the given albedo (linear).
    pub fn diffuse(&mut self, albedo: f32) -> u32 {
        let code = encode(albedo);
        self.material(&[stage::light(), stage::filter([code; 3])], 0)
    }

    pub fn sky(&mut self, stages: &[Stage], sky: SkyRecord) -> u32 {
        let index = self.material(stages, c::MATERIAL_SKY);
        self.materials[index as usize].1.sky = Some(sky);
        index
    }

    fn corners(points: [Vec3; 4]) -> [Vertex; 4] {
        let normal = (points[1] - points[0])
            .cross(points[3] - points[0])
            .normalize();
        let st = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        std::array::from_fn(|i| Vertex {
            position: points[i],
            normal,
            st: st[i],
            lightmap: st[i],
            color: u32::MAX,
        })
    }

    /// A rectangle of the map.
    pub fn quad(&mut self, points: [Vec3; 4], material: u32) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(Self::corners(points));
        let first_index = self.indices.len() as u32;
        // clockwise from the front
        self.indices.extend([0, 2, 1, 0, 3, 2].map(|i| first + i));
        self.surfaces.push(StaticSurface {
            first_index,
            index_count: 6,
            material,
            fog: 0,
            lightmap: c::NO_TEXTURE,
            model: 0,
            number: self.surfaces.len() as u32,
            curved: false,
        });
    }

    /// A ball of the map, of `rings` bands with twice as many quads each, that is shaded as a sphere.
    pub fn ball(&mut self, center: Vec3, radius: f32, rings: u32, material: u32, curved: bool) {
        let first = self.vertices.len() as u32;
        let columns = 2 * rings;
        for ring in 0..=rings {
            for column in 0..=columns {
                let (down, around) = (
                    ring as f32 / rings as f32 * std::f32::consts::PI,
                    column as f32 / columns as f32 * std::f32::consts::TAU,
                );
                let normal = Vec3::new(
                    down.sin() * around.cos(),
                    down.sin() * around.sin(),
                    down.cos(),
                );
                self.vertices.push(Vertex {
                    position: center + radius * normal,
                    normal,
                    st: Vec2::ZERO,
                    lightmap: Vec2::ZERO,
                    color: u32::MAX,
                });
            }
        }
        let first_index = self.indices.len() as u32;
        for ring in 0..rings {
            for column in 0..columns {
                let above = first + ring * (columns + 1) + column;
                let below = above + columns + 1;
                // clockwise from the front
                let quad = [above, above + 1, below, below, above + 1, below + 1];
                self.indices.extend(quad);
            }
        }
        self.surfaces.push(StaticSurface {
            first_index,
            index_count: 12 * rings * rings,
            material,
            fog: 0,
            lightmap: c::NO_TEXTURE,
            model: 0,
            number: self.surfaces.len() as u32,
            curved,
        });
    }

    /// The six inner faces of a box.
    pub fn room(&mut self, mins: Vec3, maxs: Vec3, material: u32) {
        let (x, y, z) = (
            (maxs - mins) * Vec3::X,
            (maxs - mins) * Vec3::Y,
            (maxs - mins) * Vec3::Z,
        );
        self.quad(rectangle(mins, x, y), material);
        self.quad(rectangle(mins, y, z), material);
        self.quad(rectangle(mins, z, x), material);
        self.quad(rectangle(maxs, -y, -x), material);
        self.quad(rectangle(maxs, -z, -y), material);
        self.quad(rectangle(maxs, -x, -z), material);
    }

    /// The six outer faces of a box.
    pub fn block(&mut self, mins: Vec3, maxs: Vec3, material: u32) {
        let first = self.surfaces.len();
        self.room(mins, maxs, material);
        for surface in &self.surfaces[first..] {
            let start = surface.first_index as usize;
            for triangle in self.indices[start..start + 6].chunks_exact_mut(3) {
                triangle.swap(1, 2);
            }
        }
    }

    /// A rectangle of moving geometry.
    pub fn mesh(&mut self, points: [Vec3; 4], material: u32, instance: Instance) {
        let instance_index = self.instances.len() as u32;
        self.instances.push(instance);
        self.entities.push(ViewEntity {
            kind: EntityKind::Model,
            model: instance_index as i32,
            skin: 0,
            material: 0,
            renderfx: 0,
            frame: 0,
            old_frame: 0,
            origin: instance.origin,
            first_instance: instance_index,
            instance_count: 1,
            first_mesh: self.meshes.len() as u32,
            mesh_count: 1,
        });
        let first_vertex = self.dynamic_vertices.len() as u32;
        self.dynamic_vertices.extend(Self::corners(points));
        let first_index = self.dynamic_indices.len() as u32;
        self.dynamic_indices
            .extend([0, 2, 1, 0, 3, 2].map(|i| first_vertex + i));
        self.meshes.push(DynamicMesh {
            first_index,
            index_count: 6,
            first_vertex,
            vertex_count: 4,
            material,
            instance: instance_index,
            fog: 0,
            world_surface: None,
            shape: Shape::Changing,
            paths: 0,
        });
    }

    /// A triangle light that shines to the side from which a, b, c are counter-clockwise.
    pub fn light(&mut self, vertices: [Vec3; 3], radiance: Vec3) {
        self.lights.push(TriangleLight {
            vertices,
            radiance,
            two_sided: false,
            surface: 0,
            triangle: u32::MAX,
            model: 0,
            is_sky: false,
            source: EmissionSource::SurfaceLight,
        });
    }

    /// A light that faces down: a right triangle with legs of `size` units along x and y.
    pub fn lamp(&mut self, corner: Vec3, size: f32, radiance: Vec3) {
        let corners = [corner, corner + Vec3::Y * size, corner + Vec3::X * size];
        self.light(corners, radiance);
    }

    /// A white point light with inverse-square falloff.
    pub fn point(&mut self, origin: Vec3, intensity: f32, radius: f32) {
        self.points.push(PointLight {
            origin,
            intensity: Vec3::splat(intensity),
            radius,
            spot: None,
            falloff: Falloff::InverseSquare,
            pulse: None,
        });
    }

    /// A white sun.
    pub fn sun(&mut self, direction: Vec3, irradiance: f32, angular_radius: f32) {
        self.suns.push(SunLight {
            direction,
            irradiance: Vec3::splat(irradiance),
            angular_radius,
            material: None,
        });
    }

    /// A grey dynamic light.
    pub fn dlight(&mut self, origin: Vec3, radius: f32, color: f32) {
        self.dlights.push(DynamicLight {
            origin,
            radius,
            color: Vec3::splat(color),
            ..DynamicLight::default()
        });
    }

    pub fn view(&self) -> TracedScene {
        TracedScene {
            def: self.def,
            view: View::new(&self.def, 4.0, 10000.0),
            time: self.def.time_ms as f32 * 0.001,
            instances: self.instances.clone(),
            vertices: self.dynamic_vertices.clone(),
            indices: self.dynamic_indices.clone(),
            meshes: self.meshes.clone(),
            dlights: self.dlights.clone(),
            has_world: true,
            sun: None,
            flares: Vec::new(),
            look: TracedPart {
                rigid: self.rigid.clone(),
                submodels: self.submodels.clone(),
                entities: self.entities.clone(),
                potential: (0..self.surfaces.len() as u32).collect(),
                portals: self.portals.clone(),
            },
        }
    }

    /// The lists of the tree; without one, of all lights.
    pub fn lists(&self) -> LightLists {
        if let Some((_, lists)) = &self.tree {
            return lists.clone();
        }
        let all: Vec<u32> = (0..(self.lights.len() + self.points.len()) as u32).collect();
        LightLists {
            offsets: vec![0, all.len() as u32],
            lights: all,
            triangle_lights: self.lights.len() as u32,
            sky: Vec::new(),
            shares: Vec::new(),
        }
    }

    /// The lights; rays hit none of them.
    pub fn light_source<'a>(&'a self, lists: &'a LightLists) -> MapLightSource<'a> {
        MapLightSource {
            triangles: &self.lights,
            points: &self.points,
            suns: &self.suns,
            ambient: self.ambient,
            light_cutoff: self.light_cutoff,
            bsp: self.tree.as_ref().map(|t| &t.0),
            ..MapLightSource::empty(lists)
        }
    }

    pub fn upload(&self, device: &Device, tracer: Tracer) -> Uploaded {
        let storage = BufferUsage::STORAGE;
        let materials: Vec<Material> = self.materials.iter().map(|m| m.0).collect();
        let no_mods: [TcMod; 0] = [];
        let buffers = [
            Buffer::with_data(device, "materials", storage, &materials).expect("buffer"),
            Buffer::with_data(device, "stages", storage, &self.stages).expect("buffer"),
            Buffer::with_data(device, "tc mods", storage, &no_mods).expect("buffer"),
            Buffer::with_data(device, "images", storage, &self.images).expect("buffer"),
        ];
        let vertices =
            Buffer::with_data(device, "vertices", storage, &self.vertices).expect("buffer");
        let materials = Table {
            metal: (self.materials.iter()).any(|gpu| gpu.0.specular.metal > 0.0),
            infos: self.materials.iter().map(|m| m.1).collect(),
            coverages: self.coverages.clone(),
            buffers,
        };
        let lists = self.lists();
        let source = MapLightSource {
            hittable: &vec![self.lights_are_hittable; self.lights.len()],
            ..self.light_source(&lists)
        };
        let scene = StaticScene {
            vertices: &self.vertices,
            vertex_address: vertices.address(),
            mapped_address: 0,
            indices: &self.indices,
            surfaces: self.surfaces.clone(),
            fogs: &self.fogs,
        };
        let mut geometry =
            StaticGeometry::new(device, (tracer, self.grid_cells), &scene, &materials)
                .expect("structures");
        geometry.surroundings =
            Surroundings::of_boxes(device, self.filters.clone()).expect("boxes");
        Uploaded {
            geometry,
            lights: MapLights::new(device, &source).expect("lights"),
            materials,
            _vertices: vertices,
        }
    }
}

pub struct Uploaded {
    pub geometry: StaticGeometry,
    pub(super) lights: MapLights,
    pub materials: Table,
    pub(super) _vertices: Buffer,
}

pub struct Table {
    infos: Vec<MaterialInfo>,
    metal: bool,
    coverages: HashMap<u32, f32>,
    buffers: [Buffer; 4],
}

impl MaterialTable for Table {
    fn info(&self, index: u32) -> (u32, MaterialInfo) {
        (index, self.infos[index as usize])
    }

    fn buffers(&self) -> MaterialBuffers {
        MaterialBuffers {
            materials: self.buffers[0].address(),
            stages: self.buffers[1].address(),
            tc_mods: self.buffers[2].address(),
            images: self.buffers[3].address(),
            noise: 0,
        }
    }

    fn sky_sampler(&self) -> u32 {
        1
    }

    fn has_gloss(&self, frosted: bool) -> bool {
        (self.infos.iter()).any(|info| is_glossy(info.flags, frosted))
    }

    fn has_metal(&self) -> bool {
        self.metal
    }

    fn has_heights(&self) -> bool {
        (self.infos.iter()).any(|info| info.flags & c::MATERIAL_HEIGHTS != 0)
    }

    fn mean_coverage(&self, material: u32) -> Option<f32> {
        self.coverages.get(&material).copied()
    }

    fn generation(&self) -> u64 {
        0
    }
}
