//! Maps from the command line, and places to look at them from.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, bail};
use clap::Args;
use glam::Vec3;
use q3bsp::{Bsp, Format};
use relight::{GameFiles, MemoryFiles, Overlay, Pk3, SearchPath, map_files};
use renderer_vk::Renderer;
use renderer_vk::api::{EntityKind, RefDef, RefEntity};

/// Which maps a command is about.
#[derive(Args, Debug)]
pub struct Maps {
    /// Maps by name
    #[arg(required = true)]
    pub maps: Vec<String>,
    /// Game folder with packs; give several in rising priority
    #[arg(
        long = "game",
        value_name = "DIR",
        default_value = "/usr/share/games/openarena/baseoa"
    )]
    pub games: Vec<PathBuf>,
}

/// Where the game's files and the map come from.
///
/// `map`: a name (oa_dm1), maps/oa_dm1.bsp, or a .bsp or .pk3 file; `games`: folders with packs, the last has precedence.
///
/// # Errors
/// A folder or the file cannot be read, or a pack has not exactly one map.
pub fn open(map: &str, games: &[PathBuf]) -> anyhow::Result<(Arc<dyn GameFiles>, String)> {
    let mut path = SearchPath::open(games)?;
    let map = map.to_owned();
    let file = PathBuf::from(&map);
    let name = match file.extension().and_then(|e| e.to_str()) {
        Some("pk3") if file.is_file() => {
            let pack = Pk3::open(&file)?;
            let maps = pack.list("maps", ".bsp");
            path.add_pk3(&file)?;
            match maps.as_slice() {
                [one] => format!("maps/{one}"),
                [] => bail!("{map}: no map in it"),
                many => bail!(
                    "{map}: several maps in it ({}); name one and give the pack's folder with --game",
                    many.join(", ")
                ),
            }
        }
        Some("bsp") if file.is_file() => {
            let stem = file.file_stem().and_then(|s| s.to_str()).unwrap_or("map");
            let name = format!("maps/{stem}.bsp");
            let mut front = MemoryFiles::new();
            front.insert(
                &name,
                std::fs::read(&file).with_context(|| format!("{map}: cannot be read"))?,
            )?;
            return Ok((with_map_files(path, front, &name)?, name));
        }
        _ if map.starts_with("maps/") => map,
        _ => format!("maps/{map}.bsp"),
    };
    Ok((with_map_files(path, MemoryFiles::new(), &name)?, name))
}

/// The game's files with `front` before them, and what the map brings along where its format has no scripts.
fn with_map_files(
    back: SearchPath,
    front: MemoryFiles,
    name: &str,
) -> anyhow::Result<Arc<dyn GameFiles>> {
    let files = Overlay { front, back };
    let bytes = files.read(name)?.unwrap_or_default();
    if !Format::of(&bytes).is_some_and(Format::is_quake) {
        return Ok(Arc::new(files));
    }
    let bsp = Bsp::parse(&bytes).with_context(|| name.to_owned())?;
    let Some((front, warnings)) = map_files(&bsp, &files) else {
        return Ok(Arc::new(files));
    };
    for warning in warnings {
        log::warn!("{name}: {warning}");
    }
    Ok(Arc::new(Overlay { front, back: files }))
}

/// A place to look from.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Units.
    pub origin: Vec3,
    /// Degrees, from east to north.
    pub yaw: f32,
    /// Degrees, down.
    pub pitch: f32,
}

impl Camera {
    /// Forward, left, up.
    pub fn axis(&self) -> [Vec3; 3] {
        let (sy, cy) = self.yaw.to_radians().sin_cos();
        let (sp, cp) = self.pitch.to_radians().sin_cos();
        [
            Vec3::new(cp * cy, cp * sy, -sp),
            Vec3::new(-sy, cy, 0.0),
            Vec3::new(sp * cy, sp * sy, cp),
        ]
    }

    /// The view of a picture of `size` pixels; `fov`: horizontal, degrees.
    pub fn ref_def(&self, size: (u32, u32), fov: f32) -> RefDef {
        let (width, height) = size;
        let fov = fov.clamp(1.0, 170.0);
        let half = (fov.to_radians() * 0.5).tan();
        RefDef {
            width: width as i32,
            height: height as i32,
            fov_x: fov,
            fov_y: (half * height as f32 / width as f32).atan().to_degrees() * 2.0,
            view_origin: self.origin,
            view_axis: self.axis(),
            ..RefDef::default()
        }
    }

    /// The intermission's view, or that of the first spawn point, eyes 26 units above it.
    pub fn of_map(bsp: &Bsp) -> Option<Self> {
        let entities = bsp.entities();
        let find = |class: &str| entities.iter().find(|e| e.classname() == class);
        let number =
            |e: &q3bsp::Entity, key: &str| e.get(key).and_then(|v| v.trim().parse::<f32>().ok());
        if let Some(view) = find("info_player_intermission") {
            let origin = view.vec3("origin")?;
            let target = view.get("target").and_then(|name| {
                entities
                    .iter()
                    .find(|e| e.get("targetname") == Some(name))
                    .and_then(|e| e.vec3("origin"))
            });
            let (mut yaw, mut pitch) = (number(view, "angle").unwrap_or(0.0), 0.0);
            if let Some(angles) = view.vec3("angles") {
                (pitch, yaw) = (angles.x, angles.y);
            }
            if let Some(to) = target.map(|t| t - origin).filter(|to| to.length() > 1.0) {
                yaw = to.y.atan2(to.x).to_degrees();
                pitch = -to.z.atan2(to.truncate().length()).to_degrees();
            }
            return Some(Self { origin, yaw, pitch });
        }
        let spawn = [
            "info_player_deathmatch",
            "info_player_start",
            "team_CTF_redspawn",
            "team_CTF_redplayer",
        ]
        .into_iter()
        .find_map(find)?;
        Some(Self {
            origin: spawn.vec3("origin")? + Vec3::Z * 26.0,
            yaw: number(spawn, "angle").unwrap_or(0.0),
            pitch: 0.0,
        })
    }
}

/// What the game would add to every view: the map's inline models at rest, and the marks of its mirrors.
pub fn map_entities(renderer: &mut Renderer, bsp: &Bsp) -> Vec<RefEntity> {
    let mut entities = Vec::new();
    let axis = [Vec3::X, Vec3::Y, Vec3::Z];
    for entity in bsp.entities() {
        let origin = entity.vec3("origin").unwrap_or(Vec3::ZERO);
        let base = RefEntity {
            axis,
            origin,
            old_origin: origin,
            shader_rgba: [255; 4],
            ..RefEntity::default()
        };
        match entity.get("model") {
            Some(name) if name.starts_with('*') && name != "*0" => {
                let model = renderer.register_model(name);
                entities.push(RefEntity { model, ..base });
            }
            _ => {}
        }
        // without a target it is a mirror; a camera portal needs the game to turn and move its camera
        if entity.classname() == "misc_portal_surface" && entity.get("target").is_none() {
            entities.push(RefEntity {
                kind: EntityKind::PortalSurface,
                ..base
            });
        }
    }
    entities
}
