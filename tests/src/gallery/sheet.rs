//! Compares what the two renderers left, and writes the contact sheet.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use relight::compare::{Difference, Rgb8, compare as compare_pictures};

use super::Scene;
use super::run::Player;

/// Differences are shown this many times larger.
const GAIN: i32 = 8;

/// One picture or answer of a scene.
pub struct Outcome {
    /// The scene.
    pub scene: &'static str,
    /// The picture's name, or the answer's label.
    pub name: String,
    /// How alike the pictures are; `None` for an answer.
    pub difference: Option<Difference>,
    /// What is wrong; empty if nothing is.
    pub complaint: String,
}

fn load(file: &Path) -> Option<Rgb8> {
    let image = image::open(file).ok()?.to_rgb8();
    let (width, height) = (image.width() as usize, image.height() as usize);
    Rgb8::new(width, height, image.into_raw()).ok()
}

/// Names of a scene's pictures, whoever left them.
fn names(scene: &Scene, folder: &Path) -> BTreeSet<String> {
    let start = format!("{}.", scene.name);
    let list = |player: Player| std::fs::read_dir(folder.join(player.name()));
    Player::BOTH
        .into_iter()
        .filter_map(|player| list(player).ok())
        .flatten()
        .flatten()
        .filter_map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            let name = name.strip_prefix(&start)?.strip_suffix(".png")?;
            Some(name.to_string())
        })
        .collect()
}

/// Whether two answers are the same but for rounding.
fn agree(a: &str, b: &str, tolerance: f64) -> bool {
    let words = |text: &str| -> Vec<String> { text.split_whitespace().map(Into::into).collect() };
    let (a, b) = (words(a), words(b));
    a.len() == b.len()
        && a.iter()
            .zip(&b)
            .all(|(a, b)| match (a.parse::<f64>(), b.parse::<f64>()) {
                (Ok(x), Ok(y)) => {
                    (x - y).abs() <= tolerance * x.abs().max(1.0) || x.to_bits() == y.to_bits()
                }
                _ => a == b,
            })
}

fn facts(folder: &Path, player: Player, scene: &Scene) -> Vec<(String, String)> {
    let file = folder
        .join(player.name())
        .join(format!("{}.txt", scene.name));
    std::fs::read_to_string(file)
        .unwrap_or_default()
        .lines()
        .filter_map(|line| line.split_once('\t'))
        .map(|(label, value)| (label.to_string(), value.to_string()))
        .collect()
}

/// Compares everything that the scenes left below `folder`.
pub fn compare(scenes: &[Scene], folder: &Path) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for scene in scenes {
        let outcome = |name: &str, difference, complaint: String| Outcome {
            scene: scene.name,
            name: name.to_string(),
            difference,
            complaint,
        };
        for player in Player::BOTH {
            let file = folder
                .join(player.name())
                .join(format!("{}.failed", scene.name));
            if let Ok(reason) = std::fs::read_to_string(file) {
                let complaint = format!("{}: {reason}", player.name());
                // The reference may break the stand-in's stricter rules, as long as it comes to the scene's end.
                let facts = folder
                    .join(player.name())
                    .join(format!("{}.txt", scene.name));
                let shown = player == Player::Ours || !facts.is_file();
                if shown {
                    outcomes.push(outcome("", None, complaint));
                }
            }
        }
        for name in names(scene, folder) {
            let [reference, ours] = Player::BOTH.map(|p| {
                load(
                    &folder
                        .join(p.name())
                        .join(format!("{}.{name}.png", scene.name)),
                )
            });
            let (Some(reference), Some(ours)) = (reference, ours) else {
                outcomes.push(outcome(&name, None, "only one renderer drew it".into()));
                continue;
            };
            match compare_pictures(&reference, &ours) {
                Ok(found) => {
                    let fine =
                        found.ssim >= scene.limit.ssim && found.mean_absolute <= scene.limit.mean;
                    let complaint = if fine { "" } else { "the pictures differ" };
                    outcomes.push(outcome(&name, Some(found), complaint.into()));
                }
                Err(error) => outcomes.push(outcome(&name, None, error.to_string())),
            }
        }
        let [reference, ours] = Player::BOTH.map(|p| facts(folder, p, scene));
        for (label, value) in &reference {
            let other = ours.iter().find(|(l, _)| l == label).map(|(_, v)| v);
            let complaint = match other {
                Some(other) if agree(value, other, scene.limit.fact) => String::new(),
                Some(other) => format!("{value} there, {other} here"),
                None => format!("{value} there, nothing here"),
            };
            outcomes.push(outcome(label, None, complaint));
        }
        for (label, _) in ours
            .iter()
            .filter(|(l, _)| !reference.iter().any(|(r, _)| r == l))
        {
            outcomes.push(outcome(label, None, "only here".into()));
        }
    }
    outcomes
}

