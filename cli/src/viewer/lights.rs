//! The lights of a map as a list that can be changed, and their handles in the picture.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use glam::Vec3;
use relight::light::{
    ChangeableLights, DEFAULT_POINT_LIGHT_RADIUS, Falloff, LightsByHand, POINT_LIGHT_INTENSITY,
    PointLight, SUN_IRRADIANCE, SURFACE_LIGHT_RADIANCE, SunLight,
};

use crate::pictures::write_whole;

/// Value of a light that is added, as in an entity's `light`.
const NEW_LIGHT: f32 = 300.0;

/// A light.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A point light.
    Point(PointLight),
    /// A sun.
    Sun(SunLight),
    /// The surfaces of a material, and their radiance.
    Material(String, Vec3),
}

/// A light of the list.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// The light.
    pub kind: Kind,
    /// Switched on.
    pub on: bool,
}

impl Item {
    /// Its name in the list; `number`: its place among lights of its kind, from 0.
    pub fn label(&self, number: usize) -> String {
        match &self.kind {
            Kind::Point(light) => {
                let o = light.origin;
                let what = if light.spot.is_some() {
                    "spot"
                } else {
                    "point"
                };
                format!("{what} {number} at {:.0} {:.0} {:.0}", o.x, o.y, o.z)
            }
            Kind::Sun(_) => format!("sun {number}"),
            Kind::Material(name, _) => name.clone(),
        }
    }

    /// Its colour and strength.
    pub fn light(&self) -> Vec3 {
        match &self.kind {
            Kind::Point(light) => light.intensity,
            Kind::Sun(sun) => sun.irradiance,
            Kind::Material(_, radiance) => *radiance,
        }
    }

    /// Sets colour and strength.
    pub fn set_light(&mut self, light: Vec3) {
        match &mut self.kind {
            Kind::Point(point) => point.intensity = light,
            Kind::Sun(sun) => sun.irradiance = light,
            Kind::Material(_, radiance) => *radiance = light,
        }
    }

    /// Unit of its strength, as map compilers count it.
    fn unit(&self) -> f32 {
        match self.kind {
            Kind::Point(_) => POINT_LIGHT_INTENSITY,
            Kind::Sun(_) => SUN_IRRADIANCE,
            Kind::Material(..) => SURFACE_LIGHT_RADIANCE,
        }
    }

    /// Its strength, as `light`, `q3map_sun` and `q3map_surfacelight` give it.
    pub fn strength(&self) -> f32 {
        self.light().max_element() / self.unit()
    }

    /// Sets its strength and keeps its colour.
    pub fn set_strength(&mut self, strength: f32) {
        let light = self.light();
        let color = match light.max_element() {
            0.0 => Vec3::ONE,
            brightest => light / brightest,
        };
        self.set_light(color * (strength * self.unit()));
    }

    /// Where it is; `None` for a sun and a material.
    pub fn origin(&self) -> Option<Vec3> {
        match &self.kind {
            Kind::Point(light) => Some(light.origin),
            Kind::Sun(_) | Kind::Material(..) => None,
        }
    }
}

/// The lights of the loaded map.
#[derive(Debug)]
pub struct Editor {
    /// The lights before hand-written ones.
    before: ChangeableLights,
    /// All lights.
    pub items: Vec<Item>,
    /// Ambient radiance.
    pub ambient: Vec3,
    /// Index of the selected one.
    pub selected: Option<usize>,
    saved: LightsByHand,
}

impl Editor {
    /// The lights before hand-written ones changed them, and now.
    pub fn new(before: ChangeableLights, now: ChangeableLights) -> Self {
        let saved = LightsByHand::between(&before, &now);
        let mut editor = Self {
            before,
            items: Vec::new(),
            ambient: now.ambient,
            selected: None,
            saved,
        };
        editor.list(&now);
        editor
    }

    /// Lists other lights as now; what is saved stays.
    pub fn show(&mut self, now: &ChangeableLights) {
        self.list(now);
    }

    fn list(&mut self, lights: &ChangeableLights) {
        let points = lights.points.iter().map(|light| Kind::Point(*light));
        let suns = lights.suns.iter().map(|sun| Kind::Sun(*sun));
        // a file may switch a material off
        let off = (self.before.materials.iter())
            .filter(|(name, _)| !lights.materials.iter().any(|(other, _)| other == name));
        let materials = lights.materials.iter().chain(off);
        let materials = materials.map(|(name, radiance)| Kind::Material(name.clone(), *radiance));
        let all = points.chain(suns).chain(materials);
        self.items = all
            .map(|kind| {
                let on = match &kind {
                    Kind::Material(name, _) => lights.materials.iter().any(|(n, _)| n == name),
                    Kind::Point(_) | Kind::Sun(_) => true,
                };
                Item { kind, on }
            })
            .collect();
        self.ambient = lights.ambient;
        self.selected = None;
    }

    /// The lights as they are now.
    fn now(&self) -> ChangeableLights {
        let mut lights = ChangeableLights {
            ambient: self.ambient,
            ..ChangeableLights::default()
        };
        for item in &self.items {
            match &item.kind {
                Kind::Point(light) if item.on => lights.points.push(*light),
                Kind::Sun(sun) if item.on => lights.suns.push(*sun),
                Kind::Material(name, radiance) => {
                    let radiance = if item.on { *radiance } else { Vec3::ZERO };
                    lights.materials.push((name.clone(), radiance));
                }
                Kind::Point(_) | Kind::Sun(_) => {}
            }
        }
        lights
    }

    /// The changes as a file.
    pub fn file(&self) -> LightsByHand {
        LightsByHand::between(&self.before, &self.now())
    }

    /// Whether there are changes that are not saved.
    pub fn is_changed(&self) -> bool {
        self.file() != self.saved
    }

