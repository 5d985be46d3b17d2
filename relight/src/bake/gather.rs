//! What computes light at points: the CPU ([`Rays`](super::Rays)), or a GPU by the renderer.

use crate::calibrate::Surroundings;
use glam::{Vec2, Vec3};

/// A place whose light is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Position, id units, slightly above the surface.
    pub position: Vec3,
    /// Unit normal of the surface. Zero for a point of the light grid: light from each direction counts fully.
    pub normal: Vec3,
    /// Its number, from 0, among the points that are averaged with it, those of one texel: these follow one another in a
    /// list, and divide the area of each light among their shadow rays.
    pub rank: u32,
}

impl Point {
    /// A point of its own.
    pub fn new(position: Vec3, normal: Vec3) -> Point {
        Point {
            position,
            normal,
            rank: 0,
        }
    }
}

/// Light at a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Light {
    /// Irradiance over π, linear: outgoing radiance of a white surface. At points without normal the cosine is 1.
    pub value: Vec3,
    /// Sum of unit vectors towards the light, each weighted by the luminance of its part of `value`.
    pub towards: Vec3,
}

impl std::ops::AddAssign for Light {
    fn add_assign(&mut self, other: Light) {
        self.value += other.value;
        self.towards += other.towards;
    }
}

impl std::ops::Mul<f32> for Light {
    type Output = Light;

    fn mul(self, factor: f32) -> Light {
        Light {
            value: self.value * factor,
            towards: self.towards * factor,
        }
    }
}

/// Where the light of a triangle of the map is found in [`LitSurfaces::light`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum LitTriangle {
    /// Nowhere: it reflects nothing.
    #[default]
    Dark,
    /// At the texels of a page, row by row.
    Texels {
        /// Index of the page's first texel.
        first: u32,
        /// Texels per side of the page.
        side: u32,
        /// The corners' coordinates, in texels.
        corners: [Vec2; 3],
    },
    /// At its corners.
    Vertices([u32; 3]),
}

/// Light on all surfaces, and their reflectances.
#[derive(Debug, Clone, Copy)]
pub struct LitSurfaces<'a> {
    /// For each triangle of [`RelitWorld::indices`](crate::RelitWorld::indices) where its light is.
    pub triangles: &'a [LitTriangle],
    /// Part of the light that each triangle reflects.
    pub reflectances: &'a [Vec3],
    /// Light at texels and vertices, irradiance over π.
    pub light: &'a [Vec3],
}

/// Reason why light could not be computed.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct GatherError(pub String);

/// Gets the completed part of one call, 0 to 1.
pub type GatherProgress<'a> = &'a mut dyn FnMut(f32);

/// Computes light at points of one world.
///
/// A result depends on the world, the points and the number of samples alone.
pub trait Gather {
    /// What computes, for people: "2 CPU threads", or the name of a GPU.
    fn name(&self) -> String;

    /// Light of the world's triangle lights, point lights and suns at points; the ambient term is not part of it.
    /// `samples`: shadow rays to each light, over its area. 0: one ray to the light's middle, as map compilers do.
    ///
    /// # Errors
    /// [`GatherError`]: the device is lost or out of memory.
    fn direct(
        &mut self,
        points: &[Point],
        samples: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError>;

    /// Light that surfaces reflect onto points, by this many rays from each over the hemisphere (without normal: over
    /// the sphere).
    ///
    /// # Errors
    /// [`GatherError`]: the device is lost or out of memory.
    fn reflected(
        &mut self,
        points: &[Point],
        lit: LitSurfaces<'_>,
        rays: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError>;

    /// How near surfaces are around points with normals: the mean over the rays of 1 − distance over reach. A ray that
    /// meets nothing within the reach, or sky, counts 0.
    ///
    /// # Errors
    /// [`GatherError`]: the device is lost or out of memory.
    fn nearness(
        &mut self,
        points: &[Point],
        around: &Surroundings,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<f32>, GatherError>;
}
