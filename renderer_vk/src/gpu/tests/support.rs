//! Shared code of these tests: a device with the validation layer, and the checks at the end.

use crate::gpu::*;
use bytemuck::Pod;

/// A headless device, or `None` with a report of a skipped test.
pub(super) fn device(allow_ray_tracing: bool) -> Option<Device> {
    made(DeviceOptions {
        allow_ray_tracing,
        ..DeviceOptions::default()
    })
}

/// The same, with required features only.
pub(super) fn poor_device() -> Option<Device> {
    made(DeviceOptions {
        required_only: true,
        ..DeviceOptions::default()
    })
}

fn made(options: DeviceOptions) -> Option<Device> {
    let options = DeviceOptions {
        app_name: "gpu tests".to_owned(),
        validation: true,
        ..options
    };
    testkit::device(Device::new(&options, SurfaceSource::Headless))
}

/// Asserts that the validation layer is silent and that no object is left.
pub(super) fn finish(device: Device) {
    device.wait_idle().unwrap();
    assert_eq!(device.graveyard_len(), 0, "objects that never died");
    let messages = device.validation_messages();
    assert!(messages.is_empty(), "validation: {messages:#?}");
}

/// Bytes as values, whatever their alignment.
pub(super) fn collect<T: Pod>(bytes: &[u8]) -> Vec<T> {
    bytes
        .chunks_exact(size_of::<T>())
        .map(bytemuck::pod_read_unaligned)
        .collect()
}
