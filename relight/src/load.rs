//! Loads a map's bytes into a [`RelitWorld`].

#[cfg(test)]
mod tests;

use crate::calibrate::{CalibrationOptions, calibrate};
use crate::exposure::{Texture, display_exponent};
use crate::external_lightmaps::external_lightmaps;
use crate::files::{FileError, GameFiles};
use crate::image;
use crate::light::{self, LightColor, LightReport, TriangleLight};
use crate::materials::Materials;
use crate::materials::by_hand::MaterialsByHand;
use crate::overbright::{self, MAP_OVERBRIGHT_BITS};
use crate::world::geometry::Geometry;
use crate::world::material::{lighting_of, lightmap_of};
use crate::world::pages::PageLoader;
use crate::world::{Flare, NO_LIGHT, RelitWorld, WorldMaterial, WorldModel, WorldSurface, fog};
use glam::{Vec3, Vec4};
use q3bsp::{Bsp, Entity, SurfaceKind};
use std::collections::{BTreeSet, HashMap};
use support::slice;

/// Reason why a map could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The map's file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// There is no such map.
    #[error("{map}: no such file in the game folders")]
    Absent {
        /// The requested game path.
        map: String,
    },
    /// The file is not a map, or a damaged one.
    #[error("{map}: {source}")]
    Map {
        /// Game path of the map.
        map: String,
        /// Lump, element and value that are wrong.
        source: q3bsp::Error,
    },
}

/// Stage of loading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Reading and checking the map.
    Map,
    /// Looking materials up.
    Materials,
    /// Building vertices and triangles, patches among them.
    Geometry,
    /// Finding what emits.
    Lights,
    /// Listing lights per cluster.
    LightLists,
    /// Fitting lights to the lightmaps.
    Calibration,
    /// Done.
    Done,
}

/// Called as each stage begins.
pub type Progress<'a> = &'a mut dyn FnMut(Stage);

/// Options of loading.
pub struct Options<'a> {
    /// Largest distance of a curve from its mesh, id units (`r_subdivisions`).
    pub subdivisions: f32,
    /// Left shift of lightmaps and vertex colours: `r_mapOverBrightBits` less what the display adds.
    pub overbright_shift: u32,
    /// Which colours stored light and directives mean.
    pub light_color: LightColor,
    /// How lights are fitted to the map's lightmaps; `None` leaves them as directives say.
    pub calibrate: Option<CalibrationOptions>,
    /// Whether the file of lights beside the map, if there is one, changes them at the end; see
    /// [`LightsByHand`](crate::light::LightsByHand).
    pub by_hand: bool,
    /// Receives progress.
    pub progress: Option<Progress<'a>>,
}

impl Default for Options<'_> {
    /// The engine's defaults in a window: subdivisions 4, shift 2; calibrated, nothing kept.
    fn default() -> Self {
        Options {
            subdivisions: 4.0,
            overbright_shift: MAP_OVERBRIGHT_BITS,
            light_color: LightColor::default(),
            calibrate: Some(CalibrationOptions::default()),
            by_hand: true,
            progress: None,
        }
    }
}

impl RelitWorld {
    /// Loads and relights a map, with the lightmaps beside it where it has none inside.
    ///
    /// # Errors
    /// [`LoadError`] when the map is absent, cannot be read or is damaged. Missing materials and images are
    /// warnings.
    pub fn load(
        files: &dyn GameFiles,
        materials: &Materials,
        map: &str,
        options: Options<'_>,
    ) -> Result<RelitWorld, LoadError> {
        let bytes = files.read(map)?.ok_or_else(|| LoadError::Absent {
            map: map.to_owned(),
        })?;
        let mut bsp = Bsp::parse(&bytes).map_err(|source| LoadError::Map {
            map: map.to_owned(),
            source,
        })?;
        let external = external_lightmaps(&mut bsp, files, map);
        let mut world = RelitWorld::from_bsp(files, materials, map, bsp, options);
        world.warnings.extend(external.err());
        Ok(world)
    }

