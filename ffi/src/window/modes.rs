//! Video modes: sizes by `r_mode`, and the list of sizes for menus.

/// A requested size, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Width over height of the display; pixels need not be square.
    pub aspect: f32,
}

/// The sizes of `r_mode` 0 to 11 and their names in `modelist`.
pub const MODES: [(&str, u32, u32); 12] = [
    ("320x240", 320, 240),
    ("400x300", 400, 300),
    ("512x384", 512, 384),
    ("640x480", 640, 480),
    ("800x600", 800, 600),
    ("960x720", 960, 720),
    ("1024x768", 1024, 768),
    ("1152x864", 1152, 864),
    ("1280x1024", 1280, 1024),
    ("1600x1200", 1600, 1200),
    ("2048x1536", 2048, 1536),
    ("856x480 (wide)", 856, 480),
];

/// The mode of the last attempt.
pub const SAFE_MODE: i32 = 3;

/// `r_mode` for the desktop's size.
pub const DESKTOP_MODE: i32 = -2;

/// Maximum side of a requested window, pixels; the renderer checks the device's own limit.
const MAX_SIDE: u32 = 16384;

fn mode(width: u32, height: u32, pixel_aspect: f32) -> Option<Mode> {
    let usable = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    usable.then(|| Mode {
        width,
        height,
        aspect: width as f32 / (height as f32 * pixel_aspect),
    })
}

/// The size in `r_custom*`.
#[derive(Clone, Copy, Debug)]
pub struct Custom {
    /// `r_customwidth`.
    pub width: i32,
    /// `r_customheight`.
    pub height: i32,
    /// `r_customPixelAspect`.
    pub pixel_aspect: f32,
}

/// The size of a mode; `None` for an unknown number, an invalid size, or an unknown desktop size.
pub fn resolve(number: i32, custom: Custom, desktop: Option<(u32, u32)>) -> Option<Mode> {
    match number {
        DESKTOP_MODE => desktop.and_then(|(width, height)| mode(width, height, 1.0)),
        -1 => {
            let aspect = if custom.pixel_aspect > 0.0 {
                custom.pixel_aspect
            } else {
                1.0
            };
            mode(
                u32::try_from(custom.width).ok()?,
                u32::try_from(custom.height).ok()?,
                aspect,
            )
        }
        _ => {
            let &(_, width, height) = MODES.get(usize::try_from(number).ok()?)?;
            mode(width, height, 1.0)
        }
    }
}

/// Value of `r_availableModes`: distinct sizes, those with the desktop's aspect ratio first, then in ascending order,
/// up to the maximum length of a variable.
pub fn available_list(mut sizes: Vec<(u32, u32)>, desktop: Option<(u32, u32)>) -> String {
    // Maximum length that the engine's menus copy.
    const LIMIT: usize = 1023;
    let shape = |(width, height): (u32, u32)| width as f32 / height as f32;
    let wanted = desktop
        .filter(|&(_, height)| height > 0)
        .map_or(4.0 / 3.0, shape);
    sizes.retain(|&(width, height)| width > 0 && height > 0);
    sizes.sort_by(|&a, &b| {
        let distance = |size| (shape(size) - wanted).abs();
        let area = |(width, height): (u32, u32)| u64::from(width) * u64::from(height);
        distance(a)
            .total_cmp(&distance(b))
            .then(area(a).cmp(&area(b)))
            .then(a.cmp(&b))
    });
    sizes.dedup();
    let mut list = String::new();
    for (width, height) in sizes {
        let entry = format!("{width}x{height}");
        if list.len() + entry.len() + 1 > LIMIT {
            break;
        }
        if !list.is_empty() {
            list.push(' ');
        }
        list.push_str(&entry);
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUSTOM: Custom = Custom {
        width: 1600,
        height: 1024,
        pixel_aspect: 1.0,
    };

    #[test]
    fn numbered_modes_are_the_engines() {
        let size = |number| resolve(number, CUSTOM, None).map(|m| (m.width, m.height));
        assert_eq!(size(3), Some((640, 480)));
        assert_eq!(size(6), Some((1024, 768)));
        assert_eq!(size(11), Some((856, 480)));
        assert_eq!(size(12), None);
        assert_eq!(size(-3), None);
        assert_eq!(size(-1), Some((1600, 1024)));
        assert_eq!(size(-2), None);
        assert_eq!(
            resolve(-2, CUSTOM, Some((1920, 1080))).map(|m| (m.width, m.height)),
            Some((1920, 1080))
        );
    }

    #[test]
    fn odd_custom_sizes_are_refused() {
        for (width, height) in [(0, 480), (640, -1), (100_000, 480)] {
            assert_eq!(
                resolve(
                    -1,
                    Custom {
                        width,
                        height,
                        pixel_aspect: 1.0
                    },
                    None
                ),
                None
            );
        }
        let stretched = resolve(
            -1,
            Custom {
                width: 640,
                height: 480,
                pixel_aspect: 2.0,
            },
            None,
        )
        .unwrap();
        assert!((stretched.aspect - 2.0 / 3.0).abs() < 1e-6);
        let zero = resolve(
            -1,
            Custom {
                width: 640,
                height: 480,
                pixel_aspect: 0.0,
            },
            None,
        )
        .unwrap();
        assert!((zero.aspect - 4.0 / 3.0).abs() < 1e-6);
    }

    #[test]
    fn the_list_is_sorted_by_shape_then_area() {
        let sizes = vec![
            (640, 480),
            (1920, 1080),
            (1280, 720),
            (1920, 1080),
            (1280, 1024),
            (0, 5),
        ];
        assert_eq!(
            available_list(sizes, Some((3840, 2160))),
            "1280x720 1920x1080 640x480 1280x1024"
        );
    }

    #[test]
    fn the_list_fits_into_a_cvar() {
        let sizes = (1..2000).map(|i| (1000 + i, 1000 + i)).collect();
        let list = available_list(sizes, None);
        assert!(list.len() < 1024 && list.len() > 900);
        assert!(
            list.split(' ')
                .all(|entry| entry.contains('x') && !entry.ends_with('x'))
        );
    }
}
