//! The renderer's calls, one by one.

use super::{Scene, Stage};
use crate::engine::Raised;

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    vec![Scene {
        files: || board().files(),
        quick: true,
        ..Scene::new(
            "first-look",
            "Pictures, text and a board of plain surfaces.",
            first_look,
        )
    }]
}

fn board() -> super::board::Board {
    use super::board::{Board, Shape};
    Board::new(4, Shape::Face, ["", "{\nmap g/base.tga\nrgbGen vertex\n}"])
        .and(
            Shape::Squares(2),
            ["", "{\nmap g/base.tga\nrgbGen vertex\n}"],
        )
        .and(
            Shape::Dome(6),
            ["", "{\nmap g/env.tga\ntcGen environment\n}"],
        )
        .and(Shape::Patch, ["", "{\nmap $lightmap\n}"])
}

fn first_look(stage: &mut Stage) -> Result<(), Raised> {
    let base = stage.register_shader_no_mip("g/base")?;
    let letters = stage.register_shader("gfx/2d/bigchars")?;
    stage.fact("handles", format!("{} {}", base > 0, letters > 0));
    let whole = [0.0, 0.0, 1.0, 1.0];
    stage.keep("2d", |e| {
        e.set_color(Some([0.2, 0.3, 0.4, 1.0]))?;
        let white = e.register_shader("g/white")?;
        e.draw_stretch_pic([0.0, 0.0, 640.0, 480.0], whole, white)?;
        e.set_color(None)?;
        e.draw_stretch_pic([40.0, 40.0, 200.0, 150.0], whole, base)?;
        e.draw_stretch_pic([300.0, 40.0, 256.0, 256.0], whole, letters)
    })?;
    board().play(stage, &[0])
}
