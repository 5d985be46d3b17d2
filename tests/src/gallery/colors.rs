//! `rgbGen` and `alphaGen`: every kind, every wave.

use super::board::{Board, Shape};
use super::{Scene, scene_list};

/// The waves of the language; noise has rules of its own.
const FUNCTIONS: [&str; 5] = ["sin", "square", "triangle", "sawtooth", "inversesawtooth"];
/// Base, amplitude, phase, frequency: within range, clamped, backwards, slow.
const SHAPES: [&str; 4] = [
    "0.5 0.5 0 1",
    "0.3 1.2 0.37 0.61",
    "0.6 -0.4 -1.7 -2.3",
    "0.25 0.7 0.125 0.013",
];
/// Milliseconds after the beginning.
const TIMES: [i32; 4] = [0, 337, 1250, 3_600_123];

/// Where colours can come from besides waves and constants.
const RGB: [&str; 10] = [
    "identity",
    "identityLighting",
    "entity",
    "oneMinusEntity",
    "vertex",
    "exactVertex",
    "oneMinusVertex",
    "lightingDiffuse",
    "const ( 0.2 0.7 1.0 )",
    "wave sin 0.5 0.3 0 0.4",
];
const ALPHA: [&str; 8] = [
    "identity",
    "const 0.3",
    "entity",
    "oneMinusEntity",
    "vertex",
    "oneMinusVertex",
    "lightingSpecular",
    "wave triangle 0.5 0.4 0.1 0.7",
];

fn waves(stage: fn(&str) -> String) -> Board {
    let all = FUNCTIONS
        .iter()
        .flat_map(|f| SHAPES.iter().map(move |s| stage(&format!("wave {f} {s}"))));
    let odd = [
        stage("wave nonsense 0.5 0.5 0 1"), // a sine, with a warning
        stage("wave SIN 0.5 0.5 0.25 0"),
        stage("wave square 0.5 0.5 0.4999 0"),
        stage("wave sin 2 1 0 1"),
    ];
    Board::new(6, Shape::Face, all.chain(odd))
}

fn rgb_waves() -> Board {
    waves(|w| format!("{{\nmap g/white.tga\nrgbGen {w}\n}}"))
}

fn alpha_waves() -> Board {
    waves(|w| format!("{{\nmap g/base.tga\nblendFunc blend\nrgbGen identity\nalphaGen {w}\n}}"))
}

fn noise() -> Board {
    let shapes = [
        "0.5 0.5 0 1",
        "0.5 1 0.3 7.1",
        "1 2 5 0.4",
        "0.2 0.6 0.7 60",
    ];
    Board::new(
        4,
        Shape::Face,
        shapes.map(|s| format!("{{\nmap g/white.tga\nrgbGen wave noise {s}\n}}")),
    )
}

fn rgb_kinds(shape: Shape) -> Board {
    // Models have no colours and pictures and polygons no normals: the reference shows what was drawn before them.
    let defined = |g: &&&str| shape != Shape::Model || !g.to_lowercase().contains("vertex");
    let kinds = || RGB.iter().filter(defined);
    let plain = kinds().map(|g| format!("{{\nmap g/white.tga\nrgbGen {g}\n}}"));
    let blended = kinds().map(|g| format!("{{\nmap g/base.tga\nblendFunc blend\nrgbGen {g}\n}}"));
    Board::new(5, shape, plain.chain(blended))
}

fn alpha_kinds(shape: Shape) -> Board {
    let plain = ALPHA.map(|g| format!("{{\nmap g/base.tga\nblendFunc blend\nalphaGen {g}\n}}"));
    // what sets all four channels, before and after
    let mixed = [
        "alphaGen const 0.4\nrgbGen entity",
        "rgbGen entity\nalphaGen const 0.4",
        "rgbGen exactVertex\nalphaGen identity",
        "alphaGen wave sin 0.5 0.2 0 1\nrgbGen exactVertex",
        "rgbGen vertex\nalphaGen identity",
        "alphaGen identity\nrgbGen vertex",
        "rgbGen vertex",
        "rgbGen lightingDiffuse\nalphaGen const 0.5",
    ]
    .map(|g| format!("{{\nmap g/base.tga\nblendFunc blend\n{g}\n}}"));
    let defined = |body: &String| match shape {
        Shape::Model => !body.to_lowercase().contains("vertex"),
        Shape::Poly | Shape::Picture => !body.contains("Specular"),
        _ => true,
    };
    let all = plain.into_iter().chain(mixed);
    Board::new(4, shape, all.filter(defined))
}

