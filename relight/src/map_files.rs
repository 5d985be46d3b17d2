//! What maps of Quake's formats bring with them, as game files: textures inside the map as pictures, and what their
//! engines did by names and flags as a shader script.

use crate::files::{GameFiles, MemoryFiles};
use crate::image;
use q3bsp::Bsp;
use q3bsp::quake::EmbeddedTexture;
use shaderscript::Sky;

/// Game path of Quake's palette.
const PALETTE: &str = "gfx/palette.lmp";

/// Game path of the script made for a map.
const SCRIPT: &str = "scripts/of_the_map.shader";

/// Quake's sky: half of the picture drifts behind the other half.
const SKY_HOLE: u8 = 0;

/// The files that a map brings with it, and what is odd about them; `None` for formats that have materials in scripts.
/// They belong in front of the game's ([`crate::Overlay`]).
///
/// Pictures that the game has in a file of its own are left to it.
pub fn map_files(bsp: &Bsp, game: &dyn GameFiles) -> Option<(MemoryFiles, Vec<String>)> {
    if !bsp.format.is_quake() {
        return None;
    }
    let mut files = MemoryFiles::new();
    let mut warnings = Vec::new();
    let palette = palette(bsp, game, &mut warnings);
    for texture in &bsp.embedded_textures {
        for (path, width, rgba) in pictures(texture, &palette) {
            let height = texture.height;
            if image::find(game, &path).is_none()
                && files
                    .insert(&format!("{path}.tga"), tga(width, height, &rgba))
                    .is_err()
            {
                warnings.push(format!("texture {:?}: no name for a file", texture.name));
            }
        }
    }
    for sky in bsp.texture_uses.iter().filter_map(|t| t.sky_box.as_ref()) {
        for side in Sky::SIDES {
            let wanted = format!("{sky}_{side}");
            if image::find(game, &wanted).is_some() {
                continue;
            }
            match image::load(game, &format!("{sky}{side}")) {
                Ok(Some((picture, _))) => {
                    let bytes = tga(picture.width, picture.height, &picture.rgba);
                    // Of names that a file cannot have, nothing was found.
                    let _ = files.insert(&format!("{wanted}.tga"), bytes);
                }
                Ok(None) => warnings.push(format!("sky {sky}{side}: no such picture")),
                Err(problem) => warnings.push(problem.to_string()),
            }
        }
    }
    let script = bsp.material_script();
    if !script.is_empty() && files.insert(SCRIPT, script).is_err() {
        warnings.push(format!("{SCRIPT}: no name for a file"));
    }
    warnings.dedup();
    Some((files, warnings))
}

/// The palette of the game, or greys with a warning when some texture needs one.
fn palette(bsp: &Bsp, game: &dyn GameFiles, warnings: &mut Vec<String>) -> Vec<u8> {
    let needed = |t: &EmbeddedTexture| t.indices.is_some() && t.palette.is_none();
    match game.read(PALETTE) {
        Ok(Some(bytes)) if bytes.len() >= 768 => return bytes,
        Ok(Some(bytes)) => warnings.push(format!(
            "{PALETTE}: {} bytes, fewer than the 768 of a palette; textures are grey",
            bytes.len()
        )),
        Ok(None) if bsp.embedded_textures.iter().any(needed) => warnings.push(format!(
            "{PALETTE}: not in the game folders; textures are grey"
        )),
        Ok(None) => {}
        Err(problem) => warnings.push(problem.to_string()),
    }
    (0..=255u8).flat_map(|index| [index; 3]).collect()
}

