//! The textures inside a map, and how the map uses textures.

use super::QuakeMap;
use crate::bytes::Fields;
use crate::error::{Lump, Warning};
use crate::format::Format;

/// Most texels of one embedded texture; a hostile header could name any.
const MAX_TEXELS: usize = 1 << 26;

/// First palette entry that Quake shows at full brightness whatever light falls on it.
const FIRST_FULLBRIGHT: u8 = 224;

/// Palette entry that is a hole in textures whose names begin with `{`.
const HOLE: u8 = 255;

/// Flags of [`super::Texinfo::flags`] in Quake II that say how a face is drawn.
pub mod quake2_flags {
    /// Emits [`super::super::Texinfo::value`].
    pub const LIGHT: u32 = 0x1;
    /// Low friction.
    pub const SLICK: u32 = 0x2;
    /// Sky.
    pub const SKY: u32 = 0x4;
    /// Waves like a liquid; has no lightmap.
    pub const WARP: u32 = 0x8;
    /// Covers a third of what is behind.
    pub const TRANS33: u32 = 0x10;
    /// Covers two thirds of what is behind.
    pub const TRANS66: u32 = 0x20;
    /// The texture flows.
    pub const FLOWING: u32 = 0x40;
    /// Not drawn.
    pub const NODRAW: u32 = 0x80;
}

/// A texture with a palette index per texel, from inside a map.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EmbeddedTexture {
    /// Name as stored, lower case.
    pub name: String,
    /// Width, texels.
    pub width: u32,
    /// Height, texels.
    pub height: u32,
    /// `width × height` palette indices, first row first; `None` when the map only names the texture.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub indices: Option<Vec<u8>>,
    /// The texture's own palette, 256 × RGB; `None` in Quake, where the game has one.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub palette: Option<Vec<u8>>,
}

impl EmbeddedTexture {
    /// The texture as RGBA under a palette of 256 × RGB (its own has precedence). Names that begin with `{` have
    /// holes. `None` without a picture.
    pub fn rgba(&self, palette: &[u8]) -> Option<Vec<u8>> {
        let holes = self.name.starts_with('{');
        self.map(
            palette,
            |index| {
                if holes && index == HOLE { 0 } else { 255 }
            },
        )
    }

    /// What glows by itself, as RGBA on black, in Quake's palette: `None` when nothing does.
    pub fn glow(&self, palette: &[u8]) -> Option<Vec<u8>> {
        if !self.glows() {
            return None;
        }
        let mut rgba = self.map(
            palette,
            |index| if index >= FIRST_FULLBRIGHT { 255 } else { 0 },
        )?;
        for [r, g, b, a] in rgba.as_chunks_mut::<4>().0 {
            if *a == 0 {
                [*r, *g, *b] = [0; 3];
            }
            *a = 255;
        }
        Some(rgba)
    }

    /// Whether some texel glows by itself: never with a palette of its own.
    pub fn glows(&self) -> bool {
        let hole = self.name.starts_with('{').then_some(HOLE);
        let glows = |&index: &u8| index >= FIRST_FULLBRIGHT && Some(index) != hole;
        self.palette.is_none() && self.indices.as_ref().is_some_and(|i| i.iter().any(glows))
    }

    fn map(&self, palette: &[u8], alpha: impl Fn(u8) -> u8) -> Option<Vec<u8>> {
        let palette = self.palette.as_deref().unwrap_or(palette);
        let entries = palette.as_chunks::<3>().0;
        let texel = |&index: &u8| {
            let [r, g, b] = entries
                .get(usize::from(index))
                .copied()
                .unwrap_or([index; 3]);
            [r, g, b, alpha(index)]
        };
        Some(self.indices.as_ref()?.iter().flat_map(texel).collect())
    }
}

/// A material of a converted map: a texture together with the way it is drawn, which Quake's formats encode in the
/// first letter of its name and Quake II in flags.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TextureUse {
    /// Name of the material, as in [`crate::ShaderRef::name`].
    pub material: String,
    /// Game paths of the pictures without extension: one, or those of an animation.
    pub frames: Vec<String>,
    /// Pictures of an animation per second.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub rate: f32,
    /// Sky in two layers that drift: the pictures are the back and the front one.
    pub layered_sky: bool,
    /// Sky of six pictures: game path of the box, to which `_rt` and so on are appended.
    pub sky_box: Option<String>,
    /// Lit by itself and waving: a liquid or a teleporter.
    pub warps: bool,
    /// Has holes where alpha is 0.
    pub holes: bool,
    /// Part that it covers of what is behind: 1 for an opaque one.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub opacity: f32,
    /// Repetitions of the texture per second that it flows by.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub flow: f32,
    /// Light that the map's compiler took it to emit, in the compiler's units; 0 for none.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub light: f32,
    /// Picture of what glows, added after light.
    pub glow: Option<String>,
    /// Words of `surfaceparm` that say what it is.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "known_parameters"))]
    pub parameters: Vec<&'static str>,
}

