//! The forms of the texture projection of a brush side.
//!
//! * Brush primitives (`brushDef`): the texture as a matrix over two axes in the side's plane that follow from its
//!   normal, in repetitions of the image. What Quake III's editors and compilers read; no size of an image is needed.
//! * Valve 220: the axes in space, in texels of the image. What the editors and compilers of Quake, Quake II and
//!   Half-Life read.
//!
//! * Classic: the image is thrown on the plane along one of the map's axes, turned and stretched, in texels. What every
//!   editor and compiler since Quake's reads.
//!
//! The first two can say every affine way of laying an image on a plane, classic lines none that shears the image where
//! it is thrown from.

use super::number;
use super::texture::Projection;
use crate::export::Brushes;
use glam::{DVec2, DVec3};
use q3bsp::Format;

/// Components of a normal below this are zero where the axes of a side are found.
const ZERO: f64 = 1e-6;

/// A form of sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// Brush primitives.
    Primitives,
    /// Valve 220.
    Valve,
    /// Quake's first form.
    Classic,
}

/// A side as a line.
pub(super) struct Line {
    /// The line.
    pub text: String,
    /// Whether the texture has the requested projection.
    pub exact: bool,
}

impl Form {
    /// The requested form, for a map of a format.
    pub(super) fn of(choice: Brushes, format: Format) -> Form {
        match choice {
            Brushes::Primitives => Form::Primitives,
            Brushes::Valve => Form::Valve,
            Brushes::Classic => Form::Classic,
            Brushes::Usual if format.is_quake() => Form::Valve,
            Brushes::Usual => Form::Primitives,
        }
    }

    /// A line of a side. `points` span its plane, clockwise seen from outside; `size` is that of the image in texels, `contents` are the content
    /// flags that the brush asks for besides its shader's.
    pub(super) fn side(
        self,
        points: [DVec3; 3],
        name: &str,
        texture: &Projection,
        size: (u32, u32),
        contents: u32,
    ) -> Line {
        let plane = points.map(|p| format!("( {} )", numbers(p))).join(" ");
        let (laid, exact) = match self {
            Form::Primitives => {
                let [s, t] =
                    matrix(points, texture).map(|row| format!("( {} )", row.map(fine).join(" ")));
                let text = format!("{plane} ( {s} {t} ) {name} {contents} 0 0");
                return Line { text, exact: true };
            }
            Form::Valve => {
                let (s, t) = (valve(texture, 0, size.0), valve(texture, 1, size.1));
                let axes =
                    [&s, &t].map(|v| format!("[ {} {} ]", numbers(v.axis), number(v.offset)));
                let scales = [s.scale, t.scale].map(number);
                (format!("{} 0 {}", axes.join(" "), scales.join(" ")), true)
            }
            Form::Classic => {
                let laid = classic(points, texture, size);
                (laid.numbers.map(number).join(" "), laid.exact)
            }
        };
        let text = format!("{plane} {name} {laid} {contents} 0 0");
        Line { text, exact }
    }
}

/// A texture as classic lines say it.
struct Classic {
    /// Shift along both coordinates in texels, degrees turned, units per texel along both.
    numbers: [f64; 5],
    exact: bool,
}

/// How far from a right angle the axes of a texture may be, cosine.
const RIGHT_ANGLE: f64 = 1e-3;

/// A texture thrown along the axis that a side faces most; of axes that it faces as much the first of z, x, y.
fn classic(points: [DVec3; 3], texture: &Projection, size: (u32, u32)) -> Classic {
    let [a, b, c] = points;
    let normal = (a - b).cross(c - b).normalize_or_zero();
    let facing = |axis: DVec3| normal.dot(axis).abs();
    let mut along = DVec3::Z;
    for axis in [DVec3::X, DVec3::Y] {
        if facing(axis) > facing(along) + 1e-4 {
            along = axis;
        }
    }
    // The axes that an image which is not turned lies along.
    let (first, second) = match along {
        DVec3::Z => (DVec3::X, DVec3::NEG_Y),
        DVec3::X => (DVec3::Y, DVec3::NEG_Z),
        _ => (DVec3::X, DVec3::NEG_Z),
    };
    let size = [f64::from(size.0), f64::from(size.1)];
    // On the plane a change along the normal is none: so much of it is added that none is left along the axis.
    let thrown = |gradient: DVec3, offset: f64| {
        let part = gradient.dot(along) / normal.dot(along);
        (gradient - normal * part, offset + part * normal.dot(a))
    };
    let (s, s0) = thrown(texture.gradients[0] * size[0], texture.offsets[0] * size[0]);
    let (t, t0) = thrown(texture.gradients[1] * size[1], texture.offsets[1] * size[1]);
    let flat = |v: DVec3| DVec2::new(v.dot(first.abs()), v.dot(second.abs()));
    let (s, t) = (flat(s), flat(t));
    // Turned by an angle, the first axis is (cos, sin) and the second (sin, -cos).
    let (cos, sin) = s.normalize_or(DVec2::X).into();
    let down = DVec2::new(sin, -cos);
    let across = t.dot(down);
    let exact = t.normalize_or_zero().dot(s.normalize_or_zero()).abs() < RIGHT_ANGLE;
    let stretch = |length: f64| 1.0 / if length.abs() < 1e-9 { 1.0 } else { length };
    let shift = |v: f64, width: f64| v - (v / width).floor() * width;
    Classic {
        numbers: [
            shift(s0, size[0]),
            shift(t0, size[1]),
            sin.atan2(cos).to_degrees(),
            stretch(s.length()),
            stretch(across),
        ],
        exact,
    }
}

