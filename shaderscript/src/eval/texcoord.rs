//! `tcGen` and `tcMod`: where an image is sampled.

use super::wave::{shape, shape_index, sine, wave};
use crate::stage::{TcGen, TcMod, WaveFunction};
use glam::{Vec2, Vec3};

/// Smallest size that `tcMod stretch` divides by.
const MIN_STRETCH: f32 = 1e-6;

/// Texture coordinates of a stage at a vertex, before `tcMod`s.
///
/// `st` and `lightmap` are the vertex's own; `position`, `normal` and `viewer` (the camera) are in entity space.
pub fn tex_coord(
    tc_gen: &TcGen,
    st: Vec2,
    lightmap: Vec2,
    position: Vec3,
    normal: Vec3,
    viewer: Vec3,
) -> Vec2 {
    match tc_gen {
        TcGen::Base => st,
        TcGen::Lightmap => lightmap,
        TcGen::Environment => environment(position, normal, viewer),
        TcGen::Vector(s, t) => Vec2::new(position.dot(*s), position.dot(*t)),
    }
}

/// `tcGen environment`: from the y and z of the view direction reflected at the surface.
pub fn environment(position: Vec3, normal: Vec3, viewer: Vec3) -> Vec2 {
    let to_viewer = (viewer - position).normalize_or_zero();
    let reflected = 2.0 * normal.dot(to_viewer) * normal - to_viewer;
    Vec2::new(0.5 + 0.5 * reflected.y, 0.5 - 0.5 * reflected.z)
}

