//! The map that a command shows, and where it looks from.

use std::sync::Arc;

use anyhow::Context;
use clap::Args;
use glam::Vec3;
use q3bsp::Bsp;
use relight::GameFiles;
use relight::sample::Sample;

use crate::game::Game;
use crate::numbers;
use crate::sample::parse_sample;
use crate::view::{Camera, open};

// No documentation comments on these structures: clap would show them in place of the subcommand's description.

// One map, or the sample.
#[derive(Args, Clone, Debug)]
pub struct ChosenMap {
    /// The map: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) with one map, or pack.pk3:maps/x.bsp
    #[arg(required_unless_present = "sample", value_name = "MAP")]
    pub map: Option<String>,
    /// Use a built-in map: hall, which is the default, or surfaces
    #[arg(long, conflicts_with = "map", num_args = 0..=1, default_missing_value = "hall", value_parser = parse_sample,
        value_name = "NAME")]
    pub sample: Option<Sample>,
    #[command(flatten)]
    pub game: Game,
}

impl ChosenMap {
    /// Opens the files; also returns the map's game path.
    ///
    /// # Errors
    /// A folder or the map cannot be read.
    pub fn open(&self) -> anyhow::Result<(Arc<dyn GameFiles>, String)> {
        match &self.map {
            Some(map) => open(map, &self.game),
            // `clap` demands a map without `--sample`
            None => {
                let sample = self.sample.unwrap_or_default();
                let files = Arc::new(sample.files()?) as Arc<dyn GameFiles>;
                Ok((files, sample.map().to_owned()))
            }
        }
    }
}

// A camera, or a spawn point.
#[derive(Args, Clone, Debug, Default)]
pub struct ChosenCamera {
    /// Camera: position in units, yaw and pitch (down) in degrees, which may be left out; default: the map's
    /// intermission or first spawn point
    #[arg(long, value_parser = parse_view, allow_hyphen_values = true, value_name = "X,Y,Z,YAW,PITCH")]
    pub view: Option<Camera>,
    /// View from a spawn point, counted from 0 in the map's order
    #[arg(long, value_name = "N", conflicts_with = "view")]
    pub spawn: Option<usize>,
}

impl ChosenCamera {
    /// The camera; `None` if the map's own is wanted.
    ///
    /// # Errors
    /// The map has no such spawn point.
    pub fn find(&self, bsp: &Bsp) -> anyhow::Result<Option<Camera>> {
        let Some(number) = self.spawn else {
            return Ok(self.view);
        };
        let spawns = Camera::spawns(bsp);
        let found = spawns.get(number).copied();
        let found = found.with_context(|| match spawns.len() {
            0 => format!("no spawn point {number}: the map has none"),
            count => format!("no spawn point {number}: the map has 0 to {}", count - 1),
        })?;
        Ok(Some(found))
    }
}

/// Parses `X,Y,Z[,YAW[,PITCH]]`; spaces may replace commas.
pub fn parse_view(text: &str) -> Result<Camera, String> {
    match numbers::list(text).as_deref() {
        Some([x, y, z, rest @ ..]) if rest.len() <= 2 => Ok(Camera {
            origin: Vec3::new(*x, *y, *z),
            yaw: rest.first().copied().unwrap_or(0.0),
            pitch: rest.get(1).copied().unwrap_or(0.0),
        }),
        _ => Err("a view is X,Y,Z,YAW,PITCH, for example 100,-50,80,90,10".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_read_as_people_write_them() {
        let view = parse_view("1,-2.5, 3,90,-10").unwrap();
        assert_eq!(view.origin, Vec3::new(1.0, -2.5, 3.0));
        assert_eq!((view.yaw, view.pitch), (90.0, -10.0));
        assert_eq!(parse_view("1 2 3").unwrap().yaw, 0.0);
        for wrong in ["", "1,2", "1,2,3,4,5,6", "a,b,c", "1,2,nan"] {
            assert!(parse_view(wrong).is_err(), "{wrong}");
        }
    }
}
