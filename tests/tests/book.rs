//! The book in `docs` and all other pages of the repository: links lead somewhere, pages are listed and short, and each
//! page of the book has a picture.

#![forbid(unsafe_code)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Most lines of a page of the book.
const LINES: usize = 200;
/// Parts of the book for users, and the most words of them all.
const FOR_USERS: [&str; 3] = ["play", "settings", "maps"];
const WORDS: usize = 12_000;
/// The picture of a page is in its first lines.
const TOP: usize = 12;

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn book() -> PathBuf {
    tests::data::repository().join("docs/src")
}

/// The pages below a folder, as paths from there.
fn pages(root: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder of pages") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                let inside = path.strip_prefix(root).expect("a path below the folder");
                found.insert(inside.to_owned());
            }
        }
    }
    found
}

/// The pages of the repository that git tracks and that are there; `None`, and the test is skipped, without git.
fn tracked(root: &Path) -> Option<Vec<PathBuf>> {
    // In a container the files may belong to another user, whose repositories git refuses otherwise.
    let arguments = ["-c", "safe.directory=*", "ls-files", "-z", "--", "*.md"];
    let listed = Command::new("git")
        .args(arguments)
        .current_dir(root)
        .output();
    let Some(listed) = listed.ok().filter(|listed| listed.status.success()) else {
        testkit::absent(testkit::Need::Data, "git lists no files here");
        return None;
    };
    let names = String::from_utf8(listed.stdout).expect("names in UTF-8");
    let paths = names.split_terminator('\0').map(PathBuf::from);
    Some(paths.filter(|path| root.join(path).exists()).collect())
}

/// The lines of a page outside of fenced code.
fn outside_fences(page: &str) -> String {
    let mut text = String::new();
    let mut fence = None;
    for line in page.lines() {
        let start = line.trim_start();
        let mut marks = ["```", "~~~"].into_iter();
        let mark = marks.find(|mark| start.starts_with(*mark));
        match (fence, mark) {
            (None, Some(_)) => fence = mark,
            (Some(open), Some(close)) if open == close => fence = None,
            (None, None) => {
                text.push_str(line);
                text.push('\n');
            }
            _ => {}
        }
    }
    text
}

/// Number of backticks at the beginning of a text.
fn ticks(text: &str) -> usize {
    text.len() - text.trim_start_matches('`').len()
}

/// Position behind the next run of `count` backticks in a text.
fn end_of_span(text: &str, count: usize) -> Option<usize> {
    let mut at = 0;
    while let Some(found) = text[at..].find('`') {
        let run = ticks(&text[at + found..]);
        at += found + run;
        if run == count {
            return Some(at);
        }
    }
    None
}

/// A text without its code spans. A span ends within its paragraph; backticks without a partner are text.
fn without_code_spans(text: &str) -> String {
    let mut kept = String::new();
    let mut rest = text;
    while let Some(at) = rest.find('`') {
        let (before, from) = rest.split_at(at);
        kept.push_str(before);
        let count = ticks(from);
        let inside = &from[count..];
        let paragraph = inside.split("\n\n").next().unwrap_or_default();
        rest = &inside[end_of_span(paragraph, count).unwrap_or_default()..];
    }
    kept + rest
}

/// Targets of the links and pictures in a text without code.
fn links(text: &str) -> Vec<&str> {
    let inline = text.match_indices("](").filter_map(|(at, mark)| {
        let target = &text[at + mark.len()..];
        let end = target.find(|c: char| c == ')' || c.is_whitespace())?;
        Some(&target[..end])
    });
    let defined = text.lines().filter_map(|line| {
        let (label, target) = line.trim_start().strip_prefix('[')?.split_once("]: ")?;
        let is_label = !label.starts_with('^') && !label.contains(']');
        target.split_whitespace().next().filter(|_| is_label)
    });
    inline.chain(defined).collect()
}

/// The fragment that GitHub and mdBook give to a heading.
fn slug(heading: &str) -> String {
    let mut text = heading.trim().to_owned();
    for target in links(heading) {
        text = text.replacen(&format!("]({target})"), "", 1);
    }
    let mut slug = String::new();
    for c in text.chars() {
        if c.is_whitespace() {
            slug.push('-');
        } else if c.is_alphanumeric() || c == '-' || c == '_' {
            slug.extend(c.to_lowercase());
        }
    }
    slug
}

/// The fragments of a page's headings: repeated ones are numbered from 1.
fn fragments(page: &str) -> BTreeSet<String> {
    let text = outside_fences(page);
    let headings = text.lines().filter_map(|line| {
        let title = line.strip_prefix('#')?.trim_start_matches('#');
        title.strip_prefix(' ')
    });
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let numbered = headings.map(|heading| {
        let slug = slug(heading);
        let count = counts.entry(slug.clone()).or_default();
        *count += 1;
        match *count {
            1 => slug,
            count => format!("{slug}-{}", count - 1),
        }
    });
    numbered.collect()
}

