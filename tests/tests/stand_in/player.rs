//! What players ask for in the console: presets.

use super::support::{engine_in_map, for_every_engine, text_of};
use tests::engine::{Engine, View};
use tests::maps::HERE;

for_every_engine!(presets_set_what_decides_about_cost,);

/// Runs a command and draws a frame; what was printed.
fn ask(engine: &mut Engine, command: &str) -> String {
    engine.take_messages();
    engine.command(command).unwrap();
    engine.picture(&View::new(HERE, 30.0)).unwrap();
    text_of(&engine.take_messages())
}

fn presets_set_what_decides_about_cost() {
    let mut engine = engine_in_map();
    let printed = ask(&mut engine, "rt_preset");
    assert!(printed.contains("* high"), "{printed}");
    assert!(printed.contains("usage: rt_preset NAME"), "{printed}");
    let printed = ask(&mut engine, "rt_preset LOW");
    assert!(printed.contains("rt_preset low"), "{printed}");
    for (name, value) in [("rt_scale", "0.5"), ("rt_bounces", "0")] {
        assert_eq!(engine.cvar(name).as_deref(), Some(value), "{name}");
    }
    assert!(ask(&mut engine, "rt_preset").contains("* low"));
    // A setting changed by hand leaves the preset.
    engine.set("rt_bounces", "2");
    engine.picture(&View::new(HERE, 30.0)).unwrap();
    assert!(!ask(&mut engine, "rt_preset").contains('*'));
    assert!(ask(&mut engine, "rt_preset best").contains("usage: rt_preset NAME"));

    assert!(ask(&mut engine, "rt_preset auto").contains("set r_rt 1 and start a map first"));
    assert_eq!(engine.cvar("rt_bounces").as_deref(), Some("2"));
    engine.assert_clean();
}

#[test]
fn the_preset_of_a_software_device_is_the_cheapest() {
    let mut engine = engine_in_map();
    engine.set("r_rt", "1");
    engine.picture(&View::new(HERE, 30.0)).unwrap();
    let printed = ask(&mut engine, "rt_preset auto");
    if printed.contains("draws in software") {
        assert_eq!(engine.cvar("rt_scale").as_deref(), Some("0.5"), "{printed}");
    } else {
        assert!(printed.contains("measuring"), "{printed}");
    }
    engine.assert_clean();
}
