//! Opens maps, and finds cameras in them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::beside::{add_beside, beside};
use crate::game::Game;
use anyhow::{Context, bail};
use glam::Vec3;
use q3bsp::{Bsp, Format};
use relight::viewpoints::{self, Viewpoint};
use relight::{GameFiles, LoadError, MemoryFiles, Overlay, Pk3, RelitWorld, SearchPath, map_files};
use renderer_vk::api::{EntityKind, RefDef, RefEntity};
use renderer_vk::{FrameStats, Renderer, Settings};

/// Opens a map with its game files; also returns its game path.
///
/// `map`: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp or .pk3 file, or pack.pk3:maps/x.bsp. Includes lights and lightmaps
/// beside a .bsp file.
///
/// # Errors
/// A folder or the file cannot be read, or a pack has no map or several.
pub fn open(map: &str, game: &Game) -> anyhow::Result<(Arc<dyn GameFiles>, String)> {
    let mut path = game.files()?;
    let map = map.to_owned();
    if let Some((pack, inside)) = map.split_once(".pk3:") {
        path.add_pk3(Path::new(&format!("{pack}.pk3")))?;
        let name = inside.to_owned();
        return Ok((with_map_files(path, MemoryFiles::new(), &name)?, name));
    }
    let file = PathBuf::from(&map);
    let name = match file.extension().and_then(|e| e.to_str()) {
        Some("pk3") if file.is_file() => {
            let pack = Pk3::open(&file)?;
            let maps = pack.list("maps", ".bsp");
            path.add_pk3(&file)?;
            match maps.as_slice() {
                [one] => format!("maps/{one}"),
                [] => bail!(no_maps(&map, &pack)),
                many => bail!(
                    "{map}: several maps in it ({}); name one and give the pack's folder with --game",
                    many.join(", ")
                ),
            }
        }
        _ if file.is_file() => {
            let stem = file.file_stem().and_then(|s| s.to_str()).unwrap_or("map");
            let name = format!("maps/{stem}.bsp");
            let bytes = std::fs::read(&file).with_context(|| format!("{map}: cannot be read"))?;
            // checked here, so that an error names the file
            Bsp::parse(&bytes).with_context(|| map.clone())?;
            let mut front = beside(&file)?;
            front.insert(&name, bytes)?;
            return Ok((with_map_files(path, front, &name)?, name));
        }
        _ if map.starts_with("maps/") => map,
        _ if map.ends_with(".bsp") && !map.contains('/') => format!("maps/{map}"),
        _ => format!("maps/{map}.bsp"),
    };
    Ok((with_map_files(path, MemoryFiles::new(), &name)?, name))
}

/// Opens a map whose bytes are known, `NAME.bsp`, with its game files and the files beside `places`; also returns its game
/// path.
///
/// # Errors
/// A folder or a file cannot be read, or the bytes are no map.
pub fn open_bytes(
    bytes: Vec<u8>,
    places: &[PathBuf],
    game: &Game,
) -> anyhow::Result<(Arc<dyn GameFiles>, String)> {
    let stem = places.first().and_then(|file| file.file_stem());
    let stem = stem.and_then(|s| s.to_str()).unwrap_or("map");
    let name = format!("maps/{stem}.bsp");
    let mut front = MemoryFiles::new();
    for place in places {
        add_beside(&mut front, place)?;
    }
    front.insert(&name, bytes)?;
    Ok((with_map_files(game.files()?, front, &name)?, name))
}

/// Name of a map for files and tables, without folders. `path`: from [`open`].
pub fn map_name(path: &str) -> &str {
    let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
    name.strip_suffix(".bsp").unwrap_or(name)
}

