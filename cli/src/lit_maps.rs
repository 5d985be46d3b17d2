//! Maps in the light that a game finds in them.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use relight::{CalibrationCache, CalibrationOptions, Options, RelitWorld};

use crate::game::Maps;
use crate::scripts::load_scripts;
use crate::view::open;

// The maps of a command line, and how their light is found. (A documentation comment would replace a subcommand's own.)
#[derive(Args, Debug)]
pub struct LitMaps {
    #[command(flatten)]
    pub chosen: Maps,
    /// Do not fit lights to the map's lightmaps first (the game does)
    #[arg(long)]
    no_calibration: bool,
    /// Keep what calibration and rays find in this folder, and take it from there
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
}

impl LitMaps {
    /// The folder of kept results.
    pub fn cache(&self) -> Option<CalibrationCache> {
        self.cache.as_ref().map(CalibrationCache::new)
    }

    /// Loads a map with measured materials and all its lights, those of its `.lights` file included; also its game path.
    /// Prints its warnings.
    ///
    /// # Errors
    /// The map cannot be found or read.
    pub fn load(&self, map: &str) -> Result<(RelitWorld, String)> {
        let (files, map) = open(map, &self.chosen.game)?;
        let (materials, _) = load_scripts(&*files);
        let calibrate = (!self.no_calibration).then(|| CalibrationOptions {
            cache: self.cache(),
            ..CalibrationOptions::default()
        });
        let options = Options {
            calibrate,
            by_hand: false,
            ..Options::default()
        };
        let mut world = RelitWorld::load(&*files, &materials, &map, options)?;
        // calibration has measured them
        if self.no_calibration {
            world.measure_materials(&*files);
        }
        world.light_by_hand(&*files);
        for warning in &world.warnings {
            log::warn!("{warning}");
        }
        Ok((world, map))
    }
}
