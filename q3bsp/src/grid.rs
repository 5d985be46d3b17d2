//! The light grid: how its points lie in space and what light they give at a place.

use crate::Bsp;
use crate::error::Lump;
use crate::lumps::GridPoint;
use glam::Vec3;

/// Grid spacing without a `gridsize` key, id units.
const DEFAULT_SIZE: Vec3 = Vec3::new(64.0, 64.0, 128.0);

/// Where the points of [`Bsp::light_grid`] are: x fastest, then y, then z.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LightGridLayout {
    /// Position of the first point, id units.
    pub origin: Vec3,
    /// Distance between points per axis.
    pub size: Vec3,
    /// Number of points per axis.
    pub counts: [usize; 3],
}

/// Light at a place, raw 0 to 255 before over-bright shift, `r_ambientScale` and `r_directedScale`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GridSample {
    /// Light from everywhere.
    pub ambient: Vec3,
    /// Light from [`Self::direction`].
    pub directed: Vec3,
    /// Unit vector towards the light; zero where no point contributes.
    pub direction: Vec3,
}

impl Bsp {
    /// The layout of the light grid, from the bounds of the world model and the world's `gridsize`.
    /// `None` when there is no grid or its length does not fit the layout; the engine then ignores it.
    pub fn light_grid(&self) -> Option<LightGridLayout> {
        let layout = self.light_grid_layout(self.light_grid.len())?;
        let rest = self.container.trailing.get(Lump::LightGrid.index());
        let whole = rest.is_none_or(Vec::is_empty);
        (layout.points() == self.light_grid.len() && whole).then_some(layout)
    }

    /// The layout that the engine expects of a light grid, whether the map has one or not. `None` if it has more than
    /// `most` points or bounds that are not finite.
    pub fn light_grid_layout(&self, most: usize) -> Option<LightGridLayout> {
        let world = self.models.first()?;
        let size = self
            .entities()
            .first()
            .and_then(|entity| entity.last("gridsize").map(str::to_owned))
            .map_or(DEFAULT_SIZE, |text| {
                crate::entities::vec3_or(&text, DEFAULT_SIZE)
            });
        let origin = size * (world.mins / size).ceil();
        let spans = (size * (world.maxs / size).floor() - origin) / size + 1.0;
        let mut counts = [0; 3];
        for (count, span) in counts.iter_mut().zip(spans.to_array()) {
            // Catches NaN too; no grid that fits a file has more points on an axis.
            if !(span >= 1.0 && span <= most as f32) {
                return None;
            }
            *count = span as usize;
        }
        let layout = LightGridLayout {
            origin,
            size,
            counts,
        };
        let total = counts
            .iter()
            .try_fold(1usize, |total, &count| total.checked_mul(count))?;
        (total <= most && origin.is_finite() && size.is_finite()).then_some(layout)
    }
}

impl LightGridLayout {
    /// Number of points.
    pub fn points(&self) -> usize {
        self.counts.iter().product()
    }

    /// Index of the point at cell coordinates, if it exists.
    pub fn index(&self, x: usize, y: usize, z: usize) -> Option<usize> {
        let [nx, ny, nz] = self.counts;
        (x < nx && y < ny && z < nz).then(|| x + nx * (y + ny * z))
    }

    /// World position of the point at cell coordinates.
    pub fn position(&self, x: usize, y: usize, z: usize) -> Vec3 {
        self.origin + self.size * Vec3::new(x as f32, y as f32, z as f32)
    }

