//! `relight render --devices`: several devices draw each picture together. Each accumulates a range of the picture's
//! frames, whose random numbers continue those of the range before; the means are averaged by their numbers of frames.

use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::Scope;

use anyhow::{Context, Result, ensure};
use renderer_vk::{Renderer, Settings};

use crate::surfaces::Texel;

/// The frames of a picture of so many that device `index` of `count` draws.
pub fn part(frames: usize, index: usize, count: usize) -> Range<usize> {
    let start = |index: usize| frames * index / count.max(1);
    start(index)..start(index + 1)
}

/// The settings of a device that draws this range of a picture's frames.
pub fn of_part(settings: &Settings, part: &Range<usize>) -> Settings {
    Settings {
        rt_first_frame: u32::try_from(part.start).unwrap_or(u32::MAX),
        ..settings.clone()
    }
}

/// The mean of a part of a picture's frames, and their number.
pub struct PartMean {
    /// Linear, before exposure.
    pub mean: Vec<Texel>,
    /// Number of frames.
    pub frames: usize,
}

/// All devices but the first. Each has a thread, which draws its part of each picture.
pub struct Others {
    means: Vec<Receiver<Result<PartMean>>>,
}

impl Others {
    /// Starts a thread for each device. `draw` draws the parts of all pictures on a device, and sends each mean; it gets
    /// the name and index of its device.
    pub fn start<'scope, 'env, F>(
        scope: &'scope Scope<'scope, 'env>,
        devices: &'env [String],
        draw: &'env F,
    ) -> Self
    where
        F: Fn(&str, usize, &SyncSender<Result<PartMean>>) -> Result<()> + Sync,
    {
        let start = |(index, name): (usize, &'env String)| {
            // a device does not draw ahead by more than a picture
            let (sender, receiver) = sync_channel(1);
            scope.spawn(move || {
                if let Err(error) = draw(name, index, &sender) {
                    // the other end is gone where the first device has failed
                    let _ = sender.send(Err(error.context(format!("device {name}"))));
                }
            });
            receiver
        };
        Self {
            means: devices.iter().enumerate().skip(1).map(start).collect(),
        }
    }

    /// Waits for the end of the threads.
    ///
    /// # Errors
    /// A device failed after it had drawn its parts.
    pub fn end(self) -> Result<()> {
        let mut left = self.means.into_iter().flatten();
        left.try_for_each(|part| part.map(drop))
    }

    /// Waits for the other parts of a picture, and lets the first device show the mean of all. `frames`: of the first
    /// device's part.
    ///
    /// # Errors
    /// A device failed.
    pub fn join(&self, renderer: &mut Renderer, frames: usize) -> Result<()> {
        if self.means.is_empty() {
            return Ok(());
        }
        let mut parts = vec![PartMean {
            mean: renderer.read_radiance()?,
            frames,
        }];
        for receiver in &self.means {
            let part = receiver.recv().context("a device stopped")??;
            parts.push(part);
        }
        let mean = mean(&parts)?;
        ensure!(
            renderer.replace_radiance(&mean)?,
            "there is no mean picture to share"
        );
        Ok(())
    }
}

/// The mean of all frames of these parts.
fn mean(parts: &[PartMean]) -> Result<Vec<Texel>> {
    let frames: usize = parts.iter().map(|part| part.frames).sum();
    let length = parts.first().map_or(0, |part| part.mean.len());
    let mut sum = vec![[0.0f64; 3]; length];
    for part in parts.iter().filter(|part| part.frames > 0) {
        ensure!(
            part.mean.len() == length,
            "devices drew pictures of different sizes"
        );
        let weight = part.frames as f64 / frames as f64;
        for (sum, texel) in sum.iter_mut().zip(&part.mean) {
            for (sum, value) in sum.iter_mut().zip(texel) {
                *sum += weight * f64::from(*value);
            }
        }
    }
    Ok(sum.into_iter().map(|t| t.map(|v| v as f32)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_the_frames_once() {
        for (frames, count) in [(64, 1), (64, 2), (7, 3), (2, 3), (1, 4)] {
            let parts: Vec<_> = (0..count).map(|index| part(frames, index, count)).collect();
            let covered: Vec<usize> = parts.iter().cloned().flatten().collect();
            assert_eq!(covered, (0..frames).collect::<Vec<_>>());
            let lengths = parts.iter().map(ExactSizeIterator::len);
            assert!(lengths.clone().max() <= lengths.min().map(|least| least + 1));
        }
    }

    #[test]
    fn means_weigh_by_their_frames() {
        let part = |value: f32, frames| PartMean {
            mean: vec![[value, 0.0, 2.0 * value]],
            frames,
        };
        let all = mean(&[part(1.0, 1), part(5.0, 3), part(100.0, 0)]).unwrap();
        assert_eq!(all, [[4.0, 0.0, 8.0]]);
        let other_size = PartMean {
            mean: vec![],
            frames: 1,
        };
        assert!(mean(&[part(1.0, 1), other_size]).is_err());
    }
}
