//! Caustics: photons that refracting bodies pass on (`photons.rgen`, `photons.glsl`).
//!
//! Each frame traces its own photons. The kernel radius of frame i falls as `(i + 1)^((a - 1) / 2)`, so that in the mean over
//! frames both the bias and the noise of the density estimate vanish: progressive photon mapping without statistics of
//! points (Knaus and Zwicker, Progressive Photon Mapping: A Probabilistic Approach, TOG 30(3), 2011, section 4).

use shaders::trace_types::{Photon, PhotonCell, PhotonView};

use super::bodies::Bodies;
use super::frame_passes::FramePasses;
use super::passes::Pass;
use crate::gpu::{Access, Buffer, BufferDesc, BufferUsage, Device, Error, Memory};
use crate::settings::Settings;

/// Photons of a frame: a power of two.
const PHOTONS: u32 = 1 << 17;
/// Photons in the first kernel, if they were spread evenly over the area of the bodies.
const IN_KERNEL: f32 = 32.0;
/// Bounds of the radius, units.
const LEAST_RADIUS: f32 = 1.0 / 16.0;
const MOST_RADIUS: f32 = 16.0;
/// The exponent `a`: 2/3 balances bias and noise (section 4.3).
const SHRINKAGE: f32 = 2.0 / 3.0;

/// Whether lit frames with these settings trace photons, on a map with refracting bodies.
pub fn in_use(settings: &Settings) -> bool {
    settings.rt_caustics && settings.rt_accumulate
}

/// Photons of a view.
pub struct Photons {
    /// Photons, and the cells of their grid.
    buffers: Option<[Buffer; 2]>,
    /// Photons of a frame: a power of two.
    pub(super) count: u32,
}

impl Default for Photons {
    fn default() -> Self {
        Self {
            buffers: None,
            count: PHOTONS,
        }
    }
}

impl Photons {
    /// Makes the buffers if frames need them, and otherwise drops them.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(&mut self, device: &Device, needed: bool) -> Result<(), Error> {
        if !needed {
            self.buffers = None;
        } else if self.buffers.is_none() {
            let make = |name, bytes: usize| {
                let desc = BufferDesc {
                    name,
                    size: u64::from(self.count) * bytes as u64,
                    usage: BufferUsage::STORAGE,
                    memory: Memory::Device,
                };
                Buffer::new(device, &desc)
            };
            self.buffers = Some([
                make("trace photons", size_of::<Photon>())?,
                make("trace photon cells", size_of::<PhotonCell>())?,
            ]);
        }
        Ok(())
    }

    /// Parameters of a frame; `accumulated`: the number of frames before it. Without buffers there are no photons.
    pub fn view(&self, bodies: &Bodies, accumulated: u32) -> PhotonView {
        let Some([photons, cells]) = &self.buffers else {
            return PhotonView::default();
        };
        let bodies = bodies.view();
        PhotonView {
            photons: photons.address(),
            cells: cells.address(),
            count: self.count,
            cell_count: self.count,
            radius: radius(bodies.area, self.count, accumulated),
            ..bodies
        }
    }

    /// Records the passes that trace the photons and sort them.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn record(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        let Some([_, cells]) = &self.buffers else {
            return Ok(());
        };
        passes.run(Pass::Photons)?;
        let (rec, access) = (&mut *passes.rec, Access::TRANSFER);
        rec.pass("trace_photon_cells", access, access)?
            .fill_buffer(cells, 0, cells.size(), 0);
        passes.run(Pass::PhotonCells)
    }
}

/// Kernel radius of a frame, units.
#[allow(clippy::cast_precision_loss)] // of counts
fn radius(area: f32, photons: u32, accumulated: u32) -> f32 {
    let first = (IN_KERNEL * area / (std::f32::consts::PI * photons as f32)).sqrt();
    let shrunk = (accumulated as f32 + 1.0).powf(0.5 * (SHRINKAGE - 1.0));
    (first.min(MOST_RADIUS) * shrunk).max(LEAST_RADIUS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_shrinks_and_stays_within_bounds() {
        // 32 photons in a kernel of 131072 over 10,000 square units
        let first = radius(10_000.0, PHOTONS, 0);
        let inside = f64::from(PHOTONS) * std::f64::consts::PI * f64::from(first).powi(2) / 1.0e4;
        assert!((inside - 32.0).abs() < 0.01, "{inside}");
        assert!((radius(10_000.0, PHOTONS, 63) / first - 0.5).abs() < 1.0e-3);
        assert_eq!(radius(1.0e12, PHOTONS, 0), MOST_RADIUS);
        assert_eq!(radius(1.0, PHOTONS, u32::MAX), LEAST_RADIUS);
    }
}
