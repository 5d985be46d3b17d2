//! Converts a relit map to drawable data: finds materials, makes lightmaps, and adds the levels of detail of curves.

use glam::Vec3;
use q3bsp::{PatchMesh, SurfaceKind, lightmap_index};
use relight::RelitWorld;
use relight::image::Image;
use shaders::types::{
    self, Vertex,
    constants::{self as c, NO_TEXTURE},
};
use support::Aabb;

use super::patch_lod::PatchLod;
use super::visible::Tree;
use super::{BrushModel, ClassicCopy, WorldData, WorldSurface};
use crate::assets::{ImageSource, LightmapClass, Materials, Textures, prepare};
use crate::gpu;
use crate::settings::Settings;

/// Direction towards the sun until a material defines one, as in the engine.
const DEFAULT_SUN: Vec3 = Vec3::new(0.45, 0.3, 0.9);

/// Settings that loading a map depends on.
#[derive(Clone, Debug)]
pub struct WorldOptions {
    /// Largest distance of a curve from its mesh, units.
    pub subdivisions: f32,
    /// Left shift of stored light.
    pub overbright_shift: u32,
    /// Desaturation of lightmaps and vertex colours, 0..1.
    pub greyscale: f32,
    /// Lightmaps are treated as white.
    pub fullbright: bool,
    /// Light comes from vertices instead of lightmaps.
    pub vertex_light: bool,
    /// All surfaces but skies have the default material.
    pub single_shader: bool,
    /// Lightmaps show their brightness as colour.
    pub lightmap_heat: bool,
}

impl WorldOptions {
    /// The options that these settings select.
    pub fn new(settings: &Settings) -> Self {
        let display = settings.effective_overbright_bits();
        Self {
            subdivisions: settings.subdivisions,
            overbright_shift: settings.map_overbright_bits.saturating_sub(display),
            greyscale: settings.greyscale.clamp(0.0, 1.0),
            fullbright: settings.fullbright,
            vertex_light: settings.vertex_light,
            single_shader: settings.single_shader,
            lightmap_heat: settings.lightmap == 2,
        }
    }

    /// Options for `relight`. Lights are not calibrated at load: only the traced look needs calibration, see
    /// [`World::light_by`](super::World::light_by).
    pub fn relight(&self) -> relight::Options<'static> {
        relight::Options {
            subdivisions: self.subdivisions,
            overbright_shift: self.overbright_shift,
            calibrate: None,
            by_hand: false,
            ..relight::Options::default()
        }
    }
}

/// Receiver of lightmap pages. [`Textures`] uploads them to the GPU.
pub trait LightmapSink: ImageSource {
    /// Bindless index of a page.
    fn lightmap(&mut self, name: &str, page: &Image) -> Result<u32, gpu::Error>;
}

impl LightmapSink for Textures {
    fn lightmap(&mut self, name: &str, page: &Image) -> Result<u32, gpu::Error> {
        self.create_lightmap(name, page)
    }
}

fn class_of(lightmap: i32, options: &WorldOptions) -> LightmapClass {
    match lightmap {
        // in this order: in the engine full brightness has precedence over vertex light
        _ if options.fullbright => LightmapClass::White,
        _ if options.vertex_light => LightmapClass::Vertex,
        0.. => LightmapClass::Page,
        lightmap_index::NONE => LightmapClass::None,
        lightmap_index::WHITE => LightmapClass::White,
        lightmap_index::TWO_D => LightmapClass::TwoD,
        _ => LightmapClass::Vertex,
    }
}

