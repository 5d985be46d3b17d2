//! Reads the structures and constants that Rust and GLSL share from the Rust sources and writes them as GLSL.
//!
//! The sources are read line by line, in rustfmt's form: one field or constant a line. A public structure or constant
//! in another form, or of a type without a GLSL counterpart, is a build error.

use std::collections::BTreeSet;
use std::fmt::Write as _;

/// A constant of type `u32` or `u8`, `uint` in GLSL.
#[derive(Debug, PartialEq, Eq)]
pub struct Constant {
    pub docs: Vec<String>,
    pub name: String,
    /// The Rust literal.
    pub value: String,
}

/// A `repr(C)` structure, in `scalar` layout in GLSL.
#[derive(Debug, PartialEq, Eq)]
pub struct Structure {
    pub docs: Vec<String>,
    pub name: String,
    pub fields: Vec<Field>,
}

/// A member of a structure.
#[derive(Debug, PartialEq, Eq)]
pub struct Field {
    pub docs: Vec<String>,
    pub name: String,
    /// The Rust type.
    pub kind: String,
}

/// The structures and constants that one Rust module shares with GLSL.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Module {
    pub constants: Vec<Constant>,
    pub structures: Vec<Structure>,
}

impl Module {
    /// Adds the public structures and constants of a source text, in their order.
    ///
    /// # Errors
    /// Line and reason.
    pub fn read(&mut self, text: &str) -> Result<(), String> {
        let mut docs: Vec<String> = Vec::new();
        let mut in_c_layout = false;
        let mut open: Option<Structure> = None;
        for (index, line) in text.lines().enumerate() {
            let line = line.trim();
            let fail = |reason: &str| Err(format!("line {}: {reason}: `{line}`", index + 1));
            if let Some(doc) = line.strip_prefix("///") {
                docs.push(doc.trim().to_owned());
                continue;
            }
            if line.starts_with("#[") {
                in_c_layout |= line == "#[repr(C)]";
                continue;
            }
            if let Some(mut structure) = open.take() {
                if line == "}" {
                    self.structures.push(structure);
                } else {
                    if let Some(field) = line.strip_prefix("pub ") {
                        let Some((name, kind)) = field
                            .strip_suffix(',')
                            .and_then(|field| field.split_once(": "))
                        else {
                            return fail("expected `pub NAME: TYPE,` on one line");
                        };
                        structure.fields.push(Field {
                            docs: std::mem::take(&mut docs),
                            name: name.to_owned(),
                            kind: kind.to_owned(),
                        });
                    } else if !line.is_empty() && !line.starts_with("//") {
                        return fail("a shared structure has public fields only");
                    }
                    open = Some(structure);
                }
            } else if let Some(rest) = line.strip_prefix("pub struct ") {
                let Some(name) = rest.strip_suffix(" {") else {
                    return fail("expected `pub struct NAME {`");
                };
                if !in_c_layout {
                    return fail("a shared structure is `repr(C)`");
                }
                open = Some(Structure {
                    docs: std::mem::take(&mut docs),
                    name: name.to_owned(),
                    fields: Vec::new(),
                });
            } else if let Some(rest) = line.strip_prefix("pub const ") {
                let parts = rest.strip_suffix(';').and_then(|rest| {
                    let (name, rest) = rest.split_once(": ")?;
                    let (kind, value) = rest.split_once(" = ")?;
                    Some((name, kind, value))
                });
                match parts {
                    Some((name, "u32" | "u8", value)) => self.constants.push(Constant {
                        docs: std::mem::take(&mut docs),
                        name: name.to_owned(),
                        value: value.to_owned(),
                    }),
                    // The `usize` copy of a constant for array lengths in Rust; GLSL has the `u32` constant.
                    Some((_, "usize", _)) => {}
                    _ => return fail("expected `pub const NAME: u32 = NUMBER;` on one line"),
                }
            }
            docs.clear();
            in_c_layout = false;
        }
        match open {
            Some(structure) => Err(format!("`{}` has no end", structure.name)),
            None => Ok(()),
        }
    }

