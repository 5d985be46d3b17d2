//! Lifetime of objects and of the device: the graveyard, the pipeline cache, failed requests, drops with pending work.

use super::support::{device, finish, image};
use crate::gpu::*;

#[test]
fn dropped_objects_wait_for_their_frame_and_no_longer() {
    let Some(device) = device(true) else { return };
    let mut ring = FrameRing::new(&device, 2).unwrap();
    let before = device.memory_report();
    for _ in 0..50 {
        let mut rec = ring.begin().unwrap();
        let a =
            Buffer::with_data(&device, "short-lived", BufferUsage::STORAGE, &[3u8; 4096]).unwrap();
        let b = image(
            &device,
            "short-lived",
            [16; 2],
            Format::Rgba8,
            ImageUsage::SAMPLED,
        );
        device.upload_image(&b, 0, 0, &[9; 1024]).unwrap();
        let c = Buffer::new(
            &device,
            &BufferDesc {
                name: "target",
                size: 4096,
                usage: BufferUsage::STORAGE,
                memory: Memory::Device,
            },
        )
        .unwrap();
        rec.pass("copy", Access::TRANSFER, Access::TRANSFER)
            .unwrap()
            .copy_buffer(&a, 0, &c, 0, 4096);
        drop((a, b, c));
        assert!(device.graveyard_len() >= 3, "freed while it is recorded");
        ring.end(rec).unwrap();
        assert!(device.graveyard_len() < 60, "the dead pile up");
    }
    // An image that is never used, and an upload whose target is dropped before it runs.
    let image = Image::new(
        &device,
        &ImageDesc::new("unused", 4, 4, Format::R8, ImageUsage::SAMPLED),
    )
    .unwrap();
    device.upload_image(&image, 0, 0, &[0; 16]).unwrap();
    drop(image);
    device.immediate(|_| Ok(())).unwrap();
    drop(ring);
    device.wait_idle().unwrap();
    assert_eq!(device.graveyard_len(), 0);
    let after = device.memory_report();
    assert_eq!(after.allocations, before.allocations, "memory leaks");
    finish(device);
}

#[test]
fn a_pipeline_cache_survives_a_restart_and_damage() {
    let Some(first) = device(true) else { return };
    let pipeline = ComputePipeline::new(&first, "fill", &shaders::TEST_FILL_COMP, &[]).unwrap();
    let data = first.pipeline_cache_data().unwrap();
    drop(pipeline);
    finish(first);
    let mut damaged = data.clone();
    if let Some(byte) = damaged.last_mut() {
        *byte ^= 1;
    }
    for cache in [data, damaged, vec![0; 3]] {
        let options = DeviceOptions {
            validation: true,
            pipeline_cache: Some(cache),
            prefer: Some("no device has this name".to_owned()),
            ..DeviceOptions::default()
        };
        let device = Device::new(&options, SurfaceSource::Headless).unwrap();
        ComputePipeline::new(&device, "fill", &shaders::TEST_FILL_COMP, &[]).unwrap();
        finish(device);
    }
}

#[test]
fn impossible_requests_are_errors() {
    let Some(device) = device(true) else { return };
    let made = |w, h, format, usage| {
        Image::new(&device, &ImageDesc::new("impossible", w, h, format, usage)).map(|_| ())
    };
    assert!(made(0, 4, Format::Rgba8, ImageUsage::SAMPLED).is_err());
    assert!(made(u32::MAX, 4, Format::Rgba8, ImageUsage::SAMPLED).is_err());
    assert!(made(4, 4, Format::D32F, ImageUsage::COLOR).is_err());
    assert!(made(4, 4, Format::Bc1, ImageUsage::STORAGE).is_err());
    let huge = Buffer::new(
        &device,
        &BufferDesc {
            name: "huge",
            size: 1 << 50,
            usage: BufferUsage::STORAGE,
            memory: Memory::Device,
        },
    );
    assert!(
        matches!(huge, Err(Error::OutOfMemory { .. } | Error::Vulkan { .. })),
        "{huge:?}"
    );
    let color = image(&device, "color", [8, 8], Format::Rgba8, ImageUsage::COLOR);
    let other = image(&device, "depth", [8, 9], Format::D32F, ImageUsage::DEPTH);
    device
        .immediate(|rec| {
            let mut pass = rec.pass("wrong", Access::GRAPHICS, Access::GRAPHICS)?;
            assert!(pass.begin_rendering(&Rendering::default()).is_err());
            let mixed = Rendering {
                color: Some(&color),
                depth: Some(&other),
                ..Rendering::default()
            };
            assert!(pass.begin_rendering(&mixed).is_err());
            pass.push(&[0u8; 3]);
            pass.push(&[0u32; 40]);
            pass.dispatch(1, 1, 1);
            pass.trace_rays(1, 1, 1);
            pass.clear_depth_rect([0, 0, 1, 1], 0.5);
            Ok(())
        })
        .unwrap();
    drop((color, other));
    // The validation layer may only report the size of the failed buffer.
    device.wait_idle().unwrap();
    let messages = device.validation_messages();
    assert!(
        messages
            .iter()
            .all(|m| m.contains("vkCreateBuffer") || m.contains("vkAllocateMemory")),
        "{messages:#?}"
    );
}

/// Collects the warnings and errors logged on this thread: the allocator's leak reports, and messages of the validation
/// layer during the destruction of the device, when the device can no longer return them.
struct Capture;

thread_local! {
    static LOGGED: std::cell::RefCell<Vec<String>> = const { std::cell::RefCell::new(Vec::new()) };
}

impl log::Log for Capture {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.level() <= log::Level::Warn
    }
    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            LOGGED.with_borrow_mut(|l| l.push(format!("{}: {}", record.target(), record.args())));
        }
    }
    fn flush(&self) {}
}

#[test]
fn a_device_dropped_with_pending_work_frees_everything() {
    log::set_logger(&Capture).unwrap();
    log::set_max_level(log::LevelFilter::Warn);
    let Some(device) = device(true) else { return };
    LOGGED.with_borrow_mut(Vec::clear);
    let mut ring = FrameRing::new(&device, 2).unwrap();
    // Uploads that never run, a frame in flight, a frame that is never ended.
    let buffer = Buffer::with_data(&device, "kept", BufferUsage::STORAGE, &[1u8; 100]).unwrap();
    let mut rec = ring.begin().unwrap();
    rec.pass("fill", Access::TRANSFER, Access::TRANSFER)
        .unwrap()
        .fill_buffer(&buffer, 0, 16, 7);
    ring.end(rec).unwrap();
    let rec = ring.begin().unwrap();
    let image = Image::new(
        &device,
        &ImageDesc::new("never used", 4, 4, Format::Rgba8, ImageUsage::SAMPLED),
    )
    .unwrap();
    device.upload_image(&image, 0, 0, &[1; 64]).unwrap();
    // The device goes first; the last object ends it.
    drop(device);
    drop(ring);
    drop(image);
    drop(rec);
    drop(buffer);
    let logged = LOGGED.with_borrow(Clone::clone);
    assert!(logged.is_empty(), "{logged:#?}");
}
