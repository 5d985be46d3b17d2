//! Panels over the renderer's picture, drawn by egui: the settings with what they cost, presets, GPU times. The map
//! viewer of `cli` and the menu of `ffi` show them.

#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

mod costs;
mod motion;
mod screen;
mod settings;

use std::collections::HashMap;

use egui::{ColorImage, Context, FullOutput, ImageData, PlatformOutput, RawInput, TextureId};
use glam::Vec2;
use renderer_vk::api::{UiFrame, UiMesh, UiTexture, UiVertex};

pub use costs::{CostHistory, frame_time};
pub use egui;
pub use motion::Motion;
pub use screen::Screen;
pub use settings::{Change, MAIN, all_settings, main_settings, presets};

/// A user interface: egui's state and its textures.
#[derive(Default)]
pub struct Gui {
    context: Context,
    images: HashMap<TextureId, ColorImage>,
}

impl Gui {
    /// A user interface in the dark style, slightly transparent.
    pub fn new() -> Self {
        let gui = Self::default();
        gui.context.set_theme(egui::Theme::Dark);
        gui.context.style_mut(|style| {
            let visuals = &mut style.visuals;
            visuals.window_fill = visuals.window_fill.gamma_multiply(0.94);
            visuals.panel_fill = visuals.panel_fill.gamma_multiply(0.94);
        });
        gui
    }

    /// Its state.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Runs a frame of panels; returns what to draw, and what egui requests of the window.
    pub fn run(
        &mut self,
        input: RawInput,
        panels: impl FnMut(&Context),
    ) -> (UiFrame, PlatformOutput) {
        let FullOutput {
            platform_output,
            textures_delta,
            shapes,
            pixels_per_point,
            ..
        } = self.context.run(input, panels);
        let mut frame = UiFrame::default();
        for (id, delta) in textures_delta.set {
            let ImageData::Color(image) = &delta.image;
            match delta.pos {
                None => {
                    self.images.insert(id, (**image).clone());
                }
                Some(place) => {
                    if let Some(whole) = self.images.get_mut(&id) {
                        patch(whole, image, place);
                    }
                }
            }
            if let Some(image) = self.images.get(&id) {
                frame.textures.retain(|t| t.id != number(id));
                frame.textures.push(texture(id, image));
            }
        }
        for id in textures_delta.free {
            self.images.remove(&id);
            frame.dropped.push(number(id));
        }
        for clipped in self.context.tessellate(shapes, pixels_per_point) {
            let egui::epaint::Primitive::Mesh(mesh) = clipped.primitive else {
                continue; // callbacks of other renderers
            };
            let pixels = |p: egui::Pos2| Vec2::new(p.x, p.y) * pixels_per_point;
            frame.meshes.push(UiMesh {
                texture: number(mesh.texture_id),
                clip: [clipped.clip_rect.min, clipped.clip_rect.max].map(pixels),
                vertices: (mesh.vertices.iter())
                    .map(|v| UiVertex {
                        position: pixels(v.pos),
                        st: Vec2::new(v.uv.x, v.uv.y),
                        rgba: v.color.to_array(),
                    })
                    .collect(),
                indices: mesh.indices,
            });
        }
        (frame, platform_output)
    }
}

/// A number for a texture: egui's own ones are even.
fn number(id: TextureId) -> u64 {
    match id {
        TextureId::Managed(id) => id * 2,
        TextureId::User(id) => id * 2 + 1,
    }
}

fn texture(id: TextureId, image: &ColorImage) -> UiTexture {
    let [width, height] = image.size.map(|side| u32::try_from(side).unwrap_or(0));
    UiTexture {
        id: number(id),
        width,
        height,
        rgba: image.pixels.iter().flat_map(|p| p.to_array()).collect(),
    }
}

/// Replaces a rectangle of an image.
fn patch(whole: &mut ColorImage, part: &ColorImage, [x, y]: [usize; 2]) {
    let rows = part.pixels.chunks_exact(part.width().max(1));
    for (row, pixels) in rows.enumerate() {
        let start = (y + row) * whole.width() + x;
        if let Some(target) = whole.pixels.get_mut(start..start + pixels.len()) {
            target.copy_from_slice(pixels);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_its_texture_once_and_meshes_inside_the_screen() {
        let mut gui = Gui::new();
        let input = || RawInput {
            screen_rect: Some(egui::Rect::from_min_size(
                egui::Pos2::ZERO,
                egui::vec2(400.0, 300.0),
            )),
            ..RawInput::default()
        };
        let (first, _) = gui.run(input(), |context| {
            egui::Window::new("Panel").show(context, |ui| ui.label("text"));
        });
        assert_eq!(first.textures.len(), 1);
        let texture = &first.textures[0];
        let bytes = texture.width as usize * texture.height as usize * 4;
        assert_eq!(texture.rgba.len(), bytes);
        assert!(texture.rgba.iter().any(|v| *v > 0));
        let (second, _) = gui.run(input(), |context| {
            egui::Window::new("Panel").show(context, |ui| ui.label("text"));
        });
        assert!(!second.meshes.is_empty());
        for mesh in &second.meshes {
            assert_eq!(mesh.texture, texture.id);
            assert!(
                mesh.indices
                    .iter()
                    .all(|i| (*i as usize) < mesh.vertices.len())
            );
        }
    }

    #[test]
    fn a_patch_replaces_its_rectangle_only() {
        let mut whole = ColorImage::filled([4, 3], egui::Color32::BLACK);
        let part = ColorImage::filled([2, 1], egui::Color32::WHITE);
        patch(&mut whole, &part, [1, 2]);
        let white = |(i, p): (usize, &egui::Color32)| (*p == egui::Color32::WHITE).then_some(i);
        let changed: Vec<usize> = whole.pixels.iter().enumerate().filter_map(white).collect();
        assert_eq!(changed, [9, 10]);
    }
}
