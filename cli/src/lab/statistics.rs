//! Statistics of pictures for `relight-lab measure`.

use glam::Vec3;
use relight::compare::Rgb8;
use relight::overbright;

/// Displayed luminance of each pixel, linear, 0 to 1.
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

/// Mean of the values selected by `part`; 0 for none.
pub fn marked_mean(values: &[f32], part: &[bool]) -> f32 {
    let marked = || values.iter().zip(part).filter(|(_, m)| **m);
    let sum: f64 = marked().map(|(v, _)| f64::from(*v)).sum();
    (sum / marked().count().max(1) as f64) as f32
}

/// Mean of pictures of one size.
pub fn mean_of(pictures: &[Vec<f32>]) -> Vec<f32> {
    let mut mean = vec![0.0; pictures.first().map_or(0, Vec::len)];
    for picture in pictures {
        for (mean, value) in mean.iter_mut().zip(picture) {
            *mean += value / pictures.len() as f32;
        }
    }
    mean
}

/// Temporal noise: median over the selected pixels of standard deviation over mean in time.
pub fn temporal_noise(frames: &[Vec<f32>], part: &[bool]) -> f32 {
    let count = frames.len() as f32;
    let pixels = frames.first().map_or(0, Vec::len);
    let mut ratios: Vec<f32> = (0..pixels)
        .filter(|pixel| part.get(*pixel).copied().unwrap_or(false))
        .filter_map(|pixel| {
            let values = || frames.iter().filter_map(|f| f.get(pixel));
            let mean = values().sum::<f32>() / count;
            let variance = values().map(|v| (v - mean) * (v - mean)).sum::<f32>() / count;
            // no ratio for black pixels, whose noise is invisible
            (mean > 1.0e-3).then(|| variance.sqrt() / mean)
        })
        .collect();
    ratios.sort_by(f32::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or(0.0)
}

/// Mean absolute error of `picture` over the mean of `truth`, for the selected pixels.
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

/// Mean signed error of `picture` over the mean of `truth`, for the selected pixels.
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
        // pixels: constant, between 1 and 3 (deviation 1, mean 2), black
        let frames = [vec![1.0, 1.0, 0.0], vec![1.0, 3.0, 0.0]];
        assert!((temporal_noise(&frames, &[true; 3]) - 0.5).abs() < 1.0e-6);
        assert_eq!(temporal_noise(&frames, &[true, false, true]), 0.0);
        assert_eq!(temporal_noise(&[], &[]), 0.0);
        assert!((marked_mean(&[1.0, 5.0, 2.0], &[true, false, true]) - 1.5).abs() < 1.0e-6);
        assert_eq!(marked_mean(&[1.0], &[false]), 0.0);
        assert_eq!(mean_of(&frames), [1.0, 2.0, 0.0]);
        assert!(mean_of(&[]).is_empty());
    }

    #[test]
    fn errors_are_taken_over_the_marked_pixels() {
        let (picture, truth, part) = ([1.5, 0.5, 9.0], [1.0, 1.0, 1.0], [true, true, false]);
        assert!((relative_error(&picture, &truth, &part) - 0.5).abs() < 1.0e-6);
        assert!(relative_bias(&picture, &truth, &part).abs() < 1.0e-6);
        assert_eq!(relative_error(&picture, &truth, &[false; 3]), 0.0);
    }
}
