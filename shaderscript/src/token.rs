//! Tokens of script text, exactly as the engine cuts them.
//!
//! The engine first compresses the text (comments anywhere outside quotes vanish, every run of line ends becomes one
//! newline) and then splits it at white space. [`Lexer`] does both in one pass and stores where each token
//! stood. What follows from the engine's way, and is kept:
//!
//! * White space is every byte up to a blank, and every byte from 0x80 on (its characters are signed).
//! * A `//` comment ends at a line feed; a lone carriage return does not end it. Elsewhere a carriage return is a
//!   line end like any other.
//! * Quotes around a token are removed; blanks, comments and line ends inside them are part of it.
//! * There is no punctuation: braces and parentheses stand between blanks or are part of a word.
//! * A token keeps its first 1023 bytes. A NUL byte ends the text.

/// Longest token, in bytes; the engine silently drops the rest of a longer one.
pub const MAX_TOKEN_BYTES: usize = 1023;

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Position {
    /// Line, from 1; CR, LF and CR LF each end one.
    pub line: u32,
    /// Column in bytes, from 1.
    pub column: u32,
}

/// A word of the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Token {
    /// The word, without quotes; bytes that are not UTF-8 are replaced.
    pub text: String,
    /// Where it starts.
    pub position: Position,
    /// Whether a line end stands between it and the token before.
    pub starts_line: bool,
}

impl Token {
    /// Compares with a keyword without case.
    pub fn is(&self, keyword: &str) -> bool {
        self.text.eq_ignore_ascii_case(keyword)
    }

    /// Number at the start of the word, 0 where there is none; see [`number`].
    pub fn number(&self) -> f32 {
        number(&self.text)
    }
}

/// Which of the engine's two readings of a text is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// After compression: how definitions are read.
    Compressed,
    /// Without it, comments only where a token could start: how the engine checks the structure of a file.
    Raw,
}

/// The bytes of a text with their places, comments removed when compressed. Small enough to copy for look-ahead.
#[derive(Clone, Copy)]
struct Bytes<'a> {
    rest: &'a [u8],
    position: Position,
    reading: Reading,
    /// Inside a quoted string, where compression leaves everything alone.
    quoted: bool,
    /// A line end was passed that has not been given out yet.
    newline: bool,
    /// Where a comment starts that the text ends in.
    unclosed: Option<Position>,
    /// Line feeds passed so far: a carriage return alone is none.
    line_feeds: u32,
}

impl<'a> Bytes<'a> {
    fn advance(&mut self) -> Option<u8> {
        let (&byte, rest) = self.rest.split_first()?;
        self.rest = rest;
        self.line_feeds = self.line_feeds.saturating_add(u32::from(byte == b'\n'));
        let ends_line = byte == b'\n' || (byte == b'\r' && rest.first() != Some(&b'\n'));
        if ends_line {
            self.position.line = self.position.line.saturating_add(1);
            self.position.column = 1;
        } else {
            self.position.column = self.position.column.saturating_add(1);
        }
        Some(byte)
    }

    fn starts_with(&self, prefix: &[u8]) -> bool {
        self.rest.starts_with(prefix)
    }

    /// Passes a comment that starts here, if one does.
    fn skip_comment(&mut self) -> bool {
        if self.starts_with(b"//") {
            while self.rest.first().is_some_and(|&b| b != b'\n' && b != 0) {
                self.advance();
            }
            true
        } else if self.starts_with(b"/*") {
            let start = self.position;
            while !self.rest.is_empty() && self.rest.first() != Some(&0) && !self.starts_with(b"*/")
            {
                self.advance();
            }
            if self.starts_with(b"*/") {
                self.advance();
                self.advance();
            } else {
                self.unclosed = Some(start);
            }
            true
        } else {
            false
        }
    }

