//! Materials as the game shows them, for programs that are to compute no light: one picture, multiplied by the colours
//! of vertices.

use super::look::{Look, Picture, Slot, VertexColor};
use super::reflection::Reflection;
use super::stack::Part;
use crate::overbright;
use glam::Vec3;

/// What glows less than this does not.
const LEAST: f32 = 1.0e-3;
/// Steps of brightness that pictures with their glow are made for, of 255: alike ones are shared between maps.
const STEP: f32 = 16.0;

/// The brightness of light as a byte, sRGB-encoded, that a picture with its glow is made for.
fn level(light: Vec3) -> u8 {
    let encoded = overbright::from_linear(overbright::luminance(light)) * 255.0;
    ((encoded / STEP).round() * STEP).clamp(0.0, 255.0) as u8
}

#[cfg(test)]
fn make_shown(look: &mut Look, light: Vec3) -> bool {
    let glows = glows(look);
    make_shown_as(look, light, glows)
}

/// Whether a material shows something that does not depend on light.
pub fn glows(look: &Look) -> bool {
    look.glow_factor.max_element() > LEAST && look.glow_factor.is_finite()
}

/// Makes a material one that needs no light. `light`: the mean of that on its surfaces, linear. Where a part of what
/// the material shows does not depend on light, its colour is that under the mean light, and light in colours of vertices
/// must not multiply it: the answer is whether it does. `glows`: whether it shows
/// anything of its own, at this moment or another ([`glows()`]).
pub fn make_shown_as(look: &mut Look, light: Vec3, glows: bool) -> bool {
    look.dielectric = None;
    look.reflection = Reflection::DIFFUSE;
    let glow = std::mem::replace(&mut look.glow_factor, Vec3::ZERO);
    let picture = look.glow.take();
    if !glows {
        return true;
    }
    let lit = look.factor.truncate();
    let opacity = look.factor.w;
    let mut show = |color: Vec3| look.factor = color.clamp(Vec3::ZERO, Vec3::ONE).extend(opacity);
    match (&mut look.color, picture) {
        (color, picture) if *color == picture || picture.is_none() => show(lit * light + glow),
        (Some(color), Some(picture)) => match (&mut color.picture, &picture.picture) {
            (
                Picture::Baked { stages, part, .. },
                Picture::Baked {
                    stages: glowing, ..
                },
            ) if stages == glowing => {
                *part = Part::Shown(level(light));
                show(Vec3::ONE);
            }
            _ if lit.max_element() <= LEAST => {
                *color = picture;
                show(glow);
            }
            _ => {
                look.lost.push(film_message(&picture));
                return true;
            }
        },
        (color, picture) => {
            *color = picture;
            show(glow);
        }
    }
    if look.vertex_color == Some(VertexColor::Light) {
        look.vertex_color = None;
    }
    false
}

fn film_message(glow: &Slot) -> String {
    let what = match &glow.picture {
        Picture::File(name) | Picture::Edited(name, _) => format!(" of {name}"),
        Picture::Reflection(_)
        | Picture::Baked { .. }
        | Picture::Film(_)
        | Picture::Sky { .. }
        | Picture::Panorama(_) => String::new(),
    };
    format!(
        "its glow{what} lies on the surface in another way than its colour; the colour is shown"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::look::Alpha;
    use glam::Vec4;

    fn slot(picture: Picture) -> Option<Slot> {
        Some(Slot {
            picture,
            clamp: false,
            tc_mods: Vec::new(),
        })
    }

    fn look(color: Option<Slot>, glow: Option<Slot>) -> Look {
        Look {
            color,
            factor: Vec4::new(0.5, 0.5, 0.5, 0.75),
            alpha: Alpha::Opaque,
            glow,
            glow_factor: Vec3::splat(0.25),
            two_sided: false,
            reversed: false,
            vertex_color: Some(VertexColor::Light),
            vertex_alpha: None,
            lightmapped: true,
            dielectric: None,
            reflection: Reflection::DIFFUSE,
            lost: Vec::new(),
        }
    }

    #[test]
    fn one_picture_is_lit_by_the_mean_and_glows() {
        let file = || slot(Picture::File("a".into()));
        let mut look = look(file(), file());
        assert!(!make_shown(&mut look, Vec3::splat(0.5)));
        assert_eq!(look.factor, Vec4::new(0.5, 0.5, 0.5, 0.75));
        assert_eq!((look.vertex_color, look.glow), (None, None));
    }

    #[test]
    fn pictures_of_one_stack_become_one() {
        let baked = |part| {
            slot(Picture::Baked {
                name: "m".into(),
                stages: vec![0, 1],
                part,
            })
        };
        let mut look = look(baked(Part::Color), baked(Part::Glow));
        assert!(!make_shown(&mut look, Vec3::ONE));
        assert_eq!(look.color, baked(Part::Shown(255)));
    }

    #[test]
    fn what_does_not_glow_keeps_the_light_of_its_vertices() {
        let mut look = look(slot(Picture::File("a".into())), None);
        look.glow_factor = Vec3::ZERO;
        assert!(make_shown(&mut look, Vec3::ONE));
        assert_eq!(look.vertex_color, Some(VertexColor::Light));
    }

    #[test]
    fn a_glow_that_lies_otherwise_is_told() {
        let mut moving = slot(Picture::File("b".into()));
        if let Some(slot) = &mut moving {
            slot.tc_mods = vec![shaderscript::TcMod::Scale(glam::Vec2::splat(3.0))];
        }
        let mut look = look(slot(Picture::File("a".into())), moving);
        assert!(make_shown(&mut look, Vec3::ONE));
        assert_eq!(look.lost.len(), 1);
    }
}
