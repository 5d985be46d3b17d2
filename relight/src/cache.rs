//! The folder of cached results on disk, for calibrations and swept light lists: file names, keys, atomic writes.
//!
//! The file name is the hash of everything that a result depends on, so a file is either current or absent.

use crate::world::RelitWorld;
use std::io;
use std::path::{Path, PathBuf};
use support::hash::Hash;

/// A folder of cached results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CalibrationCache {
    folder: PathBuf,
}

/// Reason why a cached result could not be read or written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CacheError {
    #[error("{}: cannot be read: {source}", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("{}: cannot be written: {source}", path.display())]
    Write { path: PathBuf, source: io::Error },
    #[error("{}: {source}; the map is calibrated again", path.display())]
    Damaged {
        path: PathBuf,
        source: serde_json::Error,
    },
    #[error("{}: {what}; the lists of lights are swept again", path.display())]
    Lists { path: PathBuf, what: &'static str },
}

impl CalibrationCache {
    /// A cache in a folder, which is created when the first result is written.
    pub fn new(folder: impl Into<PathBuf>) -> CalibrationCache {
        CalibrationCache {
            folder: folder.into(),
        }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Path of a result of a kind.
    pub(crate) fn path(&self, key: u128, kind: &str) -> PathBuf {
        self.folder.join(format!("{key:032x}.{kind}"))
    }

    /// Writes a file atomically: it appears whole or not at all.
    pub(crate) fn write_file(&self, path: PathBuf, bytes: &[u8]) -> Result<(), CacheError> {
        let unfinished = path.with_extension(format!("{}.part", std::process::id()));
        let write = || {
            std::fs::create_dir_all(&self.folder)?;
            std::fs::write(&unfinished, bytes)?;
            std::fs::rename(&unfinished, &path)
        };
        write().map_err(|source| {
            // Removes the temporary file of a failed attempt, if there is one.
            let _ = std::fs::remove_file(&unfinished);
            CacheError::Write { path, source }
        })
    }
}

/// Bytes of a file; `None` if it does not exist.
pub(crate) fn read_file(path: &Path) -> Result<Option<Vec<u8>>, CacheError> {
    match std::fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(CacheError::Read {
            path: path.into(),
            source,
        }),
    }
}

/// Hashes everything that light in a world depends on: geometry, materials, lights.
pub(crate) fn add_world(hash: &mut Hash, world: &RelitWorld) {
    // The file's bytes: lightmaps, geometry, PVS. The entities hold the size of the light grid.
    hash.bytes(&world.bsp.write());
    for surface in &world.surfaces {
        for number in [
            surface.material,
            surface.model,
            surface.first_index,
            surface.num_indices,
            surface.light_page as u32,
        ] {
            hash.number(u64::from(number));
        }
    }
    for vertex in &world.vertices {
        hash.vector(vertex.position);
    }
    for material in &world.materials {
        hash.number(u64::from(material.is_sky()));
        let passed = u64::from(material.class.passed);
        hash.number(material.class.class as u64 | passed << 8);
        hash.number(u64::from(material.emission.is_some()));
        hash.vector(material.albedo);
        if let Some(holes) = &material.holes {
            hash.bytes(&holes.bytes());
        }
        for shade in &material.shades {
            hash.vector(shade.linear);
            hash.vector(shade.encoded);
            hash.vector(shade.mirrored);
        }
        hash.vector(material.shown);
        for style in &material.baked.styles {
            hash.bytes(format!("{style:?}").as_bytes());
        }
    }
    for page in &world.pages {
        hash.bytes(&page.0);
    }
    for light in &world.lights {
        light.vertices.iter().for_each(|v| hash.vector(*v));
        hash.vector(light.radiance);
        hash.number(u64::from(light.surface) << 8 | u64::from(light.two_sided));
        hash.number(light.source as u64);
    }
    for light in &world.point_lights {
        hash.vector(light.origin);
        hash.vector(light.intensity);
        hash.number(u64::from(light.falloff.reach().unwrap_or(0.0).to_bits()));
    }
    for sun in &world.suns {
        hash.vector(sun.direction);
        hash.vector(sun.irradiance);
    }
    hash.vector(world.ambient);
    hash.number(u64::from(world.color_exponent.to_bits()));
}
