//! Stereo: which channels of the picture each eye draws, and where its pictures meet.
//!
//! Source: engine behaviour of `renderer_opengl1` (anaglyph modes, stereo projection).

use crate::gpu::ColorMask;
use crate::settings::Settings;

/// Whose picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Eye {
    /// One picture for both.
    #[default]
    Both,
    /// The left one's, the first of a frame.
    Left,
    /// The right one's.
    Right,
}

impl Eye {
    /// The channels that it draws by `r_anaglyphMode`: 1 red and cyan, 2 red and blue, 3 red and green, 4 green and
    /// magenta; 5 to 8 the same with the eyes swapped.
    pub fn mask(self, anaglyph: u32) -> ColorMask {
        let (mode, swapped) = match anaglyph {
            1..=4 => (anaglyph, false),
            5..=8 => (anaglyph - 4, true),
            _ => return ColorMask::ALL,
        };
        let left = match self {
            Self::Both => return ColorMask::ALL,
            Self::Left => !swapped,
            Self::Right => swapped,
        };
        let [red, green, blue] = match (mode, left) {
            (1..=3, true) => [true, false, false],
            (4, true) | (3, false) => [false, true, false],
            (1, false) => [false, true, true],
            (2, false) => [false, false, true],
            _ => [true, false, true],
        };
        ColorMask {
            red,
            green,
            blue,
            alpha: true,
        }
    }

    /// How it sees.
    pub fn stereo(self, settings: &Settings) -> Stereo {
        let (distance, ratio) = (settings.convergence, settings.stereo_separation);
        let side = match self {
            Self::Both => 0.0,
            Self::Left => 1.0,
            Self::Right => -1.0,
        };
        if side == 0.0 || ratio == 0.0 || !(distance / ratio).is_finite() || distance == 0.0 {
            return Stereo::default();
        }
        Stereo {
            slope: side / ratio,
            distance,
        }
    }
}

/// The place of an eye beside the middle: both eyes' pictures meet at a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stereo {
    /// Distance of the eye from the middle to the left, over that at which the pictures meet; 0 for a single picture.
    pub slope: f32,
    /// Distance at which the pictures meet, units.
    pub distance: f32,
}

impl Stereo {
    /// Distance of the eye from the middle to the left, units.
    pub fn offset(&self) -> f32 {
        self.slope * self.distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eyes_share_the_channels() {
        for mode in 1..=8 {
            let [left, right] = [Eye::Left, Eye::Right].map(|eye| eye.mask(mode));
            let shared = [
                left.red && right.red,
                left.green && right.green,
                left.blue && right.blue,
            ];
            assert_eq!(shared, [false; 3]);
            assert_eq!(left.red, mode < 4 || mode == 8);
            assert_eq!(Eye::Both.mask(mode), ColorMask::ALL);
        }
        assert_eq!(Eye::Left.mask(0), ColorMask::ALL);
        assert!(Eye::Right.mask(1).green && Eye::Right.mask(1).blue);
        assert!(!Eye::Right.mask(2).green && Eye::Right.mask(3).green);
        assert!(Eye::Left.mask(5).green && Eye::Right.mask(5).red);
    }

    #[test]
    fn eyes_are_a_ratio_of_the_convergence_apart() {
        let settings = Settings::default();
        assert_eq!(Eye::Left.stereo(&settings).offset(), 1.0);
        assert_eq!(Eye::Right.stereo(&settings).offset(), -1.0);
        assert_eq!(Eye::Both.stereo(&settings), Stereo::default());
        let none = Settings {
            stereo_separation: 0.0,
            ..settings
        };
        assert_eq!(Eye::Left.stereo(&none), Stereo::default());
    }
}
