//! `relight material`: interpretation of a material.

use std::fmt;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Result;
use clap::{Args, ValueEnum};
use relight::export::material_json;
use relight::materials::by_hand::MaterialsByHand;
use relight::materials::finish::Finish;
use relight::{GameFiles, Options, RelitWorld, WorldMaterial};
use serde::Serialize;
use serde_json::Value;
use shaderscript::{Diagnostic, ImplicitKind};

use crate::game::Game;
use crate::scripts::load_scripts;
use crate::view::open;

/// Print the interpretation of a material
///
/// Prints where it is defined, its stages as drawn, its class for lighting, its emission, and every warning with the
/// script's line. Exit code: 0, or 1 if the default image replaces a material.
///
/// Examples: relight material textures/gothic_light/ironcrosslt2_10000; relight material sfx/beam --json;
/// relight material --map e1m1.bsp --game id1 textures/wizwood1_5
#[derive(Args, Debug)]
pub struct MaterialArgs {
    /// Names of materials, as in maps and models
    #[arg(required = true, value_name = "NAME")]
    names: Vec<String>,
    #[command(flatten)]
    game: Game,
    /// A map that uses the materials, for their flags and their lighting. Also provides the materials of formats
    /// without scripts (Quake, Quake II), and those in its pack
    #[arg(long, value_name = "MAP")]
    map: Option<String>,
    /// Lighting of the surface, which decides the stages of a bare image; ignored if --map determines it
    #[arg(long, value_enum, default_value_t = Lighting::Lightmap)]
    lighting: Lighting,
    /// Print JSON in place of text
    #[arg(long)]
    json: bool,
}

/// Lighting of a surface.
#[derive(ValueEnum, Clone, Copy, Debug)]
enum Lighting {
    /// By a lightmap.
    Lightmap,
    /// By vertex colours.
    Vertex,
    /// By the light grid, like models.
    Entity,
    /// None: fullbright.
    White,
    /// None: a picture of the overlay.
    Overlay,
}

impl From<Lighting> for ImplicitKind {
    fn from(lighting: Lighting) -> Self {
        match lighting {
            Lighting::Lightmap => ImplicitKind::Lightmapped,
            Lighting::Vertex => ImplicitKind::Vertex,
            Lighting::Entity => ImplicitKind::EntityLit,
            Lighting::White => ImplicitKind::White,
            Lighting::Overlay => ImplicitKind::TwoD,
        }
    }
}

/// Report about a material.
#[derive(Serialize)]
struct Report {
    /// The content of its script, and its stages as drawn.
    material: Value,
    /// Its properties for lighting.
    light: Light,
    warnings: Vec<Warning>,
    /// Lines of its definition; empty for a bare image.
    source: Vec<Line>,
}

/// Properties of a material for lighting.
#[derive(Serialize)]
struct Light {
    class: String,
    two_sided: bool,
    liquid: bool,
    glowing: bool,
    additive: bool,
    filter: bool,
    environment: bool,
    /// Albedo, linear.
    albedo: [f32; 3],
    emission: Option<Emits>,
}

/// Emission of a material.
#[derive(Serialize)]
struct Emits {
    source: &'static str,
    /// Radiance relative to display white; radiant intensity for sprites.
    strength: [f32; 3],
    two_sided: bool,
    /// Varies with time.
    flickers: bool,
}

#[derive(Serialize)]
struct Warning {
    place: String,
    line: u32,
    severity: String,
    message: String,
}

#[derive(Serialize)]
struct Line {
    number: u32,
    text: String,
}

