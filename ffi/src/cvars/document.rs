//! The tables of variables in the book. `RELIGHT_UPDATE=1 cargo test -p ffi cvars::document` writes them.

use std::path::Path;

use super::tests::{KNOWN, specs};
use super::{UNUSED, flags};
use renderer_vk::settings::{Kind, PRESETS, Preset, Spec};

/// Settings that exist to compare techniques. The page that compares them has their table, not that of players.
const COMPARED: &[&str] = &[
    "rt_gridCells",
    "rt_blueNoise",
    "rt_bounceScreen",
    "rt_bounceThickness",
    "rt_bounceAdaptive",
    "rt_foveation",
    "rt_shareEyes",
    "rt_bounceRoulette",
    "rt_bounceAmbient",
    "rt_bounceAmbientFall",
    "rt_bounceCache",
    "rt_lightSelection",
    "rt_taaRays",
    "rt_taaMaximum",
    "rt_hitFeedback",
    "rt_firstHits",
    "rt_cutouts",
];

/// A row of a table. The help of variables without effect ends with a sentence that their table states once.
fn line(spec: &Spec) -> String {
    let default = match spec.default {
        "" => String::new(),
        default => format!("`{default}`"),
    };
    let letters = match spec.flags {
        flags::NONE => "–".to_owned(),
        _ => spec.letters(),
    };
    let help = spec.help.split_once(" Kept for old");
    let help = help.map_or(spec.help, |(help, _)| help);
    let range = match (spec.range, spec.kind) {
        (Some(range), kind) if range.by_engine => {
            let whole = if kind == Kind::Whole { ", whole" } else { "" };
            format!(" {} to {}{whole}.", range.min, range.max)
        }
        _ => String::new(),
    };
    format!(
        "| `{}` | {default} | {letters} | {help}{range} |\n",
        spec.name
    )
}

/// A table: the page that holds it, its name in the comments around it, its rows.
type Table = (&'static str, &'static str, Vec<&'static Spec>);

fn tables() -> [Table; 5] {
    let is_known = |spec: &&Spec| {
        let mut names = KNOWN.lines().filter_map(|line| line.split(' ').next());
        names.any(|name| name == spec.name)
    };
    let is_traced = |spec: &&Spec| spec.name == "r_rt" || spec.name.starts_with("rt_");
    let used = specs().filter(|spec| !UNUSED.iter().any(|u| u.name == spec.name));
    let (known, ours): (Vec<_>, Vec<_>) = used.partition(is_known);
    let is_compared = |spec: &&Spec| COMPARED.contains(&spec.name);
    let (compared, ours): (Vec<_>, Vec<_>) = ours.into_iter().partition(is_compared);
    let (traced, others): (Vec<_>, Vec<_>) = ours.into_iter().partition(is_traced);
    [
        ("settings/engine.md", "engine", known),
        (
            "settings/engine.md",
            "without effect",
            UNUSED.iter().collect(),
        ),
        ("settings/renderer.md", "traced look", traced),
        ("settings/renderer.md", "device and classic look", others),
        ("how/techniques.md", "compared", compared),
    ]
}

/// The page with the table between two comments replaced.
fn with_table(page: &str, name: &str, rows: &[&Spec]) -> String {
    let begin = format!("<!-- settings: {name} -->\n");
    let end = format!("<!-- /settings: {name} -->");
    let (before, rest) = page.split_once(&begin).expect("the beginning of the table");
    let (_, after) = rest.split_once(&end).expect("the end of the table");
    let rows: String = rows.iter().map(|spec| line(spec)).collect();
    let head = "| name | default | flags | what it does |\n|---|---|---|---|\n";
    format!("{before}{begin}\n{head}{rows}\n{end}{after}")
}

/// The page with the table of presets replaced.
fn with_presets(page: &str) -> String {
    let (begin, end) = ("<!-- presets -->\n", "<!-- /presets -->");
    let (before, rest) = page.split_once(begin).expect("the beginning of the table");
    let (_, after) = rest.split_once(end).expect("the end of the table");
    let row = |name: String, of: &dyn Fn(&Preset) -> String| {
        let cells: Vec<String> = PRESETS.iter().map(of).collect();
        format!("| {name} | {} |\n", cells.join(" | "))
    };
    let value = |preset: &Preset, name: &str| {
        let mut values = preset.values();
        let found = values.find(|(other, _)| *other == name);
        found.map_or_else(String::new, |(_, value)| format!("`{value}`"))
    };
    let mut table = row("setting".to_owned(), &|preset| format!("`{}`", preset.name));
    table += &row("---".to_owned(), &|_| "---".to_owned());
    for (name, _) in PRESETS.iter().take(1).flat_map(Preset::values) {
        table += &row(format!("`{name}`"), &|preset| value(preset, name));
    }
    table += &row("what it is for".to_owned(), &|preset| {
        preset.help.to_owned()
    });
    format!("{before}{begin}\n{table}\n{end}{after}")
}

/// Compares a page with what it should be, or writes it.
fn check_page(name: &str, written: impl FnOnce(&str) -> String) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../docs/src")
        .join(name);
    let page = std::fs::read_to_string(&path).expect(name);
    let written = written(&page);
    if std::env::var_os("RELIGHT_UPDATE").is_some() {
        std::fs::write(&path, written).expect(name);
    } else {
        assert!(
            written == page,
            "docs/src/{name}: run with RELIGHT_UPDATE=1"
        );
    }
}

#[test]
fn the_page_of_presets_has_their_table() {
    check_page("play/presets.md", with_presets);
}

#[test]
fn the_pages_have_the_tables() {
    let tables = tables();
    for name in [
        "settings/engine.md",
        "settings/renderer.md",
        "how/techniques.md",
    ] {
        let of_page = tables.iter().filter(|(holder, ..)| *holder == name);
        check_page(name, |page| {
            of_page.fold(page.to_owned(), |page, (_, table, rows)| {
                with_table(&page, table, rows)
            })
        });
    }
}
