//! The feature `serde`: what was serialized is deserialized again.

use shaderscript::{ImplicitKind, Pass, Script, Shader, collapse, parse_script};

#[test]
fn scripts_are_the_same_after_json() {
    let text = "textures/a\n{\n\
        cull none\nsort additive\nq3map_surfacelight 200\nq3map_sun 1 0.5 0.25 100 30 60\n\
        skyParms env/a 512 -\nfogParms ( 0.5 0.25 1 ) 400\ndeformVertexes wave 10 sin 0 1 0.5 2\n\
        { map $lightmap }\n\
        { animMap 4 a b c\nblendFunc add\nalphaFunc GE128\nrgbGen wave noise 0 1 0 1\n\
        tcMod transform 1 2 3 4 5 6\ntcGen vector ( 1 0 0 ) ( 0 1 0 )\nalphaGen portal 512 }\n}\n\
        textures/b { frobnicate 1\n{ map a\nrgbGen nothing\n} }\n";
    let script = parse_script("a.shader", text.as_bytes());
    assert_eq!(script.shaders.len(), 2);
    assert!(!script.diagnostics.is_empty());
    let json = serde_json::to_string(&script).unwrap();
    assert_eq!(serde_json::from_str::<Script>(&json).unwrap(), script);

    let implicit = Shader::implicit("textures/c", ImplicitKind::Lightmapped);
    let passes = collapse(&implicit);
    let json = serde_json::to_string(&(&implicit, &passes)).unwrap();
    let read: (Shader, Vec<Pass>) = serde_json::from_str(&json).unwrap();
    assert_eq!(read, (implicit, passes));
}
