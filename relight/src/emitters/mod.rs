//! What emits light in a world, in physical units: emitting triangles, points, suns, their lists for each cluster, and what was
//! found by which evidence. Plain data: [`light`](mod@crate::light) finds it, [`calibrate`](mod@crate::calibrate) fits it.
//!
//! # Units
//!
//! All light is linear RGB. Radiance is in *display units*: a white diffuse surface whose outgoing
//! radiance is 1 shows as display white. A diffuse surface of albedo ρ under irradiance E has outgoing
//! radiance ρ E / π. So
//!
//! * a triangle light has a radiance L; it gives a point the irradiance L cosθ cosθ' dA / d²,
//! * a point light has a radiant intensity I; it gives I cosθ / d²,
//! * a sun has the irradiance E of a surface that faces it; it gives E cosθ,
//! * the ambient term is a radiance A that comes from everywhere; it gives π A.
//!
//! # From the map compiler's numbers
//!
//! A map compiler computes, for every lightmap texel, a value v on a scale of 0..255 in which all
//! lights add up; the engine shows albedo × v × 4 / 255 (the ×4 is [`overbright`](crate::overbright)).
//! Setting this equal to ρ E / π gives **E = π v 4 / 255**, and:
//!
//! | the compiler has | its v at distance d | so |
//! |---|---|---|
//! | `q3map_surfacelight s`, area A | 0.25 s A cosθ cosθ' / d² | L = π s / 255 |
//! | light entity of value `light` | 7500 light cosθ / d² | I = π 7500 light 4 / 255 |
//! | the same with `spawnflags` 1 (linear), N = 7500 light / 8000 | N cosθ − fade d | reach R = N / fade, I = π N R² / 8 · 4 / 255 |
//! | `q3map_sun` of intensity i | i cosθ | E = π i 4 / 255 |
//! | `q3map_skylight s` | s spread evenly over the sky's directions (suns of value s / N each) | A uniform dome of radiance s 4 / 255 / 2 |
//! | `ambient a` | a | A = a 4 / 255 |
//! | `q3map_surfacelight s` on a sprite that turns to the viewer | 7500 s cosθ / d², a point light | see below |
//!
//! The dome: N suns of irradiance π s 4 / 255 / N each, evenly over the hemisphere's 2π steradians, are
//! a radiance of (π s 4 / 255) / 2π.
//!
//! A sprite shines evenly into all directions, and keeps a quad here, which shadows and highlights need.
//! A two-sided quad of radiance L and area A has, averaged over directions, the intensity L A / 2
//! (the mean of |cosθ| over the sphere is a half). Equal intensities give L = 2 I / A.
//!
//! A glowing stage has no number from a compiler: what it adds to the picture, made linear, *is* its
//! radiance.
//!
//! The numbers are a prior. Compilers have options (`-areascale`, `-pointscale`, gamma) that leave no trace
//! in the map. [`LightColor`] selects the exponent of directives' colours.
//!
//! Source: the constants are the defaults of q3map2 (area scale 0.25, point scale 7500, sky scale 1); the
//! units are written out here.

mod color;
mod emission;
mod flicker;
mod lists;
mod pulse;
mod report;
mod shade;

pub use color::LightColor;
pub(crate) use color::raise;
pub use emission::{Emission, EmissionSource};
pub use flicker::Flicker;
pub(crate) use flicker::changes;
pub use lists::{LightLists, LightRef, LightShare};
pub use pulse::{Pulse, StyleStrength};
pub use report::{Agreement, CalibrationReport, EmitterSummary, Evidence, LightReport};
pub use shade::Shade;

use glam::Vec3;
use std::f32::consts::PI;

/// Radiance of a surface with `q3map_surfacelight 1` of white colour.
pub const SURFACE_LIGHT_RADIANCE: f32 = PI / 255.0;
/// Radiant intensity of a light entity with `light 1` of white colour.
pub const POINT_LIGHT_INTENSITY: f32 = PI * 7500.0 * 4.0 / 255.0;
/// Irradiance of a surface that faces a sun of intensity 1 and white colour.
pub const SUN_IRRADIANCE: f32 = PI * 4.0 / 255.0;
/// Radiance of the sky dome of `q3map_skylight 1`.
pub const SKY_LIGHT_RADIANCE: f32 = 4.0 / 255.0 / 2.0;
/// Radiance of the uniform surroundings of `ambient 1`.
pub const AMBIENT_RADIANCE: f32 = 4.0 / 255.0;

/// Factor that the compiler applied to light before storing it, from `q3map_lightmapBrightness`; 1 by default.
/// Bounded to 1/64..64, the range of bytes.
pub fn stored_scale(scale: Option<f32>) -> f32 {
    scale
        .filter(|s| *s > 0.0 && s.is_finite())
        .map_or(1.0, |scale| scale.clamp(1.0 / 64.0, 64.0))
}

/// A triangle with uniform radiance over its area and its side's hemisphere.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct TriangleLight {
    /// Corners, counter-clockwise seen from the emitting side; world space, brush models where the
    /// map's entities put them at start.
    pub vertices: [Vec3; 3],
    /// Emitted radiance, linear; see the [module](self) for its unit.
    pub radiance: Vec3,
    /// Whether the back emits as well.
    pub two_sided: bool,
    /// Surface that it lies on: index into [`RelitWorld::surfaces`](crate::RelitWorld::surfaces).
    pub surface: u32,
    /// Triangle of the world's index buffer that it is, counted from its start (first index / 3);
    /// `u32::MAX` for the quads of sprites and the lamps of flares, which have no triangle that stays in place.
    #[serde(serialize_with = "triangle_or_null")]
    pub triangle: u32,
    /// Brush model that it belongs to: 0 is the world, which never moves.
    pub model: u32,
    /// Whether it is a piece of the sky.
    pub is_sky: bool,
    /// Where its radiance comes from.
    pub source: EmissionSource,
}

