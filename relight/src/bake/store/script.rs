//! Scripts of materials that show an image in place of the map's page.

use crate::files::GameFiles;
use crate::materials::Materials;
use shaderscript::token::{Lexer, Reading, Token};

/// The definition of a material without its name, with an image in place of `$lightmap`; of a material without script, what
/// the engine makes of its image.
///
/// The engine shifts pages in a map by the overbright bits and not images, which therefore have the shifted light. `rgbGen
/// identityLighting` in place of `identity` then gives the same picture with every `r_overBrightBits`.
pub(super) fn with_image(
    files: &dyn GameFiles,
    materials: &Materials,
    name: &str,
    image: &str,
) -> String {
    let written = definition(files, materials, name).map(|tokens| replaced(&tokens, image));
    written.unwrap_or_else(|| {
        let name = shaderscript::strip_extension(name);
        format!(
            "{{\n\t{{\n\t\tmap {image}\n\t\ttcGen lightmap\n\t\trgbGen identityLighting\n\t}}\n\
             \t{{\n\t\tmap {name}.tga\n\t\tblendFunc GL_DST_COLOR GL_ZERO\n\t\trgbGen identity\n\t}}\n}}\n"
        )
    })
}

/// The tokens of a definition from its opening brace to the closing one.
fn definition(files: &dyn GameFiles, materials: &Materials, name: &str) -> Option<Vec<Token>> {
    let shader = materials.library().find(name)?;
    let text = files.read(&shader.location.file).ok()??;
    let mut lexer = Lexer::new(&text, Reading::Compressed);
    // the name
    loop {
        let token = lexer.token()?;
        if token.position.line >= shader.location.line && token.is(&shader.name) {
            break;
        }
    }
    let mut tokens = Vec::new();
    let mut depth = 0usize;
    while let Some(token) = lexer.token() {
        match token.text.as_str() {
            "{" => depth += 1,
            "}" => depth = depth.saturating_sub(1),
            _ if depth == 0 => return None,
            _ => {}
        }
        tokens.push(token);
        if depth == 0 {
            return Some(tokens);
        }
    }
    None
}

/// The definition as text with the image in its stages of the lightmap.
fn replaced(tokens: &[Token], image: &str) -> String {
    let mut lines: Vec<(usize, Vec<String>)> = Vec::new();
    let mut depth = 0usize;
    let mut stage = 0;
    for token in tokens {
        match token.text.as_str() {
            "{" => {
                lines.push((depth, vec!["{".to_owned()]));
                depth += 1;
                stage = lines.len();
            }
            "}" => {
                depth = depth.saturating_sub(1);
                if depth == 1 {
                    let of_stage = lines.split_off(stage.min(lines.len()));
                    lines.extend(stage_with(of_stage, image));
                }
                lines.push((depth, vec!["}".to_owned()]));
                // what follows a stage is no part of it
                stage = lines.len();
            }
            word => {
                let word = match word.contains(|c: char| c <= ' ') {
                    true => format!("\"{word}\""),
                    false => word.to_owned(),
                };
                match lines.last_mut() {
                    Some((_, line)) if !token.starts_line && !is_brace(line) => line.push(word),
                    _ => lines.push((depth, vec![word])),
                }
            }
        }
    }
    let mut text = String::new();
    for (depth, line) in lines {
        text += &"\t".repeat(depth);
        text += &line.join(" ");
        text.push('\n');
    }
    text
}

fn is_brace(line: &[String]) -> bool {
    line.first().is_some_and(|word| word == "{" || word == "}")
}

/// Lines of a stage, changed if it shows the page.
fn stage_with(mut lines: Vec<(usize, Vec<String>)>, image: &str) -> Vec<(usize, Vec<String>)> {
    let is = |word: &str, name: &str| word.eq_ignore_ascii_case(name);
    let is_page = |line: &[String]| match line {
        [keyword, page, ..] => {
            (is(keyword, "map") || is(keyword, "clampMap"))
                && (is(page, "$lightmap") || is(page, "*lightmap"))
        }
        _ => false,
    };
    if !lines.iter().any(|(_, line)| is_page(line)) {
        return lines;
    }
    let mut depth = 2;
    let mut generated = false;
    for (at, line) in &mut lines {
        depth = *at;
        if is_page(line) {
            *line = vec!["map".to_owned(), image.to_owned()];
        }
        if let [keyword, kind, ..] = &mut line[..]
            && is(keyword, "rgbGen")
        {
            generated = true;
            if is(kind, "identity") {
                *kind = "identityLighting".to_owned();
            }
        }
    }
    let mut add = |words: [&str; 2]| lines.push((depth, words.map(str::to_owned).to_vec()));
    add(["tcGen", "lightmap"]);
    if !generated {
        add(["rgbGen", "identityLighting"]);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;
    use crate::materials::light::{BakedLight, baked_light};
    use shaderscript::{StageImage, parse_script};

    fn written(script: &str, name: &str) -> String {
        let mut files = MemoryFiles::new();
        files
            .insert("scripts/a.shader", script.as_bytes().to_vec())
            .unwrap();
        let (materials, _) = Materials::load(&files);
        with_image(&files, &materials, name, "maps/m/lm_0000.tga")
    }

    #[test]
    fn a_script_shows_the_image_and_keeps_the_rest() {
        let script = "other\n{\n{\nmap $lightmap\n}\n}\n// a comment\ntextures/Wall\n{\n\tsurfaceparm nomarks // why\n\
            \tq3map_surfacelight 200\n\t{\n\t\tmap $lightmap\n\t\trgbGen identity\n\t}\n\
            \t{ map textures/wall.tga\n\t\tblendFunc filter\n\t\trgbGen identity\n\t}\n\tcull none\n}\n";
        let text = written(script, "textures/wall");
        assert_eq!(
            text,
            "{\n\tsurfaceparm nomarks\n\tq3map_surfacelight 200\n\t{\n\t\tmap maps/m/lm_0000.tga\n\
             \t\trgbGen identityLighting\n\t\ttcGen lightmap\n\t}\n\t{\n\t\tmap textures/wall.tga\n\
             \t\tblendFunc filter\n\t\trgbGen identity\n\t}\n\tcull none\n}\n"
        );
        let shader = parse_script("s", format!("new\n{text}").as_bytes())
            .shaders
            .remove(0);
        assert_eq!(baked_light(&shader.stages)[0], Some(BakedLight::Main));
        assert_eq!(shader.surface_params, ["nomarks"]);
    }

    #[test]
    fn a_material_without_script_is_page_times_image() {
        let text = written("", "textures/floor");
        let shader = parse_script("s", format!("new\n{text}").as_bytes())
            .shaders
            .remove(0);
        let images: Vec<_> = shader.stages.iter().map(|s| s.image.clone()).collect();
        let map = |name: &str| StageImage::Map(name.to_owned());
        assert_eq!(
            images,
            [map("maps/m/lm_0000.tga"), map("textures/floor.tga")]
        );
    }
}
