//! `relight cameras`: camera positions in maps, chosen by a rule.

use anyhow::{Context, Result, bail};
use clap::Args;
use glam::Vec3;
use relight::GameFiles;
use relight::viewpoints::{self, VIEW_HEIGHT, Viewpoint};

use crate::game::Game;
use crate::view::{map_name, open};

/// List camera positions in maps: intermission cameras and spawn points
///
/// Prints a line for each: the map, a tab, and X Y Z YAW for the game's setviewpos. The camera is 26 units above.
///
/// Examples: relight cameras oa_dm1; relight cameras --views 1 --every 3
#[derive(Args, Debug)]
pub struct CamerasArgs {
    #[command(flatten)]
    game: Game,
    /// Views of each map: the camera of the intermission first, then spawn points, evenly out of the map's list
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = crate::numbers::count)]
    views: usize,
    /// Step through the alphabetical list of all maps, if no map is named
    #[arg(long, default_value_t = 1, value_parser = crate::numbers::count)]
    every: usize,
    /// Number of maps to skip at the start of that list
    #[arg(long, default_value_t = 0)]
    skip: usize,
    /// Maps: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) with one map, or pack.pk3:maps/x.bsp. Without
    /// any: all maps of the game where a player can appear
    #[arg(value_name = "MAP")]
    maps: Vec<String>,
}

/// A player's position: whole units and degrees, for `setviewpos`.
pub struct Place {
    /// Player origin, units.
    pub origin: Vec3,
    /// Yaw, degrees.
    pub yaw: f32,
}

/// Prints a line for each place: the map, a tab, `x y z yaw` for the game's `setviewpos`.
///
/// # Errors
/// A map cannot be read, or a named map has no place for a player.
pub fn run(args: &CamerasArgs) -> Result<()> {
    let mut found = Vec::new();
    if args.maps.is_empty() {
        let files = args.game.files()?;
        let listed = files.list("maps", ".bsp");
        let mut maps: Vec<String> = (listed.iter())
            .filter_map(|file| file.strip_suffix(".bsp"))
            .map(str::to_lowercase)
            .collect();
        maps.sort();
        maps.dedup();
        for map in maps {
            let places = places_of(&files, &format!("maps/{map}.bsp"), args.views)?;
            if !places.is_empty() {
                found.push((map, places));
            }
        }
        found = (found.into_iter().skip(args.skip))
            .step_by(args.every)
            .collect();
    } else {
        for map in &args.maps {
            let (files, path) = open(map, &args.game)?;
            let places = places_of(&*files, &path, args.views)?;
            if places.is_empty() {
                bail!("{path}: no player can appear there");
            }
            found.push((map_name(&path).to_owned(), places));
        }
    }
    for (map, places) in found {
        for Place { origin, yaw } in places {
            println!("{map}\t{} {} {} {yaw}", origin.x, origin.y, origin.z);
        }
    }
    Ok(())
}

/// The places of one map.
fn places_of(files: &dyn GameFiles, path: &str, count: usize) -> Result<Vec<Place>> {
    let Some(bytes) = files.read(path)? else {
        bail!("{path} is not in the game folders");
    };
    let bsp = q3bsp::Bsp::parse(&bytes).with_context(|| path.to_owned())?;
    Ok(places(&bsp.entities(), count))
}

/// The intermission camera and spawn points, at most `count`.
pub fn places(entities: &[q3bsp::Entity], count: usize) -> Vec<Place> {
    let mut views: Vec<Viewpoint> = viewpoints::intermission(entities).into_iter().collect();
    let spawns: Vec<_> = viewpoints::spawn_views(entities).collect();
    let wanted = count.saturating_sub(views.len()).min(spawns.len());
    views.extend((0..wanted).filter_map(|i| spawns.get(i * spawns.len() / wanted)));
    views.truncate(count);
    let place = |view: Viewpoint| Place {
        origin: (view.origin - Vec3::Z * VIEW_HEIGHT).round(),
        yaw: view.yaw.round(),
    };
    views.into_iter().map(place).collect()
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
