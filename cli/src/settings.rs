//! Options for settings of the renderer; their parsers, defaults and help come from the table of settings.

use clap::Args;
use renderer_vk::Settings;
use renderer_vk::settings::{Given, Row, SettingError, row};

/// A setting with a value.
#[derive(Clone, Debug)]
pub struct Assignment {
    row: &'static Row,
    text: String,
}

impl Assignment {
    fn new(row: &'static Row, text: &str) -> Result<Self, SettingError> {
        row.check(text)?;
        let text = text.to_owned();
        Ok(Self { row, text })
    }
}

/// The row of the setting of an option.
fn named(name: &str) -> &'static Row {
    row(name).expect("options name settings of the table")
}

/// Parser of an option for a setting.
pub fn value_of(name: &str) -> impl Fn(&str) -> Result<Assignment, SettingError> + Clone + use<> {
    let row = named(name);
    move |text| Assignment::new(row, text)
}

/// Help of an option for a setting.
pub fn help(name: &str) -> String {
    let spec = &named(name).spec;
    format!("{} (setting {name})", spec.help.trim_end_matches('.'))
}

/// Default of a setting.
pub fn default(name: &str) -> &'static str {
    named(name).spec.default
}

/// Parses `NAME=VALUE`.
fn assignment(text: &str) -> Result<Assignment, String> {
    let (name, value) = text
        .split_once('=')
        .ok_or("a setting is NAME=VALUE, for example rt_maxDepth=2")?;
    let row = row(name).ok_or_else(|| format!("there is no setting {name}"))?;
    Assignment::new(row, value).map_err(|error| error.to_string())
}

// No documentation comment: clap would show it in place of a subcommand's own description.

// Settings of the renderer.
#[derive(Args, Debug)]
pub struct SettingArgs {
    /// Set a setting by its console name (docs/src/settings), for example --set rt_maxDepth=2; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<Assignment>,
}

impl SettingArgs {
    /// Applies the options, then `--set`.
    pub fn change<'a>(
        &'a self,
        options: impl IntoIterator<Item = &'a Assignment>,
        mut settings: Settings,
    ) -> Settings {
        for Assignment { row, text } in options.into_iter().chain(&self.set) {
            let put = row.put(&mut settings, &Given::parse(text));
            debug_assert_eq!(put, Ok(()), "the parser checked it");
        }
        settings
    }
}
