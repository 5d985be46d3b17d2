//! Conditions of Quake3e's `.shaderx` scripts: `if ( $variable == 1 || ... )` before a stage or a keyword.
//!
//! What follows from the engine's way, and is kept: operators have no precedence, and a part without a comparison is
//! compared with 0. `elif` is read only while no branch was used; whether a later branch is used alternates with each
//! one, so that after a used `if` and an `elif` an `else` is used, too.

use super::definition::{DefinitionParser, Rejection};

/// Value of a console variable; empty if there is none.
pub type Variables<'a> = &'a dyn Fn(&str) -> String;

/// Whether the next branch of a chain is used; `None` outside of a chain.
pub(super) type Chain = Option<bool>;

impl DefinitionParser<'_, '_, '_> {
    /// Reads `if`, `elif` or `else`, and passes what follows if it is not used.
    pub(super) fn branch(&mut self, word: &str) -> Result<(), Rejection> {
        let unexpected = || Rejection(format!("unexpected '{word}'"));
        let mut used = match word {
            "if" => true,
            _ => self.chain.ok_or_else(unexpected)?,
        };
        if word != "else" {
            let text = self.lexer.parenthesis();
            let text = text.ok_or_else(|| Rejection(format!("{word} without a condition")))?;
            let value = evaluate(&text, self.variables).map_err(Rejection)?;
            used &= value;
        }
        if !used && let Some(next) = self.lexer.token() {
            if next.text.starts_with('{') {
                self.lexer.skip_section(1);
            } else {
                self.lexer.rest_of_line();
            }
        }
        self.chain = (word != "else").then_some(!used);
        Ok(())
    }
}

/// A word of a condition.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Word<'a> {
    Quoted(&'a str),
    Plain(&'a str),
    End,
}

/// Value of the text between parentheses; otherwise what is wrong with it.
fn evaluate(mut text: &str, variables: Variables<'_>) -> Result<bool, String> {
    let mut result = false;
    let mut both = false;
    loop {
        let left = next(&mut text);
        if left == Word::End {
            return Err("a condition ends too early".to_owned());
        }
        let mut joint = next(&mut text);
        let mut comparison = "!=";
        let mut right = Word::Plain("");
        if let Word::Plain(word @ ("==" | "!=" | "<" | "<=" | ">" | ">=")) = joint {
            comparison = word;
            right = next(&mut text);
            joint = next(&mut text);
        }
        let holds = compare(left, comparison, right, variables);
        result = if both {
            result && holds
        } else {
            result || holds
        };
        both = match joint {
            Word::Plain("||") => false,
            Word::Plain("&&") => true,
            Word::End => return Ok(result),
            Word::Plain(word) | Word::Quoted(word) => {
                return Err(format!("'{word}' in a condition is no operator"));
            }
        };
    }
}

/// Cuts off the next word.
fn next<'a>(text: &mut &'a str) -> Word<'a> {
    let rest = text.trim_start();
    let Some(first) = rest.chars().next() else {
        return Word::End;
    };
    if let Some(quoted) = rest.strip_prefix('"') {
        let (word, rest) = quoted.split_once('"').unwrap_or((quoted, ""));
        *text = rest;
        return Word::Quoted(word);
    }
    let pairs = ["==", "!=", "<=", ">=", "||", "&&"];
    let belongs = |c: char| c.is_alphanumeric() || !c.is_ascii() || "-./\\_".contains(c);
    let end = if pairs.iter().any(|pair| rest.starts_with(pair)) {
        2
    } else if first.is_ascii_punctuation() && !"-.\\_@$'#".contains(first) {
        1
    } else {
        let after = rest.char_indices().skip(1).find(|&(_, c)| !belongs(c));
        after.map_or(rest.len(), |(end, _)| end)
    };
    let (word, rest) = rest.split_at(end);
    *text = rest;
    Word::Plain(word)
}

/// Compares as texts if one side is quoted, otherwise as whole numbers.
fn compare(left: Word<'_>, comparison: &str, right: Word<'_>, variables: Variables<'_>) -> bool {
    let value = |word| match word {
        Word::Plain(word) => word
            .strip_prefix('$')
            .map_or_else(|| word.to_owned(), variables),
        Word::Quoted(word) => word.to_owned(),
        Word::End => String::new(),
    };
    let quoted = |word| matches!(word, Word::Quoted(_));
    let (a, b) = (value(left), value(right));
    let order = if quoted(left) || quoted(right) {
        a.cmp(&b)
    } else {
        whole(&a).cmp(&whole(&b))
    };
    match comparison {
        "==" => order.is_eq(),
        "!=" => order.is_ne(),
        "<" => order.is_lt(),
        "<=" => order.is_le(),
        ">" => order.is_gt(),
        _ => order.is_ge(),
    }
}

/// The whole number at the start of a text, as C's `atoi`; 0 without one.
fn whole(text: &str) -> i64 {
    let text = text.trim_start();
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
    let end = digits.find(|c: char| !c.is_ascii_digit());
    let size = digits
        .get(..end.unwrap_or(digits.len()))
        .unwrap_or_default();
    let size = size
        .parse()
        .unwrap_or(if size.is_empty() { 0 } else { i64::MAX });
    if text.starts_with('-') { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variable(name: &str) -> String {
        match name {
            "r_hdr" => "1",
            "r_size" => "-12.7",
            "s_name" => "abc",
            _ => "",
        }
        .to_owned()
    }

    #[test]
    fn conditions_are_evaluated_from_left_to_right() {
        for (text, expected) in [
            ("$r_hdr", true),
            ("$absent", false),
            ("$r_hdr==1", true),
            ("1 < 2", true),
            ("$r_size <= -12", true),
            ("$r_size == -12", true),
            ("$r_size > -12", false),
            ("\"x\"", true),
            ("$s_name == \"abc\"", true),
            ("$s_name >= \"abd\"", false),
            ("$s_name == abc", true),
            ("$r_hdr && 0 || 1", true),
            // no precedence: (1 || 1) && 0
            ("1 || 1 && 0", false),
            ("0\n|| 1", true),
        ] {
            assert_eq!(evaluate(text, &variable), Ok(expected), "{text}");
        }
        for text in ["", "1 ==1 &&", "1 = 1", "1 2", "! 1"] {
            assert!(evaluate(text, &variable).is_err(), "{text}");
        }
    }
}
