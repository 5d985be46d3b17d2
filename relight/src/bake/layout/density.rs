//! Distance between texels of a surface: from its present chart, or from the directives of map compilers.

use super::shape::{Shape, corners, project};
use glam::Vec2;
use q3bsp::{Bsp, Entity, Surface};

/// Areas below this are rounding noise: square units, and parts of a square texel.
const LEAST_AREA: f32 = 1e-2;

/// Part by which a distance may miss a whole number of units and still mean it: charts are stretched by up to one texel.
const WHOLE: f32 = 0.03;

/// Distance between the texels of a surface's present chart, id units along the axes of its projection; `None` without one,
/// and for a chart that is a single texel. `side`: texels per side of its page.
pub(super) fn present(bsp: &Bsp, surface: &Surface, shape: &Shape, side: u32) -> Option<f32> {
    let side = side as f32;
    let vertices = bsp.surface_vertices(surface);
    let (mut world, mut texels) = (0.0, 0.0);
    for corners in corners(bsp, surface) {
        let [Some(a), Some(b), Some(c)] = corners.map(|i| vertices.get(i)) else {
            continue;
        };
        let [a, b, c] = [a, b, c].map(|v| v.finite());
        let chart = (b.lightmap - a.lightmap).perp_dot(c.lightmap - a.lightmap) * side * side;
        let (u, v) = (b.position - a.position, c.position - a.position);
        let area = match shape {
            Shape::Projected { axis, .. } => project(u, *axis).perp_dot(project(v, *axis)),
            _ => u.cross(v).length(),
        };
        world += area.abs();
        texels += chart.abs();
    }
    let found = (world / texels).sqrt();
    (world > LEAST_AREA && texels > LEAST_AREA && found.is_finite()).then(|| {
        let whole = found.round();
        match whole >= 1.0 && (found - whole).abs() < WHOLE * found {
            true => whole,
            false => found,
        }
    })
}

/// What a model's entity sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OfModel {
    /// Distance in place of the compiler's default.
    sample: Option<f32>,
    /// Factor on it.
    scale: f32,
}

/// The keys of map compilers about texels, for each model (q3map2: `lightmapscale`, `_lightmapsamplesize` and their aliases).
pub(super) fn of_models(bsp: &Bsp, entities: &[Entity]) -> Vec<OfModel> {
    let plain = OfModel {
        sample: None,
        scale: 1.0,
    };
    let mut models = vec![plain; bsp.models.len()];
    for (number, entity) in entities.iter().enumerate() {
        let model = match number {
            0 => Some(0),
            _ => entity.brush_model(),
        };
        let Some(model) = model.and_then(|model| models.get_mut(model)) else {
            continue;
        };
        let first = |keys: [&str; 3]| {
            let mut values = keys.into_iter().filter_map(|key| entity.number(key));
            values.find(|value| *value > 0.0)
        };
        if let Some(scale) = first(["lightmapscale", "_lightmapscale", "_ls"]) {
            model.scale = scale;
        }
        model.sample = first(["_lightmapsamplesize", "_samplesize", "_ss"]);
    }
    models
}

impl OfModel {
    /// Distance between texels in units: a shader's own counts more than the entity's, and that more than the default; at
    /// least 1.
    pub fn sample(&self, of_shader: Option<f32>, default: f32) -> f32 {
        let sample = of_shader.or(self.sample).unwrap_or(default) * self.scale;
        sample.clamp(1.0, 16384.0)
    }
}

/// The median of distances; `None` of none.
pub(super) fn median(mut distances: Vec<f32>) -> Option<f32> {
    distances.sort_by(f32::total_cmp);
    distances.get(distances.len() / 2).copied()
}

/// Bounds of points; zero without points.
pub(super) fn bounds(points: impl IntoIterator<Item = Vec2>) -> (Vec2, Vec2) {
    let mut points = points.into_iter();
    let first = points.next().unwrap_or(Vec2::ZERO);
    points.fold((first, first), |(low, high), p| (low.min(p), high.max(p)))
}

#[cfg(test)]
mod tests {
    use super::super::shape::shape;
    use super::*;
    use glam::Vec3;
    use q3bsp::builder::MapBuilder;

    #[test]
    fn keys_of_entities_scale_the_default() {
        let mut map = MapBuilder::new();
        map.set_world_key("_lightmapscale", "0.5");
        map.begin_model();
        map.add_entity(&[("classname", "func_door"), ("model", "*1"), ("_ss", "8")]);
        let bsp = map.build();
        let models = of_models(&bsp, &bsp.entities());
        assert_eq!(models[0].sample(None, 16.0), 8.0);
        assert_eq!(models[0].sample(Some(4.0), 16.0), 2.0);
        assert_eq!(models[1].sample(None, 16.0), 8.0);
    }

    #[test]
    fn the_present_distance_is_found_from_coordinates() {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("w", 0, 1);
        let square = [(0., 0., 0.), (0., 64., 0.), (64., 64., 0.), (64., 0., 0.)];
        let at = map.add_quad(wall, square.map(Vec3::from));
        map.add_lightmap([0; 3]);
        for vertex in map.vertices_mut(at) {
            let position = vertex.position;
            vertex.lightmap = project(position, 2) / 16.0 / 128.0;
        }
        let bsp = map.build();
        let surface = &bsp.surfaces[at];
        assert_eq!(
            present(&bsp, surface, &shape(&bsp, surface), 128),
            Some(16.0)
        );
        let mut point = bsp.clone();
        point
            .vertices
            .iter_mut()
            .for_each(|v| v.lightmap = Vec2::ZERO);
        assert_eq!(present(&point, surface, &shape(&bsp, surface), 128), None);
    }
}
