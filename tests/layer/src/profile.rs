//! Devices that nobody has here, as files of text. A line is a key and its values; what a file does not say is as the
//! driver says it, and `#` begins a comment. Names of features, limits, extensions and formats are Vulkan's.
//!
//! ```text
//! name AMD Radeon RX 580                 the device's name
//! type integrated                        discrete, integrated, virtual or cpu
//! vendor 0x1002                          PCI number
//! api 1.2                                Vulkan's version
//! driver radv Mesa 22.3                  text of the driver's version
//! hide VK_KHR_ray_query                  an extension that the device lacks; more than one may follow
//! lacks shaderFloat16                    a feature that it lacks; more than one may follow
//! limit maxImageDimension2D 8192         a limit
//! heap 8192 device                       MiB, and whether it is the device's own memory
//! memory 0 device host coherent cached   the heap and the properties of a memory type
//! queues graphics compute transfer 64    a queue family and the valid bits of its timestamps
//! format D24_UNORM_S8_UINT none          a format without support,
//! format R8_UNORM STORAGE_IMAGE          or without some features of optimal tiling
//! ```
//! Lines with the key `refused` are for the test: they name what the renderer misses on the device.

use std::sync::LazyLock;

use ash::vk;

/// One device.
#[derive(Default)]
pub struct Profile {
    pub name: Option<String>,
    pub kind: Option<vk::PhysicalDeviceType>,
    pub vendor: Option<u32>,
    pub api: Option<u32>,
    pub driver: Option<String>,
    pub hidden: Vec<String>,
    /// In the spelling of `ash`.
    pub lacks: Vec<String>,
    /// In the spelling of `ash`.
    pub limits: Vec<(String, f64)>,
    pub heaps: Vec<vk::MemoryHeap>,
    pub memory: Vec<vk::MemoryType>,
    pub queues: Vec<(vk::QueueFlags, u32)>,
    /// A format and the features that it lacks.
    pub formats: Vec<(String, vk::FormatFeatureFlags)>,
}

/// The devices of `RELIGHT_LAYER_PROFILE`, or the line that is wrong.
pub static PROFILES: LazyLock<Result<Vec<Profile>, String>> = LazyLock::new(|| {
    let Some(files) = std::env::var_os("RELIGHT_LAYER_PROFILE") else {
        return Ok(Vec::new());
    };
    let read = |path: std::path::PathBuf| {
        let text = std::fs::read_to_string(&path).map_err(|e| e.to_string());
        text.and_then(|text| parse(&text))
            .map_err(|e| format!("{}: {e}", path.display()))
    };
    std::env::split_paths(&files).map(read).collect()
});

/// The devices; none if the variable is absent or wrong.
pub fn profiles() -> &'static [Profile] {
    PROFILES.as_deref().unwrap_or_default()
}

fn parse(text: &str) -> Result<Profile, String> {
    let mut profile = Profile::default();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if let Some((key, values)) = line.split_once(' ') {
            read(&mut profile, key, values.trim())
                .ok_or_else(|| format!("cannot read \"{line}\""))?;
        }
    }
    Ok(profile)
}

fn read(profile: &mut Profile, key: &str, values: &str) -> Option<()> {
    let words: Vec<&str> = values.split_whitespace().collect();
    match (key, &words[..]) {
        ("name", _) => profile.name = Some(values.to_owned()),
        ("driver", _) => profile.driver = Some(values.to_owned()),
        ("refused", _) => {}
        ("type", [kind]) => profile.kind = Some(device_type(kind)?),
        ("vendor", [number]) => {
            let digits = number.strip_prefix("0x")?;
            profile.vendor = Some(u32::from_str_radix(digits, 16).ok()?);
        }
        ("api", [version]) => {
            let (major, minor) = version.split_once('.')?;
            let version = vk::make_api_version(0, major.parse().ok()?, minor.parse().ok()?, 0);
            profile.api = Some(version);
        }
        ("hide", names) => profile.hidden.extend(names.iter().map(|n| n.to_string())),
        ("lacks", names) => profile
            .lacks
            .extend(names.iter().map(|n| spelled_by_ash(n))),
        ("limit", [name, value]) => {
            profile
                .limits
                .push((spelled_by_ash(name), value.parse().ok()?));
        }
        ("heap", [size, flags @ ..]) => profile.heaps.push(vk::MemoryHeap {
            size: size.parse::<u64>().ok()?.checked_mul(1 << 20)?,
            flags: match flags {
                ["device"] => vk::MemoryHeapFlags::DEVICE_LOCAL,
                _ => vk::MemoryHeapFlags::empty(),
            },
        }),
        ("memory", [heap, flags @ ..]) => {
            let mut kind = vk::MemoryType {
                heap_index: heap.parse().ok()?,
                ..Default::default()
            };
            for flag in flags {
                kind.property_flags |= match *flag {
                    "device" => vk::MemoryPropertyFlags::DEVICE_LOCAL,
                    "host" => vk::MemoryPropertyFlags::HOST_VISIBLE,
                    "coherent" => vk::MemoryPropertyFlags::HOST_COHERENT,
                    "cached" => vk::MemoryPropertyFlags::HOST_CACHED,
                    _ => return None,
                };
            }
            profile.memory.push(kind);
        }
        ("queues", [flags @ .., bits]) => {
            let mut family = vk::QueueFlags::empty();
            for flag in flags {
                family |= match *flag {
                    "graphics" => vk::QueueFlags::GRAPHICS,
                    "compute" => vk::QueueFlags::COMPUTE,
                    "transfer" => vk::QueueFlags::TRANSFER,
                    _ => return None,
                };
            }
            profile.queues.push((family, bits.parse().ok()?));
        }
        ("format", [name, lacks @ ..]) => {
            let mut flags = vk::FormatFeatureFlags::empty();
            for flag in lacks {
                flags |= match *flag {
                    "none" => !vk::FormatFeatureFlags::empty(),
                    "STORAGE_IMAGE" => vk::FormatFeatureFlags::STORAGE_IMAGE,
                    "COLOR_ATTACHMENT" => vk::FormatFeatureFlags::COLOR_ATTACHMENT,
                    "COLOR_ATTACHMENT_BLEND" => vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND,
                    "SAMPLED_IMAGE_FILTER_LINEAR" => {
                        vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR
                    }
                    _ => return None,
                };
            }
            profile.formats.push(((*name).to_owned(), flags));
        }
        _ => return None,
    }
    Some(())
}

fn device_type(name: &str) -> Option<vk::PhysicalDeviceType> {
    Some(match name {
        "discrete" => vk::PhysicalDeviceType::DISCRETE_GPU,
        "integrated" => vk::PhysicalDeviceType::INTEGRATED_GPU,
        "virtual" => vk::PhysicalDeviceType::VIRTUAL_GPU,
        "cpu" => vk::PhysicalDeviceType::CPU,
        _ => return None,
    })
}

/// `maxImageDimension2D` as `max_image_dimension2_d`.
fn spelled_by_ash(name: &str) -> String {
    let mut spelled = String::new();
    let mut last_is_upper = true;
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !last_is_upper {
            spelled.push('_');
        }
        last_is_upper = letter.is_ascii_uppercase();
        spelled.push(letter.to_ascii_lowercase());
    }
    spelled
}

impl Profile {
    /// Features that the device lacks of a format.
    pub fn format_lacks(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        let name = format!("{format:?}");
        let found = self.formats.iter().find(|(f, _)| *f == name);
        found.map_or(vk::FormatFeatureFlags::empty(), |(_, lacks)| *lacks)
    }
}
