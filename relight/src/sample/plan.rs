//! Measures of the sample's hall that several of its parts share, id units.

use glam::Vec2;

/// Half of the hall's length.
pub(super) const LENGTH: f32 = 450.0;
/// Half of the nave's width, to the middle of the arcades.
pub(super) const NAVE: f32 = 144.0;
/// Half of the hall's width.
pub(super) const WIDTH: f32 = 272.0;
/// Half of a bay of an arcade.
pub(super) const BAY: f32 = 112.5;
/// Half of the thickness of an arcade, and radius of its columns.
pub(super) const ARCADE: f32 = 16.0;
/// Height of the columns.
pub(super) const COLUMN: f32 = 132.0;
/// Height of the aisles' ceilings.
pub(super) const AISLE: f32 = 264.0;
/// Where the vault begins.
pub(super) const SPRING: f32 = 272.0;
/// Radius of the vault.
pub(super) const VAULT: f32 = NAVE - ARCADE;
/// Middles of the bays along x.
pub(super) const BAYS: [f32; 4] = [-337.5, -112.5, 112.5, 337.5];

/// Half of the width of the east opening, and where its arch begins.
pub(super) const EAST: (f32, f32) = (76.0, 120.0);
/// East end of the terrace.
pub(super) const TERRACE: f32 = 700.0;
/// Height of the terrace.
pub(super) const STEP: f32 = 16.0;
/// Half of the pool's size and its middle.
pub(super) const POOL: (Vec2, Vec2) = (Vec2::new(160.0, 74.0), Vec2::new(-50.0, 0.0));
/// Bottom of the pool, and the water's surface.
pub(super) const WATER: (f32, f32) = (-48.0, 5.0);
