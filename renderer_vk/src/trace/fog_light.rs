//! Mean light that a map's lights give to its fog.
//!
//! A map's author chose the colour of a fog by its look in the map, where the lights already shine. The fog's colour
//! therefore includes their light: shaders replace the part of the colour that equals the mean direct light by the
//! direct light that rays find.

use std::f32::consts::PI;

use glam::Vec3;
use relight::light::{LightRef, LightShare};
use shaders::types::Fog;

use super::light_lists::listed_light;
use super::light_tables::luminance;
use super::light_weights::spread_point;
use super::lights::MapLightSource;

/// Number of points that a volume's light is averaged over.
const PLACES: usize = 256;

/// Least distance between a light and such a point, units; it bounds the inverse-square law.
const NEAREST: f32 = 16.0;

/// Sample points of a volume below its surface.
fn places(fog: &Fog) -> impl Iterator<Item = Vec3> {
    let (mins, size) = (fog.mins, fog.maxs - fog.mins);
    let [x, y, z, distance] = fog.plane;
    let surface = (fog.has_surface != 0).then_some((Vec3::new(x, y, z), distance));
    (0..PLACES)
        .map(move |i| mins + size * spread_point(i))
        .filter(move |place| surface.is_none_or(|(normal, d)| normal.dot(*place) >= d))
}

/// Mean radiance over all directions at a point from the lights in the list of its cluster.
fn light_at(place: Vec3, cluster: i32, source: &MapLightSource<'_>) -> Vec3 {
    let shares = source.lists.shares(cluster);
    let given = |(turn, &entry): (usize, &u32)| {
        let visibility = shares.get(turn).unwrap_or(&LightShare::UNKNOWN).visible;
        let listed = listed_light(source, entry, visibility, |_| Some(0))?;
        let color = match source.lists.light(entry) {
            LightRef::Triangle(index) => source.triangles.get(index as usize)?.radiance,
            LightRef::Point(index) => source.points.get(index as usize)?.intensity,
        };
        let arrives = match source.occlusion {
            Some(occlusion) => {
                let to = listed.point_for(place, turn)?;
                f32::from(occlusion.is_free(place, to, &mut None))
            }
            None => visibility,
        };
        let light = listed.straight_on(place, NEAREST)? * arrives;
        // the mean over the sphere is a quarter of the light on a facing surface
        Some(color / luminance(color).max(f32::MIN_POSITIVE) * (0.25 * light))
    };
    let lights = source.lists.row(cluster).iter().enumerate();
    lights.filter_map(given).sum::<Vec3>() + suns_at(place, cluster, source)
}

/// The same for suns.
fn suns_at(place: Vec3, cluster: i32, source: &MapLightSource<'_>) -> Vec3 {
    let arrives = |direction: Vec3| match source.occlusion {
        Some(occlusion) => occlusion.sees_sky(place, direction),
        None => true,
    };
    (source.suns.iter())
        .filter(|sun| source.lists.sees_sky(cluster) && arrives(sun.direction))
        .map(|sun| sun.irradiance * (0.25 / PI))
        .sum()
}

/// Mean radiance at the points of a volume outside of solids.
fn own_light(fog: &Fog, source: &MapLightSource<'_>) -> Vec3 {
    let (mut sum, mut count) = (Vec3::ZERO, 0.0f32);
    for place in places(fog) {
        let cluster = source.bsp.map_or(-1, |bsp| bsp.cluster_at(place));
        if source.bsp.is_some() && cluster < 0 {
            continue;
        }
        let light = light_at(place, cluster, source);
        if light.is_finite() {
            sum += light;
            count += 1.0;
        }
    }
    sum / count.max(1.0)
}

/// The volumes, with the mean light of these lights.
pub fn lit(fogs: &[Fog], source: &MapLightSource<'_>) -> Vec<Fog> {
    let lit = |fog: &Fog| Fog {
        own_light: own_light(fog, source),
        ..*fog
    };
    fogs.iter().map(lit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight::light::{Falloff, LightLists, PointLight, SunLight};

    fn source<'a>(points: &'a [PointLight], lists: &'a LightLists) -> MapLightSource<'a> {
        MapLightSource {
            points,
            ..MapLightSource::empty(lists)
        }
    }

    fn lists(points: usize) -> LightLists {
        let count = u32::try_from(points).unwrap_or(u32::MAX);
        LightLists {
            offsets: vec![0, count],
            lights: (0..count).collect(),
            ..LightLists::default()
        }
    }

    fn point(origin: Vec3, intensity: Vec3) -> PointLight {
        PointLight {
            origin,
            intensity,
            radius: 1.0,
            spot: None,
            falloff: Falloff::InverseSquare,
            pulse: None,
        }
    }

    /// A fog volume from -50 to 50, below a height.
    fn fog_below(height: f32) -> Fog {
        Fog {
            mins: Vec3::splat(-50.0),
            maxs: Vec3::splat(50.0),
            plane: [0.0, 0.0, -1.0, -height],
            has_surface: 1,
            ..Fog::default()
        }
    }

    #[test]
    fn a_lamp_gives_fog_its_mean_radiance() {
        let color = Vec3::new(4000.0, 2000.0, 1000.0);
        let lamp = [point(Vec3::Z * 100.0, color)];
        let lists = lists(1);
        for height in [50.0, -20.0] {
            let [light] = lit(&[fog_below(height)], &source(&lamp, &lists))[..] else {
                panic!("one volume");
            };
            // midpoints of small boxes; what a lamp gives to all sides goes through a sphere
            let (mut sum, mut count) = (0.0, 0.0);
            for i in 0..64_000 {
                let at = Vec3::new((i % 40) as f32, (i / 40 % 40) as f32, (i / 1600) as f32);
                let place = (at + 0.5) * 2.5 - 50.0;
                if place.z < height {
                    sum += 1.0 / (4.0 * PI * place.distance_squared(lamp[0].origin));
                    count += 1.0;
                }
            }
            let exact = color * (sum / count);
            let error = ((light.own_light - exact) / exact).abs().max_element();
            assert!(error < 0.02, "{} {exact}", light.own_light);
        }
    }

    #[test]
    fn a_sun_gives_fog_a_quarter_of_what_faces_it() {
        let sun = [SunLight {
            direction: Vec3::Z,
            irradiance: Vec3::splat(4.0 * PI),
            angular_radius: 0.0,
            material: None,
        }];
        let lists = lists(0);
        let source = MapLightSource {
            suns: &sun,
            ..source(&[], &lists)
        };
        let light = own_light(&fog_below(50.0), &source);
        assert!((light - 1.0).abs().max_element() < 1.0e-5, "{light}");
    }
}
