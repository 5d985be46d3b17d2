//! Presets: named values for the settings that decide about quality and cost of the traced look.

use super::row::SettingError;
use super::value::Given;
use super::{Settings, row};

/// A group of values of settings.
#[derive(Debug)]
pub struct Preset {
    /// Its name for players.
    pub name: &'static str,
    /// What it is for.
    pub help: &'static str,
    column: usize,
}

/// All presets, from the cheapest to the most expensive.
pub static PRESETS: &[Preset] = &[
    Preset {
        name: "low",
        help: "half the width and height and no bounces, for graphics chips without ray tracing",
        column: 0,
    },
    Preset {
        name: "medium",
        help: "for smaller graphics cards",
        column: 1,
    },
    Preset {
        name: "high",
        help: "the defaults",
        column: 2,
    },
    Preset {
        name: "reference",
        help: "the exact picture, averaged while nothing moves (rt_pause 1 holds the view); too noisy to play",
        column: 3,
    },
];

/// Settings and their values, a column for each of [`PRESETS`].
const VALUES: &[(&str, [&str; 4])] = &[
    ("rt_scale", ["0.5", "0.75", "1", "1"]),
    ("rt_bounces", ["0", "1", "1", "2"]),
    ("rt_numRandomDL", ["1", "1", "1", "4"]),
    ("rt_candidates", ["4", "8", "8", "16"]),
    ("rt_maxDepth", ["2", "3", "4", "8"]),
    ("rt_denoiser", ["1", "1", "1", "0"]),
    ("rt_taa", ["1", "1", "1", "0"]),
    ("rt_accumulate", ["0", "0", "0", "1"]),
];

impl Preset {
    /// The preset of a name; case is ignored.
    pub fn of(name: &str) -> Option<&'static Self> {
        PRESETS
            .iter()
            .find(|preset| preset.name.eq_ignore_ascii_case(name))
    }

    /// Console variables and their values.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        VALUES
            .iter()
            .filter_map(|(name, values)| Some((*name, *values.get(self.column)?)))
    }

    /// Puts the values into settings.
    ///
    /// # Errors
    /// A row of the table of presets that the table of settings does not accept.
    pub fn put(&self, settings: &mut Settings) -> Result<(), SettingError> {
        for (name, value) in self.values() {
            if let Some(row) = row(name) {
                row.put(settings, &Given::parse(value))?;
            }
        }
        Ok(())
    }

    /// The preset whose values these settings have.
    pub fn current(settings: &Settings) -> Option<&'static Self> {
        PRESETS.iter().find(|preset| {
            let mut with = settings.clone();
            preset.put(&mut with).is_ok() && with == *settings
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_recognised_once_it_is_set() {
        for preset in PRESETS {
            let mut settings = Settings::default();
            preset
                .put(&mut settings)
                .expect("values that settings accept");
            assert_eq!(
                Preset::current(&settings).map(|p| p.name),
                Some(preset.name)
            );
            for (name, value) in preset.values() {
                let limits = row(name).expect("a setting of this name").spec.range;
                let number: f32 = value.parse().expect("a number");
                assert!(
                    limits.is_none_or(|r| (r.min..=r.max).contains(&number)),
                    "{name} {value}"
                );
            }
        }
        assert_eq!(Preset::of("HIGH").map(|p| p.name), Some("high"));
        assert!(Preset::of("ultra").is_none());
    }

    #[test]
    fn the_defaults_are_the_preset_high_and_others_are_none() {
        let mut settings = Settings::default();
        assert_eq!(Preset::current(&settings).map(|p| p.name), Some("high"));
        settings.rt_scale = 0.6;
        assert!(Preset::current(&settings).is_none());
    }
}