/// Why a link of a page leads nowhere.
fn fault(page: &Path, target: &str) -> Option<&'static str> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, fragment) = target.split_once('#').unwrap_or((target, ""));
    if target.is_empty() || file.starts_with('/') {
        return Some("is no relative path");
    }
    let path = match file {
        "" => page.to_owned(),
        file => page.parent()?.join(file),
    };
    if !path.exists() {
        return Some("is no file");
    }
    // the book is built from its folder alone
    let outside = |path: &Path| !path.canonicalize().is_ok_and(|p| p.starts_with(book()));
    if !outside(page) && outside(&path) {
        return Some("is not in the book");
    }
    let is_page = path.extension().is_some_and(|e| e == "md");
    let leads = fragment.is_empty() || !is_page || fragments(&read(&path)).contains(fragment);
    (!leads).then_some("is no heading")
}

#[test]
fn every_relative_link_of_the_repository_leads_somewhere() {
    let root = tests::data::repository();
    let Some(pages) = tracked(&root) else { return };
    assert!(!pages.is_empty(), "git tracks no pages");
    let mut wrong = Vec::new();
    for name in pages {
        let page = root.join(&name);
        let text = without_code_spans(&outside_fences(&read(&page)));
        for target in links(&text) {
            if let Some(fault) = fault(&page, target) {
                wrong.push(format!("{}: {target} {fault}", name.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_summary_lists_every_page_once() {
    let summary = read(&book().join("SUMMARY.md"));
    let listed: Vec<PathBuf> = links(&summary).into_iter().map(PathBuf::from).collect();
    let mut there = pages(&book());
    there.remove(Path::new("SUMMARY.md"));
    let missing: Vec<_> = there.iter().filter(|p| !listed.contains(p)).collect();
    assert!(missing.is_empty(), "not in SUMMARY.md: {missing:?}");
    let mut seen = BTreeSet::new();
    for page in &listed {
        assert!(there.contains(page), "{} is no page", page.display());
        assert!(seen.insert(page), "{} is listed twice", page.display());
    }
}

/// Whether a line is a picture of the book's own with a text for those who do not see it.
fn is_picture(line: &str) -> bool {
    let parts = line
        .strip_prefix("![")
        .and_then(|rest| rest.split_once("]("));
    parts.is_some_and(|(text, target)| !text.is_empty() && !target.contains("://"))
}

#[test]
fn pages_are_short_and_begin_with_a_picture() {
    let mut wrong = Vec::new();
    for name in pages(&book()) {
        let page = read(&book().join(&name));
        let lines = page.lines().count();
        if lines > LINES {
            wrong.push(format!("{}: {lines} lines", name.display()));
        }
        if name != Path::new("SUMMARY.md") && !page.lines().take(TOP).any(is_picture) {
            wrong.push(format!("{}: no picture at the top", name.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_parts_for_users_are_short() {
    let words: usize = FOR_USERS
        .iter()
        .map(|part| book().join(part))
        .flat_map(|part| pages(&part).into_iter().map(move |page| part.join(page)))
        .map(|page| read(&page).split_whitespace().count())
        .sum();
    assert!(words <= WORDS, "{words} words, at most {WORDS}");
}

#[test]
fn links_are_found_outside_of_code() {
    let page = "[a](b.md#c) `[no](x)` ![d](e.webp)\n```sh\n[no](y)\n```\n[f\ng](<h> \"title\")\n[i]: j.md\n``a ` [no](z)``\n";
    let text = without_code_spans(&outside_fences(page));
    assert_eq!(links(&text), ["b.md#c", "e.webp", "<h>", "j.md"]);
    let alone = without_code_spans("a ` b\n\n[c](d) `");
    assert_eq!(links(&alone), ["d"]);
}

#[test]
fn headings_have_the_fragments_of_github_and_mdbook() {
    let page = "# What is in a `.map`\n## 3. Take it, [now](a.md)\n## Ü x_y-z\n## Again\n```\n## no\n```\n## Again\n#no\n";
    let expected = [
        "what-is-in-a-map",
        "3-take-it-now",
        "ü-x_y-z",
        "again",
        "again-1",
    ];
    let expected: BTreeSet<String> = expected.map(str::to_owned).into();
    assert_eq!(fragments(page), expected);
}

#[test]
fn faults_of_links_are_seen() {
    let page = book().join("SUMMARY.md");
    for (target, expected) in [
        ("https://example.org/x#y", None),
        ("README.md", None),
        ("README.md#where-to-go", None),
        ("README.md#nowhere", Some("is no heading")),
        ("#nowhere", Some("is no heading")),
        ("nowhere.md", Some("is no file")),
        ("../../README.md", Some("is not in the book")),
        ("/README.md", Some("is no relative path")),
        ("", Some("is no relative path")),
    ] {
        assert_eq!(fault(&page, target), expected, "{target}");
    }
    assert!(is_picture("![a](b.webp)") && !is_picture("![](b.webp)"));
    assert!(!is_picture("![a](https://example.org/b.webp)"));
}
