//! The table of functions for the engine, and those that other engines do not have.

use super::abi::refexport_t;
use super::{CONFIG, service};
use crate::abi::{QBool, Vec3C, glconfig_t, refEntity_t};
use crate::boundary::entry;
use crate::cvars;
use crate::engine;
use crate::exports::exports;
use crate::lifecycle::{self, Ending};
use crate::scene::{self, ShaderTime};
use crate::session::with_renderer;
use std::ffi::{c_float, c_int};

/// Result of every `GetRefAPI`; the engine copies it.
pub static EXPORTS: refexport_t = exports!(refexport_t {
    Shutdown: shutdown,
    BeginRegistration: begin_registration,
    AddRefEntityToScene: add_ref_entity,
    AddLinearLightToScene: add_linear_light,
    ThrottleBackend: throttle_backend,
    FinishBloom: nothing,
    SetColorMappings: nothing,
    CanMinimize: can_minimize,
    GetConfig: get_config,
    VertexLighting: vertex_lighting,
    SyncRender: nothing,
});

/// `re.Shutdown` with a `refShutdownCode_t`.
///
/// # Safety
/// That of [`lifecycle::shutdown`].
unsafe extern "C" fn shutdown(code: c_int) {
    entry(|| {
        lifecycle::end(match code {
            0 => Ending::KeepAll,
            1 => Ending::KeepWindow,
            2 => Ending::Close,
            _ => Ending::Leave,
        });
        Ok(())
    });
}

/// `re.BeginRegistration`.
///
/// # Safety
/// That of [`lifecycle::begin_registration`].
unsafe extern "C" fn begin_registration(out: *mut glconfig_t) {
    // SAFETY: null or room for a `glconfig_t` by this function's contract.
    unsafe { lifecycle::begin_registration(out) };
    if out.is_null() {
        return;
    }
    // SAFETY: not null, so `lifecycle::begin_registration` has filled it, unless it did not return. The engine reads and
    // writes the copy on this thread only.
    let config = unsafe {
        let config = out.read_unaligned();
        CONFIG.0.get().write(config);
        config
    };
    if let Some(scale) = service(|t| t.CL_SetScaling) {
        // SAFETY: numbers alone.
        unsafe { scale(1.0, config.vidWidth, config.vidHeight) }
    }
}

/// `re.AddRefEntityToScene` with the type of `shaderTime`.
///
/// # Safety
/// That of [`scene::add_ref_entity`].
unsafe extern "C" fn add_ref_entity(from: *const refEntity_t, milliseconds: QBool) {
    let time = if milliseconds == 0 {
        ShaderTime::Seconds
    } else {
        ShaderTime::Milliseconds
    };
    // SAFETY: null or an entity by this function's contract.
    unsafe { scene::add_entity(from, time) };
}

/// `re.AddLinearLightToScene`: a light along a line.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `start` and `end` must each be null, which counts as the world's
/// origin, or point at three floats. A radius that is not above 0, and places and colours that are not finite, add
/// nothing.
unsafe extern "C" fn add_linear_light(
    start: *const Vec3C,
    end: *const Vec3C,
    radius: c_float,
    r: c_float,
    g: c_float,
    b: c_float,
) {
    // SAFETY: null or three floats each by this function's contract.
    unsafe { scene::add_light_along(start, end, radius, glam::Vec3::new(r, g, b)) };
}

/// `re.ThrottleBackend`: the next frame need not be shown.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract); there are no arguments.
unsafe extern "C" fn throttle_backend() {
    entry(|| {
        with_renderer(|_, front| {
            front.skip_present = true;
            Ok(())
        })
    });
}

/// `re.FinishBloom`, `re.SetColorMappings`, `re.SyncRender`: what they are for is done by `EndFrame`.
///
/// # Safety
/// None: there are no arguments, and the call always returns.
unsafe extern "C" fn nothing() {}

/// `re.CanMinimize`: pictures can be taken while the window is minimized.
///
/// # Safety
/// None: there are no arguments, and the call always returns.
unsafe extern "C" fn can_minimize() -> QBool {
    1
}

/// `re.GetConfig`.
///
/// # Safety
/// None: there are no arguments, and the call always returns. The result is valid until the process ends.
unsafe extern "C" fn get_config() -> *const glconfig_t {
    CONFIG.0.get()
}

/// `re.VertexLighting`: whether `r_vertexLight` applies to what is registered next: to the game, not to menus. Other
/// engines say the same by a variable.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract); there are no pointers.
unsafe extern "C" fn vertex_lighting(allowed: QBool) {
    entry(|| {
        if let Some(engine) = engine::current() {
            engine.cvar_set(c"r_uifullscreen", if allowed == 0 { "1" } else { "0" });
        }
        with_renderer(|renderer, front| {
            if let Some(cvars) = &front.cvars {
                cvars::apply(cvars, &mut front.settings);
                renderer.set_settings(&front.settings);
            }
            Ok(())
        })
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary_tests::TestEngine;
    use std::ptr::{null, null_mut};

    #[test]
    fn functions_of_this_engine_alone_may_be_called_before_registration() {
        let Some(_engine) = TestEngine::start("quake3e") else {
            return;
        };
        let re = &EXPORTS;
        // SAFETY: pointers are null or our own; no call ends in the engine's error.
        unsafe {
            (re.BeginFrame)(0);
            (re.AddRefEntityToScene)(null(), 1);
            (re.AddLinearLightToScene)(null(), null(), f32::NAN, 1.0, 1.0, 1.0);
            (re.ThrottleBackend)();
            (re.FinishBloom)();
            (re.SetColorMappings)();
            (re.SyncRender)();
            (re.VertexLighting)(1);
            assert_eq!((re.CanMinimize)(), 1);
            assert!(!(re.GetConfig)().is_null());
            (re.EndFrame)(null_mut(), null_mut());
            for code in [0, 1, 2, 3, 7] {
                (re.Shutdown)(code);
            }
        }
    }
}
