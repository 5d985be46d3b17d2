//! Images as files that other programs read: PNG, and JPEG as the game stores it.

use super::ExportError;
use super::look::{Edit, Picture};
use super::{sky, stack};
use crate::files::{GameFiles, normalise};
use crate::image::{self, Image};
use crate::overbright::{self, ByteEncoder};
use ::image::codecs::png::{CompressionType, FilterType, PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder};
use glam::{Vec3, Vec4};
use shaderscript::Shader;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes of encoded images that a store keeps by default; beyond it the ones not used for longest go.
const BUDGET: usize = 192 << 20;

/// What an image file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mime {
    /// PNG, 8 bits a channel.
    Png,
    /// JPEG, byte for byte as in the game's files.
    Jpeg,
}

impl Mime {
    /// The media type.
    pub fn text(self) -> &'static str {
        match self {
            Mime::Png => "image/png",
            Mime::Jpeg => "image/jpeg",
        }
    }

    /// Extension of its files, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Mime::Png => "png",
            Mime::Jpeg => "jpg",
        }
    }
}

/// An image as a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Encoded {
    /// The file.
    pub bytes: Vec<u8>,
    /// What it is.
    pub mime: Mime,
    /// Where it goes below a folder of images: the game path of what it was made from, safe as a file name.
    pub path: String,
    /// Hash of the bytes.
    pub hash: u64,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Mean colour, linear.
    pub mean: Vec3,
    /// Mean alpha.
    pub mean_alpha: f32,
}

impl Encoded {
    /// A picture as PNG. `path`: where it goes, without extension.
    ///
    /// # Errors
    /// [`ExportError::Image`].
    pub fn png(image: &Image, path: &str) -> Result<Encoded, ExportError> {
        let bytes = encode_png(image).map_err(|reason| ExportError::Image {
            name: path.to_owned(),
            reason,
        })?;
        Ok(Encoded::new(bytes, Mime::Png, path, image))
    }

    fn new(bytes: Vec<u8>, mime: Mime, path: &str, image: &Image) -> Encoded {
        let mut hasher = DefaultHasher::new();
        bytes.hash(&mut hasher);
        Encoded {
            hash: hasher.finish(),
            path: format!("{}.{}", safe_path(path), mime.extension()),
            mime,
            width: image.width,
            height: image.height,
            mean: image.mean_linear(),
            mean_alpha: image.mean_alpha(),
            bytes,
        }
    }
}

/// Without an alpha channel where alpha is 255 everywhere.
fn encode_png(image: &Image) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    let (width, height) = (image.width, image.height);
    let written = if image.has_alpha {
        encoder.write_image(&image.rgba, width, height, ExtendedColorType::Rgba8)
    } else {
        let rgb: Vec<u8> = image.pixels().flat_map(|[r, g, b, _]| [r, g, b]).collect();
        encoder.write_image(&rgb, width, height, ExtendedColorType::Rgb8)
    };
    written.map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// A path that every file system takes, from a name as scripts write it.
fn safe_path(name: &str) -> String {
    let safe = |c: char| match c {
        '/' => '/',
        c if c.is_alphanumeric() || "-_.+ ()".contains(c) => c,
        _ => '_',
    };
    let cleaned: String = name.chars().map(safe).collect();
    normalise(&cleaned).unwrap_or_else(|_| "image".to_owned())
}

/// What is kept of an image; `None` when there is no such image.
type Found = Option<Arc<Encoded>>;

#[derive(Default)]
struct Kept {
    /// Means of images that were not requested as files.
    means: HashMap<String, Option<Vec4>>,
    /// Image, and time of its last request.
    images: HashMap<Picture, (Found, u64)>,
    bytes: usize,
    clock: u64,
}

/// Images as files, each made once for all maps of one game. May be shared between threads.
pub struct ImageStore {
    kept: Mutex<Kept>,
    budget: usize,
}

impl Default for ImageStore {
    /// Keeps up to 192 MiB.
    fn default() -> Self {
        ImageStore::new(BUDGET)
    }
}

