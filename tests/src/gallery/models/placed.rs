//! Models put together by their tags, and the shadows of all kinds.

use glam::Vec3;

use super::super::Stage;
use super::super::board::MAP;
use super::{keep_kinds, place, turned};
use crate::engine::Raised;
use crate::engine::abi::refEntity_t;

/// Hangs an entity on a tag of another one.
fn hang(
    stage: &mut Stage,
    child: &mut refEntity_t,
    parent: &refEntity_t,
    tag: &str,
) -> Result<(), Raised> {
    let frames = [parent.oldframe, parent.frame];
    let found = stage.lerp_tag(parent.hModel, frames, 1.0 - parent.backlerp, tag)?;
    let found = found.unwrap_or_default();
    let [x, y, z] = parent.axis.map(Vec3::from);
    let turn = |v: [f32; 3]| x * v[0] + y * v[1] + z * v[2];
    child.origin = (Vec3::from(parent.origin) + turn(found.origin)).to_array();
    child.axis = found.axis.map(|axis| turn(axis).to_array());
    Ok(())
}

pub(super) fn player(stage: &mut Stage) -> Result<(), Raised> {
    const NO_WORLD_MODEL: i32 = 1;
    stage.start_map(MAP)?;
    let mut all = Vec::new();
    for (name, at) in [("sarge", -26.0), ("major", 26.0)] {
        let mut part = |part: &str, frame| -> Result<refEntity_t, Raised> {
            let folder = format!("models/players/{name}");
            Ok(refEntity_t {
                hModel: stage.register_model(&format!("{folder}/{part}.md3"))?,
                customSkin: stage.register_skin(&format!("{folder}/{part}_default.skin"))?,
                frame: frame + 1,
                oldframe: frame,
                backlerp: 0.3,
                ..refEntity_t::default()
            })
        };
        let (mut lower, mut upper, mut head) =
            (part("lower", 95)?, part("upper", 130)?, part("head", -1)?);
        head.oldframe = 0;
        lower.axis = turned(150.0);
        place(&mut lower, Vec3::new(0.0, at, 0.0));
        hang(stage, &mut upper, &lower, "tag_torso")?;
        hang(stage, &mut head, &upper, "tag_head")?;
        let mut weapon = refEntity_t {
            hModel: stage.register_model("models/weapons2/rocketl/rocketl.md3")?,
            ..refEntity_t::default()
        };
        hang(stage, &mut weapon, &upper, "tag_weapon")?;
        all.extend([lower, upper, head, weapon]);
    }
    let mut view = stage.view(Vec3::new(-60.0, 0.0, 8.0), 0.0);
    for (name, flags) in [("world", 0), ("no-world", NO_WORLD_MODEL)] {
        view.flags = flags;
        stage.keep_entities(name, &view, &all)?;
    }
    Ok(())
}

pub(super) fn shadows(stage: &mut Stage) -> Result<(), Raised> {
    const THIRD_PERSON: i32 = 0x2;
    const NO_SHADOW: i32 = 0x40;
    const SHADOW_PLANE: i32 = 0x100;
    stage.start_map(MAP)?;
    let mut view = stage.view(Vec3::new(-130.0, 0.0, 60.0), 0.0);
    view.angles.x = 30.0;
    for (name, renderfx) in [
        ("plain", 0),
        ("plane", SHADOW_PLANE),
        ("plane-none", SHADOW_PLANE | NO_SHADOW),
        ("plane-third", SHADOW_PLANE | THIRD_PERSON),
    ] {
        let entity = refEntity_t {
            frame: 1,
            oldframe: 0,
            backlerp: 0.3,
            axis: turned(25.0),
            renderfx,
            shadowPlane: -40.0,
            ..refEntity_t::default()
        };
        keep_kinds(stage, name, &view, entity, |_| true)?;
    }
    Ok(())
}
