//! The structures and constants that GLSL and Rust share must be the same on both sides: member names and offsets are
//! read out of the compiled SPIR-V and compared with what the Rust compiler made.

use std::collections::{BTreeMap, BTreeSet};

use rspirv::dr::Operand;
use rspirv::spirv::{Decoration, Op};

/// Structure, size, fields with offsets.
type Layout = (&'static str, usize, &'static [(&'static str, usize)]);

include!(concat!(env!("OUT_DIR"), "/layouts.rs"));

/// A structure of a module: members with offsets, and the array strides that occur for it.
#[derive(Default, Debug)]
struct Found {
    members: BTreeMap<u32, (String, Option<u32>)>,
    strides: BTreeSet<u32>,
}

/// Every structure of a module that has a memory layout, by name.
fn structures(words: &[u32]) -> Vec<(String, Found)> {
    let module = rspirv::dr::load_words(words).expect("the module is valid SPIR-V");
    let mut names: BTreeMap<u32, String> = BTreeMap::new();
    let mut found: BTreeMap<u32, Found> = BTreeMap::new();
    for i in &module.debug_names {
        match (i.class.opcode, &i.operands[..]) {
            (Op::Name, [Operand::IdRef(id), Operand::LiteralString(name)]) => {
                names.insert(*id, name.clone());
            }
            (
                Op::MemberName,
                [
                    Operand::IdRef(id),
                    Operand::LiteralBit32(member),
                    Operand::LiteralString(name),
                ],
            ) => {
                found
                    .entry(*id)
                    .or_default()
                    .members
                    .entry(*member)
                    .or_default()
                    .0 = name.clone();
            }
            _ => {}
        }
    }
    let mut strides = BTreeMap::new();
    for i in &module.annotations {
        match (i.class.opcode, &i.operands[..]) {
            (
                Op::MemberDecorate,
                [
                    Operand::IdRef(id),
                    Operand::LiteralBit32(member),
                    Operand::Decoration(Decoration::Offset),
                    Operand::LiteralBit32(offset),
                ],
            ) => {
                found
                    .entry(*id)
                    .or_default()
                    .members
                    .entry(*member)
                    .or_default()
                    .1 = Some(*offset);
            }
            (
                Op::Decorate,
                [
                    Operand::IdRef(id),
                    Operand::Decoration(Decoration::ArrayStride),
                    Operand::LiteralBit32(stride),
                ],
            ) => {
                strides.insert(*id, *stride);
            }
            _ => {}
        }
    }
    for i in &module.types_global_values {
        if matches!(i.class.opcode, Op::TypeArray | Op::TypeRuntimeArray)
            && let Some(Operand::IdRef(element)) = i.operands.first()
            && let Some(stride) = i.result_id.and_then(|id| strides.get(&id))
            && let Some(structure) = found.get_mut(element)
        {
            structure.strides.insert(*stride);
        }
    }
    found
        .into_iter()
        // Copies of a structure in variables have no offsets.
        .filter(|(_, f)| f.members.values().all(|m| m.1.is_some()))
        .filter_map(|(id, f)| Some((names.get(&id)?.clone(), f)))
        .collect()
}

#[test]
fn structures_have_the_same_layout_in_glsl_and_rust() {
    let mut wrong = Vec::new();
    let mut seen = BTreeSet::new();
    for module in crate::ALL {
        for (name, found) in structures(module.words()) {
            let Some((name, size, fields)) = LAYOUTS.iter().find(|l| l.0 == name) else {
                continue;
            };
            seen.insert(*name);
            let glsl: Vec<(&str, usize)> = found
                .members
                .values()
                .map(|(n, offset)| (n.as_str(), offset.unwrap_or(u32::MAX) as usize))
                .collect();
            if glsl != *fields {
                wrong.push(format!(
                    "{name} in {}:\n  GLSL {glsl:?}\n  Rust {fields:?}",
                    module.name()
                ));
            }
            for stride in found.strides {
                if stride as usize != *size {
                    wrong.push(format!(
                        "{name} in {}: elements of an array lie {stride} bytes apart, Rust's {size}",
                        module.name()
                    ));
                }
            }
        }
    }
    for (name, ..) in LAYOUTS {
        if !seen.contains(name) {
            wrong.push(format!(
                "{name} is in no module: is it named differently in GLSL, or missing in shaders/test/types.comp?"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(
        LAYOUTS.len() >= 12,
        "the table of structures lost its contents"
    );
}

/// `NAME = number` pairs of a source text, of names in capitals.
fn constants(text: &str) -> BTreeMap<String, u64> {
    let code: String = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n");
    let mut result = BTreeMap::new();
    for part in code.split([',', ';', '{', '}']) {
        let Some((left, right)) = part.split_once('=') else {
            continue;
        };
        let name = left
            .trim()
            .trim_end_matches(": u32")
            .trim_end_matches(": u8")
            .rsplit(char::is_whitespace)
            .next()
            .unwrap_or_default();
        let capitals = name.starts_with(|c: char| c.is_ascii_uppercase())
            && name
                .chars()
                .all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_');
        let number = right.trim().replace('_', "");
        let number = number.trim_end_matches(['u', 'U']);
        let value = match number.strip_prefix("0x") {
            Some(hex) => u64::from_str_radix(hex, 16),
            None => number.parse(),
        };
        if let (true, Ok(value)) = (capitals, value) {
            result.insert(name.to_owned(), value);
        }
    }
    result
}

#[test]
fn constants_have_the_same_values_in_glsl_and_rust() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |file: &str| std::fs::read_to_string(root.join(file)).unwrap();
    for (glsl_file, rust_file) in [
        ("common/types.glsl", "src/types.rs"),
        ("trace/types.glsl", "src/trace_types/constants.rs"),
    ] {
        let (glsl, rust) = (constants(&read(glsl_file)), constants(&read(rust_file)));
        assert!(
            glsl.len() > 10,
            "{glsl_file}: only {} constants found",
            glsl.len()
        );
        for (name, value) in &glsl {
            assert_eq!(
                rust.get(name),
                Some(value),
                "{name} of {glsl_file} in {rust_file}"
            );
        }
        for name in rust.keys() {
            assert!(
                glsl.contains_key(name),
                "{name} of {rust_file} is not in {glsl_file}"
            );
        }
    }
}
