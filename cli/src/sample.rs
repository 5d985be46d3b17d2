//! `relight sample`: the built-in maps as packs.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use relight::sample::Sample;
use zip::write::SimpleFileOptions;

/// Write a built-in map as a pack
///
/// The pack has the map, its textures, its script and, for the map of surfaces, the file that states how they reflect:
/// an example for packs of your own. Put it into the game's folder and load the map by its name.
///
/// Examples: relight sample surfaces -o surfaces.pk3; relight sample -o sample.pk3
#[derive(Args, Debug)]
pub struct SampleArgs {
    /// Which one: hall or surfaces
    #[arg(default_value = "hall", value_parser = parse_sample)]
    name: Sample,
    /// The pack, a new .pk3 file
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
}

/// Parses the name of a sample.
pub fn parse_sample(name: &str) -> Result<Sample, String> {
    let named = Sample::ALL
        .into_iter()
        .find(|s| s.name().eq_ignore_ascii_case(name));
    named.ok_or_else(|| {
        let names = Sample::ALL.map(Sample::name).join(", ");
        format!("there are {names}")
    })
}

/// Runs the subcommand.
///
/// # Errors
/// The file cannot be written.
pub fn run(args: &SampleArgs) -> Result<()> {
    let path = &args.output;
    if path
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case("pk3"))
    {
        bail!("{}: packs are .pk3", path.display());
    }
    let place = || path.display().to_string();
    let file = File::create_new(path).with_context(place)?;
    let mut pack = zip::ZipWriter::new(BufWriter::new(file));
    for (name, bytes) in args.name.entries() {
        pack.start_file(name, SimpleFileOptions::default())
            .with_context(place)?;
        pack.write_all(&bytes).with_context(place)?;
    }
    pack.finish()
        .with_context(place)?
        .flush()
        .with_context(place)?;
    let size = std::fs::metadata(path).with_context(place)?.len();
    println!(
        "{}: {} kB, map {}",
        path.display(),
        size.div_ceil(1000),
        args.name.map()
    );
    Ok(())
}
