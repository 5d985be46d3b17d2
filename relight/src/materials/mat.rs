//! `.mat` files of Quake II RTX: names of materials, then lines of an attribute and its value.
//!
//! | attribute | meaning here |
//! |---|---|
//! | `texture_normals`, `bump_scale` | normal map; metal in its alpha, times `metalness_factor` |
//! | `texture_base` | roughness in its alpha, if there is a normal map; the colour stays that of the map's texture |
//! | `roughness_override` | roughness; with `texture_base`, as that renderer has it, the least roughness |
//! | `texture_emissive`, `emissive_factor` | what of the surface glows, and how brightly |
//! | `specular_factor` | factor of the reflectance 0.04 |
//! | `kind CHROME`, `kind GLASS` | a mirror where nothing else is stated; glass with an index of 1.5 |
//! | all others | no effect. `is_light` has none, because lights are found in the map |

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::finish::{Finish, Glow, NormalMap, SurfaceMap, USUAL_REFLECTANCE};
use crate::hand_written::LineError;

/// Attributes without an effect.
const IGNORED: [&str; 8] = [
    "is_light",
    "base_factor",
    "light_styles",
    "bsp_radiance",
    "default_radiance",
    "texture_mask",
    "synth_emissive",
    "emissive_threshold",
];
/// Index of refraction of glass.
const GLASS: f32 = 1.5;

/// Materials by name in lower case.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mats {
    by_name: HashMap<String, Mat>,
}

/// The attributes of a material.
#[derive(Debug, Clone, PartialEq, Default)]
struct Mat {
    normals: Option<String>,
    base: Option<String>,
    emissive: Option<String>,
    emissive_factor: Option<f32>,
    bump_scale: Option<f32>,
    roughness: Option<f32>,
    metal: Option<f32>,
    specular: Option<f32>,
    kind: Option<Kind>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Chrome,
    Glass,
}

impl Mats {
    /// Adds the materials of a file; those that it names again replace earlier ones. Returns its faults.
    pub(super) fn add(&mut self, text: &str) -> Vec<LineError> {
        let mut wrong = Vec::new();
        // names that the next attributes belong to
        let mut names: Vec<String> = Vec::new();
        let mut complete = false;
        for (line, text) in (1..).zip(text.lines()) {
            let text = text.split('#').next().unwrap_or_default().trim();
            let mut fault = |what: String| wrong.push(LineError { line, what });
            if text.is_empty() {
                continue;
            }
            if let Some(name) = text.strip_suffix([':', ',']) {
                if complete {
                    names.clear();
                }
                complete = text.ends_with(':');
                let name = name.to_ascii_lowercase();
                self.by_name.insert(name.clone(), Mat::default());
                names.push(name);
                continue;
            }
            let words: Vec<&str> = text.split_whitespace().collect();
            match words[..] {
                _ if names.is_empty() => {
                    fault("an attribute before the name of a material".to_owned())
                }
                _ if !complete => {
                    fault("the last name of a material ends with a colon".to_owned());
                    names.clear();
                }
                [key, value] => {
                    for name in &names {
                        if let Some(mat) = self.by_name.get_mut(name)
                            && let Err(what) = mat.set(name, key, value)
                        {
                            fault(what);
                            break;
                        }
                    }
                }
                _ => fault("an attribute and its value belong here".to_owned()),
            }
        }
        wrong
    }

    /// What they state of a material.
    pub(super) fn finish(&self, name: &str) -> Option<Finish> {
        (!self.by_name.is_empty()).then_some(())?;
        Some(self.by_name.get(&name.to_ascii_lowercase())?.finish())
    }
}

