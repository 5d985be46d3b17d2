//! The entity lump, token by token, for games that read it through the renderer.

use support::slice::part;

/// Read position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EntityTokens {
    at: usize,
}

impl EntityTokens {
    /// The next token of the text (braces are tokens, quotes are removed); `None` at the end, after which reading
    /// restarts. The text ends at its first NUL.
    ///
    /// Source: engine tokenizer: white space is everything up to a blank, `//` and `/* */` are comments where a token
    /// could begin.
    pub fn next(&mut self, text: &[u8]) -> Option<String> {
        let end = text.iter().position(|&b| b == 0).unwrap_or(text.len());
        let text = part(text, ..end);
        let mut at = skip_blank(text, self.at);
        let token = match text.get(at) {
            None => {
                self.at = 0;
                return None;
            }
            Some(b'"') => {
                let start = at + 1;
                let rest = part(text, start..);
                let length = rest.iter().position(|&b| b == b'"').unwrap_or(rest.len());
                at = start + length + 1;
                part(rest, ..length)
            }
            Some(_) => {
                let rest = part(text, at..);
                let length = rest.iter().position(|&b| b <= b' ').unwrap_or(rest.len());
                at += length;
                part(rest, ..length)
            }
        };
        self.at = at;
        Some(String::from_utf8_lossy(token).into_owned())
    }
}

/// Position of the next byte that is neither white space nor comment.
fn skip_blank(text: &[u8], mut at: usize) -> usize {
    loop {
        // An unterminated string or comment moves the position beyond the text.
        let rest = text.get(at..).unwrap_or_default();
        match rest {
            [b, ..] if *b <= b' ' => at += 1,
            [b'/', b'/', ..] => at += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len()),
            [b'/', b'*', ..] => {
                let body = part(rest, 2..);
                at += body
                    .windows(2)
                    .position(|w| w == b"*/")
                    .map_or(rest.len(), |p| p + 4);
            }
            _ => return at,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_end_and_rewind() {
        let text = b"{ // first\n\"classname\" \"info player\"\n/* x */ \"empty\" \"\" }\n\0{ dead";
        let mut tokens = EntityTokens::default();
        let all: Vec<_> = std::iter::from_fn(|| tokens.next(text)).collect();
        assert_eq!(all, ["{", "classname", "info player", "empty", "", "}"]);
        assert_eq!(tokens.next(text).as_deref(), Some("{"));
        assert_eq!(EntityTokens::default().next(b""), None);
        let mut open = EntityTokens::default();
        assert_eq!(
            open.next(b"\"never closed").as_deref(),
            Some("never closed")
        );
        assert_eq!(open.next(b"\"never closed"), None);
        assert_eq!(EntityTokens::default().next(b"/* never closed"), None);
    }
}
