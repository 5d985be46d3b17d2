//! The panels of the viewer, and the handles over its picture.

use glam::Vec3;
use gui::egui::{self, Color32, Key, RichText, Ui};
use gui::{Change, all_settings, frame_time, main_settings, presets};

use super::lights::{Item, Kind};
use super::picked::{decoded, encoded};
use super::source::Progress;
use super::state::{Shown, Viewer};
use crate::game::USUAL;
use crate::view::map_name;
use relight::viewpoints::Viewpoint;
use std::path::Path;

/// Width of the panel, points.
const PANEL: f32 = 360.0;

impl Viewer {
    /// Lays out a frame of panels; collects changed settings.
    pub(super) fn panels(&mut self, context: &egui::Context, changes: &mut Vec<Change>) {
        self.shortcuts(context);
        egui::TopBottomPanel::bottom("status").show(context, |ui| self.status(ui));
        if self.panel {
            egui::SidePanel::right("panel")
                .default_width(PANEL)
                .show(context, |ui| {
                    egui::ScrollArea::vertical()
                        .auto_shrink([false, false])
                        .show(ui, |ui| self.side(ui, changes));
                });
        }
        egui::CentralPanel::default()
            .frame(egui::Frame::NONE)
            .show(context, |ui| self.picture_area(ui));
    }

    fn shortcuts(&mut self, context: &egui::Context) {
        if context.wants_keyboard_input() {
            return;
        }
        let pressed = |key: Key| context.input(|input| input.key_pressed(key));
        for (key, shown) in [
            (Key::Num1, Shown::Classic),
            (Key::Num2, Shown::Traced),
            (Key::Num3, Shown::Split),
            (Key::Num4, Shown::Reference),
            (Key::Num5, Shown::Hybrid),
        ] {
            if pressed(key) {
                self.shown = shown;
            }
        }
        if pressed(Key::G) {
            self.motion.walks = !self.motion.walks;
        }
        if pressed(Key::H) {
            self.panel = !self.panel;
        }
        if pressed(Key::P) {
            self.copy_view(context);
        }
    }

    /// Copies the command that renders the view.
    fn copy_view(&mut self, context: &egui::Context) {
        let command = self.command();
        context.copy_text(command.clone());
        self.message = Some(format!("copied: {command}"));
    }

    /// The command line that renders the view.
    pub(super) fn command(&self) -> String {
        let Viewpoint {
            origin: o,
            yaw,
            pitch,
        } = self.motion.camera;
        let chosen = &self.source.chosen;
        let mut map = match &chosen.map {
            Some(map) => quoted(map),
            None => "--sample".to_owned(),
        };
        if chosen.map.is_some() && chosen.game.paths != [Path::new(USUAL)] {
            for game in &chosen.game.paths {
                map += &format!(" --game {}", quoted(&game.display().to_string()));
            }
        }
        let look = match self.shown {
            Shown::Classic => "classic",
            Shown::Hybrid => "hybrid",
            Shown::Traced | Shown::Split | Shown::Reference => "traced",
        };
        let (width, height) = self.view().map_or(self.renderer.size(), |def| {
            (def.width.unsigned_abs(), def.height.unsigned_abs())
        });
        format!(
            "relight render {map} --view={:.1},{:.1},{:.1},{yaw:.1},{pitch:.1} --look {look} --size {width}x{height} \
             -o view.png",
            o.x, o.y, o.z
        )
    }

