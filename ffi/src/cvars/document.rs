//! The tables of variables in `docs/settings.md`. `RELIGHT_UPDATE=1 cargo test -p ffi cvars::document` writes them.

use std::fmt::Write;
use std::path::Path;

use super::tests::{KNOWN, specs};
use super::{UNUSED, flags};
use renderer_vk::settings::{Kind, Spec};

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

/// The page with the table below a heading replaced.
fn with_table(page: &str, heading: &str, rows: &[&Spec]) -> String {
    let (before, after) = page.split_once(heading).expect(heading);
    let (text, table) = after.split_once("|---|---|---|---|\n").expect("a table");
    let rest = table.split_once("\n\n").expect("text after the table").1;
    let mut page = format!("{before}{heading}{text}|---|---|---|---|\n");
    for spec in rows {
        write!(page, "{}", line(spec)).expect("memory");
    }
    page + "\n" + rest
}

#[test]
fn the_page_has_the_tables() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/settings.md");
    let page = std::fs::read_to_string(&path).expect("docs/settings.md");
    let unused: Vec<_> = UNUSED.iter().collect();
    let is_known = |spec: &&Spec| {
        let mut names = KNOWN.lines().filter_map(|line| line.split(' ').next());
        names.any(|name| name == spec.name)
    };
    let used = specs().filter(|spec| !unused.iter().any(|u| u.name == spec.name));
    let (known, ours): (Vec<_>, Vec<_>) = used.partition(is_known);
    let tables = [
        ("## Settings of the engine\n", known),
        ("## Settings without effect\n", unused),
        ("## Settings of this renderer\n", ours),
    ];
    let written = tables.iter().fold(page.clone(), |page, (heading, rows)| {
        with_table(&page, heading, rows)
    });
    if std::env::var_os("RELIGHT_UPDATE").is_some() {
        std::fs::write(&path, written).expect("docs/settings.md");
    } else {
        assert!(
            written == page,
            "docs/settings.md: run with RELIGHT_UPDATE=1"
        );
    }
}
