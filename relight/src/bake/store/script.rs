//! Scripts of materials that show an image in place of the map's page.

use crate::files::GameFiles;
use crate::materials::Materials;
use crate::materials::light::{BakedLight, baked_light};
use shaderscript::token::{Lexer, Reading, Token};
use shaderscript::{Shader, Stage};

/// The definition of a material without its name, with an image in place of `$lightmap`; of a material without script, what
/// the engine makes of its image.
///
/// The engine shifts pages in a map by the overbright bits and not images, which therefore have the shifted light. `rgbGen
/// identityLighting` then gives the same picture with every `r_overBrightBits`. `nomipmaps` holds for the images of all stages
/// after it: it comes before the stage of the image, last where the order of two stages may be changed. Where stages follow,
/// `nopicmip` keeps the size of the image (`r_picmip` is 1 in ioquake3).
pub(super) fn with_image(
    files: &dyn GameFiles,
    materials: &Materials,
    name: &str,
    image: &str,
) -> String {
    let written = definition(files, materials, name).map(|(shader, tokens)| {
        let light = baked_light(&shader.stages);
        let own = |(stage, light): (&Stage, &Option<BakedLight>)| {
            *light == Some(BakedLight::Main) && stage.tc_mods.is_empty()
        };
        let images: Vec<bool> = shader.stages.iter().zip(&light).map(own).collect();
        replaced(&tokens, &light, &images, image)
    });
    written.unwrap_or_else(|| {
        let name = shaderscript::strip_extension(name);
        format!(
            "{{\n\t{{\n\t\tmap {name}.tga\n\t\trgbGen identityLighting\n\t}}\n\tnomipmaps\n\
             \t{{\n\t\tmap {image}\n\t\tblendFunc GL_DST_COLOR GL_ZERO\n\t\trgbGen identityLighting\n\
             \t\ttcGen lightmap\n\t}}\n}}\n"
        )
    })
}

/// The tokens of a definition from its opening brace to the closing one.
fn definition<'a>(
    files: &dyn GameFiles,
    materials: &'a Materials,
    name: &str,
) -> Option<(&'a Shader, Vec<Token>)> {
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
            return Some((shader, tokens));
        }
    }
    None
}

/// A line of a definition: how many braces are open, and its words.
type Line = (usize, Vec<String>);

/// The definition as text with the image in its stages of the lightmap, and without those of styles, which show places of
/// the former pages. `light`: baked light of each stage; `mains`: whether its image, if it names one, is a page of the main
/// light.
fn replaced(tokens: &[Token], light: &[Option<BakedLight>], mains: &[bool], image: &str) -> String {
    let mut body = Vec::new();
    let mut stages: Vec<Vec<Line>> = Vec::new();
    let mut depth = 0usize;
    for token in tokens {
        match token.text.as_str() {
            "{" => {
                depth += 1;
                if depth == 2 {
                    // where the stage stands
                    body.push((1, Vec::new()));
                    stages.push(Vec::new());
                }
            }
            "}" => depth = depth.saturating_sub(1),
            word => {
                let word = match word.contains(|c: char| c <= ' ') {
                    true => format!("\"{word}\""),
                    false => word.to_owned(),
                };
                let lines = match stages.last_mut() {
                    Some(stage) if depth > 1 => stage,
                    _ => &mut body,
                };
                match lines.last_mut() {
                    Some((_, line)) if !token.starts_line && !line.is_empty() => line.push(word),
                    _ => lines.push((depth, vec![word])),
                }
            }
        }
    }
    let keep: Vec<bool> = (0..stages.len())
        .map(|number| light.get(number) != Some(&Some(BakedLight::Style)))
        .collect();
    let mut kept = keep.iter();
    stages.retain(|_| kept.next() == Some(&true));
    let mains = mains.iter().zip(&keep).filter(|(_, keep)| **keep);
    let mains: Vec<bool> = mains.map(|(main, _)| *main).collect();
    let at = show_image(&mut stages, &mains, image);
    let directive = match at.is_some_and(|at| at + 1 == stages.len()) {
        true => "\tnomipmaps\n",
        false => "\tnopicmip\n",
    };
    let mut text = "{\n".to_owned();
    let (mut stages, mut kept) = (stages.iter().enumerate(), keep.iter());
    for line in &body {
        if !line.1.is_empty() {
            write(&mut text, line);
        } else if kept.next() == Some(&true)
            && let Some((number, stage)) = stages.next()
        {
            if at == Some(number) {
                text += directive;
            }
            text += "\t{\n";
            stage.iter().for_each(|line| write(&mut text, line));
            text += "\t}\n";
        }
    }
    text + "}\n"
}

fn write(text: &mut String, (depth, words): &Line) {
    *text += &"\t".repeat(*depth);
    *text += &words.join(" ");
    text.push('\n');
}

fn is(word: &str, name: &str) -> bool {
    word.eq_ignore_ascii_case(name)
}

/// Whether a line of a stage names the page. `main`: whether an image in its place is one.
fn is_page(line: &[String], main: bool) -> bool {
    match line {
        [keyword, page, ..] => {
            (is(keyword, "map") || is(keyword, "clampMap"))
                && (main || is(page, "$lightmap") || is(page, "*lightmap"))
        }
        _ => false,
    }
}

