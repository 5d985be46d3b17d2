//! `rt_photo`: the scene stands still, a free camera, depth of field and exposure, pictures of any size.

pub mod panorama;
mod settings;

use std::time::{Duration, Instant};

use glam::{Mat3, Vec2};
use gui::egui::{self, Pos2};
use gui::{Gui, Motion, Screen};
use relight::probe::Probe;
use relight::viewpoints::Viewpoint;
use renderer_vk::api::{FreeCamera, Picture, RefDef, StillPicture, UiFrame};
use renderer_vk::picture_files::{open_exr, png};
use renderer_vk::{Renderer, Settings};

use crate::panel::pointer::{self, Pointer};
use crate::window::input::Input;

/// Time without motion after which frames are averaged.
const REST: Duration = Duration::from_millis(400);

/// Kind of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// For the display.
    Png,
    /// Linear light.
    Exr,
    /// All around, for the display.
    Panorama,
}

impl Kind {
    /// The kind of a word of the command.
    pub fn of(word: &str) -> Option<Self> {
        match word.to_ascii_lowercase().as_str() {
            "png" => Some(Self::Png),
            "exr" => Some(Self::Exr),
            "360" => Some(Self::Panorama),
            _ => None,
        }
    }

    /// File name extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png | Self::Panorama => "png",
            Self::Exr => "exr",
        }
    }
}

/// What the player chose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// A picture is taken.
    Take(Kind),
    /// The picture in progress is cancelled.
    Cancel,
    /// Photo mode ends.
    Close,
}

/// Steps of a picture, or of a view of a panorama.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// It is requested next.
    Wanted,
    /// The next frame has its camera, and the renderer keeps the view.
    Posed,
    /// The renderer averages frames of the kept view.
    Averaged,
}

/// A picture in progress.
#[derive(Debug)]
struct Job {
    kind: Kind,
    path: String,
    size: (u32, u32),
    samples: u32,
    step: Step,
    /// Finished views of a panorama.
    faces: Vec<Picture>,
}

/// A finished picture: path and content.
pub type Finished = (String, Vec<u8>);

/// The lens and what belongs to it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lens {
    /// Full vertical angle, degrees.
    fov: f32,
    /// Degrees, clockwise.
    roll: f32,
    /// Stops, added to `rt_exposure`.
    exposure: f32,
    blurs: bool,
    /// Diameter, units.
    aperture: f32,
    /// Distance that is sharp, units.
    focus: f32,
}

/// Photo mode.
pub struct Photo {
    gui: Gui,
    pointer: Pointer,
    motion: Motion,
    lens: Lens,
    first_lens: Lens,
    first: Viewpoint,
    /// Size over that of the window; 0: `custom`.
    scale: u32,
    custom: [u32; 2],
    samples: u32,
    panel: bool,
    job: Option<Job>,
    /// A picture requested by the command.
    asked: Option<Kind>,
    message: Option<String>,
    moved: Instant,
    last: Instant,
    probe: Option<Probe>,
}

impl Photo {
    /// Photo mode for a window of this size, from the game's view.
    pub fn new(view: &RefDef, size: (u32, u32)) -> Self {
        let [forward, ..] = view.view_axis;
        let first = Viewpoint {
            origin: view.view_origin,
            yaw: forward.y.atan2(forward.x).to_degrees(),
            pitch: (-forward.z).clamp(-1.0, 1.0).asin().to_degrees(),
        };
        let lens = Lens {
            fov: view.fov_y,
            roll: 0.0,
            exposure: 0.0,
            blurs: false,
            aperture: 4.0,
            focus: 256.0,
        };
        let now = Instant::now();
        Self {
            gui: Gui::new(),
            pointer: Pointer::new(size),
            motion: Motion::new(first),
            lens,
            first_lens: lens,
            first,
            scale: 2,
            custom: [size.0, size.1],
            samples: 256,
            panel: true,
            job: None,
            asked: None,
            message: None,
            moved: now,
            last: now,
            probe: None,
        }
    }

    /// Settings while it lasts; the console variables stay as they are.
    pub fn put(&self, settings: &mut Settings) {
        settings.rt_pause = true;
        settings.rt_exposure += self.lens.exposure;
        settings.rt_dof = self.lens.blurs;
        settings.rt_aperture = self.lens.aperture;
        settings.rt_focal_length = self.lens.focus;
        settings.rt_accumulate = self.moved.elapsed() >= REST || self.job.is_some();
        if self
            .job
            .as_ref()
            .is_some_and(|job| job.kind == Kind::Panorama)
        {
            // one exposure for all views, and no light that would end at their edges
            settings.rt_auto_exposure = false;
            settings.rt_bloom = 0.0;
            settings.rt_dof = false;
        }
    }

