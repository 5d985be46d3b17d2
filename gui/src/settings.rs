//! Widgets for settings, made from the table of settings.

use egui::{ComboBox, DragValue, Slider, Ui};
use renderer_vk::Settings;
use renderer_vk::settings::{Kind, PRESETS, Preset, ROWS, Range, Row, row};

/// A new value of a console variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The variable.
    pub name: &'static str,
    /// Its value.
    pub value: String,
}

/// Settings that matter most for picture and speed, with the passes whose GPU time they decide.
pub const MAIN: [(&str, &str, &[&str]); 10] = [
    (
        "rt_scale",
        "Resolution",
        &["trace_primary", "trace_other_side"],
    ),
    (
        "rt_numRandomDL",
        "Lights per pixel",
        &["trace_sample_lights", "trace_direct", "trace_suns"],
    ),
    (
        "rt_candidates",
        "Light candidates",
        &["trace_sample_lights"],
    ),
    ("rt_bounces", "Bounces", &["trace_bounce"]),
    ("rt_maxDepth", "Mirrors and panes", &["trace_other_side"]),
    (
        "rt_denoiser",
        "Denoiser",
        &[
            "trace_temporal",
            "trace_wavelet",
            "trace_sparse",
            "trace_gradient",
        ],
    ),
    (
        "rt_taa",
        "Smooth edges",
        &["trace_antialias", "trace_upscale", "trace_sharpen"],
    ),
    ("rt_bloom", "Bloom", &["trace_bloom_down", "trace_bloom_up"]),
    ("rt_exposure", "Exposure", &["trace_exposure"]),
    ("rt_softshadows", "Soft shadows", &[]),
];

/// Milliseconds of all passes whose name begins with one of `passes`.
fn cost(timings: &[(String, f32)], passes: &[&str]) -> f32 {
    let counts = |name: &str| passes.iter().any(|pass| name.starts_with(pass));
    let matching = timings.iter().filter(|(name, _)| counts(name));
    matching.map(|(_, ms)| ms).sum()
}

/// The presets as buttons; the one whose values are set is marked.
pub fn presets(ui: &mut Ui, settings: &Settings, changes: &mut Vec<Change>) {
    let current = Preset::current(settings).map(|preset| preset.name);
    ui.horizontal_wrapped(|ui| {
        for preset in PRESETS {
            let button = ui.selectable_label(current == Some(preset.name), preset.name);
            if button.on_hover_text(preset.help).clicked() {
                changes.extend(preset.values().map(|(name, value)| Change {
                    name,
                    value: value.to_owned(),
                }));
            }
        }
    });
}

/// The [main](MAIN) settings with their cost by `timings` (GPU milliseconds by pass).
pub fn main_settings(
    ui: &mut Ui,
    settings: &Settings,
    timings: &[(String, f32)],
    changes: &mut Vec<Change>,
) {
    egui::Grid::new("main settings")
        .num_columns(3)
        .show(ui, |ui| {
            for (name, label, passes) in MAIN {
                let Some(row) = row(name) else {
                    continue; // a test holds that there is one
                };
                ui.label(label).on_hover_text(help(row));
                widget(ui, row, settings, changes);
                let ms = cost(timings, passes);
                match passes.is_empty() || ms == 0.0 {
                    true => ui.weak("–"),
                    false => ui.weak(format!("{ms:.2} ms")),
                };
                ui.end_row();
            }
        });
}