    /// Relights a parsed map. External lightmaps are not loaded: see [`external_lightmaps`].
    pub fn from_bsp(
        files: &dyn GameFiles,
        materials: &Materials,
        map: &str,
        mut bsp: Bsp,
        mut options: Options<'_>,
    ) -> RelitWorld {
        bsp.resolve_texture_sizes(|name| image::texture_size(files, name));
        let mut begin = |stage: Stage| {
            if let Some(progress) = options.progress.as_mut() {
                progress(stage);
            }
        };
        begin(Stage::Map);
        let entities = bsp.entities();
        let mut warnings: Vec<String> =
            bsp.warnings.iter().map(|w| format!("{map}: {w}")).collect();

        begin(Stage::Materials);
        let mut pages = PageLoader::new(files);
        let (mut world_materials, material_of) =
            resolve_materials(files, materials, &bsp, &mut pages);
        warnings.extend(pages.warnings.iter().map(|w| format!("{map}: {w}")));
        let color_exponent = match options.light_color {
            LightColor::Displayed => display_exponent(&bsp, &pages.pages, &[]),
            LightColor::Stored => 1.0,
        };
        let mut finder = light::Finder::new(files, color_exponent);
        warnings.extend(material_faults(map, &world_materials));
        let (fogs, faults) = fog::fogs(&bsp, files, materials);
        warnings.extend(faults.iter().map(|fault| format!("{map}: {fault}")));

        begin(Stage::Geometry);
        let models = place_models(&bsp, &entities);
        let model_of = model_of_surfaces(&bsp);
        let patches = bsp.patch_meshes(options.subdivisions);
        let mut geometry = Geometry::default();
        let mut surfaces = Vec::with_capacity(bsp.surfaces.len());
        let mut flares = Vec::new();
        for (index, stored) in bsp.surfaces.iter().enumerate() {
            let patch = patches.get(index).and_then(Option::as_ref);
            let placed = geometry.add(&bsp, stored, patch, options.overbright_shift);
            let fog = match usize::try_from(stored.fog) {
                Ok(fog) if fog < fogs.len() => fog as u32 + 1,
                _ => 0,
            };
            let material = material_of.get(index).copied().unwrap_or(0);
            if stored.kind == SurfaceKind::Flare {
                let finite = |v: Vec3| if v.is_finite() { v } else { Vec3::ZERO };
                flares.push(Flare {
                    origin: finite(stored.lightmap_origin),
                    color: finite(stored.lightmap_vecs[0]),
                    normal: finite(stored.lightmap_vecs[2]).normalize_or_zero(),
                    surface: index as u32,
                    material,
                    fog,
                });
            }
            let lightmap = lightmap_of(&bsp, stored);
            let external = world_materials
                .get(material as usize)
                .and_then(|m| m.baked.main);
            surfaces.push(WorldSurface {
                kind: stored.kind,
                material,
                fog,
                lightmap,
                light_page: external
                    .map_or(lightmap, |page| bsp.lightmaps.len() as i32 + page as i32),
                model: model_of.get(index).copied().unwrap_or(0),
                first_vertex: placed.first_vertex,
                num_vertices: placed.num_vertices,
                first_index: placed.first_index,
                num_indices: placed.num_indices,
                first_light: 0,
                num_lights: 0,
                mins: placed.mins,
                maxs: placed.maxs,
                plane: placed.plane,
            });
        }

        begin(Stage::Lights);
        for material in &mut world_materials {
            material.emission = finder.emission(material);
        }
        let (mut point_lights, mut suns) = light::light_entities(&entities);
        suns.extend(light::suns(&world_materials, &surfaces));
        let negative = light::negative_lights(&entities);
        if negative > 0 {
            warnings.push(format!(
                "{map}: ignored {negative} light entities with negative light; dark spots are not traced"
            ));
        }
        let points = point_lights.iter_mut().map(|l| &mut l.intensity);
        for strength in points.chain(suns.iter_mut().map(|s| &mut s.irradiance)) {
            *strength = light::raise(*strength, color_exponent);
        }
        let mut world = RelitWorld {
            name: map.to_owned(),
            materials: world_materials,
            surfaces,
            models,
            vertices: geometry.vertices,
            triangle_lights: vec![NO_LIGHT; geometry.indices.len() / 3],
            indices: geometry.indices,
            pages: pages.pages,
            files_of_pages: pages.files_of_pages,
            flares,
            by_hand: MaterialsByHand::default(),
            fogs,
            lights: Vec::new(),
            point_lights,
            suns,
            light_lists: Default::default(),
            ambient: light::raise(light::ambient(&entities), color_exponent),
            sky: None,
            report: LightReport::default(),
            calibration: None,
            warnings,
            light_color: options.light_color,
            color_exponent,
            stored_gamma: 1.0,
            light_cutoff: 0.0,
            has_compiled_lights: false,
            shadowless_curves: false,
            exposure: None,
            overbright_shift: options.overbright_shift,
            bsp,
        };
        light::add_triangle_lights(&mut world);
        if world.light_count() == 0 {
            light::add_fallback_light(&mut world, &mut finder);
        }
        for material in &mut world.materials {
            material.flicker = finder.flicker(material);
        }
        world.sky = world.largest_sky();

        begin(Stage::LightLists);
        light::build_lists(&mut world);
        if let Some(calibration) = &options.calibrate {
            begin(Stage::Calibration);
            world.measure_materials_with(&mut finder);
            calibrate(&mut world, calibration);
        }
        if options.by_hand {
            world.read_by_hand(files);
        }
        begin(Stage::Done);
        world
    }

