//! The viewer without a window: events in, pictures looked at.

mod follow;

use std::path::Path;
use std::time::Duration;

use glam::Vec2;
use gui::egui::{self, Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect};
use relight::GameFiles;
use relight::sample::Sample;
use renderer_vk::api::Picture;
use renderer_vk::{Renderer, RendererOptions, Settings};

use super::source::Source;
use super::state::{Shown, Start, Viewer};
use crate::chosen::{ChosenCamera, ChosenMap};
use crate::game::Game;

const SIZE: (u32, u32) = (480, 270);

/// Time between two frames.
const FRAME: Duration = Duration::from_millis(50);

/// Frames until the lights of the sample must be found.
const PATIENCE: usize = 2000;

/// Writes the sample as a game folder.
fn write_sample(folder: &Path) {
    let files = Sample::Hall.files().unwrap();
    for (dir, extension) in [("maps", ".bsp"), ("scripts", ".shader"), ("sample", ".tga")] {
        std::fs::create_dir_all(folder.join(dir)).unwrap();
        for name in files.list(dir, extension) {
            let path = format!("{dir}/{name}");
            let bytes = files.read(&path).unwrap().unwrap();
            std::fs::write(folder.join(&path), bytes).unwrap();
        }
    }
}

/// A map by this name, in a folder that is the game.
fn source_of(folder: &Path, map: &str) -> Source {
    Source {
        chosen: ChosenMap {
            map: Some(map.to_owned()),
            sample: None,
            game: Game {
                paths: vec![folder.to_owned()],
            },
        },
        lights: None,
        followed: None,
    }
}

/// Options of a small, coarse viewer of the sample in a folder.
fn start_of(folder: &Path) -> Start {
    Start {
        source: source_of(folder, "sample"),
        cache: folder.join("cache"),
        shown: Shown::Classic,
        settings: Settings {
            rt_scale: 0.25,
            ..Settings::full_size()
        },
        place: ChosenCamera {
            view: None,
            spawn: Some(0),
        },
    }
}

/// `None` without a device.
fn viewer_of(start: Start) -> Option<Viewer> {
    let renderer = testkit::device(Renderer::new(RendererOptions {
        validation: true,
        ..RendererOptions::headless(SIZE.0, SIZE.1)
    }))?;
    Some(Viewer::new(renderer, start, Box::new(|| ())).unwrap())
}

/// A viewer of the sample in a folder, by this name; `None` without a device.
fn viewer(folder: &Path, map: &str) -> Option<Viewer> {
    let mut viewer = viewer_of(Start {
        source: source_of(folder, map),
        ..start_of(folder)
    })?;
    for _ in 0..3 {
        frame(&mut viewer, []);
    }
    assert!(viewer.map.is_some());
    Some(viewer)
}

fn frame(viewer: &mut Viewer, events: impl IntoIterator<Item = Event>) {
    let size = egui::vec2(SIZE.0 as f32, SIZE.1 as f32);
    let input = RawInput {
        screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)),
        events: events.into_iter().collect(),
        ..RawInput::default()
    };
    viewer.frame(input, FRAME).unwrap();
}

fn key(key: Key, pressed: bool) -> Event {
    Event::Key {
        key,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    }
}

fn press(viewer: &mut Viewer, which: Key) {
    frame(viewer, [key(which, true)]);
    frame(viewer, [key(which, false)]);
}

fn button(at: Pos2, pressed: bool) -> Event {
    Event::PointerButton {
        pos: at,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    }
}

/// Drags the pointer, in several frames.
fn drag(viewer: &mut Viewer, from: Pos2, to: Pos2) {
    frame(viewer, [Event::PointerMoved(from)]);
    frame(viewer, [button(from, true)]);
    for step in [0.3, 0.6, 1.0] {
        frame(viewer, [Event::PointerMoved(from + (to - from) * step)]);
    }
    frame(viewer, [button(to, false)]);
    frame(viewer, []);
}

