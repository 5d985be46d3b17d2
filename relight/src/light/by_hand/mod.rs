//! Lights written by hand: a file beside the map that adds lights, changes them, or takes them away.
//!
//! `maps/NAME.lights` belongs to `maps/NAME.bsp`. It is text; `//` and `#` begin a comment, and each line is a word and
//! numbers:
//!
//! | line | meaning |
//! |---|---|
//! | `point X Y Z LIGHT R G B [RADIUS]` | a point light, as an entity with `light` and `_color`; the radius is that of the ball that shines |
//! | `linear X Y Z LIGHT R G B FADE [RADIUS]` | a point light that falls off linearly, as an entity with `spawnflags` 1 and `fade` |
//! | `spot X Y Z LIGHT R G B TX TY TZ ANGLE [RADIUS]` | a point light that shines towards a place, in a cone of this half angle, degrees |
//! | `sun R G B INTENSITY DEGREES ELEVATION [DEVIANCE]` | as `q3map_sun` |
//! | `ambient LIGHT R G B` | light from everywhere, in place of what there is |
//! | `material NAME LIGHT R G B` | surfaces of a material shine as with `q3map_surfacelight LIGHT` and this colour; 0 puts them out |
//! | `scale WHAT FACTOR` | `points`, `suns` or `surfaces` that there were before, stronger or weaker |
//! | `without WHAT` | none of the `points`, `suns` or `surfaces` that there were before |
//!
//! Lines take effect in the order: `without`, `scale`, `material`, then what is added. Colours are as in an entity's
//! `_color`: the largest channel counts as 1.

mod written;

pub use written::ChangeableLights;

use super::entities::normalise;
use super::{
    AMBIENT_RADIANCE, DEFAULT_POINT_LIGHT_RADIUS, DEFAULT_SUN_RADIUS, Emission, EmissionSource,
    Falloff, POINT_LIGHT_INTENSITY, PointLight, SUN_IRRADIANCE, SURFACE_LIGHT_RADIANCE, Spot,
    SunLight,
};
use crate::files::GameFiles;
use crate::hand_written::{LineError, lines, numbers, vector};
use crate::materials::by_hand::MaterialsByHand;
use crate::materials::finish::Finish;
use crate::world::{RelitWorld, WorldMaterial};
use glam::Vec3;

/// The kind of lights that a line applies to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Points,
    Suns,
    Surfaces,
}

/// A file of hand-written lights.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LightsByHand {
    without: Vec<Kind>,
    scale: Vec<(Kind, f32)>,
    /// Name, radiance.
    materials: Vec<(String, Vec3)>,
    points: Vec<PointLight>,
    suns: Vec<SunLight>,
    ambient: Option<Vec3>,
}

impl LightsByHand {
    /// Parses such a file. Invalid lines are skipped and returned as errors.
    pub fn parse(text: &str) -> (LightsByHand, Vec<LineError>) {
        let mut file = LightsByHand::default();
        let mut wrong = Vec::new();
        for (line, words) in lines(text) {
            if let Some((key, rest)) = words.split_first()
                && let Err(what) = file.line(key, rest)
            {
                wrong.push(LineError { line, what });
            }
        }
        (file, wrong)
    }