    /// Next byte and where it stands; `None` at the end of the text.
    fn next(&mut self) -> Option<(u8, Position)> {
        if self.reading == Reading::Compressed && !self.quoted {
            // Line ends collapse into one, given out only before a byte that follows.
            loop {
                match self.rest.first() {
                    Some(b'\n' | b'\r') => {
                        self.newline = true;
                        self.advance();
                    }
                    Some(b'/') if self.skip_comment() => {}
                    Some(b' ' | b'\t') if self.newline => {
                        self.advance();
                    }
                    _ => break,
                }
            }
            if self.newline && !self.at_end() {
                self.newline = false;
                return Some((b'\n', self.position));
            }
        }
        if self.at_end() {
            return None;
        }
        let position = self.position;
        let byte = self.advance()?;
        if byte == b'"' {
            self.quoted = !self.quoted;
        }
        Some((byte, position))
    }

    fn at_end(&self) -> bool {
        matches!(self.rest.first(), None | Some(0))
    }
}

fn is_space(byte: u8) -> bool {
    byte <= b' ' || byte >= 0x80
}

/// Cuts a text into tokens. A copy of a lexer reads the same tokens again.
#[derive(Clone, Copy)]
pub struct Lexer<'a> {
    bytes: Bytes<'a>,
    /// The next token is the first of its line: nothing is read yet, or a line end is already consumed.
    fresh_line: bool,
}