impl ImageStore {
    /// A store that keeps up to `budget` bytes of images.
    pub fn new(budget: usize) -> ImageStore {
        ImageStore {
            kept: Mutex::default(),
            budget,
        }
    }

    /// A picture as a file; `None` when the game has no such image, or one that cannot be read, which is logged.
    /// `shader` is the material that asks.
    ///
    /// # Errors
    /// [`ExportError::Image`] when it cannot be encoded.
    pub(super) fn get(
        &self,
        files: &dyn GameFiles,
        picture: &Picture,
        shader: &Shader,
    ) -> Result<Found, ExportError> {
        if let Some(found) = self.kept(picture) {
            return Ok(found);
        }
        // Two threads may make the same image at once; the results are the same.
        let found = make(files, picture, shader)?.map(Arc::new);
        self.keep(picture, &found);
        Ok(found)
    }

    /// The mean of a picture, linear, with that of its alpha; `None` as for [`ImageStore::get`]. An image that would have
    /// to be encoded is only looked at.
    ///
    /// # Errors
    /// [`ExportError::Image`] when it cannot be encoded.
    pub(super) fn mean(
        &self,
        files: &dyn GameFiles,
        picture: &Picture,
        shader: &Shader,
    ) -> Result<Option<Vec4>, ExportError> {
        let of = |found: Found| found.map(|e| e.mean.extend(e.mean_alpha));
        if let Some(found) = self.kept(picture) {
            return Ok(of(found));
        }
        let Picture::File(name) = picture else {
            return Ok(of(self.get(files, picture, shader)?));
        };
        let known = {
            let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.means.get(name).copied()
        };
        if let Some(mean) = known {
            return Ok(mean);
        }
        let mean = match load(files, name) {
            Some((image, path)) if mime_of(&path).is_some() => {
                let found = Some(Arc::new(as_stored(files, &image, &path)?));
                self.keep(picture, &found);
                of(found)
            }
            found => found.map(|(image, _)| image.mean_linear().extend(image.mean_alpha())),
        };
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.means.insert(name.clone(), mean);
        Ok(mean)
    }

    fn kept(&self, picture: &Picture) -> Option<Found> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.clock += 1;
        let clock = kept.clock;
        let (found, used) = kept.images.get_mut(picture)?;
        *used = clock;
        Some(found.clone())
    }

    fn keep(&self, picture: &Picture, found: &Found) {
        let size = |found: &Found| found.as_ref().map_or(0, |e| e.bytes.len());
        let mut guard = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = &mut *guard;
        kept.clock += 1;
        kept.bytes += size(found);
        let before = kept
            .images
            .insert(picture.clone(), (found.clone(), kept.clock));
        kept.bytes -= before.map_or(0, |(found, _)| size(&found));
        while kept.bytes > self.budget {
            let oldest = kept
                .images
                .iter()
                .filter(|(_, (found, _))| found.is_some())
                .min_by_key(|(_, (_, used))| *used)
                .map(|(picture, _)| picture.clone());
            let Some((found, _)) = oldest.and_then(|picture| kept.images.remove(&picture)) else {
                debug_assert!(false, "{} bytes in no image", kept.bytes);
                break;
            };
            kept.bytes -= size(&found);
        }
    }
}

/// An image that a script names, and the game path of its file; `None`, with a line in the log, when it cannot be read.
pub(super) fn load(files: &dyn GameFiles, name: &str) -> Option<(Image, String)> {
    image::load(files, name).unwrap_or_else(|problem| {
        log::warn!("{problem}");
        None
    })
}

