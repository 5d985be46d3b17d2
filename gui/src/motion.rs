//! Motion of a free camera: flying, and walking on the map's floors.

use egui::{InputState, Key};
use glam::{Vec2, Vec3};
use relight::probe::Probe;
use relight::viewpoints::Viewpoint;

/// Height of the eyes above the floor, units.
const EYES: f32 = 50.0;
/// Half the width of a walker, units.
const BODY: f32 = 15.0;
/// Height of the highest step that is walked up, units.
const STEP: f32 = 18.0;
/// Acceleration of a fall, units/s², as in the game.
const GRAVITY: f32 = 800.0;
/// Initial speed of a jump, units/s, as in the game.
const JUMP: f32 = 270.0;
/// Walking speed, units/s, as in the game.
pub const WALK_SPEED: f32 = 320.0;
/// Degrees for a point of pointer motion.
const TURN: f32 = 0.22;
/// Longest time between two frames that motion follows, seconds.
const LONGEST: f32 = 0.1;

/// The camera and its motion.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// The camera.
    pub camera: Viewpoint,
    /// Speed of flying, units/s.
    pub speed: f32,
    /// Walks instead of flying.
    pub walks: bool,
    /// Upward speed, units/s.
    rise: f32,
}

impl Motion {
    /// A flying camera.
    pub fn new(camera: Viewpoint) -> Self {
        Self {
            camera,
            speed: WALK_SPEED,
            walks: false,
            rise: 0.0,
        }
    }

    /// Turns by a motion of the pointer, points.
    pub fn turn(&mut self, by: Vec2) {
        self.camera.yaw = (self.camera.yaw - by.x * TURN).rem_euclid(360.0);
        self.camera.pitch = (self.camera.pitch + by.y * TURN).clamp(-89.0, 89.0);
    }

    /// Moves by the keys held for `seconds`; `probe`: the map's surfaces, for walking. Returns whether it moves.
    pub fn advance(&mut self, input: &InputState, seconds: f32, probe: Option<&Probe>) -> bool {
        let seconds = seconds.min(LONGEST);
        let held = |keys: &[Key]| f32::from(u8::from(keys.iter().any(|k| input.key_down(*k))));
        let ahead = held(&[Key::W]) - held(&[Key::S]);
        let aside = held(&[Key::A]) - held(&[Key::D]);
        let up = held(&[Key::E, Key::Space]) - held(&[Key::Q, Key::C]);
        let turn = Vec2::new(
            held(&[Key::ArrowRight]) - held(&[Key::ArrowLeft]),
            held(&[Key::ArrowDown]) - held(&[Key::ArrowUp]),
        );
        self.turn(turn * (90.0 / TURN * seconds));
        let fast = if input.modifiers.shift { 3.0 } else { 1.0 };
        let before = self.camera.origin;
        let [forward, left, _] = self.camera.axis();
        match (self.walks, probe) {
            (true, Some(probe)) => {
                let ahead_flat = forward.truncate().normalize_or_zero() * ahead;
                let wish = (ahead_flat + left.truncate() * aside).normalize_or_zero();
                self.walk(wish * WALK_SPEED * fast, up > 0.0, seconds, probe);
            }
            _ => {
                let wish = (forward * ahead + left * aside + Vec3::Z * up).normalize_or_zero();
                self.camera.origin += wish * (self.speed * fast * seconds);
            }
        }
        self.camera.origin != before || turn != Vec2::ZERO
    }

