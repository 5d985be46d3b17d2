//! GPU times over the last frames, as a plot.

use std::collections::VecDeque;

use egui::Ui;
use egui_plot::{Legend, Line, Plot, PlotPoints};
use renderer_vk::Costs;

/// Frames that are kept.
const FRAMES: usize = 240;

/// Passes with a line of their own; the rest is summed.
const LINES: usize = 7;

/// GPU times of the last frames by pass.
#[derive(Clone, Debug, Default)]
pub struct CostHistory {
    frames: VecDeque<Vec<(String, f32)>>,
}

/// Sum of GPU times, milliseconds.
pub fn frame_time(timings: &[(String, f32)]) -> f32 {
    timings.iter().map(|(_, ms)| ms).sum::<f32>().max(0.0)
}

impl CostHistory {
    /// Adds a frame: milliseconds by pass. Passes of one name are summed.
    pub fn add(&mut self, timings: &[(String, f32)]) {
        if timings.is_empty() {
            return;
        }
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        let passes = Costs::passes(timings, |_| None);
        let times = passes.into_iter().map(|pass| (pass.name, pass.ms));
        self.frames.push_back(times.collect());
    }

    /// The newest frame.
    pub fn newest(&self) -> &[(String, f32)] {
        self.frames.back().map_or(&[], Vec::as_slice)
    }

    /// Names of all passes with their mean time, the most expensive first.
    pub fn means(&self) -> Vec<(String, f32)> {
        let mut sums: Vec<(String, f32)> = Vec::new();
        for (name, ms) in self.frames.iter().flatten() {
            match sums.iter_mut().find(|(known, _)| known == name) {
                Some((_, sum)) => *sum += ms,
                None => sums.push((name.clone(), *ms)),
            }
        }
        let count = self.frames.len().max(1) as f32;
        sums.iter_mut().for_each(|(_, sum)| *sum /= count);
        sums.sort_by(|a, b| b.1.total_cmp(&a.1));
        sums
    }

    /// Draws the plot, stacked: each line is the sum of its pass and those below it.
    pub fn plot(&self, ui: &mut Ui) {
        let means = self.means();
        let shown: Vec<&str> = means.iter().take(LINES).map(|(name, _)| &**name).collect();
        let plot = Plot::new("GPU times")
            .height(160.0)
            .include_y(0.0)
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .y_axis_label("GPU ms")
            .legend(Legend::default().text_style(egui::TextStyle::Small));
        // frames that compile pipelines take seconds: the axis ends at twice the time of nearly all frames
        let mut times: Vec<f32> = self.frames.iter().map(|f| frame_time(f)).collect();
        times.sort_by(f32::total_cmp);
        let usual = times.get(times.len() * 9 / 10).copied().unwrap_or(0.0);
        let high = f64::from(usual.max(0.01)) * 2.0;
        plot.show(ui, |plot| {
            plot.set_plot_bounds_y(0.0..=high);
            let of = |frame: &[(String, f32)], wanted: &dyn Fn(&str) -> bool| -> f64 {
                let matching = frame.iter().filter(|(name, _)| wanted(name));
                matching.map(|(_, ms)| f64::from(*ms)).sum()
            };
            let mut sums = vec![0.0; self.frames.len()];
            for place in 0..=shown.len() {
                let name = shown.get(place).copied();
                let wanted = |pass: &str| match name {
                    Some(name) => pass == name,
                    None => !shown.contains(&pass),
                };
                let points: PlotPoints<'_> = (self.frames.iter().zip(&mut sums).enumerate())
                    .map(|(x, (frame, sum))| {
                        *sum += of(frame, &wanted);
                        [x as f64, *sum]
                    })
                    .collect();
                let label = name.map_or("all passes", |name| name.trim_start_matches("trace_"));
                plot.line(Line::new(label, points).fill(0.0).fill_alpha(0.08));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_over_all_frames_and_old_frames_leave() {
        let mut history = CostHistory::default();
        let frame = |a: f32| {
            vec![
                ("a".to_owned(), a),
                ("b".to_owned(), 1.0),
                ("b".to_owned(), 2.0),
            ]
        };
        history.add(&frame(4.0));
        history.add(&frame(8.0));
        history.add(&[]);
        assert_eq!(
            history.means(),
            [("a".to_owned(), 6.0), ("b".to_owned(), 3.0)]
        );
        assert_eq!(frame_time(history.newest()), 11.0);
        for _ in 0..FRAMES {
            history.add(&frame(1.0));
        }
        assert_eq!(history.means()[0], ("b".to_owned(), 3.0));
        assert_eq!(history.frames.len(), FRAMES);
    }
}