/// What `r_greyscale` takes the colour out of: every source of colours on every shape that has it.
fn grey() -> Board {
    let colored = |shape, kinds: &[&str]| {
        let body = |kind: &&str| format!("{{\nmap g/base.tga\nrgbGen {kind}\n}}");
        Board::new(6, shape, kinds.iter().map(body))
    };
    let mut board = colored(Shape::Face, &RGB);
    for (shape, kinds) in [
        (Shape::Dome(6), &["exactVertex", "const ( 1 0.3 0.1 )"][..]),
        (
            Shape::Model,
            &["entity", "oneMinusEntity", "lightingDiffuse"],
        ),
        (Shape::Sprite, &["entity", "vertex"]),
        (Shape::Poly, &["vertex", "oneMinusVertex"]),
        (
            Shape::Picture,
            &["vertex", "exactVertex", "const ( 0.1 0.9 0.4 )"],
        ),
    ] {
        board.tiles.extend(colored(shape, kinds).tiles);
    }
    board
}

fn portal_alpha() -> Board {
    let ranges = [64.0, 128.0, 150.0, 200.0, 256.0, 1000.0, 0.0];
    let stages =
        ranges.map(|r| format!("{{\nmap g/base.tga\nblendFunc blend\nalphaGen portal {r}\n}}"));
    let none = "{\nmap g/base.tga\nblendFunc blend\nalphaGen portal\n}".to_string();
    Board::new(4, Shape::Squares(4), stages.into_iter().chain([none]))
}

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "rgb-waves": "rgbGen wave: every function.", board(rgb_waves(), &TIMES), quick: true;
        "alpha-waves": "alphaGen wave: every function.", board(alpha_waves(), &TIMES);
        "rgb-grey": "Every colour with r_greyscale 1.",
            board(grey(), &[0]), cvars: &[("r_greyscale", "1")], quick: true;
        "rgb-half-grey": "Every colour with r_greyscale 0.4.", board(grey(), &[0]), cvars: &[("r_greyscale", "0.4")];
        "rgb-noise": "rgbGen wave noise.", board(noise(), &[0, 337, 1250, 40_000]);
        "rgb-face": "rgbGen on faces.", board(rgb_kinds(Shape::Face), &[0, 700]), quick: true;
        "rgb-soup": "rgbGen on triangle soups.", board(rgb_kinds(Shape::Squares(3)), &[0]);
        "rgb-patch": "rgbGen on patches.", board(rgb_kinds(Shape::Patch), &[0]);
        "rgb-model": "rgbGen on models.", board(rgb_kinds(Shape::Model), &[0, 700]), quick: true;
        "rgb-poly": "rgbGen on polygons.", board(rgb_kinds(Shape::Poly), &[0, 700]);
        "rgb-sprite": "rgbGen on sprites.", board(rgb_kinds(Shape::Sprite), &[0, 700]);
        "rgb-picture": "rgbGen in 2D.", board(rgb_kinds(Shape::Picture), &[0, 700]);
        "alpha-face": "alphaGen on faces.", board(alpha_kinds(Shape::Face), &[0, 700]), quick: true;
        "alpha-soup": "alphaGen on soups.", board(alpha_kinds(Shape::Dome(6)), &[0]);
        "alpha-model": "alphaGen on models.", board(alpha_kinds(Shape::Model), &[0]), quick: true;
        "alpha-poly": "alphaGen on polygons.", board(alpha_kinds(Shape::Poly), &[0]);
        "alpha-sprite": "alphaGen on sprites.", board(alpha_kinds(Shape::Sprite), &[0]);
        "alpha-picture": "alphaGen in 2D.", board(alpha_kinds(Shape::Picture), &[0]);
        "alpha-portal": "alphaGen portal: fades by distance.", board(portal_alpha(), &[0]);
    }
}
