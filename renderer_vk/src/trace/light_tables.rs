//! Alias tables that shaders sample lights from.

use glam::Vec3;
use shaders::trace_types::LightSlot;
use support::slice::{self, part_mut};

/// Part of a row's probability that is distributed uniformly, so that a wrong estimate excludes no light.
const EVEN_PART: f64 = 0.1;

/// An entry of a row before its table is built.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Number of the light.
    pub light: u32,
    /// Estimated light at the row's cell without occlusion; any unit.
    pub weight: f32,
    /// Estimated visible part of the light, above 0.
    pub visibility: f32,
}

impl Entry {
    /// Estimated light that arrives.
    pub fn given(&self) -> f32 {
        let given = self.weight * self.visibility;
        if given.is_finite() {
            given.max(0.0)
        } else {
            0.0
        }
    }
}

/// Appends the slots of a row. The probability of each light is above 0.
///
/// Source: Walker's alias method (ACM TOMS 3(3), 1977), built as by Vose (IEEE TSE 17(9), 1991).
pub fn append_slots(slots: &mut Vec<LightSlot>, entries: &[Entry]) {
    let weight = |e: &Entry| f64::from(e.given());
    let total: f64 = entries.iter().map(weight).sum();
    #[allow(clippy::cast_precision_loss)] // a row's length
    let even = 1.0 / entries.len().max(1) as f64;
    let chance = |e: &Entry| {
        if total > 0.0 {
            EVEN_PART * even + (1.0 - EVEN_PART) * weight(e) / total
        } else {
            even
        }
    };
    let first = slots.len();
    let visibility = |e: &Entry| e.visibility.clamp(1.0e-4, 1.0);
    #[allow(clippy::cast_possible_truncation)] // rounds to single precision
    slots.extend(entries.iter().map(|e| LightSlot {
        light: e.light,
        alias: e.light,
        threshold: 1.0,
        chance: chance(e) as f32,
        alias_chance: chance(e) as f32,
        visibility: visibility(e),
        alias_visibility: visibility(e),
        padding: 0,
    }));
    let row = part_mut(slots, first..);
    // part of each slot that its own light occupies
    let mut parts: Vec<f64> = entries.iter().map(|e| chance(e) / even).collect();
    let (mut poor, mut rich): (Vec<usize>, Vec<usize>) =
        (0..parts.len()).partition(|&i| parts.get(i).is_some_and(|&p| p < 1.0));
    while let (Some(&low), Some(&high)) = (poor.last(), rich.last()) {
        poor.pop();
        let own = parts.get(low).copied().unwrap_or(1.0);
        let Some(&LightSlot {
            light,
            chance,
            visibility,
            ..
        }) = slice::get(row, high)
        else {
            break;
        };
        if let Some(slot) = row.get_mut(low) {
            #[allow(clippy::cast_possible_truncation)] // rounds to single precision
            {
                slot.threshold = own as f32;
            }
            slot.alias = light;
            slot.alias_chance = chance;
            slot.alias_visibility = visibility;
        }
        if let Some(left) = parts.get_mut(high) {
            *left -= 1.0 - own;
            if *left < 1.0 {
                rich.pop();
                poor.push(high);
            }
        }
    }
}

/// Luminance of a linear colour; 0 for negative colours.
pub fn luminance(c: Vec3) -> f32 {
    relight::overbright::luminance(c).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Probability of each light, computed from the slots.
    fn drawn(slots: &[LightSlot]) -> Vec<f64> {
        let mut chances = vec![0.0; slots.len()];
        for slot in slots {
            let part = 1.0 / slots.len() as f64;
            chances[slot.light as usize] += part * f64::from(slot.threshold);
            chances[slot.alias as usize] += part * (1.0 - f64::from(slot.threshold));
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
            let entries: Vec<Entry> = (0u32..)
                .zip(&weights)
                .map(|(light, &weight)| Entry {
                    light,
                    weight,
                    visibility: if light % 3 == 0 { 1.0 } else { 0.25 },
                })
                .collect();
            let mut slots = Vec::new();
            append_slots(&mut slots, &entries);
            assert_eq!(slots.len(), weights.len());
            let drawn = drawn(&slots);
            assert!((drawn.iter().sum::<f64>() - 1.0).abs() < 1.0e-5);
            for (i, slot) in slots.iter().enumerate() {
                assert_eq!(slot.light as usize, i);
                let stored = f64::from(slot.chance);
                assert!(stored > 0.0);
                assert!(
                    (drawn[i] / stored - 1.0).abs() < 1.0e-4,
                    "{} {stored}",
                    drawn[i]
                );
                assert_eq!(slot.alias_chance, slots[slot.alias as usize].chance);
                assert_eq!(slot.alias_visibility, slots[slot.alias as usize].visibility);
            }
        }
        append_slots(&mut Vec::new(), &[]);
    }
}
