//! Texture images: the engine's formats, its search for files, and the arithmetic on pixels that
//! both looks share.
//!
//! TGA, BMP and PCX have readers of their own, because the engine reads them differently from their
//! specifications (a TGA's top-down flag means nothing to it). PNG and JPEG are decoded by `image`.

mod bmp;
mod pcx;
mod resample;
mod tga;
mod wal;

use crate::files::{FileError, GameFiles};
use crate::overbright;
use glam::{Vec2, Vec3, Vec4};
use image::{DynamicImage, ImageDecoder, ImageFormat};
use std::io::Cursor;
use support::parallel;

/// The most pixels that an image may have: 2²⁶, an 8192 × 8192 picture. Checked before pixels are
/// decoded, so that a header of a few bytes cannot ask for gigabytes.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Extensions that the engine tries, in its order.
pub const EXTENSIONS: [&str; 6] = ["tga", "jpg", "jpeg", "png", "pcx", "bmp"];

/// Extension of the textures of Quake II, tried after those of the engine.
const WAL: &str = "wal";

/// All extensions in the order tried.
fn extensions() -> impl Iterator<Item = &'static str> {
    EXTENSIONS.into_iter().chain([WAL])
}

/// Why an image file could not be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file's content is not an image that the engine reads.
    #[error("{file}: {reason}")]
    Malformed {
        /// Game path of the file.
        file: String,
        /// What is wrong.
        reason: String,
    },
    /// The picture is empty or has more than [`MAX_PIXELS`] pixels.
    #[error("{file}: {width} x {height} pixels; an image has 1 to {MAX_PIXELS}")]
    Size {
        /// Game path of the file.
        file: String,
        /// Width that the header names.
        width: u32,
        /// Height that the header names.
        height: u32,
    },
}

/// A picture: 8-bit sRGB-encoded RGBA, straight alpha, row 0 on top (texture coordinate t = 0).
#[derive(Clone, PartialEq, Eq)]
pub struct Image {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// `width * height * 4` bytes.
    pub rgba: Vec<u8>,
    /// Whether some pixel's alpha is not 255; the engine keeps an alpha channel only then.
    pub has_alpha: bool,
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Image({} x {}, alpha: {})",
            self.width, self.height, self.has_alpha
        )
    }
}

impl Image {
    /// The pixel at texture coordinates, linear, with its alpha as it is; beyond the edges the picture repeats, or its
    /// edge goes on with `clamp`. `table`: [`byte_table`](crate::overbright::byte_table). Coordinates that are no numbers
    /// are those of the first pixel.
    pub fn linear_texel(&self, st: Vec2, clamp: bool, table: &[f32; 256]) -> Vec4 {
        let column = |t: f32, side: u32| -> usize {
            let t = if clamp {
                t.clamp(0.0, 1.0)
            } else {
                t.rem_euclid(1.0)
            };
            ((t * side as f32) as u32).min(side.saturating_sub(1)) as usize
        };
        let at = column(st.y, self.height) * self.width as usize + column(st.x, self.width);
        let pixels = self.rgba.as_chunks::<4>().0;
        let [r, g, b, a] = pixels.get(at).copied().unwrap_or([0, 0, 0, 255]);
        let linear = |byte: u8| table[usize::from(byte)];
        Vec4::new(linear(r), linear(g), linear(b), f32::from(a) / 255.0)
    }

    /// A picture from its pixels; `None` when the number of bytes does not fit the size, or the size
    /// is empty or above [`MAX_PIXELS`].
    pub fn from_rgba(width: u32, height: u32, rgba: Vec<u8>) -> Option<Image> {
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > MAX_PIXELS || rgba.len() as u64 != pixels * 4 {
            return None;
        }
        Some(Image::of(width, height, rgba))
    }

    /// A picture from as many pixels as its size has.
    fn of(width: u32, height: u32, rgba: Vec<u8>) -> Image {
        let has_alpha = rgba.chunks_exact(4).any(|p| p.get(3) != Some(&255));
        Image {
            width,
            height,
            rgba,
            has_alpha,
        }
    }

    /// A picture of at least one pixel; `texel`: colour at a column and row.
    pub fn generate(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
        let at = |i| texel(i % width, i / width);
        Image::of(width, height, (0..width * height).flat_map(at).collect())
    }

