//! What leaves the renderer: screenshots, still pictures, frames of a video, costs.

use super::support::{engine_in_map, for_every_engine, image_of, text_of};
use relight::compare::Rgb8;
use tests::engine::{Engine, View};
use tests::maps::{HERE, ROOMS};

for_every_engine!(
    screenshots_are_files,
    captures_show_the_frame_in_which_they_were_asked_for,
    what_is_not_written_is_not_called_written,
    video_frames_reach_the_writer,
);

fn screenshots_are_files() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let shown = engine.picture(&view).unwrap();
    let frame = |engine: &mut Engine, command: &str| {
        engine.begin_frame(0).unwrap();
        engine.clear_scene().unwrap();
        engine.render_scene(&view).unwrap();
        engine.command(command).unwrap();
        engine.end_frame().unwrap();
    };
    frame(&mut engine, "screenshot");
    assert!(engine.read_file("screenshots/shot0000.tga").is_some());
    frame(&mut engine, "screenshot");
    assert!(engine.read_file("screenshots/shot0001.tga").is_some());
    frame(&mut engine, "screenshotJPEG good");
    let jpeg = engine.read_file("screenshots/good.jpg").unwrap();
    let jpeg = image_of(&jpeg, "jpg");
    let alike = relight::compare::compare(&shown, &jpeg).unwrap();
    assert!(alike.ssim > 0.95, "{alike:?}");
    frame(&mut engine, "screenshot levelshot");
    let levelshot = engine.read_file("levelshots/rooms.tga").unwrap();
    let levelshot = image_of(&levelshot, "tga");
    assert_eq!((levelshot.width(), levelshot.height()), (128, 128));
    engine.assert_clean();
}

fn captures_show_the_frame_in_which_they_were_asked_for() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let shown = engine.picture(&view).unwrap();
    let unlike = engine.picture(&View::new(HERE, 120.0)).unwrap();
    assert!(relight::compare::compare(&shown, &unlike).unwrap().ssim < 0.9);
    // one line of commands: the picture, then what draws frames of its own
    engine.picture(&view).unwrap();
    engine.take_messages();
    engine.command("screenshot now").unwrap();
    engine.command("screenshot silent").unwrap();
    engine.command("screenshotJPEG now").unwrap();
    engine.command("screenshot levelshot").unwrap();
    let (mut capture, mut encode) = (vec![0; 320 * 240 * 8], vec![0; 320 * 240 * 8]);
    (engine.take_video_frame(320, 240, &mut capture, &mut encode, true)).unwrap();
    let lines = text_of(&engine.take_messages());
    assert!(lines.contains("Wrote screenshots/now.tga"), "{lines}");
    assert!(!lines.contains("shot0000"), "{lines}");
    engine.start_map(ROOMS).unwrap();
    engine.restart_video().unwrap();
    engine.picture_of(|_| Ok(())).unwrap();
    for name in ["now.tga", "shot0000.tga"] {
        let file = engine.read_file(&format!("screenshots/{name}")).unwrap();
        assert_eq!(image_of(&file, "tga"), shown, "{name}");
    }
    let film = engine.take_video();
    assert_eq!(film.len(), 1);
    let jpeg = engine.read_file("screenshots/now.jpg").unwrap();
    for (name, bytes) in [("now.jpg", &jpeg), ("the film", &film[0])] {
        let alike = relight::compare::compare(&shown, &image_of(bytes, "jpg")).unwrap();
        assert!(alike.ssim > 0.9, "{name}: {alike:?}");
    }
    assert!(engine.read_file("levelshots/rooms.tga").is_some());
    // before the first frame there is nothing to show: the picture waits for one
    engine.command("screenshot first").unwrap();
    engine.restart_video().unwrap();
    engine.command("screenshot later").unwrap();
    assert!(engine.read_file("screenshots/later.tga").is_none());
    engine.picture_of(|_| Ok(())).unwrap();
    assert!(engine.read_file("screenshots/first.tga").is_some());
    assert!(engine.read_file("screenshots/later.tga").is_some());
    engine.assert_clean();
}

fn what_is_not_written_is_not_called_written() {
    let mut engine = engine_in_map();
    engine.set("r_rt", "1");
    let view = View::new(HERE, 30.0);
    engine.picture(&view).unwrap();
    engine.take_messages();
    for command in [
        "rt_stats json ../../x",
        "rt_path ../../x",
        "screenshot ../../x",
        "screenshotJPEG a::b",
    ] {
        engine.command(command).unwrap();
        let lines = text_of(&engine.take_messages());
        assert!(
            lines.contains("not a name for a file"),
            "{command}: {lines}"
        );
    }
    // a name that is fine, where the engine cannot write
    std::fs::write(engine.home().join("stats"), b"no folder").unwrap();
    std::fs::write(engine.home().join("paths"), b"no folder").unwrap();
    std::fs::remove_dir_all(engine.home().join("screenshots")).unwrap();
    std::fs::write(engine.home().join("screenshots"), b"no folder").unwrap();
    for command in [
        "rt_stats json stats/x",
        "rt_path x",
        "screenshot x",
        "rt_path x",
    ] {
        engine.command(command).unwrap();
    }
    for _ in 0..5 {
        engine.begin_frame(0).unwrap();
        engine.end_frame().unwrap();
    }
    let lines = text_of(&engine.take_messages());
    assert!(!lines.contains("Wrote"), "{lines}");
    for file in ["stats/x.json", "paths/x.txt", "screenshots/x.tga"] {
        let line = format!("{file} could not be written");
        assert!(lines.contains(&line), "{line}: {lines}");
    }
    engine.assert_clean();
}

