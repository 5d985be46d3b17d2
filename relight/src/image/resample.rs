//! Sizes of textures: powers of two, and mip chains.

use super::Image;
use support::slice::item;

impl Image {
    /// The picture with both sides a power of two, as the engine uploads it.
    ///
    /// Sides grow to the next power, or shrink to the one below with `round_down`
    /// (`r_roundImagesDown`). Each new pixel is the mean of the four old ones at a quarter and three
    /// quarters of its width and height.
    pub fn to_power_of_two(&self, round_down: bool) -> Image {
        let side = |old: u32| {
            let up = old.next_power_of_two();
            if round_down && up > old { up / 2 } else { up }
        };
        self.resample(side(self.width), side(self.height))
    }

    /// The picture in another size; sides are made at least 1. See
    /// [`to_power_of_two`](Self::to_power_of_two) for the filter.
    pub fn resample(&self, width: u32, height: u32) -> Image {
        let (width, height) = (width.max(1), height.max(1));
        if (width, height) == (self.width, self.height) {
            return self.clone();
        }
        // Old positions of the two taps along a side, in 16.16 fixed point as the engine steps it.
        let taps = |old: u32, new: u32| -> Vec<[usize; 2]> {
            let step = (u64::from(old) << 16) / u64::from(new);
            let tap = |i: u32, quarter: u64| {
                let at = (quarter * (step / 4) + u64::from(i) * step) >> 16;
                usize::try_from(at.min(u64::from(old) - 1)).unwrap_or(0)
            };
            (0..new).map(|i| [tap(i, 1), tap(i, 3)]).collect()
        };
        let (columns, rows) = (taps(self.width, width), taps(self.height, height));
        let mut rgba = Vec::with_capacity(columns.len() * rows.len() * 4);
        for [upper, lower] in rows {
            for &[left, right] in &columns {
                let taps = [(upper, left), (upper, right), (lower, left), (lower, right)];
                rgba.extend(self.mean(taps));
            }
        }
        Image::of(width, height, rgba)
    }

    /// The next smaller level of the mip chain: a 2 × 2 box filter on encoded values, rounding down,
    /// as the engine's `r_simpleMipMaps`. A side of 1 stays 1; of an odd side the last line is left out.
    pub fn halve(&self) -> Image {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let dx = usize::from(self.width > 1);
        let dy = usize::from(self.height > 1);
        let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
        for y in 0..height as usize {
            for x in 0..width as usize {
                let (x0, y0) = (x * (1 + dx), y * (1 + dy));
                let (x1, y1) = (x0 + dx, y0 + dy);
                rgba.extend(self.mean([(y0, x0), (y0, x1), (y1, x0), (y1, x1)]));
            }
        }
        Image::of(width, height, rgba)
    }

    /// Mean of four texels (row, column), rounded down.
    fn mean(&self, taps: [(usize, usize); 4]) -> [u8; 4] {
        let texels = self.rgba.as_chunks::<4>().0;
        let mut sum = [0u16; 4];
        for (y, x) in taps {
            let texel = item(texels, y * self.width as usize + x);
            for (sum, byte) in sum.iter_mut().zip(texel) {
                *sum += u16::from(byte);
            }
        }
        sum.map(|s| (s >> 2) as u8)
    }

    /// The picture and all its smaller levels, down to 1 × 1.
    pub fn mip_chain(&self) -> Vec<Image> {
        let mut chain = vec![self.clone()];
        while let Some(last) = chain.last()
            && (last.width > 1 || last.height > 1)
        {
            let next = last.halve();
            chain.push(next);
        }
        chain
    }
}
