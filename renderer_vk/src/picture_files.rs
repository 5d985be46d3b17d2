//! Pictures as files: PNG and JPEG for the display, OpenEXR for linear light.

use exr::prelude::{Encoding, Image, SpecificChannels, WritableImage, f16};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::error::{EncodingError, ImageFormatHint, ParameterError, ParameterErrorKind};
use image::{ExtendedColorType, ImageEncoder, ImageError, ImageResult};

/// A PNG of RGB bytes, rows from the top.
///
/// # Errors
/// The bytes do not match the size.
pub fn png(rgb: &[u8], width: u32, height: u32) -> ImageResult<Vec<u8>> {
    fits(rgb.len(), 3, width, height)?;
    let mut bytes = Vec::new();
    let kind = ExtendedColorType::Rgb8;
    PngEncoder::new(&mut bytes).write_image(rgb, width, height, kind)?;
    Ok(bytes)
}

/// A JPEG of RGB bytes, rows from the top; quality in percent.
///
/// # Errors
/// The bytes do not match the size.
pub fn jpeg(rgb: &[u8], width: u32, height: u32, quality: u8) -> ImageResult<Vec<u8>> {
    fits(rgb.len(), 3, width, height)?;
    let mut bytes = Vec::new();
    let kind = ExtendedColorType::Rgb8;
    JpegEncoder::new_with_quality(&mut bytes, quality).write_image(rgb, width, height, kind)?;
    Ok(bytes)
}

/// The encoders of `image` panic where the number of values does not match the size.
fn fits(values: usize, per_pixel: usize, width: u32, height: u32) -> ImageResult<()> {
    let pixels = (width as usize).checked_mul(height as usize);
    if pixels.and_then(|n| n.checked_mul(per_pixel)) == Some(values) {
        return Ok(());
    }
    let kind = ParameterErrorKind::DimensionMismatch;
    Err(ImageError::Parameter(ParameterError::from_kind(kind)))
}

/// An OpenEXR file of linear light, 16-bit floats compressed without loss (ZIP), rows from the top. Light above the
/// largest of these floats, 65504, has that value.
///
/// # Errors
/// The values do not match the size.
pub fn open_exr(radiance: &[[f32; 3]], width: u32, height: u32) -> ImageResult<Vec<u8>> {
    fits(radiance.len(), 1, width, height)?;
    let size = exr::math::Vec2(width as usize, height as usize);
    let half = |value: f32| f16::from_f32(value.clamp(0.0, f16::MAX.to_f32()));
    let channels = SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
        let [r, g, b] = radiance[at.1 * size.0 + at.0].map(half);
        (r, g, b)
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_encoded_channels(size, Encoding::SMALL_LOSSLESS, channels)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| {
            let format = ImageFormatHint::Name("OpenEXR".to_owned());
            ImageError::Encoding(EncodingError::new(format, error))
        })?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers};

    #[test]
    fn files_hold_what_was_written() {
        let rgb = [1, 2, 3, 250, 251, 252];
        let read = image::load_from_memory(&png(&rgb, 2, 1).unwrap()).unwrap();
        assert_eq!(read.to_rgb8().into_raw(), rgb);
        let read = image::load_from_memory(&jpeg(&[128; 192], 8, 8, 90).unwrap()).unwrap();
        assert!(
            read.to_rgb8()
                .into_raw()
                .iter()
                .all(|v| v.abs_diff(128) <= 1)
        );
        // exact as 16-bit floats, but for the last one, which is too large
        let light = [[0.5, 1.0, 100.0], [0.0, 0.125, 1e9]];
        let file = std::io::Cursor::new(open_exr(&light, 2, 1).unwrap());
        let read = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |_, _| vec![[0.0; 3]; 2],
                |read, at, (r, g, b): (f32, f32, f32)| read[at.0] = [r, g, b],
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(file)
            .unwrap();
        let read = read.layer_data.channel_data.pixels;
        assert_eq!(read, [[0.5, 1.0, 100.0], [0.0, 0.125, 65504.0]]);
        assert!(open_exr(&light, 3, 1).is_err());
        assert!(png(&rgb, 3, 1).is_err() && jpeg(&rgb, 1, 1, 90).is_err());
    }
}