    fn line(&mut self, key: &str, rest: &[&str]) -> Result<(), String> {
        match key.to_ascii_lowercase().as_str() {
            "point" => {
                let n = numbers(rest, 7, 8)?;
                let mut light = point(&n)?;
                if let Some(&radius) = n.get(7) {
                    light.radius = above_zero(radius, "the radius")?;
                }
                self.points.push(light);
            }
            "linear" => {
                let n = numbers(rest, 8, 9)?;
                let mut light = point(&n)?;
                let fade = above_zero(n.get(7).copied().unwrap_or(0.0), "the fade")?;
                let value = n.get(3).copied().unwrap_or(0.0);
                let (intensity, falloff) = super::entities::linear(value, fade);
                light.intensity *= intensity / (value * POINT_LIGHT_INTENSITY);
                light.falloff = falloff;
                if let Some(&radius) = n.get(8) {
                    light.radius = above_zero(radius, "the radius")?;
                }
                self.points.push(light);
            }
            "spot" => {
                let n = numbers(rest, 11, 12)?;
                let mut light = point(&n)?;
                if let Some(&radius) = n.get(11) {
                    light.radius = above_zero(radius, "the radius")?;
                }
                let aim = vector(&n, 7) - light.origin;
                let angle = n.get(10).copied().unwrap_or(0.0);
                let direction = aim.try_normalize();
                let direction = direction.filter(|_| angle > 0.0 && angle < 90.0);
                let direction = direction
                    .ok_or("a spot needs a target elsewhere and an angle between 0 and 90")?;
                light.spot = Some(Spot {
                    direction,
                    tan_half_angle: angle.to_radians().tan(),
                });
                self.points.push(light);
            }
            "sun" => {
                let n = numbers(rest, 6, 7)?;
                let [intensity, degrees, elevation] = vector(&n, 3).to_array();
                let color = normalise(not_below_zero(vector(&n, 0))?);
                let (sin, cos) = degrees.to_radians().sin_cos();
                let (up, flat) = elevation.to_radians().sin_cos();
                self.suns.push(SunLight {
                    direction: Vec3::new(cos * flat, sin * flat, up).normalize_or(Vec3::Z),
                    irradiance: color * (above_zero(intensity, "the intensity")? * SUN_IRRADIANCE),
                    angular_radius: match n.get(6) {
                        Some(&deviance) if deviance > 0.0 => deviance.min(90.0).to_radians(),
                        _ => DEFAULT_SUN_RADIUS,
                    },
                    material: None,
                });
            }
            "ambient" => self.ambient = Some(colored(&numbers(rest, 4, 4)?)? * AMBIENT_RADIANCE),
            "material" => {
                let (name, rest) = rest.split_first().ok_or("a material's name is missing")?;
                let radiance = colored(&numbers(rest, 4, 4)?)? * SURFACE_LIGHT_RADIANCE;
                self.materials.push(((*name).to_owned(), radiance));
            }
            "scale" => {
                let (what, rest) = rest.split_first().ok_or("points, suns or surfaces?")?;
                let factor = *numbers(rest, 1, 1)?.first().unwrap_or(&1.0);
                if factor < 0.0 {
                    return Err("a factor cannot be below 0".to_owned());
                }
                self.scale.push((kind(what)?, factor));
            }
            "without" => match rest {
                [what] => self.without.push(kind(what)?),
                _ => return Err("points, suns or surfaces?".to_owned()),
            },
            _ => return Err(format!("unknown word {key:?}")),
        }
        Ok(())
    }

    /// Changes a world's lights and rebuilds the lists. Returns the names of materials that the world does not
    /// have.
    pub fn apply(&self, world: &mut RelitWorld) -> Vec<String> {
        let without = |kind: Kind| self.without.contains(&kind);
        let scale = |kind: Kind| {
            let factors = self.scale.iter().filter(|(of, _)| *of == kind);
            let all: f32 = factors.map(|(_, factor)| factor).product();
            if without(kind) { 0.0 } else { all }
        };
        let (points, suns, surfaces) = (
            scale(Kind::Points),
            scale(Kind::Suns),
            scale(Kind::Surfaces),
        );
        for light in &mut world.point_lights {
            light.intensity *= points;
        }
        for sun in &mut world.suns {
            sun.irradiance *= suns;
        }
        for light in &mut world.lights {
            light.radiance *= surfaces;
        }
        for emission in world
            .materials
            .iter_mut()
            .filter_map(|m| m.emission.as_mut())
        {
            emission.strength *= surfaces;
        }
        for summary in &mut world.report.emitters {
            summary.radiance *= surfaces;
        }
        let mut unknown = Vec::new();
        for (name, radiance) in &self.materials {
            if !set_material(world, name, *radiance) {
                unknown.push(name.clone());
            }
        }
        super::remove_triangle_lights(world, |_| false);
        world
            .point_lights
            .retain(|l| l.intensity.max_element() > 0.0);
        world.suns.retain(|s| s.irradiance.max_element() > 0.0);
        world.point_lights.extend(&self.points);
        world.suns.extend(&self.suns);
        world.ambient = self.ambient.unwrap_or(world.ambient);
        world.report.point_lights = world.point_lights.len();
        world.report.suns = world.suns.len();
        super::build_lists(world);
        unknown
    }
}

