//! Emission and reflectance of materials, measured on their images.

use super::Finder;
use crate::exposure::DEFAULT_EXPONENT;
use crate::files::GameFiles;
use crate::materials::Materials;
use crate::world::WorldMaterial;
use crate::world::pages::PageLoader;
use glam::Vec3;
use shaderscript::ImplicitKind;
use std::sync::Arc;

impl WorldMaterial {
    /// A material without a map, resolved as a map's would be: with the flags of its script, its emission and its
    /// reflectance.
    pub fn by_name(
        files: &dyn GameFiles,
        materials: &Materials,
        name: &str,
        lighting: ImplicitKind,
    ) -> WorldMaterial {
        let resolved = materials.resolve(files, name, lighting);
        let definition = resolved.definition();
        let flags = (definition.surface_flags, definition.content_flags);
        let mut pages = PageLoader::new(files);
        let mut material = WorldMaterial::new(name, flags, lighting, resolved, &mut pages);
        let mut finder = Finder::new(files, DEFAULT_EXPONENT);
        material.emission = finder.emission(&material);
        material.flicker = finder.flicker(&material);
        material.measure_reflection(&mut finder, [255; 4]);
        material.shown = finder.shown(&material);
        material
    }

    /// Measures its reflectance and its holes. `corners`: mean colour of its vertices.
    pub(crate) fn measure_reflection(&mut self, finder: &mut Finder<'_>, corners: [u8; 4]) {
        self.shades = finder.shades(self, corners);
        self.holes = finder.holes(self).map(Arc::new);
        let count = self.shades.len().max(1) as f32;
        let mean = self.shades.iter().map(|s| s.linear).sum::<Vec3>() / count;
        self.albedo = (mean.min(Vec3::ONE) * self.stored_scale()).min(Vec3::ONE);
    }
}