/// One coordinate of a texture in texels: `axis · p / scale + offset`.
struct Valve {
    axis: DVec3,
    offset: f64,
    scale: f64,
}

fn valve(texture: &Projection, at: usize, size: u32) -> Valve {
    let size = f64::from(size);
    let (gradient, offset) = match at {
        0 => (texture.gradients[0], texture.offsets[0]),
        _ => (texture.gradients[1], texture.offsets[1]),
    };
    let length = gradient.length() * size;
    Valve {
        axis: gradient * size / length,
        offset: offset * size,
        scale: 1.0 / length,
    }
}

/// The texture over the axes of a side's plane: a row for each coordinate.
///
/// The axes are those of Quake III's editors: the first is horizontal, the second points down where the first does not.
fn matrix(points: [DVec3; 3], texture: &Projection) -> [[f64; 3]; 2] {
    let [a, b, c] = points;
    let normal = (a - b).cross(c - b).normalize_or_zero();
    let clean = |v: f64| if v.abs() < ZERO { 0.0 } else { v };
    let normal = DVec3::new(clean(normal.x), clean(normal.y), clean(normal.z));
    let around_y = -normal.z.atan2(normal.x.hypot(normal.y));
    let around_z = normal.y.atan2(normal.x);
    let first = DVec3::new(-around_z.sin(), around_z.cos(), 0.0);
    let second = DVec3::new(
        -around_y.sin() * around_z.cos(),
        -around_y.sin() * around_z.sin(),
        -around_y.cos(),
    );
    // What a texture changes along the normal is the same everywhere on the plane.
    let foot = normal * normal.dot(a);
    let row = |gradient: DVec3, offset: f64| {
        let offset = offset + gradient.dot(foot);
        // An image repeats: small offsets read better.
        let offset = offset - offset.floor();
        [gradient.dot(first), gradient.dot(second), offset]
    };
    let ([s, t], [s0, t0]) = (texture.gradients, texture.offsets);
    [row(s, s0), row(t, t0)]
}

/// Three numbers.
pub(super) fn numbers(v: DVec3) -> String {
    v.to_array().map(number).join(" ")
}

/// A number of a matrix, whose errors grow with the distance from the origin.
fn fine(value: f64) -> String {
    let rounded = (value * 1e10).round() / 1e10;
    format!("{}", rounded + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_of_a_floor_and_of_walls_are_those_of_the_editors() {
        let texture = Projection {
            gradients: [DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.25, 0.0)],
            offsets: [0.125, 0.0],
        };
        // A floor, clockwise seen from above: its axes are y and x.
        let floor = [DVec3::ZERO, DVec3::Y, DVec3::X].map(|p| p * 64.0);
        let [s, t] = matrix(floor, &texture);
        assert!((s[0].abs() < 1e-12) && (s[1] - 0.5).abs() < 1e-12 && s[2] == 0.125);
        assert!((t[0] - 0.25).abs() < 1e-12 && t[1].abs() < 1e-12);
        // A wall that looks along x: its axes are y and down.
        let wall = Projection {
            gradients: [DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.0, 0.0, -0.25)],
            offsets: [0.0; 2],
        };
        let points = [DVec3::ZERO, DVec3::Z, DVec3::Y].map(|p| p * 64.0 + DVec3::X * 8.0);
        let [s, t] = matrix(points, &wall);
        assert!((s[0] - 0.5).abs() < 1e-12 && s[1].abs() < 1e-12, "{s:?}");
        assert!(t[0].abs() < 1e-12 && (t[1] - 0.25).abs() < 1e-12, "{t:?}");
    }
}
