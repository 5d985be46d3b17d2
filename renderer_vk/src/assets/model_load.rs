//! Loads models: selects reader, file and levels of detail.
//!
//! Source: engine behaviour of `renderer_opengl1` (model registration).

use std::sync::Arc;

use q3model::{Iqm, Md3, Mdr};
use relight::GameFiles;

use super::material::LightmapClass;
use super::materials::Materials;
use super::models::{IqmModel, MAX_LODS, Md3Lod, MdrModel, Model};
use super::source::ImageSource;

/// Inputs of model loading.
pub(super) struct Loader<'a> {
    pub files: &'a dyn GameFiles,
    pub materials: &'a mut Materials,
    pub source: &'a mut dyn ImageSource,
    /// Total bytes of the files read.
    pub bytes: usize,
}

/// A model file format.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Iqm,
    Mdr,
    Md3,
}

/// In the order in which they are tried for a name without a known extension.
const FORMATS: [(Format, &str); 3] = [
    (Format::Iqm, "iqm"),
    (Format::Mdr, "mdr"),
    (Format::Md3, "md3"),
];

impl Loader<'_> {
    /// Reads a model by the reader of its extension. If that fails, or no reader has this extension, tries the other
    /// formats under the same name.
    pub fn model(&mut self, name: &str) -> Option<Model> {
        let known = extension(name).and_then(|extension| {
            let known = |(_, own): &&(Format, &str)| extension.eq_ignore_ascii_case(own);
            FORMATS.iter().find(known).map(|&(format, _)| format)
        });
        if let Some(model) = known.and_then(|format| self.by_format(format, name)) {
            return Some(model);
        }
        let stem = match known {
            Some(_) => shaderscript::strip_extension(name),
            None => name,
        };
        let others = FORMATS.iter().filter(|(format, _)| Some(*format) != known);
        for (format, extension) in others {
            let other = format!("{stem}.{extension}");
            let Some(model) = self.by_format(*format, &other) else {
                continue; // absent, or refused with a warning
            };
            if known.is_some() {
                log::info!("{name}: not usable; {other} is used");
            }
            return Some(model);
        }
        None
    }

    fn by_format(&mut self, format: Format, file: &str) -> Option<Model> {
        match format {
            Format::Iqm => self.iqm(file),
            Format::Mdr => self.mdr(file),
            Format::Md3 => self.md3_lods(file),
        }
    }

    fn read<T>(
        &mut self,
        file: &str,
        parse: impl FnOnce(&[u8]) -> Result<T, q3model::Error>,
    ) -> Option<T> {
        let bytes = match self.files.read(file) {
            Ok(bytes) => bytes?,
            Err(problem) => {
                log::warn!("{problem}");
                return None;
            }
        };
        match parse(&bytes) {
            Ok(model) => {
                self.bytes += bytes.len();
                Some(model)
            }
            Err(problem) => {
                log::warn!("{file}: {problem}");
                None
            }
        }
    }

    fn material(&mut self, shader: &str) -> u32 {
        self.materials
            .find_or_default(self.source, shader, LightmapClass::None)
    }

    fn iqm(&mut self, file: &str) -> Option<Model> {
        let iqm = self.read(file, Iqm::parse)?;
        let surfaces = iqm.surfaces.iter();
        let materials = surfaces.map(|s| self.material(&s.material)).collect();
        let skeleton = iqm.skeleton();
        Some(Model::Iqm(IqmModel {
            iqm,
            skeleton,
            materials,
        }))
    }

    fn mdr(&mut self, file: &str) -> Option<Model> {
        let mdr = self.read(file, Mdr::parse)?;
        let of_surfaces = |surfaces: &Vec<q3model::MdrSurface>| {
            let shaders = surfaces.iter().map(|s| &s.shader);
            shaders.map(|shader| self.material(shader)).collect()
        };
        let materials = mdr.lods.iter().map(of_surfaces).collect();
        Some(Model::Mdr(MdrModel { mdr, materials }))
    }

    /// Reads the existing levels, coarsest first: materials of equal sort values are drawn in order of registration.
    fn md3_lods(&mut self, name: &str) -> Option<Model> {
        let mut found: [Option<Arc<Md3Lod>>; MAX_LODS] = Default::default();
        for (lod, slot) in found.iter_mut().enumerate().rev() {
            // a coarser level replaces one that fails
            *slot = self.md3(&lod_name(name, lod)).map(Arc::new);
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

    fn md3(&mut self, file: &str) -> Option<Md3Lod> {
        let md3 = self.read(file, Md3::parse)?;
        let of_surface = |surface: &q3model::Surface| {
            let shaders = surface.shaders.iter();
            shaders.map(|shader| self.material(shader)).collect()
        };
        let materials = md3.surfaces.iter().map(of_surface).collect();
        Some(Md3Lod { md3, materials })
    }
}

/// The text after the last dot of a path's last component.
fn extension(name: &str) -> Option<&str> {
    let file = name.rsplit('/').next().unwrap_or(name);
    file.rsplit_once('.').map(|(_, extension)| extension)
}

/// The file name of a level of detail: `name_1.md3`; the name is split at its first dot, as in the engine.
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
