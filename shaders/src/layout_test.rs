//! Compares the layout of the structures that GLSL and Rust share: member names and offsets from the compiled SPIR-V
//! with those of the Rust compiler. Likewise names and ids of specialization constants.

use std::collections::{BTreeMap, BTreeSet};

use rspirv::dr::Operand;
use rspirv::spirv::{Decoration, Op};

/// Structure, size, fields with offsets.
type Layout = (&'static str, usize, &'static [(&'static str, usize)]);

include!(concat!(env!("OUT_DIR"), "/layouts.rs"));

/// A structure of a module: members with offsets, and their array strides.
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

/// Name and id of each specialization constant of a module.
fn specialization_constants(words: &[u32]) -> Vec<(String, u32)> {
    let module = rspirv::dr::load_words(words).expect("the module is valid SPIR-V");
    let names: BTreeMap<u32, &String> = module
        .debug_names
        .iter()
        .filter_map(|i| match (i.class.opcode, &i.operands[..]) {
            (Op::Name, [Operand::IdRef(id), Operand::LiteralString(name)]) => Some((*id, name)),
            _ => None,
        })
        .collect();
    module
        .annotations
        .iter()
        .filter_map(|i| match &i.operands[..] {
            [
                Operand::IdRef(id),
                Operand::Decoration(Decoration::SpecId),
                Operand::LiteralBit32(number),
            ] => Some((names.get(id)?.to_string(), *number)),
            _ => None,
        })
        .collect()
}

#[test]
fn specialization_constants_have_the_ids_that_rust_has() {
    let mut seen = BTreeSet::new();
    for module in crate::ALL {
        let mut taken = BTreeSet::new();
        for (name, id) in specialization_constants(module.words()) {
            assert!(
                crate::constant_ids::ALL.contains(&(name.as_str(), id)),
                "{name} has id {id} in {}, which Rust has not",
                module.name()
            );
            assert!(
                taken.insert(id),
                "two constants have id {id} in {}",
                module.name()
            );
            seen.insert((name, id));
        }
    }
    for (name, id) in crate::constant_ids::ALL {
        assert!(
            seen.contains(&((*name).to_owned(), *id)),
            "{name} with id {id} is in no module"
        );
    }
    assert!(!seen.is_empty());
}
