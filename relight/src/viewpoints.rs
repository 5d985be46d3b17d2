//! Where games set players, and what these see.

use glam::Vec3;
use q3bsp::Entity;

/// Height of the camera above a player's origin, id units.
pub const VIEW_HEIGHT: f32 = 26.0;
/// How far above its spawn point the game sets a player's origin, id units.
pub const SPAWN_LIFT: f32 = 9.0;

/// A place to look from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Viewpoint {
    /// Camera position, id units.
    pub origin: Vec3,
    /// Degrees from east to north.
    pub yaw: f32,
    /// Degrees down.
    pub pitch: f32,
}

impl Viewpoint {
    /// Axes: forward, left, up.
    pub fn axis(&self) -> [Vec3; 3] {
        let (sy, cy) = self.yaw.to_radians().sin_cos();
        let (sp, cp) = self.pitch.to_radians().sin_cos();
        [
            Vec3::new(cp * cy, cp * sy, -sp),
            Vec3::new(-sy, cy, 0.0),
            Vec3::new(sp * cy, sp * sy, cp),
        ]
    }
}

/// Whether the game sets players at an entity: `info_player_deathmatch` and `info_player_start`, those of other games
/// (`info_player_team1`, `info_player_race`), and those of teams (`team_CTF_redspawn`, `team_CTF_redplayer`). The
/// intermission's camera is none.
pub fn is_spawn_point(entity: &Entity) -> bool {
    let class = entity.classname().to_ascii_lowercase();
    let team =
        class.starts_with("team_") && (class.ends_with("spawn") || class.ends_with("player"));
    team || class.starts_with("info_player_") && class != "info_player_intermission"
}

/// Whether it is the camera of the intermission.
pub fn is_intermission(entity: &Entity) -> bool {
    (entity.classname()).eq_ignore_ascii_case("info_player_intermission")
}

/// Where the entity is that another one names as its target.
pub fn target(entity: &Entity, entities: &[Entity]) -> Option<Vec3> {
    let name = entity.get("target")?;
    let is_named = |e: &&Entity| {
        let own = e.get("targetname");
        own.is_some_and(|own| own.eq_ignore_ascii_case(name))
    };
    entities.iter().find(is_named)?.vec3("origin")
}

/// The camera of the intermission, which looks at its target; `None` for a map without one.
pub fn intermission(entities: &[Entity]) -> Option<Viewpoint> {
    let entity = entities.iter().find(|e| is_intermission(e))?;
    // An entity without an origin is at 0, as in the engine.
    let origin = entity.vec3("origin").unwrap_or_default();
    let to = target(entity, entities).map(|target| target - origin);
    if let Some(to) = to.filter(|to| to.length() > 1.0) {
        return Some(Viewpoint {
            origin,
            yaw: to.y.atan2(to.x).to_degrees(),
            pitch: -to.z.atan2(to.truncate().length()).to_degrees(),
        });
    }
    let pitch = entity.vec3("angles").map_or(0.0, |angles| angles.x);
    let yaw = yaw(entity);
    Some(Viewpoint { origin, yaw, pitch })
}

/// What players see where they appear, in the order of the map.
pub fn spawn_views(entities: &[Entity]) -> impl Iterator<Item = Viewpoint> {
    let spawns = entities.iter().filter(|entity| is_spawn_point(entity));
    spawns.map(|entity| Viewpoint {
        // As above.
        origin: entity.vec3("origin").unwrap_or_default() + Vec3::Z * (SPAWN_LIFT + VIEW_HEIGHT),
        yaw: yaw(entity),
        pitch: 0.0,
    })
}

/// Which way an entity is turned, degrees.
fn yaw(entity: &Entity) -> f32 {
    let turned = entity.vec3("angles").map(|angles| angles.y);
    turned.or(entity.number("angle")).unwrap_or(0.0)
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

    #[test]
    fn players_see_from_above_their_spawn_points_and_the_intermission_looks_at_its_target() {
        let text = r#"
            { "classname" "info_player_deathmatch" "origin" "1 2 3" "angle" "90" "target" "T" }
            { "classname" "Info_Player_Intermission" "origin" "0 0 100" "target" "t" }
            { "classname" "target_position" "targetname" "T" "origin" "0 -100 0" }
        "#;
        let (entities, _) = q3bsp::entities::parse(text.as_bytes());
        let spawn = Viewpoint {
            origin: Vec3::new(1.0, 2.0, 38.0),
            yaw: 90.0,
            pitch: 0.0,
        };
        assert_eq!(spawn_views(&entities).collect::<Vec<_>>(), [spawn]);
        let camera = intermission(&entities).expect("a camera");
        assert_eq!((camera.origin, camera.yaw), (Vec3::Z * 100.0, -90.0));
        assert!((camera.pitch - 45.0).abs() < 1e-4, "{}", camera.pitch);
        assert_eq!(intermission(&entities[..1]), None);
    }
}
