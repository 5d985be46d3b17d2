//! Picture files, written atomically.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use relight::compare::Rgb8;
use renderer_vk::picture_files;

/// Writes a file atomically: to a temporary file beside it, which is then renamed.
///
/// # Errors
/// The file cannot be written; the temporary file is removed.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut half = path.as_os_str().to_owned();
    half.push(".part");
    let half = PathBuf::from(half);
    std::fs::write(&half, bytes)
        .and_then(|()| std::fs::rename(&half, path))
        .inspect_err(|_| {
            let _ = std::fs::remove_file(&half);
        })
        .with_context(|| format!("{}: cannot be written", path.display()))
}

/// Quality of JPEG files, percent.
const JPEG_QUALITY: u8 = 85;

/// Whether a path ends in `.jpg` or `.jpeg`.
fn is_jpeg(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    ["jpg", "jpeg"]
        .iter()
        .any(|jpeg| extension.eq_ignore_ascii_case(jpeg))
}

/// Fails if [`write_rgb`] does not write files of this name.
///
/// # Errors
/// Says which it writes.
pub fn check_name(path: &Path) -> Result<()> {
    let png = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if !png && !is_jpeg(path) {
        bail!("{}: pictures are .png or .jpg", path.display());
    }
    Ok(())
}

/// Writes a picture of 8 bits a channel, rows from the top: a JPEG if the path ends so, otherwise a PNG.
///
/// # Errors
/// The file cannot be written, or `rgb` does not have three bytes a pixel.
pub fn write_rgb(path: &Path, rgb: &[u8], width: u32, height: u32) -> Result<()> {
    let encoded = match is_jpeg(path) {
        true => picture_files::jpeg(rgb, width, height, JPEG_QUALITY),
        false => picture_files::png(rgb, width, height),
    };
    let bytes = encoded.with_context(|| path.display().to_string())?;
    write_whole(path, &bytes)
}

/// Reads an image in a format of the game, by extension; drops alpha.
///
/// # Errors
/// The file cannot be read or is no image.
pub fn read(path: &Path) -> Result<Rgb8> {
    let file = path.display().to_string();
    // No format has the empty extension.
    let extension = path.extension().unwrap_or_default();
    let extension = extension.to_string_lossy().to_lowercase();
    let bytes = std::fs::read(path).with_context(|| file.clone())?;
    let picture = relight::image::decode(&file, &extension, &bytes)?;
    let rgb = picture
        .pixels()
        .flat_map(|[r, g, b, _]| [r, g, b])
        .collect();
    Ok(Rgb8::new(
        picture.width as usize,
        picture.height as usize,
        rgb,
    )?)
}

/// Writes a picture, as [`write_rgb`] does.
///
/// # Errors
/// The file cannot be written, or the picture is too large.
pub fn write(path: &Path, picture: &Rgb8) -> Result<()> {
    let (width, height) = (
        u32::try_from(picture.width())?,
        u32::try_from(picture.height())?,
    );
    write_rgb(path, picture.pixels(), width, height)
}
