//! A `.map` file: the part on which surfaces depend, and the part that changes the light alone.

use std::hash::{DefaultHasher, Hash, Hasher};

use q3bsp::map_text::{self, MapEntity, MapTextError};
use q3bsp::{Bsp, Entity};

/// Keys of the world that change its light alone.
const LIGHT_KEYS: [&str; 6] = [
    "ambient",
    "_ambient",
    "_color",
    "_mingridlight",
    "_minlight",
    "_minvertexlight",
];

/// Beginnings of the classes of point entities that no compiler makes surfaces of. Others may be models.
const WITHOUT_SURFACES: [&str; 12] = [
    "ammo_",
    "holdable_",
    "info_",
    "item_",
    "light",
    "misc_portal_",
    "misc_teleporter_",
    "path_",
    "shooter_",
    "target_",
    "team_",
    "weapon_",
];

/// A `.map` file.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceText {
    /// The world's keys, then the point entities.
    entities: Vec<Entity>,
    /// Hash of the brushes, the patches, and the keys of the world, of brush entities and of models: what surfaces depend on.
    compiled: u64,
}

impl SourceText {
    /// Reads the text.
    ///
    /// # Errors
    /// It is not complete.
    pub fn parse(text: &[u8]) -> Result<Self, MapTextError> {
        let all = map_text::parse(text)?;
        let mut hash = DefaultHasher::new();
        let targets: Vec<&str> = (all.iter())
            .filter(|found| has_surfaces(found))
            .filter_map(|found| found.entity.get("target"))
            .collect();
        for (index, found) in all.iter().enumerate() {
            let entity = &found.entity;
            let is_target = entity
                .get("targetname")
                .is_some_and(|name| targets.iter().any(|t| t.eq_ignore_ascii_case(name)));
            if index > 0 && !has_surfaces(found) && !is_target {
                continue;
            }
            let lights = |key: &str| LIGHT_KEYS.iter().any(|k| k.eq_ignore_ascii_case(key));
            let pairs = entity
                .pairs
                .iter()
                .filter(|(key, _)| index > 0 || !lights(key));
            pairs.for_each(|pair| pair.hash(&mut hash));
            (found.brushes, found.geometry).hash(&mut hash);
        }
        let entities = all.into_iter().enumerate();
        let entities = entities.filter(|(index, found)| *index == 0 || found.brushes == 0);
        Ok(Self {
            entities: entities.map(|(_, found)| found.entity).collect(),
            compiled: hash.finish(),
        })
    }

    /// The world's keys, then the point entities.
    pub fn entities(&self) -> &[Entity] {
        &self.entities
    }

    /// Whether a compiler makes the same surfaces of both.
    pub fn compiles_as(&self, other: &Self) -> bool {
        self.compiled == other.compiled
    }

    /// A compiled map with the point entities, and the light of the world, of this text: compilers remove light entities.
    /// Brush entities stay, because they name models of the compiled map.
    pub fn light(&self, bsp: &mut Bsp) {
        let lights =
            |(key, _): &&(String, String)| LIGHT_KEYS.iter().any(|k| k.eq_ignore_ascii_case(key));
        let mut compiled = bsp.entities().into_iter();
        let mut world = compiled.next().unwrap_or_default();
        world.pairs.retain(|pair| !lights(&pair));
        let mut own = self.entities.iter();
        let own_world = own.next();
        world.pairs.extend(
            own_world
                .iter()
                .flat_map(|e| e.pairs.iter().filter(lights).cloned()),
        );
        let models = compiled.filter(|entity| entity.brush_model().is_some());
        let is_model = |entity: &&Entity| {
            entity
                .classname()
                .to_ascii_lowercase()
                .starts_with("misc_model")
        };
        let points = own.filter(|entity| !is_model(entity)).cloned();
        let entities: Vec<Entity> = std::iter::once(world).chain(models).chain(points).collect();
        bsp.entities = q3bsp::entities::write(&entities);
    }
}

