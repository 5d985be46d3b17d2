//! Image files: every kind that is read, which file a name finds, sizes, mip levels, what is broken.

use super::board::{Board, MAP, Shape};
use super::image_files::{Png, Texel, bmp, jpeg, pcx, tga};
use super::textures::tga_with_alpha;
use super::{File, Scene, Stage};
use crate::engine::Raised;

/// The colours of the pictures.
const PALETTE: [Texel; 16] = {
    let mut colors = [[0, 0, 0, 255]; 16];
    let mut i = 0;
    while i < 16 {
        colors[i] = [
            (i % 4 * 85) as u8,
            (i / 4 * 85) as u8,
            ((i * 7) % 16 * 17) as u8,
            if i % 5 == 4 { 90 } else { 255 },
        ];
        i += 1;
    }
    colors
};

/// Which of them a pixel has: blocks that no swap of rows, columns or colours leaves as they are.
fn index(x: u16, y: u16) -> u16 {
    (x / 8 + y / 8 * 3 + u16::from(x > y)) % 16
}

fn color(x: u16, y: u16) -> Texel {
    PALETTE[usize::from(index(x, y))]
}

/// The same without alpha.
fn opaque(x: u16, y: u16) -> Texel {
    let [r, g, b, _] = color(x, y);
    [r, g, b, 255]
}

fn grey(x: u16, y: u16) -> Texel {
    let [r, g, ..] = color(x, y);
    [r / 2 + g / 2; 4]
}

const SIDES: [u16; 2] = [32, 32];

/// Each kind of file, with a name that has the extension of its kind.
fn kinds() -> Vec<(&'static str, Vec<u8>)> {
    let png = |bits, kind| Png {
        bits,
        kind,
        interlaced: false,
        palette: &[],
        transparency: &[],
    };
    let colored = |x, y| color(x, y)[..3].iter().map(|v| u16::from(*v)).collect();
    let with_alpha = |x, y| color(x, y).map(u16::from).to_vec();
    let wide = |x, y| {
        color(x, y)
            .map(|v| u16::from(v) * 257 - 3.min(u16::from(v)))
            .to_vec()
    };
    let grey_of = |bits: u16| move |x, y| vec![u16::from(grey(x, y)[0]) >> (8 - bits)];
    let few = &PALETTE[..4];
    vec![
        ("tga24.tga", tga(2, 3, SIDES, 0, b"", color)),
        ("tga32.tga", tga(2, 4, SIDES, 8, b"", color)),
        ("tga-text.tga", tga(2, 3, SIDES, 0, b"a comment", color)),
        ("tga-down.tga", tga(2, 3, SIDES, 0x20, b"", color)),
        ("tga-grey.tga", tga(3, 1, SIDES, 0, b"", grey)),
        ("tga-runs24.tga", tga(10, 3, SIDES, 0, b"", color)),
        ("tga-runs32.tga", tga(10, 4, SIDES, 8, b"", color)),
        ("jpg.jpg", jpeg(SIDES, false, color)),
        ("jpg-grey.jpg", jpeg(SIDES, true, color)),
        ("jpeg.jpeg", jpeg(SIDES, false, color)),
        ("png1.png", png(1, 0).write(SIDES, grey_of(1))),
        ("png2.png", png(2, 0).write(SIDES, grey_of(2))),
        ("png4.png", png(4, 0).write(SIDES, grey_of(4))),
        ("png8.png", png(8, 0).write(SIDES, grey_of(8))),
        (
            "png16.png",
            png(16, 0).write(SIDES, |x, y| vec![u16::from(grey(x, y)[0]) * 256 + 255]),
        ),
        ("png24.png", png(8, 2).write(SIDES, colored)),
        (
            "png48.png",
            png(16, 2).write(SIDES, |x, y| wide(x, y)[..3].to_vec()),
        ),
        (
            "png-grey-alpha.png",
            png(8, 4).write(SIDES, |x, y| {
                vec![u16::from(grey(x, y)[0]), u16::from(color(x, y)[3])]
            }),
        ),
        ("png32.png", png(8, 6).write(SIDES, with_alpha)),
        ("png64.png", png(16, 6).write(SIDES, wide)),
        (
            "png-palette2.png",
            Png {
                palette: few,
                ..png(2, 3)
            }
            .write(SIDES, |x, y| vec![index(x, y) % 4]),
        ),
        (
            "png-palette4.png",
            Png {
                palette: &PALETTE,
                ..png(4, 3)
            }
            .write(SIDES, |x, y| vec![index(x, y)]),
        ),
        (
            "png-palette8.png",
            Png {
                palette: &PALETTE,
                transparency: &PALETTE.map(|p| p[3]),
                ..png(8, 3)
            }
            .write(SIDES, |x, y| vec![index(x, y)]),
        ),
        (
            "png-key.png",
            Png {
                // the colour of index 5 is transparent
                transparency: &[0, PALETTE[5][0], 0, PALETTE[5][1], 0, PALETTE[5][2]],
                ..png(8, 2)
            }
            .write(SIDES, colored),
        ),
        (
            "png-grey-key.png",
            Png {
                transparency: &[0, 85],
                ..png(8, 0)
            }
            .write(SIDES, grey_of(8)),
        ),
        (
            "png-passes.png",
            Png {
                interlaced: true,
                ..png(8, 6)
            }
            .write(SIDES, with_alpha),
        ),
        (
            "png-passes4.png",
            Png {
                interlaced: true,
                palette: &PALETTE,
                ..png(4, 3)
            }
            .write(SIDES, |x, y| vec![index(x, y)]),
        ),
        ("pcx.pcx", pcx(SIDES, &PALETTE, |x, y| index(x, y) as u8)),
        (
            "bmp8.bmp",
            bmp(8, SIDES, &PALETTE, |x, y| vec![index(x, y) as u8]),
        ),
        // those of 16 bits make the reference write beyond its memory
        (
            "bmp24.bmp",
            bmp(24, SIDES, &[], |x, y| {
                let [r, g, b, _] = color(x, y);
                vec![b, g, r]
            }),
        ),
        (
            "bmp32.bmp",
            bmp(32, SIDES, &[], |x, y| {
                let [r, g, b, a] = color(x, y);
                vec![b, g, r, a]
            }),
        ),
    ]
}

