use super::*;
use crate::files::MemoryFiles;
use image::{ImageEncoder, Rgba, RgbaImage};

/// A picture with no symmetry, so that any swap of rows, columns or channels shows.
fn pattern(width: u32, height: u32) -> RgbaImage {
    RgbaImage::from_fn(width, height, |x, y| {
        let v = x * 37 + y * 101;
        Rgba([
            v as u8,
            (v / 3) as u8,
            (x * 9) as u8,
            (255 - (x * y) % 200) as u8,
        ])
    })
}

fn encode(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A TGA of 24 bits, first row first.
pub(crate) fn rgb_tga(width: u16, height: u16, body: &[u8]) -> Vec<u8> {
    tga(2, width, height, 24, 0x20, body)
}

fn tga(kind: u8, width: u16, height: u16, bits: u8, descriptor: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0, 0, kind, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    bytes.extend(width.to_le_bytes());
    bytes.extend(height.to_le_bytes());
    bytes.extend([bits, descriptor]);
    bytes.extend(body);
    bytes
}

#[test]
fn tga_agrees_with_the_oracle() {
    for (width, height) in [(1, 1), (5, 3), (16, 16), (130, 2)] {
        let picture = pattern(width, height);
        for image in [
            DynamicImage::from(picture.clone()),
            DynamicImage::from(picture.clone()).into_rgb8().into(),
        ] {
            for rle in [false, true] {
                let mut bytes = Vec::new();
                let encoder = image::codecs::tga::TgaEncoder::new(&mut bytes);
                let encoder = if rle { encoder } else { encoder.disable_rle() };
                encoder
                    .write_image(image.as_bytes(), width, height, image.color().into())
                    .unwrap();
                // The encoder writes rows from the top and sets the flag for it. The reader ignores the flag, so
                // the picture comes out upside down.
                assert_eq!(bytes[17] & 0x20, 0x20);
                let ours = decode("x.tga", "tga", &bytes).unwrap();
                let flipped = image.flipv().into_rgba8();
                assert_eq!(
                    ours.rgba,
                    flipped.into_raw(),
                    "{width} x {height}, rle {rle}"
                );
                // Without the flag `image` reads it as we do.
                bytes[17] &= !0x20;
                let theirs = image::load_from_memory_with_format(&bytes, ImageFormat::Tga).unwrap();
                assert_eq!(ours.rgba, theirs.into_rgba8().into_raw());
            }
        }
    }
}

#[test]
fn tga_refusals() {
    let four = [1, 2, 3, 4];
    let refuse = |bytes: &[u8]| decode("x.tga", "tga", bytes).unwrap_err().to_string();
    assert!(refuse(&[0; 17]).contains("header"));
    assert!(refuse(&tga(1, 1, 1, 8, 0, &four)).contains("type 1"));
    assert!(refuse(&tga(2, 1, 1, 16, 0, &four)).contains("16 bits"));
    assert!(refuse(&tga(2, 2, 1, 24, 0, &four)).contains("cut short"));
    assert!(refuse(&tga(2, 0, 1, 24, 0, &four)).contains("0 x 1"));
    assert!(refuse(&tga(10, u16::MAX, u16::MAX, 24, 0, &four)).contains("65535"));
    assert!(refuse(&tga(10, 8, 1, 24, 0, &[0x83, 1, 2, 3, 0x83, 1, 2])).contains("cut short"));
    let mut mapped = tga(2, 1, 1, 24, 0, &four);
    mapped[1] = 1;
    assert!(refuse(&mapped).contains("colour map"));
}

#[test]
fn tga_runs_cross_rows_and_grey_is_grey() {
    // One run of five red pixels over a 3 x 2 picture, then one blue one.
    let rle = tga(10, 3, 2, 24, 0, &[0x84, 0, 0, 255, 0x00, 255, 0, 0]);
    let image = decode("x.tga", "tga", &rle).unwrap();
    let colours: Vec<_> = image.pixels().collect();
    // The file's second row is the picture's first.
    assert_eq!(colours[2], [0, 0, 255, 255]);
    assert!(colours.iter().filter(|c| **c == [255, 0, 0, 255]).count() == 5);
    // A run past the end is cut off.
    assert!(decode("x.tga", "tga", &tga(10, 2, 1, 24, 0, &[0x87, 1, 2, 3])).is_ok());
    let grey = decode("x.tga", "tga", &tga(3, 2, 1, 8, 0, &[7, 9])).unwrap();
    assert_eq!(grey.rgba, [7, 7, 7, 255, 9, 9, 9, 255]);
}

#[test]
fn deep_pngs_keep_their_high_byte() {
    let words = vec![0x12ff, 0xfe80, 0x0080];
    let grey = image::ImageBuffer::from_vec(3, 1, words).unwrap();
    let file = encode(&DynamicImage::ImageLuma16(grey), ImageFormat::Png);
    let ours = decode("x.png", "png", &file).unwrap();
    let grey = |v: u8| [v, v, v, 255];
    assert_eq!(ours.rgba, [grey(0x12), grey(0xfe), grey(0)].concat());
}

#[test]
fn bmp_agrees_with_the_oracle_and_keeps_alpha() {
    for width in [1, 2, 3, 4, 7] {
        let rgb = DynamicImage::from(DynamicImage::from(pattern(width, 5)).into_rgb8());
        let ours = decode("x.bmp", "bmp", &encode(&rgb, ImageFormat::Bmp)).unwrap();
        assert_eq!(ours.rgba, rgb.to_rgba8().into_raw());
        let grey = DynamicImage::from(rgb.to_luma8());
        let ours = decode("x.bmp", "bmp", &encode(&grey, ImageFormat::Bmp)).unwrap();
        assert_eq!(ours.rgba, grey.to_rgba8().into_raw());
    }
    let header = |bits: u16, height: i32, data: &[u8]| {
        let mut bytes = b"BM".to_vec();
        bytes.extend((54 + data.len() as u32).to_le_bytes());
        bytes.extend([0; 4]);
        for word in [54u32, 40, 2, height as u32] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(1u16.to_le_bytes());
        bytes.extend(bits.to_le_bytes());
        bytes.extend([0; 24]);
        bytes.extend(data);
        bytes
    };
    let alpha = decode("x.bmp", "bmp", &header(32, 1, &[1, 2, 3, 4, 5, 6, 7, 255])).unwrap();
    assert_eq!(alpha.rgba, [3, 2, 1, 4, 7, 6, 5, 255]);
    assert!(alpha.has_alpha);
    let five = decode("x.bmp", "bmp", &header(16, -1, &[0x00, 0x7c, 0x1f, 0x00])).unwrap();
    assert_eq!(five.rgba, [248, 0, 0, 255, 0, 0, 248, 255]);
    for broken in [
        &header(24, 9, &[0; 8])[..],
        &header(4, 1, &[0; 8]),
        b"BM",
        &[0; 60],
    ] {
        assert!(decode("x.bmp", "bmp", broken).is_err());
    }
}

#[test]
fn pcx_runs_and_palette() {
    let mut bytes = vec![0x0a, 5, 1, 8, 0, 0, 0, 0];
    bytes.extend([2, 0, 1, 0]); // 3 x 2
    bytes.resize(65, 0);
    bytes.push(1);
    bytes.resize(128, 0);
    bytes.extend([0xc4, 1, 2, 0xc1, 0xc0]);
    bytes.push(0x0c);
    let mut palette = vec![0; 768];
    palette[3..6].copy_from_slice(&[10, 20, 30]);
    palette[6..9].copy_from_slice(&[1, 2, 3]);
    palette[576..579].copy_from_slice(&[9, 8, 7]);
    bytes.extend(palette);
    let image = decode("x.pcx", "pcx", &bytes).unwrap();
    assert_eq!((image.width, image.height), (3, 2));
    let colours: Vec<_> = image.pixels().collect();
    assert_eq!(colours[..4], [[10, 20, 30, 255]; 4]);
    assert_eq!(colours[4..], [[1, 2, 3, 255], [9, 8, 7, 255]]);
    for length in 0..bytes.len() {
        assert!(
            decode("x.pcx", "pcx", &bytes[..length]).is_err(),
            "{length}"
        );
    }
}

#[test]
fn no_input_panics() {
    let picture = DynamicImage::from(pattern(9, 4));
    let mut corpus: Vec<(&str, Vec<u8>)> = vec![("png", encode(&picture, ImageFormat::Png))];
    let rgb = DynamicImage::from(picture.to_rgb8());
    corpus.push(("bmp", encode(&rgb, ImageFormat::Bmp)));
    corpus.push(("jpg", encode(&rgb, ImageFormat::Jpeg)));
    corpus.push(("tga", encode(&picture, ImageFormat::Tga)));
    for (extension, bytes) in corpus {
        assert!(decode("x", extension, &bytes).is_ok());
        for length in 0..bytes.len() {
            let _ = decode("x", extension, &bytes[..length]);
        }
        for at in 0..bytes.len().min(80) {
            for flip in [0xff, 0x80, 0x01] {
                let mut damaged = bytes.clone();
                damaged[at] ^= flip;
                let _ = decode("x", extension, &damaged);
            }
        }
    }
}

#[test]
fn jpegs_without_an_end_are_shown_as_far_as_they_go() {
    let picture = DynamicImage::from(DynamicImage::from(pattern(64, 64)).to_rgb8());
    let whole = encode(&picture, ImageFormat::Jpeg);
    let cut = &whole[..whole.len() * 3 / 4];
    assert!(!is_cut_jpeg("jpg", &whole));
    assert!(is_cut_jpeg("jpg", cut) && !is_cut_jpeg("tga", cut));
    // an end in what stands before the picture is not the picture's
    let titled = [&whole[..2], &[0xff, 0xe1, 0, 4, 0xff, 0xd9], &whole[2..]].concat();
    assert!(!is_cut_jpeg("jpg", &titled) && is_cut_jpeg("jpg", &titled[..titled.len() - 2]));
    let [whole, cut] = [&whole[..], cut].map(|bytes| decode("x.jpg", "jpg", bytes).unwrap());
    assert_eq!((cut.width, cut.height), (64, 64));
    // the first rows of blocks are there
    assert_eq!(whole.rgba[..64 * 4 * 8], cut.rgba[..64 * 4 * 8]);
    assert_ne!(whole, cut);
}

#[test]
fn extensions_fall_back_as_in_the_engine() {
    let picture =
        |shade: u8| DynamicImage::from(RgbaImage::from_pixel(1, 1, Rgba([shade, 0, 0, 255])));
    let mut files = MemoryFiles::new();
    for (name, shade) in [
        ("a.tga", 1),
        ("a.png", 2),
        ("b.png", 3),
        ("d.e.png", 4),
        ("f.tga.png", 5),
    ] {
        let format = if name.ends_with("tga") {
            ImageFormat::Tga
        } else {
            ImageFormat::Png
        };
        files.insert(name, encode(&picture(shade), format)).unwrap();
    }
    files.insert("c.png", "broken").unwrap();
    files.insert("g.tga", "broken").unwrap();
    files
        .insert("g.png", encode(&picture(6), ImageFormat::Png))
        .unwrap();
    let shade = |name: &str| {
        load(&files, name)
            .unwrap()
            .map(|(image, file)| (image.rgba[0], file))
    };
    let found = |shade: u8, file: &str| Some((shade, file.to_owned()));
    assert_eq!(shade("a.png"), found(2, "a.png"));
    assert_eq!(shade("a"), found(1, "a.tga"));
    assert_eq!(shade("a.jpg"), found(1, "a.tga"));
    assert_eq!(shade("B.TGA"), found(3, "B.png"));
    assert_eq!(shade("d.e"), found(4, "d.e.png"));
    assert_eq!(shade("a.xyz"), None);
    assert_eq!(shade("f.tga.png"), found(5, "f.tga.png"));
    assert_eq!(shade("c.png"), None);
    assert!(matches!(
        load(&files, "g"),
        Err(ImageError::Malformed { .. })
    ));
    assert_eq!(shade("g.png"), found(6, "g.png"));
    assert_eq!(find(&files, "b.tga").as_deref(), Some("b.png"));
    assert!(load(&files, "../x").is_err());
    // many at once give the same
    let names = [
        "a.png", "a", "B.TGA", "a.xyz", "c.png", "g", "*white", "../x",
    ]
    .repeat(20);
    let all = load_all(&files, &names, |image| image.rgba[0]);
    assert_eq!(all.len(), names.len());
    for (name, found) in names.iter().zip(all) {
        let one = load(&files, name).map(|found| found.map(|(image, _)| image.rgba[0]));
        assert_eq!(format!("{found:?}"), format!("{one:?}"), "{name}");
    }
}

#[test]
fn sizes_and_mips() {
    let image = |w, h| Image::from_rgba(w, h, pattern(w, h).into_raw()).unwrap();
    let up = image(5, 3).to_power_of_two(false);
    assert_eq!((up.width, up.height), (8, 4));
    let down = image(5, 3).to_power_of_two(true);
    assert_eq!((down.width, down.height), (4, 2));
    assert_eq!(image(8, 4).to_power_of_two(true), image(8, 4));
    let twice = Image::from_rgba(2, 1, vec![10, 0, 0, 255, 21, 0, 0, 255]).unwrap();
    assert_eq!(twice.halve().rgba, [15, 0, 0, 255]);
    assert_eq!(
        twice.resample(4, 2).rgba[..8],
        [10, 0, 0, 255, 10, 0, 0, 255]
    );
    let chain = image(8, 2).mip_chain();
    let sides: Vec<_> = chain.iter().map(|i| (i.width, i.height)).collect();
    assert_eq!(sides, [(8, 2), (4, 1), (2, 1), (1, 1)]);
    assert!(Image::from_rgba(2, 2, vec![0; 15]).is_none());
}

#[test]
fn means() {
    let half = Image::from_rgba(2, 1, vec![255, 0, 0, 255, 0, 0, 0, 0]).unwrap();
    assert!((half.mean_linear() - Vec3::new(0.5, 0.0, 0.0)).length() < 1e-6);
    assert!((half.mean_alpha() - 0.5).abs() < 1e-6);
}

/// Calls `visit` with name, extension in lower case, and bytes of every image of these packs.
fn for_each_image(packs: &[std::path::PathBuf], mut visit: impl FnMut(&str, &str, Vec<u8>)) {
    for extension in EXTENSIONS {
        testkit::for_each_file(packs, &format!(".{extension}"), |_, name, bytes| {
            visit(name, extension, bytes.to_vec());
        });
    }
}

/// Every image of OpenArena decodes, TGAs as `image` decodes them once their top-down bit is cleared.
#[test]
fn openarena_images_decode() {
    let Some(game) = testkit::game() else {
        return;
    };
    let mut count = std::collections::BTreeMap::<String, usize>::new();
    let mut seen = std::collections::HashSet::new();
    for_each_image(&game.packs, |name, extension, mut bytes| {
        if seen.insert(name.to_ascii_lowercase()) {
            *count.entry(extension.to_owned()).or_default() += 1;
        }
        let ours = match decode(name, extension, &bytes) {
            // A PCX with three planes is among them; the engine refuses it as well.
            Err(ImageError::Malformed { .. }) if extension == "pcx" => return,
            decoded => decoded.unwrap(),
        };
        if extension == "tga" {
            bytes[17] &= !0x20;
            let theirs = image::load_from_memory_with_format(&bytes, ImageFormat::Tga).unwrap();
            assert!(
                ours.rgba == theirs.into_rgba8().into_raw(),
                "{name} differs from the oracle"
            );
        }
    });
    println!("{count:?}");
    if !game.exact() {
        return;
    }
    assert_eq!(count["jpg"], 1505);
    assert_eq!(count["tga"], 1439);
    assert_eq!(count["png"], 7);
}

/// What holds for any image, whoever made it: it has all of its texels, or is refused with a line that names it.
#[test]
fn images_of_other_packs_decode_or_are_refused() {
    let Some(game) = testkit::game() else {
        return;
    };
    let (mut decoded, mut refused) = (0, 0);
    for_each_image(&game.others, |name, extension, bytes| {
        match decode(name, extension, &bytes) {
            Ok(image) => {
                let texels = u64::from(image.width) * u64::from(image.height);
                assert!(
                    texels > 0 && image.rgba.len() as u64 == texels * 4,
                    "{name}"
                );
                decoded += 1;
            }
            Err(error) => {
                assert!(error.to_string().contains(name), "{name}: {error}");
                refused += 1;
            }
        }
    });
    println!("{decoded} images decode, {refused} are refused");
}

#[test]
fn wal_takes_the_palette_of_its_game() {
    let mut wal = vec![0; 100];
    wal[32..36].copy_from_slice(&2u32.to_le_bytes());
    wal[36..40].copy_from_slice(&1u32.to_le_bytes());
    wal[40..44].copy_from_slice(&100u32.to_le_bytes());
    wal.extend([3, 200]);
    let mut files = MemoryFiles::new();
    files.insert("textures/e1/stone.wal", wal.clone()).unwrap();
    assert!(load(&files, "textures/e1/stone").unwrap().is_none());
    let palette: Vec<u8> = (0..=255u8).flat_map(|i| [i, 0, 9]).collect();
    files.insert("pics/colormap.pcx", palette).unwrap();
    let (image, path) = load(&files, "textures/e1/stone").unwrap().unwrap();
    assert_eq!(path, "textures/e1/stone.wal");
    assert_eq!(image.rgba, [3, 0, 9, 255, 200, 0, 9, 255]);
    assert_eq!(texture_size(&files, "textures/e1/stone"), Some((2, 1)));
    assert_eq!(texture_size(&files, "textures/e1/none"), None);
    for length in 0..wal.len() {
        assert!(wal::decode(&wal[..length], &[0; 768]).is_err());
    }
}