/// Game path of the light file of a map: its own path with the extension `.lights`.
pub fn lights_file(map: &str) -> String {
    let stem = map.strip_suffix(".bsp").unwrap_or(map);
    format!("{stem}.lights")
}

impl RelitWorld {
    /// Game path of the map's light file: the map's own with the extension `.lights`.
    pub fn lights_file(&self) -> String {
        lights_file(&self.name)
    }

    /// Reads [files of materials](MaterialsByHand), and applies their lines that state light. Their errors become
    /// warnings of the world.
    pub fn emit_by_hand(&mut self, files: &dyn GameFiles) {
        let (by_hand, faults) = MaterialsByHand::load(files, &self.name);
        self.warnings.extend(faults);
        let stated = |material: &WorldMaterial| {
            let finish = by_hand.finish(&material.name, &Finish::default());
            let emitted = match (finish.emission, finish.glow.filter(|glow| glow.lights)) {
                (Some((value, color)), _) => color * value * SURFACE_LIGHT_RADIANCE,
                (None, Some(glow)) => {
                    // a missing image is reported where the surface is drawn
                    let (image, _) = crate::image::load(files, &glow.image).ok()??;
                    image.mean_linear() * glow.radiance
                }
                (None, None) => return None,
            };
            Some((material.name.clone(), emitted))
        };
        let file = LightsByHand {
            materials: self.materials.iter().filter_map(stated).collect(),
            ..LightsByHand::default()
        };
        if !file.materials.is_empty() {
            file.apply(self);
        }
        self.by_hand = by_hand;
    }

    /// Applies files of materials, then the file of lights beside the map.
    pub fn read_by_hand(&mut self, files: &dyn GameFiles) {
        self.emit_by_hand(files);
        self.light_by_hand(files);
    }

    /// Applies the [file](LightsByHand) beside the map; whether there is one. Its errors become warnings of the world.
    pub fn light_by_hand(&mut self, files: &dyn GameFiles) -> bool {
        let path = self.lights_file();
        let bytes = match files.read(&path) {
            Ok(Some(bytes)) => bytes,
            Ok(None) => return false,
            Err(problem) => {
                self.warnings.push(problem.to_string());
                return false;
            }
        };
        let (file, wrong) = LightsByHand::parse(&String::from_utf8_lossy(&bytes));
        let unknown = file.apply(self);
        let wrong = wrong.iter().map(|problem| format!("{path}: {problem}"));
        self.warnings.extend(wrong);
        let unknown = unknown
            .iter()
            .map(|name| format!("{path}: material {name} is not in the map"));
        self.warnings.extend(unknown);
        true
    }
}

/// Sets the emission of a material's surfaces; `false` if no material has this name.
fn set_material(world: &mut RelitWorld, name: &str, radiance: Vec3) -> bool {
    let chosen: Vec<u32> = (0u32..)
        .zip(&world.materials)
        .filter(|(_, m)| m.name.eq_ignore_ascii_case(name))
        .map(|(i, _)| i)
        .collect();
    super::remove_triangle_lights(world, |material| chosen.contains(&material));
    for &index in &chosen {
        if let Some(material) = world.materials.get_mut(index as usize) {
            let source = if material.is_sky() {
                EmissionSource::Sky
            } else {
                EmissionSource::SurfaceLight
            };
            material.emission = Some(Emission::of(material, source, radiance));
        }
    }
    super::add_triangle_lights_of(world, |material| chosen.contains(&material));
    !chosen.is_empty()
}