    /// The camera of the next frame: that of a view of a panorama that is to be kept, otherwise the free one.
    pub fn camera(&self) -> FreeCamera {
        let face = self
            .job
            .as_ref()
            .filter(|job| job.kind == Kind::Panorama && job.step == Step::Posed);
        if let Some(axis) = face.and_then(|job| panorama::FACES.get(job.faces.len())) {
            return FreeCamera {
                origin: self.motion.camera.origin,
                axis: *axis,
                fov_y: 90.0,
            };
        }
        let [forward, left, up] = self.motion.camera.axis();
        let roll = Mat3::from_axis_angle(forward, self.lens.roll.to_radians());
        FreeCamera {
            origin: self.motion.camera.origin,
            axis: [forward, roll * left, roll * up],
            fov_y: self.lens.fov,
        }
    }

    /// Cancels the picture in progress.
    pub fn cancel(&mut self, renderer: &mut Renderer) {
        if self.job.take().is_some_and(|job| job.step != Step::Wanted) {
            renderer.cancel_still();
            self.message = Some("cancelled".to_owned());
        }
    }

    /// Requests a picture, as the panel does; `samples`: those of this and later ones.
    pub fn ask(&mut self, kind: Kind, samples: Option<u32>) {
        self.samples = samples.map_or(self.samples, |samples| samples.clamp(1, 65536));
        self.asked = Some(kind);
    }

    /// Begins a picture.
    pub fn take(&mut self, kind: Kind, path: String, window: (u32, u32)) {
        let (width, height) = self.size(window);
        let size = match kind {
            Kind::Panorama => {
                let side = panorama::side(width);
                (side, side)
            }
            Kind::Png | Kind::Exr => (width, height),
        };
        self.message = None;
        self.job = Some(Job {
            kind,
            path,
            size,
            samples: self.samples,
            step: Step::Wanted,
            faces: Vec::new(),
        });
    }

    /// Size of pictures, pixels.
    fn size(&self, (width, height): (u32, u32)) -> (u32, u32) {
        match self.scale {
            0 => (self.custom[0].max(1), self.custom[1].max(1)),
            scale => (width * scale, height * scale),
        }
    }

    /// Shows a message in the panel.
    pub fn say(&mut self, message: String) {
        self.message = Some(message);
    }

    /// Requests what the picture in progress needs of the renderer, and takes what is finished.
    ///
    /// # Errors
    /// A message for the player: the picture cannot be made.
    pub fn advance(&mut self, renderer: &mut Renderer) -> Result<Option<Finished>, String> {
        let Some(job) = &mut self.job else {
            return Ok(None);
        };
        let made = Self::advance_job(job, renderer, self.motion.camera.yaw);
        if !matches!(made, Ok(None)) {
            self.job = None;
            self.moved = Instant::now();
        }
        made
    }

    fn advance_job(
        job: &mut Job,
        renderer: &mut Renderer,
        yaw: f32,
    ) -> Result<Option<Finished>, String> {
        match job.step {
            Step::Wanted => {
                let radiance = job.kind == Kind::Exr;
                renderer.request_still(job.samples, Some(job.size), radiance)?;
                job.step = Step::Posed;
                return Ok(None);
            }
            // the frame that has just ended had the camera
            Step::Posed => job.step = Step::Averaged,
            Step::Averaged => {}
        }
        let still = renderer.take_still().map_err(|e| e.to_string())?;
        let Some(StillPicture { picture, radiance }) = still else {
            return match renderer.still_progress() {
                Some(_) => Ok(None),
                None => Err(
                    "the picture was not made: the device has not enough memory for this size"
                        .into(),
                ),
            };
        };
        let bytes = match (job.kind, radiance) {
            (Kind::Exr, Some(light)) => open_exr(&light, picture.width, picture.height),
            (Kind::Panorama, _) => {
                let width = (job.size.0 as f32 * std::f32::consts::PI) as u32;
                job.faces.push(picture);
                if job.faces.len() < panorama::FACES.len() {
                    job.step = Step::Wanted;
                    return Ok(None);
                }
                let joined = panorama::join(&job.faces, width & !1, yaw);
                let joined = joined.ok_or("the views have different sizes")?;
                png(&joined.rgb, joined.width, joined.height)
            }
            (Kind::Png | Kind::Exr, _) => png(&picture.rgb, picture.width, picture.height),
        };
        let bytes = bytes.map_err(|e| e.to_string())?;
        Ok(Some((job.path.clone(), bytes)))
    }

    /// Part of the picture in progress that is done, and what it is.
    fn progress(&self, renderer: &Renderer) -> Option<(f32, String)> {
        let job = self.job.as_ref()?;
        let (done, wanted) = renderer.still_progress().unwrap_or((0, job.samples));
        let part = done as f32 / wanted.max(1) as f32;
        Some(match job.kind {
            Kind::Panorama => {
                let count = panorama::FACES.len();
                let faces = job.faces.len();
                let all = (faces as f32 + part) / count as f32;
                (all, format!("view {} of {count}", (faces + 1).min(count)))
            }
            Kind::Png | Kind::Exr => (part, format!("{done} of {wanted} samples")),
        })
    }

