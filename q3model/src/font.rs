//! Pre-rendered fonts: `fonts/fontImage_<points>.dat`.

use crate::Error;
use crate::bytes::{Fields, Region};

/// Glyphs in every font, by byte value.
pub const GLYPHS_PER_FONT: usize = 256;

/// The one size that the engine accepts.
pub const FONT_FILE_BYTES: usize = GLYPHS_PER_FONT * GLYPH_BYTES + 4 + 64;

const GLYPH_BYTES: usize = 80;

/// A font.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FontInfo {
    /// By byte value; always [`GLYPHS_PER_FONT`].
    pub glyphs: Vec<Glyph>,
    /// Factor from the glyphs' pixels to the size asked for.
    pub glyph_scale: f32,
    /// File name stored by the tool that made the font.
    pub name: String,
}

/// One character, sizes in pixels.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Glyph {
    /// Rows.
    pub height: i32,
    /// Distance of its top above the base line.
    pub top: i32,
    /// Distance of its bottom from the base line.
    pub bottom: i32,
    /// Columns.
    pub pitch: i32,
    /// Step to the next character.
    pub x_skip: i32,
    /// Width of its image.
    pub image_width: i32,
    /// Height of its image.
    pub image_height: i32,
    /// Left edge in its texture, 0 to 1.
    pub s: f32,
    /// Upper edge.
    pub t: f32,
    /// Right edge.
    pub s2: f32,
    /// Lower edge.
    pub t2: f32,
    /// Shader of its texture; the file's number for it means nothing and is not kept.
    pub shader: String,
}

impl FontInfo {
    /// Reads a font table.
    ///
    /// # Errors
    /// Any length but [`FONT_FILE_BYTES`].
    pub fn parse(bytes: &[u8]) -> Result<FontInfo, Error> {
        if bytes.len() != FONT_FILE_BYTES {
            return Err(Error::Value {
                what: "length of the font file".to_owned(),
                value: bytes.len() as i64,
                expected: format!("not {FONT_FILE_BYTES}"),
            });
        }
        let file = Region::new(bytes, 0);
        let glyphs = file.records(|| "glyphs".to_owned(), 0, GLYPHS_PER_FONT, GLYPH_BYTES)?;
        let mut rest = Fields::new(bytes.get(glyphs.len()..).unwrap_or(&[]));
        Ok(FontInfo {
            glyphs: glyphs.chunks_exact(GLYPH_BYTES).map(read_glyph).collect(),
            glyph_scale: rest.f32(),
            name: rest.name::<64>(),
        })
    }
}

fn read_glyph(record: &[u8]) -> Glyph {
    let mut f = Fields::new(record);
    let [
        height,
        top,
        bottom,
        pitch,
        x_skip,
        image_width,
        image_height,
    ] = std::array::from_fn(|_| f.i32());
    let [s, t, s2, t2] = std::array::from_fn(|_| f.f32());
    let _handle = f.i32();
    Glyph {
        height,
        top,
        bottom,
        pitch,
        x_skip,
        image_width,
        image_height,
        s,
        t,
        s2,
        t2,
        shader: f.name::<32>(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_where_the_engine_has_them() {
        let mut bytes = vec![0; FONT_FILE_BYTES];
        let a = usize::from(b'A') * GLYPH_BYTES;
        bytes[a + 16] = 9;
        bytes[a + 28..a + 32].copy_from_slice(&0.5f32.to_le_bytes());
        bytes[a + 44] = 77;
        bytes[a + 48..a + 53].copy_from_slice(b"fonts");
        bytes[20480..20484].copy_from_slice(&2.0f32.to_le_bytes());
        bytes[20484] = b'f';
        let font = FontInfo::parse(&bytes).unwrap();
        assert_eq!(bytes.len(), 20548);
        let glyph = &font.glyphs[65];
        assert_eq!(
            (glyph.x_skip, glyph.s, glyph.shader.as_str()),
            (9, 0.5, "fonts")
        );
        assert_eq!((font.glyph_scale, font.name.as_str()), (2.0, "f"));
        assert!(FontInfo::parse(&bytes[1..]).is_err());
    }
}
