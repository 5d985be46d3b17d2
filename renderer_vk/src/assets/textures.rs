//! Textures by name, on the GPU.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Vec2, Vec4};
use relight::GameFiles;
use relight::image::{self, Image, ImageError, default_image};
use relight::materials::finish::SurfaceMap;

use super::alpha::AlphaGrid;
use super::prepare::{self, TextureSettings};
use super::source::{ImageFlags, ImageSource};
use crate::gpu::{
    self, Device, Filter, Format, ImageDesc, ImageUsage, MipFilter, SamplerDesc, Wrap,
};
use crate::settings::TextureMode;

/// The samplers of textures: bindless indices in the order of [`compile::sampler`](super::compile::sampler).
///
/// On a new device they are 0 to 4. Samplers without mip levels never change; a change of `r_textureMode` or anisotropy
/// replaces the first two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Samplers(pub [u32; 5]);

impl Samplers {
    /// Finds or makes the samplers for an `r_textureMode` and an anisotropy (1 and below: none).
    ///
    /// # Errors
    /// The device has no free descriptors for samplers.
    pub fn new(
        device: &Device,
        texture_mode: TextureMode,
        anisotropy: f32,
    ) -> Result<Self, gpu::Error> {
        let (filter, mip) = texture_filter(texture_mode);
        let anisotropy = if anisotropy.is_finite() {
            anisotropy
        } else {
            0.0
        };
        let make = |filter, mip, wrap, anisotropy| {
            device.sampler(&SamplerDesc {
                filter,
                mip,
                wrap,
                anisotropy,
                lod_bias: 0.0,
            })
        };
        Ok(Self([
            make(filter, mip, Wrap::Repeat, anisotropy)?,
            make(filter, mip, Wrap::Clamp, anisotropy)?,
            make(Filter::Linear, MipFilter::None, Wrap::Repeat, 0.0)?,
            make(Filter::Linear, MipFilter::None, Wrap::Clamp, 0.0)?,
            make(Filter::Nearest, MipFilter::None, Wrap::Clamp, 0.0)?,
        ]))
    }

    /// Bindless index of a value of [`compile::sampler`](super::compile::sampler).
    pub fn index(&self, kind: u32) -> u32 {
        self.0.get(kind as usize).copied().unwrap_or(self.0[0])
    }
}

/// Filters of an `r_textureMode`.
fn texture_filter(mode: TextureMode) -> (Filter, MipFilter) {
    match mode {
        TextureMode::Nearest => (Filter::Nearest, MipFilter::None),
        TextureMode::Linear => (Filter::Linear, MipFilter::None),
        TextureMode::NearestMipNearest => (Filter::Nearest, MipFilter::Nearest),
        TextureMode::LinearMipNearest => (Filter::Linear, MipFilter::Nearest),
        TextureMode::NearestMipLinear => (Filter::Nearest, MipFilter::Linear),
        TextureMode::LinearMipLinear => (Filter::Linear, MipFilter::Linear),
    }
}

/// A texture by name.
struct Texture {
    name: String,
    /// `None` if there is no usable file.
    image: Option<gpu::Image>,
    flags: ImageFlags,
}

/// A dynamic texture: cinematics and raw pictures.
struct Scratch {
    image: gpu::Image,
    /// A queued command of this frame draws it.
    queued: bool,
}

/// All textures of a registration.
pub struct Textures {
    device: Device,
    files: Arc<dyn GameFiles>,
    settings: TextureSettings,
    by_name: HashMap<String, usize>,
    textures: Vec<Texture>,
    means: HashMap<u32, Vec4>,
    /// Lightmap pages with their names.
    lightmaps: Vec<(String, gpu::Image)>,
    /// Alpha grids of images with a transparent texel, by bindless index.
    transparent: HashMap<u32, AlphaGrid>,
    scratch: HashMap<usize, Scratch>,
    white: u32,
    default_image: u32,
    black: u32,
    dynamic_light: u32,
    failure: Option<gpu::Error>,
}

