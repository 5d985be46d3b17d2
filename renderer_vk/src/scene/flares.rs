//! Finds the flares of a view.
//!
//! Source: engine behaviour of `renderer_opengl1` (flares). The GPU tests occlusion, by the depth of the view that was
//! just drawn or by a ray.

use glam::{Vec2, Vec3};
use q3bsp::SurfaceKind;
use relight::world::Flare;
use shaders::types;
use support::slice;

use super::View;
use super::entity::to_world;
use crate::assets::grey;
use crate::settings::Settings;
use crate::world::WorldData;

/// Distance behind the visible surface at which a flare still shows, units.
const SLACK: f32 = 24.0;
/// Value of `r_flareCoeff` that replaces 0, as in the engine.
const DEFAULT_COEFFICIENT: i32 = 150;

/// A flare in the frustum, before the occlusion test.
#[derive(Clone, Copy, Debug)]
pub struct ViewFlare {
    /// Index of the map's surface.
    pub surface: u32,
    /// Index of the instance that places the surface.
    pub instance: u32,
    /// Its parameters; the slot is set later.
    pub flare: types::Flare,
}

/// Parameters for the flares of a view.
pub(super) struct FlareView<'a> {
    pub view: &'a View,
    pub world: &'a WorldData,
    pub settings: &'a Settings,
}

impl FlareView<'_> {
    /// The flare of a surface placed by an instance, if it is in the frustum. `instance`: index of `placed`.
    pub fn find(&self, surface: u32, instance: u32, placed: &types::Instance) -> Option<ViewFlare> {
        let stored = slice::get(&self.world.surfaces, surface as usize)?;
        if stored.kind != SurfaceKind::Flare {
            return None;
        }
        let flares = &self.world.relit.flares;
        let index = flares.binary_search_by_key(&surface, |f| f.surface).ok()?;
        let flare = self.shown(flares.get(index)?, placed)?;
        Some(ViewFlare {
            surface,
            instance,
            flare,
        })
    }

    fn shown(&self, flare: &Flare, placed: &types::Instance) -> Option<types::Flare> {
        let view = self.view;
        // flares that face away are omitted; the engine compares without the entity's transform
        let facing = if flare.normal == Vec3::ZERO {
            1.0
        } else {
            let to_camera = (view.origin - flare.origin).normalize_or_zero();
            to_camera.dot(flare.normal)
        };
        if facing < 0.0 {
            return None;
        }
        let at = to_world(placed, flare.origin);
        let clip = view.world_to_clip * at.extend(1.0);
        let inside = clip.x.abs() < clip.w && clip.y.abs() < clip.w;
        if !inside {
            return None;
        }
        let [x, y, width, height] = view.viewport;
        // the engine counts pixels from the lower left corner and rounds to the nearest
        let pixel = |ndc: f32, size: i32| ((1.0 + ndc) * 0.5 * size as f32 + 0.5).floor() as i32;
        let column = pixel(clip.x / clip.w, width);
        let row = pixel(-clip.y / clip.w, height);
        if !(0..width).contains(&column) || !(0..height).contains(&row) {
            return None;
        }
        let tested = [
            x.checked_add(column)?,
            y.checked_add(height)?.checked_sub(row)?.checked_sub(1)?,
        ];
        let [Ok(tested_x), Ok(tested_y)] = tested.map(u32::try_from) else {
            return None;
        };
        let depth = view.axis[0].dot(at - view.origin);
        let distance = depth.max(1.0);
        let size = width as f32 * (self.settings.flare_size / 640.0 + 8.0 / distance);
        let coefficient = match self.settings.flare_coefficient as i32 {
            0 => DEFAULT_COEFFICIENT,
            set => set,
        } as f32;
        let spread = distance + size * coefficient.sqrt();
        let intensity = coefficient * size * size / (spread * spread);
        let color = flare.color * facing * intensity * 255.0 * self.through_fog(flare.fog, at);
        let color = grey(color, self.settings.greyscale);
        // a negative coefficient has no square root
        if !(color.is_finite() && size.is_finite()) {
            return None;
        }
        Some(types::Flare {
            color,
            size,
            center: Vec2::new((x + column) as f32, (y + height - row) as f32),
            pixel: [tested_x, tested_y],
            depth: view.depth_at(depth - SLACK),
            slot: 0,
            fresh: 0,
            at,
            reach: at.distance(view.origin) - SLACK,
        })
    }

    /// Transmittance of fog volume `fog` (plus one; 0: no fog) from a point to the camera.
    fn through_fog(&self, fog: u32, point: Vec3) -> f32 {
        let volume = fog
            .checked_sub(1)
            .and_then(|i| self.world.fogs.get(i as usize));
        volume.map_or(1.0, |volume| 1.0 - fog_factor(volume, self.view, point))
    }
}

/// Opacity of a fog volume at a point, by the engine's table of view depth and depth below the fog's surface.
fn fog_factor(fog: &types::Fog, view: &View, point: Vec3) -> f32 {
    let mut s = (point - view.origin).dot(view.axis[0]) / (8.0 * fog.depth);
    let [nx, ny, nz, dist] = fog.plane;
    let below = |p: Vec3| Vec3::new(nx, ny, nz).dot(p) - dist;
    let t = if fog.has_surface == 0 {
        31.0 / 32.0
    } else {
        let (here, camera) = (below(point), below(view.origin));
        match (camera < 0.0, here) {
            (true, ..1.0) | (false, ..0.0) => 1.0 / 32.0,
            (true, _) => 1.0 / 32.0 + (30.0 / 32.0) * here / (here - camera),
            (false, _) => 31.0 / 32.0,
        }
    };
    if s < 0.0 || t < 1.0 / 32.0 {
        return 0.0;
    }
    if t < 31.0 / 32.0 {
        s *= (t - 1.0 / 32.0) / (30.0 / 32.0);
    }
    (s * 8.0).min(1.0).sqrt()
}
