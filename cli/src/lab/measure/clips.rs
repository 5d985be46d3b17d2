//! Pictures of a moving camera, in real time and of the reference, for metrics that see motion (`lab/jod.py`).

use std::path::Path;

use anyhow::{Context, Result};
use glam::Vec3;
use indicatif::ProgressBar;
use q3bsp::Bsp;
use renderer_vk::Settings;
use renderer_vk::path::PathPoint;
use serde_json::{Value, json};

use super::stage::{FRAME_TIME, Stage, TURN, Variant, WALK};
use crate::pictures::{write, write_whole};
use crate::view::Camera;

/// Frames in a second.
const RATE: f32 = 1000.0 / FRAME_TIME as f32;

/// Number of directions that are tried; the camera walks along the one with the longest open way.
const DIRECTIONS: u8 = 16;

/// Distance that the camera keeps to the end of its way, and of points that are tested, units.
const KEPT: f32 = 32.0;
const STEP: f32 = 4.0;

/// What a clip is made of.
pub struct Clip<'a> {
    /// The camera of each frame.
    pub cameras: Vec<Camera>,
    /// Frames with the first camera before the clip.
    pub before: u32,
    /// Frames of the reference of each frame.
    pub reference: u32,
    pub variants: &'a [Variant],
}

impl Clip<'_> {
    /// Draws and writes it: a folder of pictures for each variant and for the reference, `path.txt` with the cameras,
    /// and at last `clip.json`.
    ///
    /// # Errors
    /// The device is lost or out of memory, or a file cannot be written.
    pub fn write(
        &self,
        stage: &mut Stage,
        base: &Settings,
        folder: &Path,
        bar: &ProgressBar,
    ) -> Result<Value> {
        let Some(first) = self.cameras.first() else {
            return Ok(Value::Null);
        };
        let make = |name: &str| {
            let folder = folder.join(name);
            std::fs::create_dir_all(&folder)
                .with_context(|| format!("{}: cannot be made", folder.display()))?;
            anyhow::Ok(folder)
        };
        let time = |frame: usize| (frame as i32).saturating_mul(FRAME_TIME as i32);
        for Variant { name, settings } in self.variants {
            let folder = make(name)?;
            stage.cut(first, settings)?;
            for _ in 0..self.before {
                stage.frame_at(first, time(0), &[])?;
                bar.inc(1);
            }
            for (number, camera) in self.cameras.iter().enumerate() {
                stage.frame_at(camera, time(number), &[])?;
                write(&picture(&folder, number), &stage.picture()?)?;
                bar.inc(1);
            }
        }
        let reference = make("reference")?;
        for (number, camera) in self.cameras.iter().enumerate() {
            let at = (camera, time(number));
            let (truth, _) = stage.reference_at(base, at, &[], self.reference, bar)?;
            write(&picture(&reference, number), &truth)?;
        }
        let lines: String = (self.cameras.iter().enumerate())
            .map(|(number, camera)| {
                let mut def = camera.ref_def(stage.size, stage.fov);
                def.time_ms = time(number);
                PathPoint::of(&def).line()
            })
            .collect();
        write_whole(&folder.join("path.txt"), lines.as_bytes())?;
        let names: Vec<_> = self.variants.iter().map(|variant| variant.name).collect();
        let about = json!({
            "rate": RATE, "frames": self.cameras.len(), "width": stage.size.0, "height": stage.size.1,
            "reference_frames": self.reference, "pictures": names,
        });
        write_whole(&folder.join("clip.json"), format!("{about:#}\n").as_bytes())?;
        Ok(about)
    }
}

fn picture(folder: &Path, number: usize) -> std::path::PathBuf {
    folder.join(format!("{number:04}.png"))
}

/// Cameras of a walk from a place, along the direction in which the way is longest, while the camera turns.
pub fn walk(bsp: &Bsp, from: &Camera, frames: usize) -> Vec<Camera> {
    let wanted = WALK * frames as f32;
    let is_open = |at: Vec3| bsp.cluster_at(at) >= 0;
    let (direction, way) = longest_way(from.origin, wanted + KEPT, is_open);
    let way = (way - KEPT).max(0.0);
    (0..frames)
        .map(|frame| {
            let frame = frame as f32;
            Camera {
                origin: from.origin + direction * (WALK * frame).min(way),
                yaw: from.yaw + TURN * frame,
                ..*from
            }
        })
        .collect()
}

/// The horizontal direction in which the longest way is open, and its length, at most `wanted`.
fn longest_way(from: Vec3, wanted: f32, is_open: impl Fn(Vec3) -> bool) -> (Vec3, f32) {
    let length = |direction: Vec3| {
        let steps = (1..).map(|step: u16| f32::from(step) * STEP);
        let blocked =
            (steps.take_while(|way| *way < wanted)).find(|way| !is_open(from + direction * *way));
        blocked.map_or(wanted, |way| way - STEP)
    };
    (0..DIRECTIONS)
        .map(|number| {
            let angle = std::f32::consts::TAU * f32::from(number) / f32::from(DIRECTIONS);
            let direction = Vec3::new(angle.cos(), angle.sin(), 0.0);
            (direction, length(direction))
        })
        // the first of equal ones
        .reduce(|best, next| if next.1 > best.1 { next } else { best })
        .unwrap_or((Vec3::X, 0.0))
}

#[cfg(test)]
mod tests {
    use q3bsp::builder::MapBuilder;

    use super::*;

    #[test]
    fn a_camera_walks_where_the_way_is_longest_and_stays_inside() {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("wall", 0, q3bsp::content_flags::SOLID);
        map.add_room(
            wall,
            Vec3::new(-40.0, -500.0, 0.0),
            Vec3::new(40.0, 60.0, 100.0),
        );
        let bsp = map.build();
        let from = Camera {
            origin: Vec3::new(0.0, 0.0, 50.0),
            yaw: 10.0,
            pitch: 0.0,
        };
        let cameras = walk(&bsp, &from, 120);
        assert_eq!(cameras.len(), 120);
        assert_eq!(cameras[0].origin, from.origin);
        let end = cameras[119];
        assert!(
            (end.origin.y + WALK * 119.0).abs() < 0.01,
            "towards -y: {end:?}"
        );
        assert_eq!(end.yaw, from.yaw + TURN * 119.0);
        let far = walk(&bsp, &from, 2000);
        assert!(far.iter().all(|c| bsp.cluster_at(c.origin) >= 0));
        assert!(far[1999].origin.y < -440.0);
        // in the wall
        let lost = Camera {
            origin: Vec3::splat(5000.0),
            ..from
        };
        assert_eq!(walk(&bsp, &lost, 3)[2].origin, lost.origin);
    }
}
