//! Models that entities name besides brushes, read as what is drawn of them while they stand still: the first frame of
//! the finest level of detail.

use super::geometry::{self, Part};
use crate::files::{GameFiles, normalise};
use crate::world::WorldVertex;
use glam::{Vec2, Vec3};
use q3bsp::Entity;
use q3model::{Iqm, Md3, Mdr, Skin};
use support::slice::item;

/// Class of the models that a map's compiler made part of the map's surfaces.
const COMPILED: &str = "misc_model";
/// How the three kinds of file begin.
const MD3: &[u8] = b"IDP3";
const MDR: &[u8] = b"RDM5";
const IQM: &[u8] = b"INTERQUAKEMODEL\0";

/// Triangles of a model that share a material.
pub struct ModelSurface {
    /// Its name, lower case, as skins name it.
    name: String,
    /// Name of the material.
    pub shader: String,
    /// The triangles, in the model's own space; winding as in maps. The material's number means nothing.
    pub part: Part,
    /// Triangles left out because they have no area, or coordinates that are no numbers.
    pub degenerate: usize,
}

/// The model files that an entity, which is not the world, names: with each the key. What the compiler made part of the
/// map is not among them, nor are brush models.
pub fn named(entity: &Entity) -> impl Iterator<Item = (&'static str, &str)> {
    let compiled = entity.classname().eq_ignore_ascii_case(COMPILED);
    let keys = ["model", "model2"].into_iter().filter(move |_| !compiled);
    keys.filter_map(|key| {
        let value = entity.get(key)?;
        // the game gives this key other meanings too
        let file = value.rsplit(['/', '\\']).next()?.contains('.');
        (file && !value.starts_with('*')).then_some((key, value))
    })
}

/// A model as an entity shows it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct ModelName {
    /// The file, in its one spelling.
    pub path: String,
    /// The skin's file, in its one spelling; `None` where the model has its own materials.
    pub skin: Option<String>,
}

impl ModelName {
    /// The model `path` of an entity, with the skin that its key `skin` or `_skin` names: a file, or the number of one
    /// beside the model (`NAME_2.skin`).
    pub fn of(entity: &Entity, path: &str) -> ModelName {
        let path = canonical(path);
        let value = entity.get("skin").or_else(|| entity.get("_skin"));
        let skin = value.map(str::trim).filter(|v| !v.is_empty()).map(|value| {
            let stem = path
                .rsplit_once('.')
                .map_or(path.as_str(), |(stem, _)| stem);
            match value.parse::<u32>() {
                Ok(number) => format!("{stem}_{number}.skin"),
                Err(_) => canonical(value),
            }
        });
        ModelName { path, skin }
    }
}

/// One spelling of a model file's path; the path itself where it is none inside the game folder.
pub fn canonical(path: &str) -> String {
    normalise(path).unwrap_or_else(|_| path.to_owned())
}

/// Reads a model, and what is wrong with its skin, where that is not used.
///
/// # Errors
/// What is wrong with the file, as the end of a sentence that begins with its name.
pub fn read(
    files: &dyn GameFiles,
    model: &ModelName,
) -> Result<(Vec<ModelSurface>, Option<String>), String> {
    let bytes = files.read(&model.path).map_err(|e| e.to_string())?;
    let bytes = bytes.ok_or("there is no such file")?;
    let damaged = |e: q3model::Error| e.to_string();
    let mut surfaces: Vec<ModelSurface> = if bytes.starts_with(MD3) {
        md3(&Md3::parse(&bytes).map_err(damaged)?)
    } else if bytes.starts_with(MDR) {
        mdr(&Mdr::parse(&bytes).map_err(damaged)?)
    } else if bytes.starts_with(IQM) {
        iqm(&Iqm::parse(&bytes).map_err(damaged)?)
    } else {
        return Err("it is no MD3, MDR or IQM".to_owned());
    };
    let Some(skin) = &model.skin else {
        return Ok((surfaces, None));
    };
    let text = match files.read(skin) {
        Ok(Some(text)) => text,
        Ok(None) => return Ok((surfaces, Some(format!("{skin}: there is no such skin")))),
        Err(problem) => return Ok((surfaces, Some(problem.to_string()))),
    };
    let skin = Skin::parse(&text);
    for surface in &mut surfaces {
        if let Some(shader) = skin.shader_for(&surface.name) {
            shader.clone_into(&mut surface.shader);
        }
    }
    Ok((surfaces, None))
}

