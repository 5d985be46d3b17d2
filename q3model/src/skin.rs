//! Skins: text files that give the surfaces of a model their shaders.

/// The entries of a `.skin` file, in file order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Skin {
    /// The entries; those for tags are left out.
    pub surfaces: Vec<SkinSurface>,
}

/// One entry.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SkinSurface {
    /// Surface name, lower case.
    pub surface: String,
    /// Shader name as written; may be empty.
    pub shader: String,
}

impl Skin {
    /// Reads a skin: pairs of surface and shader, separated by a comma. Never fails: what is no pair
    /// ends up in a name that no surface has. Bytes that are not UTF-8 are replaced.
    pub fn parse(text: &[u8]) -> Skin {
        let end = text.iter().position(|&b| b == 0).unwrap_or(text.len());
        let mut tokens = Tokens {
            text: text.get(..end).unwrap_or(text),
        };
        let mut surfaces = Vec::new();
        while let Some(surface) = tokens.next().filter(|token| !token.is_empty()) {
            let surface = surface.to_ascii_lowercase();
            tokens.skip_comma();
            if surface.contains("tag_") {
                continue;
            }
            // The last line may name no shader.
            let shader = tokens.next().unwrap_or_default();
            surfaces.push(SkinSurface { surface, shader });
        }
        Skin { surfaces }
    }

    /// The shader of a surface, whose name must be lower case as [`crate::Surface::name`] is.
    pub fn shader_for(&self, surface: &str) -> Option<&str> {
        let entry = self
            .surfaces
            .iter()
            .find(|entry| entry.surface == surface)?;
        Some(&entry.shader)
    }
}

/// Words separated by white space or commas; comments vanish; quotes keep everything between them.
struct Tokens<'a> {
    text: &'a [u8],
}

impl Tokens<'_> {
    fn skip_space_and_comments(&mut self) {
        loop {
            let rest = match self.text {
                [b'/', b'/', rest @ ..] => {
                    let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
                    rest.get(end..)
                }
                [b'/', b'*', rest @ ..] => {
                    let end = rest.windows(2).position(|pair| pair == b"*/");
                    end.and_then(|end| rest.get(end + 2..))
                }
                // Signed characters: bytes from 0x80 count as white space.
                [byte, rest @ ..] if *byte <= 32 || *byte >= 0x80 => Some(rest),
                _ => return,
            };
            self.text = rest.unwrap_or(&[]);
        }
    }

    fn skip_comma(&mut self) {
        if let [b',', rest @ ..] = self.text {
            self.text = rest;
        }
    }

    fn next(&mut self) -> Option<String> {
        self.skip_space_and_comments();
        let (word, rest) = match self.text {
            [] => return None,
            [b'"', rest @ ..] => {
                let end = rest.iter().position(|&b| b == b'"').unwrap_or(rest.len());
                (rest.get(..end), rest.get(end + 1..))
            }
            text => {
                let ends = |&b: &u8| b <= 32 || b == b',';
                let end = text.iter().position(ends).unwrap_or(text.len());
                (text.get(..end), text.get(end..))
            }
        };
        self.text = rest.unwrap_or(&[]);
        Some(String::from_utf8_lossy(word.unwrap_or(&[])).into_owned())
    }
}
