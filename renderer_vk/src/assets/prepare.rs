//! Prepares the mip levels of a texture from an image file, by the engine's rules and the player's settings.
//!
//! Source: engine behaviour of `renderer_opengl1`: sides become powers of two, `r_picmip` halves, then the mip chain.

use glam::{Vec3, Vec4};
use relight::image::Image;
use relight::overbright;
use support::slice::item;

use super::source::ImageFlags;
use crate::settings::Settings;

/// Settings that textures depend on; they change only at registration.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureSettings {
    /// Number of halvings of images with `picmip`.
    pub picmip: u32,
    /// Sizes are rounded down to a power of two instead of up.
    pub round_down: bool,
    /// Box filter for mip levels; otherwise a weighted 4 x 4 filter.
    pub simple_mip_maps: bool,
    /// Mip levels of detail stages fade to grey.
    pub detail_fade: bool,
    /// Factor on the colours of mipmapped images, at least 1.
    pub intensity: f32,
    /// Gamma applied to images if the display applies none: `r_gamma` with `r_ignorehwgamma`, otherwise 1.
    pub gamma: f32,
    /// 0..1: desaturation.
    pub greyscale: f32,
    /// Mip levels are tinted.
    pub color_mips: bool,
    /// Maximum side that the device supports.
    pub max_size: u32,
}

impl TextureSettings {
    /// The part of the renderer's settings that textures depend on.
    pub fn new(settings: &Settings, max_size: u32) -> Self {
        Self {
            picmip: settings.picmip,
            round_down: settings.round_images_down,
            simple_mip_maps: settings.simple_mip_maps,
            detail_fade: settings.detail_fade,
            intensity: if settings.intensity.is_finite() {
                settings.intensity.max(1.0)
            } else {
                1.0
            },
            gamma: settings.software_gamma(),
            greyscale: if settings.greyscale.is_finite() {
                settings.greyscale.clamp(0.0, 1.0)
            } else {
                0.0
            },
            color_mips: settings.color_mip_levels,
            max_size: max_size.max(1),
        }
    }
}

/// The levels of a texture, largest first; at least one.
pub fn prepare(image: &Image, flags: ImageFlags, settings: &TextureSettings) -> Vec<Image> {
    let mut base = image.to_power_of_two(settings.round_down);
    let whole = (base.width, base.height);
    if settings.greyscale > 0.0 && !flags.data {
        desaturate(&mut base.rgba, settings.greyscale);
    }
    let fades = flags.detail && settings.detail_fade;
    let halvings = if flags.picmip && !fades {
        settings.picmip
    } else {
        0
    };
    let target = |side: u32| {
        side.checked_shr(halvings)
            .unwrap_or(0)
            .clamp(1, settings.max_size)
    };
    let (width, height) = (target(base.width), target(base.height));
    while base.width > width || base.height > height {
        base = smaller(&base, settings.simple_mip_maps);
    }
    if flags.mipmap && settings.intensity > 1.0 && !flags.data {
        brighten(&mut base.rgba, settings.intensity);
    }
    // the engine does not modify images without mip levels, unless it halves them
    let halved = (base.width, base.height) != whole;
    if settings.gamma != 1.0 && (flags.mipmap || halved) && !flags.data {
        apply_gamma(&mut base.rgba, settings.gamma);
    }
    if !flags.mipmap {
        return vec![base];
    }
    let mut levels = vec![base];
    let mut tints = MIP_TINTS.iter().cycle();
    while let Some(last) = levels.last()
        && (last.width > 1 || last.height > 1)
    {
        // from a tinted or faded level
        let mut next = smaller(last, settings.simple_mip_maps);
        if settings.color_mips
            && let Some(tint) = tints.next()
        {
            blend_over(&mut next.rgba, *tint);
        }
        if fades {
            fade_to_grey(&mut next.rgba, levels.len());
        }
        levels.push(next);
    }
    levels
}

/// Blends a mip level of a detail stage towards the grey that `dst_color src_color` leaves unchanged: a quarter at the
/// first level, all from the fourth on.
fn fade_to_grey(rgba: &mut [u8], level: usize) {
    let grey = level.min(4) as u32;
    for [color @ .., _] in rgba.as_chunks_mut::<4>().0 {
        for channel in color {
            *channel = ((u32::from(*channel) * (4 - grey) + 127 * grey) / 4) as u8;
        }
    }
}

/// Colours of `r_colorMipLevels` from the first mip level below the largest.
const MIP_TINTS: [[u8; 3]; 3] = [[255, 0, 0], [0, 255, 0], [0, 0, 255]];

