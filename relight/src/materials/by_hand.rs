//! Materials written by hand: files that state how surfaces reflect, which the engine's scripts cannot.
//!
//! `maps/NAME.materials` belongs to `maps/NAME.bsp`; `scripts/*.materials` of a pack hold on all maps. Each line is a
//! word, a name and values; `//` and `#` begin a comment. In names `*` stands for any characters and `?` for one.
//!
//! | line | meaning |
//! |---|---|
//! | `rough NAME ROUGHNESS [REFLECTANCE]` | reflects by a perceptual roughness of 0 to 1; reflectance at normal incidence, 0.04 without it |
//! | `metal NAME [PART]` | this part of it is metal, all without a number |
//! | `mirror NAME R G B` | mirrors this part of the light sharply, beside what its stages show |
//! | `glass NAME INDEX R G B` | is glass of this refractive index, which lets this part of the light through |
//! | `emit NAME LIGHT R G B` | shines, as with `q3map_surfacelight LIGHT` and this colour; 0 puts it out |
//! | `glow NAME IMAGE [RADIANCE]` | shines where this image is bright: white has this radiance, 1 (display white) without a number; as a lamp it has the mean of the image |
//! | `normals NAME IMAGE [SCALE]` | has a normal map; the factor is that of the normals' parts along the surface |
//! | `surface NAME IMAGE` | has a map of roughness (green) and metal (blue), which multiply those of other lines |
//! | `plain NAME` | reflects nothing: forgets the lines before, and shows painted reflections as the game does |
//!
//! Of several lines that match a name and state the same, the last counts: packs' files follow each other by name, and the
//! map's file follows them. All of them follow what packs state themselves ([`Materials::of_pack`]) and `.mat`
//! files ([`mat`](super::mat)). `rough` replaces a map of roughness that a pack states.
//!
//! [`Materials::of_pack`]: super::Materials::of_pack

use glam::{Vec2, Vec3};

use super::finish::{Finish, Glow, NormalMap, SurfaceMap};
use super::mat::Mats;
use crate::files::GameFiles;
use crate::hand_written::{LineError, lines, matches, numbers, vector};

/// What a line states.
#[derive(Debug, Clone, PartialEq)]
enum Statement {
    Rough(f32, Option<f32>),
    Metal(f32),
    Mirror(Vec3),
    Glass(f32, Vec3),
    Emit(f32, Vec3),
    Glow(String, f32),
    Normals(String, f32),
    Surface(String),
    Plain,
}

/// A line: what it states of the materials whose names match.
#[derive(Debug, Clone, PartialEq)]
struct Rule {
    pattern: String,
    statement: Statement,
    line: usize,
    /// It is of the map's own file.
    of_map: bool,
}

/// The lines of files of materials, in the order in which they take effect.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MaterialsByHand {
    mats: Mats,
    rules: Vec<Rule>,
}

impl MaterialsByHand {
    /// Parses such a file. Invalid lines are skipped and returned as errors.
    pub fn parse(text: &str) -> (MaterialsByHand, Vec<LineError>) {
        let mut file = MaterialsByHand::default();
        let wrong = file.add(text, false);
        (file, wrong)
    }

    fn add(&mut self, text: &str, of_map: bool) -> Vec<LineError> {
        let mut wrong = Vec::new();
        for (line, words) in lines(text) {
            match rule(&words) {
                Ok((pattern, statement)) => self.rules.push(Rule {
                    pattern: pattern.to_owned(),
                    statement,
                    line,
                    of_map,
                }),
                Err(what) => wrong.push(LineError { line, what }),
            }
        }
        wrong
    }

