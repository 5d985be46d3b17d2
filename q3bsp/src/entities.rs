//! The entity text: `{ "key" "value" … }`, read more tolerantly than the engine, in linear time.

use crate::Bsp;
use glam::Vec3;

/// Key and value pairs in file order, duplicates included.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Entity {
    /// The pairs; bytes that are not UTF-8 are replaced.
    pub pairs: Vec<(String, String)>,
}

/// Something odd in the entity text and what was made of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EntityWarning {
    /// Line, from 1.
    pub line: usize,
    /// What was found and done.
    pub message: &'static str,
}

impl Entity {
    /// The first value of a key, compared without regard to ASCII case; game code looks keys up this way.
    pub fn get(&self, key: &str) -> Option<&str> {
        let same = |(k, _): &&(String, String)| k.eq_ignore_ascii_case(key);
        self.pairs.iter().find(same).map(|(_, v)| v.as_str())
    }

    /// The last value of a key: what fields that the game fills while reading, and the renderer's
    /// world keys, end up with.
    pub fn last(&self, key: &str) -> Option<&str> {
        let same = |(k, _): &&(String, String)| k.eq_ignore_ascii_case(key);
        self.pairs.iter().rev().find(same).map(|(_, v)| v.as_str())
    }

    /// The first value of a key as three numbers; a number that is missing, malformed or not finite
    /// is 0. `None` without the key.
    pub fn vec3(&self, key: &str) -> Option<Vec3> {
        self.get(key).map(|text| vec3_or(text, Vec3::ZERO))
    }

    /// The first value of a key as a number, read as C's `atof` would: the longest prefix that is one,
    /// else 0. `None` without the key.
    pub fn number(&self, key: &str) -> Option<f32> {
        self.get(key)
            .map(|text| leading_number(text).unwrap_or(0.0))
    }

    /// The `classname`, or an empty string.
    pub fn classname(&self) -> &str {
        self.get("classname").unwrap_or("")
    }

    /// The brush model that a `model "*n"` key names; always a positive number (0 is the world), which
    /// may still be more than the map has.
    pub fn brush_model(&self) -> Option<usize> {
        let digits = self.get("model")?.strip_prefix('*')?;
        digits.parse().ok().filter(|&n| n > 0)
    }
}

impl Bsp {
    /// The entities; the first is the world (`worldspawn`).
    pub fn entities(&self) -> Vec<Entity> {
        parse(&self.entities).0
    }
}

/// Reads entity text up to its first NUL. Braces outside quotes always separate, a missing `}` ends
/// the entity where the next begins or the text ends, a key without a value is left out; each of these
/// is a warning.
pub fn parse(text: &[u8]) -> (Vec<Entity>, Vec<EntityWarning>) {
    let end = text.iter().position(|&b| b == 0).unwrap_or(text.len());
    let mut tokens = Tokens {
        text: text.get(..end).unwrap_or(text),
        at: 0,
        line: 1,
        unterminated: false,
    };
    let mut entities = Vec::new();
    let mut warnings = Vec::new();
    let mut current: Option<Entity> = None;
    let mut key: Option<String> = None;
    while let Some(token) = tokens.next() {
        let mut warn = |message| {
            warnings.push(EntityWarning {
                line: tokens.line,
                message,
            });
        };
        match (token, current.as_mut()) {
            (Token::Open, None) => current = Some(Entity::default()),
            (Token::Open, Some(_)) => {
                warn("an entity begins inside another, which ends here");
                key = None;
                entities.extend(current.replace(Entity::default()));
            }
            (Token::Close, Some(_)) => {
                if key.take().is_some() {
                    warn("a key without a value is left out");
                }
                entities.extend(current.take());
            }
            (Token::Close, None) | (Token::Word(_), None) => warn("skipped, as no entity is open"),
            (Token::Word(word), Some(entity)) => match key.take() {
                None => key = Some(word),
                Some(key) => entity.pairs.push((key, word)),
            },
        }
    }
    let mut warn = |message| {
        warnings.push(EntityWarning {
            line: tokens.line,
            message,
        });
    };
    if tokens.unterminated {
        warn("a quotation mark is not closed");
    }
    if key.is_some() {
        warn("a key without a value is left out");
    }
    if let Some(entity) = current {
        warn("the last entity is not closed");
        entities.push(entity);
    }
    (entities, warnings)
}

/// The text for entities, each pair on its line, ending in NUL: what compilers write. Quotation marks
/// cannot be expressed and become apostrophes.
pub fn write(entities: &[Entity]) -> Vec<u8> {
    let mut out = String::new();
    for entity in entities {
        out.push_str("{\n");
        for (key, value) in &entity.pairs {
            for text in [key, value] {
                out.push('"');
                out.extend(
                    text.chars()
                        .filter(|&c| c != '\0')
                        .map(|c| if c == '"' { '\'' } else { c }),
                );
                out.push_str("\" ");
            }
            out.pop();
            out.push('\n');
        }
        out.push_str("}\n");
    }
    out.push('\0');
    out.into_bytes()
}

enum Token {
    Open,
    Close,
    Word(String),
}

struct Tokens<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
    unterminated: bool,
}

/// The engine compares *signed* characters, so that bytes from 0x80 are white space too.
fn is_space(byte: u8) -> bool {
    byte <= 32 || byte >= 0x80
}

