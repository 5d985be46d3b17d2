//! Recognizes the shadows that a game draws itself: with `cg_shadows 1`, a dark mark on the ground below each player in
//! every frame. The traced look omits them, because it traces these shadows.
//!
//! Source: behaviour of the game (cgame): the centre of a mark's texture is the projected position. For shadows it lies
//! straight below the origin of a model; other marks stay where something hit a surface.

use glam::{Vec2, Vec3};
use shaderscript::{BlendFactor, Shader};

use crate::api::{EntityKind, PolyVert, RefEntity};

/// Tolerance of the centre's distance from the vertical line through the model, units, for rounding.
const SLACK: f32 = 0.1;
/// Distance below a model within which the game draws its shadow, units.
const REACH: f32 = 160.0;

/// Whether a material can only darken what is behind it.
pub fn only_darkens(shader: &Shader) -> bool {
    let takes = |stage: &shaderscript::Stage| {
        matches!(
            stage.blend,
            Some((
                BlendFactor::Zero,
                BlendFactor::OneMinusSrcColor | BlendFactor::SrcColor
            ))
        )
    };
    !shader.stages.is_empty() && shader.stages.iter().all(takes)
}

/// Centre of a polygon's texture on its plane; `None` if the texture coordinates do not span the plane.
fn middle(corners: &[PolyVert]) -> Option<Vec3> {
    let [a, rest @ ..] = corners else {
        return None;
    };
    // the largest triangle of the fan has the least rounding error
    let area = |b: &PolyVert, c: &PolyVert| (b.st - a.st).perp_dot(c.st - a.st);
    let (b, c) = rest
        .windows(2)
        .filter_map(|pair| match pair {
            [b, c] => Some((b, c)),
            _ => None,
        })
        .max_by(|x, y| area(x.0, x.1).abs().total_cmp(&area(y.0, y.1).abs()))?;
    let whole = area(b, c);
    if whole.abs() < 1.0e-6 {
        return None;
    }
    let to = Vec2::splat(0.5) - a.st;
    let along_b = to.perp_dot(c.st - a.st) / whole;
    let along_c = (b.st - a.st).perp_dot(to) / whole;
    Some(a.position + (b.position - a.position) * along_b + (c.position - a.position) * along_c)
}

/// Whether a polygon with a darkening material is the shadow of one of the models.
pub fn is_painted_shadow(corners: &[PolyVert], entities: &[RefEntity]) -> bool {
    let Some(middle) = middle(corners) else {
        return false;
    };
    entities.iter().any(|entity| {
        let down = entity.origin - middle;
        entity.kind == EntityKind::Model
            && down.truncate().length() < SLACK
            && (0.0..REACH).contains(&down.z)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part of a mark with a radius of 24 units around `center`, clipped at one side.
    fn piece(center: Vec3) -> Vec<PolyVert> {
        let corner = |x: f32, y: f32| PolyVert {
            position: center + Vec3::new(x, y, 0.0),
            st: Vec2::splat(0.5) + Vec2::new(x, y) / 48.0,
            ..PolyVert::default()
        };
        vec![
            corner(5.0, -24.0),
            corner(24.0, -24.0),
            corner(24.0, 24.0),
            corner(5.0, 24.0),
        ]
    }

    #[test]
    fn a_mark_straight_below_a_model_is_its_shadow() {
        let entity = RefEntity {
            origin: Vec3::new(100.0, 200.0, 50.0),
            ..RefEntity::default()
        };
        let below = piece(Vec3::new(100.0, 200.0, 26.0));
        assert!(is_painted_shadow(&below, &[RefEntity::default(), entity]));
        for aside in [
            Vec3::new(101.0, 200.0, 26.0),
            Vec3::new(100.0, 200.0, 60.0),
            Vec3::new(100.0, 200.0, -300.0),
        ] {
            assert!(
                !is_painted_shadow(&piece(aside), std::slice::from_ref(&entity)),
                "{aside}"
            );
        }
        assert!(!is_painted_shadow(
            &below[..1],
            std::slice::from_ref(&entity)
        ));
        let sprite = RefEntity {
            kind: EntityKind::Sprite,
            ..entity
        };
        assert!(!is_painted_shadow(&below, &[sprite]));
    }
}