    fn status(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let name = self
                .map
                .as_ref()
                .map_or("loading", |map| map_name(&map.name));
            ui.strong(name);
            let Viewpoint {
                origin: o,
                yaw,
                pitch,
            } = self.motion.camera;
            ui.weak(format!(
                "{:.0} {:.0} {:.0}  {yaw:.0}° {pitch:.0}°",
                o.x, o.y, o.z
            ));
            let gpu = frame_time(self.costs.newest());
            let rate = 1.0 / self.frame_seconds.max(1e-4);
            ui.weak(format!("GPU {gpu:.2} ms, {rate:.0} frames/s"));
            if let Some(follow) = &self.follow {
                ui.label(follow.line());
            }
            if let Some(message) = &self.message {
                ui.label(message);
            }
        });
    }

    fn side(&mut self, ui: &mut Ui, changes: &mut Vec<Change>) {
        ui.add_space(4.0);
        ui.horizontal_wrapped(|ui| {
            for (shown, name) in [
                (Shown::Classic, "Classic"),
                (Shown::Traced, "Traced"),
                (Shown::Split, "Split"),
                (Shown::Reference, "Reference"),
                (Shown::Hybrid, "Hybrid"),
            ] {
                ui.selectable_value(&mut self.shown, shown, name);
            }
            ui.checkbox(&mut self.motion.walks, "walk")
                .on_hover_text("G");
            ui.checkbox(&mut self.animates, "animate");
        });
        self.progress(ui);
        self.watch_state(ui);
        ui.separator();
        ui.horizontal(|ui| {
            ui.label("Preset");
            presets(ui, &self.settings, changes);
        });
        main_settings(ui, &self.settings, self.costs.newest(), changes);
        egui::CollapsingHeader::new("All settings").show(ui, |ui| {
            ui.add(egui::TextEdit::singleline(&mut self.filter).hint_text("search"));
            all_settings(ui, &self.settings, &self.filter, changes);
        });
        self.camera_list(ui);
        self.surface(ui);
        self.light_list(ui);
        egui::CollapsingHeader::new("GPU times")
            .default_open(true)
            .show(ui, |ui| {
                self.costs.plot(ui);
                egui::Grid::new("costs").show(ui, |ui| {
                    for (name, ms) in self.costs.means() {
                        ui.label(name);
                        ui.label(format!("{ms:.3} ms"));
                        ui.end_row();
                    }
                    ui.label("these panels (CPU)");
                    ui.label(format!("{:.3} ms", self.panel_ms));
                    ui.end_row();
                });
                if let Some(seconds) = self.first_picture {
                    ui.weak(format!("first picture of the map after {seconds:.2} s"));
                }
                ui.weak(self.renderer.device_info().name.clone());
            });
    }

    /// What is not complete yet.
    fn progress(&self, ui: &mut Ui) {
        if !self.shown.is_traced() {
            return;
        }
        if let Some(finder) = self.finder.as_ref().filter(|_| !self.found) {
            if let Progress::Part(part) = finder.newest {
                let left = finder.left().map(|s| format!(", about {s:.0} s left"));
                let text = format!("finding the map's lights{}", left.unwrap_or_default());
                ui.add(egui::ProgressBar::new(part).text(text));
            }
            return;
        }
        if self.shown == Shown::Reference {
            let frames = self.renderer.accumulated_frames();
            let left = self.wanted_frames.saturating_sub(frames) as f32 * self.frame_seconds;
            let text = match left > 0.0 {
                true => format!(
                    "{frames} of {} frames, about {left:.0} s left",
                    self.wanted_frames
                ),
                false => format!("{frames} frames"),
            };
            let part = frames as f32 / self.wanted_frames as f32;
            ui.add(egui::ProgressBar::new(part.min(1.0)).text(text));
        }
    }

    /// What has become of the files of a map that is being made.
    fn watch_state(&self, ui: &mut Ui) {
        let Some(follow) = &self.follow else {
            return;
        };
        ui.separator();
        ui.strong(follow.line());
        ui.weak(follow.files());
        if let Some(problem) = &follow.problem {
            ui.label(RichText::new(problem).monospace());
        }
        if let Some(note) = &follow.note {
            ui.label(note);
        }
    }

    fn camera_list(&mut self, ui: &mut Ui) {
        egui::CollapsingHeader::new("Cameras").show(ui, |ui| {
            let mut chosen = None;
            let cameras = self.map.iter().flat_map(|map| &map.cameras);
            ui.horizontal_wrapped(|ui| {
                for (name, camera) in cameras {
                    if ui.button(name).clicked() {
                        chosen = Some(*camera);
                    }
                }
            });
            if let Some(camera) = chosen {
                self.motion.camera = camera.into();
            }
            ui.horizontal(|ui| {
                if ui.button("keep this view").clicked()
                    && let Some(map) = &mut self.map
                {
                    let name = format!("view {}", map.cameras.len());
                    map.cameras.push((name, self.motion.camera.into()));
                }
                if ui.button("copy as command").on_hover_text("P").clicked() {
                    self.copy_view(ui.ctx());
                }
            });
            ui.add(
                egui::Slider::new(&mut self.motion.speed, 40.0..=4000.0)
                    .logarithmic(true)
                    .text("units/s"),
            );
        });
    }

    fn surface(&mut self, ui: &mut Ui) {
        let mut chosen = None;
        egui::CollapsingHeader::new("Surface")
            .default_open(true)
            .show(ui, |ui| {
                let Some(picked) = &self.picked else {
                    ui.weak("Click a surface in the picture.");
                    return;
                };
                ui.strong(&picked.material);
                let defined = picked.defined.as_deref();
                ui.weak(defined.unwrap_or("no script; a bare image"));
                egui::Grid::new("facts")
                    .max_col_width(PANEL * 0.6)
                    .show(ui, |ui| {
                        for (name, value) in &picked.facts {
                            ui.label(*name);
                            ui.label(value);
                            ui.end_row();
                        }
                    });
                ui.label("Light that reaches this place:");
                if !self.can_trace() {
                    ui.weak("The map's lights are not found yet: choose Traced, then click again.");
                }
                egui::Grid::new("arriving").striped(true).show(ui, |ui| {
                    for line in &picked.light {
                        let [r, g, b] = line.color;
                        ui.colored_label(Color32::from_rgb(r, g, b), "⏺");
                        if ui.link(&line.name).clicked() {
                            chosen = Some((line.material.clone(), line.point));
                        }
                        ui.label(format!("{:.0} %", line.part * 100.0));
                        ui.weak(format!("{:.0} % unshadowed", line.visible * 100.0));
                        ui.end_row();
                    }
                });
                egui::CollapsingHeader::new("Material").show(ui, |ui| {
                    ui.add(egui::Label::new(RichText::new(&picked.report).monospace()).extend());
                });
            });
        let Some((material, point)) = chosen else {
            return;
        };
        if let Some(editor) = &mut self.editor {
            match (material, point) {
                (Some(name), _) => editor.select_material(&name),
                (None, Some(index)) => editor.selected = Some(index),
                (None, None) => {}
            }
        }
    }

    fn light_list(&mut self, ui: &mut Ui) {
        let mut apply = false;
        let mut save = false;
        let header = egui::CollapsingHeader::new("Lights").default_open(true);
        header.show(ui, |ui| {
            let place = self
                .picked
                .as_ref()
                .map(|p| p.met.point + p.met.normal * 16.0);
            let [forward, ..] = self.motion.camera.axis();
            let place = place.unwrap_or(self.motion.camera.origin + forward * 64.0);
            let Some(editor) = &mut self.editor else {
                ui.weak("Lights are listed once the traced look is shown.");
                return;
            };
            ui.horizontal_wrapped(|ui| {
                let add = ui
                    .button("add")
                    .on_hover_text("before the picked surface, or ahead");
                if add.clicked() {
                    editor.add(place);
                    apply = true;
                }
                if ui.button("remove").clicked() {
                    editor.remove_selected();
                    apply = true;
                }
                let reset = ui.button("as compiled");
                if reset
                    .on_hover_text("discards every change of the lights")
                    .clicked()
                {
                    editor.reset();
                    apply = true;
                }
                let text = if editor.is_changed() {
                    "save *"
                } else {
                    "save"
                };
                let path = self.lights_path.as_ref().map(|p| p.display().to_string());
                save = ui
                    .button(text)
                    .on_hover_text(path.unwrap_or_default())
                    .clicked();
            });
            let mut number = 0;
            let mut before = None;
            egui::ScrollArea::vertical()
                .max_height(180.0)
                .id_salt("lights")
                .show(ui, |ui| {
                    for index in 0..editor.items.len() {
                        let Some(item) = editor.items.get_mut(index) else {
                            continue;
                        };
                        let kind = std::mem::discriminant(&item.kind);
                        number = if before == Some(kind) { number + 1 } else { 0 };
                        before = Some(kind);
                        ui.horizontal(|ui| {
                            apply |= ui.checkbox(&mut item.on, "").changed();
                            ui.colored_label(swatch(item), "⏺");
                            let label = item.label(number);
                            let chosen = editor.selected == Some(index);
                            if ui.selectable_label(chosen, label).clicked() {
                                editor.selected = Some(index);
                            }
                        });
                    }
                });
            let selected = editor
                .selected
                .and_then(|index| editor.items.get_mut(index));
            if let Some(item) = selected {
                apply |= edit(ui, item);
            }
        });
        if apply {
            self.apply_lights();
        }
        if save {
            self.save_lights();
        }
    }

    pub(super) fn save_lights(&mut self) {
        let (Some(editor), Some(path)) = (&mut self.editor, &self.lights_path) else {
            self.message =
                Some("no place to save lights; name one with --lights-file FILE".to_owned());
            return;
        };
        self.message = Some(match editor.save(path) {
            Ok(()) => format!("saved {}", path.display()),
            Err(e) => format!("{e:#}; choose another file with --lights-file FILE"),
        });
    }
}

