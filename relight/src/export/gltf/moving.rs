//! What of materials moves where animations are asked for.

use super::pulse::Pulse;
use crate::export::Export;
use crate::export::film::Film;
use crate::export::layers::Layer;
use crate::export::look::{Look, Picture, Slot};
use crate::export::losses::{FILM, PULSE, WOBBLE};
use crate::export::shown::{glows, make_shown_as};
use crate::export::stack::Moment;
use glam::{Vec2, Vec3};
use shaderscript::{AlphaGen, RgbGen, Shader, Stage, StageImage, TcMod};

/// The light in which a material is looked at.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lighting {
    /// Mean radiance of its lights.
    pub radiance: Option<Vec3>,
    /// Of materials that are to need no light, the mean of that on their surfaces.
    pub shown: Option<Vec3>,
}

/// What other programs can say of a layer, and whether light in colours of vertices multiplies it.
pub fn look_in(source: &Export<'_>, layer: &Layer<'_>, lighting: Lighting) -> (Look, bool) {
    let lit = lighting.shown.is_none();
    let mut look = source.look(layer, lighting.radiance, lit, Moment::Mean);
    let shaded = match lighting.shown {
        Some(light) => {
            let glows = glows(&look);
            make_shown_as(&mut look, light, glows)
        }
        None => true,
    };
    (look, shaded)
}

/// Animates a layer's pictures, and returns how its colours change. `bounds`: least and largest texture
/// coordinates of its surfaces, where they are known.
pub fn make_moving(
    source: &Export<'_>,
    layer: &Layer<'_>,
    lighting: Lighting,
    look: &mut Look,
    bounds: Option<(Vec2, Vec2)>,
) -> Option<Pulse> {
    if !source.options.animate {
        return None;
    }
    let shader = &layer.material.resolved.shader;
    for slot in [&mut look.color, &mut look.glow].into_iter().flatten() {
        let film = bounds.and_then(|bounds| Film::of(slot, shader, bounds));
        let Some(film) = film else {
            report_sway(shader, slot, &mut look.lost);
            continue;
        };
        let picture = Picture::Film(film);
        if let (Ok(Some(_)), Picture::Film(film)) = (source.picture(&picture, shader), &picture) {
            let shows = |s: &Stage| matches!(&s.image, StageImage::Animation { images, .. } if *images == film.images);
            not_lost(shader, &mut look.lost, FILM, shows);
            slot.picture = picture;
        }
    }
    let lit = lighting.shown.is_none();
    let usual = source.look(layer, lighting.radiance, lit, Moment::Mean);
    let pulse = Pulse::of(shader, &mut |moment| {
        let mut now = source.look(layer, lighting.radiance, lit, moment);
        if let Some(light) = lighting.shown {
            make_shown_as(&mut now, light, glows(&usual));
        }
        now
    });
    let waves = |s: &Stage| {
        matches!(s.rgb_gen, RgbGen::Wave(_)) || matches!(s.alpha_gen, AlphaGen::Wave(_))
    };
    // of several waves some may be in no factor
    if pulse.is_some() && shader.stages.iter().filter(|s| waves(s)).count() == 1 {
        not_lost(shader, &mut look.lost, PULSE, waves);
    }
    pulse
}

/// Removes a message about the stages that are `meant`.
fn not_lost(shader: &Shader, lost: &mut Vec<String>, text: &str, meant: impl Fn(&Stage) -> bool) {
    for (i, _) in shader.stages.iter().enumerate().filter(|(_, s)| meant(s)) {
        let text = format!("stage {i}: {text}");
        lost.retain(|line| *line != text);
    }
}

/// Reports how turbulence is approximated.
fn report_sway(shader: &Shader, slot: &Slot, lost: &mut [String]) {
    let wobbles = |m: &TcMod| matches!(m, TcMod::Turbulent { .. });
    if !slot.tc_mods.iter().any(wobbles) {
        return;
    }
    for (i, stage) in shader.stages.iter().enumerate() {
        let text = format!("stage {i}: {WOBBLE}");
        if let Some(line) = lost.iter_mut().find(|line| **line == text)
            && stage.tc_mods == slot.tc_mods
        {
            line.push_str("; it sways as a whole");
        }
    }
}