fn in_folder(files: Vec<(&'static str, Vec<u8>)>) -> impl Iterator<Item = File> {
    files
        .into_iter()
        .map(|(name, bytes)| (format!("i/{name}"), bytes))
}

/// A picture alone, and over a colour by its alpha.
fn pictures<'a>(names: impl IntoIterator<Item = &'a str>) -> impl Iterator<Item = String> {
    names.into_iter().map(|name| {
        format!(
            "{{\nmap g/half.tga\nrgbGen const ( 0.2 0.5 0.9 )\n}}\n{{\nmap i/{name}\nblendFunc blend\nrgbGen identity\n}}"
        )
    })
}

/// The files of one kind.
fn formats(extension: &str) -> Board {
    let kinds = kinds();
    let names = kinds.iter().map(|(name, _)| *name);
    Board::new(
        6,
        Shape::Face,
        pictures(names.filter(|name| name.ends_with(extension))),
    )
}

fn format_files(extension: &str) -> Vec<File> {
    let mut files = formats(extension).files();
    files.extend(in_folder(kinds()));
    files
}

/// Names as scripts write them, of files that are there with other extensions.
const WRITTEN: [&str; 17] = [
    "all",
    "all.tga",
    "all.jpg",
    "all.png",
    "all.bmp",
    "all.xyz",
    "pair.jpg",
    "pair.tga",
    "pair",
    "ALL.TGA",
    "upper.tga",
    "dotted.name",
    "dotted.name.tga",
    "fall.png",
    "fall",
    "cut.png",
    "half.jpg",
];

fn found() -> Vec<(&'static str, Vec<u8>)> {
    let one = |n: usize| move |_, _| opaque(n as u16 * 8, 0);
    let of = |n: usize| move |_, _| PALETTE[n].map(|v| u16::from(v / 2 + 60))[..3].to_vec();
    let png = Png {
        bits: 8,
        kind: 2,
        interlaced: false,
        palette: &[],
        transparency: &[],
    };
    let whole = png.write([16, 16], of(9));
    // a JPEG is shown as far as it goes
    let mut half = jpeg(SIDES, false, color);
    half.truncate(half.len() * 3 / 4);
    vec![
        ("all.tga", tga(2, 3, [16, 16], 0, b"", one(1))),
        ("all.jpg", jpeg([16, 16], false, one(2))),
        ("all.png", png.write([16, 16], of(3))),
        ("all.bmp", bmp(24, [16, 16], &[], |_, _| vec![200, 90, 10])),
        ("pair.png", png.write([16, 16], of(5))),
        ("pair.pcx", pcx([16, 16], &PALETTE, |_, _| 6)),
        ("upper.TGA", tga(2, 3, [16, 16], 0, b"", one(7))),
        ("dotted.name.tga", tga(2, 3, [16, 16], 0, b"", one(3))),
        // what cannot be decoded counts as missing, so that the next kind is tried
        ("fall.png", b"no picture".to_vec()),
        (
            "fall.bmp",
            bmp(24, [16, 16], &[], |_, _| vec![20, 190, 110]),
        ),
        ("cut.png", whole[..whole.len() / 2].to_vec()),
        ("half.jpg", half),
    ]
}