/// A word of a command line.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:+=,@".contains(c);
    match word.chars().all(plain) && !word.is_empty() {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

/// The colour of a light at full brightness.
pub(super) fn swatch(item: &Item) -> Color32 {
    let light = item.light();
    let [r, g, b] = encoded(light / light.max_element().max(f32::MIN_POSITIVE));
    Color32::from_rgb(r, g, b)
}

/// Fields of the selected light; whether its light has changed.
fn edit(ui: &mut Ui, item: &mut Item) -> bool {
    let mut changed = false;
    let mut done = |response: egui::Response| {
        // a drag is applied at its end
        changed |= response.drag_stopped()
            || response.lost_focus()
            || response.changed() && !response.dragged();
    };
    egui::Grid::new("light").show(ui, |ui| {
        let light = item.light();
        let strength = light.max_element();
        let mut color = encoded(light / strength.max(f32::MIN_POSITIVE));
        ui.label("colour");
        let picker = ui.color_edit_button_srgb(&mut color);
        if picker.changed() {
            let chosen = decoded(color);
            let brightest = chosen.max_element().max(f32::MIN_POSITIVE);
            item.set_light(chosen / brightest * strength);
        }
        done(picker);
        ui.end_row();
        ui.label("strength");
        let mut number = item.strength();
        let speed = number * 0.01;
        let drag = ui.add(
            egui::DragValue::new(&mut number)
                .range(0.01..=1e6)
                .speed(speed),
        );
        if drag.changed() {
            item.set_strength(number);
        }
        done(drag);
        ui.end_row();
        if let Kind::Point(light) = &mut item.kind {
            for (label, value) in [
                ("x", &mut light.origin.x),
                ("y", &mut light.origin.y),
                ("z", &mut light.origin.z),
            ] {
                ui.label(label);
                done(ui.add(egui::DragValue::new(value)));
                ui.end_row();
            }
            ui.label("radius");
            done(
                ui.add(
                    egui::DragValue::new(&mut light.radius)
                        .range(0.1..=256.0)
                        .speed(0.1),
                ),
            );
            ui.end_row();
        }
        if let Kind::Sun(sun) = &mut item.kind {
            let d = sun.direction;
            let mut degrees = d.y.atan2(d.x).to_degrees();
            let mut elevation = d.z.clamp(-1.0, 1.0).asin().to_degrees();
            ui.label("direction");
            let a = ui.add(egui::DragValue::new(&mut degrees).suffix("°"));
            ui.end_row();
            ui.label("elevation");
            let b = ui.add(
                egui::DragValue::new(&mut elevation)
                    .range(-89.0..=89.0)
                    .suffix("°"),
            );
            ui.end_row();
            if a.changed() || b.changed() {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let (up, flat) = elevation.to_radians().sin_cos();
                sun.direction = Vec3::new(cos * flat, sin * flat, up).normalize_or(Vec3::Z);
            }
            done(a);
            done(b);
        }
    });
    changed
}