/// The pictures of a texture: game path, width, RGBA.
fn pictures(texture: &EmbeddedTexture, palette: &[u8]) -> Vec<(String, u32, Vec<u8>)> {
    let Some(rgba) = texture.rgba(palette) else {
        return Vec::new();
    };
    let path = format!("textures/{}", texture.name);
    let mut list = Vec::new();
    if texture.name.starts_with("sky") && texture.palette.is_none() {
        let half = texture.width / 2;
        let part = |front: bool| -> Vec<u8> {
            let indices = texture.indices.iter().flatten();
            let texels = rgba.as_chunks::<4>().0.iter().zip(indices);
            let width = texture.width.max(1) as usize;
            let columns = match front {
                true => 0..half as usize,
                false => half as usize..2 * half as usize,
            };
            texels
                .enumerate()
                .filter(|(at, _)| columns.contains(&(at % width)))
                .flat_map(|(_, (&[r, g, b, _], &index))| {
                    let hole = front && index == SKY_HOLE;
                    [r, g, b, if hole { 0 } else { 255 }]
                })
                .collect()
        };
        if half > 0 {
            list.push((format!("{path}_back"), half, part(false)));
            list.push((format!("{path}_front"), half, part(true)));
        }
    }
    if let Some(glow) = texture.glow(palette) {
        list.push((format!("{path}_glow"), texture.width, glow));
    }
    list.push((path, texture.width, rgba));
    list
}

/// An uncompressed TGA of 32 bits, first row at the top.
fn tga(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    let half = |n: u32| u16::try_from(n).unwrap_or(u16::MAX).to_le_bytes();
    let mut out = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    out.extend(half(width));
    out.extend(half(height));
    out.extend([32, 8]);
    // The engine's reader takes the last row first, whatever the header.
    for row in rgba.chunks_exact((width as usize * 4).max(1)).rev() {
        out.extend(
            row.as_chunks::<4>()
                .0
                .iter()
                .flat_map(|&[r, g, b, a]| [b, g, r, a]),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Materials, Overlay};
    use q3bsp::Format;
    use q3bsp::builder::MapBuilder;
    use shaderscript::ImplicitKind;

    fn texture(name: &str, width: u32, indices: &[u8]) -> EmbeddedTexture {
        EmbeddedTexture {
            name: name.to_owned(),
            width,
            height: indices.len() as u32 / width,
            indices: Some(indices.to_vec()),
            palette: None,
        }
    }

    #[test]
    fn textures_inside_a_map_are_found_as_pictures() {
        let mut bsp = MapBuilder::new().build();
        assert!(map_files(&bsp, &MemoryFiles::new()).is_none());
        bsp.format = Format::Quake;
        bsp.embedded_textures = vec![
            texture("{hole", 2, &[1, 255, 2, 3]),
            texture("sky1", 4, &[0, 7, 8, 9]),
            texture("lamp", 1, &[250]),
        ];
        bsp.texture_uses = vec![q3bsp::quake::TextureUse {
            material: "textures/{hole".to_owned(),
            frames: vec!["textures/{hole".to_owned()],
            holes: true,
            opacity: 1.0,
            ..Default::default()
        }];
        let mut game = MemoryFiles::new();
        let palette: Vec<u8> = (0..=255u8).flat_map(|i| [i, 100, 0]).collect();
        let (_, warnings) = map_files(&bsp, &game).unwrap();
        assert!(warnings[0].contains("palette"), "{warnings:?}");
        game.insert(PALETTE, palette).unwrap();
        let (front, warnings) = map_files(&bsp, &game).unwrap();
        assert_eq!(warnings, Vec::<String>::new());
        let files = Overlay { front, back: game };
        let load = |name: &str| image::load(&files, name).unwrap().unwrap().0;
        let hole = load("textures/{hole");
        assert_eq!((hole.width, hole.height), (2, 2));
        assert_eq!(hole.rgba[..8], [1, 100, 0, 255, 255, 100, 0, 0]);
        assert_eq!(hole.rgba[8..12], [2, 100, 0, 255]);
        assert_eq!(
            load("textures/sky1_front").rgba,
            [0, 100, 0, 0, 7, 100, 0, 255]
        );
        assert_eq!(
            load("textures/sky1_back").rgba,
            [8, 100, 0, 255, 9, 100, 0, 255]
        );
        assert_eq!(load("textures/lamp_glow").rgba, [250, 100, 0, 255]);
        let (materials, problems) = Materials::load(&files);
        assert!(problems.is_empty(), "{problems:?}");
        let resolved = materials.resolve(&files, "textures/{hole", ImplicitKind::Lightmapped);
        assert_eq!(
            (resolved.fault.as_ref(), resolved.shader.stages.len()),
            (None, 2)
        );
    }
}
