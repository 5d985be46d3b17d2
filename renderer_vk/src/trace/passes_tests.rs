use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::*;

/// `PrimaryHits` as words: `primary hits`.
fn words(name: &str) -> String {
    let mut words = String::new();
    for (i, c) in name.chars().enumerate() {
        if c.is_uppercase() && i > 0 {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}

fn listed(resources: &[Resource]) -> String {
    let names: Vec<String> = resources.iter().map(|r| words(&format!("{r:?}"))).collect();
    names.join(", ")
}

/// Name of a pass's shader.
fn shader_of(row: &Row) -> &'static str {
    match row.shader {
        Shader::Rays(rays) => rays.pipeline.name(),
        Shader::Compute(spirv) => spirv.name(),
    }
}

/// The table of passes as Markdown.
fn markdown() -> String {
    let mut text = String::from(
        "| pass | shader | invocations | reads | writes | what it does |\n|---|---|---|---|---|---|\n",
    );
    for row in TABLE {
        let file = shader_of(row).split(' ').next().unwrap_or_default();
        let mut reads = listed(row.reads);
        if !row.may_read.is_empty() {
            let _ = write!(reads, " ({})", listed(row.may_read));
        }
        let _ = writeln!(
            text,
            "| `{}` | `{}` | {} | {reads} | {} | {} |",
            row.name,
            file.trim_start_matches("trace/"),
            words(&format!("{:?}", row.size)),
            listed(row.writes),
            row.about.trim(),
        );
    }
    text
}

#[test]
fn the_table_of_passes_in_architecture_is_this_one() {
    let (begin, end) = ("<!-- passes -->\n", "<!-- end of passes -->");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../ARCHITECTURE.md");
    let text = std::fs::read_to_string(file).expect("ARCHITECTURE.md");
    let (before, rest) = text.split_once(begin).expect("the mark before the table");
    let (table, after) = rest.split_once(end).expect("the mark behind the table");
    let wanted = markdown();
    if std::env::var_os("RELIGHT_UPDATE").is_some() {
        std::fs::write(file, format!("{before}{begin}{wanted}{end}{after}")).expect("written");
    } else {
        assert_eq!(
            table, wanted,
            "run `RELIGHT_UPDATE=1 cargo test -p renderer_vk --lib table_of_passes`"
        );
    }
}

#[test]
fn everything_read_is_written_by_some_pass() {
    let written: Vec<Resource> = (TABLE.iter().flat_map(|row| row.writes.iter().copied()))
        .chain([
            Resource::Scene,
            Resource::Lights,
            Resource::DrawnHits,
            Resource::HybridSurfaces,
        ])
        .collect();
    for row in TABLE {
        for read in row.reads.iter().chain(row.may_read) {
            assert!(written.contains(read), "{} reads {read:?}", row.name);
        }
        assert!(!row.writes.is_empty(), "{} writes nothing", row.name);
    }
}

#[test]
fn passes_that_share_pipelines_declare_the_same_ones() {
    for row in TABLE {
        let Some(shared) = row.shares.map(Pass::row) else {
            continue;
        };
        let built = |row: &Row| (shader_of(row), row.constants, format!("{:?}", row.switches));
        assert_eq!(built(row), built(shared), "{}", row.name);
        assert!(shared.shares.is_none(), "{}", row.name);
    }
}

#[test]
fn each_ray_counter_has_one_name() {
    let names: BTreeSet<(u32, &str)> = TABLE
        .iter()
        .filter_map(|row| row.counter.map(|counter| (counter, row.name)))
        .collect();
    let counters: Vec<u32> = names.iter().map(|(counter, _)| *counter).collect();
    assert_eq!(counters, (0..COUNTERS as u32).collect::<Vec<_>>());
    assert_eq!(counter_of("trace_suns"), Some(t::COUNT_SUNS as usize));
    assert_eq!(counter_of("trace_composite"), None);
}
