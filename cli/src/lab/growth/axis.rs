//! What is made larger, and how large.

use renderer_vk::Settings;

use super::scene::Made;
use crate::numbers;

/// What grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    Pixels,
    Lights,
    Triangles,
    Entities,
    Curves,
    Layers,
    Mirrors,
    Trees,
}

/// Names and sizes of an axis.
struct Description {
    name: &'static str,
    unit: &'static str,
    /// Its sizes by default.
    sizes: &'static [f64],
    /// Smallest and largest size that a scene can be made of.
    limits: (f64, f64),
}

const EIGHT: &[f64] = &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];

/// Proportion of pictures, width over height.
const ASPECT: f64 = 16.0 / 9.0;

impl Axis {
    /// All, in the order of the page.
    pub const ALL: [Self; 8] = [
        Self::Pixels,
        Self::Lights,
        Self::Triangles,
        Self::Entities,
        Self::Curves,
        Self::Layers,
        Self::Mirrors,
        Self::Trees,
    ];

    fn description(self) -> Description {
        match self {
            Self::Pixels => Description {
                name: "pixels",
                unit: "pixels of the picture",
                sizes: &[0.25e6, 0.5e6, 1e6, 2e6, 4e6, 8e6],
                limits: (256.0, 1e8),
            },
            Self::Lights => Description {
                name: "lights",
                unit: "triangle lights in one hall, together of constant area",
                sizes: &[1.0, 10.0, 100.0, 1000.0, 5000.0, 20_000.0],
                limits: (1.0, 1e6),
            },
            Self::Triangles => Description {
                name: "triangles",
                unit: "triangles of the hall's floor",
                sizes: &[1e4, 3e4, 1e5, 3e5, 1e6, 3e6, 1e7],
                limits: (2.0, 2e7),
            },
            Self::Entities => Description {
                name: "entities",
                unit: "entities of a brush model with 12 triangles",
                sizes: &[0.0, 10.0, 100.0, 1000.0, 10_000.0],
                limits: (0.0, 1e5),
            },
            Self::Curves => Description {
                name: "curves",
                unit: "fineness of 24 curved columns: 1 / r_subdivisions",
                sizes: &[1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0, 4.0],
                limits: (1e-3, 100.0),
            },
            Self::Layers => Description {
                name: "layers",
                unit: "translucent layers before the whole view",
                sizes: EIGHT,
                limits: (0.0, 64.0),
            },
            Self::Mirrors => Description {
                name: "mirrors",
                unit: "mirrors that a view ray may pass between two facing ones (rt_maxDepth)",
                sizes: EIGHT,
                limits: (0.0, 16.0),
            },
            Self::Trees => Description {
                name: "trees",
                unit: "trees of 32 leaves with holes, one surface each",
                sizes: &[0.0, 12.0, 48.0, 192.0],
                limits: (0.0, 1e4),
            },
        }
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        self.description().name
    }

    /// What a size counts.
    pub fn unit(self) -> &'static str {
        self.description().unit
    }

    /// Settings, picture and scene of a size.
    pub fn case(self, size: f64, (width, height): (u32, u32), base: &Settings) -> Case {
        let mut case = Case {
            settings: base.clone(),
            picture: (width, height),
            entities: 0,
            scene: Made::default(),
        };
        let count = size.round() as usize;
        match self {
            Self::Pixels => {
                let height = (size / ASPECT).sqrt().round().max(1.0);
                case.picture = ((size / height).round() as u32, height as u32);
            }
            Self::Lights => case.scene.lights = count,
            Self::Triangles => case.scene.triangles = count,
            Self::Entities => case.entities = count,
            Self::Curves => {
                case.scene.columns = true;
                case.settings.subdivisions = (1.0 / size) as f32;
            }
            Self::Layers => case.scene.layers = count,
            Self::Trees => case.scene.trees = count,
            Self::Mirrors => {
                case.scene.mirrors = true;
                case.settings.rt_max_depth = count as u32;
            }
        }
        case
    }
}

/// What is drawn for a size.
pub struct Case {
    pub settings: Settings,
    /// Size of the picture, pixels.
    pub picture: (u32, u32),
    pub scene: Made,
    /// Entities in the view.
    pub entities: usize,
}

/// An axis with its sizes, ascending.
#[derive(Clone, Debug)]
pub struct Sizes {
    pub axis: Axis,
    pub sizes: Vec<f64>,
}

impl From<Axis> for Sizes {
    fn from(axis: Axis) -> Self {
        let sizes = axis.description().sizes.to_vec();
        Self { axis, sizes }
    }
}

/// Parses `NAME` or `NAME=SIZE,SIZE,…`.
pub fn parse_axis(text: &str) -> Result<Sizes, String> {
    let (name, sizes) = match text.split_once('=') {
        Some((name, sizes)) => (name, Some(sizes)),
        None => (text, None),
    };
    let axis = Axis::ALL.into_iter().find(|axis| axis.name() == name);
    let axis = axis.ok_or_else(|| {
        let names = Axis::ALL.map(Axis::name);
        format!("an axis is one of {}", names.join(", "))
    })?;
    let Some(sizes) = sizes else {
        return Ok(axis.into());
    };
    let (low, high) = axis.description().limits;
    let sizes: Option<Vec<f64>> =
        numbers::list(sizes).map(|list| list.into_iter().map(f64::from).collect());
    let mut sizes = sizes
        .filter(|list| !list.is_empty() && list.iter().all(|s| (low..=high).contains(s)))
        .ok_or_else(|| {
            format!("sizes of {name} are numbers from {low} to {high}, with commas between")
        })?;
    sizes.sort_by(f64::total_cmp);
    sizes.dedup();
    Ok(Sizes { axis, sizes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_names_with_sizes() {
        for axis in Axis::ALL {
            let sizes = parse_axis(axis.name()).unwrap();
            assert_eq!(sizes.axis, axis);
            assert!(sizes.sizes.len() >= 3 && sizes.sizes.is_sorted());
            let listed: Vec<_> = sizes.sizes.iter().map(ToString::to_string).collect();
            let given = format!("{}={}", axis.name(), listed.join(","));
            assert_eq!(
                parse_axis(&given).unwrap().sizes.len(),
                listed.len(),
                "within the limits"
            );
        }
        assert_eq!(parse_axis("lights=10,2,2").unwrap().sizes, [2.0, 10.0]);
        for wrong in [
            "",
            "walls",
            "lights=",
            "lights=0",
            "lights=x",
            "mirrors=17",
            "curves=0",
        ] {
            assert!(parse_axis(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_picture_has_the_pixels_of_its_size() {
        for size in Sizes::from(Axis::Pixels).sizes {
            let (width, height) = Axis::Pixels
                .case(size, (1, 1), &Settings::default())
                .picture;
            let pixels = f64::from(width) * f64::from(height);
            assert!((pixels / size - 1.0).abs() < 0.01, "{width} x {height}");
        }
    }
}
