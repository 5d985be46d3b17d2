//! A camera path through the whole library, measured.

#![forbid(unsafe_code)]

use tests::camera_path::{Play, play};
use tests::maps::{self, HERE, ROOMS};

fn wanted(traced: bool) -> Play {
    let line = |frame: i32| {
        let [x, y, z] = HERE.to_array();
        format!(
            "{} {x} {y} {z} 0 {} 0 90 73.74\n",
            1000 + 50 * frame,
            10 * frame
        )
    };
    let text: String = (0..3).map(line).collect();
    Play {
        library: tests::data::library(),
        packs: Default::default(),
        files: maps::files(),
        map: ROOMS.to_string(),
        path: renderer_vk::path::parse(&text).expect("a path"),
        size: [64, 48],
        traced,
        window: false,
        cvars: [("rt_bounces", "0"), ("rt_lights", "prior")]
            .map(|(name, value)| (name.to_string(), value.to_string()))
            .to_vec(),
        settling: 2,
        picture: true,
    }
}

#[test]
fn a_path_is_played_and_its_passes_are_told() {
    let (report, picture) = play(&wanted(true)).expect("it plays");
    let picture = picture.expect("a picture");
    assert_eq!((picture.width(), picture.height()), (64, 48));
    assert!(picture.distinct_colors() > 30);
    let pass = |name: &str| report.passes().iter().find(|p| p.name == name);
    let primary_rays = pass("trace_primary_rays").expect("the traced look has it");
    // one ray for each pixel at least
    assert!(primary_rays.rays.iter().any(|&rays| rays >= 64.0 * 48.0));
    assert_eq!(primary_rays.ms.len(), 3);
    assert!(pass("trace_bounce_rays").is_none(), "rt_bounces is 0");

    let (report, _) = play(&wanted(false)).expect("it plays");
    assert!(report.passes().iter().all(|p| !p.name.starts_with("trace")));
    let json = report.json();
    assert!(json["rays"].is_null());
    assert!(json["memory"]["textures"].as_u64() > Some(0));
}

#[test]
fn a_map_that_is_not_there_is_an_error() {
    let missing = Play {
        map: "maps/none.bsp".to_string(),
        ..wanted(true)
    };
    assert!(play(&missing).is_err());
    let nothing = Play {
        path: Vec::new(),
        ..wanted(true)
    };
    assert!(play(&nothing).is_err());
}
