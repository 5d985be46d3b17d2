//! Camera paths: the views of a game, frame by frame, as text, for repeated measurements without the game.
//!
//! One line per frame: time in milliseconds, origin, pitch, yaw and roll in degrees, both angles of the field of view
//! in degrees, separated by spaces. Empty lines and text after a `#` are ignored.

use glam::{Mat3, Vec3};
use thiserror::Error;

use crate::api::RefDef;

/// A frame's camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Game time, milliseconds.
    pub time_ms: i32,
    /// Units.
    pub origin: Vec3,
    /// Degrees: pitch (down), yaw (from east to north), roll (clockwise).
    pub angles: Vec3,
    /// Full angles, degrees.
    pub fov: [f32; 2],
}

/// A line that is not a camera.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("line {line}: {text:?} is not TIME X Y Z PITCH YAW ROLL FOV_X FOV_Y")]
pub struct PathError {
    /// Line number, from 1.
    pub line: usize,
    /// Text of the line.
    pub text: String,
}

impl PathPoint {
    /// The camera of a view.
    pub fn of(def: &RefDef) -> Self {
        let [forward, left, up] = def.view_axis;
        Self {
            time_ms: def.time_ms,
            origin: def.view_origin,
            angles: Vec3::new(
                (-forward.z).clamp(-1.0, 1.0).asin(),
                forward.y.atan2(forward.x),
                (left.z).atan2(up.z),
            )
            .map(f32::to_degrees),
            fov: [def.fov_x, def.fov_y],
        }
    }

    /// The camera a part of the way from one to another; angles take the shorter way.
    pub fn between(&self, other: &Self, part: f32) -> Self {
        let mix = |from: f32, to: f32| from + (to - from) * part;
        let turn =
            |from: f32, to: f32| from + ((to - from + 180.0).rem_euclid(360.0) - 180.0) * part;
        let (a, b) = (self.angles, other.angles);
        let time = f64::from(self.time_ms)
            + (f64::from(other.time_ms) - f64::from(self.time_ms)) * f64::from(part);
        #[allow(clippy::cast_possible_truncation)] // saturates
        Self {
            time_ms: time.round() as i32,
            origin: self.origin.lerp(other.origin, part),
            angles: Vec3::new(turn(a.x, b.x), turn(a.y, b.y), turn(a.z, b.z)),
            fov: [
                mix(self.fov[0], other.fov[0]),
                mix(self.fov[1], other.fov[1]),
            ],
        }
    }

    /// Forward, left, up.
    pub fn axis(&self) -> [Vec3; 3] {
        let [pitch, yaw, roll] = self.angles.map(f32::to_radians).to_array();
        let turn =
            Mat3::from_rotation_z(yaw) * Mat3::from_rotation_y(pitch) * Mat3::from_rotation_x(roll);
        [turn.x_axis, turn.y_axis, turn.z_axis]
    }

    /// The view for a picture of this size. The horizontal angle is kept; the vertical angle follows from the size's
    /// aspect ratio, which may differ from the recorded one.
    pub fn ref_def(&self, width: u32, height: u32) -> RefDef {
        let half = (self.fov[0].clamp(1.0, 170.0).to_radians() * 0.5).tan();
        #[allow(clippy::cast_precision_loss)] // pixels
        let shape = height as f32 / width.max(1) as f32;
        RefDef {
            width: i32::try_from(width).unwrap_or(i32::MAX),
            height: i32::try_from(height).unwrap_or(i32::MAX),
            fov_x: self.fov[0].clamp(1.0, 170.0),
            fov_y: (half * shape).atan().to_degrees() * 2.0,
            view_origin: self.origin,
            view_axis: self.axis(),
            time_ms: self.time_ms,
            ..RefDef::default()
        }
    }

    /// The line of a path file.
    pub fn line(&self) -> String {
        let Self {
            time_ms,
            origin: o,
            angles: a,
            fov: [across, down],
        } = self;
        format!(
            "{time_ms} {} {} {} {} {} {} {across} {down}\n",
            o.x, o.y, o.z, a.x, a.y, a.z
        )
    }
}