    /// The engine's lookup: trilinear over the eight points around `p`, leaving out points inside walls
    /// (ambient all zero) and beyond the grid, and making up for their weight. Outside the grid the
    /// nearest cell is used with the fraction of the place itself, as the engine does.
    /// `None` if `p` is not finite.
    pub fn sample(&self, points: &[GridPoint], p: Vec3) -> Option<GridSample> {
        let v = (p - self.origin) / self.size;
        if !v.is_finite() {
            return None;
        }
        let floor = v.floor();
        let fraction = (v - floor).to_array();
        let mut cell = [0; 3];
        for ((cell, at), count) in cell.iter_mut().zip(floor.to_array()).zip(self.counts) {
            // A float-to-integer cast saturates.
            *cell = (at.max(0.0) as usize).min(count.saturating_sub(1));
        }
        let mut total = 0.0;
        let mut sum = GridSample {
            ambient: Vec3::ZERO,
            directed: Vec3::ZERO,
            direction: Vec3::ZERO,
        };
        for corner in 0..8usize {
            let mut weight = 1.0;
            let mut at = cell;
            for (axis, (at, fraction)) in at.iter_mut().zip(fraction).enumerate() {
                let next = corner >> axis & 1;
                *at += next;
                weight *= if next == 1 { fraction } else { 1.0 - fraction };
            }
            let Some(point) = self
                .index(at[0], at[1], at[2])
                .and_then(|at| points.get(at))
            else {
                // The corner lies beyond the grid.
                continue;
            };
            if point.ambient == [0; 3] {
                continue;
            }
            total += weight;
            sum.ambient += weight * rgb(point.ambient);
            sum.directed += weight * rgb(point.directed);
            sum.direction += weight * direction(point);
        }
        if total > 0.0 && total < 0.99 {
            sum.ambient /= total;
            sum.directed /= total;
        }
        sum.direction = sum.direction.normalize_or_zero();
        Some(sum)
    }
}

/// Towards a point's light as the engine finds it: nearly [`GridPoint::direction`], but with angles read in a table of
/// 1024 sines whose last entry is the first one again, and cosines a quarter of the table further.
fn direction(point: &GridPoint) -> Vec3 {
    let sine = |entry: u32| ((entry & 1023) as f32 * (std::f32::consts::TAU / 1023.0)).sin();
    let both = |angle: u8| {
        let entry = u32::from(angle) * 4;
        (sine(entry), sine(entry + 256))
    };
    let (sin_lat, cos_lat) = both(point.latitude);
    let (sin_long, cos_long) = both(point.longitude);
    Vec3::new(cos_lat * sin_long, sin_lat * sin_long, cos_long)
}

fn rgb(bytes: [u8; 3]) -> Vec3 {
    Vec3::from_array(bytes.map(f32::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(level: u8, longitude: u8) -> GridPoint {
        GridPoint {
            ambient: [level; 3],
            directed: [level; 3],
            longitude,
            latitude: 0,
        }
    }

    const ROW: LightGridLayout = LightGridLayout {
        origin: Vec3::new(-64.0, 0.0, 0.0),
        size: Vec3::new(64.0, 64.0, 128.0),
        counts: [3, 1, 1],
    };

    #[test]
    fn interpolates_between_points() {
        let points = [point(100, 0), point(200, 0), point(0, 0)];
        let sample = ROW.sample(&points, Vec3::new(-48.0, 0.0, 0.0)).unwrap();
        assert_eq!(sample.ambient, Vec3::splat(125.0));
        assert_eq!(sample.direction, Vec3::Z);
    }

    #[test]
    fn points_in_walls_do_not_darken() {
        let points = [point(100, 0), point(200, 64), point(0, 0)];
        let sample = ROW.sample(&points, Vec3::new(32.0, 0.0, 0.0)).unwrap();
        assert_eq!(sample.ambient, Vec3::splat(200.0));
        assert!(sample.direction.abs_diff_eq(Vec3::X, 0.01));
    }

    #[test]
    fn directions_are_those_that_opengl1_answers() {
        let points = [GridPoint {
            latitude: 100,
            ..point(100, 40)
        }; 3];
        let sample = ROW.sample(&points, Vec3::ZERO).unwrap();
        let answered = Vec3::new(-0.645_339_4, 0.526_371, 0.553_597_9);
        assert!(
            sample.direction.abs_diff_eq(answered, 1e-6),
            "{}",
            sample.direction
        );
    }

    #[test]
    fn nothing_lit_gives_nothing() {
        let sample = ROW.sample(&[point(0, 0); 3], Vec3::ZERO).unwrap();
        assert_eq!(sample.ambient, Vec3::ZERO);
        assert_eq!(sample.direction, Vec3::ZERO);
        assert_eq!(ROW.sample(&[point(0, 0); 3], Vec3::NAN), None);
    }
}
