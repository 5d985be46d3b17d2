//! Writes files of hand-written lights.

use std::fmt;

use glam::Vec3;

use super::{Kind, LightsByHand};
use crate::light::entities::value_and_fade;
use crate::light::{
    AMBIENT_RADIANCE, Falloff, POINT_LIGHT_INTENSITY, PointLight, SUN_IRRADIANCE,
    SURFACE_LIGHT_RADIANCE, SunLight,
};
use crate::world::RelitWorld;

/// The lights of a world that a file can change.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChangeableLights {
    /// Point lights.
    pub points: Vec<PointLight>,
    /// Suns.
    pub suns: Vec<SunLight>,
    /// Light from everywhere.
    pub ambient: Vec3,
    /// Name and radiance of each material whose surfaces emit light: that of its brightest surface.
    pub materials: Vec<(String, Vec3)>,
}

impl ChangeableLights {
    /// Those of a world.
    pub fn of(world: &RelitWorld) -> Self {
        let mut materials: Vec<(String, Vec3)> = Vec::new();
        for light in &world.lights {
            let surface = world.surfaces.get(light.surface as usize);
            let Some(material) = surface.and_then(|s| world.material_of(s)) else {
                continue;
            };
            match materials
                .iter_mut()
                .find(|(name, _)| *name == material.name)
            {
                Some((_, radiance)) => {
                    if light.radiance.element_sum() > radiance.element_sum() {
                        *radiance = light.radiance;
                    }
                }
                None => materials.push((material.name.clone(), light.radiance)),
            }
        }
        Self {
            points: world.point_lights.clone(),
            suns: world.suns.clone(),
            ambient: world.ambient,
            materials,
        }
    }
}

impl LightsByHand {
    /// The file that turns the lights `before` into the lights `after`. Pulses of point lights that stay as they are
    /// are kept only if no point light is changed or removed, because a file cannot describe them.
    pub fn between(before: &ChangeableLights, after: &ChangeableLights) -> Self {
        let mut file = Self::default();
        match after.points.strip_prefix(before.points.as_slice()) {
            Some(added) => file.points.extend(added),
            None => {
                file.without.push(Kind::Points);
                file.points.clone_from(&after.points);
            }
        }
        match after.suns.strip_prefix(before.suns.as_slice()) {
            Some(added) => file.suns.extend(added),
            None => {
                file.without.push(Kind::Suns);
                file.suns.clone_from(&after.suns);
            }
        }
        file.ambient = (after.ambient != before.ambient).then_some(after.ambient);
        for (name, radiance) in &after.materials {
            let same = |(other, was): &(String, Vec3)| other == name && was == radiance;
            if !before.materials.iter().any(same) {
                file.materials.push((name.clone(), *radiance));
            }
        }
        file
    }

    /// Whether the file changes nothing.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The text of a file.
impl fmt::Display for LightsByHand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |kind: &Kind| match kind {
            Kind::Points => "points",
            Kind::Suns => "suns",
            Kind::Surfaces => "surfaces",
        };
        for kind in &self.without {
            writeln!(f, "without {}", name(kind))?;
        }
        for (kind, factor) in &self.scale {
            writeln!(f, "scale {} {factor}", name(kind))?;
        }
        for (material, radiance) in &self.materials {
            let light = written(*radiance / SURFACE_LIGHT_RADIANCE);
            writeln!(f, "material {material} {light}")?;
        }
        for light in &self.points {
            write_point(f, light)?;
        }
        for sun in &self.suns {
            let d = sun.direction;
            let strength = sun.irradiance.max_element();
            let color = sun.irradiance / strength.max(f32::MIN_POSITIVE);
            writeln!(
                f,
                "sun {} {} {} {} {} {} {}",
                color.x,
                color.y,
                color.z,
                strength / SUN_IRRADIANCE,
                d.y.atan2(d.x).to_degrees(),
                d.z.clamp(-1.0, 1.0).asin().to_degrees(),
                sun.angular_radius.to_degrees()
            )?;
        }
        if let Some(ambient) = self.ambient {
            writeln!(f, "ambient {}", written(ambient / AMBIENT_RADIANCE))?;
        }
        Ok(())
    }
}

