//! Pictures of the screen as files: screenshots, level shots, and frames of a recorded video.
//!
//! The input pixels are those that the screen shows, after gamma, with rows from the top. File names and formats follow
//! the engine's own renderer.

use crate::failure::Failure;
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use renderer_vk::api::Picture;

/// Rows of a video frame are padded to a multiple of this.
const AVI_LINE_PADDING: usize = 4;

/// File format of a screenshot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Uncompressed, 24 bits.
    Tga,
    /// Compressed; `r_screenshotJpegQuality`.
    Jpeg,
}

impl Format {
    /// File name extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Tga => "tga",
            Format::Jpeg => "jpg",
        }
    }
}

/// A requested picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Shot {
    /// The whole screen.
    Screen {
        /// File format.
        format: Format,
        /// Path in the user's game folder.
        path: String,
        /// Prints no message.
        silent: bool,
    },
    /// 128x128 pixels for the map menu.
    Level {
        /// Path in the user's game folder.
        path: String,
    },
}

/// A requested video frame. The buffers are the engine's.
#[derive(Clone, Copy, Debug)]
pub struct VideoFrame {
    /// Pixels of the video.
    pub width: u32,
    /// Pixels of the video.
    pub height: u32,
    /// Destination of the encoded frame, at least `width * height * 4` bytes.
    pub encode_buffer: *mut u8,
    /// JPEG instead of raw rows.
    pub motion_jpeg: bool,
}

/// The picture of `rt_screenshot` in progress.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StillShot {
    /// Path in the user's game folder.
    pub path: String,
    /// Tenths of the work that have been reported.
    shown: u32,
}

impl StillShot {
    /// A picture without progress.
    pub fn new(path: String) -> Self {
        Self { path, shown: 0 }
    }

    /// A progress message for each tenth of the work.
    pub fn progress(&mut self, done: u32, wanted: u32) -> Option<String> {
        let tenths = u64::from(done) * 10 / u64::from(wanted.max(1));
        let tenths = u32::try_from(tenths).unwrap_or(10);
        if tenths <= self.shown || tenths >= 10 {
            return None;
        }
        self.shown = tenths;
        Some(format!("rt_screenshot: {done} of {wanted} samples"))
    }
}

/// Arguments of `rt_screenshot`: samples per pixel, and optionally the size. `None`: invalid arguments.
pub fn still_arguments(arguments: &[String]) -> Option<(u32, Option<(u32, u32)>)> {
    let size = |text: &String| {
        let (width, height) = text.split_once(['x', 'X'])?;
        Some((width.parse().ok()?, height.parse().ok()?))
    };
    let samples = |text: &String| text.parse().ok().filter(|samples| *samples > 0);
    match arguments {
        [spp] => Some((samples(spp)?, None)),
        [spp, text] => Some((samples(spp)?, Some(size(text)?))),
        _ => None,
    }
}

/// Requested captures, and the file numbers in use.
#[derive(Debug, Default)]
pub struct Captures {
    /// In the order of the requests.
    pub shots: Vec<Shot>,
    /// At most one per frame.
    pub video: Option<VideoFrame>,
    /// `rt_screenshot`.
    pub still: Option<StillShot>,
    next_number: [u32; 2],
    /// Number of the next picture of `rt_photo`.
    pub next_photo: u32,
}

/// Number of file numbers: file names have four digits.
const NUMBERS: u32 = 10_000;

impl Captures {
    /// Drops the requests; keeps the numbers.
    pub fn clear(&mut self) {
        self.shots.clear();
        self.video = None;
        self.still = None;
    }

    /// The next unused `screenshots/shotNNNN` name; `None` if all are in use.
    pub fn next_path(&mut self, format: Format, exists: impl Fn(&str) -> bool) -> Option<String> {
        let next = &mut self.next_number[format as usize];
        free_path("screenshots/shot", format.extension(), next, exists)
    }
}

/// The next unused name `STEMnnnn.EXTENSION`, from the number `next` on; `None` if all are in use.
pub fn free_path(
    stem: &str,
    extension: &str,
    next: &mut u32,
    exists: impl Fn(&str) -> bool,
) -> Option<String> {
    while *next < NUMBERS {
        let path = format!("{stem}{:04}.{extension}", *next);
        *next += 1;
        if !exists(&path) {
            return Some(path);
        }
    }
    None
}