impl WorldData {
    /// Finds materials and makes lightmaps for a relit map. A device failure is stored in `failure`, and the surfaces
    /// have no lightmap.
    pub fn new<S: LightmapSink>(
        relit: RelitWorld,
        materials: &mut Materials,
        source: &mut S,
        options: &WorldOptions,
        failure: &mut Option<gpu::Error>,
    ) -> Self {
        materials.forget_sun();
        let lightmaps = make_lightmaps(&relit, source, options, failure);
        // before those of surfaces, as the engine: of equal sort values, the material found first is drawn first
        let fog_materials = relit
            .fogs
            .iter()
            .map(|fog| materials.find(source, &fog.volume.shader, LightmapClass::None, true))
            .collect();
        let mut indices = relit.indices.clone();
        let patches = relit.bsp.patch_meshes(options.subdivisions);
        let mut surfaces = find_surfaces(
            &relit,
            &lightmaps,
            &patches,
            &mut indices,
            materials,
            source,
            options,
        );
        if relit.page(0).is_none() {
            materials.light_unlit(surfaces.iter().map(|surface| surface.material));
        }
        let mut vertices: Vec<Vertex> = relit.vertices.iter().map(|v| vertex(v, options)).collect();
        for (index, surface) in surfaces.iter_mut().enumerate() {
            if materials.get(surface.material).uses_normals() {
                surface.classic =
                    copy_for_classic(&relit, index, surface, &mut vertices, &mut indices);
            }
        }
        for fog in &relit.fogs {
            materials.leave_to_fog(&fog.volume.shader);
        }
        remap_by_map(&relit, materials, source, options);
        let drawn = (0u32..).zip(&surfaces).filter(|(_, s)| s.index_count > 0);
        let is_deformed = |s: &WorldSurface| s.deformed && s.model == 0;
        let is_portal =
            |s: &WorldSurface| materials.get(s.material).sort <= shaderscript::sort::PORTAL;
        Self {
            vertices,
            indices,
            models: brush_models(&relit),
            fogs: fogs(&relit, &surfaces, materials),
            fog_materials,
            grid: relit.bsp.light_grid(),
            grid_points: super::grid::shifted_points(&relit.bsp, options.overbright_shift),
            tree: Tree::new(&relit.bsp),
            sun_direction: materials
                .last_sun()
                .unwrap_or_else(|| DEFAULT_SUN.normalize()),
            deformed_surfaces: (drawn.clone())
                .filter(|(_, s)| is_deformed(s))
                .map(|(index, _)| index)
                .collect(),
            portal_surfaces: drawn
                .filter(|(_, s)| is_portal(s))
                .map(|(index, _)| index)
                .collect(),
            surfaces,
            relit,
        }
    }
}

/// Geometry of a relit map that stops light, without lightmaps and levels of detail.
pub struct Occluding {
    /// Vertices of the relit map.
    pub vertices: Vec<Vertex>,
    /// The map's surfaces, with their materials.
    pub surfaces: Vec<WorldSurface>,
}

impl Occluding {
    /// Finds the materials of a map.
    pub fn new<S: LightmapSink>(
        relit: &RelitWorld,
        materials: &mut Materials,
        source: &mut S,
        options: &WorldOptions,
    ) -> Self {
        let mut none = Vec::new();
        let surfaces = find_surfaces(relit, &[], &[], &mut none, materials, source, options);
        remap_by_map(relit, materials, source, options);
        Self {
            vertices: relit.vertices.iter().map(|v| vertex(v, options)).collect(),
            surfaces,
        }
    }
}

/// The surfaces with materials, lightmaps and levels of detail. Appends the indices of coarser levels.
fn find_surfaces<S: LightmapSink>(
    relit: &RelitWorld,
    lightmaps: &[u32],
    patches: &[Option<PatchMesh>],
    indices: &mut Vec<u32>,
    materials: &mut Materials,
    source: &mut S,
    options: &WorldOptions,
) -> Vec<WorldSurface> {
    let mut surfaces = Vec::with_capacity(relit.surfaces.len());
    for (index, stored) in relit.surfaces.iter().enumerate() {
        let material = relit.materials.get(stored.material as usize);
        let name = material.map_or("", |m| m.name.as_str());
        let class = class_of(stored.lightmap, options);
        let found = materials.find_or_default(source, name, class);
        let found = if options.single_shader && !materials.get(found).is_sky() {
            0
        } else {
            found
        };
        materials.note_lightmap_page(found, stored.lightmap);
        mark_emitter(relit, stored, found, materials);
        let lod = patches
            .get(index)
            .and_then(Option::as_ref)
            .filter(|_| stored.num_indices > 0)
            .map(|mesh| PatchLod::new(mesh, stored, indices));
        let registered = materials.get(found);
        let lightmap = usize::try_from(stored.lightmap)
            .ok()
            .filter(|_| class == LightmapClass::Page)
            .and_then(|page| lightmaps.get(page).copied())
            .unwrap_or(NO_TEXTURE);
        surfaces.push(WorldSurface {
            first_index: stored.first_index,
            index_count: stored.num_indices,
            first_vertex: stored.first_vertex,
            vertex_count: stored.num_vertices,
            material: found,
            fog: stored.fog,
            lightmap,
            bounds: Aabb::new(stored.mins, stored.maxs),
            plane: stored.plane,
            flat: is_flat(relit, stored),
            kind: stored.kind,
            model: stored.model,
            deformed: registered.deforms(),
            sky: registered.is_sky(),
            lod,
            classic: None,
        });
    }
    surfaces
}

