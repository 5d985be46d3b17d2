//! Stereo: which channels of the picture each eye draws, and where its pictures meet.
//!
//! Source: engine behaviour of `renderer_opengl1` (anaglyph modes, stereo projection).

use crate::gpu::ColorMask;
use crate::settings::{Anaglyph, Settings};

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
    /// The channels that it draws.
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
