//! Albedo, normal and distance of the surfaces in a picture, decoded from the views of `rt_debug`.

use relight::overbright;

/// Colour or direction of a pixel.
pub type Texel = [f32; 3];

/// Decodes the albedo that `rt_debug 1` shows, linear; black where no surface is lit. The picture of `rt_illumination 0`
/// has the same encoding, and shows the emission of unlit surfaces too.
pub fn albedo() -> impl Fn(&[u8]) -> Texel {
    let linear = overbright::byte_table();
    move |rgb| std::array::from_fn(|k| linear[usize::from(rgb[k])])
}

/// Decodes the normal that `rt_debug 2` shows; zero where it shows black, because no surface is lit there.
pub fn normal(rgb: &[u8]) -> Texel {
    if rgb.iter().all(|v| *v == 0) {
        return [0.0; 3];
    }
    std::array::from_fn(|k| f32::from(rgb[k]) / 127.5 - 1.0)
}

/// Decodes the view distance that `rt_debug 3` shows, units, from 8 to 7950 in steps of 2.8 %; `None` where it shows
/// black, because no surface is lit there or it is farther.
pub fn distance(rgb: &[u8]) -> Option<f32> {
    let shown = f32::from(rgb[0]) / 255.0;
    (shown > 0.0).then(|| (3.0 + 10.0 * (1.0 - shown)).exp2())
}

/// Mean of pictures.
pub struct Mean {
    sum: Vec<Texel>,
    count: u16,
}

impl Mean {
    /// No picture yet; `pixels`: of each.
    pub fn new(pixels: usize) -> Self {
        Self {
            sum: vec![[0.0; 3]; pixels],
            count: 0,
        }
    }

    /// Adds a picture.
    pub fn add(&mut self, picture: impl Iterator<Item = Texel>) {
        for (sum, texel) in self.sum.iter_mut().zip(picture) {
            for (sum, value) in sum.iter_mut().zip(texel) {
                *sum += value;
            }
        }
        self.count += 1;
    }

    /// The mean.
    pub fn texels(self) -> Vec<Texel> {
        let count = f32::from(self.count.max(1));
        let texels = self.sum.into_iter();
        texels.map(|sum| sum.map(|v| v / count)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_decoded() {
        let albedo = albedo();
        assert_eq!(albedo(&[0, 255, 0]), [0.0, 1.0, 0.0]);
        assert!((albedo(&[188; 3])[0] - 0.5).abs() < 0.01);
        assert_eq!(normal(&[0, 0, 0]), [0.0; 3]);
        assert_eq!(normal(&[255, 0, 255]), [1.0, -1.0, 1.0]);
        assert_eq!(distance(&[0; 3]), None);
        assert_eq!(distance(&[255; 3]), Some(8.0));
        let far = distance(&[102; 3]).expect("a surface");
        assert!((far - 512.0).abs() < 1.0e-2, "{far}");
    }

    #[test]
    fn pictures_are_averaged() {
        let mut mean = Mean::new(2);
        mean.add([[1.0, 0.0, 0.0], [2.0; 3]].into_iter());
        mean.add([[0.0, 1.0, 0.0], [4.0; 3]].into_iter());
        assert_eq!(mean.texels(), [[0.5, 0.5, 0.0], [3.0; 3]]);
    }
}
