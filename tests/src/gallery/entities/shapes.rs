//! What entities of every type look like, and what their flags do.

use glam::Vec3;

use super::super::Stage;
use super::super::board::MAP;
use super::super::models::turned;
use super::{
    BEAM, CROSSHAIR, DEPTH_HACK, FIRST_PERSON, LIGHTNING, MIN_LIGHT, PORTAL_SURFACE, RAIL_CORE,
    RAIL_RINGS, THIRD_PERSON, askew, line, sprite, tube_at,
};
use crate::engine::Raised;
use crate::engine::abi::refEntity_t;

pub(super) fn shapes(stage: &mut Stage) -> Result<(), Raised> {
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
    stage.keep_entities("sprites", &view, &sprites)?;
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
    stage.keep_entities("beams", &view, &beams)?;
    for (name, kind) in [
        ("rail-core", RAIL_CORE),
        ("rail-rings", RAIL_RINGS),
        ("lightning", LIGHTNING),
    ] {
        let entity = refEntity_t {
            customShader: add,
            ..line(kind, left, right)
        };
        stage.keep_entities(name, &view, &[entity])?;
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
    stage.keep_entities("axes", &view, &axes)
}

pub(super) fn rails(stage: &mut Stage) -> Result<(), Raised> {
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
        stage.keep_entities(name, &view, &all)?;
    }
    // from behind its start, so that some of it lies behind the camera
    let view = stage.view(Vec3::new(-20.0, 100.0, -30.0), -80.0);
    let all = [RAIL_CORE, RAIL_RINGS, LIGHTNING].map(|kind| refEntity_t {
        customShader: add,
        ..line(kind, left, right)
    });
    stage.keep_entities("along", &view, &all)
}

pub(super) fn flags(stage: &mut Stage) -> Result<(), Raised> {
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
        stage.keep_entities(name, &view, &scene)?;
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
        stage.keep_entities(name, &view, &scene)?;
    }
    Ok(())
}