/// The difference of two pictures of one size, grey where they are the same.
fn difference(a: &Rgb8, b: &Rgb8) -> Option<Rgb8> {
    let pixels = a.pixels().iter().zip(b.pixels()).map(|(&a, &b)| {
        let apart = i32::from(b) - i32::from(a);
        (128 + apart * GAIN).clamp(0, 255) as u8
    });
    Rgb8::new(a.width(), a.height(), pixels.collect()).ok()
}

/// Writes `SCENE.NAME.png` (reference, ours, difference) and `index.html` into `folder`.
pub fn write(scenes: &[Scene], outcomes: &[Outcome], folder: &Path) -> std::io::Result<()> {
    let mut page = String::from(
        "<!doctype html><meta charset=utf-8><title>Gallery</title>\n\
         <style>body{font:14px sans-serif}img{max-width:100%}.bad{color:#b00}</style>\n\
         <h1>opengl1 | Relight | difference, eight times</h1>\n",
    );
    let escape = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;");
    for scene in scenes {
        let _ = writeln!(
            page,
            "<h2>{}</h2><p>{}</p>",
            scene.name,
            escape(scene.about)
        );
        for outcome in outcomes.iter().filter(|o| o.scene == scene.name) {
            let class = if outcome.complaint.is_empty() {
                "good"
            } else {
                "bad"
            };
            let figures = outcome.difference.map_or_else(String::new, |d| {
                format!("SSIM {:.4}, mean difference {:.3}", d.ssim, d.mean_absolute)
            });
            let _ = writeln!(
                page,
                "<p class={class}><b>{}</b> {figures} {}</p>",
                escape(&outcome.name),
                escape(&outcome.complaint)
            );
            if outcome.difference.is_none() {
                continue;
            }
            let file = format!("{}.{}.png", scene.name, outcome.name);
            let [Some(reference), Some(ours)] =
                Player::BOTH.map(|p| load(&folder.join(p.name()).join(&file)))
            else {
                continue;
            };
            let row = difference(&reference, &ours)
                .and_then(|d| Rgb8::side_by_side(&[reference, ours, d], 4));
            let Some(row) = row else { continue };
            let (width, height) = (row.width() as u32, row.height() as u32);
            if let Some(image) = image::RgbImage::from_raw(width, height, row.pixels().to_vec()) {
                image
                    .save(folder.join(&file))
                    .map_err(std::io::Error::other)?;
            }
            let _ = writeln!(page, "<a href=\"{file}\"><img src=\"{file}\"></a>");
        }
    }
    std::fs::write(folder.join("index.html"), page)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_agree_but_for_rounding() {
        assert!(agree("1 2.0001 x", "1 2.0002 x", 1e-3));
        assert!(agree("1000.5", "1000.6", 1e-3) && !agree("1.5", "1.6", 1e-3));
        assert!(agree("NaN", "NaN", 1e-3));
        assert!(!agree("1 2", "1", 1e-3) && !agree("x", "y", 1e-3));
    }
}
