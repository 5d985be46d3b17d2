//! Pages of baked light, before they are bytes.

use glam::Vec3;
use support::slice::item;

/// A square page of values per texel, rows from the top. Light is as stored: 1 is byte 255, display-encoded or not as the
/// map's compiler stored it; values above 1 are possible until the page is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// Texels per side.
    pub side: usize,
    /// The texels, row by row.
    pub texels: Vec<Vec3>,
}

impl Page {
    /// A page of zeros.
    pub fn blank(side: usize) -> Page {
        Page {
            side,
            texels: vec![Vec3::ZERO; side * side],
        }
    }

    /// Index of a texel; coordinates beyond the page are clamped to its edge.
    pub fn index(&self, x: i64, y: i64) -> usize {
        let most = self.side.saturating_sub(1) as i64;
        (y.clamp(0, most) as usize) * self.side + x.clamp(0, most) as usize
    }

    /// The texel at a column and row, clamped to the page.
    pub fn texel(&self, x: i64, y: i64) -> Vec3 {
        item(&self.texels, self.index(x, y))
    }
}

/// RGB bytes of stored light, rounded. A colour with a component above 1 is scaled as a whole, so that its hue stays, as map
/// compilers and the engine do. NaN gives 0.
pub fn light_bytes(light: Vec3) -> [u8; 3] {
    let light = light.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1e9) });
    let light = light / light.max_element().max(1.0);
    light.to_array().map(|c| (c * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bright_light_keeps_its_hue() {
        assert_eq!(light_bytes(Vec3::new(0.5, 1.0, 0.0)), [128, 255, 0]);
        assert_eq!(light_bytes(Vec3::new(2.0, 1.0, 0.0)), [255, 128, 0]);
        let odd = Vec3::new(f32::NAN, -1.0, f32::INFINITY);
        assert_eq!(light_bytes(odd), [0, 0, 255]);
    }

    #[test]
    fn texels_beyond_the_page_are_those_of_its_edge() {
        let mut page = Page::blank(2);
        page.texels[3] = Vec3::ONE;
        assert_eq!(page.texel(7, 1), Vec3::ONE);
        assert_eq!(page.texel(-1, 9), Vec3::ZERO);
    }
}
