//! Where games set players.

use q3bsp::Entity;

/// Whether the game sets players at an entity: `info_player_deathmatch` and `info_player_start`, those of other games
/// (`info_player_team1`, `info_player_race`), and those of teams (`team_CTF_redspawn`, `team_CTF_redplayer`). The
/// intermission's camera is none.
pub fn is_spawn_point(entity: &Entity) -> bool {
    let class = entity.classname().to_ascii_lowercase();
    let team =
        class.starts_with("team_") && (class.ends_with("spawn") || class.ends_with("player"));
    team || class.starts_with("info_player_") && class != "info_player_intermission"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn players_appear_at_spawn_points_of_any_game() {
        let is = |class: &str| {
            let text = format!("{{ \"classname\" \"{class}\" }}");
            let (entities, _) = q3bsp::entities::parse(text.as_bytes());
            entities.first().is_some_and(is_spawn_point)
        };
        for class in [
            "info_player_deathmatch",
            "info_player_start",
            "INFO_PLAYER_START",
            "info_player_team1",
            "info_player_race",
            "team_CTF_redspawn",
            "team_CTF_blueplayer",
        ] {
            assert!(is(class), "{class}");
        }
        for class in [
            "info_player_intermission",
            "info_notnull",
            "team_CTF_redflag",
            "team_redobelisk",
            "worldspawn",
        ] {
            assert!(!is(class), "{class}");
        }
    }
}
