//! The renderer's calls, one by one: 2D, fonts, films, remaps, queries, views, captures.

mod answers;
mod pictures;
mod views;

use super::board::{Board, Shape};
use super::{File, Limit, Scene, Stage, model, scene_list};
use crate::engine::Raised;
use crate::maps;

const WHOLE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "first-look": "Pictures, text and a board of plain surfaces.",
            calls(first_look), files: || board().files(), quick: true;
        "2d-pictures": "DrawStretchPic and SetColor.",
            calls(pictures::pictures), files: || script(pictures::PICTURES), quick: true;
        "2d-between": "Pictures whose edges run through centres of pixels, or near them.",
            calls(pictures::between), limit: Limit { ssim: 0.9999, ..Limit::SAME }, quick: true;
        "2d-raw": "DrawStretchRaw and UploadCinematic.", calls(pictures::raw), quick: true;
        "2d-font": "RegisterFont and its glyphs.", calls(pictures::font), files: pictures::fonts;
        "register": "What registering answers.", calls(answers::register), files: answers::registered, quick: true;
        "remap": "RemapShader on surfaces, entities, pictures.",
            calls(answers::remap), files: || answers::remapped().files(), quick: true;
        "queries": "Answers about the map and models.",
            calls(answers::queries), files: || [maps::files(), model::files()].concat(), quick: true;
        "marks": "Marks where the map takes them.", calls(answers::marks), files: || answers::marked().files();
        "marks-meshes": "Marks on triangle meshes, too.",
            calls(answers::marks), files: || answers::marked().files(), cvars: &[("r_marksOnTriangleMeshes", "1")];
        "views": "Several views and pictures in a frame.", calls(views::views), files: || board().files(), quick: true;
        "captures": "TakeVideoFrame, screenshots, level shots.", calls(views::captures), files: || board().files();
    }
}

fn script(text: &str) -> Vec<File> {
    vec![("scripts/calls.shader".to_string(), text.as_bytes().to_vec())]
}

fn board() -> Board {
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

/// Fills the window with a colour.
fn clear(engine: &mut crate::engine::Engine) -> Result<(), Raised> {
    let white = engine.register_shader("g/white")?;
    engine.set_color(Some([0.2, 0.3, 0.4, 1.0]))?;
    engine.draw_stretch_pic([0.0, 0.0, 640.0, 480.0], WHOLE, white)?;
    engine.set_color(None)
}

fn first_look(stage: &mut Stage) -> Result<(), Raised> {
    let base = stage.register_shader_no_mip("g/base")?;
    let letters = stage.register_shader("gfx/2d/bigchars")?;
    stage.fact("handles", format!("{} {}", base > 0, letters > 0));
    stage.keep("2d", |e| {
        clear(e)?;
        e.draw_stretch_pic([40.0, 40.0, 200.0, 150.0], WHOLE, base)?;
        e.draw_stretch_pic([300.0, 40.0, 256.0, 256.0], WHOLE, letters)
    })?;
    board().play(stage, &[0])
}
