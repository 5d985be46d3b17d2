//! What the writer writes: the known layouts, byte by byte, and the same map when it is read again.

use super::room::{FORMATS, i32_at, room};
use q3bsp::Format;
use q3bsp::quake::QuakeMap;

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap())
}

#[test]
fn what_is_written_is_read_again() {
    for format in FORMATS {
        let map = room(format);
        let bytes = map.write();
        let mut read = QuakeMap::parse(&bytes).unwrap();
        assert!(read.write() == bytes, "{format}");
        read.directory.clear();
        assert_eq!(read, map, "{format}");
    }
}

/// A record of a written file by its place in the directory, which begins at `start`.
fn record(bytes: &[u8], start: usize, lump: usize, stride: usize, element: usize) -> &[u8] {
    let (offset, length) = (
        i32_at(bytes, start + lump * 8),
        i32_at(bytes, start + 4 + lump * 8),
    );
    assert_eq!(length as usize % stride, 0, "lump {lump}");
    &bytes[offset as usize + element * stride..][..stride]
}

#[test]
fn records_of_quake_have_the_layouts_of_the_format() {
    let bytes = room(Format::Quake).write();
    assert_eq!(i32_at(&bytes, 0), 29);
    let at = |lump, stride, element| record(&bytes, 4, lump, stride, element);
    assert_eq!(
        [f32_at(at(1, 20, 3), 4), f32_at(at(1, 20, 3), 12)],
        [1.0, 32.0]
    );
    assert_eq!(f32_at(at(3, 12, 1), 0), 32.0);
    let node = at(5, 24, 0);
    assert_eq!(
        [
            i32_at(node, 0),
            i32::from(u16_at(node, 4) as i16),
            i32::from(u16_at(node, 6) as i16)
        ],
        [0, -2, -1]
    );
    assert_eq!([u16_at(node, 8) as i16, u16_at(node, 14) as i16], [-32, 32]);
    assert_eq!([u16_at(node, 20), u16_at(node, 22)], [0, 6]);
    let info = at(6, 40, 1);
    assert_eq!(
        [
            f32_at(info, 0),
            f32_at(info, 12),
            f32_at(info, 24),
            f32_at(info, 28)
        ],
        [1.0, 32.0, -1.0, 16.0]
    );
    assert_eq!([i32_at(info, 32), i32_at(info, 36)], [1, 1]);
    let face = at(7, 20, 5);
    assert_eq!([0, 2, 8, 10].map(|o| u16_at(face, o)), [5, 1, 4, 2]);
    assert_eq!([i32_at(face, 4), i32_at(face, 16)], [20, 250]);
    assert_eq!(face[12..16], [0, 7, 255, 255]);
    let leaf = at(10, 28, 1);
    assert_eq!([i32_at(leaf, 0), i32_at(leaf, 4)], [-1, 0]);
    assert_eq!([u16_at(leaf, 20), u16_at(leaf, 22)], [0, 6]);
    assert_eq!(leaf[24..], [1, 2, 3, 4]);
    assert_eq!(u16_at(at(11, 2, 4), 0), 4);
    assert_eq!([u16_at(at(12, 4, 1), 0), u16_at(at(12, 4, 1), 2)], [0, 4]);
    let model = at(14, 64, 0);
    assert_eq!(
        [36, 40, 52, 56, 60].map(|o| i32_at(model, o)),
        [0, 1, 1, 0, 6]
    );

    let bytes = room(Format::Bsp2).write();
    assert_eq!(bytes[..4], *b"BSP2");
    let at = |lump, stride, element| record(&bytes, 4, lump, stride, element);
    let node = at(5, 44, 0);
    assert_eq!(
        [i32_at(node, 4), i32_at(node, 36), i32_at(node, 40)],
        [-2, 0, 6]
    );
    assert_eq!([f32_at(node, 12), f32_at(node, 24)], [-32.0, 32.0]);
    let face = at(7, 28, 5);
    assert_eq!(
        [0, 4, 8, 12, 16, 24].map(|o| i32_at(face, o)),
        [5, 1, 20, 4, 2, 250]
    );
    let leaf = at(10, 44, 1);
    assert_eq!([f32_at(leaf, 8), f32_at(leaf, 20)], [-32.0, 32.0]);
    assert_eq!([i32_at(leaf, 36), i32::from(leaf[43])], [6, 4]);
    assert_eq!(i32_at(at(12, 8, 1), 4), 4);
    let bytes = room(Format::TwoPsb).write();
    assert_eq!(i32_at(record(&bytes, 4, 5, 32, 0), 28), 6);
    assert_eq!(i32_at(record(&bytes, 4, 10, 32, 1), 24), 6);
    assert_eq!(i32_at(&room(Format::GoldSrc).write(), 0), 30);
}

#[test]
fn records_of_quake2_have_the_layouts_of_the_format() {
    let bytes = room(Format::Quake2).write();
    assert_eq!((&bytes[..4], i32_at(&bytes, 4)), (&b"IBSP"[..], 38));
    let at = |lump, stride, element| record(&bytes, 8, lump, stride, element);
    let node = at(4, 28, 0);
    assert_eq!([i32_at(node, 4), i32_at(node, 8)], [-2, -1]);
    assert_eq!(
        [
            u16_at(node, 12) as i16,
            u16_at(node, 18) as i16,
            u16_at(node, 26) as i16
        ],
        [-32, 32, 6]
    );
    let info = at(5, 76, 1);
    assert_eq!(
        [i32_at(info, 32), i32_at(info, 36), i32_at(info, 72)],
        [0x29, 300, -1]
    );
    assert_eq!(info[40..48], *b"e1/pool\0");
    let face = at(6, 20, 5);
    assert_eq!([0, 2, 8, 10].map(|o| u16_at(face, o)), [5, 1, 4, 2]);
    assert_eq!(i32_at(face, 16), 750);
    let leaf = at(8, 28, 0);
    assert_eq!(
        [
            i32_at(leaf, 0),
            i32::from(u16_at(leaf, 4) as i16),
            i32::from(u16_at(leaf, 26))
        ],
        [1, -1, 1]
    );
    let model = at(13, 48, 0);
    assert_eq!([36, 40, 44].map(|o| i32_at(model, o)), [0, 0, 6]);
    assert_eq!([0, 4, 8].map(|o| i32_at(at(14, 12, 0), o)), [0, 6, 0x20]);
    assert_eq!(
        [u16_at(at(15, 4, 1), 0), u16_at(at(15, 4, 1), 2)],
        [1, 65535]
    );

    let bytes = room(Format::Qbism).write();
    assert_eq!(bytes[..4], *b"QBSP");
    let leaf = record(&bytes, 8, 8, 52, 1);
    assert_eq!([4, 8, 40, 48].map(|o| i32_at(leaf, o)), [0, 1, 6, 0]);
    assert_eq!(i32_at(record(&bytes, 8, 15, 8, 1), 4), -1);
    assert_eq!(i32_at(record(&bytes, 8, 4, 44, 0), 40), 6);
}
