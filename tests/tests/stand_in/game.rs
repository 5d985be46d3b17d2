//! Maps of the game itself, where its data is there.

use glam::Vec3;
use relight::compare::Rgb8;
use tests::engine::files::Packs;
use tests::engine::{Engine, Options, View};

#[test]
fn maps_of_the_game_in_both_looks() {
    let Some(data) = testkit::folder() else {
        return;
    };
    let packs = Packs::open(&data).unwrap();
    let few = ["oa_dm1", "am_galmevish", "oa_ctf2"]
        .map(str::to_string)
        .to_vec();
    let full = testkit::is_set("RELIGHT_FULL");
    let mut engine = Engine::start(Options {
        packs: packs.clone(),
        ..Options::default()
    })
    .unwrap();
    let maps = if full { map_names(&engine) } else { few };
    for map in maps {
        let file = format!("maps/{map}.bsp");
        engine.take_messages();
        engine
            .start_map(&file)
            .unwrap_or_else(|e| panic!("{map}: {e}"));
        let view = View::new(spawn(&mut engine), 0.0);
        for look in ["0", "1"] {
            engine.set("r_rt", look);
            let mut pictures: Vec<Rgb8> = Vec::new();
            for yaw in [0.0, 90.0, 180.0, 270.0] {
                let view = View {
                    angles: Vec3::new(0.0, yaw, 0.0),
                    ..view
                };
                pictures.push(engine.picture(&view).unwrap());
            }
            let brightest = pictures
                .iter()
                .map(Rgb8::mean_luminance)
                .fold(0.0, f64::max);
            let colors = pictures.iter().map(Rgb8::distinct_colors).max().unwrap();
            println!("{map} r_rt {look}: mean luminance up to {brightest:.1}, colours {colors}");
            assert!(
                (3.0..240.0).contains(&brightest),
                "{map}, r_rt {look}: luminance {brightest}"
            );
            assert!(colors > 200, "{map}, r_rt {look}: {colors} colours");
        }
        engine.set("r_rt", "0");
        engine.assert_clean();
    }
}

fn map_names(engine: &Engine) -> Vec<String> {
    let mut names: Vec<String> = engine
        .list_files("maps", ".bsp")
        .iter()
        .map(|n| n.trim_end_matches(".bsp").to_string())
        .collect();
    names.sort();
    names
}

/// Where the first player may start, camera included.
fn spawn(engine: &mut Engine) -> Vec3 {
    let mut tokens = Vec::new();
    while let Some(token) = engine.entity_token().unwrap() {
        tokens.push(token);
    }
    let start = tokens
        .split(|t| t == "}")
        .find(|e| {
            e.iter()
                .any(|t| t == "info_player_deathmatch" || t == "info_player_start")
        })
        .expect("a map has a start");
    let at = start
        .iter()
        .position(|t| t == "origin")
        .expect("a start has a place")
        + 1;
    let numbers: Vec<f32> = start[at]
        .split_whitespace()
        .map(|n| n.parse().unwrap())
        .collect();
    Vec3::from_slice(&numbers) + Vec3::Z * 40.0
}
