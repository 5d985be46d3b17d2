//! The picture in the window: what is dragged and clicked there, and the handles that are drawn over it.

use glam::{Vec2, Vec3};
use gui::Screen;
use gui::egui::{self, Align2, Color32, FontId, Rect, Sense, Stroke, Ui};

use super::lights::{Item, Kind};
use super::panels::swatch;
use super::state::{FOV, Handle, Shown, Viewer};

/// Distance within which the pointer grasps a handle or an edge, points.
const GRASP: f32 = 9.0;
/// Length of the axes of the selected light, points.
const AXIS: f32 = 56.0;

impl Viewer {
    /// The picture: camera, edge, handles, picking.
    pub(super) fn picture_area(&mut self, ui: &mut Ui) {
        let rect = ui.available_rect_before_wrap();
        self.view_rect = rect;
        let response = ui.interact(rect, ui.id().with("picture"), Sense::click_and_drag());
        let pointer = response.interact_pointer_pos().map(|p| Vec2::new(p.x, p.y));
        let by = response.drag_delta();
        let mut by = Vec2::new(by.x, by.y);
        if response.drag_started()
            && let Some(at) = pointer
        {
            // egui reports a drag once the pointer has moved a few points
            let pressed = ui.input(|input| input.pointer.press_origin());
            let begin = pressed.map_or(at, |p| Vec2::new(p.x, p.y));
            self.dragged = Some(self.handle_at(begin));
            by = at - begin;
        }
        if response.dragged() {
            match self.dragged {
                Some(Handle::Edge) => {
                    let place =
                        pointer.map_or(self.split, |at| (at.x - rect.left()) / rect.width());
                    self.split = place.clamp(0.0, 1.0);
                }
                Some(Handle::Axis(axis)) => self.drag_light(Some(axis), by),
                Some(Handle::Light) => self.drag_light(None, by),
                Some(Handle::Camera) | None => self.motion.turn(by),
            }
        }
        if response.drag_stopped() {
            if matches!(self.dragged, Some(Handle::Axis(_) | Handle::Light)) {
                self.apply_lights();
            }
            self.dragged = None;
        }
        if response.clicked()
            && let Some(at) = pointer
        {
            match self.light_at(at) {
                Some(index) => {
                    if let Some(editor) = &mut self.editor {
                        editor.selected = Some(index);
                    }
                }
                None => self.pick(at),
            }
        }
        if response.hovered() {
            let scrolled = ui.input(|input| input.smooth_scroll_delta.y);
            self.motion.speed = (self.motion.speed * (scrolled * 0.005).exp()).clamp(40.0, 4000.0);
        }
        self.paint(ui, rect);
    }

    /// What a drag that begins here moves.
    fn handle_at(&self, at: Vec2) -> Handle {
        let edge = self.view_rect.left() + self.split * self.view_rect.width();
        if self.shown == Shown::Split && (at.x - edge).abs() <= GRASP {
            return Handle::Edge;
        }
        for (axis, [from, tip]) in (0..).zip(self.axes()) {
            // an axis that points at the camera cannot be followed
            if tip.distance(at) <= GRASP && tip.distance(from) > 2.0 * GRASP {
                return Handle::Axis(axis);
            }
        }
        let selected = self.editor.as_ref().and_then(|editor| editor.selected);
        match self.light_at(at) {
            Some(index) if Some(index) == selected => Handle::Light,
            _ => Handle::Camera,
        }
    }