/// Whether a compiler may make surfaces of an entity.
fn has_surfaces(found: &MapEntity) -> bool {
    let class = found.entity.classname().to_ascii_lowercase();
    found.brushes > 0
        || !WITHOUT_SURFACES
            .iter()
            .any(|begin| class.starts_with(begin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight::GameFiles;
    use relight::sample::Sample;

    const MAP: &str = r#"{
"classname" "worldspawn"
"message" "room"
"ambient" "5"
{
( 0 0 0 ) ( 1 0 0 ) ( 0 1 0 ) base/wall 0 0 0 1 1 0 0 0
}
}
{
"classname" "func_door"
"target" "bell"
{
( 0 0 8 ) ( 1 0 8 ) ( 0 1 8 ) base/door 0 0 0 1 1 0 0 0
}
}
{
"classname" "light"
"origin" "0 0 64"
"target" "floor"
}
{
"classname" "info_null"
"origin" "0 0 0"
"targetname" "floor"
}
{
"classname" "target_speaker"
"origin" "0 0 0"
"targetname" "bell"
}
{
"classname" "misc_model"
"model" "models/tree.md3"
"origin" "9 9 9"
}
"#;

    fn read(text: &str) -> SourceText {
        SourceText::parse(text.as_bytes()).unwrap()
    }

    #[test]
    fn lights_need_no_compiler_and_surfaces_do() {
        let before = read(MAP);
        assert_eq!(before.entities().len(), 5);
        for (from, to, compiles) in [
            ("0 0 64", "0 8 64", false),
            ("\"ambient\" \"5\"", "\"_minlight\" \"9\"", false),
            // what a light is aimed at
            (
                "\"0 0 0\"\n\"targetname\" \"floor\"",
                "\"1 0 0\"\n\"targetname\" \"floor\"",
                false,
            ),
            (
                "{\n\"classname\" \"info_null\"",
                "{\n\"classname\" \"light\"\n}\n{\n\"classname\" \"info_null\"",
                false,
            ),
            ("\"room\"", "\"hall\"", true),
            ("base/wall", "base/floor", true),
            ("\"func_door\"", "\"func_static\"", true),
            ("\"9 9 9\"", "\"9 9 8\"", true),
            // what an entity with surfaces is aimed at, as decals are
            (
                "\"0 0 0\"\n\"targetname\" \"bell\"",
                "\"1 0 0\"\n\"targetname\" \"bell\"",
                true,
            ),
        ] {
            assert!(MAP.contains(from), "{from}");
            let after = read(&MAP.replacen(from, to, 1));
            assert_eq!(!after.compiles_as(&before), compiles, "{from}");
            assert!(after != before, "{from}");
        }
        assert_eq!(read(&MAP.replace('\n', "\r\n")), before);
    }

    #[test]
    fn a_compiled_map_gets_the_lights_of_the_text() {
        let files = Sample::Hall.files().unwrap();
        let bytes = files.read(Sample::Hall.map()).unwrap().unwrap();
        let mut bsp = Bsp::parse(&bytes).unwrap();
        let text = "{ classname worldspawn ambient 7 message other } { classname light origin \"1 2 3\" } { classname misc_model }";
        read(text).light(&mut bsp);
        let written = Bsp::parse(&bsp.write()).unwrap();
        let entities = written.entities();
        assert_eq!(entities[0].get("ambient"), Some("7"));
        assert_ne!(entities[0].get("message"), Some("other"));
        let last = entities.last().unwrap();
        assert_eq!(
            (last.classname(), last.get("origin")),
            ("light", Some("1 2 3"))
        );
        let models = |list: &[Entity]| list.iter().filter(|e| e.brush_model().is_some()).count();
        assert_eq!(
            models(&entities),
            models(&Bsp::parse(&bytes).unwrap().entities())
        );
        assert_eq!(
            written.surfaces.len(),
            Bsp::parse(&bytes).unwrap().surfaces.len()
        );
    }
}