/// Puts the image into the stages that show the page. Returns the first of them.
///
/// Engines draw the first two stages at once, with the colour of the first, if one multiplies the other and both have the
/// same `rgbGen` and nothing else in particular (`CollapseMultitexture`). That stays: where both are `identity`, both become
/// `identityLighting`. Two passes would darken triangles that compilers left double.
fn show_image(stages: &mut [Vec<Line>], mains: &[bool], image: &str) -> Option<usize> {
    let main = |number: usize| mains.get(number) == Some(&true);
    let shows: Vec<bool> = (stages.iter().enumerate())
        .map(|(number, stage)| stage.iter().any(|(_, line)| is_page(line, main(number))))
        .collect();
    let together = match stages {
        [first, second, ..] => {
            is_plain(first) && is_plain(second) && !blends(first) && multiplies(second)
        }
        _ => false,
    };
    let of_pair = together && shows.iter().take(2).filter(|shows| **shows).count() == 1;
    let at = shows.iter().position(|shows| *shows);
    for (number, (stage, &shows)) in stages.iter_mut().zip(&shows).enumerate() {
        let changes = shows || (of_pair && number < 2);
        if !changes {
            continue;
        }
        let (mut generated, mut placed) = (false, false);
        for (_, line) in stage.iter_mut() {
            placed |= line.first().is_some_and(|word| is(word, "tcGen"));
            if is_page(line, shows && main(number)) {
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
        let mut add = |words: [&str; 2]| stage.push((2, words.map(str::to_owned).to_vec()));
        if shows && !placed {
            add(["tcGen", "lightmap"]);
        }
        if !generated {
            add(["rgbGen", "identityLighting"]);
        }
    }
    match stages {
        [light, texture] if of_pair && at == Some(0) => {
            // a product has no order
            let is_blend = |line: &Line| line.1.first().is_some_and(|word| is(word, "blendFunc"));
            light.extend(texture.iter().filter(|line| is_blend(line)).cloned());
            texture.retain(|line| !is_blend(line));
            stages.swap(0, 1);
            Some(1)
        }
        _ => at,
    }
}

/// The words of a stage's blend function.
fn blend(stage: &[Line]) -> Option<&[String]> {
    let mut lines = stage.iter();
    lines.find_map(|(_, line)| match &line[..] {
        [keyword, kinds @ ..] if is(keyword, "blendFunc") => Some(kinds),
        _ => None,
    })
}

fn blends(stage: &[Line]) -> bool {
    blend(stage).is_some()
}

fn multiplies(stage: &[Line]) -> bool {
    blend(stage).is_some_and(|kinds| match kinds {
        [kind] => is(kind, "filter"),
        [from, to] => {
            (is(from, "GL_DST_COLOR") && is(to, "GL_ZERO"))
                || (is(from, "GL_ZERO") && is(to, "GL_SRC_COLOR"))
        }
        _ => false,
    })
}

/// Whether a stage has an image, coordinates, blending and at most a constant colour.
fn is_plain(stage: &[Line]) -> bool {
    stage.iter().all(|(_, line)| match &line[..] {
        [keyword, kind, ..] if is(keyword, "rgbGen") => {
            is(kind, "identity") || is(kind, "identityLighting")
        }
        [keyword, ..] => ["map", "clampMap", "blendFunc", "tcGen", "tcMod"]
            .iter()
            .any(|known| is(keyword, known)),
        [] => true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;
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
            "{\n\tsurfaceparm nomarks\n\tq3map_surfacelight 200\n\t{\n\t\tmap textures/wall.tga\n\
             \t\trgbGen identityLighting\n\t}\n\tnomipmaps\n\t{\n\t\tmap maps/m/lm_0000.tga\n\
             \t\trgbGen identityLighting\n\t\ttcGen lightmap\n\t\tblendFunc filter\n\t}\n\tcull none\n}\n"
        );
        let shader = parse_script("s", format!("new\n{text}").as_bytes())
            .shaders
            .remove(0);
        assert_eq!(baked_light(&shader.stages), [None, Some(BakedLight::Main)]);
        assert_eq!(shader.surface_params, ["nomarks"]);
    }

    #[test]
    fn stages_that_engines_do_not_join_keep_their_colour() {
        let cut_out = "grate\n{\n{\nmap a.tga\nalphaFunc GE128\ndepthWrite\nrgbGen identity\n}\n\
            {\nmap $lightmap\nblendFunc filter\ndepthFunc equal\n}\n}\n";
        let text = written(cut_out, "grate");
        assert!(text.contains("\t\trgbGen identity\n"), "{text}");
        assert!(
            text.contains("depthFunc equal\n\t\ttcGen lightmap\n\t\trgbGen identityLighting\n")
        );
    }

    #[test]
    fn an_image_that_a_script_names_is_replaced() {
        let script = "wall\n{\n{\nmap maps/m/lm_0003.tga\nrgbGen identity\ntcGen lightmap\n}\n\
            {\nmap textures/wall.tga\nblendFunc filter\nrgbGen identity\n}\n}\n";
        let text = written(script, "wall");
        assert!(!text.contains("lm_0003"), "{text}");
        assert_eq!(text.matches("map maps/m/lm_0000.tga").count(), 1, "{text}");
        assert_eq!(text.matches("tcGen lightmap").count(), 1, "{text}");
        assert!(text.contains("map textures/wall.tga"), "{text}");
    }

    #[test]
    fn stages_of_styles_go() {
        let script = "lamp\n{\n{\nmap $lightmap\n}\n{\nmap a.tga\nblendFunc filter\n}\n\
            {\nmap $lightmap\nblendFunc GL_SRC_ALPHA GL_ONE\nrgbGen wave noise 0.5 1 0 5\n\
            tcMod transform 1 0 0 1 0.5 0\n}\n{\nmap glow.tga\nblendFunc add\n}\n}\n";
        let text = written(script, "lamp");
        assert!(
            !text.contains("noise") && text.contains("glow.tga"),
            "{text}"
        );
        assert_eq!(text.matches("lm_0000").count(), 1);
        assert_eq!(text.matches('{').count(), text.matches('}').count());
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
            [map("textures/floor.tga"), map("maps/m/lm_0000.tga")]
        );
    }
}
