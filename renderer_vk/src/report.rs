//! A report for the developers: one zip with what they ask for when something is wrong, and nothing personal.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use zip::write::{SimpleFileOptions, ZipWriter};

use crate::api::Picture;
use crate::gpu::DeviceInfo;
use crate::picture_files::png;
use crate::settings::ROWS;
use crate::statistics::Costs;

/// What a report holds.
#[derive(Debug)]
pub struct Report<'a> {
    /// What the program runs in, and on what, a line each. Version and system are added.
    pub about: Vec<String>,
    /// The device in use, and its GPU times and memory; `None` if there is no usable device.
    pub device: Option<(&'a DeviceInfo, &'a Costs)>,
    /// Values of settings, by name of the console variable; those that are absent have their defaults.
    pub settings: HashMap<&'static str, String>,
    /// Messages, oldest first.
    pub log: &'a [String],
    /// Pictures and their names.
    pub pictures: &'a [(String, Picture)],
}

/// A report that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// An archive of over 4 GiB.
    #[error("the report's archive: {0}")]
    Zip(#[from] zip::result::ZipError),
    /// See its message.
    #[error("the report's archive: {0}")]
    Write(#[from] std::io::Error),
    /// A picture without pixels.
    #[error("the report's picture: {0}")]
    Picture(#[from] image::ImageError),
}

impl Report<'_> {
    /// The zip archive.
    ///
    /// # Errors
    /// See [`ReportError`].
    pub fn zip(&self) -> Result<Vec<u8>, ReportError> {
        let person = Person::of_this_process();
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        let mut text = |name: &str, text: &str| -> Result<(), ReportError> {
            zip.start_file(name, SimpleFileOptions::default())?;
            zip.write_all(person.removed_from(text).as_bytes())?;
            Ok(())
        };
        let (system, kind) = (std::env::consts::OS, std::env::consts::ARCH);
        let version = env!("CARGO_PKG_VERSION");
        let about = format!("Relight {version}\nsystem: {system} {kind}\n");
        text("about.txt", &(about + &lines(&self.about)))?;
        if let Some((device, costs)) = self.device {
            text("device.txt", &format!("{device:#?}\n"))?;
            text("timings.json", &costs.json())?;
        }
        text("settings.txt", &self.settings())?;
        text("log.txt", &lines(self.log))?;
        for (name, picture) in self.pictures {
            zip.start_file(format!("{name}.png"), SimpleFileOptions::default())?;
            zip.write_all(&png(&picture.rgb, picture.width, picture.height)?)?;
        }
        Ok(zip.finish()?.into_inner())
    }

    /// All settings; a `*` marks those that are not at their defaults.
    fn settings(&self) -> String {
        let mut text = String::new();
        for row in ROWS {
            let default = row.spec.default;
            let value = self
                .settings
                .get(row.spec.name)
                .map_or(default, String::as_str);
            let mark = if value == default { ' ' } else { '*' };
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{mark} {} \"{value}\" (default \"{default}\")",
                row.spec.name
            );
        }
        text
    }
}

fn lines(lines: &[String]) -> String {
    let ends = lines.iter().map(|line| format!("{}\n", line.trim_end()));
    ends.collect()
}

/// What names the person at this computer in paths and messages.
#[derive(Debug, Default)]
struct Person {
    /// Home folders, with either separator.
    homes: Vec<String>,
    /// Names of the user and the computer.
    names: Vec<String>,
}

impl Person {
    fn of_this_process() -> Self {
        let variable = |name: &&str| std::env::var(name).ok();
        let homes = ["HOME", "USERPROFILE", "APPDATA", "LOCALAPPDATA"];
        let names = ["USER", "LOGNAME", "USERNAME", "HOSTNAME", "COMPUTERNAME"];
        Self {
            homes: homes.iter().filter_map(variable).collect(),
            names: names.iter().filter_map(variable).collect(),
        }
    }

    /// The text without them: a home folder becomes `~`, a name `USER`.
    fn removed_from(&self, text: &str) -> String {
        let mut text = text.to_owned();
        for home in &self.homes {
            // `/` is the home of some services; nothing personal is in it.
            if home.len() > 1 {
                text = text
                    .replace(home, "~")
                    .replace(&home.replace('\\', "/"), "~");
            }
        }
        text = without_next_name(&text, "/home/", " /\\\":\n");
        for folder in ["/Users/", "\\Users\\"] {
            // names may have spaces there
            text = without_next_name(&text, folder, "/\\\":\n");
        }
        for name in self
            .names
            .iter()
            .filter(|name| name.len() > 2 && *name != "root")
        {
            text = replace_word(&text, name, "USER");
        }
        text
    }
}

/// Replaces the name that follows `folder` in paths, up to one of the characters `ends`.
fn without_next_name(text: &str, folder: &str, ends: &str) -> String {
    let mut parts = text.split(folder);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c| ends.contains(c)).unwrap_or(part.len());
        out.push_str(folder);
        out.push_str("USER");
        out.push_str(part.get(end..).unwrap_or_default());
    }
    out
}

/// Replaces a word where neither a letter nor a digit is beside it.
fn replace_word(text: &str, word: &str, by: &str) -> String {
    let beside = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(word) {
        let (before, found) = rest.split_at(at);
        let after = found.get(word.len()..).unwrap_or_default();
        out.push_str(before);
        let inside = beside(before.chars().next_back().or(out.chars().next_back()))
            || beside(after.chars().next());
        out.push_str(if inside { word } else { by });
        rest = after;
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_personal_stays() {
        let person = Person {
            homes: vec!["/home/jane".to_owned(), "C:\\Users\\Jane Doe".to_owned()],
            names: vec!["jane".to_owned(), "pc".to_owned()],
        };
        let text = "read /home/jane/.q3a/x and C:\\Users\\Jane Doe\\AppData, C:/Users/Jane Doe/y\n\
                    /home/bob/maps by jane, janet\\Users\\Eve Roe\\z";
        let found = person.removed_from(text);
        assert_eq!(
            found,
            "read ~/.q3a/x and ~\\AppData, ~/y\n/home/USER/maps by USER, janet\\Users\\USER\\z"
        );
    }

    #[test]
    fn a_service_whose_home_is_the_root_keeps_its_paths() {
        let person = Person {
            homes: vec!["/".to_owned()],
            names: vec!["root".to_owned()],
        };
        assert_eq!(
            person.removed_from("/usr/share of root"),
            "/usr/share of root"
        );
    }
}