/// Prints the report about each material.
pub fn run(args: &MaterialArgs) -> Result<ExitCode> {
    let (files, map): (Arc<dyn GameFiles>, _) = match &args.map {
        Some(map) => {
            let (files, name) = open(map, &args.game)?;
            (files, Some(name))
        }
        None => (Arc::new(args.game.files()?), None),
    };
    let files = &*files;
    let (materials, diagnostics) = load_scripts(files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    let world = map.map(|map| RelitWorld::load(files, &materials, &map, options));
    let mut world = world.transpose()?;
    if let Some(world) = &mut world {
        world.measure_materials(files);
    }
    let by_hand = match &world {
        Some(world) => world.by_hand.clone(),
        None => {
            let (by_hand, faults) = MaterialsByHand::load(files, "");
            faults.iter().for_each(|fault| log::warn!("{fault}"));
            by_hand
        }
    };
    let mut reports = Vec::new();
    let mut faults = 0;
    for name in &args.names {
        let used = world.as_ref().map_or(Vec::new(), |w| used_in(w, name));
        let own = used.is_empty().then(|| {
            let lighting = args.lighting.into();
            WorldMaterial::by_name(files, &materials, name, lighting)
        });
        for material in used.into_iter().chain(&own) {
            faults += usize::from(material.resolved.fault.is_some());
            let shader = &material.resolved.shader;
            let finish = materials.finish(files, &material.name, shader, &by_hand);
            reports.push(Report::new(files, material, &finish, &diagnostics));
        }
    }
    if args.json {
        println!("{}", serde_json::to_string_pretty(&reports)?);
    } else {
        reports.iter().for_each(|report| print!("{report}"));
    }
    Ok(match faults {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    })
}

/// The report about one material, as text. `finish`: what is stated about its reflection; `all`: diagnostics of all
/// scripts.
pub fn describe(
    files: &dyn GameFiles,
    material: &WorldMaterial,
    finish: &Finish,
    all: &[Diagnostic],
) -> String {
    Report::new(files, material, finish, all).to_string()
}

/// Materials of a map with a name, or whose image has it: one for each set of flags and kind of lighting.
fn used_in<'a>(world: &'a RelitWorld, name: &str) -> Vec<&'a WorldMaterial> {
    let uses = world.bsp.texture_uses.iter();
    let pictured: Vec<&str> = uses
        .filter(|t| {
            t.frames
                .first()
                .is_some_and(|f| f.eq_ignore_ascii_case(name))
        })
        .map(|t| t.material.as_str())
        .collect();
    let wanted = |m: &&WorldMaterial| {
        let same = |other: &str| m.name.eq_ignore_ascii_case(other);
        same(name) || pictured.iter().any(|other| same(other))
    };
    world.materials.iter().filter(wanted).collect()
}

impl Report {
    fn new(
        files: &dyn GameFiles,
        material: &WorldMaterial,
        finish: &Finish,
        all: &[Diagnostic],
    ) -> Report {
        let class = &material.class;
        let about = |d: &&Diagnostic| {
            let definition = material.resolved.script.as_ref();
            definition.is_some_and(|script| {
                let same = |name: &String| name.eq_ignore_ascii_case(&script.name);
                d.shader.as_ref().is_some_and(same)
            })
        };
        Report {
            material: material_json(material, finish),
            light: Light {
                class: format!("{:?}", class.class),
                two_sided: class.two_sided,
                liquid: class.liquid,
                glowing: class.glowing,
                additive: class.additive,
                filter: class.filter,
                environment: class.environment,
                albedo: material.albedo.to_array(),
                emission: material.emission.map(|e| Emits {
                    source: e.source.label(),
                    strength: e.strength.to_array(),
                    two_sided: e.two_sided,
                    flickers: material.flicker.is_some(),
                }),
            },
            warnings: all
                .iter()
                .filter(about)
                .map(|d| Warning {
                    place: d.file.clone(),
                    line: d.line,
                    severity: d.severity.to_string(),
                    message: d.message.clone(),
                })
                .collect(),
            source: source(files, material),
        }
    }
}

