//! Entities: every type, every flag, their light, fog and order.

use glam::Vec3;
use q3bsp::builder::MapBuilder;

use super::board::{Board, MAP, Shape};
use super::models::{KINDS, model_files, turned};
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
                shapes,
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
                rails,
            )
        },
        scene(
            "entities-flags",
            "Depth hack, and what is seen in a mirror alone or everywhere but there.",
            mirror_files,
            flags,
        ),
        Scene {
            quick: true,
            ..scene(
                "entities-light",
                "The light grid, lights of the game, the light of views without a world.",
                plain_files,
                light,
            )
        },
        scene(
            "entities-brushes",
            "Brush models: placed, turned, lit, with materials that want an entity's light.",
            brush_files,
            brushes,
        ),
        scene(
            "entities-fog",
            "Models, sprites and polygons inside, before and behind fog.",
            fog_files,
            fog,
        ),
        scene(
            "entities-polys",
            "Polygons of one call and of many, their colours and their order.",
            plain_files,
            polys,
        ),
        scene(
            "entities-order",
            "Translucent entities in the order of their numbers and shaders, several scenes in a frame.",
            plain_files,
            order,
        ),
        scene(
            "entities-values",
            "Colour, texture offset and time of an entity in its material.",
            plain_files,
            values,
        ),
        scene(
            "entities-bad",
            "Types that do not exist, places that are no place.",
            plain_files,
            bad,
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
fn add_screen(map: &mut MapBuilder, shader: i32, center: Vec3, size: f32) {
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

fn shapes(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let round = stage.register_shader("e/sprite")?;
    let add = stage.register_shader("e/add")?;
    let (left, right) = (Vec3::new(0.0, 40.0, -10.0), Vec3::new(20.0, -40.0, 20.0));
    let view = askew(stage);
    let sprites = [
        sprite(left, 20.0, round),
        refEntity_t {
            rotation: 30.0,
            ..sprite(right, 20.0, round)
        },
        refEntity_t {
            rotation: -100.0,
            ..sprite(Vec3::ZERO, 12.0, add)
        },
        sprite(Vec3::new(0.0, 0.0, 40.0), 10.0, 0),
    ];
    keep(stage, "sprites", &view, &sprites)?;
    // without a shader that is drawn late the world is drawn over them
    let beams = [
        line(BEAM, Vec3::new(0.0, 0.0, 50.0), Vec3::ZERO),
        line(BEAM, Vec3::new(500.0, 530.0, 510.0), Vec3::splat(500.0)),
        line(BEAM, Vec3::new(0.0, -30.0, 20.0), Vec3::ZERO),
        line(BEAM, Vec3::ONE, Vec3::ONE),
    ];
    let beams = [0, add, round, add].into_iter().zip(beams);
    let beams: Vec<_> = beams
        .map(|(shader, beam)| refEntity_t {
            customShader: shader,
            ..beam
        })
        .collect();
    keep(stage, "beams", &view, &beams)?;
    for (name, kind) in [
        ("rail-core", RAIL_CORE),
        ("rail-rings", RAIL_RINGS),
        ("lightning", LIGHTNING),
    ] {
        let entity = refEntity_t {
            customShader: add,
            ..line(kind, left, right)
        };
        keep(stage, name, &view, &[entity])?;
    }
    let axes = [
        refEntity_t::default(),
        refEntity_t {
            hModel: 999,
            origin: left.to_array(),
            axis: turned(40.0),
            ..refEntity_t::default()
        },
        refEntity_t {
            hModel: stage.register_model("m/none.md3")?,
            origin: right.to_array(),
            axis: turned(-40.0).map(|a| a.map(|v| v * 2.0)),
            renderfx: DEPTH_HACK,
            ..refEntity_t::default()
        },
    ];
    keep(stage, "axes", &view, &axes)
}

fn rails(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let add = stage.register_shader("e/add")?;
    let (left, right) = (Vec3::new(0.0, 140.0, -40.0), Vec3::new(20.0, -140.0, 50.0));
    let view = stage.view(Vec3::new(-140.0, 0.0, 0.0), 0.0);
    for (name, core, width, segment) in [
        ("plain", "6", "16", "32"),
        ("wide", "20", "64", "32"),
        ("thin", "1", "8", "16"),
        ("odd", "2.7", "16.9", "20.5"),
    ] {
        stage.set("r_railCoreWidth", core);
        stage.set("r_railWidth", width);
        stage.set("r_railSegmentLength", segment);
        let up = Vec3::Z * 30.0;
        let all = [
            line(RAIL_CORE, left + up, right + up),
            line(RAIL_RINGS, left, right),
            line(LIGHTNING, left - up, right - up),
            line(
                RAIL_RINGS,
                left - up * 2.0,
                left - up * 2.0 + Vec3::X * 10.0,
            ),
            line(RAIL_RINGS, -up * 2.0, Vec3::new(0.0, -70.0, 0.0) - up * 2.0),
        ]
        .map(|entity| refEntity_t {
            customShader: add,
            ..entity
        });
        keep(stage, name, &view, &all)?;
    }
    // from behind its start, so that some of it lies behind the eye
    let view = stage.view(Vec3::new(-20.0, 100.0, -30.0), -80.0);
    let all = [RAIL_CORE, RAIL_RINGS, LIGHTNING].map(|kind| refEntity_t {
        customShader: add,
        ..line(kind, left, right)
    });
    keep(stage, "along", &view, &all)
}

fn flags(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let round = stage.register_shader("e/sprite")?;
    let add = stage.register_shader("e/add")?;
    let view = stage.view(Vec3::new(-130.0, 0.0, 0.0), 0.0);
    let mirror = line(PORTAL_SURFACE, Vec3::X * 30.0, Vec3::X * 30.0);
    let model = tube_at(stage, Vec3::new(-30.0, 44.0, 0.0))?;
    let all = [
        model,
        refEntity_t {
            rotation: 30.0,
            ..sprite(Vec3::new(-30.0, 0.0, 20.0), 12.0, round)
        },
        refEntity_t {
            customShader: add,
            ..line(
                LIGHTNING,
                Vec3::new(-30.0, -20.0, -30.0),
                Vec3::new(-40.0, 20.0, -40.0),
            )
        },
        refEntity_t {
            hModel: 0,
            origin: [-30.0, -44.0, 0.0],
            ..model
        },
        refEntity_t {
            customShader: add,
            ..line(BEAM, Vec3::new(0.0, 0.0, -30.0), Vec3::ZERO)
        },
    ];
    for (name, renderfx) in [
        ("none", 0),
        ("third-person", THIRD_PERSON),
        ("first-person", FIRST_PERSON),
        ("depth-hack", DEPTH_HACK),
        ("min-light", MIN_LIGHT),
        ("crosshair", CROSSHAIR | DEPTH_HACK),
        ("all-unused", 0x20 | 0x40 | !0x3ff),
    ] {
        let mut scene = vec![mirror];
        scene.extend(all.map(|entity| refEntity_t { renderfx, ..entity }));
        keep(stage, name, &view, &scene)?;
    }
    // behind the wall
    let behind = |at: &mut refEntity_t| at.origin[0] += 100.0;
    for (name, renderfx) in [("hidden", 0), ("hacked", DEPTH_HACK)] {
        let mut scene = all
            .map(|entity| refEntity_t { renderfx, ..entity })
            .to_vec();
        scene.iter_mut().for_each(behind);
        // without it the mirror would show what it showed before
        scene.push(mirror);
        keep(stage, name, &view, &scene)?;
    }
    Ok(())
}

fn light(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let white = stage.register_shader("e/white")?;
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    let mut row = Vec::new();
    for at in 0..4u8 {
        let y = 66.0 - f32::from(at) * 44.0;
        let z = f32::from(at % 2) * 30.0;
        row.push(refEntity_t {
            customShader: white,
            ..tube_at(stage, Vec3::new(0.0, y, z))?
        });
    }
    keep(stage, "grid", &view, &row)?;
    let lights = [
        (
            Vec3::new(-30.0, 60.0, 10.0),
            120.0,
            Vec3::new(1.0, 0.3, 0.1),
        ),
        (
            Vec3::new(-20.0, -50.0, 60.0),
            200.0,
            Vec3::new(0.1, 0.4, 1.5),
        ),
        (Vec3::new(0.0, 22.0, 30.0), 5.0, Vec3::ONE),
    ];
    for (name, additive) in [("lights", false), ("additive", true)] {
        stage.keep_view(name, &view, |e| {
            for (at, radius, color) in lights {
                if additive {
                    e.add_additive_light(at, radius, color)?;
                } else {
                    e.add_light(at, radius, color)?;
                }
            }
            row.iter().try_for_each(|entity| e.add_entity(entity))
        })?;
    }
    let elsewhere: Vec<_> = row
        .iter()
        .map(|entity| refEntity_t {
            renderfx: LIGHTING_ORIGIN,
            lightingOrigin: [-20.0, -130.0, -120.0],
            ..*entity
        })
        .collect();
    keep(stage, "elsewhere", &view, &elsewhere)?;
    let outside: Vec<_> = row
        .iter()
        .map(|entity| refEntity_t {
            renderfx: LIGHTING_ORIGIN,
            lightingOrigin: [9000.0, -9000.5, 4000.3],
            ..*entity
        })
        .collect();
    keep(stage, "outside", &view, &outside)?;
    for (name, flags) in [
        ("no-world", NO_WORLD_MODEL),
        ("hyperspace", NO_WORLD_MODEL | HYPERSPACE),
        ("hyperspace-world", HYPERSPACE),
    ] {
        let mut view = view;
        view.flags = flags;
        stage.keep_view(name, &view, |e| {
            for (at, radius, color) in lights {
                e.add_light(at, radius, color)?;
            }
            row.iter().try_for_each(|entity| e.add_entity(entity))
        })?;
    }
    stage.set("r_ambientScale", "0.3");
    stage.set("r_directedScale", "1.7");
    keep(stage, "scaled", &view, &row)?;
    for (number, at) in [
        Vec3::ZERO,
        Vec3::new(31.0, -77.0, 12.0),
        Vec3::new(-500.0, 900.0, 3.0),
    ]
    .into_iter()
    .enumerate()
    {
        let text = stage.light_for_point(at)?.map_or_else(
            || "none".to_string(),
            |answer| {
                let line = |v: Vec3| format!("{} {} {}", v.x, v.y, v.z);
                answer.map(line).join(" ")
            },
        );
        stage.fact(&format!("light {number}"), text);
    }
    Ok(())
}

fn brushes(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-120.0, 0.0, 20.0), 0.0);
    let mut all = Vec::new();
    for (at, yaw) in [(1u8, 0.0), (2, 30.0), (3, 60.0)] {
        all.push(refEntity_t {
            hModel: stage.register_model(&format!("*{at}"))?,
            origin: [0.0, 110.0 - f32::from(at) * 55.0, 0.0],
            axis: turned(yaw),
            shaderRGBA: [200, 120, 60, 255],
            ..refEntity_t::default()
        });
    }
    keep(stage, "placed", &view, &all)?;
    stage.keep_view("lights", &view, |e| {
        e.add_light(Vec3::new(-40.0, 40.0, 10.0), 90.0, Vec3::new(1.0, 0.5, 0.2))?;
        e.add_light(
            Vec3::new(-50.0, -30.0, 20.0),
            90.0,
            Vec3::new(0.2, 0.5, 1.0),
        )?;
        all.iter().try_for_each(|entity| e.add_entity(entity))
    })?;
    for (name, renderfx) in [("third-person", THIRD_PERSON), ("depth-hack", DEPTH_HACK)] {
        let flagged: Vec<_> = all
            .iter()
            .map(|entity| refEntity_t {
                renderfx,
                ..*entity
            })
            .collect();
        keep(stage, name, &view, &flagged)?;
    }
    Ok(())
}