    /// Runs a frame: motion and panel; what to draw, and what the player chose.
    pub fn frame(
        &mut self,
        events: &[Input],
        relative: bool,
        renderer: &Renderer,
    ) -> (UiFrame, Vec<Action>) {
        let size = renderer.size();
        let input = self.pointer.input(events, relative, size);
        let now = Instant::now();
        let seconds = now.duration_since(self.last).as_secs_f32();
        self.last = now;
        let mut actions = Vec::new();
        let mut clicked = None;
        let mut turned = Vec2::ZERO;
        let progress = self.progress(renderer);
        let before = (self.motion.camera, self.lens);
        let mut gui = std::mem::take(&mut self.gui);
        let place = self.pointer.place();
        let (ui, _) = gui.run(input, |context| {
            actions.clear();
            if context.input(|i| i.key_pressed(egui::Key::Tab)) {
                self.panel = !self.panel;
            }
            if context.input(|i| i.key_pressed(egui::Key::Escape)) {
                actions.push(Action::Close);
            }
            if self.panel || progress.is_some() {
                self.show_panel(context, size, progress.as_ref(), &mut actions);
            }
            (clicked, turned) = area(context);
            if self.panel {
                pointer::draw(context, place);
            }
        });
        if self.job.is_none() {
            actions.extend(self.asked.take().map(Action::Take));
            self.motion.turn(turned);
            let moves = !gui.context().wants_keyboard_input();
            if moves {
                gui.context()
                    .input(|input| self.motion.advance(input, seconds, None));
            }
            if let Some(at) = clicked {
                self.focus_at(at, gui.context().content_rect(), renderer);
            }
        }
        self.gui = gui;
        if before != (self.motion.camera, self.lens) {
            self.moved = now;
        }
        (ui, actions)
    }

    /// Focuses on the map's surface at a place of the window, points.
    fn focus_at(&mut self, at: Pos2, screen: egui::Rect, renderer: &Renderer) {
        let Some(world) = renderer.world() else {
            return;
        };
        let (low, size) = (screen.min, screen.size());
        let [low, size] = [Vec2::new(low.x, low.y), Vec2::new(size.x, size.y)];
        let across = (self.lens.fov.to_radians() * 0.5).tan() * size.x / size.y;
        let fov = [across.atan().to_degrees() * 2.0, self.lens.fov];
        let FreeCamera { origin, axis, .. } = self.camera();
        let ray = Screen::new(origin, axis, fov, low, size).ray(Vec2::new(at.x, at.y));
        let probe = self.probe.get_or_insert_with(|| Probe::new(&world.relit));
        if let Some(met) = probe.surface(origin, ray) {
            // distance of the plane of focus
            self.lens.focus = (met.distance * ray.dot(axis[0])).clamp(1.0, 65536.0);
            self.message = Some(format!("sharp at {:.0} units", self.lens.focus));
        }
    }
}

/// The picture behind the panel: where it was clicked, and the drag that turns the camera.
fn area(context: &egui::Context) -> (Option<Pos2>, Vec2) {
    let frame = egui::CentralPanel::default().frame(egui::Frame::NONE);
    let shown = frame.show(context, |ui| {
        let rect = ui.max_rect();
        ui.interact(rect, ui.id().with("scene"), egui::Sense::click_and_drag())
    });
    let response = shown.inner;
    let at = response.interact_pointer_pos();
    let by = response.drag_delta();
    (at.filter(|_| response.clicked()), Vec2::new(by.x, by.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_view_of_a_panorama_has_the_frame_in_which_it_is_kept() {
        let size = (64, 32);
        let mut photo = Photo::new(&RefDef::default(), size);
        let free = photo.camera();
        photo.take(Kind::Panorama, "a.png".to_owned(), size);
        let job = |photo: &mut Photo, step| {
            let job = photo.job.as_mut().expect("a picture in progress");
            job.step = step;
        };
        for face in panorama::FACES {
            assert_eq!(photo.camera(), free);
            job(&mut photo, Step::Posed);
            let posed = photo.camera();
            assert_eq!((posed.axis, posed.fov_y), (face, 90.0));
            assert_eq!(posed.origin, free.origin);
            job(&mut photo, Step::Averaged);
            assert_eq!(photo.camera(), free);
            // the view is finished
            let finished = Picture {
                width: 1,
                height: 1,
                rgb: vec![0; 3],
            };
            if let Some(job) = &mut photo.job {
                job.faces.push(finished);
                job.step = Step::Wanted;
            }
        }
    }

    #[test]
    fn settings_change_only_while_it_lasts_and_a_panorama_has_one_exposure() {
        let size = (64, 32);
        let mut photo = Photo::new(&RefDef::default(), size);
        photo.lens.exposure = 1.5;
        let mut settings = Settings {
            rt_exposure: 0.5,
            ..Settings::default()
        };
        photo.put(&mut settings);
        assert!(settings.rt_pause && settings.rt_exposure == 2.0);
        assert!(settings.rt_auto_exposure && settings.rt_bloom > 0.0);
        photo.take(Kind::Panorama, "a.png".to_owned(), size);
        photo.put(&mut settings);
        assert!(!settings.rt_auto_exposure && settings.rt_bloom == 0.0 && settings.rt_accumulate);
    }
}
