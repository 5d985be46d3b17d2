//! Scenes made by hand, and what renders them.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use relight::light::{EmissionSource, LightLists, PointLight, SunLight, TriangleLight};
use shaders::trace_types::SkyRecord;
use shaders::types::constants as c;
use shaders::types::{Fog, Instance, Material, MaterialBuffers, Stage, TcMod, Vertex};

use crate::api::{DynamicLight, EntityKind, RefDef};
use crate::gpu::{
    Buffer, BufferUsage, Device, DeviceOptions, Filter, Format, FrameRing, Image, ImageDesc,
    ImageUsage, MipFilter, SamplerDesc, SurfaceSource, Wrap,
};
use crate::raster::FlareTest;
use crate::scene::{
    DynamicMesh, Portal, RigidMesh, ShadowVolumes, Shape, Submodel, View, ViewEntity, ViewScene,
};
use crate::settings::Settings;
use crate::trace::geometry::StaticGeometry;
use crate::trace::input::{MaterialInfo, MaterialTable, StaticScene, StaticSurface, Tracer};
use crate::trace::lights::{MapLightSource, MapLights};
use crate::trace::surroundings::Surroundings;
use crate::trace::view_tracer::{TracedMap, ViewTracer};

/// A device with its validation layer on and the look under test.
pub struct Gpu {
    pub device: Device,
    pub tracer: Tracer,
    pub look: ViewTracer,
    pub ring: FrameRing,
}

impl Gpu {
    /// Runs a test with every tracer that the device has.
    pub fn each(test: fn(&mut Gpu)) {
        for tracer in [Tracer::Pipeline, Tracer::Query, Tracer::Compute] {
            if let Some(mut gpu) = Self::new(tracer) {
                println!("{tracer:?}");
                test(&mut gpu);
            }
        }
    }

    /// `None`, with a printed line, where there is no device for the tracer.
    pub fn new(tracer: Tracer) -> Option<Self> {
        let options = DeviceOptions {
            validation: true,
            // without the tracer's extensions, so that it is shown to need none
            allow_ray_tracing: tracer != Tracer::Compute,
            ..DeviceOptions::default()
        };
        let device = match Device::new(&options, SurfaceSource::Headless) {
            Ok(device) if tracer.is_possible(device.info()) => device,
            other => {
                let name = |d: Device| format!("{} does not trace rays", d.info().name);
                let why = other.map_or_else(|e| e.to_string(), name);
                let required = std::env::var("RELIGHT_REQUIRE_GPU").as_deref() == Ok("1");
                assert!(!required, "{why}");
                println!("skipped: {why}");
                return None;
            }
        };
        for wrap in [Wrap::Repeat, Wrap::Clamp] {
            device
                .sampler(&SamplerDesc {
                    filter: Filter::Linear,
                    mip: MipFilter::Linear,
                    wrap,
                    anisotropy: 1.0,
                    lod_bias: 0.0,
                })
                .expect("sampler");
        }
        Some(Self {
            look: ViewTracer::new(&device, tracer).expect("pipelines"),
            tracer,
            ring: FrameRing::new(&device, 2).expect("frames"),
            device,
        })
    }

    /// Counts rays in what is rendered from now on, or no longer.
    pub fn count_rays(&mut self, count: bool) {
        self.look.count_rays = count;
    }

    /// Rays of each counted pass in the newest finished frame.
    pub fn rays(&self) -> Option<[u64; 3]> {
        self.look.rays()
    }

