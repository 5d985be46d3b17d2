//! Output of the console command `shaderlist`.

use super::super::material::{Combine, LightmapClass, Material};
use super::Materials;

impl Materials {
    /// Lines for `shaderlist`, one for each material and lightmap page: number of passes, `L` with a lightmap, `E` with
    /// a script, combination of two textures in the first pass, kind, name.
    pub fn list(&self, in_drawing_order: bool) -> Vec<String> {
        let order: Vec<u32> = if in_drawing_order {
            self.sorted.clone()
        } else {
            (0u32..).take(self.list.len()).collect()
        };
        let mut lines = vec!["-".repeat(23)];
        for index in order {
            let material = self.get(index);
            let pages = self.pages.range((index, i32::MIN)..=(index, i32::MAX));
            let times = pages.count().max(1);
            lines.extend(std::iter::repeat_n(list_line(material), times));
        }
        lines.push(format!("{} total shaders", lines.len() - 1));
        lines.push("-".repeat(18));
        lines
    }
}

/// A material's line in `shaderlist`.
fn list_line(material: &Material) -> String {
    let combined = match material.passes.first() {
        Some(pass) if pass.stage_count == 2 => match pass.combine {
            Combine::Modulate => "MT(m) ",
            Combine::Add => "MT(a) ",
        },
        _ => "      ",
    };
    format!(
        "{} {}{combined}{}{}: {}{}",
        material.passes.len(),
        if material.lightmap_class == LightmapClass::Page {
            "L "
        } else {
            "  "
        },
        if material.explicit { "E " } else { "  " },
        if material.is_sky() { "sky " } else { "gen " },
        material.shown_name(),
        if material.defaulted {
            " (DEFAULTED)"
        } else {
            ""
        }
    )
}