impl Mat {
    fn set(&mut self, name: &str, key: &str, value: &str) -> Result<(), String> {
        let number = || {
            let parsed = value.parse().ok().filter(|n: &f32| n.is_finite());
            parsed.ok_or_else(|| format!("{value:?} is not a number"))
        };
        // one star stands for the name without its folders, two for the whole name
        let file = name.rsplit('/').next().unwrap_or(name);
        let image = || match value {
            "0" => None,
            _ if value.contains("**") => Some(value.replacen("**", name, 1)),
            _ => Some(value.replacen('*', file, 1)),
        };
        match key {
            "texture_normals" => self.normals = image(),
            "texture_base" => self.base = image(),
            "texture_emissive" => self.emissive = image(),
            "emissive_factor" => self.emissive_factor = Some(number()?.max(0.0)),
            "bump_scale" => self.bump_scale = Some(number()?),
            "roughness_override" => {
                // below 0: none
                self.roughness = Some(number()?).filter(|r| *r >= 0.0).map(|r| r.min(1.0));
            }
            "metalness_factor" => self.metal = Some(number()?.clamp(0.0, 1.0)),
            "specular_factor" => self.specular = Some(number()?.clamp(0.0, 25.0)),
            "kind" => {
                self.kind = match value.to_ascii_uppercase().as_str() {
                    "CHROME" => Some(Kind::Chrome),
                    "GLASS" => Some(Kind::Glass),
                    "REGULAR" | "WATER" | "LAVA" | "SKY" | "SLIME" | "INVISIBLE" | "SCREEN"
                    | "CAMERA" | "INVALID" => None,
                    _ => return Err(format!("unknown kind {value:?}")),
                };
            }
            _ if IGNORED.contains(&key) => {}
            _ => return Err(format!("unknown attribute {key:?}")),
        }
        Ok(())
    }

    fn finish(&self) -> Finish {
        let mut finish = Finish::default();
        if let Some(normals) = &self.normals {
            let scale = self.bump_scale.unwrap_or(1.0);
            finish.normals = Some(NormalMap::downward(
                normals.clone(),
                Vec2::splat(scale),
                0.0,
            ));
            finish.surface = Some(SurfaceMap::Alphas {
                roughness: self.base.clone().filter(|_| self.roughness.is_none()),
                metal: normals.clone(),
            });
            finish.metal = self.metal;
        }
        finish.roughness = self.roughness;
        let factor = self.emissive_factor.unwrap_or(1.0);
        finish.glow = self.emissive.clone().map(|image| Glow {
            image,
            radiance: factor,
            lights: false,
        });
        finish.reflectance = self.specular.map(|s| Vec3::splat(s * USUAL_REFLECTANCE));
        match self.kind {
            Some(Kind::Chrome) if self.normals.is_none() => finish.mirror = Some(Vec3::splat(0.9)),
            Some(Kind::Glass) => finish.glass = Some((GLASS, Vec3::ONE)),
            _ => {}
        }
        finish
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_and_faults() {
        let mut mats = Mats::default();
        let wrong = mats.add(
            "bump_scale 1\n# comment\ntextures/A, # two\nTEXTURES/b:\n\ttexture_normals overrides/*_n.tga\n\
             \ttexture_base **.tga\n\tmetalness_factor 0.5\n\tkind CHROME\n\tshine 1\n\tbump_scale x\n\
             \tis_light 1\ntextures/c:\n\tkind GLASS\n\troughness_override 0.3 4\ntextures/d,\n\tbump_scale 1\n\
             textures/e:\n\tkind chrome\n\tspecular_factor 2\n",
        );
        let lines: Vec<usize> = wrong.iter().map(|w| w.line).collect();
        assert_eq!(lines, [1, 9, 10, 14, 16], "{wrong:?}");
        let b = mats.finish("textures/B").unwrap();
        let normals = b.normals.clone().unwrap();
        assert_eq!(normals.image, "overrides/b_n.tga");
        let alphas = SurfaceMap::Alphas {
            roughness: Some("textures/b.tga".to_owned()),
            metal: normals.image,
        };
        assert_eq!(
            (b.surface, b.metal, b.mirror),
            (Some(alphas), Some(0.5), None)
        );
        assert_eq!(
            mats.finish("textures/c").unwrap().glass,
            Some((1.5, Vec3::ONE))
        );
        let e = mats.finish("textures/e").unwrap();
        assert_eq!(
            (e.mirror, e.reflectance),
            (Some(Vec3::splat(0.9)), Some(Vec3::splat(0.08)))
        );
        assert_eq!(mats.finish("textures/f"), None);
        // a file that follows replaces a material as a whole
        assert_eq!(mats.add("textures/b:\nroughness_override -1\n"), []);
        assert_eq!(mats.finish("textures/b"), Some(Finish::default()));
    }
}