#[test]
fn a_still_picture_that_its_map_does_not_live_to_see_is_told() {
    let mut engine = engine_in_map();
    engine.set("r_rt", "1");
    let view = View::new(HERE, 30.0);
    engine.picture(&view).unwrap();
    engine.command("rt_screenshot 4000").unwrap();
    engine.picture(&view).unwrap();
    engine.take_messages();
    engine.start_map(ROOMS).unwrap();
    let lines = text_of(&engine.take_messages());
    assert!(
        lines.contains("rt_screenshot: screenshots/shot0000.tga was not made"),
        "{lines}"
    );
    engine.assert_clean();
}

#[test]
fn a_still_picture_is_made_beside_the_game() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let frame = |engine: &mut Engine, command: &str, yaw: f32| {
        engine.begin_frame(0).unwrap();
        engine.clear_scene().unwrap();
        engine.render_scene(&View::new(HERE, yaw)).unwrap();
        if !command.is_empty() {
            engine.command(command).unwrap();
        }
        engine.end_frame().unwrap();
    };
    let printed = |engine: &mut Engine| text_of(&engine.take_messages());
    engine.take_messages();
    frame(&mut engine, "rt_screenshot 4", 30.0);
    assert!(
        printed(&mut engine).contains("set r_rt 1"),
        "it needs the traced look"
    );
    engine.set("r_rt", "1");
    engine.set("rt_accumulate", "1");
    let mut shown = engine.picture(&view).unwrap();
    for _ in 0..15 {
        shown = engine.picture(&view).unwrap();
    }
    engine.set("rt_accumulate", "0");
    for wrong in [
        "rt_screenshot",
        "rt_screenshot 0",
        "rt_screenshot 2 big",
        "rt_screenshot 2 0x9",
    ] {
        engine.take_messages();
        frame(&mut engine, wrong, 30.0);
        assert!(
            printed(&mut engine).contains("rt_screenshot"),
            "{wrong} is taken"
        );
    }
    engine.take_messages();
    frame(&mut engine, "rt_screenshot 16 320x240", 30.0);
    frame(&mut engine, "rt_screenshot 1", 30.0);
    // the picture is of the view at the request, whatever the game shows meanwhile
    for _ in 0..20 {
        frame(&mut engine, "", 120.0);
    }
    let lines = printed(&mut engine);
    assert!(
        lines.contains("in progress") && lines.contains("of 16 samples"),
        "{lines}"
    );
    let file = engine
        .read_file("screenshots/shot0000.tga")
        .expect("the picture");
    let alike = relight::compare::compare(&shown, &image_of(&file, "tga")).unwrap();
    assert!(alike.ssim > 0.9, "{alike:?}");
    // larger than the window
    frame(&mut engine, "rt_screenshot 1 400x300", 30.0);
    frame(&mut engine, "", 30.0);
    frame(&mut engine, "", 30.0);
    let file = engine
        .read_file("screenshots/shot0001.tga")
        .expect("the picture");
    let large = image_of(&file, "tga");
    assert_eq!((large.width(), large.height()), (400, 300));
    engine.assert_clean();
}

// It uses no table of the engine that other tests do not use, and takes 55 s on two cores: one engine is enough.
#[test]
fn costs_are_told_in_lines_and_as_json() {
    let mut engine = engine_in_map();
    engine.set("r_rt", "1");
    let view = View::new(HERE, 30.0);
    engine.picture(&view).unwrap();
    engine.command("rt_stats").unwrap();
    engine.command("rt_stats json stats/frame").unwrap();
    engine.take_messages();
    for _ in 0..5 {
        engine.picture(&view).unwrap();
    }
    let lines = text_of(&engine.take_messages());
    for part in [
        "trace_primary_rays",
        "rays",
        "all passes",
        "screen images",
        "textures",
    ] {
        assert!(lines.contains(part), "no {part} in {lines}");
    }
    let json = engine.read_file("stats/frame.json").expect("the file");
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let passes = json["passes"].as_array().expect("a list");
    let primary = passes.iter().find(|p| p["name"] == "trace_primary_rays");
    let rays = primary.and_then(|p| p["rays"].as_u64()).expect("a number");
    assert!(rays >= 320 * 240, "{rays}");
    engine.assert_clean();
}

fn video_frames_reach_the_writer() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let shown = engine.picture(&view).unwrap();
    let (mut capture, mut encode) = (vec![0; 320 * 240 * 8], vec![0; 320 * 240 * 8]);
    for jpeg in [false, true] {
        engine.begin_frame(0).unwrap();
        engine.clear_scene().unwrap();
        engine.render_scene(&view).unwrap();
        engine
            .take_video_frame(320, 240, &mut capture, &mut encode, jpeg)
            .unwrap();
        engine.end_frame().unwrap();
    }
    let frames = engine.take_video();
    assert_eq!(frames.len(), 2);
    // blue first, rows from the bottom
    assert_eq!(frames[0].len(), 320 * 240 * 3);
    let rgb: Vec<u8> = frames[0]
        .chunks_exact(320 * 3)
        .rev()
        .flatten()
        .copied()
        .collect();
    let rgb: Vec<u8> = rgb
        .chunks_exact(3)
        .flat_map(|p| [p[2], p[1], p[0]])
        .collect();
    assert_eq!(Rgb8::new(320, 240, rgb).unwrap(), shown);
    assert_eq!(frames[1][..2], [0xFF, 0xD8]);
    let alike = relight::compare::compare(&shown, &image_of(&frames[1], "jpg")).unwrap();
    assert!(alike.ssim > 0.9, "{alike:?}");
    engine.assert_clean();
}
