//! Words of Quake3e's `.shaderx` files, which are unknown in other files.

use shaderscript::{StageImage, TcGen, parse_script};

#[test]
fn extended_scripts() {
    let read = |file, body: &str| {
        let text = format!("name\n{{\n{body}\n}}\n");
        parse_script(file, text.as_bytes()).shaders.remove(0)
    };
    let images = |body: &str| -> Vec<String> {
        let shader = read("a.SHADERX", body);
        assert_eq!(shader.rejected, None, "{body}");
        let names = shader.stages.iter().flat_map(|stage| stage.image.names());
        names.cloned().collect()
    };
    let stages = |branches: [&str; 3]| {
        let stage = |(branch, image)| format!("{branch} {{\nmap {image}\n}}\n");
        branches
            .into_iter()
            .zip(["a", "b", "c"])
            .map(stage)
            .collect::<String>()
    };
    for (branches, expected) in [
        (["if ( 1 )", "else", ""], &["a", "c"][..]),
        (["if ( 0 )", "else", ""], &["b", "c"]),
        (["if (0)", "elif ( 2 > 1 )", "else"], &["b"]),
        (["if (0)", "elif (0)", "else"], &["c"]),
        // the engine's way: after a used `if` and an `elif`, `else` is used
        (["if (1)", "elif (1)", "else"], &["a", "c"]),
    ] {
        assert_eq!(images(&stages(branches)), expected, "{branches:?}");
    }
    let skipped = "if ( 0 )\nsort 3\nif ( 1 ) novlcollapse\n";
    let stage = "{\nscreenMap s\ndlight\ndepthFragment\ntcGen environment firstPerson\n}";
    let shader = read("a.shaderx", &format!("{skipped}{stage}"));
    assert_eq!((shader.rejected, shader.sort), (None, None));
    assert_eq!(shader.stages[0].image, StageImage::Map("s".to_owned()));
    assert_eq!(shader.stages[0].tc_gen, TcGen::Environment);
    for body in [
        "else {\nmap a\n}",
        "if {\nmap a\n}",
        "if ( 1 =1 ) {\nmap a\n}",
        "if ( 1 {\nmap a\n}",
        "{\nscreenMap\n}",
    ] {
        assert!(read("a.shaderx", body).rejected.is_some(), "{body}");
    }
    for word in [
        "if ( 1 )",
        "novlcollapse",
        "{\nscreenMap s\n}",
        "{\nmap a\ndlight\n}",
    ] {
        let body = format!("{word} {{\nmap a\n}}");
        assert!(read("a.shader", &body).rejected.is_some(), "{word}");
    }
}
