//! `relight compare`: similarity of pictures of one view, and the pictures side by side.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use relight::compare::{Rgb8, compare, flip};

use crate::pictures::{read, write};

/// Compare pictures of one view
///
/// Prints a line for each picture: structural similarity (1: equal), mean FLIP (0: equal), mean absolute and root mean
/// square difference (0 to 255), share of pixels that differ by more than 8, mean luminance of both. For folders it
/// prints a table.
///
/// Examples: relight compare reference.png other.png --side-by-side both.png; relight compare opengl1 vk --worst-to worst
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// Reference picture (PNG, JPEG or TGA), or a folder of pictures
    reference: PathBuf,
    /// Pictures to compare with it; folders with pictures of the same names, if the reference is a folder
    others: Vec<PathBuf>,
    /// Write all pictures side by side to this file (PNG or JPEG, by its ending)
    #[arg(long, value_name = "FILE")]
    side_by_side: Option<PathBuf>,
    /// For folders: write the least similar pictures to this folder, with the reference and the difference
    #[arg(long, value_name = "DIR", conflicts_with = "side_by_side")]
    worst_to: Option<PathBuf>,
    /// Number of these pictures
    #[arg(long, default_value_t = 12)]
    worst: usize,
}

/// Prints one line for each picture; the help text lists its figures.
pub fn run(args: &CompareArgs) -> Result<()> {
    if args.reference.is_dir() {
        let to = args.worst_to.as_deref();
        return crate::table::folders(&args.reference, &args.others, args.worst, to);
    }
    let reference = read(&args.reference)?;
    let mut pictures = vec![reference];
    for path in &args.others {
        let picture = read(path)?;
        if let Some(reference) = pictures.first() {
            let d = compare(reference, &picture)
                .with_context(|| format!("{} and {}", args.reference.display(), path.display()))?;
            println!(
                "{}: SSIM {:.4}, FLIP {:.4}, mean difference {:.3}, RMS {:.3}, {:.2} % of pixels differ by more than 8, luminance {:.1} and {:.1}",
                path.display(),
                d.ssim,
                flip(reference, &picture)?,
                d.mean_absolute,
                d.root_mean_square,
                100.0 * d.differing,
                reference.mean_luminance(),
                picture.mean_luminance(),
            );
        }
        pictures.push(picture);
    }
    if let Some(path) = &args.side_by_side
        && let Some(all) = Rgb8::side_by_side(&pictures, 4)
    {
        write(path, &all)?;
    }
    Ok(())
}
