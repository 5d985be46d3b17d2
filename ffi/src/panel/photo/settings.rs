//! The panel of photo mode.

use gui::egui::{self, Button, Context, DragValue, ProgressBar, Slider};

use super::{Action, Kind, Photo};

/// Samples of a pixel to choose from.
const SAMPLES: [u32; 5] = [16, 64, 256, 1024, 4096];

impl Photo {
    pub(super) fn show_panel(
        &mut self,
        context: &Context,
        window: (u32, u32),
        progress: Option<&(f32, String)>,
        actions: &mut Vec<Action>,
    ) {
        egui::Window::new("Photo")
            .collapsible(false)
            .resizable(false)
            .default_pos([24.0, 24.0])
            .show(context, |ui| {
                if let Some((part, text)) = progress {
                    ui.add(ProgressBar::new(*part).text(text));
                    if ui.button("Cancel").clicked() {
                        actions.push(Action::Cancel);
                    }
                    return;
                }
                let lens = &mut self.lens;
                ui.add(
                    Slider::new(&mut lens.fov, 5.0..=120.0)
                        .text("angle")
                        .suffix("°"),
                );
                ui.add(
                    Slider::new(&mut lens.roll, -180.0..=180.0)
                        .text("roll")
                        .suffix("°"),
                );
                ui.add(Slider::new(&mut lens.exposure, -6.0..=6.0).text("exposure, stops"));
                ui.checkbox(&mut lens.blurs, "depth of field")
                    .on_hover_text("click the picture to focus there");
                if lens.blurs {
                    let aperture = Slider::new(&mut lens.aperture, 0.25..=64.0);
                    ui.add(aperture.logarithmic(true).text("aperture, units"));
                    let focus = Slider::new(&mut lens.focus, 8.0..=8192.0);
                    ui.add(focus.logarithmic(true).text("focus, units"));
                }
                ui.separator();
                ui.horizontal(|ui| {
                    for (scale, name) in [(1, "1x"), (2, "2x"), (4, "4x"), (0, "size")] {
                        ui.selectable_value(&mut self.scale, scale, name);
                    }
                    if self.scale == 0 {
                        ui.add(DragValue::new(&mut self.custom[0]).range(1..=16384));
                        ui.add(DragValue::new(&mut self.custom[1]).range(1..=16384));
                    }
                    let (width, height) = self.size(window);
                    ui.weak(format!("{width}x{height}"));
                });
                ui.horizontal(|ui| {
                    ui.label("samples");
                    for samples in SAMPLES {
                        ui.selectable_value(&mut self.samples, samples, samples.to_string());
                    }
                });
                ui.horizontal(|ui| {
                    for (kind, name, help) in [
                        (Kind::Png, "PNG", "a picture as the display shows it"),
                        (Kind::Exr, "OpenEXR", "linear light, for picture editors"),
                        (Kind::Panorama, "360°", "all around, twice as wide as high"),
                    ] {
                        if ui.add(Button::new(name)).on_hover_text(help).clicked() {
                            actions.push(Action::Take(kind));
                        }
                    }
                    if ui.button("reset").clicked() {
                        self.motion.camera = self.first;
                        self.lens = self.first_lens;
                    }
                    if ui.button("close").on_hover_text("Escape").clicked() {
                        actions.push(Action::Close);
                    }
                });
                if let Some(message) = &self.message {
                    ui.label(message);
                }
                ui.weak("W A S D Q E move, drag turns, Tab hides this panel");
            });
    }
}
