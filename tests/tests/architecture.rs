//! The arrows between crates and modules: a crate uses those that ARCHITECTURE.md's table allows, and no modules at the top
//! of a crate use each other in a circle. Unsafe code is where its rule says.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

type Uses = BTreeMap<String, BTreeSet<String>>;

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The crates of the workspace.
fn members() -> Vec<String> {
    let manifest = read(&tests::data::repository().join("Cargo.toml"));
    let line = manifest.lines().find(|l| l.starts_with("members"));
    let names = line.expect("members").split('"').skip(1).step_by(2);
    names.map(str::to_owned).collect()
}

/// Rows of ARCHITECTURE.md's table of crates: name, and those in its last column.
fn table() -> Vec<(String, BTreeSet<String>)> {
    let page = read(&tests::data::repository().join("ARCHITECTURE.md"));
    let quoted = |cell: &str| -> Vec<String> {
        let names = cell.split('`').skip(1).step_by(2);
        names.map(|n| n.trim_end_matches('/').to_owned()).collect()
    };
    let rows = page
        .lines()
        .skip_while(|line| !line.starts_with("| crate | holds | may use |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
        let [name, _, uses] = cells[..] else {
            panic!("three cells: {row}")
        };
        let name = quoted(name).into_iter().next().expect("a crate's name");
        (name, quoted(uses).into_iter().collect())
    })
    .collect()
}

#[test]
fn crates_use_those_that_the_table_allows_and_none_above() {
    let (members, table) = (members(), table());
    let named: Vec<&String> = table.iter().map(|(name, _)| name).collect();
    for member in &members {
        assert!(named.contains(&member), "{member} has no row");
    }
    for (row, (name, allowed)) in table.iter().enumerate() {
        for other in allowed {
            let at = named.iter().position(|n| *n == other);
            assert!(
                at.is_some_and(|at| at < row),
                "{name}: {other} is not above"
            );
        }
        let manifest = read(&tests::data::repository().join(name).join("Cargo.toml"));
        let used: BTreeSet<String> = manifest
            .lines()
            .skip_while(|line| line.trim() != "[dependencies]")
            .skip(1)
            .take_while(|line| !line.starts_with('['))
            .filter_map(|line| line.split(['.', ' ', '=']).next())
            .filter_map(|dependency| {
                let folder = |m: &&String| m.rsplit('/').next() == Some(dependency);
                members.iter().find(folder).cloned()
            })
            .collect();
        assert_eq!(&used, allowed, "{name}: Cargo.toml and the table");
    }
}