fn kind(word: &str) -> Result<Kind, String> {
    match word.to_ascii_lowercase().as_str() {
        "points" => Ok(Kind::Points),
        "suns" => Ok(Kind::Suns),
        "surfaces" => Ok(Kind::Surfaces),
        _ => Err(format!("{word:?} is none of points, suns, surfaces")),
    }
}

fn above_zero(number: f32, what: &str) -> Result<f32, String> {
    let good = number > 0.0;
    good.then_some(number)
        .ok_or_else(|| format!("{what} must be above 0"))
}

fn not_below_zero(color: Vec3) -> Result<Vec3, String> {
    let good = color.min_element() >= 0.0;
    good.then_some(color)
        .ok_or_else(|| "colours cannot be below 0".to_owned())
}

/// `LIGHT R G B`.
fn colored(numbers: &[f32]) -> Result<Vec3, String> {
    let value = numbers.first().copied().unwrap_or(0.0);
    if value < 0.0 {
        return Err("light cannot be below 0".to_owned());
    }
    Ok(normalise(not_below_zero(vector(numbers, 1))?) * value)
}

/// `X Y Z LIGHT R G B`.
fn point(numbers: &[f32]) -> Result<PointLight, String> {
    // A line with fewer numbers was refused before.
    let strength = colored(numbers.get(3..).unwrap_or_default())?;
    if strength == Vec3::ZERO {
        return Err("the light must be above 0".to_owned());
    }
    Ok(PointLight {
        origin: vector(numbers, 0),
        intensity: strength * POINT_LIGHT_INTENSITY,
        radius: DEFAULT_POINT_LIGHT_RADIUS,
        spot: None,
        falloff: Falloff::InverseSquare,
        pulse: None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::TriangleLight;
    use super::*;
    use crate::Options;
    use crate::materials::Materials;
    use crate::sample::Sample;

    const TEXT: &str = "# lamps of the hall
point 8 16 24  300  1 0.5 0   6   // above the door
SPOT 0 0 100 200 1 1 1  0 0 0 30
sun 1 1 0.5 100 90 45
without points
scale surfaces 0.5
ambient 10 1 1 1
material no/such 100 1 1 1
point 1 2 3
point 1 2 3 x 1 1 1
sparkle 7
scale stars 2
sun 1 -1 1 100 0 0
spot 1 2 3 100 1 1 1 1 2 3 30
";

    #[test]
    fn lines_are_read_and_wrong_ones_told() {
        let (file, wrong) = LightsByHand::parse(TEXT);
        assert_eq!(file.points.len(), 2);
        let first = file.points[0];
        assert_eq!(first.origin, Vec3::new(8.0, 16.0, 24.0));
        assert_eq!(first.radius, 6.0);
        let expected = Vec3::new(1.0, 0.5, 0.0) * 300.0 * POINT_LIGHT_INTENSITY;
        assert!((first.intensity - expected).length() < 1.0);
        let spot = file.points[1].spot.unwrap();
        assert_eq!(spot.direction, Vec3::NEG_Z);
        assert!((spot.tan_half_angle - 30f32.to_radians().tan()).abs() < 1e-6);
        let sun = file.suns[0];
        assert!((sun.direction - Vec3::new(0.0, 0.5f32.sqrt(), 0.5f32.sqrt())).length() < 1e-6);
        assert!((sun.irradiance.x - 100.0 * SUN_IRRADIANCE).abs() < 1e-3);
        let lines: Vec<usize> = wrong.iter().map(|w| w.line).collect();
        assert_eq!(lines, [9, 10, 11, 12, 13, 14], "{wrong:?}");
        assert_eq!(
            wrong[0].to_string(),
            "line 9: 7 to 8 numbers belong here, not 3"
        );
    }

    #[test]
    fn linear_lights_are_those_of_entities() {
        let (file, wrong) =
            LightsByHand::parse("linear 1 2 3 300 1 0.5 0 2\nlinear 1 2 3 300 1 1 1 0");
        assert_eq!(wrong.len(), 1, "{wrong:?}");
        let [light] = file.points[..] else {
            panic!("{:?}", file.points)
        };
        let reach = 7500.0 * 300.0 / 8000.0 / 2.0;
        assert_eq!(light.falloff, Falloff::Linear { reach });
        // Up close it stores 7500 · 300 / 8000.
        let near = light.intensity * light.falloff.irradiance(1e-3, 1.0) / SUN_IRRADIANCE;
        let expected = Vec3::new(1.0, 0.5, 0.0) * (7500.0 * 300.0 / 8000.0);
        assert!((near - expected).length() < 0.1, "{near}");
    }

    /// The sample map, not calibrated.
    fn load(files: &crate::files::MemoryFiles) -> RelitWorld {
        let (materials, _) = Materials::load(files);
        let options = Options {
            calibrate: None,
            ..Options::default()
        };
        RelitWorld::load(files, &materials, Sample::Hall.map(), options).unwrap()
    }

    #[test]
    fn a_file_beside_the_map_changes_its_lights() {
        let mut files = Sample::Hall.files().unwrap();
        let plain = load(&files);
        assert!(plain.lights.len() > 1 && plain.warnings.is_empty());
        let lamp = plain.surfaces[plain.lights[0].surface as usize].material;
        let name = plain.materials[lamp as usize].name.clone();
        let text = format!("{TEXT}\nmaterial {name} 0 1 1 1\n");
        files.insert(&plain.lights_file(), text).unwrap();
        let lit = load(&files);
        assert_eq!(lit.point_lights.len(), 2);
        assert!(lit.warnings.iter().any(|w| w.contains(".lights: line 9")));
        assert!(lit.warnings.iter().any(|w| w.contains("no/such")));
        let out = |l: &TriangleLight| lit.surfaces[l.surface as usize].material == lamp;
        assert!(!lit.lights.iter().any(out));
        assert!((lit.ambient - 10.0 * AMBIENT_RADIANCE).length() < 1e-5);
        // What is left shines half as bright, and is listed.
        for light in &lit.lights {
            let before = plain
                .lights
                .iter()
                .find(|l| l.surface == light.surface)
                .unwrap();
            assert!((light.radiance - before.radiance * 0.5).length() < 1e-5);
        }
        let all = lit.light_lists.row(-1);
        assert_eq!(all.len(), lit.lights.len() + 2);
    }

    #[test]
    fn files_of_materials_state_light_that_files_of_lights_override() {
        let mut files = Sample::Hall.files().unwrap();
        let plain = load(&files);
        let lamp = plain.surfaces[plain.lights[0].surface as usize].material;
        let name = plain.materials[lamp as usize].name.clone();
        let of_lamp = |world: &RelitWorld| -> Vec<Vec3> {
            let lit = |l: &&TriangleLight| world.surfaces[l.surface as usize].material == lamp;
            world
                .lights
                .iter()
                .filter(lit)
                .map(|l| l.radiance)
                .collect()
        };
        let path = crate::materials::by_hand::materials_file(&plain.name);
        files
            .insert(&path, format!("emit {name} 51 2 1 1\nemit {name} x\n"))
            .unwrap();
        let lit = load(&files);
        let expected = Vec3::new(1.0, 0.5, 0.5) * 51.0 * SURFACE_LIGHT_RADIANCE;
        assert!(!of_lamp(&lit).is_empty());
        assert!(
            of_lamp(&lit)
                .iter()
                .all(|r| (*r - expected).length() < 1e-5)
        );
        assert_eq!(lit.warnings.len(), 1, "{:?}", lit.warnings);
        assert!(lit.warnings[0].contains(".materials: line 2"));
        files
            .insert(&plain.lights_file(), format!("material {name} 0 1 1 1\n"))
            .unwrap();
        assert!(of_lamp(&load(&files)).is_empty());
    }
}
