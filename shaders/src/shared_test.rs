//! Tests of the writer of shared GLSL: its output, and its errors.

use std::collections::BTreeSet;

use crate::shared::{Module, specialization_constants};

fn glsl(rust: &str) -> Result<String, String> {
    let mut module = Module::default();
    module.read(rust)?;
    let text = module.glsl("types", None, &mut BTreeSet::new())?;
    let body = text.split_once("_block_layout : require\n\n").unwrap().1;
    Ok(body.trim_end_matches("\n#endif\n").to_owned())
}

fn structure(field: &str) -> String {
    format!("pub const N: u32 = 4;\n#[repr(C)]\npub struct S {{\n    {field}\n}}\n")
}

#[test]
fn constants_become_unsigned() {
    assert_eq!(
        glsl("/// Bits.\npub const A: u32 = 0xFFFF_0000;\npub const B: u8 = 12;\n").unwrap(),
        "// Bits.\nconst uint A = 0xFFFF0000u;\nconst uint B = 12u;\n"
    );
}

#[test]
fn members_have_the_counterparts_of_their_types() {
    for (rust, glsl_member) in [
        ("u32", "uint m"),
        ("i32", "int m"),
        ("f32", "float m"),
        ("u64", "uint64_t m"),
        ("Vec2", "vec2 m"),
        ("Vec3", "vec3 m"),
        ("[f32; 4]", "vec4 m"),
        ("[f32; 6]", "float m[6]"),
        ("[[f32; 4]; 3]", "vec4 m[3]"),
        ("[[f32; 6]; N]", "float m[N][6]"),
        ("[Vec3; 3]", "vec3 m[3]"),
        ("[i32; 2]", "int m[2]"),
    ] {
        let text = glsl(&structure(&format!("pub m: {rust},"))).unwrap();
        assert!(text.contains(&format!("    {glsl_member};\n")), "{text}");
    }
}

#[test]
fn structures_stand_after_those_that_they_hold() {
    let text = glsl(
        "#[repr(C)]\npub struct Outer {\n    pub inner: [Inner; 2],\n}\n\
         #[repr(C)]\npub struct Inner {\n    pub m: u32,\n}\n",
    )
    .unwrap();
    let place = |name: &str| text.find(name).unwrap();
    assert!(place("struct Inner {") < place("struct Outer {"), "{text}");
}

#[test]
fn what_glsl_cannot_have_is_an_error() {
    for field in [
        "pub m: bool,",
        "pub m: Unknown,",
        "pub m: S,",
        "pub m: [u32; UNKNOWN],",
        "pub m: (u32, u32),",
        "m: u32,",
        "pub m:",
    ] {
        assert!(glsl(&structure(field)).is_err(), "{field}");
    }
    for text in [
        "pub struct S {\n    pub m: u32,\n}\n",
        "#[repr(C)]\npub struct S {\n    pub m: u32,\n",
        "#[repr(C)]\npub struct S(u32);\n",
        "pub const A: u64 = 1;\n",
        "pub const A: u32 = 1 << 3;\n",
        "pub const A: u32 = 0x1_0000_0000;\n",
        "pub const A: u32 =\n    1;\n",
    ] {
        assert!(glsl(text).is_err(), "{text}");
    }
}

#[test]
fn specialization_constants_are_found_by_name_and_id() {
    let text = "// constant_id\nlayout(constant_id = 0) const uint A = 0; // B\n\
                layout(constant_id = 12) const uint C_D = 0xF;\n";
    assert_eq!(
        specialization_constants(text).unwrap(),
        [("A".to_owned(), 0), ("C_D".to_owned(), 12)]
    );
    for text in [
        "layout(constant_id = N) const uint A = 0;",
        "layout(constant_id=1) const uint A = 0;",
        "layout(constant_id = 1)",
    ] {
        assert!(specialization_constants(text).is_err(), "{text}");
    }
}