    /// A picture of one colour, 1 × 1.
    pub fn uniform(rgba: [u8; 4]) -> Image {
        Image::of(1, 1, rgba.to_vec())
    }

    /// The pixels, row by row from the top.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = [u8; 4]> + '_ {
        self.rgba.as_chunks::<4>().0.iter().copied()
    }

    /// Mean colour, linear, each channel 0..=1; alpha plays no part.
    pub fn mean_linear(&self) -> Vec3 {
        let table = overbright::byte_table();
        let mut sum = [0.0f64; 3];
        for [r, g, b, _] in self.pixels() {
            for (sum, byte) in sum.iter_mut().zip([r, g, b]) {
                *sum += f64::from(table[usize::from(byte)]);
            }
        }
        let count = f64::from(self.width) * f64::from(self.height);
        Vec3::from_array(sum.map(|s| (s / count) as f32))
    }

    /// Mean colour as stored, each channel 0..=1; alpha plays no part.
    pub fn mean_stored(&self) -> Vec3 {
        let mut sum = [0u64; 3];
        for [r, g, b, _] in self.pixels() {
            for (sum, byte) in sum.iter_mut().zip([r, g, b]) {
                *sum += u64::from(byte);
            }
        }
        let count = f64::from(self.width) * f64::from(self.height) * 255.0;
        Vec3::from_array(sum.map(|s| (s as f64 / count) as f32))
    }

    /// Mean alpha, 0..=1.
    pub fn mean_alpha(&self) -> f32 {
        let sum: u64 = self.pixels().map(|[.., a]| u64::from(a)).sum();
        (sum as f64 / (f64::from(self.width) * f64::from(self.height) * 255.0)) as f32
    }
}

/// Loads the image that a script or a map names.
///
/// The engine's search: a name with a known extension is tried as written; when that file is absent
/// (or is a PNG, JPEG or PCX that cannot be decoded) the extension is taken off and the others are
/// tried in the order of [`EXTENSIONS`]. A name with no or an unknown extension gets each extension
/// in turn. Returns the picture and the game path of the file it came from; `None` when there is none.
///
/// # Errors
/// [`ImageError`] when a TGA or BMP is malformed, an image is too large, or a file cannot be read. The
/// engine leaves the map for the first of these; callers here draw the default image and say so once.
///
/// The names of the engine's built-in images `*white` and `*default` give those.
pub fn load(files: &dyn GameFiles, name: &str) -> Result<Option<(Image, String)>, ImageError> {
    if let Some(image) = built_in(name) {
        return Ok(Some((image, name.to_owned())));
    }
    for (file, extension) in candidates(name) {
        if let Some(image) = load_one(files, &file, &extension)? {
            return Ok(Some((image, file)));
        }
    }
    Ok(None)
}

/// Most files that are read before they are decoded.
const BATCH: usize = 64;

/// [`load`] of several images: reads their files on this thread, and decodes them on all cores. `keep`: what is kept of a
/// picture.
pub fn load_all<T: Send>(
    files: &dyn GameFiles,
    names: &[&str],
    keep: impl Fn(Image) -> T + Sync,
) -> Vec<Result<Option<T>, ImageError>> {
    let read = |name: &&str| {
        let read = |(file, extension): (String, String)| {
            let bytes = files.read(&file).ok()??;
            Some((file, extension, bytes))
        };
        candidates(name).find_map(read)
    };
    let usual = |(file, extension, bytes): &(String, String, Vec<u8>)| {
        let cut = is_cut_jpeg(extension, bytes);
        decode(file, extension, bytes).ok().filter(|_| !cut)
    };
    names
        .chunks(BATCH)
        .flat_map(|names| {
            let read: Vec<_> = names.iter().map(read).collect();
            let kept = parallel::map(&read, |_, file| file.as_ref().and_then(usual).map(&keep));
            let found = |(name, kept): (&&str, Option<T>)| match kept {
                Some(kept) => Ok(Some(kept)),
                // built in, missing or faulty: with messages, and the search after them
                None => load(files, name).map(|found| found.map(|(image, _)| keep(image))),
            };
            names.iter().zip(kept).map(found).collect::<Vec<_>>()
        })
        .collect()
}

