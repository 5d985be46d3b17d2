//! Format and encoding of a window's images.

use ash::vk;

use super::image::Format;

/// Encoding of a window's images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// sRGB, 8 bits a channel.
    Srgb,
    /// Rec. 2020 primaries and SMPTE ST 2084, 10 bits a channel.
    Hdr10,
    /// Linear Rec. 709 in half floats; 1 is 80 cd/m².
    ScRgb,
}

impl Encoding {
    /// Format of such images, of a window or not.
    pub fn format(self) -> Format {
        match self {
            Self::Srgb => Format::Rgba8,
            Self::Hdr10 => Format::Rgb10A2,
            Self::ScRgb => Format::Rgba16F,
        }
    }

    fn color_space(self) -> vk::ColorSpaceKHR {
        match self {
            Self::Srgb => vk::ColorSpaceKHR::SRGB_NONLINEAR,
            Self::Hdr10 => vk::ColorSpaceKHR::HDR10_ST2084_EXT,
            Self::ScRgb => vk::ColorSpaceKHR::EXTENDED_SRGB_LINEAR_EXT,
        }
    }
}

/// Format of a window's images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WindowFormat {
    pub texels: Format,
    pub encoding: Encoding,
    pub color_space: vk::ColorSpaceKHR,
}

impl Default for WindowFormat {
    fn default() -> Self {
        Self {
            texels: Format::Bgra8,
            encoding: Encoding::Srgb,
            color_space: Encoding::Srgb.color_space(),
        }
    }
}

impl WindowFormat {
    /// The first wanted encoding of more than white that is offered, otherwise 8 bits a channel without conversion.
    pub fn choose(offered: &[vk::SurfaceFormatKHR], wide: &[Encoding]) -> Option<Self> {
        let wide = wide.iter().find_map(|&encoding| {
            let (texels, color_space) = (encoding.format(), encoding.color_space());
            let same =
                |f: &vk::SurfaceFormatKHR| f.format == texels.vk() && f.color_space == color_space;
            offered.iter().any(same).then_some(Self {
                texels,
                encoding,
                color_space,
            })
        });
        let plain = || {
            let encoding = Encoding::Srgb;
            [Format::Bgra8, Format::Rgba8]
                .into_iter()
                .find_map(|texels| {
                    let of_format = offered.iter().filter(|f| f.format == texels.vk());
                    let nearest =
                        of_format.min_by_key(|f| f.color_space != encoding.color_space())?;
                    Some(Self {
                        texels,
                        encoding,
                        color_space: nearest.color_space,
                    })
                })
        };
        wide.or_else(plain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_wanted_encoding_that_is_offered_is_chosen() {
        let offer = |format: Format, color_space| vk::SurfaceFormatKHR {
            format: format.vk(),
            color_space,
        };
        let plain = offer(Format::Bgra8, vk::ColorSpaceKHR::SRGB_NONLINEAR);
        let hdr10 = offer(Format::Rgb10A2, vk::ColorSpaceKHR::HDR10_ST2084_EXT);
        let sc_rgb = offer(Format::Rgba16F, vk::ColorSpaceKHR::EXTENDED_SRGB_LINEAR_EXT);
        // the format alone is not enough
        let deep = offer(Format::Rgb10A2, vk::ColorSpaceKHR::SRGB_NONLINEAR);
        let choose = |offered: &[_], wide: &[Encoding]| {
            let chosen = WindowFormat::choose(offered, wide);
            chosen.map(|f| (f.texels, f.encoding, f.color_space))
        };
        let both = [Encoding::Hdr10, Encoding::ScRgb];
        let srgb = Some((Format::Bgra8, Encoding::Srgb, plain.color_space));
        assert_eq!(choose(&[plain, hdr10, sc_rgb], &[]), srgb);
        assert_eq!(choose(&[plain, deep], &both), srgb);
        assert_eq!(
            choose(&[plain, sc_rgb, hdr10], &both),
            Some((Format::Rgb10A2, Encoding::Hdr10, hdr10.color_space))
        );
        assert_eq!(
            choose(&[plain, sc_rgb], &both),
            Some((Format::Rgba16F, Encoding::ScRgb, sc_rgb.color_space))
        );
        assert_eq!(choose(&[deep], &both), None);
        // a window without sRGB is shown in the colour space that it has
        let other = offer(Format::Bgra8, vk::ColorSpaceKHR::DISPLAY_P3_NONLINEAR_EXT);
        let only = Some((Format::Bgra8, Encoding::Srgb, other.color_space));
        assert_eq!(choose(&[other], &[]), only);
        assert_eq!(choose(&[other, plain], &[]), srgb);
    }
}
