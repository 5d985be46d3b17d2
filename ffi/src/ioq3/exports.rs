//! The table of functions for the engine.

use super::abi::refexport_t;
use crate::exports::exports;
use crate::{lifecycle, scene};

/// Result of every `GetRefAPI`; the engine copies it.
pub static EXPORTS: refexport_t = exports!(refexport_t {
    Shutdown: lifecycle::shutdown,
    BeginRegistration: lifecycle::begin_registration,
    AddRefEntityToScene: scene::add_ref_entity,
});

/// Calls every function of the table with invalid arguments.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract).
#[cfg(test)]
pub unsafe fn call_everything() {
    use std::ptr::{null, null_mut};
    let re = &EXPORTS;
    let pixels = [0u8; 4];
    let mut buffer = [1; 4];
    // SAFETY: pointers are null, C strings, or our own memory of the stated size, which outlives the call. The frame
    // owns nothing with a destructor, in case a call ends in the engine's error.
    unsafe {
        (re.RegisterModel)(c"a".as_ptr());
        (re.RegisterSkin)(null());
        (re.RegisterShader)(c"".as_ptr());
        (re.RegisterShaderNoMip)(c"a".as_ptr());
        (re.LoadWorld)(c"maps/a.bsp".as_ptr());
        (re.SetWorldVisData)(null());
        (re.EndRegistration)();
        (re.ClearScene)();
        (re.AddRefEntityToScene)(null());
        (re.AddPolyToScene)(1, -1, null(), 5);
        (re.AddPolyToScene)(0, 3, null(), 1);
        assert_eq!(
            (re.LightForPoint)(null(), null_mut(), null_mut(), null_mut()),
            0
        );
        (re.AddLightToScene)(null(), f32::NAN, 1.0, 1.0, 1.0);
        (re.AddAdditiveLightToScene)(null(), 100.0, 1.0, 1.0, 1.0);
        (re.RenderScene)(null());
        (re.SetColor)(null());
        (re.DrawStretchPic)(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0);
        (re.DrawStretchRaw)(0, 0, 1, 1, 1, 1, pixels.as_ptr(), 0, 1);
        (re.UploadCinematic)(1, 1, -1, 1, pixels.as_ptr(), -3, 1);
        (re.BeginFrame)(0);
        (re.EndFrame)(null_mut(), null_mut());
        assert_eq!(
            (re.MarkFragments)(3, null(), null(), 1, null_mut(), 1, null_mut()),
            0
        );
        assert_eq!((re.LerpTag)(null_mut(), 1, 0, 0, 0.0, c"tag".as_ptr()), 0);
        (re.ModelBounds)(1, null_mut(), null_mut());
        (re.RegisterFont)(null(), 12, null_mut());
        (re.RemapShader)(null(), null(), null());
        assert_eq!((re.GetEntityToken)(buffer.as_mut_ptr(), 4), 0);
        assert_eq!((re.inPVS)(null(), null()), 0);
        (re.TakeVideoFrame)(-1, 4, null_mut(), null_mut(), 1);
        (re.Shutdown)(0);
        (re.Shutdown)(1);
        (re.Shutdown)(1);
    }
    assert_eq!(buffer[0], 0);
}
