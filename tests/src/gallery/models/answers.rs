//! Tags and bounds of every kind of model.

use glam::Vec3;

use super::super::board::MAP;
use super::super::{Stage, tube};
use super::KINDS;
use crate::engine::Raised;

pub(super) fn answers(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let others = [
        "m/rigid.iqm",
        "m/joint",
        "m/bone.md3",
        "m/broken.iqm",
        "m/none.md3",
        "*0",
    ];
    for kind in KINDS.into_iter().chain(others) {
        let model = stage.register_model(kind)?;
        stage.fact(&format!("{kind} found"), model > 0);
        let (mins, maxs) = stage.model_bounds(model)?;
        let line = |v: Vec3| format!("{} {} {}", v.x, v.y, v.z);
        stage.fact(
            &format!("{kind} bounds"),
            format!("{} {}", line(mins), line(maxs)),
        );
        // frames beyond the last are read past the end of its poses by the reference, where a model has joints
        let beyond = if kind.ends_with("iqm") || kind == "m/joint" {
            2
        } else {
            9
        };
        for (start, end, frac) in [(0, 0, 0.0), (0, 1, 0.25), (1, 2, 0.5), (2, beyond, 1.0)] {
            for tag in [tube::TAG, "root", "TAG_TOP", "none"] {
                let found = stage.lerp_tag(model, [start, end], frac, tag)?;
                let text = found.map_or_else(
                    || "none".to_string(),
                    |at| {
                        let axis = at.axis.map(|a| line(a.into()));
                        format!("{} {}", line(at.origin.into()), axis.join(" "))
                    },
                );
                stage.fact(&format!("{kind} {tag} {start} {end} {frac}"), text);
            }
        }
    }
    Ok(())
}
