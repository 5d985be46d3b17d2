//! The text of a `.map` file, the source that editors write and compilers read: entities with their keys, and the
//! geometry of each as a hash.
//!
//! Brushes (plain, Valve 220, `brushDef`, `brushDef3`) and patches (`patchDef2`, `patchDef3`) are not read, only compared.
//! Words are those of q3map2: white space ends a word, a brace separates only if it stands alone, and `//`, `#` or `;`
//! begin a comment where a word could begin.

use std::hash::{DefaultHasher, Hasher};

use crate::Entity;

/// An entity of a `.map` file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MapEntity {
    /// Its keys and values.
    pub entity: Entity,
    /// Number of its brushes and patches.
    pub brushes: u32,
    /// Hash of their words, in order; comments and white space do not count.
    pub geometry: u64,
}

/// What a text is not complete for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct MapTextError {
    /// Line, from 1.
    pub line: usize,
    /// What is wrong there.
    pub what: &'static str,
}

/// Reads a `.map` file.
///
/// # Errors
/// A brace or a quotation mark has no partner, as in a file that is not written to its end, or a word is at no place of
/// an entity.
pub fn parse(text: &[u8]) -> Result<Vec<MapEntity>, MapTextError> {
    let mut words = Words {
        text,
        at: 0,
        line: 1,
    };
    let mut entities = Vec::new();
    while let Some(word) = words.next()? {
        match word {
            Word::Plain(b"{") => entities.push(entity(&mut words)?),
            _ => return Err(words.error("an entity begins with {")),
        }
    }
    Ok(entities)
}

/// An entity, after its opening brace.
fn entity(words: &mut Words<'_>) -> Result<MapEntity, MapTextError> {
    let mut found = MapEntity::default();
    let mut geometry = DefaultHasher::new();
    loop {
        let key = match words.next()? {
            None => return Err(words.error("the file ends inside of an entity")),
            Some(Word::Plain(b"}")) => break,
            Some(Word::Plain(b"{")) => {
                brush(words, &mut geometry)?;
                found.brushes += 1;
                continue;
            }
            Some(Word::Plain(key) | Word::Quoted(key)) => key,
        };
        match words.next()? {
            Some(Word::Plain(b"{" | b"}")) | None => {
                return Err(words.error("a key has no value"));
            }
            Some(Word::Plain(value) | Word::Quoted(value)) => {
                let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
                found.entity.pairs.push((text(key), text(value)));
            }
        }
    }
    found.geometry = match found.brushes {
        0 => 0,
        _ => geometry.finish(),
    };
    Ok(found)
}

/// A brush or patch, after its opening brace.
fn brush(words: &mut Words<'_>, hash: &mut DefaultHasher) -> Result<(), MapTextError> {
    let mut depth = 1_u32;
    hash.write_u8(b'{');
    while depth > 0 {
        let (kind, bytes) = match words.next()? {
            None => return Err(words.error("the file ends inside of a brush")),
            Some(Word::Plain(bytes)) => {
                match bytes {
                    b"{" => depth = depth.saturating_add(1),
                    b"}" => depth -= 1,
                    _ => {}
                }
                (0, bytes)
            }
            Some(Word::Quoted(bytes)) => (1, bytes),
        };
        hash.write_u8(kind);
        hash.write(bytes);
        // no byte of UTF-8
        hash.write_u8(0xff);
    }
    Ok(())
}

