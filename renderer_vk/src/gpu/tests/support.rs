//! Shared code of these tests: a device with the validation layer, and the checks at the end.

use crate::gpu::*;
use bytemuck::{Pod, Zeroable};

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

/// A buffer of results that the CPU reads.
pub(super) fn readback(device: &Device, name: &str, size: usize) -> Buffer {
    let desc = BufferDesc {
        name,
        size: size as u64,
        usage: BufferUsage::STORAGE,
        memory: Memory::Readback,
    };
    Buffer::new(device, &desc).unwrap()
}

pub(super) fn image(
    device: &Device,
    name: &str,
    [width, height]: [u32; 2],
    format: Format,
    usage: ImageUsage,
) -> Image {
    Image::new(device, &ImageDesc::new(name, width, height, format, usage)).unwrap()
}

/// Runs `count` invocations of a shader with groups of 64, and waits for them.
pub(super) fn compute(device: &Device, pipeline: &ComputePipeline, push: &impl Pod, count: u32) {
    device
        .immediate(|rec| {
            let mut pass = rec.pass("compute", Access::COMPUTE, Access::COMPUTE)?;
            pass.bind_compute(pipeline);
            pass.push(push);
            pass.dispatch(count.div_ceil(64), 1, 1);
            Ok(())
        })
        .unwrap();
}

/// Triangles of one colour on an image of [`Format::Rgba8`].
pub(super) fn triangles(name: &str, depth: Format) -> GraphicsDesc<'_> {
    let (vertex, fragment) = (&shaders::TEST_TRIANGLE_VERT, &shaders::TEST_TRIANGLE_FRAG);
    GraphicsDesc {
        color: Some(Format::Rgba8),
        depth: Some(depth),
        ..GraphicsDesc::new(name, vertex, fragment)
    }
}

/// What the shaders of [`triangles`] read.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Draw {
    pub corners: u64,
    pub color: [f32; 4],
}

/// Draws a triangle without indices.
pub(super) fn draw_corners(
    pass: &mut Pass<'_>,
    pipeline: &GraphicsPipeline,
    corners: u64,
    color: [f32; 4],
) {
    pass.bind_graphics(pipeline);
    pass.push(&Draw { corners, color });
    pass.draw(3, 1, 0, 0);
}

/// A pass that draws to `target`.
pub(super) fn rendering<'a>(rec: &'a mut Recorder, target: &Rendering<'_>) -> Pass<'a> {
    let pass = rec.pass("draw", Access::GRAPHICS, Access::GRAPHICS);
    let mut pass = pass.unwrap();
    pass.begin_rendering(target).unwrap();
    pass
}

/// A pixel of an image 32 pixels wide.
pub(super) fn pixel(bytes: &[u8], x: usize, y: usize) -> [u8; 4] {
    bytes.as_chunks::<4>().0[y * 32 + x]
}
