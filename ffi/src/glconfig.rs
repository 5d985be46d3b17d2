//! Properties of the renderer for the engine, its menus and the game (`glconfig_t`).

use crate::abi::{QBool, glconfig_t};
use crate::config::DeviceStrings;
use renderer_vk::DeviceInfo;
use std::ffi::c_char;

/// Properties besides those of the device.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    /// Pixels.
    pub size: (u32, u32),
    /// Width over height of the display.
    pub aspect: f32,
    /// Hz; 0: unknown.
    pub refresh_rate: i32,
    /// Fills the screen.
    pub fullscreen: bool,
    /// `r_gamma` applies to the finished picture, not to textures.
    pub gamma: bool,
}

/// Copies text into a C array, truncated, with a terminating zero.
fn put<const N: usize>(to: &mut [c_char; N], text: &str) {
    let bytes = text
        .bytes()
        .filter(|&byte| byte != 0)
        .take(N - 1)
        .chain(std::iter::repeat(0));
    for (to, byte) in to.iter_mut().zip(bytes) {
        *to = byte as c_char;
    }
}

/// The whole structure.
pub fn glconfig(info: &DeviceInfo, screen: Screen) -> glconfig_t {
    let strings = DeviceStrings::new(info);
    let pixels = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
    let mut config = glconfig_t {
        renderer_string: [0; 1024],
        vendor_string: [0; 1024],
        version_string: [0; 1024],
        extensions_string: [0; 8192],
        maxTextureSize: pixels(info.max_image_size),
        numTextureUnits: 32,
        colorBits: 32,
        depthBits: 24,
        // With 8 bits the game offers shadow volumes.
        stencilBits: 8,
        driverType: 0,
        // With any other value game code omits effects.
        hardwareType: 0,
        deviceSupportsGamma: screen.gamma.into(),
        textureCompression: 0,
        textureEnvAddAvailable: true.into(),
        vidWidth: pixels(screen.size.0),
        vidHeight: pixels(screen.size.1),
        windowAspect: screen.aspect,
        displayFrequency: screen.refresh_rate,
        isFullscreen: screen.fullscreen.into(),
        // Otherwise the engine would send every frame twice.
        stereoEnabled: QBool::from(false),
        smpActive: QBool::from(false),
    };
    put(&mut config.renderer_string, &strings.renderer);
    put(&mut config.vendor_string, &strings.vendor);
    put(&mut config.version_string, &strings.version);
    put(&mut config.extensions_string, &strings.extensions);
    config
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_cut_and_always_ended() {
        let mut to = [1 as c_char; 4];
        put(&mut to, "abcdef");
        assert_eq!(to.map(|c| c as u8), *b"abc\0");
        put(&mut to, "a");
        assert_eq!(to.map(|c| c as u8), *b"a\0\0\0");
    }
}