    /// The GLSL of this module: an included file named `name` that includes `base` first. `known`: the structures of
    /// that file; this module's are added.
    ///
    /// # Errors
    /// A value that is not an integer literal, or a type without a counterpart.
    pub fn glsl(
        &self,
        name: &str,
        base: Option<&str>,
        known: &mut BTreeSet<String>,
    ) -> Result<String, String> {
        let guard = format!("RELIGHT_GENERATED_{}_GLSL", name.to_ascii_uppercase());
        let mut text = format!(
            "// Written by shaders/build.rs from shaders/src/{name}.rs and shaders/src/{name}/; edits belong there.\n\
             // Everything is laid out `scalar`. Addresses are buffer device addresses.\n\
             #ifndef {guard}\n#define {guard}\n\n"
        );
        match base {
            Some(base) => {
                let _ = writeln!(text, "#include \"{base}\"\n");
            }
            None => text.push_str(
                "#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require\n\
                 #extension GL_EXT_scalar_block_layout : require\n\n",
            ),
        }
        let mut lengths = BTreeSet::new();
        for constant in &self.constants {
            write_docs(&mut text, "", &constant.docs);
            let value = number(&constant.value)
                .ok_or_else(|| format!("{}: `{}` is no literal", constant.name, constant.value))?;
            let _ = writeln!(text, "const uint {} = {value};", constant.name);
            lengths.insert(constant.name.as_str());
        }
        let own: BTreeSet<&str> = self.structures.iter().map(|s| s.name.as_str()).collect();
        // GLSL requires declaration before use: a structure is written once the structures of its members are known.
        let mut left: Vec<&Structure> = self.structures.iter().collect();
        while !left.is_empty() {
            let before = left.len();
            let mut waiting = Vec::new();
            for structure in left {
                let mut members = String::new();
                let mut ready = true;
                for field in &structure.fields {
                    let (base, dimensions) = glsl_type(&field.kind, &lengths)
                        .map_err(|e| format!("{}.{}: {e}", structure.name, field.name))?;
                    let is_basic = BASIC.iter().any(|b| b.1 == base) || base == "vec4";
                    if !is_basic && !known.contains(base) {
                        if !own.contains(base) {
                            return Err(format!(
                                "{}.{}: no GLSL type for `{base}`",
                                structure.name, field.name
                            ));
                        }
                        ready = false;
                    }
                    write_docs(&mut members, "    ", &field.docs);
                    let _ = writeln!(members, "    {base} {}{dimensions};", field.name);
                }
                if ready {
                    text.push('\n');
                    write_docs(&mut text, "", &structure.docs);
                    let _ = writeln!(text, "struct {} {{\n{members}}};", structure.name);
                    known.insert(structure.name.clone());
                } else {
                    waiting.push(structure);
                }
            }
            if waiting.len() == before {
                return Err(format!("`{}` holds itself", waiting[0].name));
            }
            left = waiting;
        }
        text.push_str("\n#endif\n");
        Ok(text)
    }
}

/// Rust types and their counterparts of the same size and alignment in `scalar` layout.
const BASIC: [(&str, &str); 6] = [
    ("u32", "uint"),
    ("i32", "int"),
    ("f32", "float"),
    ("u64", "uint64_t"),
    ("Vec2", "vec2"),
    ("Vec3", "vec3"),
];

/// The GLSL type of a Rust type, and the array dimensions that follow the member's name. `lengths`: constants that may
/// be array lengths.
fn glsl_type<'a>(kind: &'a str, lengths: &BTreeSet<&str>) -> Result<(&'a str, String), String> {
    if kind == "[f32; 4]" {
        return Ok(("vec4", String::new()));
    }
    if let Some(array) = kind.strip_prefix('[') {
        let (element, length) = array
            .strip_suffix(']')
            .and_then(|array| array.rsplit_once("; "))
            .ok_or_else(|| format!("`{kind}` is no array"))?;
        if number(length).is_none() && !lengths.contains(length) {
            return Err(format!(
                "the length `{length}` is neither a number nor a constant that GLSL has"
            ));
        }
        let (base, inner) = glsl_type(element, lengths)?;
        return Ok((base, format!("[{length}]{inner}")));
    }
    match BASIC.iter().find(|b| b.0 == kind) {
        Some((_, glsl)) => Ok((*glsl, String::new())),
        None => Ok((kind, String::new())),
    }
}

/// Converts a Rust integer literal to GLSL.
fn number(literal: &str) -> Option<String> {
    let digits = literal.replace('_', "");
    let value = match digits.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16),
        None => digits.parse(),
    };
    value.ok().map(|_| format!("{digits}u"))
}

/// Documentation as GLSL comments.
fn write_docs(text: &mut String, indent: &str, docs: &[String]) {
    for doc in docs {
        let _ = writeln!(text, "{indent}// {doc}");
    }
}

/// Name and id of the specialization constants that a GLSL file declares.
///
/// # Errors
/// A declaration in another form than `layout(constant_id = ID) const TYPE NAME = VALUE;`.
pub fn specialization_constants(text: &str) -> Result<Vec<(String, u32)>, String> {
    let mut found = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let code = line.split_once("//").map_or(line, |(code, _)| code);
        if !code.contains("constant_id") {
            continue;
        }
        let declaration = code
            .trim()
            .strip_prefix("layout(constant_id = ")
            .and_then(|rest| rest.split_once(") const "))
            .and_then(|(id, rest)| {
                let (declared, _) = rest.split_once(" = ")?;
                let (_, name) = declared.split_once(' ')?;
                Some((name.to_owned(), id.parse().ok()?))
            });
        found.push(declaration.ok_or_else(|| {
            format!(
                "{}: expected `layout(constant_id = ID) const TYPE NAME = VALUE;`",
                index + 1
            )
        })?);
    }
    Ok(found)
}