fn click(viewer: &mut Viewer, at: Pos2) {
    frame(viewer, [Event::PointerMoved(at)]);
    frame(viewer, [button(at, true)]);
    frame(viewer, [button(at, false)]);
}

/// Frames until `done`.
fn until(viewer: &mut Viewer, what: &str, done: impl Fn(&Viewer) -> bool) {
    for _ in 0..PATIENCE {
        if done(viewer) {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
        frame(viewer, []);
    }
    let problem = viewer.followed().and_then(|follow| follow.problem.as_ref());
    panic!("{what}: {:?} {problem:?}", viewer.message);
}

/// Mean difference of the columns `from..to` of the rows above the status line.
fn difference(a: &Picture, b: &Picture, from: u32, to: u32) -> f64 {
    let mut sum = 0.0;
    let mut count = 0.0;
    for y in 40..a.height - 60 {
        for x in from..to {
            for channel in 0..3 {
                let at = ((y * a.width + x) * 3 + channel) as usize;
                sum += f64::from(a.rgb[at].abs_diff(b.rgb[at]));
                count += 1.0;
            }
        }
    }
    sum / count
}

#[test]
fn mouse_and_keys_move_pick_and_split() {
    let folder = tempfile::tempdir().unwrap();
    write_sample(folder.path());
    let map = folder.path().join(Sample::Hall.map()).display().to_string();
    let Some(mut viewer) = viewer(folder.path(), &map) else {
        return;
    };
    // with the panel, then without: the view is wider
    let narrow = viewer.view_rect.width();
    press(&mut viewer, Key::H);
    frame(&mut viewer, []);
    assert!(viewer.view_rect.width() > narrow + 50.0);

    let before = viewer.motion.camera;
    frame(&mut viewer, [key(Key::W, true)]);
    frame(&mut viewer, []);
    frame(&mut viewer, [key(Key::W, false)]);
    assert!(viewer.motion.camera.origin.distance(before.origin) > 5.0);
    let yaw = viewer.motion.camera.yaw;
    drag(
        &mut viewer,
        Pos2::new(200.0, 100.0),
        Pos2::new(260.0, 100.0),
    );
    assert!((viewer.motion.camera.yaw - yaw).abs() > 5.0);

    click(&mut viewer, Pos2::new(240.0, 200.0));
    let picked = viewer.picked.as_ref().expect("a surface of the sample");
    assert!(
        picked.material.starts_with("sample/"),
        "{}",
        picked.material
    );
    assert!(picked.report.contains(&picked.material));
    let command = viewer.command();
    assert!(
        command.contains("--view=") && command.contains("--look classic"),
        "{command}"
    );

    // both looks side by side, then the edge at the right
    viewer.animates = false;
    frame(&mut viewer, []);
    let classic = viewer.picture().unwrap();
    // without moving models and lights the hybrid look is the classic one but for the environment images of
    // the floor and the globe
    press(&mut viewer, Key::Num5);
    until(&mut viewer, "no hybrid look", Viewer::is_ready);
    assert!(viewer.command().contains("--look hybrid"));
    let hybrid = viewer.picture().unwrap();
    let apart = difference(&classic, &hybrid, 10, SIZE.0 - 10);
    assert!(apart > 0.5 && apart < 4.0, "{apart}");
    press(&mut viewer, Key::Num3);
    until(&mut viewer, "no traced look", Viewer::is_ready);
    let split = viewer.picture().unwrap();
    let middle = SIZE.0 / 2;
    assert!(difference(&classic, &split, 10, middle - 10) < 0.5);
    assert!(difference(&classic, &split, middle + 10, SIZE.0 - 10) > 2.0);
    let edge = Pos2::new(viewer.view_rect.center().x, 60.0);
    let yaw = viewer.motion.camera.yaw;
    drag(&mut viewer, edge, Pos2::new(430.0, 60.0));
    assert!(
        (viewer.split - 430.0 / SIZE.0 as f32).abs() < 0.03,
        "{}",
        viewer.split
    );
    assert_eq!(viewer.motion.camera.yaw, yaw);
    let moved = viewer.picture().unwrap();
    assert!(difference(&classic, &moved, 10, 400) < 0.5);
    let messages = viewer.end();
    assert!(messages.is_empty(), "{messages:?}");
}

#[test]
fn lights_are_changed_saved_and_reloaded() {
    let folder = tempfile::tempdir().unwrap();
    write_sample(folder.path());
    // by its name in the game: only loading reads it
    let Some(mut viewer) = viewer(folder.path(), "sample") else {
        return;
    };
    press(&mut viewer, Key::H);
    press(&mut viewer, Key::Num2);
    viewer.animates = false;
    until(&mut viewer, "no traced look", Viewer::is_ready);
    let before = viewer.picture().unwrap();

    // every light off: the picture is dark
    let editor = viewer.editor.as_mut().expect("the list of lights");
    editor.items.iter_mut().for_each(|item| item.on = false);
    editor.ambient = glam::Vec3::ZERO;
    viewer.settings.rt_auto_exposure = false;
    viewer.apply_lights();
    for _ in 0..16 {
        frame(&mut viewer, []);
    }
    let dark = viewer.picture().unwrap();
    let mean = |p: &Picture| p.rgb.iter().map(|v| f64::from(*v)).sum::<f64>() / p.rgb.len() as f64;
    assert!(
        mean(&dark) < 0.7 * mean(&before),
        "{} {}",
        mean(&dark),
        mean(&before)
    );

    // a new light, moved by its handle
    let ahead = viewer.motion.camera.axis()[0] * 80.0;
    let place = viewer.motion.camera.origin + ahead;
    let editor = viewer.editor.as_mut().unwrap();
    editor.add(place);
    viewer.apply_lights();
    viewer.panel = true;
    frame(&mut viewer, []);
    let shown = viewer.screen().unwrap().place(place).unwrap();
    let at = Pos2::new(shown.x, shown.y);
    drag(&mut viewer, at, at + egui::vec2(0.0, -20.0));
    let editor = viewer.editor.as_ref().unwrap();
    let item = &editor.items[editor.selected.unwrap()];
    let moved = item.origin().unwrap();
    assert!(moved.z > place.z + 2.0, "{place} {moved}");
    let expected = Vec2::new(shown.x, shown.y - 20.0);
    let now = viewer.screen().unwrap().place(moved).unwrap();
    assert!(now.distance(expected) < 2.0, "{now} {expected}");
    viewer.panel = false;
    for _ in 0..16 {
        frame(&mut viewer, []);
    }
    let lit = viewer.picture().unwrap();
    assert!(
        mean(&lit) > mean(&dark) + 1.0,
        "{} {}",
        mean(&lit),
        mean(&dark)
    );

    // saved beside the map; nothing is reloaded for it
    viewer.save_lights();
    let path = folder.path().join("maps/sample.lights");
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("\npoint "), "{text}");
    assert!(!viewer.editor.as_ref().unwrap().is_changed());

    // another program changes the file, then the map
    std::fs::write(&path, "without points\npoint 1 2 3 300 1 1 1\n").unwrap();
    until(&mut viewer, "lights are not reloaded", |viewer| {
        viewer.message.as_deref() == Some("lights reloaded")
    });
    let camera = viewer.motion.camera.origin;
    let map = folder.path().join(Sample::Hall.map());
    std::fs::write(&map, "no map").unwrap();
    until(&mut viewer, "a damaged map is not reported", |viewer| {
        viewer
            .message
            .as_deref()
            .is_some_and(|m| m.starts_with("not reloaded: "))
    });
    // the map before is still shown
    frame(&mut viewer, []);
    let kept = viewer.picture().unwrap();
    assert!(mean(&kept) > 1.0);
    write_sample(folder.path());
    until(&mut viewer, "the map is not reloaded", |viewer| {
        viewer.message.as_deref() == Some("reloaded: files have changed")
    });
    assert_eq!(viewer.motion.camera.origin, camera);
    let messages = viewer.end();
    assert!(messages.is_empty(), "{messages:?}");
}
