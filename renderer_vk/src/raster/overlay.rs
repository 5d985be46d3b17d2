//! The 2D overlay: pictures in window pixels, drawn in call order through the same draw list.

use glam::{Vec2, Vec3};
use shaders::types::constants as c;
use shaders::types::{Draw, Instance, Vertex};
use shaderscript::eval::{self, DeformContext, DeformVertex};
use support::slice::part;

use super::aids::Aids;
use super::list::{DepthRange, DrawList, faces, stage_depth};
use super::pipelines::{CullFaces, Depth, State};
use super::shading::{Shading, StageContext};
use crate::assets::compile::sampler;
use crate::assets::{Material, RasterPass};

/// Content of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Content {
    Material(u32),
    /// A bindless texture, clamped and without mip levels, times the picture's colour.
    Texture(u32),
    /// A texture at the brightness of white before overbright bits (cinematics).
    Film(u32),
    /// A texture blended by its alpha.
    Transparent(u32),
}

/// A run of pictures with equal content.
#[derive(Clone, Copy, Debug)]
struct Run {
    content: Content,
    first: u32,
    count: u32,
}

/// Pictures queued since the last 3D view.
#[derive(Default)]
pub struct Overlay {
    vertices: Vec<Vertex>,
    runs: Vec<Run>,
}

/// A rectangle in window pixels (y down), with texture coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Picture2d {
    /// Left, top.
    pub position: Vec2,
    /// Width and height; if one is negative, the picture shows its back.
    pub size: Vec2,
    /// Texture coordinates of the upper left corner.
    pub st1: Vec2,
    /// Texture coordinates of the lower right corner.
    pub st2: Vec2,
    /// RGBA, red in the lowest byte.
    pub color: u32,
}

/// Row coordinate of a picture's upper or lower edge. An edge may run through a row of pixel centres, as menus and HUDs
/// designed for 640 × 480 do at many window sizes. In OpenGL, whose rows count from below, such a row belongs to the
/// picture above the edge, in Vulkan to the one below; so the edge is moved down by a part of a pixel.
fn row_edge(y: f32) -> f32 {
    // the rasterizer rounds positions to this grid, pixels
    const STEP: f32 = 1.0 / 256.0;
    let center = y.floor() + 0.5;
    if (y - center).abs() < STEP / 2.0 {
        center + STEP
    } else {
        y
    }
}