/// Passes a surface's light to its material.
pub(super) fn mark_emitter(
    relit: &RelitWorld,
    surface: &relight::world::WorldSurface,
    material: u32,
    materials: &mut Materials,
) {
    let stored = relit.materials.get(surface.material as usize);
    if surface.num_indices == 0 || stored.is_none_or(|m| m.emission.is_none()) {
        return;
    }
    // surfaces that emit no light by the calibration have none
    let light = relit
        .lights
        .get(surface.first_light as usize)
        .filter(|_| surface.num_lights > 0);
    // the stages of glowing surfaces and skies show the light themselves
    let hidden = light.filter(|l| l.source == relight::light::EmissionSource::SurfaceLight);
    materials.set_emitter(material, hidden.map_or(Vec3::ZERO, |l| l.radiance));
}

/// Whether every triangle of a surface lies in its plane, within a unit, and faces along the plane's normal.
fn is_flat(relit: &RelitWorld, surface: &relight::world::WorldSurface) -> bool {
    let Some(plane) = surface.plane else {
        return false;
    };
    surface
        .triangles()
        .map(|triangle| relit.triangle(triangle))
        .all(|[a, b, c]| {
            let front = (c - a).cross(b - a);
            // degenerate triangles have no direction
            let faces = front.dot(plane.normal) >= 0.99 * front.length();
            let sliver = front.length_squared() < 1e-3;
            (faces || sliver) && [a, b, c].iter().all(|p| plane.distance(*p).abs() <= 1.0)
        })
}

/// Appends a copy of a planar surface with the normal that the map stores for it, if its vertices have other normals.
fn copy_for_classic(
    relit: &RelitWorld,
    index: usize,
    surface: &WorldSurface,
    vertices: &mut Vec<Vertex>,
    indices: &mut Vec<u32>,
) -> Option<ClassicCopy> {
    if surface.kind != SurfaceKind::Planar {
        return None;
    }
    let stored = relit.bsp.surfaces.get(index)?.lightmap_vecs[2];
    let first = surface.first_vertex as usize;
    let own = vertices.get(first..first + surface.vertex_count as usize)?;
    let same = |v: &Vertex| v.normal.abs_diff_eq(stored, 1e-3);
    if !stored.is_finite() || own.iter().all(same) {
        return None;
    }
    let own = own.to_vec();
    let list = surface.first_index as usize..;
    let list = indices
        .get(list)?
        .get(..surface.index_count as usize)?
        .to_vec();
    let copy = ClassicCopy {
        first_vertex: u32::try_from(vertices.len()).ok()?,
        first_index: u32::try_from(indices.len()).ok()?,
    };
    vertices.extend(own.into_iter().map(|v| Vertex {
        normal: stored,
        ..v
    }));
    let moved = |i: u32| {
        i.wrapping_sub(surface.first_vertex)
            .wrapping_add(copy.first_vertex)
    };
    indices.extend(list.into_iter().map(moved));
    Some(copy)
}

