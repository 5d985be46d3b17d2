//! Maps written for other programs.
//!
//! * [`Export`]: what is written: a relit world, and where its images come from.
//! * [`export`]: writes one map in a [`Format`]; a file appears whole or not at all.
//! * `geometry`: what is drawn, joined by material, without what other programs stumble over.
//! * `model_file`: models that entities name besides brushes.
//! * `layers`: stages weighted by vertex alpha, as materials of their own.
//! * `look`: a material's stages as far as other programs can say them.
//! * `reflection`: roughness, metal, reflectance and normals that packs and files state.
//! * [`ImageStore`]: images as files, each made once for all maps.
//!
//! # Space
//!
//! Maps have z up and triangles that are clockwise seen from the front. Where a format has y up and counter-clockwise
//! triangles, a point (x, y, z) becomes `scale` · (x, z, −y), a pure rotation, and the corners of every triangle are
//! written in reverse.

mod emission;
mod extras;
mod film;
mod geometry;
mod gltf;
mod images;
pub mod json;
mod layers;
mod lightmaps;
mod look;
mod losses;
mod map;
mod model_file;
mod obj;
mod output;
mod reflection;
mod shown;
mod sky;
mod stack;
mod vertex_light;

pub use extras::material as material_json;
pub use images::{Encoded, ImageStore, Mime};
pub use output::Output;

use crate::files::GameFiles;
use crate::materials::Materials;
use crate::world::RelitWorld;
use std::io;
use std::path::{Path, PathBuf};

/// Length of an id unit in metres that [`ExportOptions::default`] uses: a power of two, so that nothing is rounded.
/// A player of 56 units is 1.75 m tall.
pub const METRES_PER_UNIT: f32 = 1.0 / 32.0;

/// A format that maps are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// glTF 2.0 in one binary file.
    Glb,
    /// glTF 2.0 as JSON, with its data beside it.
    Gltf,
    /// Wavefront OBJ with its MTL.
    Obj,
    /// Brushes, patches and entities, for level editors and compilers.
    Map,
    /// Everything, as [`json`].
    Json,
}

impl Format {
    /// All formats.
    pub const ALL: [Format; 5] = [
        Format::Glb,
        Format::Gltf,
        Format::Obj,
        Format::Map,
        Format::Json,
    ];

    /// Extension of its files, without the dot; also the name that users give.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Glb => "glb",
            Format::Gltf => "gltf",
            Format::Obj => "obj",
            Format::Map => "map",
            Format::Json => "json",
        }
    }

    /// The format of an extension, given without its dot, case of no importance.
    pub fn from_extension(extension: &str) -> Option<Format> {
        Format::ALL
            .into_iter()
            .find(|format| format.extension().eq_ignore_ascii_case(extension))
    }
}

/// What becomes of a map's lightmaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lightmaps {
    /// Materials need no light, and colours of vertices hold that of the lightmaps: every program shows the map lit. The
    /// lightmaps are there with their coordinates, unused.
    #[default]
    Vertices,
    /// Materials are lit by lightmaps, for programs that support them.
    Keep,
    /// Left out, for programs that compute light themselves.
    Strip,
}

/// What becomes of the sky.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sky {
    /// A box around the map, a picture a side.
    #[default]
    Box,
    /// A ball around the map with one picture all round (equirectangular).
    Panorama,
    /// Left out.
    Strip,
}

/// Where images go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ImagePlace {
    /// What the format usually does: inside a single binary file, beside a text file.
    #[default]
    Usual,
    /// Inside the file, where the format can.
    Embed,
    /// As files of their own, in a folder that all maps of one output folder share.
    Beside,
    /// Nowhere: geometry, materials by name and colour, lights and entities alone. No image is read.
    None,
}

/// How sides of brushes say how their textures lie, in [`Format::Map`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Brushes {
    /// As the editors of the map's game have it: [`Brushes::Valve`] for Quake, Quake II and Half-Life, else
    /// [`Brushes::Primitives`].
    #[default]
    Usual,
    /// Brush primitives (`brushDef`).
    Primitives,
    /// Valve 220.
    Valve,
    /// Quake's first form: every editor and compiler reads it, but it cannot say all ways to lay a texture.
    Classic,
}

