//! Materials of a map that was compiled without light.

use shaders::types::constants as c;
use support::slice::{part_mut, span};

use super::materials::Materials;

impl Materials {
    /// Lets lightmap stages of these materials show traced light. The engine draws them white on surfaces without a
    /// lightmap, which is the author's wish only in a map that has lightmaps.
    pub fn light_unlit(&mut self, materials: impl Iterator<Item = u32>) {
        for index in materials {
            let material = self.get(index);
            let range = span(material.stage_first, material.stage_count);
            for stage in part_mut(&mut self.arrays.stages, range) {
                stage.flags &= !c::STAGE_NO_LIGHTMAP;
            }
        }
        self.touch();
    }
}
