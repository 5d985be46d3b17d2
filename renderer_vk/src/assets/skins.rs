//! Skins by handle: the material of each surface of a model.

use q3model::Skin;
use relight::GameFiles;

use super::material::LightmapClass;
use super::materials::Materials;
use super::source::ImageSource;

/// A skin.
#[derive(Clone, Debug, Default)]
pub struct LoadedSkin {
    /// Registered name.
    pub name: String,
    /// Surface names (lower case) and materials. An unusable material is kept: its remaining stages are drawn.
    pub surfaces: Vec<(String, u32)>,
}

impl LoadedSkin {
    /// The material of a surface.
    pub fn material(&self, surface: &str) -> Option<u32> {
        self.surfaces
            .iter()
            .find(|(name, _)| name == surface)
            .map(|&(_, material)| material)
    }
}

/// Skins by handle; 0 is the default skin, which has the default material on every surface.
#[derive(Debug, Default)]
pub struct Skins {
    list: Vec<LoadedSkin>,
}

impl Skins {
    /// The handle of a skin; 0 if there is none. A name without the ending `.skin` is a material for a model of one
    /// surface.
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
        let known = self
            .list
            .iter()
            .position(|s| s.name.eq_ignore_ascii_case(name));
        let slot = known.unwrap_or_else(|| {
            let surfaces = load(files, materials, source, name);
            self.list.push(LoadedSkin {
                name: name.to_owned(),
                surfaces,
            });
            self.list.len() - 1
        });
        match self.list.get(slot) {
            Some(skin) if !skin.surfaces.is_empty() => i32::try_from(slot + 1).unwrap_or(0),
            _ => 0,
        }
    }

    /// A skin; `None` for 0 and for unknown handles.
    pub fn get(&self, handle: i32) -> Option<&LoadedSkin> {
        let slot = usize::try_from(handle.checked_sub(1)?).ok()?;
        self.list.get(slot)
    }

    /// Lines for `skinlist`: each skin by handle, with its surfaces and their materials.
    pub fn list(&self, materials: &Materials) -> Vec<String> {
        let default = LoadedSkin {
            name: "<default skin>".into(),
            surfaces: vec![(String::new(), 0)],
        };
        let rule = "-".repeat(18);
        let mut lines = vec![rule.clone()];
        for (handle, skin) in std::iter::once(&default).chain(&self.list).enumerate() {
            let count = skin.surfaces.len();
            lines.push(format!("{handle:3}:{} ({count} surfaces)", skin.name));
            lines.extend(skin.surfaces.iter().map(|(surface, material)| {
                format!(
                    "       {surface} = {}",
                    materials.get(*material).shown_name()
                )
            }));
        }
        lines.push(rule);
        lines
    }
}

fn load(
    files: &dyn GameFiles,
    materials: &mut Materials,
    source: &mut dyn ImageSource,
    name: &str,
) -> Vec<(String, u32)> {
    let ends_in_skin = name.len() >= 5
        && name
            .get(name.len() - 5..)
            .is_some_and(|end| end.eq_ignore_ascii_case(".skin"));
    if !ends_in_skin {
        let material = materials.find(source, name, LightmapClass::None, true);
        return vec![(String::new(), material)];
    }
    let text = match files.read(name) {
        Ok(Some(text)) => text,
        Ok(None) => return Vec::new(),
        Err(problem) => {
            log::warn!("{problem}");
            return Vec::new();
        }
    };
    Skin::parse(&text)
        .surfaces
        .into_iter()
        .map(|s| {
            let material = materials.find(source, &s.shader, LightmapClass::None, true);
            (s.surface, material)
        })
        .collect()
}