    /// Measures what calibration needs of materials (albedo, emission of their stages) and the colours of described
    /// lights. Loading does this only for calibration. Must precede [lights by hand](Self::light_by_hand), whose
    /// colours are final.
    pub fn measure_materials(&mut self, files: &dyn GameFiles) {
        self.measure_materials_with(&mut light::Finder::new(files, self.color_exponent));
    }

    fn measure_materials_with(&mut self, finder: &mut light::Finder<'_>) {
        let corners = self.corner_colors();
        finder.prepare_materials(&self.materials);
        for (material, corners) in self.materials.iter_mut().zip(corners) {
            material.measure_reflection(finder, corners);
            material.shown = if material.is_sky() {
                finder.sky_radiance(material)
            } else {
                finder.shown(material)
            };
        }
        if self.light_color == LightColor::Displayed {
            let exponent = display_exponent(&self.bsp, &self.pages, &self.textures());
            light::recolor(self, exponent);
        }
    }

    /// Brightness of the textures of the world's surfaces under light.
    fn textures(&self) -> Vec<Texture> {
        let mut areas = vec![0.0; self.materials.len()];
        let lit = (self.surfaces.iter()).filter(|s| s.num_indices > 0 && s.model == 0);
        for surface in lit {
            if let Some(area) = areas.get_mut(surface.material as usize) {
                *area += self.surface_area(surface);
            }
        }
        // Glowing parts reflect nothing and do not count.
        (self.materials.iter().zip(areas))
            .filter(|(_, area)| area.is_finite() && *area > 0.0)
            .flat_map(|(material, area)| {
                let part = area / material.shades.len().max(1) as f32;
                material.shades.iter().map(move |shade| Texture {
                    brightness: overbright::luminance(shade.encoded),
                    area: part,
                })
            })
            .filter(|texture| texture.brightness.is_finite())
            .collect()
    }

    /// Mean vertex colour of each material over its area, encoded; white without surfaces.
    fn corner_colors(&self) -> Vec<[u8; 4]> {
        let mut sums = vec![(Vec4::ZERO, 0.0); self.materials.len()];
        for surface in &self.surfaces {
            let Some((sum, whole)) = slice::get_mut(&mut sums, surface.material as usize) else {
                continue;
            };
            for triangle in surface.triangles() {
                let corners = self.corners(triangle);
                let [a, b, c] = corners.map(|v| v.position);
                let area = (b - a).cross(c - a).length() * 0.5;
                let colors = corners.map(|v| Vec4::from_array(v.color.map(f32::from)));
                let color: Vec4 = colors.iter().sum();
                *sum += color * (area / 3.0);
                *whole += area;
            }
        }
        let mean = |(sum, whole): (Vec4, f32)| match whole > 0.0 {
            true => (sum / whole).to_array().map(|c| c.round() as u8),
            false => [255; 4],
        };
        sums.into_iter().map(mean).collect()
    }

