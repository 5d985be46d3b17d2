//! A writer of RoQ films, the video files of id Tech 3: pictures of squares in plain colours, which the engine's own
//! decoder reads back exactly.
//!
//! Source of the format: the description "id RoQ video file format" by Tim Ferguson (2001). A film is a row of chunks:
//! 16 bits of kind, 32 of size, 16 of argument, then data. A code book has cells of 2 x 2 pixels (four luminances and
//! two chrominances) and of 4 x 4 pixels (four of the former). A picture is a row of squares of 16 x 16 pixels, each of
//! four of 8 x 8, with two bits for its kind; kind 2 is one cell of 4 x 4, enlarged.

/// Kinds of chunks.
mod chunk {
    pub const SIGNATURE: u16 = 0x1084;
    pub const INFO: u16 = 0x1001;
    pub const CODE_BOOK: u16 = 0x1002;
    pub const PICTURE: u16 = 0x1011;
}

/// A film of pictures of `side` x `side` pixels, `side` a multiple of 16. A picture is given by the luminance and the two
/// chrominances of each of its squares of 8 x 8 pixels, in rows from the top; at most 256 different colours in each.
pub fn film(side: u16, pictures: &[Vec<[u8; 3]>]) -> Vec<u8> {
    let mut file = Vec::new();
    // of the first chunk the size is meaningless and the argument is the pictures a second
    push(&mut file, chunk::SIGNATURE, u32::MAX, 30, &[]);
    let info: Vec<u8> = [side, side, 8, 4]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    push(&mut file, chunk::INFO, 8, 0, &info);
    for picture in pictures {
        let mut colors: Vec<[u8; 3]> = picture.clone();
        colors.sort_unstable();
        colors.dedup();
        let count = colors.len();
        let mut book = Vec::new();
        for [y, u, v] in &colors {
            book.extend([*y, *y, *y, *y, *u, *v]);
        }
        for cell in 0..count {
            book.extend([cell as u8; 4]);
        }
        // 256 cells are written as 0
        let argument = (((count % 256) << 8) | (count % 256)) as u16;
        push(
            &mut file,
            chunk::CODE_BOOK,
            book.len() as u32,
            argument,
            &book,
        );
        let data = squares(usize::from(side), picture, &colors);
        push(&mut file, chunk::PICTURE, data.len() as u32, 0, &data);
    }
    file
}

/// The squares of a picture in the order of the file: four to each of 16 x 16 pixels. Eight kinds of two bits come as a
/// word of 16, the first in the highest bits, each word before the data of its kinds.
fn squares(side: usize, picture: &[[u8; 3]], colors: &[[u8; 3]]) -> Vec<u8> {
    let across = side / 8;
    let order = (0..across / 2)
        .flat_map(|y| (0..across / 2).map(move |x| (x * 2, y * 2)))
        .flat_map(|(x, y)| [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]);
    let cells: Vec<u8> = order
        .map(|(x, y)| {
            let place = colors.binary_search(&picture[y * across + x]);
            place.expect("a colour of the picture") as u8
        })
        .collect();
    let mut data = Vec::new();
    for eight in cells.chunks(8) {
        let kinds = (0..eight.len()).fold(0u16, |word, i| word | (2 << (14 - 2 * i)));
        data.extend(kinds.to_le_bytes());
        data.extend(eight);
    }
    data
}

fn push(file: &mut Vec<u8>, kind: u16, size: u32, argument: u16, data: &[u8]) {
    file.extend(kind.to_le_bytes());
    file.extend(size.to_le_bytes());
    file.extend(argument.to_le_bytes());
    file.extend(data);
}

/// Red, green and blue of a luminance and two chrominances, as films mean them (ITU-R BT.601, all of 0 to 255).
pub fn rgb([y, u, v]: [u8; 3]) -> [u8; 3] {
    let (y, u, v) = (f32::from(y), f32::from(u) - 128.0, f32::from(v) - 128.0);
    [
        y + 1.402 * v,
        y - 0.344_136 * u - 0.714_136 * v,
        y + 1.772 * u,
    ]
    .map(|c| c.clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_follow_each_other_to_the_end() {
        let picture: Vec<[u8; 3]> = (0..16).map(|i| [i * 10, 128, 128]).collect();
        let film = film(32, &[picture.clone(), picture]);
        let (mut at, mut kinds) = (8, Vec::new());
        while at < film.len() {
            let kind = u16::from_le_bytes([film[at], film[at + 1]]);
            let size = u32::from_le_bytes(film[at + 2..at + 6].try_into().unwrap());
            kinds.push(kind);
            at += 8 + size as usize;
        }
        assert_eq!(at, film.len());
        assert_eq!(kinds, [0x1001, 0x1002, 0x1011, 0x1002, 0x1011]);
        // two words of kinds and a cell for each square
        assert_eq!(film.len(), 8 + 16 + 2 * (8 + 16 * 10 + 8 + 2 * 2 + 16));
    }

    #[test]
    fn colours_are_those_of_television() {
        assert_eq!(rgb([128, 128, 128]), [128; 3]);
        assert_eq!(rgb([76, 84, 255]), [254, 0, 0]);
    }
}