/// The game path of the file that [`load`] would try first among those that exist, without reading it.
pub fn find(files: &dyn GameFiles, name: &str) -> Option<String> {
    if built_in(name).is_some() {
        return Some(name.to_owned());
    }
    candidates(name)
        .map(|(file, _)| file)
        .find(|file| files.exists(file))
}

/// Files that an image may lie in, and their extensions in lower case: as written, then with the others.
fn candidates(name: &str) -> impl Iterator<Item = (String, String)> {
    let (stem, written) = match split_extension(name) {
        Some((stem, ext)) if known(ext) => (stem, Some(ext.to_ascii_lowercase())),
        _ => (name, None),
    };
    let others = extensions().filter({
        let written = written.clone();
        move |ext| written.as_deref() != Some(ext)
    });
    let others = others.map(move |ext| (format!("{stem}.{ext}"), ext.to_owned()));
    let written = written.map(|ext| (name.to_owned(), ext));
    written.into_iter().chain(others)
}

/// The engine's built-in images that scripts can name: `*white`, 8 × 8, and `*default`, here opaque.
pub fn built_in(name: &str) -> Option<Image> {
    match name {
        "*white" => Some(Image::generate(8, 8, |_, _| [255; 4])),
        "*default" => Some(default_image(255)),
        _ => None,
    }
}

/// The image of missing textures, `*default`: 16 × 16, dark grey with a white border. `alpha`: of the grey; 32 in the
/// engine.
pub fn default_image(alpha: u8) -> Image {
    Image::generate(16, 16, |x, y| {
        if matches!(x, 0 | 15) || matches!(y, 0 | 15) {
            [255; 4]
        } else {
            [32, 32, 32, alpha]
        }
    })
}

fn known(extension: &str) -> bool {
    EXTENSIONS.iter().any(|e| e.eq_ignore_ascii_case(extension))
}

/// Stem and extension of a game path; `None` when the last component has no dot.
pub(crate) fn split_extension(name: &str) -> Option<(&str, &str)> {
    let (stem, ext) = name.rsplit_once('.')?;
    (!ext.contains(['/', '\\'])).then_some((stem, ext))
}

fn load_one(
    files: &dyn GameFiles,
    file: &str,
    extension: &str,
) -> Result<Option<Image>, ImageError> {
    let Some(bytes) = files.read(file)? else {
        return Ok(None);
    };
    let decoded = match extension {
        WAL => decode_wal(files, file, &bytes),
        _ => decode(file, extension, &bytes),
    };
    match decoded {
        Ok(image) => {
            if is_cut_jpeg(extension, &bytes) {
                log::warn!(
                    "{file}: JPEG cut short after {} bytes; what is missing is grey",
                    bytes.len()
                );
            }
            Ok(Some(image))
        }
        // The engine treats these three formats as absent when they cannot be decoded.
        Err(problem @ ImageError::Malformed { .. }) if !matches!(extension, "tga" | "bmp") => {
            log::warn!("{problem}; trying other extensions");
            Ok(None)
        }
        Err(problem) => Err(problem),
    }
}

/// Whether a file is a JPEG without an end (ITU-T T.81, table B.1, `EOI`), which is shown as far as it goes. What stands
/// before the first scan may hold a small picture with an end of its own.
fn is_cut_jpeg(extension: &str, bytes: &[u8]) -> bool {
    if !matches!(extension, "jpg" | "jpeg") {
        return false;
    }
    // A file that ends early leaves nothing to read, here and below, and has no end.
    let mut rest = bytes.get(2..).unwrap_or_default();
    loop {
        rest = match rest {
            [0xff, 0xda, scan @ ..] => {
                return !scan.windows(2).rev().any(|pair| pair == [0xff, 0xd9]);
            }
            [0xff, 0xff, ..] => rest.get(1..).unwrap_or_default(),
            [0xff, _, high, low, ..] => {
                let length = usize::from(u16::from_be_bytes([*high, *low]));
                rest.get(2 + length..).unwrap_or_default()
            }
            _ => return true,
        };
    }
}