    /// The mean of `frames` frames before exposure, and the last picture.
    pub fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
    ) -> (Vec<Vec3>, Vec<[u8; 4]>) {
        self.render_path(scene, settings, frames, |_, _| {})
    }

    /// As [`render`](Self::render), with a camera that `place` moves before each frame.
    pub fn render_path(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
        place: impl Fn(u32, &mut RefDef),
    ) -> (Vec<Vec3>, Vec<[u8; 4]>) {
        self.render_views(scene, settings, frames, |frame, view| {
            place(frame, &mut view.def);
        })
    }

    /// As [`render`](Self::render), with a view that `change` changes before each frame.
    pub fn render_views(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
        change: impl Fn(u32, &mut ViewScene),
    ) -> (Vec<Vec3>, Vec<[u8; 4]>) {
        self.render_watched(scene, settings, frames, change, None)
    }

    /// As [`render_views`](Self::render_views), and hands the picture before exposure to `watch` after each frame.
    #[allow(clippy::type_complexity)] // of an optional closure
    pub fn render_watched(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
        change: impl Fn(u32, &mut ViewScene),
        mut watch: Option<&mut dyn FnMut(u32, &[Vec3])>,
    ) -> (Vec<Vec3>, Vec<[u8; 4]>) {
        let uploaded = scene.upload(&self.device, self.tracer);
        let [width, height] = [scene.def.width as u32, scene.def.height as u32];
        let usage = ImageUsage::STORAGE | ImageUsage::COLOR;
        let target = Image::new(
            &self.device,
            &ImageDesc::new("test target", width, height, Format::Rgba8, usage),
        )
        .expect("target");
        let mut view = scene.view();
        for frame in 0..frames {
            change(frame, &mut view);
            view.view = View::new(&view.def, 4.0, 10000.0);
            let mut rec = self.ring.begin().expect("frame");
            let map = TracedMap {
                geometry: &uploaded.geometry,
                lights: &uploaded.lights,
                flares: FlareTest::default(),
            };
            self.look
                .record_view(
                    &mut rec,
                    &view,
                    Some(map),
                    &uploaded.materials,
                    settings,
                    &target,
                )
                .expect("recorded");
            self.ring.end(rec).expect("submitted");
            if let Some(watch) = &mut watch {
                self.device.wait_idle().expect("done");
                watch(frame, &self.linear_picture());
            }
        }
        self.device.wait_idle().expect("done");
        if settings.rt_accumulate {
            assert_eq!(
                self.look.accumulated_frames(),
                frames,
                "nothing changed between the frames"
            );
        }
        let linear = self.linear_picture();
        let picture: Vec<[u8; 4]> =
            bytemuck::pod_collect_to_vec(&self.device.read_image(&target).expect("read"));
        self.check_messages();
        self.look.reset();
        (linear, picture)
    }

    /// The picture of the last frame before exposure.
    fn linear_picture(&self) -> Vec<Vec3> {
        let hdr = self.look.hdr().expect("traced");
        let bytes = self.device.read_image(hdr).expect("read");
        let floats: Vec<f32> = if hdr.format() == Format::Rgba32F {
            bytemuck::pod_collect_to_vec(&bytes)
        } else {
            bytemuck::pod_collect_to_vec::<u8, u16>(&bytes)
                .into_iter()
                .map(half)
                .collect()
        };
        floats
            .chunks_exact(4)
            .map(|p| Vec3::new(p[0], p[1], p[2]))
            .collect()
    }

    /// Whether the denoiser looks at gradients; it does unless told otherwise.
    pub fn use_gradients(&mut self, on: bool) {
        self.look.denoiser.gradients = on;
    }

    /// Position and path of each pixel of the last frame, and its motion as the motion image has it.
    pub fn motion(&self) -> Vec<([f32; 4], [f32; 4])> {
        let targets = self.look.targets.as_ref().expect("traced");
        let read = |image| self.device.read_image(image).expect("read");
        let places: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&read(&targets.position));
        let halves: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&read(&targets.motion));
        let motions = halves.iter().map(|m| m.map(half));
        places.into_iter().zip(motions).collect()
    }

    /// The validation layer has nothing to say.
    pub fn check_messages(&self) {
        let messages = self.device.validation_messages();
        let short: Vec<String> = messages
            .iter()
            .map(|m| m.chars().take(600).collect())
            .collect();
        assert!(messages.is_empty(), "{short:#?}");
    }

    /// The mean over the picture of the mean of `frames` frames.
    pub fn mean(&mut self, scene: &Scene, settings: &Settings, frames: u32) -> Vec3 {
        let (pixels, _) = self.render(scene, settings, frames);
        pixels.iter().sum::<Vec3>() / pixels.len() as f32
    }
}