/// The words that conversion uses for [`TextureUse::parameters`]; another one is an error.
#[cfg(feature = "serde")]
fn known_parameters<'de, D: serde::Deserializer<'de>>(
    from: D,
) -> Result<Vec<&'static str>, D::Error> {
    use serde::{Deserialize, de::Error};
    const KNOWN: &[&str] = &["sky", "nolightmap", "trans", "water", "lava", "slime"];
    let words = Vec::<String>::deserialize(from)?;
    let known = |word: &String| {
        let found = KNOWN.iter().copied().find(|known| known == word);
        found.ok_or_else(|| D::Error::unknown_variant(word, KNOWN))
    };
    words.iter().map(known).collect()
}

/// A texture name of 16 or 32 bytes as text, lower case.
pub(super) fn name_of(raw: &[u8]) -> String {
    let end = raw.iter().position(|&b| b == 0).unwrap_or(raw.len());
    let name = String::from_utf8_lossy(raw.get(..end).unwrap_or(raw));
    name.to_ascii_lowercase()
}

impl QuakeMap {
    /// The textures in the file, under the indices that texinfos use; what is missing or damaged is `None`, and the
    /// latter a warning.
    pub(super) fn embedded_textures(&self) -> (Vec<Option<EmbeddedTexture>>, Vec<Warning>) {
        let mut warnings = Vec::new();
        let data = &self.textures;
        let Some((count, offsets)) = data.split_first_chunk::<4>() else {
            return (Vec::new(), warnings);
        };
        let count = usize::try_from(i32::from_le_bytes(*count)).unwrap_or(0);
        let offsets = offsets.as_chunks::<4>().0.iter().take(count);
        // Textures do not share texels, or a small file could ask for any amount of memory.
        let mut left = data.len();
        let textures = offsets
            .enumerate()
            .map(|(element, offset)| {
                let offset = i32::from_le_bytes(*offset);
                // -1 is a texture that the compiler did not find.
                let start = usize::try_from(offset).ok()?;
                let texture = data.get(start..).and_then(|d| self.embedded_texture(d));
                let texture = texture.filter(|texture| {
                    let texels = texture.indices.as_ref().map_or(0, Vec::len);
                    let fits = texels <= left;
                    left = left.saturating_sub(texels);
                    fits
                });
                if texture.is_none() {
                    warnings.push(Warning {
                        lump: Lump::Textures,
                        element: Some(element),
                        field: "offset".into(),
                        value: i64::from(offset),
                        action: "no texture is there; taken as missing".into(),
                    });
                }
                texture
            })
            .collect();
        (textures, warnings)
    }

    fn embedded_texture(&self, data: &[u8]) -> Option<EmbeddedTexture> {
        let mut fields = Fields::new(data.get(..40)?);
        let name = name_of(&fields.bytes::<16>());
        let (width, height) = (fields.u32(), fields.u32());
        let offsets: [u32; 4] = std::array::from_fn(|_| fields.u32());
        let size = usize::try_from(u64::from(width) * u64::from(height)).ok()?;
        if size == 0 || size > MAX_TEXELS {
            return None;
        }
        let at = |offset: u32, length: usize| {
            let start = usize::try_from(offset).ok()?;
            data.get(start..start.checked_add(length)?)
        };
        let indices = match offsets[0] {
            0 => None,
            offset => Some(at(offset, size)?.to_vec()),
        };
        let palette = match self.format {
            Format::GoldSrc if offsets[3] != 0 => {
                // Behind the smallest picture, after the number of entries.
                let smallest = usize::try_from((width / 8) * (height / 8)).ok()?;
                at(offsets[3], smallest + 2 + 768).and_then(|d| d.get(smallest + 2..))
            }
            _ => None,
        };
        Some(EmbeddedTexture {
            name,
            width,
            height,
            indices,
            palette: palette.map(<[u8]>::to_vec),
        })
    }
}
