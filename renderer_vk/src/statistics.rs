//! Costs of a frame: time and rays of each pass, memory by purpose; as lines and as JSON.

mod spread;

pub use spread::Spread;

use std::fmt::Write as _;

use crate::gpu::{MemoryKind, MemoryUse};
use serde::{Serialize, Serializer};

/// Cost of a pass in the newest finished frame; passes of the same name are summed.
#[derive(Clone, Debug, PartialEq)]
pub struct PassCost {
    /// Name.
    pub name: String,
    /// Milliseconds on the GPU.
    pub ms: f32,
    /// Number of its rays; `None` for a pass without a counter, or while rays are not counted.
    pub rays: Option<u64>,
}

impl PassCost {
    /// Millions of rays a second, where both are known.
    pub fn mrays_per_second(&self) -> Option<f64> {
        let rays = self.rays.filter(|_| self.ms > 0.0)?;
        #[allow(clippy::cast_precision_loss)] // a rounded count for reports
        Some(rays as f64 / (f64::from(self.ms) * 1000.0))
    }
}

/// Labels of the buffers of our own structures.
const STRUCTURES: [&str; 6] = [
    "trace grid",
    "trace nodes",
    "trace leafs",
    "trace rigid",
    "trace skin",
    "trace animated",
];

/// Purpose of GPU memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MemoryPurpose {
    /// Images as large as the picture.
    ScreenImages,
    /// Acceleration structures, and our own hierarchies.
    AccelerationStructures,
    /// Light lists and the lights in them.
    Lights,
    /// Textures.
    Textures,
    /// Other buffers of the device.
    Buffers,
    /// Memory that the CPU writes and reads: uploads, per-frame data, read-backs.
    Shared,
}

impl MemoryPurpose {
    /// All, in the order of reports.
    pub const ALL: [Self; 6] = [
        Self::ScreenImages,
        Self::AccelerationStructures,
        Self::Lights,
        Self::Textures,
        Self::Buffers,
        Self::Shared,
    ];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::ScreenImages => "screen images",
            Self::AccelerationStructures => "acceleration structures",
            Self::Lights => "lights",
            Self::Textures => "textures",
            Self::Buffers => "buffers",
            Self::Shared => "shared with the CPU",
        }
    }

    /// Purpose of an allocation, by its kind, and for plain buffers by their label.
    pub fn of(allocation: &MemoryUse) -> Self {
        let any = |parts: &[&str]| parts.iter().any(|part| allocation.label.contains(part));
        match allocation.kind {
            MemoryKind::Target => Self::ScreenImages,
            MemoryKind::Texture => Self::Textures,
            MemoryKind::AccelerationStructure => Self::AccelerationStructures,
            MemoryKind::Shared => Self::Shared,
            MemoryKind::Buffer if any(&STRUCTURES) => Self::AccelerationStructures,
            MemoryKind::Buffer if any(&["light", "trace suns"]) => Self::Lights,
            MemoryKind::Buffer => Self::Buffers,
        }
    }
}

/// Cost of the structures of a map's constant geometry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StructureCost {
    /// From triangles in memory until the structures are on the device, wall time in milliseconds.
    pub build_ms: f64,
    /// Bytes on the device.
    pub bytes: u64,
    /// Triangles in them.
    pub triangles: usize,
    /// Cells of the map's uniform grid along each axis; `None` if it has none.
    pub cells: Option<[u32; 3]>,
}

/// Cost of the structures from which a map's lights are sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightCost {
    /// Lights of the map, without suns.
    pub lights: usize,
    /// Building the lists of the cells and normal bins, with their visibility rays: wall time in milliseconds. The lists
    /// of the clusters, which the loader makes, are not in it.
    pub lists_ms: f64,
    /// Bytes of the lists on the device.
    pub lists_bytes: u64,
    /// Building the trees: wall time in milliseconds; `None`: no frame has used them.
    pub tree_ms: Option<f64>,
    /// Bytes of the trees on the device.
    pub tree_bytes: Option<u64>,
}

/// Cost of the acceleration structures of moving bodies in traced views, summed over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MovingCost {
    /// Frames.
    pub frames: u64,
    /// Work of the CPU for structures, milliseconds.
    pub cpu_ms: f64,
    /// Animated parts with a structure.
    pub parts: u64,
    /// Animated parts that were left out.
    pub left_out_parts: u64,
    /// Refits and builds of their structures.
    pub refits: u64,
    /// Animated parts whose hits were counted (`rt_hitFeedback`).
    pub counted: u64,
    /// Those that no ray hit.
    pub unmet: u64,
    /// Bodies, while hits are counted: instances of entities with triangles.
    pub bodies: u64,
    /// Those that were left out.
    pub left_out: u64,
    /// Instances of top levels.
    pub instances: u64,
    /// Those that the CPU wrote: the GPU keeps the others while hits are counted.
    pub written: u64,
}

