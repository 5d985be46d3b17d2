//! Alias tables that shaders sample lights from.

use glam::Vec3;
use shaders::trace_types::LightSlot;

/// Part of a table's probability that is distributed uniformly, so that a wrong estimate excludes no light.
const EVEN_PART: f64 = 0.1;

/// Largest value of a 16-bit fraction.
const WHOLE: f64 = 65535.0;

/// A light of a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Number of the light.
    pub light: u32,
    /// Estimated light that arrives; any unit.
    pub share: f32,
    /// Estimated visible part of the light, above 0.
    pub visibility: f32,
}

/// A share of light; 0 if it is no usable number.
pub fn usable(share: f32) -> f32 {
    if share.is_finite() {
        share.max(0.0)
    } else {
        0.0
    }
}

/// Probabilities by share, above 0 for each light.
pub fn probabilities(entries: &[Entry]) -> Vec<f64> {
    let total: f64 = entries.iter().map(|e| f64::from(usable(e.share))).sum();
    #[allow(clippy::cast_precision_loss)] // a list's length
    let even = 1.0 / entries.len().max(1) as f64;
    let probability = |entry: &Entry| {
        if total > 0.0 {
            EVEN_PART * even + (1.0 - EVEN_PART) * f64::from(usable(entry.share)) / total
        } else {
            even
        }
    };
    entries.iter().map(probability).collect()
}

/// Appends the slots of a table, which draws each light with about its probability. `chance`: the probability that a
/// slot states, from the index of its light and the exact probability of the table.
///
/// Source: Walker's alias method (ACM TOMS 3(3), 1977), built as by Vose (IEEE TSE 17(9), 1991).
pub fn append_table(
    slots: &mut Vec<LightSlot>,
    entries: &[Entry],
    probabilities: &[f64],
    chance: impl Fn(usize, f64) -> f64,
) {
    #[allow(clippy::cast_precision_loss)] // a list's length
    let count = entries.len() as f64;
    // by slot: the part that its own light occupies, in 1 / 65535, and the alias
    let mut kept = vec![WHOLE; entries.len()];
    let mut aliases: Vec<usize> = (0..entries.len()).collect();
    let mut parts: Vec<f64> = probabilities.iter().map(|p| p * count).collect();
    let (mut poor, mut rich): (Vec<usize>, Vec<usize>) =
        (0..parts.len()).partition(|&i| parts.get(i).is_some_and(|&p| p < 1.0));
    while let (Some(&low), Some(&high)) = (poor.last(), rich.last()) {
        poor.pop();
        // A slot draws its own light at least once in 65,535.
        let own = (parts.get(low).copied().unwrap_or(1.0) * WHOLE).round();
        let own = own.clamp(1.0, WHOLE);
        if let (Some(kept), Some(alias)) = (kept.get_mut(low), aliases.get_mut(low)) {
            (*kept, *alias) = (own, high);
        }
        if let Some(left) = parts.get_mut(high) {
            *left -= 1.0 - own / WHOLE;
            if *left < 1.0 {
                rich.pop();
                poor.push(high);
            }
        }
    }
    // The rounded thresholds change the probabilities a little; slots state those that are drawn.
    let mut exact: Vec<f64> = kept.iter().map(|own| own / WHOLE / count).collect();
    for (own, &alias) in kept.iter().zip(&aliases) {
        if let Some(exact) = exact.get_mut(alias) {
            *exact += (1.0 - own / WHOLE) / count;
        }
    }
    let visibility = |e: &Entry| (f64::from(e.visibility) * WHOLE).round().clamp(1.0, WHOLE);
    let made = (entries.iter().enumerate()).zip(kept.iter().zip(aliases.iter().zip(&exact)));
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // rounded, in range
    slots.extend(
        made.map(|((i, entry), (&own, (&alias, &exact)))| LightSlot {
            light: entry.light,
            alias: u32::try_from(alias).unwrap_or(u32::MAX),
            chance: chance(i, exact) as f32,
            fractions: own as u32 | (visibility(entry) as u32) << 16,
        }),
    );
}

/// Luminance of a linear colour; 0 for negative colours.
pub fn luminance(c: Vec3) -> f32 {
    relight::overbright::luminance(c).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(weights: &[f32]) -> Vec<Entry> {
        (0u32..)
            .zip(weights)
            .map(|(light, &share)| Entry {
                light,
                share,
                visibility: if light % 3 == 0 { 1.0 } else { 0.25 },
            })
            .collect()
    }

    /// Probability of each light, computed from the slots as shaders draw.
    fn drawn(slots: &[LightSlot]) -> Vec<f64> {
        let mut chances = vec![0.0; slots.len()];
        for (i, slot) in slots.iter().enumerate() {
            let part = 1.0 / slots.len() as f64;
            let threshold = f64::from(slot.fractions & 0xFFFF) / WHOLE;
            chances[i] += part * threshold;
            chances[slot.alias as usize] += part * (1.0 - threshold);
        }
        chances
    }

    #[test]
    fn lights_are_sampled_with_their_stated_probability() {
        for weights in [
            vec![1.0],
            vec![0.0, 0.0, 0.0],
            vec![1.0, 2.0, 3.0, 0.0, 100.0, 1.0e-6, 7.0],
            (0..1000).map(|i| ((i * 7919) % 101) as f32).collect(),
            vec![f32::INFINITY, 1.0, f32::NAN],
        ] {
            let entries = entries(&weights);
            let wanted = probabilities(&entries);
            let mut slots = Vec::new();
            append_table(&mut slots, &entries, &wanted, |_, exact| exact);
            assert_eq!(slots.len(), weights.len());
            let drawn = drawn(&slots);
            assert!((drawn.iter().sum::<f64>() - 1.0).abs() < 1.0e-5);
            for (i, slot) in slots.iter().enumerate() {
                assert_eq!(slot.light as usize, i);
                let stored = f64::from(slot.chance);
                assert!(stored > 0.0);
                assert!(
                    (drawn[i] / stored - 1.0).abs() < 1.0e-6,
                    "{} {stored}",
                    drawn[i]
                );
                // thresholds have 16 bits
                assert!(
                    (drawn[i] / wanted[i] - 1.0).abs() < 2.0e-3,
                    "{} {}",
                    drawn[i],
                    wanted[i]
                );
                let visibility = f64::from(slot.fractions >> 16) / WHOLE;
                assert!((visibility - f64::from(entries[i].visibility)).abs() < 1.0e-5);
            }
        }
        append_table(&mut Vec::new(), &[], &[], |_, exact| exact);
    }
}
