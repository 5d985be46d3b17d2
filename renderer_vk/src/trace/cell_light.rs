//! Mean light of each cell by the map's light grid, for the light of bounces that are not traced (`rt_bounceAmbient`).

use glam::Vec3;
use q3bsp::Bsp;
use relight::overbright::{MAP_OVERBRIGHT_BITS, to_linear};

use super::light_cells::Cell;
use super::light_normal_bins::POINTS;
use super::light_weights::spread_point;

/// Mean of the positive cosine between a direction and all normals.
const MEAN_COSINE: f32 = 0.25;

/// Radiance of a white diffuse surface in each cell, mean over its orientations, and after them the mean of all cells;
/// black without a light grid.
pub fn of(bsp: Option<&Bsp>, cells: &[Cell]) -> Vec<Vec3> {
    let layout = bsp.and_then(Bsp::light_grid);
    let at = |point: Vec3| {
        let (bsp, layout) = bsp.zip(layout)?;
        let sample = layout.sample(&bsp.light_grid, point)?;
        #[allow(clippy::cast_precision_loss)] // a factor of 4
        let scale = (1u32 << MAP_OVERBRIGHT_BITS) as f32 / 255.0;
        let encoded = (sample.ambient + sample.directed * MEAN_COSINE) * scale;
        Some(Vec3::from(encoded.to_array().map(to_linear)))
    };
    let of_cell = |cell: &Cell| {
        let point = |i| cell.bounds.mins + cell.bounds.size() * spread_point(i);
        mean(&(0..POINTS).filter_map(|i| at(point(i))).collect::<Vec<_>>())
    };
    let mut light: Vec<Vec3> = cells.iter().map(of_cell).collect();
    light.push(mean(&light));
    light
}

#[allow(clippy::cast_precision_loss)] // a number of cells
fn mean(light: &[Vec3]) -> Vec3 {
    light.iter().sum::<Vec3>() / light.len().max(1) as f32
}