fn search() -> Board {
    Board::new(
        8,
        Shape::Face,
        WRITTEN.map(|name| format!("{{\nmap i/{name}\nrgbGen identity\n}}")),
    )
}

/// Sides of pictures, most of them no powers of two.
const SIZES: [[u16; 2]; 12] = [
    [1, 1],
    [3, 3],
    [5, 40],
    [20, 20],
    [33, 31],
    [48, 48],
    [63, 65],
    [96, 20],
    [100, 60],
    [129, 127],
    [200, 7],
    [300, 200],
];

fn size_name([width, height]: [u16; 2]) -> String {
    format!("s{width}x{height}.tga")
}

/// With mip levels, with each way to forbid them or `r_picmip`, clamped; then by `RegisterShaderNoMip` and by
/// `RegisterShader`.
fn sizes() -> Board {
    let with = |head: &'static str, map: &'static str| {
        let copy = if head.is_empty() && map == "map" {
            ""
        } else {
            "copy/"
        };
        let kind = format!("{head}{map}").replace(char::is_whitespace, "");
        SIZES.map(|size| {
            let name = size_name(size);
            // an image keeps the flags of its first use
            let name = if copy.is_empty() {
                name
            } else {
                format!("{kind}-{name}")
            };
            format!("{head}\n{{\n{map} i/{name}\ntcMod scale 1.3 1.3\nrgbGen identity\n}}")
        })
    };
    Board::new(12, Shape::Face, with("", "map"))
        .and(Shape::Face, with("nopicmip", "map"))
        .and(Shape::Face, with("nomipmaps", "map"))
        .and(Shape::Face, with("", "clampMap"))
}

fn size_files() -> Vec<File> {
    let mut files = sizes().files();
    for [width, height] in SIZES {
        let name = size_name([width, height]);
        let texel = |x: u16, y: u16| {
            let across = u32::from(x) * 255 / u32::from(width);
            let down = u32::from(y) * 255 / u32::from(height);
            [
                across as u8,
                down as u8,
                ((x ^ y) % 2 * 255) as u8,
                255 - (x % 3) as u8 * 80,
            ]
        };
        let bytes = tga_with_alpha(width, height, texel);
        for kind in [
            "",
            "nopicmipmap-",
            "nomipmapsmap-",
            "clampMap-",
            "bare-",
            "barenomip-",
        ] {
            files.push((format!("i/{kind}{name}"), bytes.clone()));
        }
    }
    files
}

fn play_sizes(stage: &mut Stage) -> Result<(), Raised> {
    sizes().play(stage, &[0])?;
    let mut shaders = Vec::new();
    for size in SIZES {
        let name = size_name(size);
        shaders.push((
            stage.register_shader(&format!("i/bare-{name}"))?,
            stage.register_shader_no_mip(&format!("i/barenomip-{name}"))?,
        ));
    }
    stage.keep("pictures", |e| {
        e.set_color(None)?;
        for (i, (plain, no_mip)) in shaders.iter().enumerate() {
            let (column, row) = ((i % 6) as f32, (i / 6) as f32);
            for (half, shader) in [(0.0, plain), (1.0, no_mip)] {
                let place = [
                    column * 105.0 + 5.0,
                    (row * 2.0 + half) * 118.0 + 5.0,
                    95.0,
                    108.0,
                ];
                e.draw_stretch_pic(place, [-0.2, -0.2, 1.3, 1.3], *shader)?;
            }
        }
        Ok(())
    })
}

const fn sized(
    name: &'static str,
    about: &'static str,
    cvars: &'static [(&'static str, &'static str)],
) -> Scene {
    Scene {
        files: size_files,
        cvars,
        ..Scene::new(name, about, play_sizes)
    }
}

fn levels() -> Board {
    let scales = ["0.5 0.5", "1 1", "2 2", "4 4", "8 8", "1 6", "7 1", "16 16"];
    let with = |map: &'static str| {
        scales.map(|s| format!("{{\n{map}\ntcMod scale {s}\nrgbGen identity\n}}"))
    };
    Board::new(8, Shape::Face, with("map g/base.tga"))
        .and(Shape::Face, with("map g/fine.tga"))
        .and(Shape::Face, with("map i/s100x60.tga"))
        .and(Shape::Patch, with("map g/wide.tga"))
}

