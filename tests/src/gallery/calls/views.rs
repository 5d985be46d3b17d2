//! Several views in a frame, and captures of it.

use glam::Vec3;
use relight::compare::Rgb8;

use super::{WHOLE, board, clear};
use crate::engine::Raised;
use crate::engine::abi::refEntity_t;
use crate::gallery::Stage;
use crate::gallery::board::MAP;

pub(super) fn views(stage: &mut Stage) -> Result<(), Raised> {
    let board = board();
    stage.start_map(MAP)?;
    let base = stage.register_shader_no_mip("g/alpha")?;
    let dome = stage.register_model("g/dome.md3")?;
    let whole = board.view(stage);
    let head = refEntity_t {
        hModel: dome,
        origin: [80.0, 0.0, 0.0],
        frame: 1,
        ..refEntity_t::default()
    };
    stage.set_color(None)?;
    let mut inset = stage.view(Vec3::ZERO, 0.0);
    (inset.place, inset.width, inset.height) = ([400, 20], 200, 150);
    inset.flags = 1;
    inset.fov = 60.0;
    stage.keep("inset", |e| {
        e.clear_scene()?;
        e.render_scene(&whole)?;
        e.draw_stretch_pic([300.0, 0.0, 200.0, 200.0], WHOLE, base)?;
        e.clear_scene()?;
        e.add_entity(&head)?;
        e.add_light(Vec3::new(40.0, 30.0, 0.0), 100.0, Vec3::new(1.0, 0.2, 0.1))?;
        e.render_scene(&inset)?;
        e.draw_stretch_pic([450.0, 100.0, 100.0, 100.0], WHOLE, base)
    })?;
    // without ClearScene the next scene starts empty all the same
    stage.keep("marks", |e| {
        clear(e)?;
        e.clear_scene()?;
        e.add_entity(&head)?;
        e.render_scene(&inset)?;
        let mut second = inset;
        second.place = [20, 200];
        e.render_scene(&second)?;
        e.add_entity(&head)?;
        second.place = [240, 300];
        e.render_scene(&second)
    })?;
    let mut left = whole;
    (left.width, left.fov) = (320, 60.0);
    let mut right = left;
    (right.place, right.angles.y) = ([320, 0], 20.0);
    stage.keep("split", |e| {
        clear(e)?;
        e.clear_scene()?;
        e.render_scene(&left)?;
        e.clear_scene()?;
        e.render_scene(&right)
    })?;
    for (name, flags) in [("hyperspace", 5), ("hyperspace-world", 4)] {
        let mut view = whole;
        view.flags = flags;
        stage.keep(name, |e| {
            e.clear_scene()?;
            e.add_entity(&refEntity_t {
                origin: [-20.0, 0.0, 0.0],
                ..head
            })?;
            e.render_scene(&view)
        })?;
    }
    for (name, angles) in [
        ("rolled", Vec3::new(5.0, -10.0, 40.0)),
        ("down", Vec3::new(80.0, 30.0, 0.0)),
    ] {
        let mut view = whole;
        view.angles = angles;
        stage.keep(name, |e| {
            e.clear_scene()?;
            e.render_scene(&view)
        })?;
    }
    Ok(())
}

pub(super) fn captures(stage: &mut Stage) -> Result<(), Raised> {
    let board = board();
    stage.start_map(MAP)?;
    let view = board.view(stage);
    let (width, height) = stage.size();
    for jpeg in [false, true] {
        let name = if jpeg { "jpeg" } else { "raw" };
        let mut capture = vec![0; (width * height * 4) as usize + 64];
        let mut encode = capture.clone();
        stage.begin_frame(0)?;
        board.draw(stage, &view)?;
        stage.take_video_frame(width, height, &mut capture, &mut encode, jpeg)?;
        stage.end_frame()?;
        let frames = stage.take_video();
        stage.fact(&format!("{name} frames"), frames.len());
        let Some(bytes) = frames.first() else {
            continue;
        };
        let pixels: Vec<u8> = if jpeg {
            let image = image::load_from_memory(bytes).expect("a picture").to_rgb8();
            stage.fact("jpeg size", format!("{:?}", image.dimensions()));
            image.into_raw()
        } else {
            stage.fact("raw bytes", bytes.len());
            let row = width as usize * 3;
            let rows = bytes.chunks_exact(row).rev();
            rows.flat_map(|row| row.chunks_exact(3).flat_map(|p| [p[2], p[1], p[0]]))
                .collect()
        };
        let picture = Rgb8::new(width as usize, height as usize, pixels).expect("its size");
        stage.keep_picture(name, &picture);
    }
    for (command, file) in [
        ("screenshotJPEG shot", "screenshots/shot.jpg"),
        ("screenshot levelshot", "levelshots/board.tga"),
        ("screenshot", "screenshots/shot0000.tga"),
    ] {
        stage.begin_frame(0)?;
        board.draw(stage, &view)?;
        stage.command(command)?;
        stage.end_frame()?;
        let bytes = stage.read_file(file);
        stage.fact(&format!("{file} there"), bytes.is_some());
        let Some(bytes) = bytes else { continue };
        let extension = &file[file.len() - 3..];
        let image = relight::image::decode(file, extension, &bytes).expect("a picture");
        let pixels = image.pixels().flat_map(|[r, g, b, _]| [r, g, b]).collect();
        let picture =
            Rgb8::new(image.width as usize, image.height as usize, pixels).expect("its size");
        stage.keep_picture(&file.replace(['/', '.'], "-"), &picture);
    }
    Ok(())
}
