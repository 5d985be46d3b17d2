//! Pictures as files: PNG for the display, OpenEXR for linear light.

use image::error::{ParameterError, ParameterErrorKind};
use image::{ExtendedColorType, ImageEncoder, ImageError, ImageResult};

use crate::api::Picture;

/// A PNG.
///
/// # Errors
/// The bytes do not match the size.
pub fn png(picture: &Picture) -> ImageResult<Vec<u8>> {
    fits(picture.rgb.len(), 3, picture.width, picture.height)?;
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes).write_image(
        &picture.rgb,
        picture.width,
        picture.height,
        ExtendedColorType::Rgb8,
    )?;
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
    image::codecs::openexr::OpenExrEncoder::new(&mut bytes).write_image(
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
        let picture = Picture {
            width: 2,
            height: 1,
            rgb: vec![1, 2, 3, 250, 251, 252],
        };
        let read = image::load_from_memory(&png(&picture).unwrap()).unwrap();
        assert_eq!(read.to_rgb8().into_raw(), picture.rgb);
        let light = [[0.5, 1.0, 100.0], [0.0, 1e-4, 2.0]];
        let read = image::load_from_memory(&open_exr(&light, 2, 1).unwrap()).unwrap();
        let read = read.to_rgb32f().into_raw();
        assert_eq!(read, light.concat());
        assert!(open_exr(&light, 3, 1).is_err());
        assert!(
            png(&Picture {
                width: 3,
                ..picture
            })
            .is_err()
        );
    }
}
