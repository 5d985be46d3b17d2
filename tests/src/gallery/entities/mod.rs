//! Entities: every type, every flag, their light, fog and order.

mod lists;
mod shapes;
mod surroundings;

use glam::Vec3;
use q3bsp::builder::MapBuilder;

use super::board::{Board, Shape};
use super::models::{model_files, turned};
use super::{File, Limit, Scene, Stage};
use crate::engine::abi::{polyVert_t, refEntity_t};
use crate::engine::{Raised, View};

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    let scene = |name, about, files, play| Scene {
        files,
        ..Scene::new(name, about, play)
    };
    vec![
        Scene {
            quick: true,
            ..scene(
                "entities-shapes",
                "Sprites, beams, rails, bolts and the axes of missing models.",
                plain_files,
                shapes::shapes,
            )
        },
        Scene {
            // of the bolt's quads one is seen exactly from its edge: rounding decides which pixels it has
            limit: Limit {
                ssim: 0.99,
                ..Limit::SAME
            },
            ..scene(
                "entities-rails",
                "Rails and bolts from the side, from their end, at other widths and lengths.",
                plain_files,
                shapes::rails,
            )
        },
        scene(
            "entities-flags",
            "Depth hack, and what is seen in a mirror alone or everywhere but there.",
            mirror_files,
            shapes::flags,
        ),
        Scene {
            quick: true,
            ..scene(
                "entities-light",
                "The light grid, lights of the game, the light of views without a world.",
                plain_files,
                surroundings::light,
            )
        },
        scene(
            "entities-brushes",
            "Brush models: placed, turned, lit, with materials that want an entity's light.",
            brush_files,
            surroundings::brushes,
        ),
        scene(
            "entities-fog",
            "Models, sprites and polygons inside, before and behind fog.",
            fog_files,
            surroundings::fog,
        ),
        scene(
            "entities-polys",
            "Polygons of one call and of many, their colours and their order.",
            plain_files,
            lists::polys,
        ),
        scene(
            "entities-order",
            "Translucent entities in the order of their numbers and shaders, several scenes in a frame.",
            plain_files,
            lists::order,
        ),
        scene(
            "entities-values",
            "Colour, texture offset and time of an entity in its material.",
            plain_files,
            lists::values,
        ),
        scene(
            "entities-bad",
            "Types that do not exist, places that are no place.",
            plain_files,
            lists::bad,
        ),
    ]
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
    Board {
        script: SCRIPT.to_string(),
        ..Board::new(4, Shape::Face, [""; 0])
    }
}

fn with_models(mut files: Vec<File>) -> Vec<File> {
    files.extend(model_files());
    files
}

fn plain_files() -> Vec<File> {
    with_models(board().files())
}

/// A quad that faces back towards the camera, `size` units to each side.
fn add_screen(map: &mut MapBuilder, shader: q3bsp::ShaderId, center: Vec3, size: f32) {
    let corner = |y: f32, z: f32| center + Vec3::new(0.0, y * size, z * size);
    let corners = [
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
    ];
    map.add_quad(shader, corners);
}

fn mirror_files() -> Vec<File> {
    let mut map = board().map();
    let mirror = map.add_shader("e/mirror", 0, 1);
    add_screen(&mut map, mirror, Vec3::new(36.0, 0.0, 0.0), 64.0);
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

fn tube_at(stage: &mut Stage, at: Vec3) -> Result<refEntity_t, Raised> {
    Ok(refEntity_t {
        hModel: stage.register_model("m/key.md3")?,
        origin: at.to_array(),
        axis: turned(25.0),
        frame: 1,
        oldframe: 1,
        ..refEntity_t::default()
    })
}

fn keep(stage: &mut Stage, name: &str, view: &View, all: &[refEntity_t]) -> Result<(), Raised> {
    stage.keep_view(name, view, |e| {
        all.iter().try_for_each(|entity| e.add_entity(entity))
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