enum Word<'a> {
    Plain(&'a [u8]),
    Quoted(&'a [u8]),
}

struct Words<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Words<'a> {
    fn error(&self, what: &'static str) -> MapTextError {
        MapTextError {
            line: self.line,
            what,
        }
    }

    fn rest(&self) -> &'a [u8] {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// Takes bytes while they fit, counting lines.
    fn take(&mut self, fits: impl Fn(u8) -> bool) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().position(|b| !fits(*b)).unwrap_or(rest.len());
        let taken = rest.get(..length).unwrap_or_default();
        self.line += taken.iter().filter(|b| **b == b'\n').count();
        self.at += length;
        taken
    }

    fn skip_space_and_comments(&mut self) -> Result<(), MapTextError> {
        loop {
            self.take(|b| b <= b' ');
            let rest = self.rest();
            if rest.starts_with(b"//") || matches!(rest.first(), Some(b'#' | b';')) {
                self.take(|b| b != b'\n');
            } else if rest.starts_with(b"/*") {
                let length = rest.windows(2).skip(2).position(|pair| pair == b"*/");
                let length = length.ok_or(self.error("a comment is not closed"))? + 4;
                let comment = rest.get(..length).unwrap_or_default();
                self.line += comment.iter().filter(|b| **b == b'\n').count();
                self.at += length;
            } else {
                return Ok(());
            }
        }
    }

    fn next(&mut self) -> Result<Option<Word<'a>>, MapTextError> {
        self.skip_space_and_comments()?;
        match self.rest().first() {
            None => Ok(None),
            Some(b'"') => {
                self.at += 1;
                let word = self.take(|b| b != b'"');
                if self.rest().is_empty() {
                    return Err(self.error("a quotation mark is not closed"));
                }
                self.at += 1;
                Ok(Some(Word::Quoted(word)))
            }
            Some(_) => Ok(Some(Word::Plain(self.take(|b| b > b' ' && b != b';')))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A brush of each kind of syntax.
    const BRUSHES: [&str; 5] = [
        "( 0 0 0 ) ( 1 0 0 ) ( 0 1 0 ) base/wall 0 0 0 0.5 0.5 0 0 0\n( 0 0 8 ) ( 0 1 8 ) ( 1 0 8 ) common/caulk 0 0 0 1 1 0 0 0\n",
        "( 0 0 0 ) ( 1 0 0 ) ( 0 1 0 ) {grate [ 1 0 0 0 ] [ 0 -1 0 0 ] 0 1 1\n",
        "brushDef\n{\n( 0 0 0 ) ( 1 0 0 ) ( 0 1 0 ) ( ( 1 0 0 ) ( 0 1 0 ) ) base/wall 0 0 0\n}\n",
        "brushDef3\n{\n( 0 0 1 -8 ) ( ( 1 0 0 ) ( 0 1 0 ) ) \"base/wall\" 0 0 0\n}\n",
        "patchDef2\n{\nbase/pipe\n( 3 3 0 0 0 )\n(\n( ( 0 0 0 0 0 ) ( 0 8 0 0 0 ) ( 8 8 0 0 0 ) )\n)\n}\n",
    ];

    fn map(brushes: &[&str], lights: &str) -> String {
        let mut text = String::from("// Game: Quake 3\n{\n\"classname\" \"worldspawn\"\n");
        for (number, brush) in brushes.iter().enumerate() {
            text += &format!("// brush {number}\n{{\n{brush}}}\n");
        }
        format!("{text}}}\n{lights}")
    }

    fn read(text: &str) -> Vec<MapEntity> {
        parse(text.as_bytes()).unwrap()
    }

    #[test]
    fn entities_are_read_and_brushes_counted() {
        let lights = "// entity 1\n{ classname light // here\n\"origin\" \"1 2 3\" }\n";
        for brush in BRUSHES {
            let entities = read(&map(&[brush, brush], lights));
            assert_eq!(entities.len(), 2, "{brush}");
            assert_eq!(entities[0].brushes, 2);
            assert_eq!(entities[0].entity.classname(), "worldspawn");
            assert_eq!(entities[0].entity.pairs.len(), 1);
            assert_eq!((entities[1].brushes, entities[1].geometry), (0, 0));
            assert_eq!(entities[1].entity.get("origin"), Some("1 2 3"));
        }
    }

    #[test]
    fn only_words_of_brushes_change_the_hash_of_geometry() {
        let plain = read(&map(&BRUSHES, ""))[0].geometry;
        let keys = map(&BRUSHES, "{ \"classname\" \"light\" }").replace(
            "\"worldspawn\"",
            "\"worldspawn\"\n\"ambient\" \"10\"\n\"message\" \"a } brush {\"",
        );
        assert_eq!(read(&keys)[0].geometry, plain);
        let spaced = map(&BRUSHES, "")
            .replace('\n', "\r\n  ")
            .replace("// brush", "// Brush");
        assert_eq!(read(&spaced)[0].geometry, plain);
        for brush in BRUSHES {
            let changed = map(&BRUSHES, "").replace(brush, &brush.replacen('8', "9", 1));
            let changed = match changed == map(&BRUSHES, "") {
                true => map(&BRUSHES, "").replace(brush, &brush.replacen("0 0 0", "0 0 1", 1)),
                false => changed,
            };
            assert_ne!(read(&changed)[0].geometry, plain, "{brush}");
        }
        let mut other = BRUSHES;
        other.swap(0, 4);
        assert_ne!(read(&map(&other, ""))[0].geometry, plain);
        // a word that is split differently is another
        let joined = map(&["a bc\n"], "");
        assert_ne!(
            read(&joined)[0].geometry,
            read(&map(&["ab c\n"], ""))[0].geometry
        );
    }

    #[test]
    fn a_text_that_ends_early_is_an_error_with_its_line() {
        let whole = map(&BRUSHES, "{\n\"classname\" \"light\"\n}\n");
        let first = whole.find('{').unwrap();
        let second = whole.rfind('{').unwrap();
        let end_of_all = whole.rfind('}').unwrap() + 1;
        for end in first + 1..=whole.len() {
            // between entities nothing is missing that could be known
            let complete = end == second || end == second - 1 || end >= end_of_all;
            let read = parse(&whole.as_bytes()[..end]);
            assert_eq!(read.is_ok(), complete, "{end}: {read:?}");
        }
        for (text, line, what) in [
            ("x", 1, "an entity begins with {"),
            ("{\n}\n}", 3, "an entity begins with {"),
            ("{\n\"a\" }", 2, "a key has no value"),
            ("{\n\"a\" \"b\n", 3, "a quotation mark is not closed"),
            ("/* x", 1, "a comment is not closed"),
            ("{ { { }", 1, "the file ends inside of a brush"),
        ] {
            let error = parse(text.as_bytes()).unwrap_err();
            assert_eq!(error, MapTextError { line, what }, "{text}");
        }
    }

    #[test]
    fn any_bytes_are_read_without_a_panic() {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        let parts: [&[u8]; 12] = [
            b"{",
            b"}",
            b"\"",
            b" ",
            b"\n",
            b"//",
            b"/*",
            b"*/",
            b"patchDef2",
            b"(",
            b"\xff\0",
            b";",
        ];
        for _ in 0..4000 {
            let length = next() % 40;
            let text: Vec<u8> = (0..length)
                .flat_map(|_| parts[(next() % 12) as usize].to_vec())
                .collect();
            if let Ok(entities) = parse(&text) {
                let opened = text.iter().filter(|b| **b == b'{').count();
                assert!(entities.len() <= opened);
            }
        }
        // nesting is no recursion
        let deep = [b"{ ".repeat(100_000), b"} ".repeat(100_000)].concat();
        assert_eq!(parse(&deep).unwrap()[0].brushes, 1);
    }
}