    /// Walks with a horizontal velocity, along walls, up steps, and falls.
    fn walk(&mut self, velocity: Vec2, jumps: bool, seconds: f32, probe: &Probe) {
        for by in [Vec3::X * velocity.x, Vec3::Y * velocity.y] {
            let by = by * seconds;
            let length = by.length();
            if length > 0.0 && is_free(probe, self.camera.origin, by / length, length) {
                self.camera.origin += by;
            }
        }
        let origin = self.camera.origin;
        let floor = probe.distance(origin, Vec3::NEG_Z, EYES + STEP * 4.0);
        let standing = floor.is_some_and(|distance| distance <= EYES + 1.0) && self.rise <= 0.0;
        if standing {
            self.rise = if jumps { JUMP } else { 0.0 };
        } else {
            self.rise -= GRAVITY * seconds;
        }
        let drop = -self.rise * seconds;
        self.camera.origin.z -= match floor {
            // onto the floor, not through it
            Some(distance) if drop >= 0.0 => (distance - EYES).min(drop),
            _ => drop,
        };
        if let Some(distance) = floor
            && self.rise <= 0.0
            && distance < EYES
        {
            self.camera.origin.z += EYES - distance;
        }
        let ceiling = probe.distance(self.camera.origin, Vec3::Z, 8.0);
        if ceiling.is_some() && self.rise > 0.0 {
            self.rise = 0.0;
        }
    }
}

/// Whether a walker can move from `origin` along a unit vector. Steps of up to [`STEP`] are no obstacle.
fn is_free(probe: &Probe, origin: Vec3, direction: Vec3, length: f32) -> bool {
    let heights = [0.0, -EYES * 0.5, STEP - EYES + 1.0];
    heights.iter().all(|height| {
        let from = origin + Vec3::Z * *height;
        probe.distance(from, direction, length + BODY).is_none()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::RawInput;
    use relight::sample::Sample;
    use relight::{Materials, Options, RelitWorld};

    fn held(keys: &[Key]) -> InputState {
        let context = egui::Context::default();
        let events = keys.iter().map(|key| egui::Event::Key {
            key: *key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: egui::Modifiers::NONE,
        });
        let input = RawInput {
            events: events.collect(),
            ..RawInput::default()
        };
        let mut state = None;
        let _ = context.run(input, |context| state = Some(context.input(Clone::clone)));
        state.unwrap()
    }

    #[test]
    fn flying_follows_the_view_at_its_speed() {
        let mut motion = Motion::new(Viewpoint {
            yaw: 90.0,
            ..Viewpoint::default()
        });
        assert!(motion.advance(&held(&[Key::W]), 0.05, None));
        let expected = Vec3::new(0.0, WALK_SPEED * 0.05, 0.0);
        assert!(motion.camera.origin.distance(expected) < 1e-3);
        assert!(!motion.advance(&held(&[]), 0.05, None));
        motion.turn(Vec2::new(0.0, 1e6));
        assert_eq!(motion.camera.pitch, 89.0);
    }

    #[test]
    fn a_walker_stands_on_the_floor_and_stops_at_walls() {
        let files = Sample::Hall.files().unwrap();
        let (materials, _) = Materials::load(&files);
        let options = Options {
            calibrate: None,
            ..Options::default()
        };
        let world = RelitWorld::load(&files, &materials, Sample::Hall.map(), options).unwrap();
        let probe = Probe::new(&world);
        let entities = world.bsp.entities();
        let spawn = relight::viewpoints::spawn_views(&entities).next().unwrap();
        let mut motion = Motion::new(spawn);
        motion.walks = true;
        for _ in 0..60 {
            motion.advance(&held(&[]), 0.05, Some(&probe));
        }
        let height = |motion: &Motion| {
            let down = probe.distance(motion.camera.origin, Vec3::NEG_Z, 1e4);
            down.unwrap()
        };
        assert!((height(&motion) - EYES).abs() < 1.5, "{}", height(&motion));
        // a minute ahead: some wall stops it, above some floor
        for _ in 0..1200 {
            motion.advance(&held(&[Key::W]), 0.05, Some(&probe));
        }
        assert!(
            world.bsp.cluster_at(motion.camera.origin) >= 0,
            "{motion:?}"
        );
        assert!((height(&motion) - EYES).abs() < 2.0, "{}", height(&motion));
    }
}
