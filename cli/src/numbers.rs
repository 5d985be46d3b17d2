//! Parsers of numbers, with their limits.

/// Parses a number that satisfies `fits`; `what` describes the accepted numbers.
fn number(text: &str, what: &str, fits: impl Fn(f32) -> bool) -> Result<f32, String> {
    let parsed: Option<f32> = text.parse().ok();
    let fitting = parsed.filter(|n| n.is_finite() && fits(*n));
    fitting.ok_or_else(|| format!("it must be {what}"))
}

/// A number above 0.
pub fn positive(text: &str) -> Result<f32, String> {
    number(text, "a number above 0", |n| n > 0.0)
}

/// A number of at least 0.
pub fn not_negative(text: &str) -> Result<f32, String> {
    number(text, "0 or a number above it", |n| n >= 0.0)
}

/// A part of something: 0 to 1.
pub fn part(text: &str) -> Result<f32, String> {
    number(text, "a number from 0 to 1", |n| (0.0..=1.0).contains(&n))
}

/// Finite numbers with commas or spaces between; `None` if anything else is among them.
pub fn list(text: &str) -> Option<Vec<f32>> {
    let words = text
        .split(|c: char| c == ',' || c.is_whitespace())
        .filter(|word| !word.is_empty());
    words
        .map(|word| word.parse().ok().filter(|n: &f32| n.is_finite()))
        .collect()
}

/// A horizontal field of view, degrees, of a plane projection.
pub fn fov(text: &str) -> Result<f32, String> {
    number(
        text,
        "an angle from 1 to 170 degrees, for example 90",
        |n| (1.0..=170.0).contains(&n),
    )
}

/// A whole number of at least 1.
pub fn count(text: &str) -> Result<usize, String> {
    let parsed: Option<usize> = text.parse().ok();
    let fitting = parsed.filter(|n| *n > 0);
    fitting.ok_or_else(|| "it must be a whole number of at least 1".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_that_make_sense_pass() {
        assert_eq!(fov("90"), Ok(90.0));
        for text in ["0", "180", "-90", "NaN", "inf", "wide", "170.1"] {
            assert!(fov(text).is_err(), "{text}");
        }
        assert!(fov("180").unwrap_err().contains("1 to 170"));
        assert!(positive("NaN").is_err() && positive("inf").is_err());
        assert!(positive("0").is_err() && positive("-1").is_err());
        assert_eq!(positive("1e-3"), Ok(1e-3));
        assert_eq!(not_negative("0"), Ok(0.0));
        assert_eq!((part("0"), part("1")), (Ok(0.0), Ok(1.0)));
        assert!(part("1.1").is_err() && part("-0.1").is_err() && part("NaN").is_err());
        assert!(not_negative("-1").is_err());
        assert!(count("0").is_err() && count("1.5").is_err() && count("-1").is_err());
        assert_eq!(count("3"), Ok(3));
        assert_eq!(list("1,-2 3.5"), Some(vec![1.0, -2.0, 3.5]));
        assert!(list("1,x").is_none() && list("1,inf").is_none());
    }
}
