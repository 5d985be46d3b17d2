//! Loads maps with the light that the game shows them in.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use relight::{CalibrationCache, CalibrationOptions, Options, RelitWorld};

use crate::game::Maps;
use crate::scripts::load_scripts;
use crate::view::open;

// The maps, and the options of calibration. (A documentation comment would replace the subcommand's description.)
#[derive(Args, Debug)]
pub struct LitMaps {
    #[command(flatten)]
    pub chosen: Maps,
    /// Do not fit lights to the map's lightmaps first (the game does)
    #[arg(long)]
    no_calibration: bool,
    /// Cache calibrations and swept light lists in this folder
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
}

impl LitMaps {
    /// The cache folder.
    pub fn cache(&self) -> Option<CalibrationCache> {
        self.cache.as_ref().map(CalibrationCache::new)
    }

    /// Loads a map with measured materials and all its lights, those of its `.lights` file included; also returns its
    /// game path. Prints its warnings.
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
        // calibration measures them, too
        if self.no_calibration {
            world.measure_materials(&*files);
        }
        world.read_by_hand(&*files);
        for warning in &world.warnings {
            log::warn!("{warning}");
        }
        Ok((world, map))
    }
}
