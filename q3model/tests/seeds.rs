//! The seeds of the fuzz targets `md3`, `mdr`, `iqm` and `skin`, and mutations of them, through the functions that the
//! targets call.

use survive::{survive_iqm, survive_md3, survive_mdr, survive_skin};

#[path = "../../fuzz/mutate.rs"]
mod mutate;
#[path = "common/samples.rs"]
mod samples;
#[path = "common/survive.rs"]
mod survive;

#[test]
fn seeds_and_mutations_of_them_survive() {
    for (target, survive) in [
        ("md3", survive_md3 as fn(&[u8]) -> bool),
        ("mdr", survive_mdr),
        ("iqm", survive_iqm),
    ] {
        let (taken, refused) = mutate::run(target, 5000, survive);
        assert!(
            taken > 500 && refused > 500,
            "{target}: {taken} taken, {refused} refused"
        );
    }
    mutate::run("skin", 5000, survive_skin);
}

/// Run by hand when the samples have changed.
#[test]
#[ignore = "writes fuzz/seeds"]
fn write_seeds() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../fuzz/seeds");
    let write = |name: &str, bytes: Vec<u8>| {
        std::fs::write(format!("{folder}/{name}"), bytes).expect("the folder is there");
    };
    write("md3/two_frames.md3", samples::md3().write());
    write("mdr/plain.mdr", samples::mdr().write(false));
    write("mdr/compressed.mdr", samples::mdr().write(true));
    write("iqm/two_frames.iqm", samples::iqm().write());
}
