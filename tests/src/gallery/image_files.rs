//! Writers of image files in the kinds that the engine reads and no encoder at hand writes.

use std::io::Cursor;

use image::ImageFormat;

/// A colour with alpha.
pub type Texel = [u8; 4];

/// A TGA of type 2 (colour), 3 (grey) or 10 (colour in runs), of `depth` bytes a pixel, rows from the bottom;
/// `descriptor` and the length of the text before the pixels are as given.
pub fn tga(
    kind: u8,
    depth: usize,
    [width, height]: [u16; 2],
    descriptor: u8,
    text: &[u8],
    texel: impl Fn(u16, u16) -> Texel,
) -> Vec<u8> {
    let mut bytes = vec![text.len() as u8, 0, kind, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    bytes.extend(width.to_le_bytes());
    bytes.extend(height.to_le_bytes());
    bytes.extend([depth as u8 * 8, descriptor]);
    bytes.extend(text);
    let stored = |[r, g, b, a]: Texel| [b, g, r, a].into_iter().take(depth).collect::<Vec<u8>>();
    let texels: Vec<Vec<u8>> = (0..height)
        .rev()
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| stored(texel(x, y)))
        .collect();
    if kind != 10 {
        bytes.extend(texels.concat());
        return bytes;
    }
    // runs of equal pixels, and of five unequal ones; both cross the ends of rows
    let mut rest = texels.as_slice();
    while let Some(first) = rest.first() {
        let equal = rest.iter().take(128).take_while(|t| *t == first).count();
        let count = if equal > 1 { equal } else { rest.len().min(5) };
        let (run, after) = rest.split_at(count);
        bytes.push(if equal > 1 { 0x80 } else { 0 } | (count - 1) as u8);
        bytes.extend(if equal > 1 {
            first.clone()
        } else {
            run.concat()
        });
        rest = after;
    }
    bytes
}

/// A BMP of 8, 24 or 32 bits; `palette` for the first of them.
pub fn bmp(
    bits: u16,
    [width, height]: [u16; 2],
    palette: &[Texel],
    pixel: impl Fn(u16, u16) -> Vec<u8>,
) -> Vec<u8> {
    let mut colors: Vec<u8> = palette
        .iter()
        .flat_map(|[r, g, b, _]| [*b, *g, *r, 0])
        .collect();
    if bits == 8 {
        colors.resize(1024, 0);
    }
    let body: Vec<u8> = (0..height)
        .rev()
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .flat_map(|(x, y)| pixel(x, y))
        .collect();
    let start = 54 + colors.len() as u32;
    let mut bytes = b"BM".to_vec();
    bytes.extend((start + body.len() as u32).to_le_bytes());
    bytes.extend([0; 4]);
    for word in [start, 40, u32::from(width), u32::from(height)] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(1u16.to_le_bytes());
    bytes.extend(bits.to_le_bytes());
    bytes.extend([0; 24]);
    bytes.extend(colors);
    bytes.extend(body);
    bytes
}

/// A PCX of 8 bits with a palette.
pub fn pcx(
    [width, height]: [u16; 2],
    palette: &[Texel],
    index: impl Fn(u16, u16) -> u8,
) -> Vec<u8> {
    let mut bytes = vec![0x0a, 5, 1, 8, 0, 0, 0, 0];
    bytes.extend((width - 1).to_le_bytes());
    bytes.extend((height - 1).to_le_bytes());
    bytes.resize(65, 0);
    bytes.push(1);
    bytes.extend(width.to_le_bytes());
    bytes.resize(128, 0);
    for y in 0..height {
        let row: Vec<u8> = (0..width).map(|x| index(x, y)).collect();
        let mut rest = row.as_slice();
        while let Some(first) = rest.first() {
            let count = rest.iter().take(63).take_while(|i| *i == first).count();
            bytes.extend([0xc0 | count as u8, *first]);
            rest = &rest[count..];
        }
    }
    bytes.push(0x0c);
    let mut colors: Vec<u8> = palette
        .iter()
        .flat_map(|[r, g, b, _]| [*r, *g, *b])
        .collect();
    colors.resize(768, 0);
    bytes.extend(colors);
    bytes
}

/// The chunks of a PNG before its pixels.
pub struct Png<'a> {
    /// Bits of a sample: 1, 2, 4, 8 or 16.
    pub bits: u8,
    /// 0 grey, 2 colour, 3 palette, 4 grey with alpha, 6 colour with alpha.
    pub kind: u8,
    /// In seven passes.
    pub interlaced: bool,
    /// Colours of a palette.
    pub palette: &'a [Texel],
    /// The `tRNS` chunk, if it has any bytes.
    pub transparency: &'a [u8],
}

