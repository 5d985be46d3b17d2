//! Transfers console variables to the renderer's settings.

use super::{Cvars, Registered, number};
use crate::engine::Engine;
use renderer_vk::Settings;
use renderer_vk::settings::{Given, Kind, Reading, SettingError};

/// Transfers the value of a variable.
fn read(
    engine: Engine,
    registered: &Registered,
    settings: &mut Settings,
) -> Result<(), SettingError> {
    let Some(variable) = registered.variable else {
        return registered.row.put(settings, &Given::parse(""));
    };
    let text = match registered.row.spec.kind {
        Kind::Name(_) => engine.cvar_string(variable),
        _ => String::new(),
    };
    let given = Given {
        integer: engine.cvar_as_integer(variable),
        number: number(engine, variable),
        text: &text,
    };
    registered.row.put(settings, &given)
}

/// Transfers the settings that are read at the renderer's start. A latched one with an unknown name gets its default.
pub fn apply_at_registration(cvars: &Cvars, settings: &mut Settings) {
    for registered in &cvars.settings {
        let row = registered.row;
        if row.reading == Reading::Frame {
            continue;
        }
        let unknown = read(cvars.engine, registered, settings).err();
        if let Some(error) = unknown.filter(|_| row.reading == Reading::Start) {
            log::warn!("{error}; {} is used", row.spec.default);
            row.reset(settings);
        }
    }
}

/// Transfers the settings that are read each frame, and those whose variable has changed. Cheap: the values are in the
/// engine's memory, and text is copied only after a change.
pub fn apply(cvars: &Cvars, settings: &mut Settings) {
    let engine = cvars.engine;
    let modified = |r: &&Registered| r.with.is_some_and(|v| engine.cvar_modified(v));
    for registered in &cvars.settings {
        let due = registered.row.reading == Reading::Frame || modified(&registered);
        if due && read(engine, registered, settings).is_err() {
            // only r_textureMode; the message is that of the engine's own renderer
            log::info!("bad filter name");
        }
    }
    for variable in cvars
        .settings
        .iter()
        .filter(modified)
        .filter_map(|r| r.with)
    {
        engine.cvar_seen(variable);
    }
}

/// Writes limited values back to variables that menus show and that the engine does not limit: `r_gamma` and
/// `r_intensity`.
pub fn write_back_limits(cvars: &Cvars) {
    for Registered { row, variable, .. } in &cvars.settings {
        let (Some(variable), Some(range)) = (variable, row.spec.range) else {
            continue; // the engine did not take it, or it has no limits
        };
        let value = number(cvars.engine, *variable);
        let limit = value.clamp(range.min, range.max);
        if !range.by_engine && limit != value {
            cvars.set(&row.spec, &limit.to_string());
        }
    }
}