fn make_lightmaps<S: LightmapSink>(
    relit: &RelitWorld,
    source: &mut S,
    options: &WorldOptions,
    failure: &mut Option<gpu::Error>,
) -> Vec<u32> {
    if options.vertex_light || options.fullbright {
        return Vec::new();
    }
    let side = u32::try_from(relit.bsp.lightmap_size()).unwrap_or(128);
    let mut brightest = 0.0f32;
    let pages = (0..relit.bsp.lightmaps.len())
        .map(|page| {
            let picture = if options.lightmap_heat {
                heat_page(relit, page, side, &mut brightest)
            } else {
                relit
                    .lightmap(page)
                    .and_then(|rgb| prepare::light_page(&rgb, side, 0, options.greyscale))
            };
            let Some(picture) = picture else {
                return NO_TEXTURE;
            };
            match source.lightmap(&format!("*lightmap{page}"), &picture) {
                Ok(index) => index,
                Err(problem) => {
                    failure.get_or_insert(problem);
                    NO_TEXTURE
                }
            }
        })
        .collect();
    if options.lightmap_heat {
        log::info!("Brightest lightmap value: {}", (brightest * 255.0) as i32);
    }
    pages
}

/// A lightmap page that shows its stored brightness as colour; raises `brightest`.
fn heat_page(relit: &RelitWorld, page: usize, side: u32, brightest: &mut f32) -> Option<Image> {
    let stored = relit.bsp.lightmaps.get(page)?;
    let (picture, most) = prepare::heat_page(&stored.0, side)?;
    *brightest = brightest.max(most);
    Some(picture)
}

fn vertex(v: &relight::world::WorldVertex, options: &WorldOptions) -> Vertex {
    let mut color = v.color;
    if options.greyscale > 0.0 {
        prepare::desaturate(&mut color, options.greyscale);
    }
    Vertex {
        position: v.position,
        normal: v.normal,
        st: v.st,
        lightmap: v.lightmap,
        color: u32::from_le_bytes(color),
    }
}

/// The fog volumes. A drawn, two-sided surface of a volume also covers the view from inside.
fn fogs(relit: &RelitWorld, surfaces: &[WorldSurface], materials: &Materials) -> Vec<types::Fog> {
    let mut fogs: Vec<_> = relit.fogs.iter().map(fog).collect();
    let veil = c::MATERIAL_FOG | c::MATERIAL_TWO_SIDED;
    for surface in surfaces {
        let volume = (surface.fog as usize).checked_sub(1);
        let Some(fog) = volume.and_then(|volume| fogs.get_mut(volume)) else {
            // A surface outside of fog.
            continue;
        };
        if fog.has_surface != 0 && materials.get(surface.material).flags & veil == veil {
            fog.has_surface = c::FOG_SURFACE_DRAWN;
        }
    }
    fogs
}

fn fog(fog: &relight::world::WorldFog) -> types::Fog {
    let surface = fog.volume.surface;
    types::Fog {
        mins: fog.volume.mins,
        maxs: fog.volume.maxs,
        plane: surface.map_or([0.0; 4], |p| [p.normal.x, p.normal.y, p.normal.z, p.dist]),
        has_surface: u32::from(surface.is_some()),
        color: fog.color,
        depth: fog.depth,
        own_light: Vec3::ZERO,
    }
}

fn brush_models(relit: &RelitWorld) -> Vec<BrushModel> {
    relit
        .models
        .iter()
        .zip(&relit.bsp.models)
        .map(|(model, stored)| BrushModel {
            first_surface: model.first_surface,
            num_surfaces: model.num_surfaces,
            bounds: Aabb::new(stored.mins, stored.maxs),
        })
        .collect()
}

/// The map's own remapping: worldspawn keys `remapshader...` with values `old;new`.
fn remap_by_map<S: LightmapSink>(
    relit: &RelitWorld,
    materials: &mut Materials,
    source: &mut S,
    options: &WorldOptions,
) {
    let entities = relit.bsp.entities();
    let Some(world) = entities.first() else {
        // A map without entities.
        return;
    };
    let starts = |key: &str, prefix: &str| {
        key.get(..prefix.len())
            .is_some_and(|start| start.eq_ignore_ascii_case(prefix))
    };
    for (key, value) in &world.pairs {
        let applies = starts(key, "remapshader")
            || (options.vertex_light && starts(key, "vertexremapshader"));
        if let Some((old, new)) = value.split_once(';').filter(|_| applies) {
            materials.remap(source, old, new, None);
        }
    }
}
