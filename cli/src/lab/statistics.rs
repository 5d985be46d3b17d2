//! What `relight-lab measure` takes from pictures.

use glam::Vec3;
use relight::compare::Rgb8;
use relight::overbright;

/// Radiance as displayed of each pixel: luminance of the decoded values, 0 to 1.
pub fn luminance(picture: &Rgb8) -> Vec<f32> {
    let linear = overbright::byte_table();
    let pixels = picture.pixels().chunks_exact(3);
    pixels
        .map(|p| {
            overbright::luminance(Vec3::from_array(
                [0, 1, 2].map(|c| linear[usize::from(p[c])]),
            ))
        })
        .collect()
}

/// Mean of the values that `part` marks; 0 without any.
pub fn marked_mean(values: &[f32], part: &[bool]) -> f32 {
    let marked = || values.iter().zip(part).filter(|(_, m)| **m);
    let sum: f64 = marked().map(|(v, _)| f64::from(*v)).sum();
    (sum / marked().count().max(1) as f64) as f32
}

/// Median over the pixels that `part` marks of standard deviation over mean of their values in time.
pub fn temporal_noise(frames: &[Vec<f32>], part: &[bool]) -> f32 {
    let count = frames.len() as f32;
    let pixels = frames.first().map_or(0, Vec::len);
    let mut ratios: Vec<f32> = (0..pixels)
        .filter(|pixel| part.get(*pixel).copied().unwrap_or(false))
        .filter_map(|pixel| {
            let values = || frames.iter().filter_map(|f| f.get(pixel));
            let mean = values().sum::<f32>() / count;
            let variance = values().map(|v| (v - mean) * (v - mean)).sum::<f32>() / count;
            // black has no noise that could be seen, and no ratio
            (mean > 1.0e-3).then(|| variance.sqrt() / mean)
        })
        .collect();
    ratios.sort_by(f32::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or(0.0)
}

/// Mean error of `picture` relative to the mean of `truth`, over the pixels that `part` marks.
pub fn relative_error(picture: &[f32], truth: &[f32], part: &[bool]) -> f32 {
    let (mut error, mut sum) = (0.0, 0.0);
    for ((value, truth), _) in picture
        .iter()
        .zip(truth)
        .zip(part)
        .filter(|(_, marked)| **marked)
    {
        error += (value - truth).abs();
        sum += truth;
    }
    if sum > 0.0 { error / sum } else { 0.0 }
}

/// Signed: how much too bright the marked pixels are in the mean, relative to the truth's mean.
pub fn relative_bias(picture: &[f32], truth: &[f32], part: &[bool]) -> f32 {
    let marked = || picture.iter().zip(truth).zip(part).filter(|(_, m)| **m);
    let sum: f32 = marked().map(|((_, t), _)| t).sum();
    let difference: f32 = marked().map(|((v, t), _)| v - t).sum();
    if sum > 0.0 { difference / sum } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_the_median_of_deviation_over_mean() {
        // pixels: still, between 1 and 3 (deviation 1, mean 2), black
        let frames = [vec![1.0, 1.0, 0.0], vec![1.0, 3.0, 0.0]];
        assert!((temporal_noise(&frames, &[true; 3]) - 0.5).abs() < 1.0e-6);
        assert_eq!(temporal_noise(&frames, &[true, false, true]), 0.0);
        assert_eq!(temporal_noise(&[], &[]), 0.0);
        assert!((marked_mean(&[1.0, 5.0, 2.0], &[true, false, true]) - 1.5).abs() < 1.0e-6);
        assert_eq!(marked_mean(&[1.0], &[false]), 0.0);
    }

    #[test]
    fn errors_are_taken_over_the_marked_pixels() {
        let (picture, truth, part) = ([1.5, 0.5, 9.0], [1.0, 1.0, 1.0], [true, true, false]);
        assert!((relative_error(&picture, &truth, &part) - 0.5).abs() < 1.0e-6);
        assert!(relative_bias(&picture, &truth, &part).abs() < 1.0e-6);
        assert_eq!(relative_error(&picture, &truth, &[false; 3]), 0.0);
    }
}