    /// Adds a point light and selects it.
    pub fn add(&mut self, origin: Vec3) {
        let light = PointLight {
            origin,
            intensity: Vec3::ONE * (NEW_LIGHT * POINT_LIGHT_INTENSITY),
            radius: DEFAULT_POINT_LIGHT_RADIUS,
            spot: None,
            falloff: Falloff::InverseSquare,
            pulse: None,
        };
        // behind the other point lights, so that these stay as they are
        let is_point = |item: &Item| matches!(item.kind, Kind::Point(_));
        let place = self.items.iter().filter(|item| is_point(item)).count();
        let kind = Kind::Point(light);
        self.items.insert(place, Item { kind, on: true });
        self.selected = Some(place);
    }

    /// Removes the selected light: a material's surfaces are switched off.
    pub fn remove_selected(&mut self) {
        let Some(index) = self.selected.filter(|index| *index < self.items.len()) else {
            return;
        };
        if let Kind::Material(..) = self.items[index].kind {
            self.items[index].on = false;
        } else {
            self.items.remove(index);
            self.selected = None;
        }
    }

    /// Discards every change, also those of the file.
    pub fn reset(&mut self) {
        let before = self.before.clone();
        self.list(&before);
    }

    /// Selects the light of a material, if it has one.
    pub fn select_material(&mut self, name: &str) {
        let is_it = |item: &Item| matches!(&item.kind, Kind::Material(n, _) if n == name);
        self.selected = self.items.iter().position(is_it).or(self.selected);
    }

    /// Writes the changes; comments at the head of an existing file are kept.
    ///
    /// # Errors
    /// The file cannot be read or written.
    pub fn save(&mut self, path: &Path) -> Result<()> {
        let file = self.file();
        let old = match std::fs::read(path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(e) => bail!("{}: cannot be read: {e}", path.display()),
        };
        let is_comment = |line: &&str| {
            let line = line.trim();
            line.starts_with('#') || line.starts_with("//") || line.is_empty()
        };
        let mut text: String = (old.lines().take_while(is_comment))
            .map(|line| format!("{line}\n"))
            .collect();
        if text.is_empty() {
            text.push_str("# Lights by hand, written by relight view\n");
        }
        text.push_str(&file.to_string());
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        write_whole(path, text.as_bytes())?;
        self.saved = file;
        Ok(())
    }
}

/// Where the lights of a map are saved: `--lights-file`, the file beside the map's own file, or that of the last game
/// folder. `None`: nowhere, as for the sample.
pub fn lights_path(
    chosen: Option<&PathBuf>,
    map: Option<&str>,
    name: &str,
    games: &[PathBuf],
) -> Option<PathBuf> {
    if let Some(path) = chosen {
        return Some(path.clone());
    }
    let file = Path::new(map?);
    if file.is_file()
        && file
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("bsp"))
    {
        return Some(file.with_extension("lights"));
    }
    let folder = games.iter().rev().find(|game| game.is_dir())?;
    let stem = name.strip_suffix(".bsp").unwrap_or(name);
    Some(folder.join(format!("{stem}.lights")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lights() -> ChangeableLights {
        let (file, wrong) = LightsByHand::parse("point 1 2 3 100 1 0.5 0.25\nsun 1 1 1 50 10 20");
        assert!(wrong.is_empty());
        let mut lights = ChangeableLights::default();
        lights.materials.push(("lamp".into(), Vec3::ONE));
        // by way of a file, whose fields are private
        let all = LightsByHand::between(&ChangeableLights::default(), &lights);
        assert!(!all.is_empty() && !file.is_empty());
        let mut editor = Editor::new(lights.clone(), lights.clone());
        editor.add(Vec3::new(1.0, 2.0, 3.0));
        editor.now()
    }

    #[test]
    fn changes_become_a_file_and_are_saved_below_the_comments() {
        let before = lights();
        let mut editor = Editor::new(before.clone(), before);
        assert!(!editor.is_changed());
        editor.add(Vec3::new(10.0, 20.0, 30.0));
        assert!(editor.is_changed());
        let text = editor.file().to_string();
        assert!(text.starts_with("point 10 20 30 300 1 1 1"), "{text}");
        // the light of the map is switched off: all point lights are written
        editor.items[0].on = false;
        let text = editor.file().to_string();
        assert!(text.starts_with("without points\npoint 10 20 30"), "{text}");
        editor.select_material("lamp");
        editor.remove_selected();
        assert!(editor.file().to_string().contains("material lamp 0"));

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("maps/x.lights");
        editor.save(&path).unwrap();
        assert!(!editor.is_changed());
        let written = std::fs::read_to_string(&path).unwrap();
        assert!(written.starts_with("# "), "{written}");
        std::fs::write(&path, format!("// mine\n\n{}", editor.file())).unwrap();
        editor.reset();
        assert!(editor.is_changed());
        editor.save(&path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "// mine\n\n");
    }

    #[test]
    fn lights_are_saved_beside_the_map() {
        let folder = tempfile::tempdir().unwrap();
        let map = folder.path().join("room.bsp");
        std::fs::write(&map, "x").unwrap();
        let map = map.display().to_string();
        let game = vec![folder.path().to_owned()];
        let path = |chosen: Option<&PathBuf>, map: &str| {
            lights_path(chosen, Some(map), "maps/room.bsp", &game)
        };
        assert_eq!(path(None, &map), Some(folder.path().join("room.lights")));
        assert_eq!(
            path(None, "room"),
            Some(folder.path().join("maps/room.lights"))
        );
        let chosen = PathBuf::from("else.lights");
        assert_eq!(path(Some(&chosen), &map), Some(chosen));
    }
}
