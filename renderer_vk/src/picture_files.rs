//! Pictures as files: PNG and JPEG for the display, OpenEXR for linear light.

use image::codecs::jpeg::JpegEncoder;
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::png::PngEncoder;
use image::error::{ParameterError, ParameterErrorKind};
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

/// An OpenEXR file of linear light, 32-bit floats, rows from the top.
///
/// # Errors
/// The values do not match the size.
pub fn open_exr(radiance: &[[f32; 3]], width: u32, height: u32) -> ImageResult<Vec<u8>> {
    fits(radiance.len(), 1, width, height)?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let values: &[u8] = bytemuck::cast_slice(radiance);
    OpenExrEncoder::new(&mut bytes).write_image(
        values,
        width,
        height,
        ExtendedColorType::Rgb32F,
    )?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let light = [[0.5, 1.0, 100.0], [0.0, 1e-4, 2.0]];
        let read = image::load_from_memory(&open_exr(&light, 2, 1).unwrap()).unwrap();
        let read = read.to_rgb32f().into_raw();
        assert_eq!(read, light.concat());
        assert!(open_exr(&light, 3, 1).is_err());
        assert!(png(&rgb, 3, 1).is_err() && jpeg(&rgb, 1, 1, 90).is_err());
    }
}
