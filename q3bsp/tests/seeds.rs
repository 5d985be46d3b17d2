//! The seeds of the fuzz target `q3bsp`, and mutations of them, through the function that the target calls.

#![cfg(feature = "quake")]

use q3bsp::{Format, lightmap_index};
use survive::survive;

#[path = "common/exercise.rs"]
mod exercise;
#[path = "../../fuzz/mutate.rs"]
mod mutate;
#[path = "quake/room.rs"]
#[allow(dead_code, reason = "the tests of these formats take all of it")]
mod room;
#[path = "common/sample.rs"]
mod sample;
#[path = "common/survive.rs"]
mod survive;

#[test]
fn seeds_and_mutations_of_them_survive() {
    let (taken, refused) = mutate::run("q3bsp", 1000, survive);
    assert!(
        taken > 1000 && refused > 1000,
        "{taken} taken, {refused} refused"
    );
}

/// Run by hand when the builders have changed.
#[test]
#[ignore = "writes fuzz/seeds/q3bsp"]
fn write_seeds() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../fuzz/seeds/q3bsp");
    let write = |name: &str, bytes: Vec<u8>| {
        std::fs::write(format!("{folder}/{name}.bsp"), bytes).expect("the folder is there");
    };
    for (name, format) in [
        ("ibsp46", Format::Ibsp46),
        ("quake_live", Format::QuakeLive),
        ("rbsp", Format::Rbsp),
    ] {
        let mut bsp = sample::sample();
        bsp.format = format;
        // A page alone would be 48 KiB.
        bsp.lightmaps.clear();
        for surface in &mut bsp.surfaces {
            surface.lightmap = lightmap_index::BY_VERTEX;
        }
        if format == Format::QuakeLive {
            bsp.advertisements = vec![sample::advertisement()];
        }
        write(name, bsp.write());
    }
    for (name, format) in [
        ("quake", Format::Quake),
        ("goldsrc", Format::GoldSrc),
        ("quake2", Format::Quake2),
    ] {
        write(name, room::room(format).write());
    }
}
