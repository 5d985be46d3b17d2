//! `relight cameras`: places to look at maps from, chosen by a rule.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use glam::Vec3;
use relight::{GameFiles, SearchPath};

/// The game puts players this much above their spawn point.
const SPAWN_LIFT: f32 = 9.0;
/// Height of the eyes above the player's origin.
pub const EYES: f32 = 26.0;

/// Options of `relight cameras`.
#[derive(Args, Debug)]
pub struct CamerasArgs {
    /// Game folder with packs; give several in rising priority
    #[arg(
        long = "game",
        value_name = "DIR",
        default_value = "/usr/share/games/openarena/baseoa"
    )]
    games: Vec<PathBuf>,
    /// Places of each map: the camera of the intermission first, then spawn points, evenly out of the map's list
    #[arg(long, default_value_t = 3, value_parser = crate::numbers::count)]
    each: usize,
    /// Every how many maps of the list in alphabetical order, when none is named
    #[arg(long, default_value_t = 1, value_parser = crate::numbers::count)]
    every: usize,
    /// How many maps of that list are left out at its start
    #[arg(long, default_value_t = 0)]
    skip: usize,
    /// Maps by name. Without any: all maps of the game folders where a player can appear
    maps: Vec<String>,
}

/// Where a player is put: origin and turn, whole units and degrees as `setviewpos` takes them.
pub struct Place {
    /// Units.
    pub origin: Vec3,
    /// Degrees.
    pub yaw: f32,
}

/// Prints a line for each place: the map, a tab, `x y z yaw` for the game's `setviewpos`.
pub fn run(args: &CamerasArgs) -> Result<()> {
    let files = SearchPath::open(&args.games)?;
    let named = !args.maps.is_empty();
    let mut maps = args.maps.clone();
    if !named {
        let bsps = files.list("maps", ".bsp");
        maps = bsps
            .iter()
            .filter_map(|file| file.strip_suffix(".bsp"))
            .map(str::to_lowercase)
            .collect();
        maps.sort();
        maps.dedup();
    }
    let mut playable = Vec::new();
    for map in maps {
        let path = format!("maps/{map}.bsp");
        let Some(bytes) = files.read(&path)? else {
            bail!("{path} is not in the game folders");
        };
        let bsp = q3bsp::Bsp::parse(&bytes).with_context(|| path.clone())?;
        let places = places(&bsp.entities(), args.each);
        if places.is_empty() && named {
            bail!("{path}: no player can appear there");
        }
        if !places.is_empty() {
            playable.push((map, places));
        }
    }
    let step = if named { 1 } else { args.every };
    let skip = if named { 0 } else { args.skip };
    for (map, places) in playable.iter().skip(skip).step_by(step) {
        for Place { origin, yaw } in places {
            println!("{map}\t{} {} {} {yaw}", origin.x, origin.y, origin.z);
        }
    }
    Ok(())
}

/// The intermission's camera and spawn points, `count` at most.
pub fn places(entities: &[q3bsp::Entity], count: usize) -> Vec<Place> {
    let mut places = Vec::new();
    let intermission = entities
        .iter()
        .find(|e| e.classname() == "info_player_intermission");
    if let Some(entity) = intermission {
        places.push(place(entity, entities, -EYES));
    }
    let spawns: Vec<_> = entities
        .iter()
        .filter(|entity| relight::is_spawn_point(entity))
        .collect();
    let wanted = count.saturating_sub(places.len()).min(spawns.len());
    let chosen = (0..wanted).filter_map(|i| spawns.get(i * spawns.len() / wanted));
    places.extend(chosen.map(|e| place(e, entities, SPAWN_LIFT)));
    places.truncate(count);
    places
}

fn place(entity: &q3bsp::Entity, entities: &[q3bsp::Entity], lift: f32) -> Place {
    let origin = entity.vec3("origin").unwrap_or_default();
    // a camera with a target looks at it
    let target = entity.get("target").and_then(|name| {
        let named = |e: &&q3bsp::Entity| e.get("targetname") == Some(name);
        entities.iter().find(named)?.vec3("origin")
    });
    let turn = || {
        let angles = entity.vec3("angles").map(|angles| angles.y);
        angles.or(entity.number("angle")).unwrap_or(0.0)
    };
    let yaw = target.map_or_else(turn, |target| {
        let to = target - origin;
        to.y.atan2(to.x).to_degrees()
    });
    Place {
        origin: (origin + Vec3::Z * lift).round(),
        yaw: yaw.round(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
        { "classname" "worldspawn" }
        { "classname" "info_player_deathmatch" "origin" "1 0 0" "angle" "90" }
        { "classname" "info_player_deathmatch" "origin" "2 0 0" "angles" "0 45 0" }
        { "classname" "team_CTF_redspawn" "origin" "3 0 0" }
        { "classname" "team_CTF_redflag" "origin" "9 0 0" }
        { "classname" "info_player_intermission" "origin" "0 0 100" "target" "t" }
        { "classname" "target_position" "targetname" "t" "origin" "0 -50 0" }
    "#;

    fn summary(count: usize) -> Vec<(f32, f32, f32)> {
        let (entities, _) = q3bsp::entities::parse(TEXT.as_bytes());
        places(&entities, count)
            .iter()
            .map(|p| (p.origin.x, p.origin.z, p.yaw))
            .collect()
    }

    #[test]
    fn intermission_then_spawn_points_spread_over_the_list() {
        assert_eq!(summary(1), [(0.0, 74.0, -90.0)]);
        assert_eq!(summary(2), [(0.0, 74.0, -90.0), (1.0, 9.0, 90.0)]);
        assert_eq!(summary(3)[1..], [(1.0, 9.0, 90.0), (2.0, 9.0, 45.0)]);
        assert_eq!(summary(9).len(), 4);
        assert!(summary(0).is_empty());
    }
}