    /// The handles of the selected light's axes: from its place to their tips, points.
    fn axes(&self) -> Vec<[Vec2; 2]> {
        let ends = || {
            let editor = self.editor.as_ref()?;
            let origin = editor.items.get(editor.selected?)?.origin()?;
            let screen = self.screen()?;
            let from = screen.place(origin)?;
            let distance = origin.distance(self.motion.camera.origin);
            let across = (FOV.to_radians() * 0.5).tan() * 2.0 * distance;
            let length = AXIS / self.view_rect.width() * across;
            let tips = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| screen.place(origin + axis * length));
            Some(tips.map(|tip| [from, tip.unwrap_or(from)]).to_vec())
        };
        ends().unwrap_or_default()
    }

    /// The light whose sign is at a place of the window.
    fn light_at(&self, at: Vec2) -> Option<usize> {
        let screen = self.screen()?;
        let editor = self.editor.as_ref()?;
        let near = |item: &Item| {
            let place = screen.place(item.origin()?)?;
            Some(place.distance(at)).filter(|distance| *distance <= GRASP)
        };
        let found = editor.items.iter().enumerate();
        let found = found.filter_map(|(index, item)| Some((index, near(item)?)));
        found
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }

    fn drag_light(&mut self, axis: Option<usize>, by: Vec2) {
        let Some(screen) = self.screen() else {
            return;
        };
        let [forward, left, up] = self.motion.camera.axis();
        let camera = self.motion.camera.origin;
        let Some(editor) = &mut self.editor else {
            return;
        };
        let Some(item) = editor
            .selected
            .and_then(|index| editor.items.get_mut(index))
        else {
            return;
        };
        let Kind::Point(light) = &mut item.kind else {
            return;
        };
        light.origin += match axis {
            Some(axis) => {
                let direction = [Vec3::X, Vec3::Y, Vec3::Z][axis.min(2)];
                direction * screen.along(light.origin, direction, by)
            }
            None => {
                let depth = (light.origin - camera).dot(forward).max(1.0);
                let points = self.view_rect.width() * 0.5 / (FOV.to_radians() * 0.5).tan();
                (-left * by.x - up * by.y) * (depth / points)
            }
        };
    }

    /// Signs and handles over the picture.
    fn paint(&self, ui: &Ui, rect: Rect) {
        let painter = ui.painter_at(rect);
        if self.map.is_none() {
            painter.text(
                rect.center(),
                Align2::CENTER_CENTER,
                "Loading the map …",
                FontId::proportional(22.0),
                Color32::WHITE,
            );
            return;
        }
        if self.shown.is_traced() && !self.can_trace() {
            painter.text(
                rect.center_top() + egui::vec2(0.0, 24.0),
                Align2::CENTER_TOP,
                "Classic look until the map's lights are found",
                FontId::proportional(16.0),
                Color32::WHITE,
            );
        }
        if self.shown == Shown::Split && self.can_trace() {
            let x = rect.left() + self.split * rect.width();
            painter.vline(x, rect.y_range(), Stroke::new(2.0, Color32::WHITE));
            let middle = egui::pos2(x, rect.center().y);
            painter.circle_filled(middle, 7.0, Color32::WHITE);
            for (side, anchor, text) in [
                (-10.0, Align2::RIGHT_TOP, "classic"),
                (10.0, Align2::LEFT_TOP, "traced"),
            ] {
                let place = egui::pos2(x + side, rect.top() + 8.0);
                painter.text(
                    place,
                    anchor,
                    text,
                    FontId::proportional(15.0),
                    Color32::WHITE,
                );
            }
        }
        if let (Some(editor), Some(screen), true) = (&self.editor, self.screen(), self.panel) {
            self.paint_lights(&painter, &editor.items, editor.selected, &screen);
        }
        if let (Some(picked), Some(screen)) = (&self.picked, self.screen())
            && let Some(place) = screen.place(picked.met.point)
        {
            let place = egui::pos2(place.x, place.y);
            painter.circle_stroke(place, 5.0, Stroke::new(1.5, Color32::YELLOW));
        }
    }

    fn paint_lights(
        &self,
        painter: &egui::Painter,
        items: &[Item],
        selected: Option<usize>,
        screen: &Screen,
    ) {
        let probe = self.map.as_ref().and_then(|map| map.probe.as_ref());
        for (index, item) in items.iter().enumerate() {
            let Some(origin) = item.origin() else {
                continue;
            };
            let Some(place) = screen.place(origin) else {
                continue;
            };
            let place = egui::pos2(place.x, place.y);
            // hidden lights are faint
            let hidden = probe.is_some_and(|probe| !probe.sees(self.motion.camera.origin, origin));
            let faint = if hidden || !item.on { 0.3 } else { 1.0 };
            let color = swatch(item).gamma_multiply(faint);
            painter.circle_filled(place, 5.0, color);
            let ring = match selected == Some(index) {
                true => Stroke::new(2.5, Color32::YELLOW),
                false => Stroke::new(1.0, Color32::BLACK.gamma_multiply(faint)),
            };
            painter.circle_stroke(place, 6.0, ring);
        }
        let colors = [
            Color32::LIGHT_RED,
            Color32::LIGHT_GREEN,
            Color32::LIGHT_BLUE,
        ];
        for ([from, tip], color) in self.axes().into_iter().zip(colors) {
            let [from, tip] = [from, tip].map(|p| egui::pos2(p.x, p.y));
            painter.line_segment([from, tip], Stroke::new(2.0, color));
            painter.circle_filled(tip, 4.0, color);
        }
    }
}