/// Every setting whose name or help contains `filter`.
pub fn all_settings(ui: &mut Ui, settings: &Settings, filter: &str, changes: &mut Vec<Change>) {
    let filter = filter.to_lowercase();
    let wanted = |row: &&Row| {
        let text = format!("{} {}", row.spec.name, row.spec.help).to_lowercase();
        row.spec.kind != Kind::Text && text.contains(&filter)
    };
    for (title, of_trace) in [("Traced look", true), ("Classic look and engine", false)] {
        let is_traced = |row: &&Row| row.spec.name.starts_with("rt_") || row.spec.name == "r_rt";
        let rows: Vec<&Row> = (ROWS.iter())
            .filter(wanted)
            .filter(|row| is_traced(row) == of_trace)
            .collect();
        if rows.is_empty() {
            continue;
        }
        egui::CollapsingHeader::new(format!("{title} ({})", rows.len()))
            .default_open(of_trace || !filter.is_empty())
            .show(ui, |ui| {
                egui::Grid::new(title).num_columns(3).show(ui, |ui| {
                    for row in rows {
                        ui.label(row.spec.name).on_hover_text(help(row));
                        widget(ui, row, settings, changes);
                        reset(ui, row, settings, changes);
                        ui.end_row();
                    }
                });
            });
    }
}

fn help(row: &Row) -> String {
    let spec = &row.spec;
    format!("{}: {} Default {}.", spec.name, spec.help, spec.default)
}

/// A button that puts the default back, if another value is set.
fn reset(ui: &mut Ui, row: &Row, settings: &Settings, changes: &mut Vec<Change>) {
    let mut default = settings.clone();
    row.reset(&mut default);
    if default == *settings {
        ui.label("");
    } else if ui
        .small_button("⟲")
        .on_hover_text(format!("back to {}", row.spec.default))
        .clicked()
    {
        changes.push(Change {
            name: row.spec.name,
            value: row.spec.default.to_owned(),
        });
    }
}

/// A widget by the type and the limits of a setting.
fn widget(ui: &mut Ui, row: &Row, settings: &Settings, changes: &mut Vec<Change>) {
    let text = row.text(settings);
    let mut set = |value: String| {
        if value != text {
            changes.push(Change {
                name: row.spec.name,
                value,
            });
        }
    };
    match (row.spec.kind, row.spec.range) {
        (Kind::Text, _) => {
            ui.label(&text);
        }
        (Kind::Name(names), _) => {
            ComboBox::from_id_salt(row.spec.name)
                .selected_text(&text)
                .show_ui(ui, |ui| {
                    for name in names {
                        if ui.selectable_label(*name == text, *name).clicked() {
                            set((*name).to_owned());
                        }
                    }
                });
        }
        (
            Kind::Whole,
            Some(Range {
                min: 0.0, max: 1.0, ..
            }),
        ) => {
            let mut on = text != "0";
            if ui.checkbox(&mut on, "").changed() {
                set(u8::from(on).to_string());
            }
        }
        (Kind::Whole, range) => {
            let mut number: i64 = text.parse().unwrap_or(0);
            let changed = match range {
                Some(Range { min, max, .. }) if max <= 64.0 => {
                    ui.add(Slider::new(&mut number, min as i64..=max as i64))
                }
                _ => ui.add(DragValue::new(&mut number)),
            };
            if changed.changed() {
                set(number.to_string());
            }
        }
        (Kind::Number, range) => {
            let mut number: f32 = text.parse().unwrap_or(0.0);
            let changed = match range {
                Some(Range { min, max, .. }) if max - min <= 512.0 => ui
                    .add(Slider::new(&mut number, min..=max).logarithmic(min >= 0.0 && max > 32.0)),
                _ => ui.add(DragValue::new(&mut number).speed(0.1)),
            };
            if changed.changed() {
                set(number.to_string());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_main_settings_exist_and_their_costs_are_sums_of_passes() {
        for (name, ..) in MAIN {
            assert!(row(name).is_some(), "{name}");
        }
        let timings = [
            ("trace_bounce_rays".to_owned(), 0.5),
            ("trace_bounce_light".to_owned(), 0.25),
            ("trace_direct".to_owned(), 2.0),
        ];
        assert_eq!(cost(&timings, &["trace_bounce"]), 0.75);
        assert_eq!(cost(&timings, &[]), 0.0);
    }
}