/// Pixels of a picture's row; shorter if the data is.
fn row(picture: &Picture, y: u32) -> &[u8] {
    let length = picture.width as usize * 3;
    let start = y as usize * length;
    picture.rgb.get(start..start + length).unwrap_or(&[])
}

/// A 24-bit uncompressed TGA file, rows from the bottom.
///
/// # Errors
/// The picture exceeds the format's limit of 65535 pixels a side.
pub fn tga(picture: &Picture) -> Result<Vec<u8>, Failure> {
    let side = |n: u32| {
        u16::try_from(n).map_err(|_| {
            Failure::drop(format!(
                "a TGA file cannot be {}x{} pixels",
                picture.width, picture.height
            ))
        })
    };
    let (width, height) = (side(picture.width)?, side(picture.height)?);
    let mut file = vec![0u8; 12];
    file[2] = 2; // true colour, uncompressed
    file.extend(width.to_le_bytes());
    file.extend(height.to_le_bytes());
    file.extend([24, 0]);
    file.reserve(picture.rgb.len());
    for y in (0..picture.height).rev() {
        for pixel in row(picture, y).chunks_exact(3) {
            file.extend(pixel.iter().rev());
        }
    }
    Ok(file)
}

/// Minimum quality with full chroma resolution; below it, chroma has one sample for four pixels, as in the engine's own
/// renderer.
const FULL_CHROMA_QUALITY: u8 = 85;

/// A JPEG file; the quality is clamped to 1..=100.
///
/// # Errors
/// The picture exceeds the format's limit of 65535 pixels a side.
pub fn jpeg(picture: &Picture, quality: i32) -> Result<Vec<u8>, Failure> {
    let failed = |reason: String| {
        Failure::drop(format!(
            "cannot write a JPEG of {}x{} pixels: {reason}",
            picture.width, picture.height
        ))
    };
    let side = |n: u32| u16::try_from(n).map_err(|_| failed("it is too large".into()));
    let (width, height) = (side(picture.width)?, side(picture.height)?);
    let mut file = Vec::new();
    let quality = u8::try_from(quality.clamp(1, 100)).unwrap_or(100);
    let mut encoder = Encoder::new(&mut file, quality);
    encoder.set_sampling_factor(if quality >= FULL_CHROMA_QUALITY {
        SamplingFactor::F_1_1
    } else {
        SamplingFactor::F_2_2
    });
    encoder
        .encode(&picture.rgb, width, height, ColorType::Rgb)
        .map_err(|e| failed(e.to_string()))?;
    Ok(file)
}

/// The picture of a map menu: 128x128 pixels, each the mean of 4x3 samples, for any screen size.
pub fn level_shot(picture: &Picture) -> Picture {
    const SIDE: u32 = 128;
    let mut rgb = Vec::with_capacity((SIDE * SIDE * 3) as usize);
    // Samples are on a grid of 512x384 over the whole screen, from its lower left corner.
    let source = |length: u32, index: u32, samples: u32| {
        (u64::from(length) * u64::from(index) / u64::from(samples)) as u32
    };
    for y in 0..SIDE {
        let y = SIDE - 1 - y;
        for x in 0..SIDE {
            let mut sum = [0u32; 3];
            for sample_y in 0..3 {
                let up = source(picture.height, y * 3 + sample_y, SIDE * 3);
                let line = row(picture, picture.height.saturating_sub(up + 1));
                for sample_x in 0..4 {
                    let at = source(picture.width, x * 4 + sample_x, SIDE * 4) as usize * 3;
                    for (total, &value) in sum.iter_mut().zip(line.get(at..at + 3).unwrap_or(&[])) {
                        *total += u32::from(value);
                    }
                }
            }
            rgb.extend(sum.map(|total| (total / 12) as u8));
        }
    }
    Picture {
        width: SIDE,
        height: SIDE,
        rgb,
    }
}