impl MovingCost {
    /// What has come since `earlier`.
    pub fn since(self, earlier: Self) -> Self {
        Self {
            frames: self.frames - earlier.frames,
            cpu_ms: self.cpu_ms - earlier.cpu_ms,
            parts: self.parts - earlier.parts,
            left_out_parts: self.left_out_parts - earlier.left_out_parts,
            refits: self.refits - earlier.refits,
            counted: self.counted - earlier.counted,
            unmet: self.unmet - earlier.unmet,
            bodies: self.bodies - earlier.bodies,
            left_out: self.left_out - earlier.left_out,
            instances: self.instances - earlier.instances,
            written: self.written - earlier.written,
        }
    }

    /// With the counts of `feedback`, which has no others.
    pub(crate) fn with_feedback(self, feedback: Self) -> Self {
        Self {
            frames: self.frames,
            cpu_ms: self.cpu_ms,
            parts: self.parts,
            left_out_parts: self.left_out_parts,
            refits: self.refits,
            instances: self.instances,
            written: self.written,
            ..feedback
        }
    }

    fn line(&self) -> String {
        let parts = self.parts + self.left_out_parts;
        #[allow(clippy::cast_precision_loss)] // rounded shares for reports
        let percent = |part: u64, of: u64| part as f64 / of.max(1) as f64 * 100.0;
        format!(
            "{parts} animated parts in {} frames: {:.1} % met by no ray, {:.1} % refitted, {:.1} % left out; {:.1} % of {} bodies left out; {:.1} % of {} instances written by the CPU",
            self.frames,
            percent(self.unmet, self.counted),
            percent(self.refits, parts),
            percent(self.left_out_parts, parts),
            percent(self.left_out, self.bodies),
            self.bodies,
            percent(self.written, self.instances),
            self.instances
        )
    }
}

/// How names of passes of a traced view begin.
const TRACED: &str = "trace_";

/// Costs of the newest finished frame, and memory in use.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Costs {
    /// Name of the device.
    pub device: String,
    /// Name of the tracer, if the traced look is in use.
    pub tracer: Option<String>,
    /// Pixels of the picture.
    pub size: (u32, u32),
    /// Costs of passes, in the order of recording.
    pub passes: Vec<PassCost>,
    /// Bytes in use by purpose.
    pub memory: Vec<(MemoryPurpose, u64)>,
    /// Bytes allocated from the driver.
    pub reserved: u64,
    /// From input to picture, in a window.
    pub latency: Option<Latency>,
    /// Acceleration structures of moving bodies, if hits are counted.
    pub moving: Option<MovingCost>,
}

/// Times from input to picture of the newest frames, milliseconds. The engine reads input after a frame's end and
/// before the next frame's first call: the true times lie between both. The end of a frame that was not waited for is
/// only observed at the next poll, several times a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Latency {
    /// `shown`, on the display (`VK_KHR_present_wait`), or `drawn`, by the GPU.
    pub to: &'static str,
    /// Number of frames.
    pub frames: usize,
    /// From the end of the frame before.
    pub from_end: Spread,
    /// From the frame's first call.
    pub from_begin: Spread,
}

impl Latency {
    fn line(&self) -> String {
        let of = |spread: &Spread| format!("{:.1} ms, p99 {:.1}", spread.median, spread.p99);
        format!(
            "from input until {}, {} frames: median {} from the end of the frame before, {} from the first call",
            self.to,
            self.frames,
            of(&self.from_end),
            of(&self.from_begin)
        )
    }
}

impl Costs {
    /// Sums passes by name; `rays` knows the number of a pass's rays.
    pub fn passes(timings: &[(String, f32)], rays: impl Fn(&str) -> Option<u64>) -> Vec<PassCost> {
        let mut passes: Vec<PassCost> = Vec::new();
        for (name, ms) in timings {
            match passes.iter_mut().find(|pass| pass.name == *name) {
                Some(pass) => pass.ms += ms,
                None => passes.push(PassCost {
                    name: name.clone(),
                    ms: *ms,
                    rays: rays(name),
                }),
            }
        }
        passes
    }

    /// Sums allocations by purpose.
    pub(crate) fn memory(allocations: &[MemoryUse]) -> Vec<(MemoryPurpose, u64)> {
        let bytes_of = |purpose| {
            let held = allocations
                .iter()
                .filter(|a| MemoryPurpose::of(a) == purpose);
            held.map(|a| a.bytes).sum()
        };
        MemoryPurpose::ALL.map(|p| (p, bytes_of(p))).to_vec()
    }

