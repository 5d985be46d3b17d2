//! Names of the device for the engine, its menus and the game.

use renderer_vk::DeviceInfo;

/// Names of the device, as menus show them.
pub struct DeviceStrings {
    /// Vendor name.
    pub vendor: String,
    /// Device name.
    pub renderer: String,
    /// Vulkan version and driver version.
    pub version: String,
    /// Words separated by single spaces, never empty, because menus split it.
    pub extensions: String,
}

/// Vendors by their PCI or Khronos number.
fn vendor_name(id: u32) -> String {
    match id {
        0x1002 => "AMD".into(),
        0x1010 => "Imagination Technologies".into(),
        0x106B => "Apple".into(),
        0x10DE => "NVIDIA Corporation".into(),
        0x13B5 => "Arm".into(),
        0x14E4 => "Broadcom".into(),
        0x5143 => "Qualcomm".into(),
        0x8086 => "Intel".into(),
        0x10005 => "Mesa".into(),
        other => format!("vendor {other:#06x}"),
    }
}

impl DeviceStrings {
    /// The names of a device.
    pub fn new(info: &DeviceInfo) -> Self {
        let (major, minor, patch) = info.api_version;
        Self {
            vendor: vendor_name(info.vendor_id),
            renderer: info.name.clone(),
            version: format!(
                "Vulkan {major}.{minor}.{patch}, {}, Relight {}",
                info.driver,
                env!("CARGO_PKG_VERSION")
            ),
            extensions: extensions(info).join(" "),
        }
    }
}

fn extensions(info: &DeviceInfo) -> Vec<&'static str> {
    let mut words = vec![
        "VK_descriptor_indexing",
        "VK_buffer_device_address",
        "VK_timeline_semaphore",
    ];
    if info.ray_tracing.is_some() {
        words.extend([
            "VK_KHR_acceleration_structure",
            "VK_KHR_ray_tracing_pipeline",
        ]);
    }
    words
}