fn make(
    files: &dyn GameFiles,
    picture: &Picture,
    shader: &Shader,
) -> Result<Option<Encoded>, ExportError> {
    match picture {
        Picture::File(name) => load(files, name)
            .map(|(image, path)| as_stored(files, &image, &path))
            .transpose(),
        Picture::Edited(name, edit) => load(files, name)
            .map(|(image, path)| {
                let stem = stem(&path);
                Encoded::png(&edited(&image, *edit), &format!("{stem}_{}", edit.label()))
            })
            .transpose(),
        Picture::Reflection(map) => map
            .load(files)
            .map(|(image, path)| Encoded::png(&image, &path))
            .transpose(),
        Picture::Baked { name, stages, part } => stack::bake(files, shader, stages, *part)
            .map(|image| {
                let label = match part {
                    stack::Part::Color => "color".to_owned(),
                    stack::Part::Glow => "glow".to_owned(),
                    stack::Part::Shown(level) => format!("shown_{level}"),
                };
                Encoded::png(&image, &format!("{name}_{label}"))
            })
            .transpose(),
        Picture::Film(film) => film
            .image(files, edited)
            .map(|image| {
                let first = film.images.first().map_or("", |name| stem(name));
                let label = film.edit.map_or("", Edit::label);
                Encoded::png(&image, &format!("{first}_film{label}"))
            })
            .transpose(),
        Picture::Panorama(name) => sky::panorama(files, shader)
            .map(|image| Encoded::png(&image, &format!("{name}_panorama")))
            .transpose(),
        Picture::Sky { name, side } => sky::bake(files, shader, *side)
            .map(|image| Encoded::png(&image, &format!("{name}_side{side}")))
            .transpose(),
    }
}

/// A path without its extension.
fn stem(path: &str) -> &str {
    image::split_extension(path).map_or(path, |(stem, _)| stem)
}

/// An image's own file where other programs read it, else a PNG.
fn as_stored(files: &dyn GameFiles, image: &Image, path: &str) -> Result<Encoded, ExportError> {
    if let Some(mime) = mime_of(path)
        && let Ok(Some(bytes)) = files.read(path)
        && is_plain(&bytes, mime)
    {
        return Ok(Encoded::new(bytes, mime, stem(path), image));
    }
    Encoded::png(image, stem(path))
}

/// What a file of a name is, if other programs read it.
fn mime_of(path: &str) -> Option<Mime> {
    let extension = image::split_extension(path).map(|(_, ext)| ext.to_ascii_lowercase());
    match extension.as_deref() {
        Some("jpg" | "jpeg") => Some(Mime::Jpeg),
        Some("png") => Some(Mime::Png),
        _ => None,
    }
}

/// Whether a file's content matches its extension and has 8 bits a channel of grey, RGB or RGBA, which every program
/// reads.
fn is_plain(bytes: &[u8], mime: Mime) -> bool {
    let format = match mime {
        Mime::Png => ::image::ImageFormat::Png,
        Mime::Jpeg => ::image::ImageFormat::Jpeg,
    };
    let reader = ::image::ImageReader::with_format(std::io::Cursor::new(bytes), format);
    reader.into_decoder().is_ok_and(|decoder| {
        use ::image::ImageDecoder;
        let plain = matches!(
            decoder.original_color_type(),
            ExtendedColorType::L8 | ExtendedColorType::Rgb8 | ExtendedColorType::Rgba8
        );
        plain
    })
}