/// Blends a tint with the engine's weights, 127 and 128 of 512, which halve the brightness.
fn blend_over(rgba: &mut [u8], tint: [u8; 3]) {
    for texel in rgba.as_chunks_mut::<4>().0 {
        for (channel, tint) in texel.iter_mut().zip(tint) {
            let mixed = (u32::from(*channel) * 127 + u32::from(tint) * 128) >> 9;
            *channel = u8::try_from(mixed).unwrap_or(u8::MAX);
        }
    }
}

/// Mean linear colour and mean alpha.
pub fn mean(image: &Image) -> Vec4 {
    image.mean_linear().extend(image.mean_alpha())
}

fn smaller(image: &Image, simple: bool) -> Image {
    // the weighted filter needs two texels in each direction; the engine uses the box filter here, too
    if simple || image.width < 2 || image.height < 2 {
        image.halve()
    } else {
        weighted(image)
    }
}

/// Half the size by the weights 1 2 2 1 / 2 4 4 2 / 2 4 4 2 / 1 2 2 1 (of 36), with repeated edges.
fn weighted(image: &Image) -> Image {
    let (width, height) = (image.width / 2, image.height / 2);
    let texels = image.rgba.as_chunks::<4>().0;
    let at = |x: u32, y: u32| {
        let index = (y % image.height) as usize * image.width as usize + (x % image.width) as usize;
        item(texels, index)
    };
    const WEIGHTS: [u32; 4] = [1, 2, 2, 1];
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0u32; 4];
            for (dy, wy) in (0u32..).zip(WEIGHTS) {
                for (dx, wx) in (0u32..).zip(WEIGHTS) {
                    // one texel up and left of the 2 x 2 block; adding the size first avoids unsigned underflow
                    let texel = at(x * 2 + dx + image.width - 1, y * 2 + dy + image.height - 1);
                    for (sum, byte) in sum.iter_mut().zip(texel) {
                        *sum += u32::from(byte) * wx * wy;
                    }
                }
            }
            rgba.extend(sum.map(|s| u8::try_from(s / 36).unwrap_or(u8::MAX)));
        }
    }
    Image::from_rgba(width, height, rgba).unwrap_or_else(|| image.halve())
}

/// Luma weights (Rec. 709, as the engine).
const LUMA: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// A colour moved towards its luma by `amount`, 0 to 1 (`r_greyscale`).
pub fn grey(color: Vec3, amount: f32) -> Vec3 {
    color.lerp(Vec3::splat(color.dot(LUMA)), amount)
}

/// Blends colours towards their luma.
pub fn desaturate(rgba: &mut [u8], amount: f32) {
    for texel in rgba.as_chunks_mut::<4>().0 {
        let [r, g, b, _] = *texel;
        let luma = LUMA.dot(Vec3::new(f32::from(r), f32::from(g), f32::from(b)));
        for channel in texel.iter_mut().take(3) {
            let value = f32::from(*channel);
            *channel = (value + (luma - value) * amount) as u8;
        }
    }
}

fn brighten(rgba: &mut [u8], intensity: f32) {
    for texel in rgba.as_chunks_mut::<4>().0 {
        for channel in texel.iter_mut().take(3) {
            *channel = (f32::from(*channel) * intensity).min(255.0) as u8;
        }
    }
}

/// Applies gamma to colours, as a display's gamma ramp would.
fn apply_gamma(rgba: &mut [u8], gamma: f32) {
    let table = overbright::gamma_table(gamma, 0);
    for texel in rgba.as_chunks_mut::<4>().0 {
        for channel in texel.iter_mut().take(3) {
            *channel = table[usize::from(*channel)];
        }
    }
}

/// An opaque image of a lightmap page or other RGB bytes, overbright shift applied; `None` if the length is wrong.
pub fn light_page(rgb: &[u8], side: u32, shift_bits: u32, greyscale: f32) -> Option<Image> {
    let mut rgba = Vec::with_capacity(rgb.len() / 3 * 4);
    for texel in rgb.as_chunks::<3>().0 {
        let [r, g, b] = overbright::shift(*texel, shift_bits);
        rgba.extend([r, g, b, 255]);
    }
    if greyscale > 0.0 {
        desaturate(&mut rgba, greyscale);
    }
    Image::from_rgba(side, side, rgba)
}

/// A lightmap page with brightness as hue, red the darkest (`r_lightmap 2`), and the brightness of its brightest texel,
/// 0 to 1; `None` if the length is wrong.
pub fn heat_page(rgb: &[u8], side: u32) -> Option<(Image, f32)> {
    let mut rgba = Vec::with_capacity(rgb.len() / 3 * 4);
    let mut brightest = 0.0f32;
    for texel in rgb.as_chunks::<3>().0 {
        let [r, g, b] = texel.map(f32::from);
        // the engine's weights
        let brightness = ((0.33 * r + 0.685 * g + 0.063 * b) / 255.0).min(1.0);
        brightest = brightest.max(brightness);
        let [r, g, b] = hue(brightness);
        rgba.extend([r, g, b, 255]);
    }
    Some((Image::from_rgba(side, side, rgba)?, brightest))
}

