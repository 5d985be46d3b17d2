//! `deformVertexes`: every kind.

use super::board::{Board, Shape};
use super::{Scene, Stage, scene_list};
use crate::engine::Raised;

const TIMES: [i32; 3] = [0, 337, 2_250];

const KINDS: [&str; 14] = [
    "deformVertexes wave 100 sin 0 8 0 0.5",
    "deformVertexes wave 30 triangle 2 6 0.3 1.1",
    "deformVertexes wave 50 square 0 5 0 0.3",
    "deformVertexes wave 0 sin 0 8 0.25 0.5",
    "deformVertexes wave 20 sawtooth 3 8 0.2 0",
    "deformVertexes wave 60 inversesawtooth -4 8 0.1 2",
    "deformVertexes bulge 6 8 2",
    "deformVertexes bulge 20 5 -1",
    "deformVertexes move 4 8 0 sin 0 1 0 0.5",
    "deformVertexes move 0 0 10 sawtooth 0 1 0.3 0.8",
    "deformVertexes wave 100 sin 0 8 0 0.5\ndeformVertexes move 0 5 5 sin 0 1 0 1",
    "deformVertexes move 0 5 5 sin 0 1 0 1\ndeformVertexes bulge 6 8 2\ndeformVertexes wave 40 sin 0 3 0 1",
    "deformVertexes wave -30 sin 0 6 0 0.7",
    "",
];

fn kinds(shape: Shape) -> Board {
    // Pictures and polygons have no normals to move along.
    let bare = matches!(shape, Shape::Poly | Shape::Picture);
    let kinds = KINDS
        .iter()
        .filter(|d| !bare || !(d.contains("wave") || d.contains("bulge")));
    Board::new(
        5,
        shape,
        kinds.map(|d| format!("{d}\n{{\nmap g/base.tga\nrgbGen identity\n}}")),
    )
}

/// Normals show in environment coordinates and in light.
fn normals(shape: Shape) -> Board {
    let kinds = [
        "",
        "deformVertexes normal 0.5 1",
        "deformVertexes normal 2 0.3",
        "deformVertexes normal 0.1 5",
        "deformVertexes wave 30 sin 0 8 0 0.5",
        "deformVertexes normal 0.6 1\ndeformVertexes wave 30 sin 0 8 0 0.5",
    ];
    let shown = [
        "tcGen environment\nrgbGen identity",
        "rgbGen lightingDiffuse",
    ];
    let all = shown
        .iter()
        .flat_map(|s| kinds.map(|k| format!("{k}\n{{\nmap g/env.tga\n{s}\n}}")));
    Board::new(4, shape, all)
}

fn sprites(shape: Shape) -> Board {
    let body = |d: &str, s: &str| format!("cull none\n{d}\n{{\nmap g/base.tga\n{s}\n}}");
    // A sprite is a square, which has no short sides for `autosprite2` to find.
    let square = |body: &String| shape != Shape::Sprite || !body.contains("autosprite2");
    let bodies = [
        body("deformVertexes autosprite", "rgbGen identity"),
        body("deformVertexes autosprite", "tcGen lightmap"),
        body("deformVertexes autosprite2", "rgbGen identity"),
        body("deformVertexes autosprite", "rgbGen vertex"),
        body("deformVertexes autosprite2", "rgbGen exactVertex"),
        body(
            "deformVertexes autosprite\ndeformVertexes move 0 0 8 sin 0 1 0 1",
            "tcMod scroll 0.1 0",
        ),
        body(
            "deformVertexes wave 30 sin 0 5 0 1\ndeformVertexes autosprite2",
            "",
        ),
    ];
    Board::new(3, shape, bodies.into_iter().filter(square))
}

fn text() -> Board {
    let lines = (0..8).map(|n| {
        format!("cull none\ndeformVertexes text{n}\n{{\nmap gfx/2d/bigchars.tga\nblendFunc blend\nrgbGen identity\n}}")
    });
    Board::new(4, Shape::Squares(1), lines)
}

fn play_text(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(super::board::MAP)?;
    let board = text();
    let mut view = board.view(stage);
    view.text = [
        "HELLO",
        "a",
        "",
        "0123456789",
        "\u{1}x Y",
        "thirty-one characters are most.",
        "<>[]",
        "last",
    ];
    for yaw in [0.0, 12.0] {
        view.angles.y = yaw;
        stage.keep(&format!("yaw{yaw}"), |engine| board.draw(engine, &view))?;
    }
    Ok(())
}

/// From the side, where sprites have to turn.
fn aside(stage: &mut Stage, board: &Board) -> Result<(), Raised> {
    board.play(stage, &[0, 337])?;
    let mut view = board.view(stage);
    view.origin.y += 60.0;
    view.origin.z += 30.0;
    view.angles = glam::Vec3::new(14.0, -22.0, 25.0);
    stage.keep("turned", |engine| board.draw(engine, &view))
}

/// From where curves have fewer rows and columns, which are the points that a deformation moves.
fn from_afar(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(super::board::MAP)?;
    let board = kinds(Shape::Patch);
    let mut view = board.view(stage);
    for away in [300.0, 500.0] {
        view.origin.x -= away;
        stage.keep(&format!("{}", -view.origin.x), |engine| {
            board.draw(engine, &view)
        })?;
    }
    Ok(())
}

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "deform-soup": "deformVertexes on soups.", board(kinds(Shape::Dome(10)), &TIMES), quick: true;
        "deform-squares": "On unconnected squares.", board(kinds(Shape::Squares(5)), &TIMES);
        "deform-face": "On faces.", board(kinds(Shape::Face), &TIMES);
        "deform-patch": "On patches.", board(kinds(Shape::Patch), &TIMES);
        "deform-patch-far": "On patches with fewer columns.", calls(from_afar),
            files: || kinds(Shape::Patch).files(), quick: true;
        "deform-model": "On models.", board(kinds(Shape::Model), &TIMES);
        "deform-sprite": "On sprites.", board(kinds(Shape::Sprite), &[337]);
        "deform-poly": "On polygons.", board(kinds(Shape::Poly), &[337]);
        "deform-picture": "In 2D.", board(kinds(Shape::Picture), &[337]);
        "deform-normal": "deformVertexes normal on soups.", board(normals(Shape::Dome(8)), &TIMES);
        "deform-normal-model": "On models.", board(normals(Shape::Model), &TIMES);
        "autosprite": "deformVertexes autosprite and autosprite2.",
            calls(|stage| aside(stage, &sprites(Shape::Squares(2)))), files: || sprites(Shape::Squares(2)).files(),
            quick: true;
        "autosprite-face": "The same on faces.",
            calls(|stage| aside(stage, &sprites(Shape::Face))), files: || sprites(Shape::Face).files();
        "autosprite-sprite": "The same on sprites.",
            calls(|stage| aside(stage, &sprites(Shape::Sprite))), files: || sprites(Shape::Sprite).files();
        "deform-text": "deformVertexes text0 to text7.", calls(play_text), files: || text().files();
    }
}