fn triangle_or_null<S: serde::Serializer>(&triangle: &u32, to: S) -> Result<S::Ok, S::Error> {
    serde::Serialize::serialize(&(triangle != u32::MAX).then_some(triangle), to)
}

impl TriangleLight {
    /// Twice the area times the unit normal of the emitting side.
    fn cross(&self) -> Vec3 {
        let [a, b, c] = self.vertices;
        (b - a).cross(c - a)
    }

    /// Whether the compiler made a light of this triangle alone, which then has a light cutoff of its own; all
    /// quads of a sprite are one light.
    pub fn has_own_cutoff(&self) -> bool {
        self.triangle != u32::MAX
    }

    /// Area in square id units.
    pub fn area(&self) -> f32 {
        self.cross().length() * 0.5
    }

    /// Unit normal of the emitting side.
    pub fn normal(&self) -> Vec3 {
        self.cross().normalize_or_zero()
    }

    /// Emitted flux, both sides together: π × radiance × area for each side.
    pub fn power(&self) -> Vec3 {
        self.radiance * (PI * self.area() * if self.two_sided { 2.0 } else { 1.0 })
    }
}

/// Light from a point: a light entity that the compiler left in the map, or a light that calibration put in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLight {
    /// Position, id units.
    pub origin: Vec3,
    /// Radiant intensity, linear; see the [module](self) for its unit.
    pub intensity: Vec3,
    /// Radius of the sampled sphere, for soft shadows, id units. The compiler uses a point:
    /// this is a choice ([`DEFAULT_POINT_LIGHT_RADIUS`]).
    pub radius: f32,
    /// The cone that it shines into; `None` for all directions.
    pub spot: Option<Spot>,
    /// How its light falls off with distance.
    pub falloff: Falloff,
    /// How it changes in time about `intensity`, its mean; `None` for light that does not.
    pub pulse: Option<Pulse>,
}

/// How the light of a point falls off with distance.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub enum Falloff {
    /// With the square of the distance, as light does.
    #[default]
    InverseSquare,
    /// As the compiler's linear lights do, which no real light does: it gives a surface that faces it as much as an
    /// inverse-square light of the same intensity at half its reach, and no more than twice that up close.
    Linear {
        /// Where a surface that faces it gets none any more, id units.
        reach: f32,
    },
    /// The same, but surfaces that it does not light from behind get as much as if they faced it: q3map2's
    /// `spawnflags 1` without `_anglescale`.
    LinearAtAnyAngle {
        /// Where surfaces get none any more, id units.
        reach: f32,
    },
}

impl Falloff {
    /// Irradiance for an intensity of 1, on a surface at a distance (id units) with a cosine of incidence.
    ///
    /// A linear light gives N cosθ − f d, with N its light up close: with the reach R = N / f and the intensity
    /// I = N R² / 8 that is 8 I / R² (cosθ − d / R). Source: what q3map2's documentation calls `spawnflags 1` and `fade`.
    pub fn irradiance(self, distance: f32, cosine: f32) -> f32 {
        match self {
            Falloff::InverseSquare => cosine.max(0.0) / (distance * distance),
            Falloff::Linear { reach } => {
                8.0 / (reach * reach) * (cosine - distance / reach).max(0.0)
            }
            Falloff::LinearAtAnyAngle { .. } if cosine <= 0.0 => 0.0,
            Falloff::LinearAtAnyAngle { reach } => {
                8.0 / (reach * reach) * (1.0 - distance / reach).max(0.0)
            }
        }
    }

    /// Reach of linear falloff, id units.
    pub fn reach(self) -> Option<f32> {
        match self {
            Falloff::InverseSquare => None,
            Falloff::Linear { reach } | Falloff::LinearAtAnyAngle { reach } => Some(reach),
        }
    }
}

/// Radius of point lights, id units: about that of a lamp's bulb.
pub const DEFAULT_POINT_LIGHT_RADIUS: f32 = 4.0;

/// The cone of a spot light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Unit vector into the cone.
    pub direction: Vec3,
    /// Tangent of the cone's half angle: beyond it there is no light. The compiler fades the light out over
    /// the last 32 units of the cone's radius at each distance.
    pub tan_half_angle: f32,
}

impl Spot {
    /// Part of the light in a direction. `offset`: from the lit place to the light.
    pub fn part(&self, offset: Vec3) -> f32 {
        let along = -offset.dot(self.direction);
        let aside = (offset.length_squared() - along * along).max(0.0).sqrt();
        if along <= 0.0 {
            return 0.0;
        }
        // the compiler fades a cone out over the last 32 units of its radius
        ((along * self.tan_half_angle - aside) / 32.0).clamp(0.0, 1.0)
    }
}

/// Light from infinitely far, through surfaces of sky.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SunLight {
    /// Unit vector towards the sun.
    pub direction: Vec3,
    /// Irradiance of a surface that faces it, linear; see the [module](self) for its unit.
    pub irradiance: Vec3,
    /// Angular radius of the disc that makes its shadows soft, radians.
    pub angular_radius: f32,
    /// Material that defines it; `None` for a sun made by a light entity.
    pub material: Option<u32>,
}

/// Angular radius of suns whose material gives none: that of the real one, 0.2665 degrees in radians.
pub const DEFAULT_SUN_RADIUS: f32 = 0.004_651;