/// How a map is written. Patches were tessellated when the world was loaded ([`Options::subdivisions`]).
///
/// [`Options::subdivisions`]: crate::Options::subdivisions
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportOptions {
    /// Length of an id unit in the output; positive and finite.
    pub scale: f32,
    /// What becomes of lightmaps.
    pub lightmaps: Lightmaps,
    /// Where images go.
    pub images: ImagePlace,
    /// How sides of brushes say how their textures lie.
    pub brushes: Brushes,
    /// Whether lights of the format's kinds (points, spots, suns) are written, and lamps glow as strongly as the light
    /// that they are. With lightmaps all light is there twice.
    pub lights: bool,
    /// What all light is multiplied by; the map's own [`display_exposure`](RelitWorld::display_exposure) where it
    /// is `None`.
    pub exposure: Option<f32>,
    /// What becomes of the sky.
    pub sky: Sky,
    /// Whether the sky shines as strongly as its light in the map, instead of as bright as the game shows it.
    pub sky_light: bool,
    /// Whether moving textures, pulsing colours and images that follow each other are written as animations, which strict
    /// readers of glTF refuse.
    pub animate: bool,
}

impl Export<'_> {
    /// What all light is multiplied by.
    fn exposure(&self) -> f32 {
        let found = self.options.exposure;
        found.unwrap_or_else(|| self.world.display_exposure().scale)
    }
}

impl Default for ExportOptions {
    /// Metres, light in vertices and none besides, the sky as bright as in the game, nothing animated.
    fn default() -> Self {
        ExportOptions {
            scale: METRES_PER_UNIT,
            lightmaps: Lightmaps::default(),
            images: ImagePlace::default(),
            brushes: Brushes::default(),
            lights: false,
            exposure: None,
            sky: Sky::default(),
            sky_light: false,
            animate: false,
        }
    }
}

/// What is exported.
pub struct Export<'a> {
    /// The map with its materials and lights.
    pub world: &'a RelitWorld,
    /// Where images and models of entities come from.
    pub files: &'a dyn GameFiles,
    /// What models of entities are drawn with.
    pub materials: &'a Materials,
    /// Images as files; shared between maps.
    pub images: &'a ImageStore,
    /// How it is written.
    pub options: ExportOptions,
}

/// Why a map could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A file could not be written.
    #[error("{path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// More than the format can hold.
    #[error("{what} is {found}, more than the {limit} that the format can hold")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// How large it is.
        found: u64,
        /// How large it may be.
        limit: u64,
    },
    /// An option that makes no sense.
    #[error("{what} is {found}; it must be a positive number")]
    Option {
        /// Which one.
        what: &'static str,
        /// What it is.
        found: f32,
    },
    /// An image could not be encoded.
    #[error("image {name}: {reason}")]
    Image {
        /// Name of the image.
        name: String,
        /// Error of the encoder.
        reason: String,
    },
}

/// What was written.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExportReport {
    /// Files written, with their sizes in bytes; files that were there already with the same content are among them.
    pub files: Vec<(PathBuf, u64)>,
    /// Triangles.
    pub triangles: usize,
    /// Triangles left out because they have no area.
    pub degenerate: usize,
    /// Vertices.
    pub vertices: usize,
    /// Materials.
    pub materials: usize,
    /// Images.
    pub images: usize,
    /// Properties that the format cannot represent, each once, and the world's own warnings.
    pub warnings: Vec<String>,
}

/// Writes a map to `path`, and the files that belong to it beside it.
///
/// All files are written under other names first and renamed when everything has been written, the named one last: a
/// reader never opens a partial file.
///
/// # Errors
/// [`ExportError`] when the format cannot hold the map or a file cannot be written; then nothing is left behind.
pub fn export(
    source: &Export<'_>,
    format: Format,
    path: &Path,
) -> Result<ExportReport, ExportError> {
    for (what, found) in [
        ("scale", Some(source.options.scale)),
        ("exposure", source.options.exposure),
    ] {
        if let Some(found) = found.filter(|v| !(v.is_finite() && *v > 0.0)) {
            return Err(ExportError::Option { what, found });
        }
    }
    let mut output = Output::new(path);
    let mut report = match format {
        Format::Glb => gltf::write(source, gltf::Container::Binary, &mut output)?,
        Format::Gltf => gltf::write(source, gltf::Container::Text, &mut output)?,
        Format::Obj => obj::write(source, &mut output)?,
        Format::Map => map::write(source, &mut output)?,
        Format::Json => json::write(source, &mut output)?,
    };
    report.files = output.finish()?;
    report
        .warnings
        .extend(source.world.warnings.iter().cloned());
    Ok(report)
}

/// A map without game files, for tests.
#[cfg(test)]
fn uncalibrated(bsp: q3bsp::Bsp) -> RelitWorld {
    let files = crate::MemoryFiles::new();
    let (materials, _) = Materials::load(&files);
    let options = crate::Options {
        calibrate: None,
        ..crate::Options::default()
    };
    RelitWorld::from_bsp(&files, &materials, "maps/t.bsp", bsp, options)
}
