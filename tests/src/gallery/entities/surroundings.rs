//! Light and fog on entities, and brush models.

use glam::Vec3;

use super::super::Stage;
use super::super::board::MAP;
use super::super::models::{KINDS, turned};
use super::{
    CROSSHAIR, DEPTH_HACK, HYPERSPACE, LIGHTING_ORIGIN, NO_WORLD_MODEL, RAIL_CORE, THIRD_PERSON,
    line, sprite, square, tube_at,
};
use crate::engine::Raised;
use crate::engine::abi::refEntity_t;

pub(super) fn light(stage: &mut Stage) -> Result<(), Raised> {
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
    stage.keep_entities("grid", &view, &row)?;
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
    stage.keep_entities("elsewhere", &view, &elsewhere)?;
    let outside: Vec<_> = row
        .iter()
        .map(|entity| refEntity_t {
            renderfx: LIGHTING_ORIGIN,
            lightingOrigin: [9000.0, -9000.5, 4000.3],
            ..*entity
        })
        .collect();
    stage.keep_entities("outside", &view, &outside)?;
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
    stage.keep_entities("scaled", &view, &row)?;
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

pub(super) fn brushes(stage: &mut Stage) -> Result<(), Raised> {
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
    stage.keep_entities("placed", &view, &all)?;
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
        stage.keep_entities(name, &view, &flagged)?;
    }
    Ok(())
}

pub(super) fn fog(stage: &mut Stage) -> Result<(), Raised> {
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
        stage.keep_entities(&format!("{name}-kinds"), &view, &kinds)?;
        stage.keep_entities(name, &view, &all)?;
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
