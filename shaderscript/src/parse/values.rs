//! Arguments that several keywords share: vectors, waves, blend factors.

use super::definition::DefinitionParser;
use crate::{
    stage::{BlendFactor, Wave, WaveFunction},
    token::{number, parse_number},
};
use glam::Vec3;

impl DefinitionParser<'_, '_, '_> {
    /// `( x y z )`, every part a word of its own. The error is what is missing; words read until then are consumed,
    /// and `into` holds the components read.
    pub(super) fn vector(&mut self, into: &mut Vec3) -> Result<(), &'static str> {
        if self.lexer.token_on_line().is_none_or(|t| t.text != "(") {
            return Err("expected '(', with blanks around it");
        }
        for component in into.as_mut() {
            *component = self
                .lexer
                .token_on_line()
                .ok_or("vector needs three components")?
                .number();
        }
        if self.lexer.token_on_line().is_none_or(|t| t.text != ")") {
            return Err("expected ')', with blanks around it");
        }
        Ok(())
    }

    /// `function base amplitude phase frequency`; what is missing is 0, with a warning.
    pub(super) fn wave(&mut self, keyword: &str, noise_allowed: bool) -> Wave {
        let mut arguments = Vec::new();
        while arguments.len() < 5 {
            let Some(token) = self.lexer.token_on_line() else {
                break;
            };
            arguments.push(token.text);
        }
        let wave = self.wave_of(keyword, &arguments).unwrap_or_else(|partial| {
            self.warn(format!(
                "{keyword}: a wave needs a function and four numbers"
            ));
            partial
        });
        if wave.function == WaveFunction::Noise && !noise_allowed {
            self.warn(format!(
                "{keyword}: the engine stops with an error when it draws a noise wave here"
            ));
        }
        wave
    }

    /// A wave from its words; the error is the wave with zeros for what is missing.
    pub(super) fn wave_of(&mut self, keyword: &str, words: &[String]) -> Result<Wave, Wave> {
        let function = match words.first() {
            Some(name) => wave_function(name).unwrap_or_else(|| {
                self.warn(format!("{keyword}: unknown wave '{name}', using sin"));
                WaveFunction::Sin
            }),
            None => WaveFunction::Sin,
        };
        let argument = |i: usize| words.get(i).map_or(0.0, |word| number(word));
        let wave = Wave {
            function,
            base: argument(1),
            amplitude: argument(2),
            phase: argument(3),
            frequency: argument(4),
        };
        if words.len() < 5 { Err(wave) } else { Ok(wave) }
    }
}

fn wave_function(name: &str) -> Option<WaveFunction> {
    const NAMES: [(&str, WaveFunction); 6] = [
        ("sin", WaveFunction::Sin),
        ("square", WaveFunction::Square),
        ("triangle", WaveFunction::Triangle),
        ("sawtooth", WaveFunction::Sawtooth),
        ("inversesawtooth", WaveFunction::InverseSawtooth),
        ("noise", WaveFunction::Noise),
    ];
    lookup(&NAMES, name)
}

/// Source factor of that name.
pub(super) fn source_factor(name: &str) -> Option<BlendFactor> {
    const NAMES: [(&str, BlendFactor); 9] = [
        ("GL_ONE", BlendFactor::One),
        ("GL_ZERO", BlendFactor::Zero),
        ("GL_DST_COLOR", BlendFactor::DstColor),
        ("GL_ONE_MINUS_DST_COLOR", BlendFactor::OneMinusDstColor),
        ("GL_SRC_ALPHA", BlendFactor::SrcAlpha),
        ("GL_ONE_MINUS_SRC_ALPHA", BlendFactor::OneMinusSrcAlpha),
        ("GL_DST_ALPHA", BlendFactor::DstAlpha),
        ("GL_ONE_MINUS_DST_ALPHA", BlendFactor::OneMinusDstAlpha),
        ("GL_SRC_ALPHA_SATURATE", BlendFactor::SrcAlphaSaturate),
    ];
    lookup(&NAMES, name)
}

/// Destination factor of that name.
pub(super) fn destination_factor(name: &str) -> Option<BlendFactor> {
    const NAMES: [(&str, BlendFactor); 8] = [
        ("GL_ONE", BlendFactor::One),
        ("GL_ZERO", BlendFactor::Zero),
        ("GL_SRC_ALPHA", BlendFactor::SrcAlpha),
        ("GL_ONE_MINUS_SRC_ALPHA", BlendFactor::OneMinusSrcAlpha),
        ("GL_DST_ALPHA", BlendFactor::DstAlpha),
        ("GL_ONE_MINUS_DST_ALPHA", BlendFactor::OneMinusDstAlpha),
        ("GL_SRC_COLOR", BlendFactor::SrcColor),
        ("GL_ONE_MINUS_SRC_COLOR", BlendFactor::OneMinusSrcColor),
    ];
    lookup(&NAMES, name)
}

/// Value of a name, compared without case.
pub(super) fn lookup<T: Copy>(table: &[(&str, T)], name: &str) -> Option<T> {
    table
        .iter()
        .find(|(known, _)| known.eq_ignore_ascii_case(name))
        .map(|&(_, value)| value)
}

/// Number in a list of words; `None` where it is missing or no number.
pub(super) fn number_at(words: &[String], index: usize) -> Option<f32> {
    words.get(index).and_then(|word| parse_number(word))
}