impl Textures {
    /// The built-in textures only.
    ///
    /// # Errors
    /// The device has no memory for them.
    pub fn new(
        device: &Device,
        files: Arc<dyn GameFiles>,
        settings: TextureSettings,
    ) -> Result<Self, gpu::Error> {
        let mut textures = Self {
            device: device.clone(),
            files,
            settings,
            by_name: HashMap::new(),
            textures: Vec::new(),
            means: HashMap::new(),
            lightmaps: Vec::new(),
            transparent: HashMap::new(),
            scratch: HashMap::new(),
            white: 0,
            default_image: 0,
            black: 0,
            dynamic_light: 0,
            failure: None,
        };
        textures.white = textures.built_in("*white", &Image::uniform([255; 4]))?;
        textures.black = textures.built_in("*black", &Image::uniform([0, 0, 0, 255]))?;
        textures.default_image = textures.built_in("*default", &default_image(32))?;
        let blob = prepare::dynamic_light_picture();
        textures.dynamic_light = textures.built_in("*dlight", &blob)?;
        textures.built_in(super::compile::FOG_IMAGE, &prepare::fog_picture())?;
        Ok(textures)
    }

    /// Begins another registration with the images that are loaded, and other files that have the same images. Lightmaps,
    /// images below `maps/` and dynamic textures are dropped, and missing images are looked for again.
    pub fn renew(&mut self, files: Arc<dyn GameFiles>) {
        self.files = files;
        self.scratch.clear();
        self.failure = None;
        let mut dropped: Vec<u32> = Vec::new();
        dropped.extend(
            self.lightmaps
                .iter()
                .map(|(_, image)| image.texture_index()),
        );
        self.lightmaps.clear();
        self.textures.retain(|texture| {
            let of_map = texture.name.to_ascii_lowercase().starts_with("maps/");
            let stays = texture.image.is_some() && !of_map;
            if !stays {
                dropped.extend(texture.image.as_ref().map(gpu::Image::texture_index));
            }
            stays
        });
        for index in dropped {
            self.means.remove(&index);
            self.transparent.remove(&index);
        }
        let names = self.textures.iter().map(|texture| texture.name.clone());
        self.by_name = names.zip(0..).collect();
    }

    /// The game's files.
    pub fn files(&self) -> &Arc<dyn GameFiles> {
        &self.files
    }

    /// Settings for textures that are loaded from now on.
    pub fn set_settings(&mut self, settings: TextureSettings) {
        self.settings = settings;
    }

    /// The current settings.
    pub fn settings(&self) -> &TextureSettings {
        &self.settings
    }

    /// The 16 x 16 image of dynamic lights on walls.
    pub fn dynamic_light(&self) -> u32 {
        self.dynamic_light
    }

    /// The black image.
    pub fn black(&self) -> u32 {
        self.black
    }

    /// The bindless index of the image `name`, loaded at its first use; `None` if there is no usable file. Names are
    /// compared exactly, and the first request determines the flags, as in the engine.
    pub fn find(&mut self, name: &str, flags: ImageFlags) -> Option<u32> {
        self.find_by(name, flags, |files| {
            let Some((image, file)) = image::load(files, name)? else {
                return Ok(None);
            };
            if !file.eq_ignore_ascii_case(name) {
                log::debug!("{name}: found as {file}");
            }
            Ok(Some(image))
        })
    }

    /// [`find`](Self::find) with another way to load the image.
    fn find_by(
        &mut self,
        name: &str,
        flags: ImageFlags,
        load: impl FnOnce(&dyn GameFiles) -> Result<Option<Image>, ImageError>,
    ) -> Option<u32> {
        if let Some(texture) = self.by_name.get(name).and_then(|&i| self.textures.get(i)) {
            if texture.flags != flags && texture.image.is_some() {
                log::debug!("{name}: used with other image flags than before; the first ones stay");
            }
            return texture.image.as_ref().map(gpu::Image::texture_index);
        }
        let image = match load(&*self.files) {
            Ok(Some(image)) => self.upload(name, &image, flags),
            Ok(None) => None,
            Err(problem) => {
                log::warn!("{problem}");
                None
            }
        };
        let index = image.as_ref().map(gpu::Image::texture_index);
        self.by_name.insert(name.to_owned(), self.textures.len());
        self.textures.push(Texture {
            name: name.to_owned(),
            image,
            flags,
        });
        index
    }

    /// Uploads a lightmap page (`side` x `side` RGB), whose bytes are stored unchanged, and returns its bindless index.
    ///
    /// # Errors
    /// The device has no memory for it, or no free descriptor.
    pub fn create_lightmap(&mut self, name: &str, page: &Image) -> Result<u32, gpu::Error> {
        let image = self.create(name, std::slice::from_ref(page))?;
        let index = image.texture_index();
        self.means.insert(index, prepare::mean(page));
        self.lightmaps.push((name.to_owned(), image));
        Ok(index)
    }