fn md3(model: &Md3) -> Vec<ModelSurface> {
    let one = |surface: &q3model::Surface| {
        let vertices = surface.frame_vertices(0).iter().zip(&surface.st);
        let vertices = vertices.map(|(v, st)| vertex(v.position(), v.normal(), *st));
        // A surface may name no shader.
        let shader = surface.shaders.first().cloned().unwrap_or_default();
        joined(
            &surface.name,
            shader,
            vertices.collect(),
            &surface.triangles,
        )
    };
    model.surfaces.iter().map(one).collect()
}

fn mdr(model: &Mdr) -> Vec<ModelSurface> {
    let bones = model.frame_bones(0);
    let one = |surface: &q3model::MdrSurface| {
        let vertices = surface.vertices.iter().map(|v| {
            let (position, normal) = surface.skinned(v, bones);
            vertex(position, normal, v.st)
        });
        joined(
            &surface.name,
            surface.shader.clone(),
            vertices.collect(),
            &surface.triangles,
        )
    };
    model.lods.first().into_iter().flatten().map(one).collect()
}

fn iqm(model: &Iqm) -> Vec<ModelSurface> {
    let mut pose = Vec::new();
    model.pose(&model.skeleton(), 0, 0, 0.0, &mut pose);
    let one = |surface: &q3model::IqmSurface| {
        let vertices = model.surface_vertices(surface).iter().map(|v| {
            let (position, normal) = v.skinned(&pose);
            WorldVertex {
                color: v.color,
                ..vertex(position, normal, v.st)
            }
        });
        joined(
            &surface.name,
            surface.material.clone(),
            vertices.collect(),
            &surface.triangles,
        )
    };
    model.surfaces.iter().map(one).collect()
}

fn vertex(position: Vec3, normal: Vec3, st: Vec2) -> WorldVertex {
    WorldVertex {
        position,
        normal,
        st: if st.is_finite() { st } else { Vec2::ZERO },
        lightmap: Vec2::ZERO,
        color: [255; 4],
    }
}

fn joined(
    name: &str,
    shader: String,
    vertices: Vec<WorldVertex>,
    triangles: &[[u32; 3]],
) -> ModelSurface {
    let corners = triangles.iter();
    let corners = corners.map(|corners| corners.map(|i| item(&vertices, i as usize)));
    let (part, degenerate) = geometry::join(corners);
    ModelSurface {
        name: name.to_ascii_lowercase(),
        shader,
        part,
        degenerate,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(pairs: &[(&str, &str)]) -> Vec<(&'static str, String)> {
        let pair = |(k, v): &(&str, &str)| ((*k).to_owned(), (*v).to_owned());
        let entity = Entity {
            pairs: pairs.iter().map(pair).collect(),
        };
        let own = |(key, path): (&'static str, &str)| (key, path.to_owned());
        named(&entity).map(own).collect()
    }

    #[test]
    fn only_files_are_models() {
        let found = keys(&[("model", "*3"), ("model2", "/models/Fan.md3")]);
        assert_eq!(found, [("model2", "/models/Fan.md3".to_owned())]);
        assert_eq!(canonical(&found[0].1), "models/fan.md3");
        assert!(keys(&[("model", "someone/default")]).is_empty());
        assert!(keys(&[("classname", "misc_model"), ("model", "a.md3")]).is_empty());
        assert_eq!(keys(&[("model", "a.iqm"), ("model2", "b.mdr")]).len(), 2);
    }
}