    /// All passes together; `rays` is `None` while they are not counted.
    pub fn total(&self) -> PassCost {
        let counted = self.passes.iter().filter_map(|pass| pass.rays);
        PassCost {
            name: "all passes".into(),
            ms: self.passes.iter().map(|pass| pass.ms).sum(),
            rays: counted.clone().next().map(|_| counted.sum()),
        }
    }

    /// Lines for people: one for each pass, one for all, one for each purpose of memory.
    pub fn lines(&self) -> Vec<String> {
        let (width, height) = self.size;
        let tracer = self.tracer.as_deref().unwrap_or("no tracer");
        let mut lines = vec![format!("{}, {width} x {height}, {tracer}", self.device)];
        if self.passes.is_empty() {
            lines.push("no frame was timed yet: ask again after some frames".into());
        }
        for pass in self.passes.iter().chain([&self.total()]) {
            let rays = match (pass.rays, pass.mrays_per_second()) {
                (Some(rays), Some(rate)) => format!("{rays:12} rays {rate:9.1} Mrays/s"),
                (Some(rays), None) => format!("{rays:12} rays {:17}", ""),
                _ => " ".repeat(35),
            };
            lines.push(format!("{:9.3} ms {rays}  {}", pass.ms, pass.name));
        }
        for (purpose, bytes) in &self.memory {
            lines.push(format!("{:9.1} MB  {}", megabytes(*bytes), purpose.name()));
        }
        lines.push(format!(
            "{:9.1} MB  taken from the driver",
            megabytes(self.reserved)
        ));
        lines.extend(self.latency.iter().map(Latency::line));
        lines.extend(self.moving.iter().map(MovingCost::line));
        lines
    }

    /// GPU milliseconds of the frame, if it showed a traced view.
    pub fn traced_ms(&self) -> Option<f32> {
        let traced = self.passes.iter().any(|pass| pass.name.starts_with(TRACED));
        traced.then(|| self.total().ms)
    }

    /// One line: time, the traced passes, rays, memory.
    pub fn summary(&self) -> String {
        let total = self.total();
        let mut line = format!("{:.2} ms", total.ms);
        for pass in &self.passes {
            if let Some(name) = pass.name.strip_prefix(TRACED) {
                let _ = write!(line, ", {name} {:.2}", pass.ms);
            }
        }
        if let Some(rays) = total.rays {
            #[allow(clippy::cast_precision_loss)] // a rounded count for reports
            let _ = write!(line, "; {:.2} Mrays", rays as f64 / 1.0e6);
        }
        let held = self.memory.iter().map(|(_, bytes)| bytes).sum();
        let _ = write!(line, "; {:.0} MB", megabytes(held));
        if let Some(moving) = &self.moving {
            let _ = write!(line, "; {}", moving.line());
        }
        if let Some(latency) = &self.latency {
            let (to, from) = (latency.to, latency.from_end);
            let _ = write!(
                line,
                "; {to} after {:.1} ms, p99 {:.1}",
                from.median, from.p99
            );
        }
        line
    }

    /// The same as JSON, one value per line.
    pub fn json(&self) -> String {
        let report = Report {
            device: &self.device,
            tracer: self.tracer.as_deref(),
            width: self.size.0,
            height: self.size.1,
            passes: self.passes.iter().map(PassReport::of).collect(),
            total: PassReport::of(&self.total()),
            memory: self,
            latency: self.latency,
            moving: self.moving,
        };
        // No value in a report fails to serialize.
        serde_json::to_string_pretty(&report).unwrap_or_default() + "\n"
    }
}

/// [`Costs`] as JSON.
#[derive(Serialize)]
struct Report<'a> {
    device: &'a str,
    tracer: Option<&'a str>,
    width: u32,
    height: u32,
    passes: Vec<PassReport>,
    total: PassReport,
    #[serde(serialize_with = "memory_by_name")]
    memory: &'a Costs,
    latency: Option<Latency>,
    moving: Option<MovingCost>,
}

/// [`PassCost`] as JSON; a number that is not finite becomes `null`.
#[derive(Serialize)]
struct PassReport {
    name: String,
    ms: f64,
    rays: Option<u64>,
    mrays_per_second: Option<f64>,
}

impl PassReport {
    fn of(pass: &PassCost) -> PassReport {
        PassReport {
            name: pass.name.clone(),
            ms: (f64::from(pass.ms) * 1e4).round() / 1e4,
            rays: pass.rays,
            mrays_per_second: pass.mrays_per_second().map(|r| (r * 100.0).round() / 100.0),
        }
    }
}