/// Message for a pack without maps in the game's folder: their place, if there are any, and the remedy.
pub fn no_maps(name: &str, pack: &Pk3) -> String {
    let is_map = |path: &String| path.to_ascii_lowercase().ends_with(".bsp");
    let Some(found) = pack.all_names().find(is_map) else {
        return format!("{name}: no maps in it");
    };
    let inside = found.to_ascii_lowercase().rfind("/maps/");
    match inside.and_then(|at| found.get(..at)) {
        Some(folder) => format!(
            "{name}: no maps in it where games read them: all lies below the folder {folder} ({found}); unpack it and pack \
             what is inside of {folder}, so that the folder maps is at the top"
        ),
        None => format!(
            "{name}: no maps in it where games read them: {found} is in no folder maps at the pack's top; move it there"
        ),
    }
}

/// The game's files behind `front`, and those in the map itself if its format has no scripts.
fn with_map_files(
    back: SearchPath,
    front: MemoryFiles,
    name: &str,
) -> anyhow::Result<Arc<dyn GameFiles>> {
    let files = Overlay { front, back };
    let absent = || LoadError::Absent {
        map: name.to_owned(),
    };
    let bytes = files.read(name)?.ok_or_else(absent)?;
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

/// Yaw and pitch of an overview, degrees.
const OVERVIEW: (f32, f32) = (45.0, 50.0);

/// A camera.
#[derive(Clone, Copy, Debug, Default)]
pub struct Camera {
    /// Position, units.
    pub origin: Vec3,
    /// Degrees, counter-clockwise from +x.
    pub yaw: f32,
    /// Degrees, down.
    pub pitch: f32,
}

impl From<Viewpoint> for Camera {
    fn from(view: Viewpoint) -> Self {
        let Viewpoint { origin, yaw, pitch } = view;
        Self { origin, yaw, pitch }
    }
}

impl From<Camera> for Viewpoint {
    fn from(camera: Camera) -> Self {
        let Camera { origin, yaw, pitch } = camera;
        Self { origin, yaw, pitch }
    }
}

impl Camera {
    /// Axes: forward, left, up.
    pub fn axis(&self) -> [Vec3; 3] {
        Viewpoint::from(*self).axis()
    }

    /// The view for a picture of `size` pixels; `fov`: horizontal, degrees.
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

    /// The intermission's camera, or that of the first spawn point.
    pub fn of_map(bsp: &Bsp) -> Option<Self> {
        let entities = bsp.entities();
        let view = viewpoints::intermission(&entities);
        view.or_else(|| viewpoints::spawn_views(&entities).next())
            .map(Self::from)
    }

    /// The cameras of the spawn points, in the map's order.
    pub fn spawns(bsp: &Bsp) -> Vec<Self> {
        viewpoints::spawn_views(&bsp.entities())
            .map(Self::from)
            .collect()
    }

    /// A view of the whole map from above one of its corners; `None` if the map has no triangles.
    pub fn overview(world: &RelitWorld, size: (u32, u32), fov: f32) -> Option<Self> {
        let sky = |material: u32| {
            let material = world.materials.get(material as usize);
            material.is_none_or(relight::WorldMaterial::is_sky)
        };
        let drawn = world
            .surfaces
            .iter()
            .filter(|s| s.model == 0 && s.num_indices > 0 && !sky(s.material));
        let vertices = drawn.flat_map(|s| world.vertices_of(s));
        let places = || {
            vertices
                .clone()
                .map(|v| v.position)
                .filter(|p| p.is_finite())
        };
        let least = places().reduce(Vec3::min)?;
        let most = places().reduce(Vec3::max)?;
        let middle = (least + most) * 0.5;
        let mut camera = Self {
            origin: middle,
            yaw: OVERVIEW.0,
            pitch: OVERVIEW.1,
        };
        // as far back as the outermost corner requires
        let [forward, left, up] = camera.axis();
        let def = camera.ref_def(size, fov);
        let across = (def.fov_x.to_radians() * 0.5).tan();
        let down = (def.fov_y.to_radians() * 0.5).tan();
        let back = (0..8).map(|corner| {
            let pick = |bit: u8| if corner >> bit & 1 == 0 { least } else { most };
            let to = Vec3::new(pick(0).x, pick(1).y, pick(2).z) - middle;
            (to.dot(left).abs() / across).max(to.dot(up).abs() / down) - to.dot(forward)
        });
        camera.origin -= forward * back.fold(0.0, f32::max);
        Some(camera)
    }

    /// The first position along the view direction inside the map; otherwise this camera.
    pub fn moved_inside(self, bsp: &Bsp) -> Self {
        const STEP: f32 = 16.0;
        const STEPS: u16 = 8192;
        let [forward, ..] = self.axis();
        let inside = |p: &Vec3| bsp.cluster_at(*p) >= 0;
        let origin = (0..STEPS)
            .map(|step| self.origin + forward * (f32::from(step) * STEP))
            .find(inside)
            .unwrap_or(self.origin);
        Self { origin, ..self }
    }
}

/// Loads a map into a renderer, as a game does; returns the map's data, and [the entities](map_entities) for every
/// view.
///
/// # Errors
/// The map cannot be read, or the device is out of memory.
pub fn load(
    renderer: &mut Renderer,
    files: Arc<dyn GameFiles>,
    path: &str,
    settings: &Settings,
) -> anyhow::Result<(Bsp, Vec<RefEntity>)> {
    renderer.begin_registration(files, settings)?;
    load_registered(renderer, path)
}

/// As [`load`], with the scripts and images of the map before: only the map itself has changed.
///
/// # Errors
/// As [`load`].
pub fn load_again(
    renderer: &mut Renderer,
    files: Arc<dyn GameFiles>,
    path: &str,
    settings: &Settings,
) -> anyhow::Result<(Bsp, Vec<RefEntity>)> {
    renderer.renew_registration(files, settings)?;
    load_registered(renderer, path)
}

fn load_registered(renderer: &mut Renderer, path: &str) -> anyhow::Result<(Bsp, Vec<RefEntity>)> {
    renderer.load_world(path)?;
    renderer.end_registration();
    let bsp = renderer.world().map(|w| w.relit.bsp.clone());
    let bsp = bsp.context("no map")?;
    let entities = map_entities(renderer, &bsp);
    Ok((bsp, entities))
}

/// Draws a frame with these entities.
///
/// # Errors
/// The device is lost or out of memory.
pub fn draw(
    renderer: &mut Renderer,
    entities: &[RefEntity],
    def: &RefDef,
) -> anyhow::Result<FrameStats> {
    for &eye in renderer.eyes() {
        renderer.begin_frame(def.time_ms);
        renderer.set_eye(eye);
        renderer.clear_scene();
        for entity in entities {
            renderer.add_entity(entity);
        }
        renderer.render_scene(def)?;
    }
    Ok(renderer.end_frame()?)
}

/// A model at a place, not turned.
pub fn placed(model: i32, origin: Vec3) -> RefEntity {
    RefEntity {
        model,
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        origin,
        old_origin: origin,
        shader_rgba: [255; 4],
        ..RefEntity::default()
    }
}

/// Entities that the game would add to every view: the map's inline models at rest, and the marks of its mirrors.
fn map_entities(renderer: &mut Renderer, bsp: &Bsp) -> Vec<RefEntity> {
    let mut entities = Vec::new();
    for entity in bsp.entities() {
        let origin = entity.vec3("origin").unwrap_or(Vec3::ZERO);
        let base = placed(0, origin);
        match entity.get("model") {
            Some(name) if name.starts_with('*') && name != "*0" => {
                let model = renderer.register_model(name);
                entities.push(RefEntity { model, ..base });
            }
            _ => {}
        }
        // without a target it marks a mirror; a portal would need the game to move its camera
        if entity.classname() == "misc_portal_surface" && entity.get("target").is_none() {
            entities.push(RefEntity {
                kind: EntityKind::PortalSurface,
                ..base
            });
        }
    }
    entities
}