/// The text for people.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = |value: &Value| match value {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let empty = serde_json::Map::new();
        let material = self.material.as_object().unwrap_or(&empty);
        writeln!(f, "{}", text(&self.material["name"]))?;
        match material.get("script") {
            Some(script) => row(f, "defined in", &text(script))?,
            None => row(f, "defined by", "no script; a bare image")?,
        }
        if let Some(fault) = material.get("fault") {
            row(f, "not drawn", &format!("{}; default instead", text(fault)))?;
        }
        row(f, "kind", &self.light.words())?;
        let [r, g, b] = self.light.albedo;
        row(f, "albedo", &format!("{r:.3} {g:.3} {b:.3}"))?;
        match &self.light.emission {
            Some(e) => {
                let [r, g, b] = e.strength;
                let sides = if e.two_sided { ", both sides" } else { "" };
                let time = if e.flickers { ", changing in time" } else { "" };
                let emits = format!("{r:.3} {g:.3} {b:.3} by {}{sides}{time}", e.source);
                row(f, "emits", &emits)?;
            }
            None => row(f, "emits", "nothing")?,
        }
        for (key, value) in material {
            if !matches!(
                key.as_str(),
                "name" | "script" | "fault" | "stages" | "class"
            ) {
                row(f, key, &text(value))?;
            }
        }
        let stages = self.material["stages"]
            .as_array()
            .map_or(&[][..], Vec::as_slice);
        row(f, "stages", &stages.len().to_string())?;
        for (at, stage) in stages.iter().enumerate() {
            let fields = stage.as_object().into_iter().flatten();
            let fields: Vec<String> = fields.map(|(k, v)| format!("{k} {}", text(v))).collect();
            writeln!(f, "    {}  {}", at + 1, fields.join(", "))?;
        }
        row(f, "warnings", &self.warnings.len().to_string())?;
        for w in &self.warnings {
            writeln!(
                f,
                "    {}:{}: {}: {}",
                w.place, w.line, w.severity, w.message
            )?;
            if let Some(line) = self.source.iter().find(|line| line.number == w.line) {
                writeln!(f, "        {}", line.text.trim())?;
            }
        }
        if !self.source.is_empty() {
            row(f, "source", "")?;
        }
        for line in &self.source {
            let warned = self.warnings.iter().any(|w| w.line == line.number);
            let mark = if warned { '>' } else { ' ' };
            writeln!(f, "  {mark} {:5}  {}", line.number, line.text)?;
        }
        Ok(())
    }
}

/// A line of the report.
fn row(f: &mut fmt::Formatter<'_>, name: &str, value: &str) -> fmt::Result {
    writeln!(f, "  {name:12} {value}")
}

impl Light {
    /// Properties as words: `opaque, both sides drawn`.
    fn words(&self) -> String {
        let mut words = vec![self.class.to_lowercase()];
        for (holds, word) in [
            (self.two_sided, "both sides drawn"),
            (self.liquid, "a liquid"),
            (self.glowing, "partly independent of light"),
            (self.additive, "only adds light"),
            (self.filter, "only filters light"),
            (self.environment, "shiny"),
        ] {
            if holds {
                words.push(word.to_owned());
            }
        }
        words.join(", ")
    }
}

/// Lines of a material's definition, up to the closing brace.
fn source(files: &dyn GameFiles, material: &WorldMaterial) -> Vec<Line> {
    let Some(script) = &material.resolved.script else {
        return Vec::new();
    };
    let Ok(Some(bytes)) = files.read(&script.location.file) else {
        return Vec::new();
    };
    let text = String::from_utf8_lossy(&bytes);
    // as in the parser, CR, LF and CR LF each end a line
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    let first = script.location.line.max(1);
    let mut depth = 0i64;
    let mut lines = Vec::new();
    for (number, line) in (1u32..).zip(text.lines()).skip(first as usize - 1) {
        let code = line.split_once("//").map_or(line, |(code, _)| code);
        let count = |brace| code.matches(brace).count() as i64;
        let opened = depth > 0 || count('{') > 0;
        depth += count('{') - count('}');
        lines.push(Line {
            number,
            text: line.replace('\t', "    "),
        });
        if opened && depth <= 0 {
            break;
        }
    }
    lines
}