/// The colour of a brightness (0 to 1) at half the value: hues from red to magenta.
fn hue(brightness: f32) -> [u8; 3] {
    let sixths = brightness * 5.0;
    // 1 at the channel's own hue, 0 from a third of a turn away
    let channel = |centre: f32| {
        let away = (sixths - centre).abs();
        let away = away.min(6.0 - away);
        (2.0 - away).clamp(0.0, 1.0)
    };
    [0.0, 2.0, 4.0].map(|centre| (channel(centre) * 0.5 * 255.0) as u8)
}

/// The 16 x 16 image of a dynamic light: falls off with the square of the distance from its centre.
pub fn dynamic_light_picture() -> Image {
    Image::generate(16, 16, |x, y| {
        let (dx, dy) = (7.5 - x as f32, 7.5 - y as f32);
        let brightness = (4000.0 / (dx * dx + dy * dy)).min(255.0);
        let byte = if brightness < 75.0 {
            0
        } else {
            brightness as u8
        };
        [byte, byte, byte, 255]
    })
}

/// Fog density as alpha: horizontally by the distance in fog, vertically by the part of that distance below the fog's
/// surface. Filtering of this image is part of the appearance: slight fog even at the surface.
pub fn fog_picture() -> Image {
    const WIDTH: u32 = 256;
    const HEIGHT: u32 = 32;
    Image::generate(WIDTH, HEIGHT, |x, y| {
        let below = (y as f32 + 0.5) / HEIGHT as f32;
        let mut distance = x as f32 / WIDTH as f32;
        if below < 1.0 / 32.0 {
            distance = 0.0;
        } else if below < 31.0 / 32.0 {
            distance *= (below - 1.0 / 32.0) / (30.0 / 32.0);
        }
        // the image covers eight times the distance of full fog; the square root comes from a table
        let step = ((distance * 8.0).min(1.0) * 255.0).floor();
        [255, 255, 255, ((step / 255.0).sqrt() * 255.0) as u8]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> TextureSettings {
        TextureSettings::new(&Settings::full_size(), 4096)
    }

    fn grey(width: u32, height: u32, value: u8) -> Image {
        let rgba = [value, value, value, 255].repeat((width * height) as usize);
        Image::from_rgba(width, height, rgba).unwrap()
    }

    #[test]
    fn sizes_follow_the_flags() {
        let sizes = |flags, settings: &TextureSettings| {
            prepare(&grey(100, 60, 9), flags, settings)
                .iter()
                .map(|i| (i.width, i.height))
                .collect::<Vec<_>>()
        };
        assert_eq!(sizes(ImageFlags::NO_MIP, &settings()), [(64, 32)]);
        let chain = sizes(ImageFlags::WORLD, &settings());
        assert_eq!(chain.len(), 7);
        assert_eq!(chain.last(), Some(&(1, 1)));
        let small = TextureSettings {
            picmip: 2,
            ..settings()
        };
        assert_eq!(sizes(ImageFlags::WORLD, &small)[0], (16, 8));
        assert_eq!(sizes(ImageFlags::NO_MIP, &small), [(64, 32)]);
        let huge = TextureSettings {
            picmip: 16,
            ..settings()
        };
        assert_eq!(sizes(ImageFlags::WORLD, &huge), [(1, 1)]);
        let limited = TextureSettings {
            max_size: 8,
            round_down: false,
            ..settings()
        };
        // both sides are halved together until the larger fits
        assert_eq!(sizes(ImageFlags::NO_MIP, &limited), [(8, 4)]);
    }

    #[test]
    fn gamma_is_for_images_that_are_halved_or_mipmapped() {
        let brighter = TextureSettings {
            gamma: 2.0,
            max_size: 64,
            ..settings()
        };
        let first = |side, flags| prepare(&grey(side, side, 64), flags, &brighter)[0].rgba[0];
        // 255 * (64 / 255) ^ 0.5
        assert_eq!(first(2, ImageFlags::WORLD), 128);
        assert_eq!(first(128, ImageFlags::NO_MIP), 128);
        // the size is a power of two, or becomes one
        assert_eq!(first(2, ImageFlags::NO_MIP), 64);
        assert_eq!(first(3, ImageFlags::NO_MIP), 64);
        // only if the display applies no gamma
        let player = Settings {
            gamma: 2.0,
            ..Settings::default()
        };
        assert_eq!(TextureSettings::new(&player, 4096).gamma, 1.0);
        let ignoring = Settings {
            ignore_hw_gamma: true,
            ..player
        };
        assert_eq!(TextureSettings::new(&ignoring, 4096).gamma, 2.0);
        assert_eq!(ignoring.display_gamma(), 1.0);
    }

    #[test]
    fn intensity_is_for_mipmapped_images() {
        let bright = TextureSettings {
            intensity: 2.0,
            ..settings()
        };
        assert_eq!(
            prepare(&grey(2, 2, 100), ImageFlags::WORLD, &bright)[0].rgba[0],
            200
        );
        assert_eq!(
            prepare(&grey(2, 2, 200), ImageFlags::WORLD, &bright)[0].rgba[0],
            255
        );
        assert_eq!(
            prepare(&grey(2, 2, 100), ImageFlags::NO_MIP, &bright)[0].rgba[0],
            100
        );
    }

    #[test]
    fn weighted_filter_keeps_an_even_picture() {
        let weighted = TextureSettings {
            simple_mip_maps: false,
            ..settings()
        };
        for level in prepare(&grey(8, 8, 77), ImageFlags::WORLD, &weighted) {
            assert!(level.rgba.chunks(4).all(|t| t == [77, 77, 77, 255]));
        }
    }

    #[test]
    fn light_pages_are_shifted() {
        let page = light_page(&[10, 20, 30].repeat(4), 2, 2, 0.0).unwrap();
        assert_eq!(&page.rgba[..4], [40, 80, 120, 255]);
        assert!(light_page(&[0; 9], 2, 0, 0.0).is_none());
    }

    #[test]
    fn fog_thickens_with_distance_and_depth() {
        let fog = fog_picture();
        let at = |x: usize, y: usize| fog.rgba[(y * 256 + x) * 4 + 3];
        assert_eq!((at(0, 31), at(255, 0)), (0, 0));
        assert_eq!((at(32, 31), at(255, 31)), (255, 255));
        // an eighth of full density: the square root of the table's next lower step, 31 of 255
        assert_eq!(at(4, 31), 88);
        assert!(at(16, 10) < at(16, 20) && at(16, 20) < at(16, 31));
    }

    #[test]
    fn blob_is_bright_in_the_middle_and_black_outside() {
        let blob = dynamic_light_picture();
        let at = |x: usize, y: usize| blob.rgba[(y * 16 + x) * 4];
        assert_eq!(at(7, 7), 255);
        assert_eq!(at(0, 0), 0);
        assert_eq!(at(7, 15), 0);
        assert!(at(7, 12) > 75);
    }

    #[test]
    fn coloured_levels_are_tinted_one_on_top_of_the_other() {
        let tinted = TextureSettings {
            color_mips: true,
            ..settings()
        };
        let levels = prepare(&grey(8, 8, 200), ImageFlags::WORLD, &tinted);
        assert_eq!(levels[0].rgba[..4], [200, 200, 200, 255]);
        // (200 * 127 + 255 * 128) / 512, (200 * 127) / 512
        assert_eq!(levels[1].rgba[..4], [113, 49, 49, 255]);
        assert_eq!(levels[2].rgba[..4], [28, 75, 12, 255]);
    }

    #[test]
    fn levels_of_detail_stages_fade_to_grey() {
        let detail = ImageFlags {
            detail: true,
            ..ImageFlags::WORLD
        };
        let values = |detail_fade, flags| {
            let settings = TextureSettings {
                detail_fade,
                picmip: 1,
                ..settings()
            };
            let levels = prepare(&grey(32, 32, 200), flags, &settings);
            levels.iter().map(|level| level.rgba[0]).collect::<Vec<_>>()
        };
        // 200 * 3/4 + 127 / 4, half of that and half of 127, ...; and r_picmip does not apply
        assert_eq!(values(true, detail), [200, 181, 154, 133, 127, 127]);
        assert_eq!(values(false, detail), [200; 5]);
        assert_eq!(values(true, ImageFlags::WORLD), [200; 5]);
    }

    #[test]
    fn heat_goes_from_red_to_magenta() {
        let (page, brightest) =
            heat_page(&[0, 0, 0, 51, 51, 51, 255, 255, 255, 0, 0, 0], 2).unwrap();
        assert_eq!(page.rgba[..4], [127, 0, 0, 255]);
        assert!(page.rgba[5] > page.rgba[4], "{:?}", &page.rgba[4..8]);
        assert_eq!(page.rgba[8..12], [127, 0, 127, 255]);
        assert_eq!(brightest, 1.0);
        assert!(heat_page(&[0; 5], 2).is_none());
    }
}