/// The camera at a place of a path, counted in frames from the first; before it and after the last, the path rests.
/// `None`: the path is empty.
pub fn camera_at(points: &[PathPoint], place: f32) -> Option<PathPoint> {
    let last = points.len().checked_sub(1)?;
    #[allow(clippy::cast_precision_loss)] // a number of frames
    let place = place.clamp(0.0, last as f32);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within the path
    let index = place as usize;
    let (from, to) = (points.get(index)?, points.get((index + 1).min(last))?);
    Some(from.between(to, place.fract()))
}

/// Reads a path file.
///
/// # Errors
/// The first line that is not a camera.
pub fn parse(text: &str) -> Result<Vec<PathPoint>, PathError> {
    let mut points = Vec::new();
    for (index, full) in text.lines().enumerate() {
        let line = full.split_once('#').map_or(full, |(line, _)| line).trim();
        if line.is_empty() {
            continue;
        }
        let point = point(line).ok_or_else(|| PathError {
            line: index + 1,
            text: line.to_owned(),
        })?;
        points.push(point);
    }
    Ok(points)
}

fn point(line: &str) -> Option<PathPoint> {
    let mut words = line.split_whitespace();
    let time_ms = words.next()?.parse().ok()?;
    let numbers = words
        .map(|word| word.parse::<f32>().ok().filter(|n| n.is_finite()))
        .collect::<Option<Vec<f32>>>()?;
    let [x, y, z, pitch, yaw, roll, across, down] = numbers[..].try_into().ok()?;
    Some(PathPoint {
        time_ms,
        origin: Vec3::new(x, y, z),
        angles: Vec3::new(pitch, yaw, roll),
        fov: [across, down],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_lines_round_trip() {
        let point = PathPoint {
            time_ms: 1234,
            origin: Vec3::new(1.5, -2.25, 300.0),
            angles: Vec3::new(20.0, -135.0, 10.0),
            fov: [90.0, 73.739_8],
        };
        let read = parse(&format!("# a comment\n\n{}", point.line())).unwrap();
        assert_eq!(read, [point]);
        let def = point.ref_def(640, 480);
        let [forward, left, up] = def.view_axis;
        assert!(forward.cross(left).distance(up) < 1.0e-5);
        assert!(forward.z < 0.0, "pitch looks down");
        let again = PathPoint::of(&def);
        assert!(again.angles.distance(point.angles) < 1.0e-3, "{again:?}");
        assert!((again.fov[1] - point.fov[1]).abs() < 1.0e-3);
    }

    #[test]
    fn cameras_between_frames_take_the_shorter_way() {
        let point = |time_ms, x, yaw| PathPoint {
            time_ms,
            origin: Vec3::new(x, 0.0, 0.0),
            angles: Vec3::new(0.0, yaw, 0.0),
            fov: [90.0, 60.0],
        };
        let path = [point(0, 0.0, 170.0), point(50, 10.0, -170.0)];
        let middle = camera_at(&path, 0.5).unwrap();
        assert_eq!(middle.time_ms, 25);
        assert_eq!(middle.origin.x, 5.0);
        let straight = point(25, 5.0, 180.0).axis();
        for (axis, exact) in middle.axis().into_iter().zip(straight) {
            assert!(axis.distance(exact) < 1.0e-5, "{axis} {exact}");
        }
        assert_eq!(camera_at(&path, 0.0), Some(path[0]));
        for place in [1.0, 7.0] {
            assert!(
                camera_at(&path, place)
                    .unwrap()
                    .origin
                    .distance(path[1].origin)
                    < 1.0e-5
            );
        }
        assert_eq!(camera_at(&path, -1.0), Some(path[0]));
        assert_eq!(camera_at(&[], 0.0), None);
    }

    #[test]
    fn bad_lines_are_named() {
        let error = parse("0 1 2 3 4 5 6 90 74\n0 1 2 3 4 5 6 90").unwrap_err();
        assert_eq!(error.line, 2);
        assert!(parse("0 1 2 nan 4 5 6 90 74").is_err());
        assert!(parse("0 1 2 3 4 5 6 90 74 8").is_err());
        assert_eq!(parse("").unwrap(), []);
    }
}