/// The value of a half float.
fn half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 != 0 { -1.0 } else { 1.0 };
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f32::from(bits & 0x3ff));
    sign * match exponent {
        0 => mantissa * 2f32.powi(-24),
        31 => f32::INFINITY,
        _ => (1.0 + mantissa / 1024.0) * 2f32.powi(exponent - 15),
    }
}

/// Settings of a reference picture without bounced light.
pub fn reference() -> Settings {
    Settings {
        rt: true,
        rt_accumulate: true,
        rt_bounces: 0,
        rt_auto_exposure: false,
        rt_bloom: 0.0,
        ..Settings::default()
    }
}

/// sRGB code of a linear value.
pub fn encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// What the shaders make of a constant colour: it passes through a byte.
pub fn through_byte(encoded: f32) -> f32 {
    let byte = (encoded * 255.0 + 0.001).floor() / 255.0;
    crate::trace::frame_lights::decode(Vec3::splat(byte)).x
}

/// Stages.
pub mod stage {
    use super::*;

    fn plain() -> Stage {
        Stage {
            rgb_gen: c::RGBGEN_IDENTITY,
            alpha_gen: c::ALPHAGEN_IDENTITY,
            constant: [1.0; 4],
            blend_src: c::BLEND_ONE,
            blend_dst: c::BLEND_ZERO,
            flags: c::STAGE_WHITE,
            ..Stage::default()
        }
    }

    /// The lightmap: light itself.
    pub fn light() -> Stage {
        Stage {
            flags: 0,
            ..plain()
        }
    }

    /// White times a constant colour (encoded).
    pub fn constant(color: [f32; 3]) -> Stage {
        Stage {
            rgb_gen: c::RGBGEN_CONST,
            constant: [color[0], color[1], color[2], 1.0],
            ..plain()
        }
    }

    /// Multiplies what is below by a constant colour (encoded).
    pub fn filter(color: [f32; 3]) -> Stage {
        Stage {
            blend_src: c::BLEND_DST_COLOR,
            blend_dst: c::BLEND_ZERO,
            ..constant(color)
        }
    }

    /// A constant colour (encoded) laid over what is below with some alpha.
    pub fn blend(color: [f32; 3], alpha: f32) -> Stage {
        Stage {
            alpha_gen: c::ALPHAGEN_CONST,
            constant: [color[0], color[1], color[2], alpha],
            blend_src: c::BLEND_SRC_ALPHA,
            blend_dst: c::BLEND_ONE_MINUS_SRC_ALPHA,
            ..constant(color)
        }
    }

    /// A constant colour (encoded) added to what is below.
    pub fn add(color: [f32; 3]) -> Stage {
        Stage {
            blend_src: c::BLEND_ONE,
            blend_dst: c::BLEND_ONE,
            ..constant(color)
        }
    }

    /// An image of the scene, by its bindless index.
    pub fn image(first: u32) -> Stage {
        Stage {
            image_first: first,
            image_count: 1,
            flags: c::STAGE_DEPTH_WRITE,
            ..plain()
        }
    }
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

/// A scene made by hand.
pub struct Scene {
    pub materials: Vec<(Material, MaterialInfo)>,
    pub stages: Vec<Stage>,
    pub images: Vec<u32>,
    pub vertices: Vec<Vertex>,
    pub indices: Vec<u32>,
    pub surfaces: Vec<StaticSurface>,
    pub lights: Vec<TriangleLight>,
    pub points: Vec<PointLight>,
    pub suns: Vec<SunLight>,
    pub ambient: Vec3,
    pub fogs: Vec<Fog>,
    /// Boxes around what colours light.
    pub filters: Vec<[Vec3; 2]>,
    pub instances: Vec<Instance>,
    pub dynamic_vertices: Vec<Vertex>,
    pub dynamic_indices: Vec<u32>,
    pub meshes: Vec<DynamicMesh>,
    pub rigid: Vec<Arc<RigidMesh>>,
    pub submodels: Vec<Submodel>,
    pub entities: Vec<ViewEntity>,
    pub portals: Vec<Portal>,
    pub dlights: Vec<DynamicLight>,
    /// The map's tree with lists of its own; otherwise all lights are everywhere.
    pub tree: Option<(q3bsp::Bsp, LightLists)>,
    pub def: RefDef,
}

/// An entity in place.
pub fn identity() -> Instance {
    Instance {
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        color: [1.0; 4],
        ..Instance::default()
    }
}

impl Scene {
    /// Nothing but a camera: at `eye`, looking at `target`, `fov` degrees wide, square.
    pub fn new(eye: Vec3, target: Vec3, fov: f32, size: i32) -> Self {
        let forward = (target - eye).normalize();
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
            points: Vec::new(),
            suns: Vec::new(),
            ambient: Vec3::ZERO,
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
            def: RefDef {
                width: size,
                height: size,
                fov_x: fov,
                fov_y: fov,
                view_origin: eye,
                view_axis: [forward, aside, forward.cross(aside)],
                ..RefDef::default()
            },
        }
    }