impl Overlay {
    /// Whether nothing is queued.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// Empties the queue.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.runs.clear();
    }

    /// Queues a picture with a material.
    pub fn add(&mut self, material: u32, picture: &Picture2d) {
        self.push(Content::Material(material), picture);
    }

    /// Queues a picture with a texture.
    pub fn add_texture(&mut self, texture: u32, picture: &Picture2d) {
        self.push(Content::Texture(texture), picture);
    }

    /// Queues a picture of a film; ignores its colour.
    pub fn add_film(&mut self, texture: u32, picture: &Picture2d) {
        self.push(Content::Film(texture), picture);
    }

    /// Queues a picture with a texture that is blended by its alpha.
    pub fn add_transparent_texture(&mut self, texture: u32, picture: &Picture2d) {
        self.push(Content::Transparent(texture), picture);
    }

    fn push(&mut self, content: Content, p: &Picture2d) {
        let corner = |x: f32, y: f32| Vertex {
            position: Vec3::new(
                p.position.x + p.size.x * x,
                row_edge(p.position.y + p.size.y * y),
                0.0,
            ),
            normal: Vec3::NEG_Z,
            st: p.st1 + (p.st2 - p.st1) * Vec2::new(x, y),
            lightmap: Vec2::ZERO,
            color: p.color,
        };
        match self.runs.last_mut() {
            Some(run) if run.content == content => run.count += 1,
            _ => self.runs.push(Run {
                content,
                first: (self.vertices.len() / 4) as u32,
                count: 1,
            }),
        }
        self.vertices.extend([
            corner(0.0, 0.0),
            corner(1.0, 0.0),
            corner(1.0, 1.0),
            corner(0.0, 1.0),
        ]);
    }

    /// Appends the vertices and indices of a run.
    fn geometry(&self, run: &Run, stages: &StageContext<'_>, time: f32, list: &mut DrawList) {
        let base = list.vertices.len() as u32;
        let first = run.first as usize * 4;
        let vertices = part(&self.vertices, first..first + run.count as usize * 4);
        let quads = (0..run.count * 4).step_by(4);
        let indices = quads.flat_map(|v| [v, v + 1, v + 2, v, v + 2, v + 3]);
        let material = match run.content {
            Content::Material(index) => Some(stages.materials.get(index)),
            Content::Texture(_) | Content::Film(_) | Content::Transparent(_) => None,
        };
        let Some(material) = material.filter(|m| m.deforms()) else {
            list.vertices.extend_from_slice(vertices);
            list.indices.extend(indices.map(|i| base + i));
            return;
        };
        // rare: a menu uses a script written for the world
        let mut deformed: Vec<DeformVertex> = vertices
            .iter()
            .map(|v| DeformVertex {
                position: v.position,
                normal: Vec3::ZERO,
                st: v.st,
                color: v.color.to_le_bytes(),
            })
            .collect();
        let mut indices: Vec<u32> = indices.collect();
        let time = f64::from(time - material.time_offset);
        let clamp = material.shader.clamp_time.map_or(f64::INFINITY, f64::from);
        let context = DeformContext {
            time: time.min(clamp),
            frame_time: time,
            ..DeformContext::default()
        };
        eval::deform(
            &material.shader.deforms,
            &mut deformed,
            &mut indices,
            &context,
        );
        list.vertices.extend(deformed.iter().map(|v| Vertex {
            position: v.position,
            normal: v.normal,
            st: v.st,
            lightmap: Vec2::ZERO,
            color: u32::from_le_bytes(v.color),
        }));
        list.indices.extend(indices.iter().map(|i| base + i));
    }

    /// Turns the queued pictures into draw calls. `instance`: index of [`overlay_instance`].
    pub fn draw(
        &self,
        list: &mut DrawList,
        stages: StageContext<'_>,
        instance: &Instance,
        aids: Aids,
    ) {
        list.clear();
        for run in &self.runs {
            let first_index = list.indices.len() as u32;
            self.geometry(run, &stages, instance.time, list);
            let span = (first_index, list.indices.len() as u32 - first_index);
            let draw = Draw {
                dynamic_vertices: 1,
                ..Draw::default()
            };
            let mut push = |state: State, draw: Draw| {
                let call = list.call(state, DepthRange::Normal, span, draw);
                list.calls.push(call);
            };
            match run.content {
                Content::Texture(texture) => {
                    let (shading, draw) = stages.image(texture, sampler::CLAMP, draw);
                    push(State { shading, ..PLAIN }, draw);
                }
                Content::Film(texture) => {
                    let (shading, draw) = stages.plain_image(texture, sampler::CLAMP, draw);
                    push(State { shading, ..PLAIN }, draw);
                }
                Content::Transparent(texture) => {
                    let (shading, draw) = stages.image(texture, sampler::CLAMP, draw);
                    let blend = Some((c::BLEND_SRC_ALPHA, c::BLEND_ONE_MINUS_SRC_ALPHA));
                    let state = State {
                        blend,
                        shading,
                        ..PLAIN
                    };
                    push(state, draw);
                }
                Content::Material(index) => {
                    let material = stages.materials.get(index);
                    if aids.leaves_out(material.sort) {
                        continue;
                    }
                    for pass in &material.passes {
                        let (state, draw) = material_pass(material, pass, &stages, instance, draw);
                        push(state, draw);
                    }
                }
            }
            if aids.edges {
                list.push_edges(span, draw, CullFaces::None);
            }
        }
    }
}

/// State of an opaque picture.
pub(super) const PLAIN: State = State {
    blend: None,
    depth: Depth::Always,
    depth_write: false,
    cull: CullFaces::None,
    offset: false,
    wireframe: false,
    shading: Shading::WHITE,
};

/// State of a pass of a material's picture.
fn material_pass(
    material: &Material,
    pass: &RasterPass,
    stages: &StageContext<'_>,
    instance: &Instance,
    draw: Draw,
) -> (State, Draw) {
    let (shading, draw) = stages.passes(
        material,
        std::slice::from_ref(pass),
        instance,
        c::NO_TEXTURE,
        c::FOG_ADJUST_NONE,
        draw,
    );
    let state = State {
        cull: faces(material.cull, false),
        offset: material.polygon_offset,
        blend: pass.blend,
        depth: stage_depth(pass),
        depth_write: pass.depth_write && pass.depth_test,
        shading,
        ..PLAIN
    };
    (state, draw)
}

/// The instance of the overlay: no transform, shader time in seconds. Like the engine's entity for pictures, it has
/// neither colour nor light.
pub fn overlay_instance(time: f32) -> Instance {
    Instance {
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        viewer: Vec3::new(0.0, 0.0, -1.0),
        color: [0.0; 4],
        time,
        flags: c::INSTANCE_UNLIT,
        ..Instance::default()
    }
}
