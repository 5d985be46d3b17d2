//! Polygons, the order of what is drawn, values for materials, and what is no entity at all.

use glam::Vec3;

use super::super::Stage;
use super::super::board::MAP;
use super::{NO_WORLD_MODEL, sprite, square, tube_at};
use crate::engine::abi::{polyVert_t, refEntity_t};
use crate::engine::{Raised, View};

pub(super) fn polys(stage: &mut Stage) -> Result<(), Raised> {
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

pub(super) fn order(stage: &mut Stage) -> Result<(), Raised> {
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
    stage.keep_entities("numbers", &view, &all)?;
    all.reverse();
    stage.keep_entities("reversed", &view, &all)?;
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

pub(super) fn values(stage: &mut Stage) -> Result<(), Raised> {
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
    stage.keep_entities("values", &view, &all)?;
    stage.set_time(777);
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    stage.keep_entities("later", &view, &all)
}

pub(super) fn bad(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    let good = tube_at(stage, Vec3::ZERO)?;
    let nowhere = [0, 1, 2].map(|axis| {
        let mut entity = good;
        entity.origin[axis] = f32::NAN;
        entity
    });
    stage.keep_entities(
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
