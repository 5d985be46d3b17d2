//! Hysteresis between two states by the number of rays.

/// Frames with few rays after which something rests.
pub const QUIET_FRAMES: u32 = 8;

/// Rays of a frame below which something is quiet, over the pixels of the picture: 4 at 1920 × 1080.
const QUIET_RAYS: f32 = 2.0e-6;

/// Ratio of both thresholds.
const RATIO: f32 = 10.0;

/// Numbers of rays that change a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thresholds {
    /// What rests becomes active with more rays in a frame.
    pub active: f32,
    /// What is active rests after [`QUIET_FRAMES`] frames with fewer rays each.
    pub quiet: f32,
}

impl Thresholds {
    /// For a picture of so many pixels.
    pub fn of_pixels(pixels: u32) -> Self {
        #[allow(clippy::cast_precision_loss)] // a threshold
        let quiet = pixels as f32 * QUIET_RAYS;
        Self {
            active: quiet * RATIO,
            quiet,
        }
    }
}

/// The state of a body or of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Activity {
    /// Whether it is active.
    active: bool,
    /// Quiet frames in a row.
    quiet: u32,
}

impl Default for Activity {
    fn default() -> Self {
        Self::ACTIVE
    }
}

impl Activity {
    /// Active, with all quiet frames ahead.
    pub const ACTIVE: Self = Self {
        active: true,
        quiet: 0,
    };

    /// Whether it is active.
    pub fn is_active(self) -> bool {
        self.active
    }

    /// Takes the rays of a frame.
    pub fn observe(&mut self, rays: f32, thresholds: Thresholds) {
        if !self.active {
            if rays > thresholds.active {
                *self = Self::ACTIVE;
            }
            return;
        }
        self.quiet = if rays < thresholds.quiet {
            self.quiet + 1
        } else {
            0
        };
        self.active = self.quiet < QUIET_FRAMES;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::Random;

    #[test]
    fn thresholds_differ_by_ten() {
        let full = Thresholds::of_pixels(1920 * 1080);
        assert!((full.quiet - 4.147).abs() < 0.01, "{full:?}");
        assert!((full.active / full.quiet - 10.0).abs() < 1.0e-5);
    }

    /// The definition, from the whole history: the rays of each frame since the last time that the state was set.
    fn expected(history: &[f32], t: Thresholds) -> bool {
        let mut active = true;
        let mut since = 0;
        for (i, &rays) in history.iter().enumerate() {
            let last = QUIET_FRAMES as usize;
            if !active {
                active = rays > t.active;
                since = i + 1;
            } else if i + 1 - since >= last
                && history[i + 1 - last..=i].iter().all(|rays| *rays < t.quiet)
            {
                active = false;
            }
        }
        active
    }

    #[test]
    fn states_follow_their_definition() {
        let t = Thresholds {
            active: 20.0,
            quiet: 2.0,
        };
        let mut random = Random::new(7);
        let (mut changes, mut frames) = (0, 0);
        for _ in 0..300 {
            let mut activity = Activity::default();
            let mut history = Vec::new();
            // runs of frames with few, some or many rays
            while history.len() < 120 {
                let level = [0.0, 1.0, 2.0, 10.0, 20.0, 21.0][random.below(6)];
                for _ in 0..=random.below(12) {
                    history.push(level);
                    let before = activity.is_active();
                    activity.observe(level, t);
                    assert_eq!(activity.is_active(), expected(&history, t), "{history:?}");
                    changes += usize::from(activity.is_active() != before);
                    // between the thresholds nothing changes
                    assert!(!(2.0..=20.0).contains(&level) || activity.is_active() == before);
                    frames += 1;
                }
            }
        }
        assert!(
            changes > 500 && changes < frames / 10,
            "{changes} of {frames}"
        );
    }
}