    /// Uploads new pixels (RGBA rows from the top) of a client number. Returns `(old, new)` if it had to make a new
    /// texture, so that stages can be changed to the new index.
    ///
    /// # Errors
    /// The device has no memory for a texture of another size, or for the upload.
    pub fn update_scratch(
        &mut self,
        client: usize,
        width: u32,
        height: u32,
        rgba: &[u8],
        dirty: bool,
    ) -> Result<Option<(u32, u32)>, gpu::Error> {
        let Some(picture) = expected_bytes(width, height).and_then(|n| rgba.get(..n)) else {
            log::warn!(
                "cinematic {client}: {} bytes for {width} x {height}",
                rgba.len()
            );
            return Ok(None);
        };
        let known = self.scratch.get(&client);
        if let Some(scratch) = known
            && scratch.image.width() == width
            && scratch.image.height() == height
            // a queued command shows the pixels of the time when it was queued
            && !(dirty && scratch.queued)
        {
            if dirty {
                self.device.upload_image(&scratch.image, 0, 0, picture)?;
            }
            return Ok(None);
        }
        let old = known.map_or(self.black, |s| s.image.texture_index());
        let image = gpu::Image::new(
            &self.device,
            &ImageDesc::new("scratch", width, height, Format::Rgba8, ImageUsage::SAMPLED),
        )?;
        self.device.upload_image(&image, 0, 0, picture)?;
        let new = image.texture_index();
        let queued = false;
        self.scratch.insert(client, Scratch { image, queued });
        Ok(Some((old, new)))
    }

    /// Texture, width and height of each image, in the order of `imagelist`.
    pub fn images(&self) -> impl Iterator<Item = (u32, u32, u32)> {
        self.textures
            .iter()
            .filter_map(|t| t.image.as_ref())
            .chain(self.lightmaps.iter().map(|(_, image)| image))
            .map(|image| (image.texture_index(), image.width(), image.height()))
    }

    /// The texture of a client for a command of this frame: until [`Self::end_frame`] new pixels go to a new texture.
    pub fn queue_scratch(&mut self, client: usize) -> u32 {
        if let Some(scratch) = self.scratch.get_mut(&client) {
            scratch.queued = true;
        }
        self.scratch(client)
    }

    /// Ends the frame: its queued commands have been recorded.
    pub fn end_frame(&mut self) {
        self.scratch.values_mut().for_each(|s| s.queued = false);
    }

    /// Lines for `imagelist`: number, size, channels in use, bytes on the GPU, name; then total bytes and number of
    /// images.
    pub fn list(&self) -> Vec<String> {
        let mut bytes = 0;
        let mut lines = vec![
            String::new(),
            "      -w-- -h-- type  -size- --name-------".into(),
        ];
        let listed = self
            .textures
            .iter()
            .filter_map(|t| Some((t.name.as_str(), t.image.as_ref()?)))
            .chain(self.lightmaps.iter().map(|(name, i)| (name.as_str(), i)));
        let mut count = 0;
        for (name, image) in listed {
            let size = image_bytes(image);
            let transparent = self.transparent.contains_key(&image.texture_index());
            lines.push(format!(
                "{count:4}: {:4}x{:4} {} {} {name}",
                image.width(),
                image.height(),
                if transparent { "RGBA " } else { "RGB  " },
                readable_size(size),
            ));
            bytes += size;
            count += 1;
        }
        lines.push(" ---------".into());
        lines.push(format!(" approx {bytes} bytes"));
        lines.push(format!(" {count} total images"));
        lines.push(String::new());
        lines
    }

    /// The first device failure since the last call: lookups by name cannot return it.
    pub fn take_failure(&mut self) -> Option<gpu::Error> {
        self.failure.take()
    }

    fn upload(&mut self, name: &str, image: &Image, flags: ImageFlags) -> Option<gpu::Image> {
        let levels = prepare::prepare(image, flags, &self.settings);
        match self.create(name, &levels) {
            Ok(created) => {
                if let Some(smallest) = levels.last() {
                    // the smallest mip level averages encoded values; the mean is computed in linear light
                    let of = levels.first().unwrap_or(smallest);
                    self.means
                        .insert(created.texture_index(), prepare::mean(of));
                }
                self.note_alpha(&created, image);
                Some(created)
            }
            Err(problem) => {
                log::error!("{name}: {problem}");
                self.failure.get_or_insert(problem);
                None
            }
        }
    }

    fn note_alpha(&mut self, created: &gpu::Image, image: &Image) {
        if let Some(grid) = AlphaGrid::of(image) {
            self.transparent.insert(created.texture_index(), grid);
        }
    }

