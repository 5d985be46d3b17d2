//! Power laws through measured costs.

use serde::Serialize;

/// Exponents that are tried: from the first to the last, in steps of the third.
const EXPONENTS: (f64, f64, f64) = (0.1, 3.0, 0.01);

/// Least increase of a cost, over the cost of the smallest size, to which an exponent is fitted; below, timer noise
/// decides.
const LEAST_INCREASE: f64 = 0.1;

/// `base + factor · size^exponent`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PowerLaw {
    /// Cost that does not depend on the size.
    pub base: f64,
    /// Cost at size 1, without the base.
    pub factor: f64,
    /// How the rest grows.
    pub exponent: f64,
    /// Root mean square of the relative errors at the measured sizes.
    pub error: f64,
}

impl PowerLaw {
    /// The law with the least squared relative error through points that ascend by size; base and factor are not
    /// negative. `None` for fewer than three sizes, costs that are not positive, or a cost at the largest size that is
    /// less than a tenth above the one at the smallest.
    pub fn of(points: &[(f64, f64)]) -> Option<Self> {
        let mut sizes: Vec<f64> = points.iter().map(|(size, _)| *size).collect();
        sizes.dedup();
        let ((_, least), (largest, most)) = (*points.first()?, *points.last()?);
        let positive = points.iter().all(|(_, cost)| *cost > 0.0);
        if sizes.len() < 3 || !positive || most < (1.0 + LEAST_INCREASE) * least {
            return None;
        }
        let (first, last, step) = EXPONENTS;
        let count = ((last - first) / step).round() as u32;
        (0..=count)
            .map(|at| Self::with_exponent(points, largest, first + step * f64::from(at)))
            .min_by(|a, b| a.error.total_cmp(&b.error))
            .filter(|law| law.factor > 0.0)
    }

    /// The best base and factor for an exponent.
    fn with_exponent(points: &[(f64, f64)], largest: f64, exponent: f64) -> Self {
        // sizes as parts of the largest, and every equation divided by its cost
        let powers = points
            .iter()
            .map(|(x, y)| ((x / largest).powf(exponent), *y));
        let (mut ww, mut wp, mut pp, mut w, mut p) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (power, cost) in powers {
            let (a, b) = (1.0 / cost, power / cost);
            ww += a * a;
            wp += a * b;
            pp += b * b;
            w += a;
            p += b;
        }
        let divisor = ww * pp - wp * wp;
        let (base, factor) = match divisor.abs() > 1e-12 * ww * pp {
            true => ((w * pp - p * wp) / divisor, (p * ww - w * wp) / divisor),
            false => (w / ww, 0.0),
        };
        // at the bound of the constraint one of the two is 0
        let (base, factor) = match (base < 0.0, factor < 0.0) {
            (true, _) => (0.0, if pp > 0.0 { p / pp } else { 0.0 }),
            (_, true) => (w / ww, 0.0),
            _ => (base, factor),
        };
        let law = Self {
            base,
            factor: factor / largest.powf(exponent),
            exponent,
            error: 0.0,
        };
        let squares = (points.iter()).map(|(x, y)| (law.at(*x) / y - 1.0).powi(2));
        Self {
            error: (squares.sum::<f64>() / points.len() as f64).sqrt(),
            ..law
        }
    }

    /// The cost at a size.
    pub fn at(&self, size: f64) -> f64 {
        self.base + self.factor * size.powf(self.exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(cost: impl Fn(f64) -> f64, sizes: &[f64]) -> PowerLaw {
        let points: Vec<_> = sizes.iter().map(|x| (*x, cost(*x))).collect();
        PowerLaw::of(&points).expect("a law")
    }

    #[test]
    fn exponents_are_found_again() {
        for exponent in [0.5, 1.0, 1.5, 2.0] {
            for base in [0.0, 3.0] {
                let law = fitted(
                    |x| base + 0.01 * x.powf(exponent),
                    &[1.0, 10.0, 100.0, 1000.0, 1e4],
                );
                assert!((law.exponent - exponent).abs() < 0.006, "{law:?}");
                assert!(
                    (law.base - base).abs() < 1e-3 && law.error < 1e-3,
                    "{law:?}"
                );
                assert!((law.factor - 0.01).abs() < 1e-3);
            }
        }
        // a size of 0 is the base
        let law = fitted(|x| 2.0 + x, &[0.0, 1.0, 2.0, 4.0, 8.0]);
        assert!((law.exponent - 1.0).abs() < 0.006 && (law.base - 2.0).abs() < 1e-3);
        assert!((law.at(16.0) - 18.0).abs() < 0.3);
    }

    #[test]
    fn noise_of_a_few_percent_changes_an_exponent_little() {
        let noise = [1.02, 0.97, 1.01, 0.99, 1.03, 0.98];
        let sizes = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
        let points: Vec<_> = (sizes.iter().zip(noise))
            .map(|(x, n)| (*x, n * (1.0 + 2.0 * x)))
            .collect();
        let law = PowerLaw::of(&points).expect("a law");
        assert!(
            (law.exponent - 1.0).abs() < 0.12 && law.error < 0.03,
            "{law:?}"
        );
    }

    #[test]
    fn what_has_no_law_gets_none() {
        assert_eq!(PowerLaw::of(&[]), None);
        assert_eq!(PowerLaw::of(&[(1.0, 1.0), (2.0, 2.0)]), None, "two sizes");
        assert_eq!(PowerLaw::of(&[(1.0, 1.0), (1.0, 2.0), (2.0, 3.0)]), None);
        let flat = [(1.0, 1.0), (2.0, 1.05), (4.0, 1.02)];
        assert_eq!(PowerLaw::of(&flat), None, "noise");
        let falling = [(1.0, 3.0), (2.0, 2.0), (4.0, 1.0)];
        assert_eq!(PowerLaw::of(&falling), None);
        assert_eq!(PowerLaw::of(&[(1.0, 0.0), (2.0, 1.0), (3.0, 2.0)]), None);
    }
}
