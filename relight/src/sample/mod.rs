//! Small games made in memory: maps, their materials and their textures, all computed here. They show what the renderer
//! does without any game's data: a vaulted hall in the evening with coloured windows, a mirror, a pool that is lit from
//! below, a ball of crystal, lanterns that flicker, fog and sky; and a room of surfaces that reflect in different ways.

mod furniture;
mod hall;
mod light;
mod plan;
mod scene;
mod surfaces;
#[cfg(test)]
mod tests;
mod textures;
mod windows;

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use q3bsp::{Bsp, ShaderId, content_flags, surface_flags};

use crate::files::{FileError, MemoryFiles};
use light::{DARK, Lighting};
use scene::{Scene, add_places};

/// A built-in sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sample {
    /// The hall.
    #[default]
    Hall,
    /// The room of surfaces.
    Surfaces,
}

impl Sample {
    /// All samples.
    pub const ALL: [Sample; 2] = [Sample::Hall, Sample::Surfaces];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Sample::Hall => "hall",
            Sample::Surfaces => "surfaces",
        }
    }

    /// Game path of its map.
    pub fn map(self) -> &'static str {
        match self {
            Sample::Hall => "maps/sample.bsp",
            Sample::Surfaces => surfaces::MAP,
        }
    }

    /// Paths and contents of its files: scripts, textures, map.
    pub fn entries(self) -> Vec<(String, Vec<u8>)> {
        let (texts, images, bsp) = match self {
            Sample::Hall => (&TEXTS[..], textures::images(), build_map()),
            Sample::Surfaces => (
                &surfaces::TEXTS[..],
                surfaces::images(),
                surfaces::build_map(),
            ),
        };
        let texts = texts
            .iter()
            .map(|(path, text)| (path.to_string(), text.as_bytes().to_vec()));
        let map = (self.map().to_owned(), bsp.write());
        texts.chain(images).chain([map]).collect()
    }

    /// The sample as game files.
    ///
    /// # Errors
    /// None in practice: all paths are well-formed.
    pub fn files(self) -> Result<MemoryFiles, FileError> {
        let mut files = MemoryFiles::new();
        for (path, bytes) in self.entries() {
            files.insert(&path, bytes)?;
        }
        Ok(files)
    }
}

/// Script of the hall.
const TEXTS: [(&str, &str); 1] = [("scripts/sample.shader", include_str!("sample.shader"))];

/// Distance of the points of the light grid.
const GRID: Vec3 = Vec3::new(64.0, 64.0, 96.0);

/// The map's materials.
struct Shaders {
    stone: ShaderId,
    floor: ShaderId,
    coffer: ShaderId,
    fluted: ShaderId,
    marble: ShaderId,
    bronze: ShaderId,
    wood: ShaderId,
    mosaic: ShaderId,
    grate: ShaderId,
    mirror: ShaderId,
    /// Amber, ruby, azure.
    glass: [ShaderId; 3],
    crystal: ShaderId,
    water: ShaderId,
    mist: ShaderId,
    sky: ShaderId,
    lamp_warm: ShaderId,
    lamp_teal: ShaderId,
    lamp_rose: ShaderId,
}

impl Shaders {
    fn of(map: &mut MapBuilder) -> Shaders {
        let mut add = |name: &str, surface: u32, content: u32| {
            map.add_shader(&format!("sample/{name}"), surface, content)
        };
        let solid = content_flags::SOLID;
        Shaders {
            stone: add("stone", 0, solid),
            floor: add("floor", 0, solid),
            coffer: add("coffer", 0, solid),
            fluted: add("fluted", 0, solid),
            marble: add("marble", 0, solid),
            bronze: add("bronze", 0, solid),
            wood: add("wood", 0, solid),
            mosaic: add("mosaic", 0, solid),
            grate: add("grate", 0, solid),
            mirror: add("mirror", 0, solid),
            glass: ["glass_amber", "glass_ruby", "glass_azure"].map(|name| add(name, 0, solid)),
            crystal: add("crystal", 0, 0),
            water: add("water", 0, content_flags::WATER),
            mist: add("mist", 0, content_flags::FOG),
            sky: add("sky", surface_flags::SKY, solid),
            lamp_warm: add("lamp_warm", 0, solid),
            lamp_teal: add("lamp_teal", 0, solid),
            lamp_rose: add("lamp_rose", 0, solid),
        }
    }

    /// Those that do not stop light.
    fn clear(&self) -> [ShaderId; 11] {
        let [amber, ruby, azure] = self.glass;
        [
            amber,
            ruby,
            azure,
            self.grate,
            self.crystal,
            self.water,
            self.mist,
            self.sky,
            self.lamp_warm,
            self.lamp_teal,
            self.lamp_rose,
        ]
    }
}

/// Where the camera and the players begin.
const PLACES: [(&str, &str, &str); 5] = [
    ("info_player_intermission", "-432 -60 76", "-3 2 0"),
    ("info_player_deathmatch", "-390 60 24", "0 -4 0"),
    ("info_player_deathmatch", "380 -80 24", "0 165 0"),
    ("info_player_deathmatch", "630 20 40", "0 181 0"),
    ("info_player_deathmatch", "-330 210 24", "0 -25 0"),
];

/// Places for players and cameras, and the entity that makes a mirror of the mirror.
fn add_entities(map: &mut MapBuilder) {
    map.set_world_key("message", "Relight sample");
    add_places(map, &PLACES);
    let (mirror, _) = furniture::MIRROR;
    let at = mirror + furniture::MIRROR_NORMAL * 4.0;
    let origin = format!("{} {} {}", at.x, at.y, at.z);
    map.add_entity(&[("classname", "misc_portal_surface"), ("origin", &origin)]);
}

/// The boxes of open space.
fn add_cells(map: &mut MapBuilder) {
    let (length, width) = (plan::LENGTH, plan::WIDTH);
    map.add_cell(
        Vec3::new(-length, -width, -48.0),
        Vec3::new(0.0, width, 400.0),
    );
    map.add_cell(
        Vec3::new(0.0, -width, -48.0),
        Vec3::new(length, width, 400.0),
    );
    map.add_cell(
        Vec3::new(length, -240.0, 0.0),
        Vec3::new(plan::TERRACE, 240.0, 400.0),
    );
    map.add_cell(
        Vec3::new(-length, -336.0, 0.0),
        Vec3::new(length, -width, 300.0),
    );
}

fn build_map() -> Bsp {
    let mut scene = Scene::new();
    let shaders = Shaders::of(&mut scene.map);
    hall::build(&mut scene, &shaders);
    windows::build(&mut scene, &shaders);
    let lamps = furniture::build(&mut scene, &shaders);
    let fog = furniture::mist(&mut scene, &shaders);
    scene.pack();
    let Scene { mut map, places } = scene;
    for place in &places {
        let mut corners = map.vertices_mut(place.surface).iter();
        if corners.all(|corner| corner.position.x > plan::LENGTH) {
            map.set_fog(place.surface, fog);
        }
    }
    add_entities(&mut map);
    add_cells(&mut map);
    let mut bsp = map.build_with_grid(GRID, |_| DARK);

    let clear = shaders.clear();
    let stops: Vec<bool> = (bsp.surfaces.iter())
        .map(|surface| !clear.contains(&surface.shader))
        .collect();
    let lighting = Lighting::new(&bsp, &lamps, true, |surface| {
        stops.get(surface) == Some(&true)
    });
    lighting.store(&mut bsp, &places);
    bsp
}