impl Tokens<'_> {
    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    fn starts_with(&self, pattern: &[u8]) -> bool {
        self.text
            .get(self.at..)
            .is_some_and(|rest| rest.starts_with(pattern))
    }

    /// Advances by one byte, counting lines.
    fn bump(&mut self) -> Option<u8> {
        let byte = self.peek()?;
        self.at += 1;
        self.line += usize::from(byte == b'\n');
        Some(byte)
    }

    fn skip_space_and_comments(&mut self) {
        loop {
            if self.starts_with(b"//") {
                while self.peek().is_some_and(|b| b != b'\n') {
                    self.bump();
                }
            } else if self.starts_with(b"/*") {
                self.at += 2;
                while self.peek().is_some() && !self.starts_with(b"*/") {
                    self.bump();
                }
                self.at = (self.at + 2).min(self.text.len());
            } else if self.peek().is_some_and(is_space) {
                self.bump();
            } else {
                return;
            }
        }
    }

    fn next(&mut self) -> Option<Token> {
        self.skip_space_and_comments();
        match self.peek()? {
            b'{' => {
                self.at += 1;
                Some(Token::Open)
            }
            b'}' => {
                self.at += 1;
                Some(Token::Close)
            }
            b'"' => {
                self.at += 1;
                let start = self.at;
                while self.peek().is_some_and(|b| b != b'"') {
                    self.bump();
                }
                let word = self.word(start);
                self.unterminated |= self.bump().is_none();
                Some(word)
            }
            _ => {
                let start = self.at;
                while self
                    .peek()
                    .is_some_and(|b| b > 32 && b != b'{' && b != b'}')
                {
                    self.at += 1;
                }
                Some(self.word(start))
            }
        }
    }

    fn word(&self, start: usize) -> Token {
        let bytes = self.text.get(start..self.at).unwrap_or(&[]);
        Token::Word(String::from_utf8_lossy(bytes).into_owned())
    }
}

/// Up to three numbers separated by white space over the given defaults; reading stops at the first
/// word that is no number, as C's `sscanf` does.
pub(crate) fn vec3_or(text: &str, defaults: Vec3) -> Vec3 {
    let mut numbers = defaults.to_array();
    for (number, word) in numbers.iter_mut().zip(text.split_ascii_whitespace()) {
        match leading_number(word) {
            Some(value) => *number = value,
            None => break,
        }
    }
    Vec3::from_array(numbers)
}

/// The longest prefix that is a decimal number, as a finite value.
fn leading_number(text: &str) -> Option<f32> {
    let text = text.trim_start();
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let mut end = digits(sign);
    let mut any = end > sign;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        any |= fraction > end + 1;
        end = fraction;
    }
    if !any {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    let value: f32 = text.get(..end)?.parse().ok()?;
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(text: &str) -> Vec<Vec<(String, String)>> {
        parse(text.as_bytes())
            .0
            .into_iter()
            .map(|e| e.pairs)
            .collect()
    }

    fn pair(key: &str, value: &str) -> (String, String) {
        (key.to_owned(), value.to_owned())
    }

    #[test]
    fn reads_what_compilers_write() {
        let text = "{\n\"classname\" \"worldspawn\"\n\"message\" \"two\nlines\"\n}\n{\n\"origin\" \"1 -2.5 3e1\"\n}\n\0dead {";
        let (entities, warnings) = parse(text.as_bytes());
        assert_eq!(warnings, []);
        assert_eq!(entities.len(), 2);
        assert_eq!(entities[0].classname(), "worldspawn");
        assert_eq!(entities[0].get("MESSAGE"), Some("two\nlines"));
        assert_eq!(entities[1].vec3("origin"), Some(Vec3::new(1.0, -2.5, 30.0)));
        assert_eq!(entities[1].vec3("angles"), None);
    }

    #[test]
    fn braces_separate_without_spaces_and_comments_vanish() {
        assert_eq!(
            pairs("{\"a\" \"1\"}{b 2 // c\n/* d } */ e{f g}"),
            vec![
                vec![pair("a", "1")],
                vec![pair("b", "2")],
                vec![pair("f", "g")]
            ]
        );
    }

    #[test]
    fn oddities_are_warnings_with_lines() {
        let (entities, warnings) = parse(b"}\n{ \"a\" }\n{ \"b\" \"open");
        assert_eq!(entities.len(), 2);
        assert_eq!(entities[1].pairs, vec![pair("b", "open")]);
        let lines: Vec<usize> = warnings.iter().map(|w| w.line).collect();
        assert_eq!(lines, [1, 2, 3, 3]);
    }

    #[test]
    fn first_and_last_differ_for_duplicates() {
        let entity = &parse(b"{ k 1 K 2 }").0[0];
        assert_eq!(entity.get("k"), Some("1"));
        assert_eq!(entity.last("k"), Some("2"));
    }

    #[test]
    fn numbers_are_prefixes() {
        for (text, value) in [
            ("90deg", Some(90.0)),
            ("-1.4033e-14", Some(-1.4033e-14)),
            ("5e", Some(5.0)),
            (".5", Some(0.5)),
            ("nan", None),
            ("inf", None),
            ("1e999", None),
            ("-", None),
        ] {
            assert_eq!(leading_number(text), value, "{text}");
        }
    }

    #[test]
    fn brush_models_are_positive() {
        let model = |m: &str| parse(format!("{{ model {m} }}").as_bytes()).0[0].brush_model();
        assert_eq!(model("*12"), Some(12));
        assert_eq!(model("*-1"), None);
        assert_eq!(model("*0"), None);
        assert_eq!(model("*99999999999999999999999"), None);
        assert_eq!(model("models/a.md3"), None);
    }

    #[test]
    fn written_entities_read_back() {
        let entities = parse(b"{ a 1 \"b c\" \"d\te\" }{}{x \"\"}").0;
        assert_eq!(parse(&write(&entities)), (entities, vec![]));
    }
}