    /// Reads `materials/*.mat`, `scripts/*.materials`, and the files of both kinds beside a map. Returns what is wrong with
    /// them, one line each.
    pub fn load(files: &dyn GameFiles, map: &str) -> (MaterialsByHand, Vec<String>) {
        let mut all = MaterialsByHand::default();
        let mut faults = Vec::new();
        let stem = map.strip_suffix(".bsp").unwrap_or(map);
        let sorted = |folder: &str, extension: &str| {
            let mut names = files.list(folder, extension);
            names.sort_unstable();
            let path = |name| format!("{folder}/{name}");
            names.into_iter().map(path).collect::<Vec<_>>()
        };
        let mut each = |paths: Vec<String>, add: &mut dyn FnMut(&str, &str) -> Vec<LineError>| {
            for path in paths {
                match files.read(&path) {
                    Ok(Some(bytes)) => {
                        let wrong = add(&path, &String::from_utf8_lossy(&bytes));
                        faults.extend(wrong.iter().map(|e| format!("{path}: {e}")));
                    }
                    Ok(None) => {}
                    Err(problem) => faults.push(problem.to_string()),
                }
            }
        };
        let mut mats = sorted("materials", ".mat");
        mats.push(format!("{stem}.mat"));
        each(mats, &mut |_, text| all.mats.add(text));
        let own = materials_file(map);
        let mut lines = sorted("scripts", ".materials");
        lines.push(own.clone());
        each(lines, &mut |path, text| all.add(text, path == own));
        (all, faults)
    }

    /// What the files state of a material, over what its pack states.
    pub fn finish(&self, name: &str, of_pack: &Finish) -> Finish {
        let mut finish = of_pack.clone();
        if let Some(mat) = self.mats.finish(name) {
            finish.overlay(&mat);
        }
        let of_pack = finish.surface.clone();
        for rule in self.rules.iter().filter(|r| matches(&r.pattern, name)) {
            match &rule.statement {
                Statement::Rough(roughness, reflectance) => {
                    if finish.surface.is_some() && finish.surface == of_pack {
                        finish.forget_gloss();
                    }
                    finish.roughness = Some(*roughness);
                    finish.reflectance = reflectance.map(Vec3::splat).or(finish.reflectance);
                }
                Statement::Metal(part) => finish.metal = Some(*part),
                Statement::Mirror(part) => finish.mirror = Some(*part),
                Statement::Glass(index, part) => finish.glass = Some((*index, *part)),
                Statement::Emit(value, color) => finish.emission = Some((*value, *color)),
                Statement::Glow(image, radiance) => {
                    finish.glow = Some(Glow {
                        image: image.clone(),
                        radiance: *radiance,
                        lights: true,
                    });
                }
                Statement::Normals(image, scale) => {
                    finish.normals = Some(NormalMap {
                        image: image.clone(),
                        scale: Vec2::splat(*scale),
                        depth: 0.0,
                    });
                }
                Statement::Surface(image) => {
                    if finish.surface.is_some() && finish.surface == of_pack {
                        finish.forget_gloss();
                    }
                    finish.surface = Some(SurfaceMap::RoughnessMetal(image.clone()));
                }
                Statement::Plain => {
                    finish = Finish {
                        plain: true,
                        emission: finish.emission,
                        glow: finish.glow,
                        ..Finish::default()
                    };
                }
            }
        }
        finish
    }

    /// Lines of the map's own file that match none of these names, as a message for each.
    pub fn unmatched(&self, map: &str, names: &[&str]) -> Vec<String> {
        let path = materials_file(map);
        let own = self.rules.iter().filter(|rule| rule.of_map);
        own.filter(|rule| !names.iter().any(|name| matches(&rule.pattern, name)))
            .map(|rule| {
                let (line, pattern) = (rule.line, &rule.pattern);
                format!("{path}: line {line}: no material matches {pattern}")
            })
            .collect()
    }
}

/// Game path of the materials file of a map: its own path with the extension `.materials`.
pub fn materials_file(map: &str) -> String {
    let stem = map.strip_suffix(".bsp").unwrap_or(map);
    format!("{stem}.materials")
}

fn part(number: f32, what: &str) -> Result<f32, String> {
    (0.0..=1.0)
        .contains(&number)
        .then_some(number)
        .ok_or_else(|| format!("{what} is from 0 to 1, not {number}"))
}

fn parts(color: Vec3, what: &str) -> Result<Vec3, String> {
    for channel in color.to_array() {
        part(channel, what)?;
    }
    Ok(color)
}

fn image(word: Option<&&str>) -> Result<String, String> {
    word.map(|name| (*name).to_owned())
        .ok_or_else(|| "the name of an image is missing".to_owned())
}

/// The number behind an image's name.
fn one_or(usual: f32, rest: &[&str]) -> Result<f32, String> {
    match rest.get(1..).unwrap_or_default() {
        [] => Ok(usual),
        number => Ok(vector(&numbers(number, 1, 1)?, 0).x),
    }
}