/// The picture at the size of the video: its lower left part, black outside.
fn fit(picture: &Picture, width: u32, height: u32) -> Picture {
    if (picture.width, picture.height) == (width, height) {
        return picture.clone();
    }
    let mut rgb = Vec::with_capacity(width as usize * height as usize * 3);
    for y in 0..height {
        // Counted from the bottom, where both pictures start.
        let from_bottom = height - 1 - y;
        let line = if from_bottom < picture.height {
            row(picture, picture.height - 1 - from_bottom)
        } else {
            &[]
        };
        let wanted = width as usize * 3;
        let line = line.get(..wanted.min(line.len())).unwrap_or(&[]);
        rgb.extend_from_slice(line);
        rgb.resize(rgb.len() + wanted - line.len(), 0);
    }
    Picture { width, height, rgb }
}

/// The bytes of a video frame: JPEG, or rows from the bottom in blue, green, red, padded to four bytes.
///
/// # Errors
/// The frame exceeds the engine's buffer of `width * height * 4` bytes even at the lowest quality.
pub fn video_frame(
    picture: &Picture,
    frame: &VideoFrame,
    quality: i32,
) -> Result<Vec<u8>, Failure> {
    let picture = fit(picture, frame.width, frame.height);
    if !frame.motion_jpeg {
        let stride = (frame.width as usize * 3).next_multiple_of(AVI_LINE_PADDING);
        let mut bytes = Vec::with_capacity(stride * frame.height as usize);
        for y in (0..frame.height).rev() {
            let start = bytes.len();
            for pixel in row(&picture, y).chunks_exact(3) {
                bytes.extend(pixel.iter().rev());
            }
            bytes.resize(start + stride, 0);
        }
        return Ok(bytes);
    }
    let room = frame.width as usize * frame.height as usize * 4;
    // Only pictures of a few pixels need a second attempt.
    for quality in [quality, 50, 1] {
        let bytes = jpeg(&picture, quality)?;
        if bytes.len() <= room {
            return Ok(bytes);
        }
    }
    Err(Failure::drop(format!(
        "a video frame of {}x{} pixels does not fit into the engine's buffer",
        frame.width, frame.height
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn gradient(width: u32, height: u32) -> Picture {
        let rgb = (0..height)
            .flat_map(|y| {
                (0..width).flat_map(move |x| [(x * 7) as u8, (y * 5) as u8, (x + y) as u8])
            })
            .collect();
        Picture { width, height, rgb }
    }

    #[test]
    fn tga_is_read_back_by_its_own_rules() {
        let picture = gradient(5, 3);
        let file = tga(&picture).unwrap();
        assert_eq!(file.len(), 18 + 5 * 3 * 3);
        assert_eq!(
            file[..18],
            [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0, 3, 0, 24, 0]
        );
        // First in the file: lower left, blue first.
        assert_eq!(file[18..21], [2, 10, 0]);
        // Last: upper right.
        assert_eq!(file[18 + 42..], [4, 0, 28]);
    }

    #[test]
    fn jpeg_decodes_to_nearly_the_same() {
        let picture = gradient(32, 24);
        let file = jpeg(&picture, 95).unwrap();
        let decoded = image::load_from_memory(&file).unwrap().to_rgb8();
        assert_eq!(decoded.dimensions(), (32, 24));
        let error: u32 = decoded
            .as_raw()
            .iter()
            .zip(&picture.rgb)
            .map(|(a, b)| u32::from(a.abs_diff(*b)))
            .sum();
        assert!(error / (32 * 24 * 3) < 6, "mean error {error}");
        assert!(jpeg(&picture, -5).is_ok());
        // The frame header's sampling factors.
        let factors = |file: &[u8]| {
            let frame = file.windows(2).position(|w| w == [0xFF, 0xC0]).unwrap();
            [0, 1, 2].map(|component| file[frame + 11 + component * 3])
        };
        assert_eq!(factors(&file), [0x11; 3]);
        assert_eq!(factors(&jpeg(&picture, 85).unwrap()), [0x11; 3]);
        assert_eq!(factors(&jpeg(&picture, 84).unwrap()), [0x22, 0x11, 0x11]);
    }

    #[test]
    fn level_shot_averages_the_grid() {
        let mut picture = Picture {
            width: 512,
            height: 384,
            rgb: vec![0; 512 * 384 * 3],
        };
        // One sample of the twelve of pixel (0, 0) is white.
        picture.rgb[..3].fill(240);
        let small = level_shot(&picture);
        assert_eq!(
            (small.width, small.height, small.rgb.len()),
            (128, 128, 128 * 128 * 3)
        );
        assert_eq!(small.rgb[..6], [20, 20, 20, 0, 0, 0]);
        // 384 samples of 480 rows, counted from the bottom, leave the top row out.
        let mut tall = Picture {
            width: 512,
            height: 480,
            rgb: vec![0; 512 * 480 * 3],
        };
        tall.rgb[..512 * 3].fill(240);
        assert_eq!(level_shot(&tall).rgb[..3], [0, 0, 0]);
        let tiny = level_shot(&gradient(3, 2));
        assert_eq!(tiny.rgb.len(), 128 * 128 * 3);
    }

    #[test]
    fn raw_video_rows_are_padded_and_upside_down() {
        let picture = gradient(3, 2);
        let frame = VideoFrame {
            width: 3,
            height: 2,
            encode_buffer: std::ptr::null_mut(),
            motion_jpeg: false,
        };
        let bytes = video_frame(&picture, &frame, 90).unwrap();
        assert_eq!(bytes.len(), 2 * 12);
        assert_eq!(bytes[..3], [1, 5, 0]);
        assert_eq!(bytes[9..12], [0, 0, 0]);
        assert_eq!(bytes[12..15], [0, 0, 0]);
        assert_eq!(bytes[15..18], [1, 0, 7]);
    }

    #[test]
    fn a_video_of_another_size_keeps_the_lower_left_corner() {
        let picture = gradient(4, 4);
        let fitted = fit(&picture, 2, 5);
        assert_eq!(fitted.rgb.len(), 2 * 5 * 3);
        assert_eq!(fitted.rgb[..6], [0; 6]);
        assert_eq!(fitted.rgb[6..12], picture.rgb[..6]);
        assert_eq!(fitted.rgb[24..30], picture.rgb[36..42]);
    }

    #[test]
    fn a_frame_too_small_for_a_jpeg_header_is_an_error() {
        let frame = VideoFrame {
            width: 2,
            height: 2,
            encode_buffer: std::ptr::null_mut(),
            motion_jpeg: true,
        };
        assert!(video_frame(&gradient(2, 2), &frame, 90).is_err());
        let frame = VideoFrame {
            width: 64,
            height: 64,
            ..frame
        };
        assert!(video_frame(&gradient(64, 64), &frame, 90).unwrap().len() <= 64 * 64 * 4);
    }

    #[test]
    fn still_arguments_are_parsed_and_progress_is_in_tenths() {
        let of = |arguments: &[&str]| {
            let arguments: Vec<String> = arguments.iter().map(|a| (*a).to_owned()).collect();
            still_arguments(&arguments)
        };
        assert_eq!(of(&["64"]), Some((64, None)));
        assert_eq!(of(&["64", "3840x2160"]), Some((64, Some((3840, 2160)))));
        for bad in [
            &[][..],
            &["0"],
            &["many"],
            &["1", "2"],
            &["1", "2x"],
            &["1", "2x3", "4"],
        ] {
            assert_eq!(of(bad), None, "{bad:?}");
        }
        let mut shot = StillShot::new("a.tga".into());
        let shown: Vec<u32> = (1..=25)
            .filter(|i| shot.progress(*i, 25).is_some())
            .collect();
        assert_eq!(shown, [3, 5, 8, 10, 13, 15, 18, 20, 23]);
    }

    #[test]
    fn numbers_skip_what_exists_and_end() {
        let taken: HashSet<_> = ["screenshots/shot0000.tga", "screenshots/shot0002.tga"].into();
        let mut captures = Captures::default();
        let mut next = |format| captures.next_path(format, |path| taken.contains(path));
        assert_eq!(
            next(Format::Tga).as_deref(),
            Some("screenshots/shot0001.tga")
        );
        assert_eq!(
            next(Format::Tga).as_deref(),
            Some("screenshots/shot0003.tga")
        );
        assert_eq!(
            next(Format::Jpeg).as_deref(),
            Some("screenshots/shot0000.jpg")
        );
        assert_eq!(Captures::default().next_path(Format::Tga, |_| true), None);
    }
}
