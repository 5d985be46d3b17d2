//! Files that people write beside maps: lines of a word and its values.

use glam::Vec3;

/// A line that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct LineError {
    /// Number of the line, from 1.
    pub line: usize,
    /// What is wrong with it.
    pub what: String,
}

/// The words of each line that has any, with the line's number from 1. `//` and `#` begin a comment.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, Vec<&str>)> {
    let words = |line: &'_ str| -> Option<usize> {
        let ends = [line.find("//"), line.find('#')];
        ends.into_iter().flatten().min()
    };
    (1..).zip(text.lines()).filter_map(move |(number, line)| {
        let line = words(line).and_then(|end| line.get(..end)).unwrap_or(line);
        let found: Vec<&str> = line.split_whitespace().collect();
        (!found.is_empty()).then_some((number, found))
    })
}

/// Finite numbers, between `least` and `most` of them.
pub(crate) fn numbers(words: &[&str], least: usize, most: usize) -> Result<Vec<f32>, String> {
    if words.len() < least || words.len() > most {
        return Err(if least == most {
            format!("{least} numbers belong here, not {}", words.len())
        } else {
            format!("{least} to {most} numbers belong here, not {}", words.len())
        });
    }
    let number = |word: &&str| {
        let parsed = word.parse().ok().filter(|n: &f32| n.is_finite());
        parsed.ok_or_else(|| format!("{word:?} is not a number"))
    };
    words.iter().map(number).collect()
}

/// Three numbers from index `first` on; missing ones are 0.
pub(crate) fn vector(numbers: &[f32], first: usize) -> Vec3 {
    let number = |i: usize| numbers.get(first + i).copied().unwrap_or(0.0);
    Vec3::new(number(0), number(1), number(2))
}

/// Whether a name matches a pattern, without regard to case: `*` stands for any characters, `?` for one.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let lower = |text: &str| text.to_ascii_lowercase().into_bytes();
    let (pattern, name) = (lower(pattern), lower(name));
    // place in both, and where the last star was tried
    let (mut p, mut n) = (0, 0);
    let mut retry: Option<(usize, usize)> = None;
    while n < name.len() {
        match pattern.get(p) {
            Some(b'*') => {
                retry = Some((p, n));
                p += 1;
            }
            Some(c) if *c == b'?' || name.get(n) == Some(c) => {
                p += 1;
                n += 1;
            }
            _ => {
                let Some((star, at)) = retry else {
                    return false;
                };
                retry = Some((star, at + 1));
                p = star + 1;
                n = at + 1;
            }
        }
    }
    pattern.iter().skip(p).all(|c| *c == b'*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wildcards_stand_for_characters() {
        let name = "textures/base_wall/Metal01";
        for (pattern, expected) in [
            ("textures/base_wall/metal01", true),
            ("*", true),
            ("textures/*", true),
            ("*metal*", true),
            ("*metal0?", true),
            ("textures/*/metal??", true),
            ("*a*ll*1", true),
            ("*metal", false),
            ("metal*", false),
            ("textures/?/metal01", false),
            ("", false),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern}");
        }
        assert!(matches("**", "") && !matches("?", ""));
        // no exponential time
        let long = "a".repeat(4000);
        assert!(!matches(&format!("{}b", "a*".repeat(200)), &long));
    }

    #[test]
    fn comments_and_empty_lines_are_skipped() {
        let text = "a 1 # x // y\n\n// b\n  c // d # e\n";
        let found: Vec<_> = lines(text).collect();
        assert_eq!(found, [(1, vec!["a", "1"]), (4, vec!["c"])]);
    }
}
