//! A picture of a map from above: lights, lengths of light lists, and agreement with stored light.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use glam::{Vec2, Vec3};
use relight::calibrate::{Residual, residuals};
use relight::light::EmissionSource;
use relight::{CalibrationOptions, RelitWorld};

use crate::pictures::{write_rgb, write_whole};

/// Longest side of the picture, pixels.
const SIDE: f32 = 1400.0;

/// Empty pixels around the map.
const MARGIN: f32 = 24.0;

/// Error of the full red or blue colour, stops.
const FULL: f32 = 1.0;

type Color = [u8; 3];

/// A shape, in pixels.
enum Shape {
    Rectangle(Vec2, Vec2, Color),
    Disc(Vec2, f32, Color),
    Ring(Vec2, f32, Color),
    Line(Vec2, Vec2, Color),
}

/// Draws a map's lights to files, SVG or PNG by extension.
///
/// # Errors
/// An extension is another one, the map has no visible leaf, or a file cannot be written.
pub fn draw(world: &RelitWorld, paths: &[PathBuf]) -> Result<()> {
    let is = |path: &Path, kind: &str| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case(kind))
    };
    for path in paths {
        if !is(path, "svg") && !is(path, "png") {
            bail!("{}: a picture is .svg or .png", path.display());
        }
    }
    let options = CalibrationOptions {
        seed: 2,
        ..CalibrationOptions::default()
    };
    let residuals = residuals(world, &options);
    let (shapes, size) = shapes(world, &residuals)?;
    for path in paths {
        if is(path, "svg") {
            let text = svg(&shapes, size, &legend(world, &residuals));
            write_whole(path, text.as_bytes())?;
        } else {
            let (width, height) = (size.x as u32, size.y as u32);
            let pixels = raster(&shapes, width as usize, height as usize);
            write_rgb(path, &pixels, width, height)?;
        }
    }
    Ok(())
}

/// The legend, with figures.
fn legend(world: &RelitWorld, residuals: &[Residual]) -> Vec<String> {
    let mut stops: Vec<f32> = residuals
        .iter()
        .filter(|r| !r.saturated)
        .map(|r| r.stops().abs())
        .collect();
    stops.sort_by(f32::total_cmp);
    let median = stops.get(stops.len() / 2).copied().unwrap_or(0.0);
    vec![
        format!(
            "{}: {} triangle lights, {} point lights, {} suns",
            world.name,
            world.lights.len(),
            world.point_lights.len(),
            world.suns.len()
        ),
        format!(
            "clusters from grey to green: length of the light list, mean {:.1}, longest {}",
            world.light_lists.mean_length(),
            world.light_lists.longest()
        ),
        format!(
            "dots: traced over stored light, red: brighter, blue: darker, full colour at {FULL} stop; median {median:.3}"
        ),
        "outlines: emitting surfaces; rings: point lights, by intensity; line in the corner: towards the sun".to_owned(),
    ]
}

fn shapes(world: &RelitWorld, residuals: &[Residual]) -> Result<(Vec<Shape>, Vec2)> {
    let bsp = &world.bsp;
    let mut leaves: Vec<_> = bsp.leafs.iter().filter(|l| l.cluster >= 0).collect();
    let flat = |v: [i32; 3]| Vec2::new(v[0] as f32, v[1] as f32);
    let mins = leaves.iter().map(|l| flat(l.mins)).reduce(Vec2::min);
    let maxs = leaves.iter().map(|l| flat(l.maxs)).reduce(Vec2::max);
    let (Some(mins), Some(maxs)) = (mins, maxs) else {
        bail!("{}: no visible leaf", world.name);
    };
    let scale = (SIDE - 2.0 * MARGIN) / (maxs - mins).max_element().max(1.0);
    let size = ((maxs - mins) * scale + 2.0 * MARGIN).ceil();
    let place = |x: f32, y: f32| {
        Vec2::new(
            MARGIN + (x - mins.x) * scale,
            size.y - MARGIN - (y - mins.y) * scale,
        )
    };
    let at = |v: Vec3| place(v.x, v.y);
    let mut shapes = vec![Shape::Rectangle(Vec2::ZERO, size, [16, 16, 20])];
    // upper leafs over lower ones
    leaves.sort_by_key(|l| l.maxs[2]);
    let longest = world.light_lists.longest().max(1) as f32;
    for leaf in leaves {
        let listed = world.light_lists.row(leaf.cluster).len() as f32 / longest;
        let (a, b) = (flat(leaf.mins), flat(leaf.maxs));
        let (low, high) = (place(a.x, b.y), place(b.x, a.y));
        let green = (48.0 + 150.0 * listed) as u8;
        shapes.push(Shape::Rectangle(low, high, [48, green, 52]));
        shapes.push(Shape::Line(low, Vec2::new(high.x, low.y), [34, 38, 40]));
        shapes.push(Shape::Line(low, Vec2::new(low.x, high.y), [34, 38, 40]));
    }
    for residual in residuals.iter().filter(|r| !r.saturated) {
        let off = (residual.stops() / FULL).clamp(-1.0, 1.0);
        let (strong, weak) = ((255.0 * off.abs()) as u8, (200.0 * (1.0 - off.abs())) as u8);
        let color = if off > 0.0 {
            [strong.max(weak), weak, weak]
        } else {
            [weak, weak, strong.max(weak)]
        };
        shapes.push(Shape::Disc(at(residual.position), 1.6, color));
    }
    for light in world.lights.iter().filter(|l| !l.is_sky) {
        let color = match light.source {
            EmissionSource::Glow | EmissionSource::Flare => [255, 150, 255],
            _ => [255, 230, 90],
        };
        let [a, b, c] = light.vertices.map(at);
        shapes.extend([(a, b), (b, c), (c, a)].map(|(a, b)| Shape::Line(a, b, color)));
    }
    for light in &world.point_lights {
        // at this distance the light adds a tenth of display white to a white wall that faces it
        let reach = (light.intensity.max_element() / (0.1 * std::f32::consts::PI)).sqrt();
        let radius = (reach * scale * 0.1).clamp(2.5, 30.0);
        shapes.push(Shape::Ring(at(light.origin), radius, [255, 255, 255]));
        shapes.push(Shape::Disc(at(light.origin), 2.0, shown(light.intensity)));
    }
    for sun in &world.suns {
        let corner = Vec2::splat(MARGIN + 50.0);
        let towards = Vec2::new(sun.direction.x, -sun.direction.y) * 50.0;
        shapes.push(Shape::Line(corner, corner + towards, [255, 200, 0]));
        shapes.push(Shape::Disc(corner + towards, 6.0, shown(sun.irradiance)));
    }
    Ok((shapes, size))
}

