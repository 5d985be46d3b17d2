//! Normal and specular mapping of the classic look: which draws have it (`shaders/raster/surface_mapping.glsl`).

use shaders::types::DRAW_STAGES;
use shaders::types::constants as c;

use crate::assets::{Material, TextureLight};
use crate::settings::Settings;

/// The kinds of maps that the classic look shows, by `opengl2`'s settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceMapping {
    /// Normal maps (`r_normalMapping`).
    pub normals: bool,
    /// Roughness, metal and reflectance (`r_specularMapping`).
    pub highlights: bool,
    /// `MAPPING_*` of surfaces whose normal map has heights (`r_parallaxMapping`).
    pub heights: u32,
}

impl SurfaceMapping {
    /// By the settings.
    pub fn new(settings: &Settings) -> Self {
        Self {
            normals: settings.normal_mapping,
            highlights: settings.specular_mapping,
            heights: match settings.parallax_mapping {
                // as in `opengl2`, none without normal maps
                0 => 0,
                _ if !settings.normal_mapping => 0,
                1 => c::MAPPING_HEIGHTS,
                _ => c::MAPPING_HEIGHTS | c::MAPPING_RELIEF,
            },
        }
    }

    /// `MAPPING_*` of a material, without the stages; 0: it has no such map.
    fn of(self, material: &Material) -> u32 {
        let bit = |in_use: bool, flag: u32, bit: u32| {
            if in_use && material.flags & flag != 0 {
                bit
            } else {
                0
            }
        };
        bit(self.normals, c::MATERIAL_NORMALS, c::MAPPING_NORMALS)
            | bit(self.highlights, c::MATERIAL_ROUGH, c::MAPPING_SPECULAR)
    }

    /// `MAPPING_*` of a draw of a material; `None` unless the material has such maps, and the draw has both its first texture
    /// and the light of it. `stages`: those of the draw; bit i of `textures`: stage i has a texture.
    pub(super) fn of_draw(
        self,
        material: &Material,
        stages: [u32; DRAW_STAGES],
        textures: u32,
    ) -> Option<u32> {
        let maps = self.of(material);
        let lit = material.lit_texture.filter(|_| maps != 0)?;
        let place = |stage: u32| {
            let mut places = (0u32..).zip(stages);
            let found = places.find(|&(at, drawn)| drawn == stage && textures >> at & 1 != 0);
            found.map(|(at, _)| at)
        };
        let texture = place(lit.texture)?;
        let (source, light) = match lit.light {
            TextureLight::Lightmap(stage) => (c::MAPPING_BAKED, place(stage)? + 1),
            TextureLight::Vertices => (c::MAPPING_BAKED, 0),
            TextureLight::Grid => (c::MAPPING_OF_GRID, 0),
        };
        // they move textures of the map alone
        let heights = match source {
            c::MAPPING_BAKED if material.flags & c::MATERIAL_HEIGHTS != 0 => self.heights,
            _ => 0,
        };
        let places = texture << c::MAPPING_TEXTURE_SHIFT | light << c::MAPPING_LIGHT_SHIFT;
        Some(maps | source | places | heights)
    }
}
