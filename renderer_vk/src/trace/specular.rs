//! Specular albedo of rough surfaces: a table for `specular.glsl`.
//!
//! The albedo for a white environment is an integral over the microfacets that a view sees. With Schlick's factor
//! `F = f + (1 - f)(1 - c)^5` it is linear in the reflectance `f` at normal incidence, so that two numbers for each
//! roughness and cosine to the view suffice (Karis, Real Shading in Unreal Engine 4, 2013).

use std::f32::consts::TAU;
use std::sync::OnceLock;

use glam::{Vec2, Vec3};
use shaders::trace_types::constants::SPECULAR_TABLE;

use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// Samples of an entry. Their error is below 0.2 %.
const SAMPLES: u32 = 4096;
/// Step of their first coordinate, an irrational number that spreads them evenly (Roberts, The Unreasonable Effectiveness
/// of Quasirandom Sequences, 2018).
const STEP: f64 = 0.754_877_666_246_692_7;

/// The table on the GPU, made at first use.
#[derive(Default)]
pub struct SpecularTable(Option<Buffer>);

impl SpecularTable {
    /// Uploads the table unless that is done.
    ///
    /// # Errors
    /// Out of memory.
    pub fn make(&mut self, device: &Device) -> Result<(), Error> {
        if self.0.is_none() {
            let usage = BufferUsage::STORAGE;
            self.0 = Some(Buffer::with_data(
                device,
                "trace specular albedo",
                usage,
                table(),
            )?);
        }
        Ok(())
    }

    /// Its address; 0 before it is made.
    pub fn address(&self) -> u64 {
        self.0.as_ref().map_or(0, Buffer::address)
    }
}

/// Rows by roughness, in each the entries by the root of the cosine: even steps of both from 0 to 1.
fn table() -> &'static [Vec2] {
    static TABLE: OnceLock<Vec<Vec2>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let last = (SPECULAR_TABLE - 1) as f32;
        let entries = (0..SPECULAR_TABLE * SPECULAR_TABLE).map(|entry| {
            let (row, column) = (entry / SPECULAR_TABLE, entry % SPECULAR_TABLE);
            let [rough, root] = [row, column].map(|n| n as f32 / last);
            terms(rough * rough, root * root)
        });
        entries.collect()
    })
}

fn lambda(alpha: f32, cosine: f32) -> f32 {
    let c = cosine * cosine;
    0.5 * ((1.0 + alpha * alpha * (1.0 - c) / c.max(1e-12)).sqrt() - 1.0)
}

/// Factor of the reflectance, and constant part, of the albedo: the mean weight of directions sampled by visible normals
/// (Dupuy and Benyoub 2023).
fn terms(alpha: f32, cosine: f32) -> Vec2 {
    let cosine = cosine.max(1e-3);
    if alpha < 1e-4 {
        let away = (1.0 - cosine).powi(5);
        return Vec2::new(1.0 - away, away);
    }
    let view = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let stretched = Vec3::new(view.x * alpha, 0.0, view.z).normalize();
    let masking = lambda(alpha, cosine);
    let mut sum = Vec2::ZERO;
    for i in 0..SAMPLES {
        let u = (0.5 + f64::from(i) * STEP).fract() as f32;
        let v = (i as f32 + 0.5) / SAMPLES as f32;
        let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (u * TAU).sin_cos();
        let facet = Vec3::new(radius * cos, radius * sin, z) + stretched;
        let facet = Vec3::new(facet.x * alpha, facet.y * alpha, facet.z.max(1e-6)).normalize();
        let seen = view.dot(facet);
        let leaving = (facet * (2.0 * seen) - view).z;
        if leaving <= 0.0 {
            continue;
        }
        let shadowing = (1.0 + masking) / (1.0 + masking + lambda(alpha, leaving));
        let away = (1.0 - seen).clamp(0.0, 1.0).powi(5);
        sum += Vec2::new(1.0 - away, away) * shadowing;
    }
    sum / SAMPLES as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_surfaces_reflect_by_schlick_and_rough_ones_lose_light() {
        for cosine in [0.1f32, 0.5, 1.0] {
            let away = (1.0 - cosine).powi(5);
            let smooth = terms(1e-3, cosine);
            assert!(
                (smooth - Vec2::new(1.0 - away, away)).length() < 2e-3,
                "{smooth}"
            );
        }
        // with alpha 1, D and 4 c c' V simplify to 1 / pi and 2 c' / (c' + 1) for a normal view, c' between both
        // directions: the integral over facets is 1 - ln 2
        let whole = terms(1.0, 1.0).element_sum();
        assert!((whole - (1.0 - 2f32.ln())).abs() < 1e-3, "{whole}");
        let whole = terms(0.25, 0.7).element_sum();
        assert!((whole - 0.885).abs() < 2e-3, "{whole}");
    }
}