fn write_point(f: &mut fmt::Formatter<'_>, light: &PointLight) -> fmt::Result {
    let o = light.origin;
    let place = format!("{} {} {}", o.x, o.y, o.z);
    let radius = light.radius;
    let value = light.intensity / POINT_LIGHT_INTENSITY;
    match (light.spot, light.falloff) {
        (Some(spot), _) => {
            let target = o + spot.direction * 64.0;
            let angle = spot.tan_half_angle.atan().to_degrees();
            let light = written(value);
            let aim = format!("{} {} {}", target.x, target.y, target.z);
            writeln!(f, "spot {place} {light} {aim} {angle} {radius}")
        }
        (None, Falloff::InverseSquare) => {
            writeln!(f, "point {place} {} {radius}", written(value))
        }
        (None, Falloff::Linear { reach } | Falloff::LinearAtAnyAngle { reach }) => {
            let strength = light.intensity.max_element();
            let (number, fade) = value_and_fade(strength, reach);
            let light = written(light.intensity / strength * number);
            writeln!(f, "linear {place} {light} {fade} {radius}")
        }
    }
}

/// `LIGHT R G B` of a light.
fn written(light: Vec3) -> String {
    let strength = light.max_element();
    let color = match strength > 0.0 {
        true => light / strength,
        false => Vec3::ONE,
    };
    format!("{strength} {} {} {}", color.x, color.y, color.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "point 8 16 24 300 1 0.5 0 6
spot 0 0 100 200 1 1 1 0 0 0 30
sun 1 1 0.5 100 90 45
";

    #[test]
    fn a_written_file_is_read_as_the_same_lights() {
        let (file, _) = LightsByHand::parse(FILE);
        let (linear, _) = LightsByHand::parse("linear 1 2 3 300 1 0.5 0 2 7");
        let before = ChangeableLights {
            points: vec![file.points[0]],
            materials: vec![("a".into(), Vec3::ONE), ("b".into(), Vec3::X)],
            ..ChangeableLights::default()
        };
        // nothing changed; one added; one moved
        assert!(LightsByHand::between(&before, &before).is_empty());
        let mut after = before.clone();
        after.points.extend([file.points[1], linear.points[0]]);
        after.suns.extend(&file.suns);
        after.ambient = Vec3::new(0.5, 0.25, 0.0);
        after.materials[1].1 = Vec3::ZERO;
        let added = LightsByHand::between(&before, &after);
        assert!(added.without.is_empty());
        assert_eq!(added.materials, [("b".to_owned(), Vec3::ZERO)]);
        after.points[0].origin.x += 8.0;
        let moved = LightsByHand::between(&before, &after);
        assert_eq!(moved.without, [Kind::Points]);
        for file in [added, moved] {
            let (read, wrong) = LightsByHand::parse(&file.to_string());
            assert!(wrong.is_empty(), "{wrong:?}\n{file}");
            assert_eq!(read.without, file.without);
            assert_eq!(read.points.len(), file.points.len());
            let near = |a: Vec3, b: Vec3| (a - b).length() <= 1e-4 * b.length().max(1.0);
            for (a, b) in read.points.iter().zip(&file.points) {
                assert_eq!(a.origin, b.origin);
                assert!(near(a.intensity, b.intensity), "{a:?} {b:?}");
                assert_eq!(a.radius, b.radius);
                match (a.spot, b.spot) {
                    (None, None) => {}
                    (Some(a), Some(b)) => {
                        assert!(near(a.direction, b.direction));
                        assert!((a.tan_half_angle - b.tan_half_angle).abs() < 1e-4);
                    }
                    other => panic!("{other:?}"),
                }
                match (a.falloff, b.falloff) {
                    (Falloff::Linear { reach: a }, Falloff::Linear { reach: b }) => {
                        assert!((a - b).abs() < 1e-2);
                    }
                    (a, b) => assert_eq!(a, b),
                }
            }
            for (a, b) in read.suns.iter().zip(&file.suns) {
                assert!(near(a.direction, b.direction) && near(a.irradiance, b.irradiance));
                assert!((a.angular_radius - b.angular_radius).abs() < 1e-5);
            }
            assert!(near(read.ambient.unwrap(), file.ambient.unwrap()));
            assert_eq!(read.materials, file.materials);
        }
    }
}