/// A light's hue as a display-encoded colour.
fn shown(light: Vec3) -> Color {
    let whole = light.max_element().max(f32::MIN_POSITIVE);
    (light / whole)
        .powf(1.0 / 2.2)
        .to_array()
        .map(|c| (c * 255.0) as u8)
}

fn svg(shapes: &[Shape], size: Vec2, legend: &[String]) -> String {
    let height = size.y + 20.0 * legend.len() as f32 + 10.0;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{height}\">\n",
        size.x
    );
    let hex = |[r, g, b]: Color| format!("#{r:02x}{g:02x}{b:02x}");
    // writing to a string cannot fail
    for shape in shapes {
        let _ = match *shape {
            Shape::Rectangle(a, b, color) => writeln!(
                text,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
                a.x,
                a.y,
                b.x - a.x,
                b.y - a.y,
                hex(color)
            ),
            Shape::Disc(c, r, color) => writeln!(
                text,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{r:.1}\" fill=\"{}\"/>",
                c.x,
                c.y,
                hex(color)
            ),
            Shape::Ring(c, r, color) => writeln!(
                text,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{r:.1}\" fill=\"none\" stroke=\"{}\"/>",
                c.x,
                c.y,
                hex(color)
            ),
            Shape::Line(a, b, color) => writeln!(
                text,
                "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{}\"/>",
                a.x,
                a.y,
                b.x,
                b.y,
                hex(color)
            ),
        };
    }
    for (i, line) in legend.iter().enumerate() {
        let line = line.replace('&', "&amp;").replace('<', "&lt;");
        let y = size.y + 20.0 * (i + 1) as f32;
        let _ = writeln!(
            text,
            "<text x=\"8\" y=\"{y:.0}\" font-family=\"sans-serif\" font-size=\"14\">{line}</text>"
        );
    }
    text.push_str("</svg>\n");
    text
}

/// Pixels of the shapes, RGB, rows from the top.
fn raster(shapes: &[Shape], width: usize, height: usize) -> Vec<u8> {
    let mut pixels = vec![0u8; width * height * 3];
    let mut put = |x: f32, y: f32, color: Color| {
        if x >= 0.0 && y >= 0.0 && (x as usize) < width && (y as usize) < height {
            let first = (y as usize * width + x as usize) * 3;
            if let Some(pixel) = pixels.get_mut(first..first + 3) {
                pixel.copy_from_slice(&color);
            }
        }
    };
    for shape in shapes {
        match *shape {
            Shape::Rectangle(a, b, color) => {
                for y in a.y as i32..b.y.ceil() as i32 {
                    for x in a.x as i32..b.x.ceil() as i32 {
                        put(x as f32, y as f32, color);
                    }
                }
            }
            Shape::Disc(c, r, color) | Shape::Ring(c, r, color) => {
                let least = if matches!(shape, Shape::Ring(..)) {
                    r - 1.0
                } else {
                    -1.0
                };
                for y in (c.y - r) as i32..=(c.y + r) as i32 {
                    for x in (c.x - r) as i32..=(c.x + r) as i32 {
                        let far = Vec2::new(x as f32 + 0.5, y as f32 + 0.5).distance(c);
                        if far <= r && far >= least {
                            put(x as f32, y as f32, color);
                        }
                    }
                }
            }
            Shape::Line(a, b, color) => {
                let steps = (b - a).abs().max_element().ceil().max(1.0);
                for step in 0..=steps as u32 {
                    let at = a.lerp(b, step as f32 / steps);
                    put(at.x, at.y, color);
                }
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight::{Materials, Options};

    #[test]
    fn the_sample_map_can_be_drawn_both_ways() {
        let files = relight::sample::Sample::Hall.files().unwrap();
        let (materials, _) = Materials::load(&files);
        let world = RelitWorld::load(
            &files,
            &materials,
            relight::sample::Sample::Hall.map(),
            Options {
                calibrate: None,
                ..Options::default()
            },
        )
        .unwrap();
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        draw(&world, &[at("a.svg")]).unwrap();
        draw(&world, &[at("a.png")]).unwrap();
        assert!(draw(&world, &[at("a.txt")]).is_err());
        let text = std::fs::read_to_string(at("a.svg")).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        assert!(text.contains("<rect") && text.contains("triangle lights"));
        let picture = image::open(at("a.png")).unwrap().into_rgb8();
        let lamps = picture.pixels().filter(|p| p.0 == [255, 230, 90]).count();
        assert!(lamps > 10, "{lamps}");
    }
}
