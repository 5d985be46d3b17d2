//! What a click names: the surface, its material, and the light that reaches it.

use glam::Vec3;
use relight::light::LightShare;
use relight::overbright;
use relight::probe::{Met, Probe, Source, shown_on_white};
use relight::{GameFiles, Materials, RelitWorld};
use shaderscript::Diagnostic;

use crate::material::describe;

/// Sources that are listed.
const LISTED: usize = 8;

/// A picked surface.
pub struct Picked {
    /// Where.
    pub met: Met,
    /// Name of the material.
    pub material: String,
    /// Script file and line of its definition.
    pub defined: Option<String>,
    /// The report about the material.
    pub report: String,
    /// Facts: name and value.
    pub facts: Vec<(&'static str, String)>,
    /// Light that arrives.
    pub light: Vec<Line>,
}

/// A source of light.
pub struct Line {
    /// Its name.
    pub name: String,
    /// Its material, for light of surfaces.
    pub material: Option<String>,
    /// Index of a point light.
    pub point: Option<usize>,
    /// Part of all direct light.
    pub part: f32,
    /// Part of its light that is not shadowed.
    pub visible: f32,
    /// Display colour of a white surface under this light alone.
    pub color: [u8; 3],
}

impl Picked {
    /// Describes the surface that a ray met.
    pub fn new(
        world: &RelitWorld,
        probe: &Probe,
        met: Met,
        files: &dyn GameFiles,
        (materials, diagnostics): &(Materials, Vec<Diagnostic>),
    ) -> Option<Self> {
        let surface = world.surfaces.get(met.surface as usize)?;
        let material = world.material_of(surface)?;
        let shader = &material.resolved.shader;
        let finish = materials.finish(files, &material.name, shader, &world.by_hand);
        let location = material.resolved.script.as_ref().map(|s| &s.location);
        let above = met.point + met.normal;
        let cluster = world.bsp.cluster_at(above);
        let arriving = probe.light(world, met.point, met.normal);
        let all: Vec3 = arriving.iter().map(|a| a.irradiance).sum();
        let whole = all.element_sum().max(f32::MIN_POSITIVE);
        let row = world.light_lists.row(cluster).len();
        let shares = world.light_lists.shares(cluster);
        let kept = |share: &&LightShare| share.bare > 0.0;
        let light = (arriving.iter().take(LISTED))
            .map(|a| line(world, a.source, a.irradiance, a.visible, whole))
            .collect();
        let p = met.point;
        let facts = vec![
            ("place", format!("{:.0} {:.0} {:.0}", p.x, p.y, p.z)),
            ("distance", format!("{:.0} units", met.distance)),
            ("surface", format!("{} ({:?})", met.surface, surface.kind)),
            ("model", surface.model.to_string()),
            ("cluster", cluster.to_string()),
            (
                "light list",
                match shares.iter().filter(kept).count() {
                    0 => format!("{row} lights"),
                    known => format!("{row} lights, {known} measured by the sweep"),
                },
            ),
            (
                "lightmap",
                match surface.lightmap {
                    0.. => format!("page {}", surface.lightmap),
                    _ => "none".to_owned(),
                },
            ),
            (
                "direct light",
                format!(
                    "{:.3} on white (display white: 1), {} sources",
                    overbright::luminance(shown_on_white(all)),
                    arriving.len()
                ),
            ),
        ];
        Some(Self {
            met,
            material: material.name.clone(),
            defined: location.map(|l| format!("{}:{}", l.file, l.line)),
            report: describe(files, material, &finish, diagnostics),
            facts,
            light,
        })
    }
}

fn line(world: &RelitWorld, source: Source, irradiance: Vec3, visible: f32, whole: f32) -> Line {
    let (name, material, point) = match source {
        Source::Surface(index) => {
            let surface = world.surfaces.get(index as usize);
            let material = surface.and_then(|s| world.material_of(s));
            let name = material.map_or("surface", |m| m.name.as_str()).to_owned();
            (name.clone(), Some(name), None)
        }
        Source::Point(index) => (format!("point light {index}"), None, Some(index as usize)),
        Source::Sun(index) => (format!("sun {index}"), None, None),
    };
    let shown = shown_on_white(irradiance);
    let brightest = shown.max_element().max(f32::MIN_POSITIVE);
    Line {
        name,
        material,
        point,
        part: irradiance.element_sum() / whole,
        visible,
        color: encoded(shown / brightest),
    }
}

/// Display bytes of a linear colour.
pub fn encoded(linear: Vec3) -> [u8; 3] {
    linear
        .to_array()
        .map(|v| (overbright::from_linear(v.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

/// Linear colour of display bytes.
pub fn decoded(bytes: [u8; 3]) -> Vec3 {
    Vec3::from_array(bytes.map(|v| overbright::to_linear(f32::from(v) / 255.0)))
}