/// Source files of a crate, without its tests.
fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        if name == "tests" || name == "bin" {
            continue;
        }
        if path.is_dir() {
            sources(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

/// A source without comments and without the tests at its end.
fn code(path: &Path) -> String {
    let text = read(path);
    let product = text.split("#[cfg(test)]\nmod tests").next();
    let lines = product.unwrap_or_default().lines();
    let bare = lines.map(|line| line.split("//").next().unwrap_or_default());
    bare.collect::<Vec<_>>().join("\n")
}

/// Names that follow `prefix` in a source, those of a group in braces each.
fn names_after(code: &str, prefix: &str) -> Vec<String> {
    let word = |text: &str| -> String {
        let letters = text.trim_start().chars();
        letters
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect()
    };
    let mut names = Vec::new();
    for (at, _) in code.match_indices(prefix) {
        let rest = &code[at + prefix.len()..];
        let Some(group) = rest.strip_prefix('{') else {
            names.push(word(rest));
            continue;
        };
        let mut depth = 0;
        let mut start = true;
        for (k, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => start = true,
                c if start && depth == 0 && !c.is_whitespace() => {
                    names.push(word(&group[k..]));
                    start = false;
                }
                _ => {}
            }
        }
    }
    names
}

/// Which top-level modules of a crate use which others.
fn uses(member: &str) -> Uses {
    let root = tests::data::repository().join(member).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let module_of = |path: &Path| {
        let inside = path.strip_prefix(&root).expect("a file of the crate");
        let first = inside.components().next().expect("a name");
        let name = first.as_os_str().to_string_lossy();
        name.trim_end_matches(".rs").to_owned()
    };
    let library = root.join("lib.rs");
    let shown_by_root = if library.exists() {
        read(&library)
    } else {
        String::new()
    };
    let for_tests = names_after(&shown_by_root, "#[cfg(test)]\nmod ");
    files.retain(|path| !for_tests.contains(&module_of(path)));
    let modules: BTreeSet<String> = files.iter().map(|path| module_of(path)).collect();
    // What the crate's root shows under its own name belongs to the module that it comes from.
    let mut shown: BTreeMap<String, String> = BTreeMap::new();
    for module in &modules {
        for name in names_after(&shown_by_root, &format!("use {module}::")) {
            shown.insert(name, module.clone());
        }
    }
    let mut uses = Uses::new();
    for path in files {
        let from = module_of(&path);
        if from == "lib" || from == "main" {
            continue;
        }
        for name in names_after(&code(&path), "crate::") {
            let to = modules.get(&name).or_else(|| shown.get(&name));
            if let Some(to) = to.filter(|to| **to != from) {
                uses.entry(from.clone()).or_default().insert(to.clone());
            }
        }
    }
    uses
}

/// Strongly connected components of more than one module.
fn circles(uses: &Uses) -> Vec<BTreeSet<String>> {
    let reached = |from: &String| {
        let mut found = BTreeSet::new();
        let mut next = vec![from];
        while let Some(module) = next.pop() {
            for to in uses.get(module).into_iter().flatten() {
                if found.insert(to.clone()) {
                    next.push(to);
                }
            }
        }
        found
    };
    let reach: BTreeMap<&String, BTreeSet<String>> = uses.keys().map(|m| (m, reached(m))).collect();
    let mut found: Vec<BTreeSet<String>> = Vec::new();
    for (module, there) in &reach {
        let back = |other: &&String| reach.get(other).is_some_and(|r| r.contains(*module));
        let circle: BTreeSet<String> = there.iter().filter(back).cloned().collect();
        if circle.len() > 1 && !found.contains(&circle) {
            found.push(circle);
        }
    }
    found
}

#[test]
fn no_modules_of_a_crate_use_each_other_in_a_circle() {
    for member in members() {
        let found = circles(&uses(&member));
        assert!(found.is_empty(), "{member}: {found:?}");
    }
}

#[test]
fn front_ends_alone_name_engines() {
    const NAMES: [&str; 5] = ["ioq3", "ioquake", "quake3e", "openarena", "tremulous"];
    let root = tests::data::repository().join("ffi/src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    for path in files {
        let inside = path.strip_prefix(&root).expect("a file of the crate");
        let place = inside.to_string_lossy();
        let list = ["lib.rs", "front_ends.rs", "boundary_tests.rs"];
        if list.contains(&&*place) || NAMES.iter().any(|name| place.starts_with(name)) {
            continue;
        }
        let code = code(&path).to_lowercase();
        let named = NAMES.iter().find(|name| code.contains(**name));
        assert_eq!(named, None, "{place}");
    }
}

/// Whether a source has the word `unsafe`, not only as a part of a lint's name.
fn is_unsafe(code: &str) -> bool {
    let part = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    code.match_indices("unsafe").any(|(at, word)| {
        let (before, after) = (&code[..at], &code[at + word.len()..]);
        !part(before.chars().next_back()) && !part(after.chars().next())
    })
}

#[test]
fn unsafe_code_is_in_the_folders_of_its_rule() {
    let page = read(&tests::data::repository().join("ARCHITECTURE.md"));
    let rule = page.split("* **Unsafe** code").nth(1).expect("the rule");
    let rule = rule.split("\n* ").next().expect("its text");
    let folders: Vec<&str> = rule.split('`').skip(1).step_by(2).collect();
    let mut found = BTreeSet::new();
    for member in members() {
        let mut files = Vec::new();
        sources(
            &tests::data::repository().join(&member).join("src"),
            &mut files,
        );
        for path in files.iter().filter(|path| is_unsafe(&code(path))) {
            let place = path.strip_prefix(tests::data::repository());
            let place = place.expect("a file of ours").to_string_lossy();
            let folder = folders.iter().find(|folder| place.starts_with(**folder));
            found.insert(*folder.unwrap_or_else(|| panic!("{place}: unsafe code")));
        }
    }
    assert_eq!(found, folders.into_iter().collect(), "folders without any");
}

#[test]
fn unsafe_is_a_word_not_a_part_of_one() {
    assert!(is_unsafe("let x = unsafe { f() };") && is_unsafe("unsafe\n"));
    assert!(!is_unsafe(
        "#![forbid(unsafe_code)] #![warn(unsafe_op_in_unsafe_fn)]"
    ));
}

#[test]
fn the_test_command_runs_every_program_of_this_crate() {
    let root = tests::data::repository();
    let command = read(&root.join("test"));
    let programs = std::fs::read_dir(root.join("tests/tests")).expect("a folder");
    for program in programs {
        let path = program.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy();
        let runs = command.split_whitespace().collect::<Vec<_>>();
        let named = runs.windows(2).any(|w| w[0] == "--test" && w[1] == name);
        assert!(named, "./test does not run {name}");
    }
}

#[test]
fn names_are_found_alone_and_in_groups() {
    let code = "use crate::one::Two;\nuse crate::{three, four::{five, Six}, seven::Eight};\nlet x = crate::nine::ten();";
    let found = names_after(code, "crate::");
    assert_eq!(found, ["one", "three", "four", "seven", "nine"]);
    let uses: Uses = [("a", "b"), ("b", "c"), ("c", "a"), ("c", "d"), ("d", "e")]
        .into_iter()
        .map(|(from, to)| (from.to_owned(), [to.to_owned()].into()))
        .fold(
            Uses::new(),
            |mut all, (from, to): (String, BTreeSet<String>)| {
                all.entry(from).or_default().extend(to);
                all
            },
        );
    let circle: BTreeSet<String> = ["a", "b", "c"].map(str::to_owned).into();
    assert_eq!(circles(&uses), [circle]);
}
