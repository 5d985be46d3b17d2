//! Stereo: colour channels and camera offset of each eye.
//!
//! Source: engine behaviour of `renderer_opengl1` (anaglyph modes, stereo projection).

use crate::gpu::ColorMask;
use crate::settings::{Anaglyph, Settings};

/// Eye that is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Eye {
    /// One picture for both eyes.
    #[default]
    Both,
    /// The left eye, the first of a frame.
    Left,
    /// The right eye.
    Right,
}

impl Eye {
    /// Colour channels of the eye.
    pub fn mask(self, anaglyph: Anaglyph) -> ColorMask {
        const RED: [bool; 3] = [true, false, false];
        const GREEN: [bool; 3] = [false, true, false];
        const BLUE: [bool; 3] = [false, false, true];
        const CYAN: [bool; 3] = [false, true, true];
        const MAGENTA: [bool; 3] = [true, false, true];
        let (left, right) = match anaglyph {
            Anaglyph::None => return ColorMask::ALL,
            Anaglyph::RedCyan => (RED, CYAN),
            Anaglyph::RedBlue => (RED, BLUE),
            Anaglyph::RedGreen => (RED, GREEN),
            Anaglyph::GreenMagenta => (GREEN, MAGENTA),
            Anaglyph::CyanRed => (CYAN, RED),
            Anaglyph::BlueRed => (BLUE, RED),
            Anaglyph::GreenRed => (GREEN, RED),
            Anaglyph::MagentaGreen => (MAGENTA, GREEN),
        };
        let [red, green, blue] = match self {
            Self::Both => return ColorMask::ALL,
            Self::Left => left,
            Self::Right => right,
        };
        ColorMask {
            red,
            green,
            blue,
            alpha: true,
        }
    }

    /// Camera offset of the eye.
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

/// Camera offset of an eye; both eyes' pictures coincide at a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stereo {
    /// Offset to the left divided by that distance; 0 for a single picture.
    pub slope: f32,
    /// Distance at which the pictures coincide, units.
    pub distance: f32,
}

impl Stereo {
    /// Offset to the left, units.
    pub fn offset(&self) -> f32 {
        self.slope * self.distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eyes_share_the_channels() {
        use Anaglyph::*;
        let modes = [
            RedCyan,
            RedBlue,
            RedGreen,
            GreenMagenta,
            CyanRed,
            BlueRed,
            GreenRed,
            MagentaGreen,
        ];
        for mode in modes {
            let [left, right] = [Eye::Left, Eye::Right].map(|eye| eye.mask(mode));
            let shared = [
                left.red && right.red,
                left.green && right.green,
                left.blue && right.blue,
            ];
            assert_eq!(shared, [false; 3]);
            let number = mode as u32;
            assert_eq!(left.red, number < 4 || number == 8);
            assert_eq!(Eye::Both.mask(mode), ColorMask::ALL);
        }
        assert_eq!(Eye::Left.mask(None), ColorMask::ALL);
        assert!(Eye::Right.mask(RedCyan).green && Eye::Right.mask(RedCyan).blue);
        assert!(!Eye::Right.mask(RedBlue).green && Eye::Right.mask(RedGreen).green);
        assert!(Eye::Left.mask(CyanRed).green && Eye::Right.mask(CyanRed).red);
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