fn fog(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let round = stage.register_shader("e/sprite")?;
    let add = stage.register_shader("e/add")?;
    let mut all = Vec::new();
    for at in 0..5u8 {
        let step = f32::from(at);
        let (x, z) = (step * 30.0 - 60.0, step * 16.0 - 40.0);
        all.push(tube_at(stage, Vec3::new(x, 80.0 - step * 30.0, z))?);
        all.push(sprite(Vec3::new(x, 60.0 - step * 30.0, z), 12.0, round));
        all.push(sprite(
            Vec3::new(x, 60.0 - step * 30.0, z - 20.0),
            12.0,
            add,
        ));
        all.push(refEntity_t {
            renderfx: CROSSHAIR,
            ..sprite(Vec3::new(x, 60.0 - step * 30.0, z + 24.0), 8.0, round)
        });
    }
    all.push(refEntity_t {
        customShader: add,
        ..line(
            RAIL_CORE,
            Vec3::new(-60.0, 90.0, -50.0),
            Vec3::new(30.0, -90.0, 40.0),
        )
    });
    let mut kinds = Vec::new();
    for (row, height) in [(0, 36.0), (1, 14.0), (2, -30.0)] {
        for (at, kind) in KINDS.into_iter().enumerate() {
            // the middle ones reach into the fog: whether they have it depends on the sphere around them
            let place = Vec3::new(f32::from(row as u8) * 20.0, 80.0 - at as f32 * 40.0, height);
            kinds.push(refEntity_t {
                hModel: stage.register_model(kind)?,
                ..tube_at(stage, place)?
            });
        }
    }
    for (name, height) in [("above", 40.0), ("inside", -40.0)] {
        let view = stage.view(Vec3::new(-150.0, 0.0, height), 0.0);
        keep(stage, &format!("{name}-kinds"), &view, &kinds)?;
        keep(stage, name, &view, &all)?;
        stage.keep_view(&format!("{name}-polys"), &view, |e| {
            for step in 0..6u8 {
                let step = f32::from(step);
                let at = Vec3::new(step * 20.0 - 80.0, 90.0 - step * 36.0, step * 12.0 - 50.0);
                e.add_poly(round, &square(at, 16.0, [255, 255, 255, 200]), 4)?;
                e.add_poly(add, &square(at + Vec3::Z * 40.0, 16.0, [255; 4]), 4)?;
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// A polygon that faces the camera.
fn square(at: Vec3, size: f32, modulate: [u8; 4]) -> [polyVert_t; 4] {
    [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(y, z)| polyVert_t {
        xyz: (at + Vec3::new(0.0, y * size, z * size)).to_array(),
        st: [0.5 - y * 0.5, 0.5 - z * 0.5],
        modulate,
    })
}

fn polys(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let round = stage.register_shader("e/sprite")?;
    let add = stage.register_shader("e/add")?;
    let view = stage.view(Vec3::new(-120.0, 0.0, 0.0), 0.0);
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    stage.keep_view("one-call", &view, |e| {
        let two: Vec<_> = [
            square(at(0.0, 40.0, 0.0), 30.0, [255, 0, 0, 255]),
            square(at(10.0, 10.0, 10.0), 30.0, [0, 255, 0, 128]),
        ]
        .concat();
        e.add_poly(round, &two, 4)
    })?;
    stage.keep_view("order", &view, |e| {
        // no sorting by depth: later ones cover earlier ones
        e.add_poly(
            round,
            &square(at(-20.0, 0.0, 0.0), 30.0, [255, 0, 0, 255]),
            4,
        )?;
        e.add_poly(
            round,
            &square(at(20.0, -20.0, 10.0), 30.0, [0, 0, 255, 255]),
            4,
        )?;
        e.add_poly(
            add,
            &square(at(0.0, 20.0, 20.0), 30.0, [255, 255, 0, 255]),
            4,
        )?;
        e.add_entity(&sprite(at(10.0, 0.0, -20.0), 20.0, round))
    })?;
    stage.keep_view("pentagon", &view, |e| {
        let corners: Vec<polyVert_t> = (0..5u8)
            .map(|corner| {
                let (s, c) = (f32::from(corner) * -1.2566).sin_cos();
                polyVert_t {
                    xyz: [0.0, c * 40.0, s * 40.0],
                    st: [0.5 - c * 0.5, 0.5 - s * 0.5],
                    modulate: [255, 50 * corner, 255 - 50 * corner, 255],
                }
            })
            .collect();
        e.add_poly(round, &corners, 5)?;
        e.add_poly(add, &corners[..2], 2)?;
        e.add_poly(0, &corners, 5)
    })
}

fn order(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let round = stage.register_shader("e/sprite")?;
    let add = stage.register_shader("e/add")?;
    let view = stage.view(Vec3::new(-120.0, 0.0, 0.0), 0.0);
    let mut all = Vec::new();
    for at in 0..8u8 {
        let step = f32::from(at);
        // nearer ones before and after farther ones
        let x = if at % 3 == 0 { -step } else { step };
        let shader = if at % 2 == 0 { round } else { add };
        all.push(refEntity_t {
            rotation: step * 20.0,
            shaderRGBA: [255, 32 * at, 255 - 32 * at, 255],
            ..sprite(
                Vec3::new(x * 6.0, step * 14.0 - 50.0, step * 6.0),
                22.0,
                shader,
            )
        });
    }
    all.push(tube_at(stage, Vec3::new(0.0, 10.0, 0.0))?);
    keep(stage, "numbers", &view, &all)?;
    all.reverse();
    keep(stage, "reversed", &view, &all)?;
    let half = View {
        width: view.width / 2,
        ..view
    };
    let right = View {
        place: [view.width / 2, 40],
        height: view.height / 2,
        ..half
    };
    stage.keep("scenes", |e| {
        e.clear_scene()?;
        all.iter()
            .take(4)
            .try_for_each(|entity| e.add_entity(entity))?;
        e.add_light(Vec3::new(0.0, 30.0, 30.0), 150.0, Vec3::ONE)?;
        e.render_scene(&half)?;
        // what was drawn is gone, without being cleared
        all.iter()
            .skip(3)
            .try_for_each(|entity| e.add_entity(entity))?;
        e.render_scene(&right)?;
        e.add_entity(&all[0])?;
        e.clear_scene()?;
        e.render_scene(&View {
            place: [view.width / 2, 300],
            height: 100,
            flags: NO_WORLD_MODEL,
            ..half
        })
    })
}

fn values(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    let tint = stage.register_shader("e/entity")?;
    let inverse = stage.register_shader("e/inverse")?;
    let mut all = Vec::new();
    for (at, shader) in [tint, inverse, tint, inverse].into_iter().enumerate() {
        let y = 66.0 - at as f32 * 44.0;
        all.push(refEntity_t {
            customShader: shader,
            shaderRGBA: [250, 130, 40, 100],
            shaderTexCoord: [0.03, -0.07],
            shaderTime: at as f32 * 3.5,
            ..tube_at(stage, Vec3::new(0.0, y, 0.0))?
        });
    }
    keep(stage, "values", &view, &all)?;
    stage.set_time(777);
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    keep(stage, "later", &view, &all)
}

fn bad(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    let good = tube_at(stage, Vec3::ZERO)?;
    let nowhere = [0, 1, 2].map(|axis| {
        let mut entity = good;
        entity.origin[axis] = f32::NAN;
        entity
    });
    keep(
        stage,
        "nowhere",
        &view,
        &[nowhere[0], good, nowhere[1], nowhere[2]],
    )?;
    let mut raised = |label: &str, kind: i32| -> Result<(), Raised> {
        stage.start_map(MAP)?;
        stage.begin_frame(0)?;
        stage.clear_scene()?;
        let entity = refEntity_t {
            reType: kind,
            ..refEntity_t::default()
        };
        let level = |result: &Result<(), Raised>| match result {
            Ok(()) => "fine".to_string(),
            Err(raised) => format!("level {}", raised.level),
        };
        let added = stage.add_entity(&entity);
        let text = match &added {
            Ok(()) => format!("fine, then {}", level(&stage.render_scene(&view))),
            Err(_) => level(&added),
        };
        stage.fact(label, text);
        Ok(())
    };
    raised("type -1", -1)?;
    raised("type 8", 8)?;
    raised("type 7", 7)?;
    raised("polygon", 1)
}