fn memory_by_name<S: Serializer>(costs: &&Costs, to: S) -> Result<S::Ok, S::Error> {
    let held = costs.memory.iter().map(|(of, bytes)| (of.name(), *bytes));
    to.collect_map(held.chain([("reserved", costs.reserved)]))
}

fn megabytes(bytes: u64) -> f64 {
    #[allow(clippy::cast_precision_loss)] // a rounded value for reports
    let bytes = bytes as f64;
    bytes / f64::from(1 << 20)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn costs() -> Costs {
        let timings = [
            ("trace_direct", 2.0),
            ("overlay", 0.5),
            ("trace_direct", 1.0),
        ];
        let timings = timings.map(|(name, ms)| (name.to_owned(), ms));
        let held = |kind, label: &str, bytes| MemoryUse {
            kind,
            label: label.into(),
            bytes,
        };
        Costs {
            device: "a \"device\"\n".into(),
            tracer: None,
            size: (4, 2),
            passes: Costs::passes(&timings, |name| (name == "trace_direct").then_some(6000)),
            memory: Costs::memory(&[
                held(MemoryKind::Target, "trace light 0", 10),
                held(MemoryKind::Buffer, "trace light lists", 20),
                held(MemoryKind::Buffer, "vertices", 30),
                held(MemoryKind::Texture, "a sky light", 40),
            ]),
            reserved: 1 << 20,
            latency: None,
            moving: None,
        }
    }

    #[test]
    fn passes_of_a_name_are_one_and_rates_are_rays_over_time() {
        let costs = costs();
        assert_eq!(costs.passes.len(), 2);
        assert_eq!(
            (costs.passes[0].ms, costs.passes[0].rays),
            (3.0, Some(6000))
        );
        assert_eq!(costs.passes[0].mrays_per_second(), Some(2.0));
        assert_eq!(costs.passes[1].rays, None);
        assert_eq!((costs.total().ms, costs.total().rays), (3.5, Some(6000)));
        assert_eq!(Costs::default().total().rays, None);
    }

    #[test]
    fn memory_is_summed_by_purpose() {
        let of = |purpose| {
            let costs = costs();
            costs.memory.iter().find(|m| m.0 == purpose).map(|m| m.1)
        };
        assert_eq!(of(MemoryPurpose::ScreenImages), Some(10));
        assert_eq!(of(MemoryPurpose::Lights), Some(20));
        assert_eq!(of(MemoryPurpose::Buffers), Some(30));
        assert_eq!(of(MemoryPurpose::Textures), Some(40));
        assert_eq!(of(MemoryPurpose::AccelerationStructures), Some(0));
    }

    #[test]
    fn json_is_well_formed_whatever_the_names() {
        let costs = costs();
        let json: serde_json::Value = serde_json::from_str(&costs.json()).unwrap();
        assert_eq!(json["device"], costs.device);
        assert_eq!(json["device"], "a \"device\"\n");
        assert_eq!(json["passes"].as_array().map(Vec::len), Some(2));
        let overlay = &json["passes"][1];
        assert_eq!(
            (&overlay["name"], &overlay["ms"]),
            (&"overlay".into(), &0.5.into())
        );
        assert!(overlay["rays"].is_null());
        assert_eq!(
            (&json["total"]["ms"], &json["total"]["rays"]),
            (&3.5.into(), &6000.into())
        );
        let memory = json["memory"].as_object().unwrap();
        assert_eq!(memory.len(), costs.memory.len() + 1);
        assert_eq!(memory["reserved"], 1 << 20);
        // Four digits of a millisecond, two of a rate.
        let odd = PassCost {
            name: "odd".into(),
            ms: 0.123_456,
            rays: Some(1),
        };
        let json = Costs {
            passes: vec![odd],
            ..Costs::default()
        };
        let json: serde_json::Value = serde_json::from_str(&json.json()).unwrap();
        assert_eq!(json["passes"][0]["ms"], 0.1235);
        assert_eq!(json["passes"][0]["mrays_per_second"], 0.01);
        // neither passes nor a tracer
        let empty = Costs::default().json();
        let empty: serde_json::Value = serde_json::from_str(&empty).unwrap();
        assert_eq!(empty["passes"], serde_json::json!([]));
        assert!(empty["tracer"].is_null());
    }

    #[test]
    fn lines_name_every_pass_and_purpose() {
        let text = costs().lines().join("\n");
        for part in [
            "trace_direct",
            "overlay",
            "all passes",
            "screen images",
            "lights",
        ] {
            assert!(text.contains(part), "{part}");
        }
        assert!(
            costs()
                .summary()
                .starts_with("3.50 ms, direct 3.00; 0.01 Mrays")
        );
    }
}
