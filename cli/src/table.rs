//! Compares folders of pictures, as a table.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use relight::compare::{Rgb8, compare, flip};

use crate::pictures::{read, write};

/// Factor of displayed differences.
const GAIN: u8 = 4;

/// A picture against its reference.
#[derive(Clone, Copy)]
struct Likeness {
    ssim: f64,
    flip: f64,
    differing: f64,
}

/// Compares the pictures of the first of `folders`, and those of the same names in the others, with `reference`, and
/// prints a table with tabs between columns. Writes the `worst` least similar pictures of the first folder to `to`:
/// reference, picture, and difference.
///
/// # Errors
/// A folder or a picture cannot be read, a picture is missing or of another size, or the folders are empty.
pub fn folders(
    reference: &Path,
    folders: &[PathBuf],
    worst: usize,
    to: Option<&Path>,
) -> Result<()> {
    let Some(first) = folders.first() else {
        bail!(
            "{}: a folder to compare with it is missing",
            reference.display()
        );
    };
    let names = names(first)?;
    if names.is_empty() {
        bail!("{}: no pictures in it", first.display());
    }
    let mut header = vec!["picture".to_owned()];
    for folder in folders {
        // A path that ends in `..` has no name.
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        header.extend([
            format!("{name} SSIM"),
            format!("{name} FLIP"),
            format!("{name} >8 %"),
        ]);
    }
    println!("{}", header.join("\t"));
    let mut rows: Vec<(&String, Vec<Likeness>)> = Vec::new();
    for name in &names {
        let a = read(&reference.join(name))?;
        let mut row = Vec::new();
        for folder in folders {
            let b = read(&folder.join(name))?;
            row.push(likeness(&a, &b).with_context(|| folder.join(name).display().to_string())?);
        }
        let stem = Path::new(name).with_extension("");
        println!("{}\t{}", stem.display(), cells(row.iter().copied()));
        rows.push((name, row));
    }
    let columns = || (0..folders.len()).map(|i| rows.iter().filter_map(move |(_, row)| row.get(i)));
    let means = columns().map(|column| {
        let n = rows.len() as f64;
        Likeness {
            ssim: column.clone().map(|l| l.ssim).sum::<f64>() / n,
            flip: column.clone().map(|l| l.flip).sum::<f64>() / n,
            differing: column.map(|l| l.differing).sum::<f64>() / n,
        }
    });
    println!("mean of {}\t{}", rows.len(), cells(means));
    let extremes = columns().map(|column| Likeness {
        ssim: column.clone().map(|l| l.ssim).fold(1.0, f64::min),
        flip: column.clone().map(|l| l.flip).fold(0.0, f64::max),
        differing: column.map(|l| l.differing).fold(0.0, f64::max),
    });
    println!("worst\t{}", cells(extremes));
    if let Some(to) = to {
        std::fs::create_dir_all(to).with_context(|| to.display().to_string())?;
        let ssim = |row: &(&String, Vec<Likeness>)| row.1.first().map_or(1.0, |l| l.ssim);
        rows.sort_by(|a, b| ssim(a).total_cmp(&ssim(b)));
        for (name, _) in rows.iter().take(worst) {
            let (a, b) = (read(&reference.join(name))?, read(&first.join(name))?);
            let difference = a.difference(&b, GAIN);
            if let Some(all) = Rgb8::side_by_side(&[a, b, difference], 4) {
                write(&to.join(Path::new(name).with_extension("png")), &all)?;
            }
        }
    }
    Ok(())
}

fn likeness(a: &Rgb8, b: &Rgb8) -> Result<Likeness> {
    let difference = compare(a, b)?;
    Ok(Likeness {
        ssim: difference.ssim,
        flip: flip(a, b)?,
        differing: difference.differing,
    })
}

fn cells(row: impl Iterator<Item = Likeness>) -> String {
    row.map(|l| {
        let percent = 100.0 * l.differing;
        format!("{:.4}\t{:.4}\t{percent:.2}", l.ssim, l.flip)
    })
    .collect::<Vec<_>>()
    .join("\t")
}

/// Names of the pictures in a folder, in order.
fn names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let extension = Path::new(&name).extension();
        if extension.is_some_and(|e| e == "tga" || e == "png" || e == "jpg") {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_compared_and_the_worst_is_shown() {
        let root = tempfile::tempdir().unwrap();
        let [a, b, worst] = ["a", "b", "worst"].map(|name| root.path().join(name));
        for (folder, shift) in [(&a, 0), (&b, 60)] {
            std::fs::create_dir(folder).unwrap();
            for (name, shift) in [("same.png", 0), ("other.png", shift)] {
                let pixels = (0..16 * 16 * 3).map(|i| (i % 50) as u8 * 2 + shift);
                let picture = Rgb8::new(16, 16, pixels.collect()).unwrap();
                write(&folder.join(name), &picture).unwrap();
            }
        }
        folders(&a, std::slice::from_ref(&b), 1, Some(&worst)).unwrap();
        assert_eq!(names(&worst).unwrap(), ["other.png"]);
        assert_eq!(read(&worst.join("other.png")).unwrap().width(), 3 * 16 + 8);
        std::fs::remove_file(b.join("same.png")).unwrap();
        folders(&a, std::slice::from_ref(&b), 1, None).unwrap();
        assert!(folders(&b, std::slice::from_ref(&a), 1, None).is_err());
        assert!(folders(&a, &[], 1, None).is_err());
        assert!(folders(&worst.join("nowhere"), &[], 1, None).is_err());
    }
}