    pub fn material(&mut self, stages: &[Stage], flags: u32) -> u32 {
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

    /// A rectangle that moves.
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
        });
    }

    /// A triangle that shines to the side from which a, b, c go round counter-clockwise.
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

    pub fn view(&self) -> ViewScene {
        ViewScene {
            def: self.def,
            view: View::new(&self.def, 4.0, 10000.0),
            time: self.def.time_ms as f32 * 0.001,
            instances: self.instances.clone(),
            vertices: self.dynamic_vertices.clone(),
            indices: self.dynamic_indices.clone(),
            meshes: self.meshes.clone(),
            rigid: self.rigid.clone(),
            submodels: self.submodels.clone(),
            entities: self.entities.clone(),
            surfaces: Vec::new(),
            dlights: self.dlights.clone(),
            portals: self.portals.clone(),
            has_world: true,
            skies: Vec::new(),
            shadows: ShadowVolumes::default(),
            debug: Default::default(),
            statistics: Default::default(),
            sun: None,
            flares: Vec::new(),
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
            infos: self.materials.iter().map(|m| m.1).collect(),
            buffers,
        };
        let all: Vec<u32> = (0..(self.lights.len() + self.points.len()) as u32).collect();
        let lists = LightLists {
            offsets: vec![0, all.len() as u32],
            lights: all,
            triangle_lights: self.lights.len() as u32,
            sky: Vec::new(),
            shares: Vec::new(),
        };
        let source = MapLightSource {
            triangles: &self.lights,
            points: &self.points,
            suns: &self.suns,
            lists: self.tree.as_ref().map_or(&lists, |t| &t.1),
            flickers: &[],
            model_origins: &[],
            ambient: self.ambient,
            bsp: self.tree.as_ref().map(|t| &t.0),
        };
        let scene = StaticScene {
            vertices: &self.vertices,
            vertex_address: vertices.address(),
            indices: &self.indices,
            surfaces: self.surfaces.clone(),
            fogs: &self.fogs,
        };
        let mut geometry =
            StaticGeometry::new(device, tracer, &scene, &materials).expect("structures");
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
    lights: MapLights,
    pub materials: Table,
    _vertices: Buffer,
}

pub struct Table {
    infos: Vec<MaterialInfo>,
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

    fn generation(&self) -> u64 {
        0
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
pub fn floor_point(scene: &Scene, x: usize, y: usize) -> Vec3 {
    let def = &scene.def;
    let tan = (def.fov_x.to_radians() * 0.5).tan();
    let u = (x as f32 + 0.5) / def.width as f32 * 2.0 - 1.0;
    let v = (y as f32 + 0.5) / def.height as f32 * 2.0 - 1.0;
    let d = def.view_axis[0] - def.view_axis[1] * (u * tan) - def.view_axis[2] * (v * tan);
    def.view_origin + d * (-def.view_origin.z / d.z)
}

/// The plane through a point, as `xyz.p = w`.
pub fn plane(normal: Vec3, point: Vec3) -> Vec4 {
    normal.extend(normal.dot(point))
}