    /// Material of the sky with the largest total area.
    fn largest_sky(&self) -> Option<u32> {
        let mut area: HashMap<u32, f32> = HashMap::new();
        for surface in &self.surfaces {
            let material = self.material_of(surface);
            if surface.num_indices > 0 && material.is_some_and(WorldMaterial::is_sky) {
                *area.entry(surface.material).or_default() += self.surface_area(surface);
            }
        }
        let largest = area
            .into_iter()
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        largest.map(|(material, _)| material)
    }

    /// Area of a surface's triangles, square id units.
    pub fn surface_area(&self, surface: &WorldSurface) -> f32 {
        let triangles = surface.triangles();
        triangles
            .map(|t| self.triangle(t))
            .map(|[a, b, c]| (b - a).cross(c - a).length() * 0.5)
            .sum()
    }

    /// The light of a triangle of the index buffer.
    pub fn light_of_triangle(&self, triangle: usize) -> Option<&TriangleLight> {
        self.lights
            .get(*self.triangle_lights.get(triangle)? as usize)
    }
}

/// The materials that the surfaces use, and for every surface the index of its own.
///
/// One entry per (name, flags, lighting): compilers write one name with several flags, some of them invisible.
fn resolve_materials(
    files: &dyn GameFiles,
    materials: &Materials,
    bsp: &Bsp,
    pages: &mut PageLoader<'_>,
) -> (Vec<WorldMaterial>, Vec<u32>) {
    let mut known: HashMap<_, u32> = HashMap::new();
    let mut list = Vec::new();
    let mut of_surface = Vec::with_capacity(bsp.surfaces.len());
    for surface in &bsp.surfaces {
        let shader = bsp.shader(surface.shader);
        let name = shader.name.as_str();
        let flags = (shader.surface_flags, shader.content_flags);
        let lighting = lighting_of(lightmap_of(bsp, surface));
        let key = (name.to_ascii_lowercase(), flags, lighting);
        let material = *known.entry(key).or_insert_with(|| {
            let resolved = materials.resolve(files, name, lighting);
            list.push(WorldMaterial::new(name, flags, lighting, resolved, pages));
            (list.len() - 1) as u32
        });
        of_surface.push(material);
    }
    (list, of_surface)
}

/// The models, with the origins of their entities.
fn place_models(bsp: &Bsp, entities: &[Entity]) -> Vec<WorldModel> {
    let mut models: Vec<_> = bsp
        .models
        .iter()
        .map(|model| {
            let range = bsp.model_surfaces(model);
            WorldModel {
                first_surface: range.start as u32,
                num_surfaces: range.len() as u32,
                origin: Vec3::ZERO,
            }
        })
        .collect();
    for entity in entities {
        let model = entity.brush_model().and_then(|m| models.get_mut(m));
        if let (Some(model), Some(origin)) = (model, entity.vec3("origin")) {
            model.origin = origin;
        }
    }
    models
}

/// Model of each surface.
fn model_of_surfaces(bsp: &Bsp) -> Vec<u32> {
    let mut of_surface = vec![0; bsp.surfaces.len()];
    for (number, model) in bsp.models.iter().enumerate().skip(1) {
        slice::part_mut(&mut of_surface, bsp.model_surfaces(model)).fill(number as u32);
    }
    of_surface
}

/// Faults of materials, each once.
fn material_faults(map: &str, materials: &[WorldMaterial]) -> BTreeSet<String> {
    let fault = |m: &WorldMaterial| {
        let fault = m.resolved.fault.as_ref()?;
        Some(format!("{map}: material {}: {fault}", m.name))
    };
    materials.iter().filter_map(fault).collect()
}

impl RelitWorld {
    /// Warnings of loading except faults of materials, which a game reports when it registers them.
    pub fn map_warnings(&self) -> impl Iterator<Item = &String> {
        let of_materials = material_faults(&self.name, &self.materials);
        let others = move |warning: &&String| !of_materials.contains(*warning);
        self.warnings.iter().filter(others)
    }
}