impl<'a> Lexer<'a> {
    /// Starts at the beginning of a text.
    pub fn new(text: &'a [u8], reading: Reading) -> Lexer<'a> {
        Lexer {
            bytes: Bytes {
                rest: text,
                position: Position { line: 1, column: 1 },
                reading,
                quoted: false,
                newline: false,
                unclosed: None,
                line_feeds: 0,
            },
            fresh_line: true,
        }
    }

    /// Where the next byte stands.
    pub fn position(&self) -> Position {
        self.bytes.position
    }

    /// Line feeds before the next byte, for readers to whom a carriage return alone ends no line.
    pub(crate) fn line_feeds(&self) -> u32 {
        self.bytes.line_feeds
    }

    /// Number of bytes of the text that are not read yet.
    pub fn remaining(&self) -> usize {
        self.bytes.rest.len()
    }

    /// Drops the text beyond `remaining` bytes counted from the end of the text.
    pub(crate) fn cut_before(&mut self, remaining: usize) {
        let keep = self.bytes.rest.len().saturating_sub(remaining);
        self.bytes.rest = self.bytes.rest.get(..keep).unwrap_or_default();
    }

    /// Next token; line ends count as blanks. `None` at the end of the text, and for an empty quoted token, which
    /// the engine cannot distinguish from the end.
    pub fn token(&mut self) -> Option<Token> {
        self.read(true)
    }

    /// Next token of this line. Where a line end comes first the answer is `None` and the line end is *consumed*:
    /// the next call reads on in the following line, as the engine does.
    pub fn token_on_line(&mut self) -> Option<Token> {
        self.read(false)
    }

    fn read(&mut self, allow_line_breaks: bool) -> Option<Token> {
        let mut passed_newline = false;
        let (first, position) = loop {
            let before = self.bytes;
            let (byte, position) = self.bytes.next()?;
            if is_space(byte) {
                passed_newline |= byte == b'\n';
                continue;
            }
            if passed_newline && !allow_line_breaks {
                self.bytes = before;
                self.fresh_line = true;
                return None;
            }
            if self.bytes.reading == Reading::Raw && byte == b'/' {
                self.bytes = before;
                if self.bytes.skip_comment() {
                    continue;
                }
                self.bytes.next()?;
            }
            break (byte, position);
        };
        let starts_line = std::mem::take(&mut self.fresh_line) || passed_newline;

        let mut text = Vec::new();
        if first == b'"' {
            while let Some((byte, _)) = self.bytes.next() {
                if byte == b'"' {
                    break;
                }
                push_limited(&mut text, byte);
            }
            self.bytes.quoted = false;
        } else {
            push_limited(&mut text, first);
            loop {
                let before = self.bytes;
                match self.bytes.next() {
                    Some((byte, _)) if !is_space(byte) => push_limited(&mut text, byte),
                    Some(_) => {
                        self.bytes = before;
                        break;
                    }
                    None => break,
                }
            }
        }
        if text.is_empty() {
            return None;
        }
        Some(Token {
            text: String::from_utf8_lossy(&text).into_owned(),
            position,
            starts_line,
        })
    }

    /// Where the comment starts in which the text ended, once it is passed.
    pub fn unclosed_comment(&self) -> Option<Position> {
        self.bytes.unclosed
    }

    /// Reads a text in parentheses, which the next byte of this line but blanks must open; `None` without them.
    pub(crate) fn parenthesis(&mut self) -> Option<String> {
        let mut text = Vec::new();
        let mut open = false;
        loop {
            let (byte, _) = self.bytes.next()?;
            match byte {
                b'(' if !open => open = true,
                b' ' | b'\t' if !open => {}
                _ if !open => return None,
                b')' if !self.bytes.quoted => {
                    return Some(String::from_utf8_lossy(&text).into_owned());
                }
                _ => text.push(byte),
            }
        }
    }

    /// Reads the rest of the line, to be split by [`words`]; the line end is consumed.
    pub fn rest_of_line(&mut self) -> String {
        let mut text = Vec::new();
        while let Some((byte, _)) = self.bytes.next() {
            if byte == b'\n' {
                self.fresh_line = true;
                break;
            }
            text.push(byte);
        }
        String::from_utf8_lossy(&text).into_owned()
    }

    /// Passes a braced section whose opening brace is already read (`depth` 1) or not (`depth` 0). Only tokens that
    /// are exactly a brace count. Returns false when the text ends first.
    pub fn skip_section(&mut self, mut depth: u32) -> bool {
        loop {
            let Some(token) = self.token() else {
                if self.bytes.at_end() {
                    return depth == 0;
                }
                continue;
            };
            match token.text.as_str() {
                "{" => depth = depth.saturating_add(1),
                "}" => depth = depth.saturating_sub(1),
                _ => {}
            }
            if depth == 0 {
                return true;
            }
        }
    }

    /// Whether the text is read to its end.
    pub fn at_end(&self) -> bool {
        let mut ahead = *self;
        ahead.token().is_none() && ahead.bytes.at_end()
    }
}

fn push_limited(text: &mut Vec<u8>, byte: u8) {
    if text.len() < MAX_TOKEN_BYTES {
        text.push(byte);
    }
}

/// Splits the rest of a line into words, quotes removed.
pub fn words(line: &str) -> Vec<String> {
    let mut lexer = Lexer::new(line.as_bytes(), Reading::Compressed);
    let mut words = Vec::new();
    while !lexer.bytes.at_end() {
        if let Some(token) = lexer.token() {
            words.push(token.text);
        }
    }
    words
}

/// The number that a word starts with, as C's `atof` reads it (decimal, with optional sign, fraction and exponent);
/// 0 where there is none. Not-a-number and infinities written as words are 0 too, so that no script can bring them
/// in.
pub fn number(word: &str) -> f32 {
    parse_number(word).unwrap_or(0.0)
}

/// As [`number`], but `None` where the word does not start with a number.
pub fn parse_number(word: &str) -> Option<f32> {
    let bytes = word.as_bytes();
    let digits = |from: usize| {
        bytes
            // A word may end before its fraction or exponent.
            .get(from..)
            .unwrap_or_default()
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count()
    };
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(sign);
    let mut end = sign + whole;
    let mut fraction = 0;
    if bytes.get(end) == Some(&b'.') {
        fraction = digits(end + 1);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    let value: f64 = word.get(..end)?.parse().ok()?;
    // Too large for a float would be infinite, and infinities breed NaN in every formula downstream.
    Some((value as f32).clamp(f32::MIN, f32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &[u8]) -> Vec<String> {
        let mut lexer = Lexer::new(text, Reading::Compressed);
        std::iter::from_fn(|| lexer.token())
            .map(|t| t.text)
            .collect()
    }

    #[test]
    fn words_are_cut_at_blanks_only() {
        assert_eq!(all(b"a{ b }c (1 2)"), ["a{", "b", "}c", "(1", "2)"]);
        assert_eq!(all(b"x\x80y \x01 z"), ["x", "y", "z"]);
        assert_eq!(all(b"a\0b"), ["a"]);
    }

    #[test]
    fn comments_vanish_anywhere() {
        assert_eq!(
            all(b"a // b /* c\nd /* e\n f */ g ab/*x*/cd ef//gh"),
            ["a", "d", "g", "abcd", "ef"]
        );
        // The slashes win over the star that follows.
        assert_eq!(all(b"//****/* \na\n"), ["a"]);
        assert_eq!(all(b"a /* never closed"), ["a"]);
    }

    #[test]
    fn a_carriage_return_does_not_end_a_line_comment() {
        assert_eq!(all(b"a // b\rc\nd"), ["a", "d"]);
        let mut lexer = Lexer::new(b"a\rb", Reading::Compressed);
        assert!(lexer.token_on_line().is_some());
        assert_eq!(lexer.token_on_line(), None);
        assert_eq!(
            lexer.token_on_line().map(|t| (t.text, t.position.line)),
            Some(("b".into(), 2))
        );
    }

    #[test]
    fn quotes_keep_blanks_and_comments() {
        assert_eq!(all(b"\"a // b\" c\"d e\""), ["a // b", "c\"d", "e\""]);
        assert_eq!(all(b"\"a\nb"), ["a\nb"]);
    }

    #[test]
    fn a_line_end_is_consumed_when_it_stops_a_read() {
        let mut lexer = Lexer::new(b"a\n  b", Reading::Compressed);
        lexer.token();
        assert_eq!(lexer.token_on_line(), None);
        assert_eq!(lexer.token_on_line().map(|t| t.text), Some("b".into()));
    }

    #[test]
    fn positions_count_every_line_end_once() {
        let mut lexer = Lexer::new(b"a\r\nb\rc\n  d", Reading::Compressed);
        let at: Vec<_> = std::iter::from_fn(|| lexer.token())
            .map(|t| (t.position.line, t.position.column, t.starts_line))
            .collect();
        assert_eq!(at, [(1, 1, true), (2, 1, true), (3, 1, true), (4, 3, true)]);
    }

    #[test]
    fn raw_reading_sees_comments_only_at_token_starts() {
        let mut lexer = Lexer::new(b"a//b // c\n /* d */ e", Reading::Raw);
        let tokens: Vec<_> = std::iter::from_fn(|| lexer.token())
            .map(|t| t.text)
            .collect();
        assert_eq!(tokens, ["a//b", "e"]);
    }

    #[test]
    fn long_tokens_are_cut() {
        let text = vec![b'a'; 5000];
        assert_eq!(all(&text), ["a".repeat(MAX_TOKEN_BYTES)]);
    }

    #[test]
    fn rest_of_line_stops_before_the_next() {
        let mut lexer = Lexer::new(b"k a \"b c\" // d\ne", Reading::Compressed);
        lexer.token();
        assert_eq!(words(&lexer.rest_of_line()), ["a", "b c"]);
        assert_eq!(lexer.token().map(|t| t.text), Some("e".into()));
    }

    #[test]
    fn numbers_are_read_as_c_reads_them() {
        for (word, value) in [
            ("1", 1.0),
            ("-.5", -0.5),
            ("+2.", 2.0),
            ("3e2x", 300.0),
            ("1e", 1.0),
            ("0.25)", 0.25),
            ("textures/x", 0.0),
            ("", 0.0),
            (".", 0.0),
            ("nan", 0.0),
            ("inf", 0.0),
            ("1e999", f32::MAX),
        ] {
            assert_eq!(number(word), value, "{word}");
        }
    }
}