/// Decodes an image by its extension (lower case, one of [`EXTENSIONS`]); `file` is for messages.
///
/// # Errors
/// [`ImageError::Malformed`] and [`ImageError::Size`].
pub fn decode(file: &str, extension: &str, bytes: &[u8]) -> Result<Image, ImageError> {
    let decoded = match extension {
        "tga" => tga::decode(bytes),
        "bmp" => bmp::decode(bytes),
        "pcx" => pcx::decode(bytes),
        "jpg" | "jpeg" => foreign(ImageFormat::Jpeg, bytes),
        "png" => foreign(ImageFormat::Png, bytes),
        other => Err(Fault::Malformed(format!(
            "no reader for extension {other:?}"
        ))),
    };
    decoded.map_err(|fault| fault.of(file))
}

/// Decodes a texture of Quake II with the palette of its game.
fn decode_wal(files: &dyn GameFiles, file: &str, bytes: &[u8]) -> Result<Image, ImageError> {
    let pcx = files.read(wal::PALETTE_FILE)?;
    let palette = pcx.as_deref().and_then(wal::palette_of_pcx);
    let decoded = match palette {
        Some(palette) => wal::decode(bytes, palette),
        None => Err(Fault::Malformed(format!(
            "there is no palette for it, {}",
            wal::PALETTE_FILE
        ))),
    };
    decoded.map_err(|fault| fault.of(file))
}

/// Width and height of the picture that a map's texture coordinates are made for: the texture of Quake II when there
/// is one, else whatever [`load`] finds. `None` when there is none that can be read.
pub fn texture_size(files: &dyn GameFiles, name: &str) -> Option<(u32, u32)> {
    let wal = files.read(&format!("{name}.{WAL}")).ok().flatten();
    if let Some(size) = wal.as_deref().and_then(wal::size) {
        return Some(size);
    }
    let (picture, _) = load(files, name).ok()??;
    Some((picture.width, picture.height))
}

/// What a reader complains about, before the file's name is known.
#[derive(Debug, PartialEq)]
enum Fault {
    Malformed(String),
    Size(u32, u32),
}

impl Fault {
    fn of(self, file: &str) -> ImageError {
        let file = file.to_owned();
        match self {
            Fault::Malformed(reason) => ImageError::Malformed { file, reason },
            Fault::Size(width, height) => ImageError::Size {
                file,
                width,
                height,
            },
        }
    }
}

impl From<&str> for Fault {
    fn from(reason: &str) -> Self {
        Fault::Malformed(reason.to_owned())
    }
}

/// Number of pixels of a size that an image may have.
fn check_size(width: u32, height: u32) -> Result<usize, Fault> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > MAX_PIXELS {
        return Err(Fault::Size(width, height));
    }
    usize::try_from(pixels).map_err(|_| Fault::Size(width, height))
}

fn finish(width: u32, height: u32, rgba: Vec<u8>) -> Result<Image, Fault> {
    Image::from_rgba(width, height, rgba).ok_or(Fault::Size(width, height))
}

fn foreign(format: ImageFormat, bytes: &[u8]) -> Result<Image, Fault> {
    // some of these messages end in a line break
    let fault = |e: image::ImageError| {
        let message = e.to_string();
        let words: Vec<&str> = message.split_whitespace().collect();
        Fault::Malformed(words.join(" "))
    };
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 16);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(fault)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height)?;
    let deep = decoder.original_color_type().bits_per_pixel()
        > 8 * u16::from(decoder.original_color_type().channel_count());
    let picture = DynamicImage::from_decoder(decoder).map_err(fault)?;
    let rgba = if deep {
        // the engine keeps the high byte, and does not round
        let words = picture.into_rgba16().into_raw();
        words.iter().map(|word| (word >> 8) as u8).collect()
    } else {
        picture.into_rgba8().into_raw()
    };
    finish(width, height, rgba)
}

/// Little-endian `u16` at a byte offset.
fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes
        .get(at..)?
        .first_chunk::<2>()
        .map(|b| u16::from_le_bytes(*b))
}

/// Little-endian `u32` at a byte offset.
fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes
        .get(at..)?
        .first_chunk::<4>()
        .map(|b| u32::from_le_bytes(*b))
}

#[cfg(test)]
pub(crate) mod tests;
