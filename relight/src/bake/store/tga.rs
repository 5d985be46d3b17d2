//! Pages as Targa images: 24 bits, not compressed, bottom row first, as map compilers write them.

use q3bsp::Lightmap;

/// The image of a page.
pub(super) fn encode(page: &Lightmap) -> Vec<u8> {
    let side = page.size();
    let mut out = vec![0; 18];
    let sides = u16::try_from(side).unwrap_or(u16::MAX).to_le_bytes();
    if let Some(fields) = out.first_chunk_mut::<18>() {
        fields[2] = 2; // true colour
        [fields[12], fields[13]] = sides;
        [fields[14], fields[15]] = sides;
        fields[16] = 24;
    }
    for row in page.0.chunks_exact((side * 3).max(1)).rev() {
        for texel in row.as_chunks::<3>().0 {
            let [r, g, b] = *texel;
            out.extend([b, g, r]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::decode;

    #[test]
    fn the_decoded_image_is_the_page() {
        let page = Lightmap((0..12).collect());
        let image = decode("lm", "tga", &encode(&page)).unwrap();
        let texels: Vec<u8> = image.pixels().flat_map(|[r, g, b, _]| [r, g, b]).collect();
        assert_eq!(texels[..], page.0[..]);
    }
}