impl Png<'_> {
    /// The file; `samples` gives those of a pixel, most significant bits first in 16.
    pub fn write(
        &self,
        [width, height]: [u16; 2],
        samples: impl Fn(u16, u16) -> Vec<u16>,
    ) -> Vec<u8> {
        let mut header = Vec::new();
        header.extend(u32::from(width).to_be_bytes());
        header.extend(u32::from(height).to_be_bytes());
        header.extend([self.bits, self.kind, 0, 0, u8::from(self.interlaced)]);
        // first column and row, and steps, of each pass
        let passes: &[[u16; 4]] = if self.interlaced {
            &[
                [0, 0, 8, 8],
                [4, 0, 8, 8],
                [0, 4, 4, 8],
                [2, 0, 4, 4],
                [0, 2, 2, 4],
                [1, 0, 2, 2],
                [0, 1, 1, 2],
            ]
        } else {
            &[[0, 0, 1, 1]]
        };
        let mut raw = Vec::new();
        for &[left, top, across, down] in passes {
            if left >= width {
                continue;
            }
            for y in (top..height).step_by(down.into()) {
                // no filter
                raw.push(0);
                let columns = (left..width).step_by(across.into());
                raw.extend(self.pack(columns.flat_map(|x| samples(x, y))));
            }
        }
        let mut bytes = vec![0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a];
        chunk(&mut bytes, b"IHDR", &header);
        if !self.palette.is_empty() {
            let colors: Vec<u8> = self
                .palette
                .iter()
                .flat_map(|[r, g, b, _]| [*r, *g, *b])
                .collect();
            chunk(&mut bytes, b"PLTE", &colors);
        }
        if !self.transparency.is_empty() {
            chunk(&mut bytes, b"tRNS", self.transparency);
        }
        chunk(&mut bytes, b"IDAT", &stored(&raw));
        chunk(&mut bytes, b"IEND", &[]);
        bytes
    }

    fn pack(&self, samples: impl Iterator<Item = u16>) -> Vec<u8> {
        let samples: Vec<u16> = samples.collect();
        match self.bits {
            16 => samples.iter().flat_map(|s| s.to_be_bytes()).collect(),
            8 => samples.iter().map(|s| *s as u8).collect(),
            bits => samples
                .chunks(usize::from(8 / bits))
                .map(|part| {
                    let join = |byte: u8, (i, s): (usize, &u16)| {
                        byte | ((*s as u8) << (8 - bits * (i as u8 + 1)))
                    };
                    part.iter().enumerate().fold(0, join)
                })
                .collect(),
        }
    }
}

/// A stream of zlib that compresses nothing (RFC 1950, RFC 1951 section 3.2.4).
fn stored(raw: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0x78, 0x01];
    let mut parts = raw.chunks(0xffff).peekable();
    while let Some(part) = parts.next() {
        bytes.push(u8::from(parts.peek().is_none()));
        let length = part.len() as u16;
        bytes.extend(length.to_le_bytes());
        bytes.extend((!length).to_le_bytes());
        bytes.extend(part);
    }
    let (low, high) = raw.iter().fold((1u32, 0u32), |(low, high), byte| {
        let low = (low + u32::from(*byte)) % 65521;
        (low, (high + low) % 65521)
    });
    bytes.extend((high << 16 | low).to_be_bytes());
    bytes
}

/// A chunk of a PNG (PNG specification, section 5.3, and its check sum, annex D).
fn chunk(bytes: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    bytes.extend((data.len() as u32).to_be_bytes());
    let start = bytes.len();
    bytes.extend(kind);
    bytes.extend(data);
    let check = bytes[start..].iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            if sum & 1 == 1 {
                0xedb8_8320 ^ (sum >> 1)
            } else {
                sum >> 1
            }
        })
    });
    bytes.extend((!check).to_be_bytes());
}

/// A JPEG of the best quality, in colour or grey.
///
/// # Panics
/// When the encoder fails, which it does not in memory.
pub fn jpeg([width, height]: [u16; 2], grey: bool, texel: impl Fn(u16, u16) -> Texel) -> Vec<u8> {
    let picture = image::RgbImage::from_fn(width.into(), height.into(), |x, y| {
        let [r, g, b, _] = texel(x as u16, y as u16);
        image::Rgb([r, g, b])
    });
    let picture = image::DynamicImage::from(picture);
    let picture = if grey {
        picture.to_luma8().into()
    } else {
        picture
    };
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, ImageFormat::Jpeg)
        .expect("it is written to memory");
    bytes.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is written here is what another reader reads.
    #[test]
    fn pngs_are_pngs() {
        let texel = |x: u16, y: u16| (x * 5 + y * 3) % 4;
        for (bits, kind, channels, interlaced) in [
            (2, 0, 1, false),
            (2, 3, 1, true),
            (8, 6, 4, true),
            (16, 2, 3, false),
        ] {
            let png = Png {
                bits,
                kind,
                interlaced,
                palette: if kind == 3 {
                    &[[9; 4], [20; 4], [30; 4], [40; 4]]
                } else {
                    &[]
                },
                transparency: &[],
            };
            let bytes = png.write([13, 9], |x, y| {
                vec![texel(x, y) * 80 % (1 << bits.min(8)); channels]
            });
            let read = image::load_from_memory_with_format(&bytes, ImageFormat::Png);
            let read = read.unwrap_or_else(|e| panic!("{bits} {kind}: {e}"));
            assert_eq!((read.width(), read.height()), (13, 9));
        }
    }
}
