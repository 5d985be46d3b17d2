//! Models by handle.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use q3model::Md3;
use relight::GameFiles;

use super::material::LightmapClass;
use super::materials::Materials;
use super::source::ImageSource;
use crate::api::Orientation;

/// Most levels of detail of a model.
pub const MAX_LODS: usize = 3;

/// One level of detail.
#[derive(Debug)]
pub struct Md3Lod {
    /// The mesh.
    pub md3: Md3,
    /// For each surface the materials that its shader names stand for; the default material for unusable ones.
    pub materials: Vec<Vec<u32>>,
}

/// A model.
#[derive(Debug)]
pub enum Model {
    /// Key-framed triangles, the finest level first; missing levels are left out and coarser ones repeated in their
    /// place, so that every entry up to `lods.len()` can be drawn.
    Mesh {
        /// At least one level.
        lods: Vec<Arc<Md3Lod>>,
    },
    /// A brush model of the current map.
    Inline {
        /// Index of the BSP model.
        model: u32,
        /// Its bounds.
        bounds: (Vec3, Vec3),
    },
}

/// Models by handle; handle 0 is no model.
#[derive(Debug, Default)]
pub struct Models {
    list: Vec<(String, Option<Model>)>,
    by_name: HashMap<String, i32>,
}

impl Models {
    /// The handle of a model, loaded at its first use; 0 for a missing or unusable one.
    pub fn register(
        &mut self,
        files: &dyn GameFiles,
        materials: &mut Materials,
        source: &mut dyn ImageSource,
        name: &str,
    ) -> i32 {
        if name.is_empty() {
            return 0;
        }
        if let Some(&handle) = self.by_name.get(name) {
            return self.usable(handle);
        }
        let model = load_lods(files, materials, source, name).or_else(|| {
            // the engine tries its other kinds of model under the same name
            let other = format!("{}.md3", shaderscript::strip_extension(name));
            let other = Some(other).filter(|other| !other.eq_ignore_ascii_case(name))?;
            let model = load_lods(files, materials, source, &other)?;
            log::info!("{name}: not found; {other} is used");
            Some(model)
        });
        let handle = self.push(name, model);
        self.usable(handle)
    }

    /// Registers the brush models of a map as `*0`, `*1`, ...
    pub fn register_inline(&mut self, bounds: &[(Vec3, Vec3)]) {
        for (model, &bounds) in (0u32..).zip(bounds) {
            let name = format!("*{model}");
            let value = Some(Model::Inline { model, bounds });
            match self.by_name.get(&name).copied() {
                Some(handle) => {
                    let slot = usize::try_from(handle - 1).ok();
                    if let Some(entry) = slot.and_then(|slot| self.list.get_mut(slot)) {
                        entry.1 = value;
                    }
                }
                None => {
                    self.push(&name, value);
                }
            }
        }
    }

    fn push(&mut self, name: &str, model: Option<Model>) -> i32 {
        self.list.push((name.to_owned(), model));
        let handle = i32::try_from(self.list.len()).unwrap_or(0);
        self.by_name.insert(name.to_owned(), handle);
        handle
    }

    fn usable(&self, handle: i32) -> i32 {
        if self.get(handle).is_some() {
            handle
        } else {
            0
        }
    }

    /// A model; `None` for 0, for a failed one and for a handle that was never given out.
    pub fn get(&self, handle: i32) -> Option<&Model> {
        let slot = usize::try_from(handle.checked_sub(1)?).ok()?;
        self.list.get(slot)?.1.as_ref()
    }

    /// Where a tag is between two frames; `None` when the model has no such tag.
    pub fn lerp_tag(
        &self,
        handle: i32,
        start: i32,
        end: i32,
        fraction: f32,
        name: &str,
    ) -> Option<Orientation> {
        let Model::Mesh { lods } = self.get(handle)? else {
            return None;
        };
        let tag = lods.first()?.md3.lerp_tag(name, start, end, fraction)?;
        Some(Orientation {
            origin: tag.origin,
            axis: tag.axis,
        })
    }

    /// Bounds: those of the brush model, or of the first frame of the finest level; zeros for no model.
    pub fn bounds(&self, handle: i32) -> (Vec3, Vec3) {
        match self.get(handle) {
            Some(Model::Inline { bounds, .. }) => *bounds,
            Some(Model::Mesh { lods }) => lods
                .first()
                .and_then(|lod| lod.md3.frames.first())
                .map_or((Vec3::ZERO, Vec3::ZERO), |frame| (frame.mins, frame.maxs)),
            None => (Vec3::ZERO, Vec3::ZERO),
        }
    }

    /// One line each, for `modellist`.
    pub fn list(&self) -> Vec<String> {
        self.list
            .iter()
            .map(|(name, model)| match model {
                None => format!("(missing) {name}"),
                Some(Model::Inline { .. }) => format!("brush model {name}"),
                Some(Model::Mesh { lods }) => format!("{} levels  {name}", lods.len()),
            })
            .collect()
    }
}

/// The name of a level of detail: `name_1.md3`; the name is split at its first dot, as in the engine.
fn lod_name(name: &str, lod: usize) -> String {
    let stem = name.split('.').next().unwrap_or(name);
    let extension = name
        .get(stem.len()..)
        .filter(|e| e.len() > 1)
        .unwrap_or(".md3");
    if lod == 0 {
        name.to_owned()
    } else {
        format!("{stem}_{lod}{extension}")
    }
}

/// Loads what levels there are.
fn load_lods(
    files: &dyn GameFiles,
    materials: &mut Materials,
    source: &mut dyn ImageSource,
    name: &str,
) -> Option<Model> {
    let mut found: [Option<Arc<Md3Lod>>; MAX_LODS] = Default::default();
    for (lod, slot) in found.iter_mut().enumerate() {
        // a level that fails is taken over from a coarser one
        *slot = load_md3(files, materials, source, &lod_name(name, lod)).map(Arc::new);
    }
    let last = found.iter().rposition(Option::is_some)?;
    let mut lods = Vec::with_capacity(last + 1);
    let mut coarser = None;
    for slot in found.into_iter().take(last + 1).rev() {
        coarser = slot.or(coarser);
        lods.extend(coarser.clone());
    }
    lods.reverse();
    Some(Model::Mesh { lods })
}

fn load_md3(
    files: &dyn GameFiles,
    materials: &mut Materials,
    source: &mut dyn ImageSource,
    file: &str,
) -> Option<Md3Lod> {
    let bytes = match files.read(file) {
        Ok(bytes) => bytes?,
        Err(problem) => {
            log::warn!("{problem}");
            return None;
        }
    };
    let md3 = match Md3::parse(&bytes) {
        Ok(md3) => md3,
        Err(problem) => {
            log::warn!("{file}: {problem}");
            return None;
        }
    };
    let materials = md3
        .surfaces
        .iter()
        .map(|surface| {
            surface
                .shaders
                .iter()
                .map(|shader| materials.find_or_default(source, shader, LightmapClass::None))
                .collect()
        })
        .collect();
    Some(Md3Lod { md3, materials })
}
