//! Frames of the built-in sample map.

use std::sync::Arc;

use relight::sample::Sample;
use relight::{GameFiles, viewpoints};
use renderer_vk::api::RefDef;
use renderer_vk::{Renderer, Settings};

/// Loads the sample; the view of its first spawn point.
pub fn load_sample(
    renderer: &mut Renderer,
    settings: &Settings,
    (width, height): (u32, u32),
) -> RefDef {
    let files: Arc<dyn GameFiles> = Arc::new(Sample::Hall.files().unwrap());
    renderer.begin_registration(files, settings).unwrap();
    renderer.load_world(Sample::Hall.map()).unwrap();
    renderer.end_registration();
    let entities = renderer.world().unwrap().relit.bsp.entities();
    let view = viewpoints::spawn_views(&entities).next().unwrap();
    RefDef {
        width: width as i32,
        height: height as i32,
        fov_x: 90.0,
        fov_y: 58.7,
        view_origin: view.origin,
        view_axis: view.axis(),
        ..RefDef::default()
    }
}

/// Draws a frame.
pub fn frame(renderer: &mut Renderer, def: &RefDef) {
    renderer.begin_frame(0);
    renderer.render_scene(def).unwrap();
    renderer.end_frame().unwrap();
}