fn rule<'a>(words: &[&'a str]) -> Result<(&'a str, Statement), String> {
    let (key, rest) = words.split_first().ok_or("no words")?;
    let key = key.to_ascii_lowercase();
    let known = [
        "rough", "metal", "mirror", "glass", "emit", "glow", "normals", "surface", "plain",
    ];
    if !known.contains(&key.as_str()) {
        return Err(format!(
            "unknown word {key:?}; known are {}",
            known.join(", ")
        ));
    }
    let (name, rest) = rest.split_first().ok_or("a material's name is missing")?;
    let statement = match key.as_str() {
        "rough" => {
            let n = numbers(rest, 1, 2)?;
            let roughness = part(vector(&n, 0).x, "roughness")?;
            let reflectance = n.get(1).map(|&r| part(r, "reflectance")).transpose()?;
            Statement::Rough(roughness, reflectance)
        }
        "metal" => {
            let n = numbers(rest, 0, 1)?;
            Statement::Metal(part(
                n.first().copied().unwrap_or(1.0),
                "the part of metal",
            )?)
        }
        "mirror" => {
            let n = numbers(rest, 3, 3)?;
            Statement::Mirror(parts(vector(&n, 0), "a mirrored part")?)
        }
        "glass" => {
            let n = numbers(rest, 4, 4)?;
            let index = vector(&n, 0).x;
            if !(1.0..=4.0).contains(&index) {
                return Err(format!("a refractive index is from 1 to 4, not {index}"));
            }
            Statement::Glass(index, parts(vector(&n, 1), "a transmitted part")?)
        }
        "emit" => {
            let n = numbers(rest, 4, 4)?;
            let (value, color) = (vector(&n, 0).x, vector(&n, 1));
            if value < 0.0 || color.min_element() < 0.0 {
                return Err("light cannot be below 0".to_owned());
            }
            let largest = color.max_element();
            Statement::Emit(
                value,
                if largest > 0.0 {
                    color / largest
                } else {
                    color
                },
            )
        }
        "glow" => {
            let radiance = one_or(1.0, rest)?;
            if radiance < 0.0 {
                return Err("light cannot be below 0".to_owned());
            }
            Statement::Glow(image(rest.first())?, radiance)
        }
        "normals" => Statement::Normals(image(rest.first())?, one_or(1.0, rest)?),
        "surface" => match rest {
            [_] => Statement::Surface(image(rest.first())?),
            _ => return Err("one image belongs here".to_owned()),
        },
        _ if rest.is_empty() => Statement::Plain,
        _ => return Err(format!("nothing belongs behind plain {name}")),
    };
    Ok((name, statement))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;

    #[test]
    fn the_last_line_that_matches_counts() {
        let text = "rough textures/* 0.8\nmetal *steel*\nRough *steel_wet 0.1 0.02 // rain\n\
                    mirror *steel 0.2 0.3 0.4\nplain *rusty*\nemit *lamp 300 2 1 0\nglow *lamp textures/lamp_glow 4\n\
                    normals *steel textures/n_n 0.5\nsurface *steel textures/n_rm\nglass *pane 1.5 0.9 1 0.9\n";
        let (file, wrong) = MaterialsByHand::parse(text);
        assert_eq!(wrong, []);
        let steel = file.finish("textures/base/STEEL", &Finish::default());
        assert_eq!((steel.roughness, steel.metal), (Some(0.8), Some(1.0)));
        assert_eq!(steel.mirror, Some(Vec3::new(0.2, 0.3, 0.4)));
        let normals = NormalMap {
            image: "textures/n_n".to_owned(),
            scale: Vec2::splat(0.5),
            depth: 0.0,
        };
        assert_eq!(steel.normals, Some(normals));
        let surface = SurfaceMap::RoughnessMetal("textures/n_rm".to_owned());
        assert_eq!(steel.surface, Some(surface));
        let wet = file.finish("textures/steel_wet", &Finish::default());
        assert_eq!(
            (wet.roughness, wet.reflectance),
            (Some(0.1), Some(Vec3::splat(0.02)))
        );
        let rusty = file.finish("textures/steel_rusty", &Finish::default());
        assert!(rusty.plain && !rusty.is_rough());
        let lamp = file.finish("textures/lamp", &Finish::default());
        assert_eq!(lamp.emission, Some((300.0, Vec3::new(1.0, 0.5, 0.0))));
        let glow = lamp.glow.unwrap();
        assert_eq!(
            (glow.image.as_str(), glow.radiance),
            ("textures/lamp_glow", 4.0)
        );
        assert_eq!(
            file.finish("a_pane", &Finish::default()).glass,
            Some((1.5, Vec3::new(0.9, 1.0, 0.9)))
        );
        assert_eq!(
            file.finish("models/x", &Finish::default()),
            Finish::default()
        );
    }

    #[test]
    fn wrong_lines_are_reported_with_their_numbers() {
        let text = "rough a 1.5\nrough a\nshiny a 1\nmirror a 1 1\nglass a 0.5 1 1 1\nmetal\n\
                    plain a 3\nnormals a\nnormals a b c\nsurface a b c\nrough a nan\nemit a -1 1 1 1\nglow a\nglow a b -1\nrough a 0.5";
        let (file, wrong) = MaterialsByHand::parse(text);
        let lines: Vec<usize> = wrong.iter().map(|w| w.line).collect();
        assert_eq!(lines, (1..=14).collect::<Vec<_>>(), "{wrong:?}");
        assert_eq!(
            wrong[0].to_string(),
            "line 1: roughness is from 0 to 1, not 1.5"
        );
        assert!(wrong[2].to_string().contains("unknown word \"shiny\""));
        assert_eq!(file.finish("a", &Finish::default()).roughness, Some(0.5));
    }

    #[test]
    fn lines_of_a_map_follow_those_of_packs() {
        let mut files = MemoryFiles::new();
        files
            .insert("scripts/b.materials", "rough a* 0.2\nbad")
            .unwrap();
        files
            .insert("scripts/a.materials", "rough a* 0.1\n")
            .unwrap();
        files
            .insert("maps/x.materials", "\nmetal ab\nmetal q*")
            .unwrap();
        files
            .insert("materials/m.mat", "d:\nroughness_override 0.1\nd:\nshine 1")
            .unwrap();
        files
            .insert("maps/x.mat", "D:\ntexture_base x\nroughness_override 0.7\n")
            .unwrap();
        let (all, mut faults) = MaterialsByHand::load(&files, "maps/x.bsp");
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert_eq!(
            faults.remove(0),
            "materials/m.mat: line 4: unknown attribute \"shine\""
        );
        assert!(faults[0].starts_with("scripts/b.materials: line 2: unknown word"));
        let finish = all.finish("ab", &Finish::default());
        assert_eq!((finish.roughness, finish.metal), (Some(0.2), Some(1.0)));
        // lines follow what packs and .mat files state; roughness replaces a pack's map of it
        let map = |image: &str| Some(SurfaceMap::Specular(image.to_owned()));
        let of_pack = |image: &str| Finish {
            surface: map(image),
            reflectance: Some(Vec3::ONE),
            metal: Some(0.5),
            ..Finish::default()
        };
        assert_eq!(all.finish("c", &of_pack("m")), of_pack("m"));
        let rough = all.finish("a", &of_pack("m"));
        assert_eq!(
            (rough.surface, rough.reflectance, rough.roughness),
            (None, None, Some(0.2))
        );
        assert_eq!(rough.metal, None, "a factor of the map");
        let (file, _) = MaterialsByHand::parse("surface a own\nrough b 0.2 0.1\nrough b 0.3");
        let own = file.finish("a", &of_pack("m"));
        assert_eq!(
            own.surface,
            Some(SurfaceMap::RoughnessMetal("own".to_owned()))
        );
        assert_eq!(
            (own.roughness, own.reflectance, own.metal),
            (None, None, None)
        );
        // a later line keeps what it does not state
        let twice = file.finish("b", &Finish::default());
        assert_eq!(
            (twice.roughness, twice.reflectance),
            (Some(0.3), Some(Vec3::splat(0.1)))
        );
        let of_mat = all.finish("d", &of_pack("m"));
        assert_eq!(of_mat.roughness, Some(0.7));
        assert_eq!((of_mat.surface, of_mat.metal), (None, None));
        let unmatched = all.unmatched("maps/x.bsp", &["ab", "c"]);
        assert_eq!(
            unmatched,
            ["maps/x.materials: line 3: no material matches q*"]
        );
    }
}