    /// The smallest and the greatest alpha of an image within a triangle of texture coordinates; `None` for a dynamic
    /// or unknown image.
    pub fn alpha_range(&self, texture: u32, corners: [Vec2; 3], clamped: bool) -> Option<(u8, u8)> {
        match self.transparent.get(&texture) {
            Some(grid) => Some(grid.range(corners, clamped)),
            None => self.means.contains_key(&texture).then_some((255, 255)),
        }
    }

    /// Part of an image whose alpha passes a test; `None` for a dynamic or unknown image.
    pub fn alpha_share(&self, texture: u32, passes: impl Fn(u8) -> bool) -> Option<f32> {
        match self.transparent.get(&texture) {
            Some(grid) => Some(grid.share(passes)),
            None => self.means.contains_key(&texture).then_some(1.0),
        }
    }

    fn create(&self, name: &str, levels: &[Image]) -> Result<gpu::Image, gpu::Error> {
        let (width, height) = levels.first().map_or((1, 1), |l| (l.width, l.height));
        let image = gpu::Image::new(
            &self.device,
            &ImageDesc {
                mips: u32::try_from(levels.len()).unwrap_or(1).max(1),
                ..ImageDesc::new(name, width, height, Format::Rgba8, ImageUsage::SAMPLED)
            },
        )?;
        for (mip, level) in (0u32..).zip(levels) {
            self.device.upload_image(&image, mip, 0, &level.rgba)?;
        }
        Ok(image)
    }

    fn built_in(&mut self, name: &str, image: &Image) -> Result<u32, gpu::Error> {
        let levels = prepare::prepare(
            image,
            ImageFlags {
                picmip: false,
                ..ImageFlags::WORLD
            },
            &TextureSettings {
                picmip: 0,
                intensity: 1.0,
                ..self.settings.clone()
            },
        );
        let created = self.create(name, &levels)?;
        let index = created.texture_index();
        self.means.insert(index, prepare::mean(image));
        self.note_alpha(&created, image);
        self.by_name.insert(name.to_owned(), self.textures.len());
        self.textures.push(Texture {
            name: name.to_owned(),
            image: Some(created),
            flags: ImageFlags {
                picmip: false,
                ..ImageFlags::WORLD
            },
        });
        Ok(index)
    }
}

/// Bytes of an image of four bytes a texel with its mip levels.
fn image_bytes(image: &gpu::Image) -> u64 {
    (0..image.mips())
        .map(|mip| {
            let side = |size: u32| u64::from((size >> mip).max(1));
            side(image.width()) * side(image.height()) * 4
        })
        .sum()
}

/// A size, formatted for the width of the list's column.
fn readable_size(bytes: u64) -> String {
    const KIB: u64 = 1024;
    match bytes {
        0..KIB => format!("{bytes:4}b "),
        KIB..0x10_0000 => format!("{:4}kb", bytes / KIB),
        _ => format!("{:4.1}Mb", bytes as f64 / (KIB * KIB) as f64),
    }
}

fn expected_bytes(width: u32, height: u32) -> Option<usize> {
    if width == 0 || height == 0 {
        return None;
    }
    usize::try_from(u64::from(width) * u64::from(height) * 4).ok()
}

impl ImageSource for Textures {
    fn image(&mut self, name: &str, flags: ImageFlags) -> Option<(u32, ImageFlags)> {
        let index = self.find(name, flags)?;
        let first = self.by_name.get(name).and_then(|&i| self.textures.get(i));
        Some((index, first.map_or(flags, |texture| texture.flags)))
    }

    fn surface_map(&mut self, map: &SurfaceMap) -> Option<u32> {
        // the name of a file cannot be that of a map: it does not end with a parenthesis
        self.find_by(&map.to_string(), ImageFlags::DATA, |files| map.load(files))
    }

    fn exists(&self, name: &str) -> bool {
        image::find(&*self.files, name).is_some()
    }

    fn white(&self) -> u32 {
        self.white
    }

    fn default_image(&self) -> u32 {
        self.default_image
    }

    fn scratch(&mut self, client: usize) -> u32 {
        self.scratch
            .get(&client)
            .map_or(self.black, |s| s.image.texture_index())
    }

    fn lightmap(&self, page: usize) -> Option<u32> {
        self.lightmaps.get(page).map(|(_, i)| i.texture_index())
    }

    fn mean(&self, texture: u32) -> Vec4 {
        self.means.get(&texture).copied().unwrap_or(Vec4::ONE)
    }
}