/// An image with another alpha; see [`Edit`].
fn edited(image: &Image, edit: Edit) -> Image {
    let table = overbright::byte_table();
    let linear = |c: [u8; 3]| Vec3::from_array(c.map(|b| table[usize::from(b)]));
    let encoder = ByteEncoder::new();
    let encode = |v: f32| encoder.byte(v);
    let texel = |[r, g, b, a]: [u8; 4]| -> [u8; 4] {
        match edit {
            Edit::Inverted => [r, g, b, 255 - a],
            Edit::FromBrightness => {
                let color = linear([r, g, b]);
                let alpha = color.max_element();
                let [r, g, b] = (color / alpha.max(1.0e-6)).to_array().map(encode);
                [r, g, b, (alpha * 255.0 + 0.5) as u8]
            }
            Edit::FromDarkness => {
                let color = linear([r, g, b]);
                let passed = overbright::luminance(color);
                [
                    0,
                    0,
                    0,
                    ((1.0 - passed).clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
                ]
            }
        }
    };
    let rgba: Vec<u8> = image.pixels().flat_map(texel).collect();
    Image {
        has_alpha: rgba.as_chunks::<4>().0.iter().any(|p| p[3] != 255),
        width: image.width,
        height: image.height,
        rgba,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;

    fn picture(texels: &[[u8; 4]]) -> Image {
        Image::from_rgba(texels.len() as u32, 1, texels.concat()).unwrap()
    }

    #[test]
    fn added_light_is_what_blending_adds() {
        let image = picture(&[[0, 0, 0, 255], [188, 0, 0, 255], [255; 4]]);
        let out = edited(&image, Edit::FromBrightness);
        assert_eq!(out.rgba[..4], [0, 0, 0, 0]);
        // 188 is half as bright as 255
        assert_eq!(out.rgba[4..8], [255, 0, 0, 128]);
        assert_eq!(out.rgba[8..], [255; 4]);
        let out = edited(&image, Edit::FromDarkness);
        assert_eq!(out.rgba[..4], [0, 0, 0, 255]);
        assert_eq!(out.rgba[8..], [0, 0, 0, 0]);
    }

    #[test]
    fn jpegs_pass_untouched_and_others_become_png() {
        let image = picture(&[[10, 20, 30, 255], [40, 50, 60, 255]]);
        let mut jpeg = Vec::new();
        let rgb = [10, 20, 30, 40, 50, 60];
        ::image::codecs::jpeg::JpegEncoder::new(&mut jpeg)
            .write_image(&rgb, 2, 1, ExtendedColorType::Rgb8)
            .unwrap();
        let tga = [
            &[0u8, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 24, 0][..],
            &[30, 20, 10, 60, 50, 40],
        ]
        .concat();
        let mut files = MemoryFiles::new();
        files.insert("t/a.jpg", jpeg.clone()).unwrap();
        files.insert("t/b.tga", tga).unwrap();
        let store = ImageStore::default();
        let shader = Shader::new("t/x");
        let get = |name: &str| {
            let picture = Picture::File(name.to_owned());
            store.get(&files, &picture, &shader).unwrap()
        };
        let a = get("t/a").unwrap();
        assert_eq!(
            (a.mime, &a.bytes, a.path.as_str()),
            (Mime::Jpeg, &jpeg, "t/a.jpg")
        );
        let b = get("t/b.jpg").unwrap();
        assert_eq!((b.mime, b.path.as_str()), (Mime::Png, "t/b.png"));
        let back = ::image::load_from_memory(&b.bytes).unwrap();
        assert_eq!(back.color(), ::image::ColorType::Rgb8);
        assert_eq!(back.into_rgba8().into_raw(), image.rgba);
        assert!(get("t/none").is_none());
    }

    #[test]
    fn the_store_forgets_what_was_not_used_for_longest() {
        let mut files = MemoryFiles::new();
        let tga = |c: u8| {
            let head = [0u8, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0];
            [&head[..], &[c, c, c]].concat()
        };
        for (i, name) in ["a", "b", "c"].into_iter().enumerate() {
            files.insert(&format!("{name}.tga"), tga(i as u8)).unwrap();
        }
        let picture = |name: &str| Picture::File(name.to_owned());
        let shader = Shader::new("x");
        let size = {
            let store = ImageStore::default();
            store
                .get(&files, &picture("a"), &shader)
                .unwrap()
                .unwrap()
                .bytes
                .len()
        };
        let store = ImageStore::new(size * 2 + size / 2);
        for name in ["a", "b", "a", "c"] {
            store.get(&files, &picture(name), &shader).unwrap().unwrap();
        }
        let kept = store.kept.lock().unwrap();
        assert!(kept.images.contains_key(&picture("a")));
        assert!(!kept.images.contains_key(&picture("b")));
        assert!(kept.bytes <= store.budget);
    }

    #[test]
    fn names_become_safe_paths() {
        assert_eq!(safe_path("Textures\\a/b?c"), "textures_a/b_c");
        assert_eq!(safe_path("../x"), "image");
        assert_eq!(safe_path("*white"), "_white");
    }
}
