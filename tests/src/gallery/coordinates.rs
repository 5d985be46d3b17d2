//! `tcGen` and `tcMod`: every kind, alone and in orders.

use super::board::{Board, Shape};
use super::{Scene, scene_list};

const TIMES: [i32; 3] = [0, 337, 61_250];

const GENERATORS: [&str; 9] = [
    "tcGen base",
    "tcGen texture",
    "tcGen lightmap",
    "tcGen environment",
    "tcGen vector ( 0 0.02 0 ) ( 0 0 0.03 )",
    "tcGen vector ( 0.01 0.005 0.01 ) ( 0 -0.01 0.02 )",
    "texGen environment",
    "tcGen nonsense",
    "",
];

const MODIFIERS: [&str; 24] = [
    "tcMod turb 0 0.25 0 0.2",
    "tcMod turb 5 0.1 0.7 1.3",
    "tcMod turb 0 0.4 -0.3 -0.7",
    "tcMod scale 2 0.5",
    "tcMod scale -1 3",
    "tcMod scroll 0.3 -0.7",
    "tcMod scroll 25 0.01",
    "tcMod stretch sin 1 0.5 0 0.4",
    "tcMod stretch sawtooth 0.5 2 0.1 0.3",
    "tcMod stretch inversesawtooth 0.5 1 0 0.7",
    "tcMod stretch triangle 1.5 -0.7 0.2 1",
    "tcMod stretch square 1 0.5 0 3",
    "tcMod transform 0.5 0.2 -0.3 1.5 0.1 0.7",
    "tcMod rotate 45",
    "tcMod rotate -333",
    "tcMod entityTranslate",
    "tcMod scale 2 2\ntcMod rotate 30\ntcMod scroll 0.1 0.2",
    "tcMod scroll 0.1 0.2\ntcMod rotate 30\ntcMod scale 2 2",
    "tcMod rotate 30\ntcMod stretch sin 1 0.3 0 1\ntcMod turb 0 0.1 0 1\ntcMod scale 0.7 1.3",
    "tcMod turb 0 0.1 0 1\ntcMod transform 1 0.5 0 1 0 0\ntcMod entityTranslate\ntcMod rotate 7",
    "tcMod scroll 0.5 0.5\ntcMod scroll -0.25 1",
    "tcMod scale 8 8",
    "tcMod rotate 0",
    "tcMod scroll 0 0",
];

fn generators(shape: Shape) -> Board {
    // Pictures and polygons have no normals, and those and models no lightmap: the reference shows what was drawn
    // before them.
    let bare = matches!(shape, Shape::Poly | Shape::Picture);
    let unlit = bare || shape == Shape::Model;
    let kinds = GENERATORS
        .iter()
        .filter(|g| !(bare && g.contains("environment") || unlit && g.contains("lightmap")));
    Board::new(
        3,
        shape,
        kinds.map(|g| format!("{{\nmap g/env.tga\n{g}\n}}")),
    )
}

fn modifiers(shape: Shape) -> Board {
    Board::new(
        6,
        shape,
        MODIFIERS.map(|m| format!("{{\nmap g/base.tga\n{m}\n}}")),
    )
}

fn together(shape: Shape) -> Board {
    let generators = [
        "environment",
        "lightmap",
        "vector ( 0.01 0.01 0 ) ( 0 0.01 0.02 )",
    ];
    let lit = generators
        .iter()
        .filter(|g| shape != Shape::Model || **g != "lightmap");
    let all = lit.flat_map(|g| {
        MODIFIERS[..16]
            .iter()
            .step_by(2)
            .map(move |m| format!("{{\nmap g/env.tga\ntcGen {g}\n{m}\n}}"))
    });
    Board::new(6, shape, all)
}

/// Mip levels: the same fine checkerboard, nearer and farther.
fn levels() -> Board {
    let scales = [
        "0.25 0.25",
        "0.5 0.5",
        "1 1",
        "2 2",
        "4 4",
        "1 6",
        "7 1",
        "0.3 3",
    ];
    let with = |head: &'static str| {
        scales.map(|s| format!("{head}\n{{\nmap g/fine.tga\ntcMod scale {s}\n}}"))
    };
    Board::new(8, Shape::Face, with(""))
        .and(Shape::Face, with("nomipmaps"))
        .and(Shape::Patch, with(""))
}

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "tcgen-soup": "tcGen on soups.", board(generators(Shape::Dome(8)), &[0]), quick: true;
        "tcgen-face": "tcGen on faces.", board(generators(Shape::Face), &[0]);
        "tcgen-patch": "tcGen on patches.", board(generators(Shape::Patch), &[0]);
        "tcgen-model": "tcGen on models.", board(generators(Shape::Model), &[0]);
        "tcgen-poly": "tcGen on polygons.", board(generators(Shape::Poly), &[0]);
        "tcgen-sprite": "tcGen on sprites.", board(generators(Shape::Sprite), &[0]);
        "tcgen-picture": "tcGen in 2D.", board(generators(Shape::Picture), &[0]);
        "tcmod-face": "tcMod on faces.", board(modifiers(Shape::Face), &TIMES), quick: true;
        "tcmod-soup": "tcMod on soups.", board(modifiers(Shape::Squares(4)), &TIMES);
        "tcmod-model": "tcMod on models.", board(modifiers(Shape::Model), &TIMES);
        "tcmod-sprite": "tcMod on sprites.", board(modifiers(Shape::Sprite), &TIMES);
        "tcmod-poly": "tcMod on polygons.", board(modifiers(Shape::Poly), &[337]);
        "tcmod-picture": "tcMod in 2D.", board(modifiers(Shape::Picture), &TIMES);
        "tc-together": "tcGen with tcMod.", board(together(Shape::Dome(8)), &[0, 700]);
        "tc-model": "The same on models.", board(together(Shape::Model), &[0, 700]);
        "tc-levels": "Mip levels.", board(levels(), &[0]);
    }
}
