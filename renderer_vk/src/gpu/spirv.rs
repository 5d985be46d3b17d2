//! Changes of SPIR-V for what a device lacks.

use std::borrow::Cow;

/// Words before the first instruction.
const HEADER: usize = 5;
const OP_UNDEF: u32 = 1;
const OP_EXTENSION: u32 = 10;
const OP_CAPABILITY: u32 = 17;
const OP_READ_CLOCK: u32 = 5056;
const SHADER_CLOCK: u32 = 5055;
/// Words of `SPV_KHR_shader_clock` in an `OpExtension`: the text, padded with zeros.
const CLOCK_EXTENSION: &[u8; 24] = b"SPV_KHR_shader_clock\0\0\0\0";

/// The module without the capability `ShaderClockKHR`: what reads the clock gets an undefined value, for code that a
/// specialization constant disables.
pub(crate) fn without_clock(words: &[u32]) -> Cow<'_, [u32]> {
    let has_clock =
        instructions(words).any(|i| matches!(i, [_, SHADER_CLOCK] if code(i) == OP_CAPABILITY));
    if !has_clock {
        return Cow::Borrowed(words);
    }
    let mut kept = words.get(..HEADER).unwrap_or_default().to_vec();
    for instruction in instructions(words) {
        match (code(instruction), instruction) {
            (OP_CAPABILITY, [_, SHADER_CLOCK]) => {}
            (OP_EXTENSION, [_, name @ ..])
                if bytemuck::cast_slice::<u32, u8>(name) == CLOCK_EXTENSION => {}
            (OP_READ_CLOCK, [_, kind, result, ..]) => {
                kept.extend([3 << 16 | OP_UNDEF, *kind, *result])
            }
            _ => kept.extend(instruction),
        }
    }
    Cow::Owned(kept)
}

fn code(instruction: &[u32]) -> u32 {
    instruction.first().map_or(0, |word| word & 0xFFFF)
}

/// The instructions of a module, up to one that is longer than the rest.
fn instructions(words: &[u32]) -> impl Iterator<Item = &[u32]> {
    let mut rest = words.get(HEADER..).unwrap_or_default();
    std::iter::from_fn(move || {
        let length = (rest.first()? >> 16).max(1) as usize;
        let (instruction, after) = rest.split_at_checked(length)?;
        rest = after;
        Some(instruction)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reads_clock(words: &[u32]) -> bool {
        instructions(words).any(|i| code(i) == OP_READ_CLOCK)
    }

    #[test]
    fn a_module_without_the_clock_lacks_its_instructions_alone() {
        let mut changed = 0;
        for module in shaders::ALL {
            let (words, without) = (module.words(), without_clock(module.words()));
            let whole: usize = instructions(words).map(<[u32]>::len).sum();
            assert_eq!(HEADER + whole, words.len(), "{}", module.name());
            assert!(!reads_clock(&without), "{}", module.name());
            if !reads_clock(words) {
                assert_eq!(*without, *words, "{}", module.name());
                continue;
            }
            changed += 1;
            let rest = |words: &[u32]| {
                let plain = |i: &&[u32]| {
                    !matches!(
                        code(i),
                        OP_CAPABILITY | OP_EXTENSION | OP_READ_CLOCK | OP_UNDEF
                    )
                };
                instructions(words)
                    .filter(plain)
                    .flatten()
                    .copied()
                    .collect::<Vec<_>>()
            };
            assert_eq!(rest(&without), rest(words), "{}", module.name());
            let count = |words: &[u32], of| instructions(words).filter(|i| code(i) == of).count();
            assert_eq!(
                count(&without, OP_CAPABILITY) + 1,
                count(words, OP_CAPABILITY)
            );
            assert_eq!(
                count(&without, OP_EXTENSION) + 1,
                count(words, OP_EXTENSION)
            );
        }
        assert!(changed > 0, "no module reads the clock");
    }

    #[test]
    fn damaged_words_are_kept_up_to_the_damage() {
        assert!(without_clock(&[]).is_empty());
        assert_eq!(*without_clock(&[1, 2, 3]), [1, 2, 3]);
        let cut = [
            0,
            0,
            0,
            0,
            0,
            2 << 16 | OP_CAPABILITY,
            SHADER_CLOCK,
            9 << 16 | 60,
        ];
        assert_eq!(*without_clock(&cut), [0; HEADER]);
    }
}
