//! Entities: every type, every flag, their light, fog and order.

mod lists;
mod shapes;
mod surroundings;

use glam::Vec3;

use super::board::{Board, screen};
use super::models::{model_files, turned};
use super::{File, Limit, Scene, Stage, scene_list};
use crate::engine::abi::{polyVert_t, refEntity_t};
use crate::engine::{Raised, View};

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "entities-shapes": "Sprites, beams, rails, bolts and the axes of missing models.",
            calls(shapes::shapes), files: plain_files, quick: true;
        // of the bolt's quads one is seen exactly from its edge: rounding decides which pixels it has
        "entities-rails": "Rails and bolts from the side, from their end, at other widths and lengths.",
            calls(shapes::rails), files: plain_files, limit: Limit { ssim: 0.99, ..Limit::SAME };
        "entities-flags": "Depth hack, and what is seen in a mirror alone or everywhere but there.",
            calls(shapes::flags), files: mirror_files;
        "entities-light": "The light grid, lights of the game, the light of views without a world.",
            calls(surroundings::light), files: plain_files, quick: true;
        "entities-brushes": "Brush models: placed, turned, lit, with materials that want an entity's light.",
            calls(surroundings::brushes), files: brush_files;
        "entities-fog": "Models, sprites and polygons inside, before and behind fog.",
            calls(surroundings::fog), files: fog_files;
        "entities-polys": "Polygons of one call and of many, their colours and their order.",
            calls(lists::polys), files: plain_files;
        "entities-order": "Translucent entities in the order of their numbers and shaders, several scenes in a frame.",
            calls(lists::order), files: plain_files;
        "entities-values": "Colour, texture offset and time of an entity in its material.",
            calls(lists::values), files: plain_files;
        "entities-bad": "Types that do not exist, places that are no place.", calls(lists::bad), files: plain_files;
    }
}

const SPRITE: i32 = 2;
const BEAM: i32 = 3;
const RAIL_CORE: i32 = 4;
const RAIL_RINGS: i32 = 5;
const LIGHTNING: i32 = 6;
const PORTAL_SURFACE: i32 = 7;

const MIN_LIGHT: i32 = 0x1;
const THIRD_PERSON: i32 = 0x2;
const FIRST_PERSON: i32 = 0x4;
const DEPTH_HACK: i32 = 0x8;
const CROSSHAIR: i32 = 0x10;
const LIGHTING_ORIGIN: i32 = 0x80;

const NO_WORLD_MODEL: i32 = 1;
const HYPERSPACE: i32 = 4;

const SCRIPT: &str = "
tube/upper
{
    {
        map g/env.tga
        rgbGen lightingDiffuse
    }
}
e/sprite
{
    cull none
    {
        map g/cut.tga
        blendFunc blend
        rgbGen exactVertex
    }
}
e/add
{
    cull none
    {
        map g/wide.tga
        blendFunc add
        rgbGen vertex
    }
}
e/lit
{
    {
        map g/base.tga
        rgbGen lightingDiffuse
    }
}
e/white
{
    {
        map g/white.tga
        rgbGen lightingDiffuse
    }
}
e/entity
{
    {
        map g/base.tga
        rgbGen entity
        tcMod entityTranslate
    }
}
e/inverse
{
    {
        map g/cut.tga
        blendFunc blend
        rgbGen oneMinusEntity
        alphaGen entity
        tcMod scroll 0.1 0.2
    }
}
e/fog
{
    surfaceparm fog
    fogparms ( 0.6 0.5 0.3 ) 300
}
e/mirror
{
    portal
    {
        map g/grey.tga
        blendFunc GL_DST_COLOR GL_ZERO
        depthWrite
    }
}
";

fn board() -> Board {
    Board::empty(SCRIPT)
}

fn with_models(mut files: Vec<File>) -> Vec<File> {
    files.extend(model_files());
    files
}

fn plain_files() -> Vec<File> {
    with_models(board().files())
}

fn mirror_files() -> Vec<File> {
    let mut map = board().map();
    let mirror = map.add_shader("e/mirror", 0, 1);
    map.add_quad(mirror, screen(Vec3::X * 36.0, 64.0, 64.0));
    with_models(board().files_with(map))
}

fn brush_files() -> Vec<File> {
    let mut map = board().map();
    let page = map.add_lightmap([60, 40, 20]);
    for shader in ["g/base", "e/lit", "e/entity"] {
        let shader = map.add_shader(shader, 0, 1);
        map.begin_model();
        let half = Vec3::splat(16.0);
        let first = map.add_box_faces(shader, -half, half, false);
        for surface in first {
            map.set_lightmap(surface, page);
        }
    }
    with_models(board().files_with(map))
}

fn fog_files() -> Vec<File> {
    let mut map = board().map();
    let shader = map.add_shader("e/fog", 0, 0x40);
    map.add_fog_brush(
        shader,
        Vec3::new(-300.0, -300.0, -300.0),
        Vec3::new(300.0, 300.0, 8.0),
        5,
    );
    with_models(board().files_with(map))
}

/// An entity of a type between two places.
fn line(kind: i32, from: Vec3, to: Vec3) -> refEntity_t {
    refEntity_t {
        reType: kind,
        origin: to.to_array(),
        oldorigin: from.to_array(),
        shaderRGBA: [255, 180, 60, 255],
        ..refEntity_t::default()
    }
}

fn sprite(at: Vec3, radius: f32, shader: i32) -> refEntity_t {
    refEntity_t {
        reType: SPRITE,
        origin: at.to_array(),
        radius,
        customShader: shader,
        shaderRGBA: [255, 200, 150, 220],
        ..refEntity_t::default()
    }
}

pub(super) fn tube_at(stage: &mut Stage, at: Vec3) -> Result<refEntity_t, Raised> {
    Ok(refEntity_t {
        hModel: stage.register_model("m/key.md3")?,
        origin: at.to_array(),
        axis: turned(25.0),
        frame: 1,
        oldframe: 1,
        ..refEntity_t::default()
    })
}

/// A camera that looks along no axis.
fn askew(stage: &Stage) -> View {
    let mut view = stage.view(Vec3::new(-120.0, 50.0, 40.0), -20.0);
    view.angles.x = 15.0;
    view.angles.z = 10.0;
    view
}

/// A polygon that faces the camera.
fn square(at: Vec3, size: f32, modulate: [u8; 4]) -> [polyVert_t; 4] {
    [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(y, z)| polyVert_t {
        xyz: (at + Vec3::new(0.0, y * size, z * size)).to_array(),
        st: [0.5 - y * 0.5, 0.5 - z * 0.5],
        modulate,
    })
}