fn level_files() -> Vec<File> {
    let mut files = levels().files();
    files.extend(
        size_files()
            .into_iter()
            .filter(|(name, _)| name.starts_with("i/s")),
    );
    files
}

fn play_levels(stage: &mut Stage) -> Result<(), Raised> {
    levels().play(stage, &[0])
}

/// Without mip levels what is far is noise, and its place in the picture is the driver's: here texels are large.
fn close() -> Board {
    let with = |map: &'static str, scales: [&'static str; 4]| {
        scales.map(|s| format!("{{\n{map}\ntcMod scale {s}\nrgbGen identity\n}}"))
    };
    Board::new(
        4,
        Shape::Face,
        with(
            "map g/base.tga",
            ["0.2 0.2", "0.3 0.3", "0.5 0.5", "0.3 0.7"],
        ),
    )
    .and(
        Shape::Face,
        with(
            "map g/fine.tga",
            ["0.03 0.03", "0.05 0.05", "0.1 0.1", "0.1 0.05"],
        ),
    )
    .and(
        Shape::Face,
        with(
            "map g/wide.tga",
            ["0.2 0.2", "0.3 0.3", "0.2 0.5", "0.3 0.7"],
        ),
    )
}

fn play_modes_of(stage: &mut Stage, board: &Board, modes: &[&str]) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = board.view(stage);
    for mode in modes {
        stage.set("r_textureMode", mode);
        let name = mode.to_ascii_lowercase().replace('_', "-");
        stage.keep(&name, |e| board.draw(e, &view))?;
    }
    Ok(())
}

fn play_modes(stage: &mut Stage) -> Result<(), Raised> {
    let modes = [
        "GL_NEAREST_MIPMAP_NEAREST",
        "gl_linear_mipmap_nearest",
        "GL_NEAREST_MIPMAP_LINEAR",
        "GL_NO_SUCH_MODE",
        "GL_LINEAR_MIPMAP_LINEAR",
    ];
    play_modes_of(stage, &levels(), &modes)
}

fn play_close(stage: &mut Stage) -> Result<(), Raised> {
    play_modes_of(stage, &close(), &["GL_NEAREST", "GL_LINEAR"])
}

const fn level_scene(
    name: &'static str,
    about: &'static str,
    cvars: &'static [(&'static str, &'static str)],
) -> Scene {
    Scene {
        files: level_files,
        cvars,
        ..Scene::new(name, about, play_levels)
    }
}

macro_rules! format_scene {
    ($name:literal, $about:literal, $extension:literal) => {
        Scene {
            files: || format_files($extension),
            quick: true,
            ..Scene::new($name, $about, |stage| formats($extension).play(stage, &[0]))
        }
    };
}

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    vec![
        format_scene!("image-tga", "Every kind of TGA.", ".tga"),
        format_scene!("image-jpg", "JPEGs.", "jpg"),
        format_scene!("image-png", "Every kind of PNG.", ".png"),
        format_scene!("image-pcx", "A PCX.", ".pcx"),
        format_scene!("image-bmp", "Every kind of BMP.", ".bmp"),
        Scene {
            files: || {
                search()
                    .files()
                    .into_iter()
                    .chain(in_folder(found()))
                    .collect()
            },
            quick: true,
            ..Scene::new("image-search", "Which file a name finds.", |stage| {
                search().play(stage, &[0])
            })
        },
        sized("image-sizes", "Sides that are no powers of two.", &[]),
        sized(
            "image-sizes-up",
            "The same, enlarged.",
            &[("r_roundImagesDown", "0")],
        ),
        sized(
            "image-picmip",
            "The same, halved twice where that is allowed.",
            &[("r_picmip", "2")],
        ),
        sized(
            "image-brightness",
            "The same, with gamma and intensity in the textures.",
            &[
                ("r_ignorehwgamma", "1"),
                ("r_gamma", "1.8"),
                ("r_intensity", "1.5"),
                ("r_picmip", "1"),
            ],
        ),
        level_scene(
            "image-weighted",
            "Mip levels by the wider filter.",
            &[("r_simpleMipMaps", "0")],
        ),
        level_scene(
            "image-tints",
            "Tinted mip levels.",
            &[("r_colorMipLevels", "1")],
        ),
        Scene {
            files: level_files,
            ..Scene::new("image-modes", "r_textureMode with mip levels.", play_modes)
        },
        Scene {
            files: || close().files(),
            ..Scene::new(
                "image-modes-close",
                "r_textureMode without mip levels.",
                play_close,
            )
        },
    ]
}
