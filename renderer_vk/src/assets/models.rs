//! Models by handle.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use q3model::{Iqm, IqmSkeleton, Md3, Mdr};
use relight::GameFiles;

use super::materials::Materials;
use super::model_load::Loader;
use super::source::ImageSource;
use crate::api::Orientation;

/// Maximum number of levels of detail of a model.
pub const MAX_LODS: usize = 3;

/// One level of detail.
#[derive(Debug)]
pub struct Md3Lod {
    /// The mesh.
    pub md3: Md3,
    /// For each surface the materials of its shaders; the default material for unusable ones.
    pub materials: Vec<Vec<u32>>,
}

/// A model with bones that are stored per frame.
#[derive(Debug)]
pub struct MdrModel {
    /// The model.
    pub mdr: Mdr,
    /// For each level and each of its surfaces the material; the default material for an unusable one.
    pub materials: Vec<Vec<u32>>,
}

/// A model with a skeleton of joints.
#[derive(Debug)]
pub struct IqmModel {
    /// The model.
    pub iqm: Iqm,
    /// Its joints in the bind pose.
    pub skeleton: IqmSkeleton,
    /// For each surface the material; the default material for an unusable one.
    pub materials: Vec<u32>,
}

/// A model.
#[derive(Debug)]
pub enum Model {
    /// Key-framed triangles, finest level first; a coarser level replaces a missing one, so that every entry up to
    /// `lods.len()` can be drawn.
    Mesh {
        /// At least one level.
        lods: Vec<Arc<Md3Lod>>,
    },
    /// Bones stored per frame, with levels of detail in the file.
    Mdr(MdrModel),
    /// A skeleton of joints.
    Iqm(IqmModel),
    /// A brush model of the current map.
    Inline {
        /// Index of the BSP model.
        model: u32,
        /// Its bounds.
        bounds: (Vec3, Vec3),
    },
}

/// Models by handle; handle 0 is invalid.
#[derive(Debug, Default)]
pub struct Models {
    list: Vec<(String, Option<Model>)>,
    by_name: HashMap<String, i32>,
    /// File size of each handle's model, bytes.
    file_bytes: HashMap<i32, usize>,
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
        let mut loader = Loader {
            files,
            materials,
            source,
            bytes: 0,
        };
        let model = loader.model(name);
        let bytes = loader.bytes;
        let handle = self.push(name, model);
        self.file_bytes.insert(handle, bytes);
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

    /// A model; `None` for 0, for a model that failed to load and for unknown handles.
    pub fn get(&self, handle: i32) -> Option<&Model> {
        let slot = usize::try_from(handle.checked_sub(1)?).ok()?;
        self.list.get(slot)?.1.as_ref()
    }

    /// Interpolated orientation of a tag between two frames; `None` if the model has no such tag.
    pub fn lerp_tag(
        &self,
        handle: i32,
        start: i32,
        end: i32,
        fraction: f32,
        name: &str,
    ) -> Option<Orientation> {
        let tag = match self.get(handle)? {
            Model::Mesh { lods } => lods.first()?.md3.lerp_tag(name, start, end, fraction)?,
            Model::Mdr(model) => model.mdr.lerp_tag(name, start, end, fraction)?,
            Model::Iqm(model) => model.iqm.lerp_tag(name, start, end, fraction)?,
            Model::Inline { .. } => return None,
        };
        Some(Orientation {
            origin: tag.origin,
            axis: tag.axis,
        })
    }

    /// Bounds of the brush model, or of the first frame of the finest level; zeros without a model or without stored
    /// bounds.
    pub fn bounds(&self, handle: i32) -> (Vec3, Vec3) {
        let of_frame = |frame: &q3model::Frame| (frame.mins, frame.maxs);
        let bounds = match self.get(handle) {
            Some(Model::Inline { bounds, .. }) => Some(*bounds),
            Some(Model::Mesh { lods }) => lods
                .first()
                .and_then(|lod| lod.md3.frames.first())
                .map(of_frame),
            Some(Model::Mdr(model)) => model.mdr.frames.first().map(of_frame),
            Some(Model::Iqm(model)) => model.iqm.bounds.first().copied(),
            None => None,
        };
        bounds.unwrap_or((Vec3::ZERO, Vec3::ZERO))
    }

    /// Lines for `modellist`: bytes of the files, number of levels with files of their own, name; then the sum.
    pub fn list(&self) -> Vec<String> {
        let mut total = 0;
        let mut lines = Vec::with_capacity(self.list.len() + 1);
        for (handle, (name, model)) in (1..).zip(&self.list) {
            let size = self.file_bytes.get(&handle).copied().unwrap_or(0);
            let levels = match model {
                Some(Model::Mesh { lods }) => {
                    let coarser = lods.iter().skip(1);
                    let repeated = lods.iter().zip(coarser).filter(|(a, b)| Arc::ptr_eq(a, b));
                    lods.len() - repeated.count()
                }
                _ => 1,
            };
            total += size;
            lines.push(format!("{size:8} : ({levels}) {name}"));
        }
        lines.push(format!("{total:8} : Total models"));
        lines
    }
}