/// Applies `tcMod`s in order.
///
/// `position` is the (deformed) vertex in entity space, `time` the shader time in seconds, `entity_st` the entity's
/// scroll speed (`shaderTexCoord`).
///
/// * turb: s += sine((x + z) / 1024 + phase + time frequency) amplitude, t likewise with y alone
/// * scroll and entityTranslate: adds the fraction of speed times time
/// * stretch: by 1 / wave about (0.5, 0.5); a wave nearer to 0 than 1e-6 counts as 1e-6
/// * rotate: by -degrees times time about (0.5, 0.5), in steps of 1 / 1024 turn
pub fn apply_tc_mods(
    tc_mods: &[TcMod],
    st: Vec2,
    position: Vec3,
    time: f64,
    entity_st: Vec2,
) -> Vec2 {
    let scroll = |speed: Vec2| {
        let moved = |v: f32| {
            let distance = f64::from(v) * time;
            (distance - distance.floor()) as f32
        };
        Vec2::new(moved(speed.x), moved(speed.y))
    };
    let transform = |st: Vec2, m: [[f32; 2]; 2], translate: Vec2| {
        Vec2::new(
            st.x * m[0][0] + st.y * m[1][0],
            st.x * m[0][1] + st.y * m[1][1],
        ) + translate
    };
    tc_mods.iter().fold(st, |st, tc_mod| match tc_mod {
        TcMod::Turbulent {
            amplitude,
            phase,
            frequency,
            ..
        } => {
            let now = f64::from(*phase) + time * f64::from(*frequency);
            let wobble = |v: f32| sine(f64::from(v) / 1024.0 + now) * amplitude;
            st + Vec2::new(wobble(position.x + position.z), wobble(position.y))
        }
        TcMod::Scale(factor) => st * *factor,
        TcMod::Scroll(speed) => st + scroll(*speed),
        TcMod::EntityTranslate => st + scroll(entity_st),
        TcMod::Stretch(w) => {
            // The engine divides by zero here; a scale this large shows the image's mean just as well.
            let size = wave(w, time);
            let p = if size.abs() < MIN_STRETCH {
                MIN_STRETCH.recip().copysign(size)
            } else {
                size.recip()
            };
            transform(st, [[p, 0.0], [0.0, p]], Vec2::splat(0.5 - 0.5 * p))
        }
        TcMod::Transform { matrix, translate } => transform(st, *matrix, *translate),
        TcMod::Rotate(degrees_per_second) => {
            let turns = -f64::from(*degrees_per_second) * time / 360.0;
            let index = shape_index(turns);
            let sin = shape(WaveFunction::Sin, index);
            let cos = shape(WaveFunction::Sin, index + 256);
            transform(
                st,
                [[cos, sin], [-sin, cos]],
                Vec2::new(0.5 - 0.5 * cos + 0.5 * sin, 0.5 - 0.5 * sin - 0.5 * cos),
            )
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::Wave;

    const ST: Vec2 = Vec2::new(0.25, 0.75);

    fn one(tc_mod: TcMod, position: Vec3, time: f64) -> Vec2 {
        apply_tc_mods(&[tc_mod], ST, position, time, Vec2::new(2.0, -0.25))
    }

    #[track_caller]
    fn near(a: Vec2, b: Vec2) {
        assert!(a.abs_diff_eq(b, 4e-3), "{a} is not {b}");
    }

    #[test]
    fn every_generator() {
        let at = |tc_gen| {
            tex_coord(
                &tc_gen,
                ST,
                Vec2::new(0.1, 0.2),
                Vec3::new(1.0, 2.0, 3.0),
                Vec3::Z,
                Vec3::new(1.0, 2.0, 13.0),
            )
        };
        assert_eq!(at(TcGen::Base), ST);
        assert_eq!(at(TcGen::Lightmap), Vec2::new(0.1, 0.2));
        let axes = TcGen::Vector(Vec3::new(0.5, 0.0, 1.0), Vec3::new(0.0, 2.0, 0.0));
        assert_eq!(at(axes), Vec2::new(3.5, 4.0));
        // Straight above: reflected = z.
        assert_eq!(at(TcGen::Environment), Vec2::new(0.5, 0.0));
        // From y at 45 degrees: reflected = (0, -sqrt 1/2, sqrt 1/2).
        let half = 0.5 * 0.5_f32.sqrt();
        near(
            environment(Vec3::ZERO, Vec3::Z, Vec3::new(0.0, 7.0, 7.0)),
            Vec2::new(0.5 - half, 0.5 - half),
        );
    }

    #[test]
    fn turb_wobbles_by_position() {
        let turb = |phase: f32, frequency: f32| TcMod::Turbulent {
            base: 99.0,
            amplitude: 0.5,
            phase,
            frequency,
        };
        near(one(turb(0.25, 0.0), Vec3::ZERO, 0.0), Vec2::new(0.75, 1.25));
        near(one(turb(0.0, 0.5), Vec3::ZERO, 0.5), Vec2::new(0.75, 1.25));
        // x + z = 256 is a quarter turn, y = -256 a quarter back.
        near(
            one(turb(0.0, 0.0), Vec3::new(200.0, -256.0, 56.0), 0.0),
            Vec2::new(0.75, 0.25),
        );
    }

    #[test]
    fn scale_scroll_and_translate() {
        assert_eq!(
            one(TcMod::Scale(Vec2::new(2.0, -1.0)), Vec3::ZERO, 9.0),
            Vec2::new(0.5, -0.75)
        );
        // 0.5 * 2.5 = 1.25 -> 0.25; -0.1 * 2.5 = -0.25 -> 0.75.
        near(
            one(TcMod::Scroll(Vec2::new(0.5, -0.1)), Vec3::ZERO, 2.5),
            Vec2::new(0.5, 1.5),
        );
        near(
            one(TcMod::EntityTranslate, Vec3::ZERO, 1.25),
            Vec2::new(0.75, 0.75 + 0.6875),
        );
    }

    #[test]
    fn stretch_scales_about_the_middle() {
        let stretch = TcMod::Stretch(Wave {
            function: WaveFunction::Square,
            base: 3.0,
            amplitude: -1.0,
            phase: 0.0,
            frequency: 1.0,
        });
        near(
            one(stretch.clone(), Vec3::ZERO, 0.0),
            Vec2::new(0.375, 0.625),
        );
        near(one(stretch, Vec3::ZERO, 0.5), Vec2::new(0.4375, 0.5625));
    }

    #[test]
    fn stretch_to_nothing_stays_finite() {
        let nothing = TcMod::Stretch(Wave {
            function: WaveFunction::Sawtooth,
            base: 0.0,
            amplitude: 1.0,
            phase: 0.0,
            frequency: 1.0,
        });
        assert!(one(nothing, Vec3::ZERO, 0.0).is_finite());
    }

    #[test]
    fn transform_is_a_matrix() {
        let transform = TcMod::Transform {
            matrix: [[1.0, 2.0], [3.0, 4.0]],
            translate: Vec2::new(10.0, 20.0),
        };
        assert_eq!(
            one(transform, Vec3::ZERO, 1.0),
            Vec2::new(0.25 + 2.25 + 10.0, 0.5 + 3.0 + 20.0)
        );
    }

    #[test]
    fn rotate_turns_about_the_middle() {
        // -90 degrees: relative (-0.25, 0.25) turns to (0.25, 0.25) by s' = s cos - t sin with sin = -1.
        near(
            one(TcMod::Rotate(90.0), Vec3::ZERO, 1.0),
            Vec2::new(0.75, 0.75),
        );
        near(
            one(TcMod::Rotate(90.0), Vec3::ZERO, 2.0),
            Vec2::new(0.75, 0.25),
        );
        near(
            one(TcMod::Rotate(-45.0), Vec3::ZERO, 2.0),
            Vec2::new(0.25, 0.25),
        );
    }

    #[test]
    fn order_counts() {
        let scale = TcMod::Scale(Vec2::splat(2.0));
        let scroll = TcMod::Scroll(Vec2::splat(0.5));
        let run = |mods: &[TcMod]| apply_tc_mods(mods, ST, Vec3::ZERO, 1.0, Vec2::ZERO);
        assert_eq!(run(&[scale.clone(), scroll.clone()]), Vec2::new(1.0, 2.0));
        assert_eq!(run(&[scroll, scale]), Vec2::new(1.5, 2.5));
    }
}
