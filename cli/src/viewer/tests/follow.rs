//! `relight watch` without a window.

use super::*;
use crate::viewer::State;
use crate::viewer::source::Followed;
use crate::watched::Files;
use std::sync::Arc;

/// A viewer that follows `room.bsp`, or `room.map`, in a folder with the files of the sample; `None` without a device.
fn watcher(folder: &Path, source: bool) -> Option<Viewer> {
    write_sample(folder);
    let bsp = folder.join("maps/room.bsp");
    let source = source.then(|| (bsp.with_extension("map"), None));
    let start = Start {
        source: Source {
            followed: Some(Followed::new(Files {
                bsp: bsp.clone(),
                source,
            })),
            ..source_of(folder, &bsp.display().to_string())
        },
        ..start_of(folder)
    };
    let mut viewer = viewer_of(start)?;
    viewer.hide_panel();
    Some(viewer)
}

fn mean(picture: &Picture) -> f64 {
    let sum: f64 = picture.rgb.iter().map(|v| f64::from(*v)).sum();
    sum / picture.rgb.len() as f64
}

fn shown(viewer: &Viewer) -> u32 {
    viewer.followed().unwrap().shown
}

fn state(viewer: &Viewer) -> State {
    viewer.followed().unwrap().state
}

#[test]
fn a_map_is_shown_once_it_is_whole_and_keeps_the_camera() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut viewer) = watcher(folder.path(), false) else {
        return;
    };
    let bsp = folder.path().join("maps/room.bsp");
    let whole = std::fs::read(folder.path().join(Sample::Hall.map())).unwrap();
    for _ in 0..3 {
        frame(&mut viewer, []);
    }
    assert_eq!(
        (state(&viewer), viewer.map.is_some()),
        (State::Waits, false)
    );
    assert!(viewer.take_title().unwrap().contains("waiting"));
    // half of it
    std::fs::write(&bsp, &whole[..whole.len() / 2]).unwrap();
    until(&mut viewer, "half a map", |v| state(v) == State::Failed);
    assert!(viewer.map.is_none());
    std::fs::write(&bsp, &whole).unwrap();
    until(&mut viewer, "no map", |v| shown(v) == 1);
    assert!(matches!(state(&viewer), State::Shown(_)));
    viewer.animates = false;
    until(&mut viewer, "not ready", Viewer::is_ready);
    let before = viewer.picture().unwrap();
    assert!(mean(&before) > 1.0);

    let classic_camera = viewer.motion.camera;
    // another camera and look, which the next version keeps
    viewer.motion.camera.yaw -= 30.0;
    let camera = viewer.motion.camera;
    press(&mut viewer, Key::Num2);
    until(&mut viewer, "not traced", Viewer::is_ready);
    let traced = viewer.picture().unwrap();
    assert!(difference(&before, &traced, 10, SIZE.0 - 10) > 2.0);
    // by a new name
    let mut bsp_of = q3bsp::Bsp::parse(&whole).unwrap();
    bsp_of.entities.extend(b"{ \"classname\" \"info_null\" }\0");
    let other = folder.path().join("maps/other");
    std::fs::write(&other, bsp_of.write()).unwrap();
    std::fs::rename(&other, &bsp).unwrap();
    until(&mut viewer, "no second map", |v| shown(v) == 2);
    assert_eq!(
        (viewer.motion.camera, viewer.shown),
        (camera, Shown::Traced)
    );
    let State::Shown(Some(seconds)) = state(&viewer) else {
        panic!("{:?}", state(&viewer))
    };
    assert!(seconds > 0.0);
    assert!(viewer.take_title().unwrap().contains("after save"));
    until(&mut viewer, "not ready", Viewer::is_ready);

    // a damaged one is reported, and the picture stays
    std::fs::write(&bsp, "IBSP").unwrap();
    until(&mut viewer, "not reported", |v| state(v) == State::Failed);
    let problem = viewer.followed().unwrap().problem.clone().unwrap();
    assert!(problem.contains("room.bsp"), "{problem}");
    frame(&mut viewer, []);
    assert!(mean(&viewer.picture().unwrap()) > 1.0);
    assert_eq!(shown(&viewer), 2);
    std::fs::write(&bsp, &whole).unwrap();
    until(&mut viewer, "no third map", |v| shown(v) == 3);
    // the images of the map before are used: the picture is the same
    let traced_camera = viewer.motion.camera;
    viewer.motion.camera = classic_camera;
    press(&mut viewer, Key::Num1);
    until(&mut viewer, "not ready", Viewer::is_ready);
    let again = viewer.picture().unwrap();
    assert_eq!(difference(&before, &again, 10, SIZE.0 - 10), 0.0);
    viewer.motion.camera = traced_camera;
    press(&mut viewer, Key::Num2);
    // the lights of the lightmaps replace those of the directives
    until(&mut viewer, "no lights", |v| v.found && v.is_ready());
    let messages = viewer.end();
    assert!(messages.is_empty(), "{messages:?}");
}

#[test]
fn lights_of_the_text_change_the_picture_without_loading() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut viewer) = watcher(folder.path(), true) else {
        return;
    };
    let place = |name: &str| folder.path().join("maps").join(name);
    let text = |light: &str| {
        let spawn = "{\n\"classname\" \"info_player_deathmatch\"\n\"origin\" \"-390 60 33\"\n}\n";
        format!("{{\n\"classname\" \"worldspawn\"\n{{\n( 0 0 0 ) base/wall\n}}\n}}\n{spawn}{light}")
    };
    std::fs::write(place("room.map"), text("")).unwrap();
    std::fs::copy(folder.path().join(Sample::Hall.map()), place("room.bsp")).unwrap();
    press(&mut viewer, Key::Num2);
    until(&mut viewer, "no map", |v| shown(v) == 1);
    viewer.animates = false;
    viewer.settings.rt_auto_exposure = false;
    let camera = viewer.motion.camera;
    until(&mut viewer, "not ready", Viewer::is_ready);
    let before = viewer.picture().unwrap();
    let points = |v: &Viewer| v.renderer.world().unwrap().relit.point_lights.clone();
    assert!(points(&viewer).is_empty());
    let files = Arc::clone(&viewer.map.as_ref().unwrap().files);

    let [forward, ..] = camera.axis();
    let o = camera.origin + forward * 60.0;
    let light = format!(
        "{{\n\"classname\" \"light\"\n\"light\" \"900\"\n\"_color\" \"1 0 0\"\n\"origin\" \"{} {} {}\"\n}}\n",
        o.x, o.y, o.z
    );
    std::fs::write(place("room.map"), text(&light)).unwrap();
    until(&mut viewer, "no light", |v| shown(v) == 2);
    assert_eq!(points(&viewer).len(), 1);
    until(&mut viewer, "not ready", Viewer::is_ready);
    let lit = viewer.picture().unwrap();
    assert!(
        mean(&lit) > mean(&before) + 1.0,
        "{} {}",
        mean(&lit),
        mean(&before)
    );
    // the light is removed again, and the picture is that of before
    std::fs::write(place("room.map"), text("")).unwrap();
    until(&mut viewer, "the light stays", |v| shown(v) == 3);
    assert!(points(&viewer).is_empty());
    assert!(Arc::ptr_eq(&files, &viewer.map.as_ref().unwrap().files));
    assert_eq!(viewer.motion.camera, camera);
    // a map that is made has the lights of its text, not those of its lightmaps
    assert!(!viewer.found && viewer.finder.is_none());
    let messages = viewer.end();
    assert!(messages.is_empty(), "{messages:?}");
}
