//! What the library answers about models and the world: tags, bounds, entities, light, visibility, marks.

use super::support::{engine_in_map, for_every_engine};
use glam::Vec3;
use tests::maps::{ELSEWHERE, HERE};

for_every_engine!(
    models_answer,
    the_world_answers,
    marks_are_clipped_to_surfaces,
);

fn models_answer() {
    let mut engine = engine_in_map();
    let model = engine.register_model("models/test.md3").unwrap();
    assert_eq!(engine.register_model("models/test.md3").unwrap(), model);
    assert_eq!(engine.register_model("models/nothing.md3").unwrap(), 0);
    assert!(engine.register_skin("models/test.skin").unwrap() > 0);
    let tag = engine
        .lerp_tag(model, [0, 1], 0.25, "tag_top")
        .unwrap()
        .unwrap();
    assert_eq!(tag.origin, [0.0, 0.0, 20.0]);
    assert_eq!(
        tag.axis,
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    );
    assert_eq!(
        engine.lerp_tag(model, [0, 1], 0.0, "tag_none").unwrap(),
        None
    );
    assert_eq!(
        engine.model_bounds(model).unwrap(),
        (Vec3::new(0.0, -16.0, -16.0), Vec3::new(0.0, 16.0, 16.0))
    );
    // the map itself is inline model 0
    let world = engine.register_model("*0").unwrap();
    assert!(world > 0);
    let (low, high) = engine.model_bounds(world).unwrap();
    assert!(low.x <= -256.0 && high.x >= 1256.0, "{low} {high}");
    assert_eq!(engine.register_model("*77").unwrap(), 0);
    engine.assert_clean();
}

fn the_world_answers() {
    let mut engine = engine_in_map();
    // ambient and directed light: shifted by two overbright bits, brought back into range, scaled by
    // r_ambientScale 0.6 and r_directedScale 1
    let [ambient, directed, direction] = engine.light_for_point(HERE).unwrap().unwrap();
    assert!(
        (ambient - Vec3::new(127.0, 191.0, 255.0) * 0.6).length() < 2.0,
        "{ambient}"
    );
    assert!(
        (directed - Vec3::new(255.0, 127.0, 63.0)).length() < 2.0,
        "{directed}"
    );
    assert!((direction - Vec3::Z).length() < 0.02, "{direction}");

    assert!(engine.in_pvs(HERE, HERE + Vec3::Y * 50.0).unwrap());
    assert!(!engine.in_pvs(HERE, ELSEWHERE).unwrap());

    let mut tokens = Vec::new();
    while let Some(token) = engine.entity_token().unwrap() {
        tokens.push(token);
        assert!(tokens.len() < 1000, "the entities never end");
    }
    assert_eq!(tokens[..3], ["{", "classname", "worldspawn"]);
    assert!(tokens.contains(&"info_player_deathmatch".to_string()));
    assert_eq!(tokens.last().unwrap(), "}");
    assert_eq!(
        engine.entity_token().unwrap().as_deref(),
        Some("{"),
        "the end rewinds"
    );
    engine.assert_clean();
}

fn marks_are_clipped_to_surfaces() {
    let mut engine = engine_in_map();
    // clockwise seen from where the mark comes from
    let square = |center: Vec3, r: f32| {
        [(-r, -r), (-r, r), (r, r), (r, -r)].map(|(x, y)| center + Vec3::new(x, y, 0.0))
    };
    let down = Vec3::Z * -20.0;
    let (points, fragments) = engine
        .mark_fragments(&square(Vec3::new(-100.0, 0.0, 0.0), 16.0), down, 384, 128)
        .unwrap();
    assert!(!fragments.is_empty());
    for fragment in &fragments {
        assert!(fragment.numPoints >= 3);
    }
    for p in &points {
        assert!(
            p.z.abs() < 0.1 && (p.x + 100.0).abs() < 16.1 && p.y.abs() < 16.1,
            "{p}"
        );
    }
    // over an edge of the floor the mark is cut
    let (points, _) = engine
        .mark_fragments(&square(Vec3::new(-256.0, 0.0, 0.0), 16.0), down, 384, 128)
        .unwrap();
    assert!(points.iter().all(|p| p.x >= -256.1), "{points:?}");
    // in the middle of the room there is nothing
    let (_, none) = engine
        .mark_fragments(&square(Vec3::new(0.0, 0.0, 128.0), 8.0), down, 384, 128)
        .unwrap();
    assert!(none.is_empty());
    // small buffers are not overrun
    for (max_points, max_fragments) in [(0, 0), (3, 1), (4, 1), (384, 0)] {
        engine
            .mark_fragments(
                &square(HERE * Vec3::new(1.0, 1.0, 0.0), 64.0),
                down,
                max_points,
                max_fragments,
            )
            .unwrap();
    }
    engine.assert_clean();
}
