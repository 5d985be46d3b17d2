//! The GPU layer on whatever Vulkan device there is, with the validation layer where it is installed.
//!
//! Without a device each test says so and passes, unless `RELIGHT_REQUIRE_GPU=1`.

use bytemuck::{Pod, Zeroable};
use renderer_vk::gpu::*;

/// A headless device, or `None` with a printed line.
fn device(allow_ray_tracing: bool) -> Option<Device> {
    let options = DeviceOptions {
        app_name: "gpu tests".to_owned(),
        validation: true,
        allow_ray_tracing,
        ..DeviceOptions::default()
    };
    match Device::new(&options, SurfaceSource::Headless) {
        Ok(device) => Some(device),
        Err(e) => {
            let required = std::env::var("RELIGHT_REQUIRE_GPU").is_ok_and(|v| v == "1");
            assert!(!required, "a GPU is required: {e}");
            println!("skipped: {e}");
            None
        }
    }
}

/// Whatever a test did, the validation layer must have been silent and nothing may be left behind.
fn finish(device: Device) {
    device.wait_idle().unwrap();
    assert_eq!(device.graveyard_len(), 0, "objects that never died");
    let messages = device.validation_messages();
    assert!(messages.is_empty(), "validation: {messages:#?}");
}

/// Bytes as values, whatever their alignment.
fn collect<T: Pod>(bytes: &[u8]) -> Vec<T> {
    bytes
        .chunks_exact(size_of::<T>())
        .map(bytemuck::pod_read_unaligned)
        .collect()
}

#[test]
fn buffers_keep_what_was_uploaded() {
    let Some(device) = device(true) else { return };
    println!("{:#?}", device.info());
    let data: Vec<u32> = (0..100_000).collect();
    let buffer = Buffer::with_data(&device, "numbers", BufferUsage::STORAGE, &data).unwrap();
    // A later upload to the same place wins, also within one batch.
    device
        .upload_buffer(&buffer, 40, bytemuck::bytes_of(&77u32))
        .unwrap();
    let bytes = device.read_buffer(&buffer, 0, 400_000).unwrap();
    let back: Vec<u32> = collect(&bytes);
    for (i, value) in back.iter().enumerate() {
        assert_eq!(*value as usize, if i == 10 { 77 } else { i });
    }
    assert!(device.read_buffer(&buffer, 399_999, 2).is_err());
    assert!(device.upload_buffer(&buffer, u64::MAX, &[0]).is_err());
    assert!(
        buffer.write(0, &[1]).is_err(),
        "device memory is not mapped"
    );
    assert_ne!(buffer.address(), 0);
    drop(buffer);
    finish(device);
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Fill {
    numbers: u64,
    sums: u64,
    image: u32,
    width: u32,
    height: u32,
    count: u32,
}

#[test]
fn compute_writes_a_storage_image_and_reads_by_address() {
    let Some(device) = device(true) else { return };
    let mut ring = FrameRing::new(&device, 2).unwrap();
    assert!(FrameRing::new(&device, 2).is_err(), "one ring per device");
    let pipeline =
        ComputePipeline::new(&device, "fill", &shaders::TEST_FILL_COMP, &[(3, 5)]).unwrap();
    // Another compilation of the same file, asked for by a comment in it.
    let twice =
        ComputePipeline::new(&device, "twice", &shaders::TEST_FILL_COMP_TWICE, &[(3, 5)]).unwrap();
    let image = Image::new(
        &device,
        &ImageDesc::new(
            "target",
            61,
            35,
            Format::Rgba32F,
            ImageUsage::STORAGE | ImageUsage::SAMPLED,
        ),
    )
    .unwrap();
    let result = Buffer::new(
        &device,
        &BufferDesc {
            name: "result",
            size: 4,
            usage: BufferUsage::STORAGE,
            memory: Memory::Readback,
        },
    )
    .unwrap();
    for frame in 1..=5u32 {
        let mut rec = ring.begin().unwrap();
        assert!(ring.begin().is_err(), "one frame at a time");
        // More than a chunk of the arena, so that it grows.
        let numbers = vec![frame; 300_000];
        let address = rec.arena().push(&numbers).unwrap();
        let mut pass = rec.pass("fill", Access::COMPUTE, Access::COMPUTE).unwrap();
        pass.bind_compute(if frame == 5 { &twice } else { &pipeline });
        pass.push(&Fill {
            numbers: address,
            sums: result.address(),
            image: image.storage_index(),
            width: 61,
            height: 35,
            count: 300_000,
        });
        pass.dispatch(8, 5, 1);
        drop(pass);
        ring.end(rec).unwrap();
        if frame == 3 {
            // A frame that is thrown away leaves no trace.
            let mut rec = ring.begin().unwrap();
            let gone = Buffer::with_data(&device, "gone", BufferUsage::STORAGE, &[1u32]).unwrap();
            rec.pass("nothing", Access::TRANSFER, Access::TRANSFER)
                .unwrap()
                .copy_buffer(&gone, 0, &result, 0, 4);
            drop(gone);
        }
    }
    device.wait_idle().unwrap();
    let mut sum = [0; 4];
    result.read(0, &mut sum).unwrap();
    assert_eq!(u32::from_ne_bytes(sum), 2 * (5 * 300_000 + 5));
    let texels: Vec<[f32; 4]> = collect(&device.read_image(&image).unwrap());
    assert_eq!(texels.len(), 61 * 35);
    for (i, texel) in texels.iter().enumerate() {
        let (x, y) = (i % 61, i / 61);
        assert_eq!(*texel, [x as f32, y as f32, 5.0, 1.0]);
    }
    if device.info().timestamps {
        let times = device.timings();
        assert_eq!(times.len(), 1);
        assert_eq!(times[0].0, "fill");
        assert!(times[0].1 >= 0.0 && times[0].1 < 60_000.0, "{times:?}");
    }
    drop((image, result, pipeline, twice, ring));
    finish(device);
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Sample {
    colors: u64,
    image: u32,
    how: u32,
    size: u32,
    lod: f32,
}

#[test]
fn textures_are_sampled_by_index_with_all_their_levels() {
    let Some(device) = device(true) else { return };
    let pipeline =
        ComputePipeline::new(&device, "sample", &shaders::TEST_SAMPLE_COMP, &[]).unwrap();
    let image = Image::new(
        &device,
        &ImageDesc {
            mips: 9,
            ..ImageDesc::new("texture", 4, 4, Format::Rgba8, ImageUsage::SAMPLED)
        },
    )
    .unwrap();
    assert_eq!(image.mips(), 3, "no more levels than the size allows");
    let other = Image::new(
        &device,
        &ImageDesc::new("other", 4, 4, Format::Rgba8, ImageUsage::SAMPLED),
    )
    .unwrap();
    assert_ne!(image.texture_index(), other.texture_index());
    let texels: Vec<u8> = (0..16).flat_map(|i| [i * 17, 0, 255, 255]).collect();
    device.upload_image(&image, 0, 0, &texels).unwrap();
    device.upload_image(&image, 1, 0, &[51; 16]).unwrap();
    assert!(device.upload_image(&image, 1, 0, &[0; 15]).is_err());
    assert!(device.upload_image(&image, 3, 0, &[0; 4]).is_err());
    // A rectangle of one texel over the first upload.
    device
        .upload_image_rect(&image, 0, 3, 2, 1, 1, &[1, 2, 3, 4])
        .unwrap();
    assert!(
        device
            .upload_image_rect(&image, 0, 4, 0, 1, 1, &[0; 4])
            .is_err()
    );
    let nearest = device
        .sampler(&SamplerDesc {
            filter: Filter::Nearest,
            ..SamplerDesc::default()
        })
        .unwrap();
    let smooth = device
        .sampler(&SamplerDesc {
            anisotropy: 16.0,
            ..SamplerDesc::default()
        })
        .unwrap();
    assert_ne!(nearest, smooth);
    assert_eq!(
        smooth,
        device
            .sampler(&SamplerDesc {
                anisotropy: 16.0,
                ..SamplerDesc::default()
            })
            .unwrap()
    );
    let colors = Buffer::new(
        &device,
        &BufferDesc {
            name: "colors",
            size: 256,
            usage: BufferUsage::STORAGE,
            memory: Memory::Device,
        },
    )
    .unwrap();
    let run = |lod: f32, generate: bool| -> Vec<[f32; 4]> {
        device
            .immediate(|rec| {
                if generate {
                    rec.pass("mips", Access::TRANSFER, Access::TRANSFER)?
                        .generate_mips(&image);
                }
                let mut pass = rec.pass("sample", Access::COMPUTE, Access::COMPUTE)?;
                pass.bind_compute(&pipeline);
                pass.push(&Sample {
                    colors: colors.address(),
                    image: image.texture_index(),
                    how: nearest,
                    size: 4,
                    lod,
                });
                pass.dispatch(1, 1, 1);
                Ok(())
            })
            .unwrap();
        collect(&device.read_buffer(&colors, 0, 256).unwrap())
    };
    let byte = |v: f32| (v * 255.0).round() as u8;
    for (i, color) in run(0.0, false).iter().enumerate() {
        let wanted = if i == 11 {
            [1, 2, 3, 4]
        } else {
            [i as u8 * 17, 0, 255, 255]
        };
        assert_eq!(color.map(byte), wanted, "texel {i}");
    }
    assert_eq!(run(1.0, false)[5].map(byte), [51; 4]);
    // Level 1 from level 0: the mean of texels 0, 1, 4, 5 in the corner.
    let corner = run(1.0, true)[0].map(byte);
    assert!(
        corner[0].abs_diff(43) <= 1 && corner[2] == 255,
        "{corner:?}"
    );
    let index = image.texture_index();
    drop((image, other, colors, pipeline));
    device.wait_idle().unwrap();
    let again = Image::new(
        &device,
        &ImageDesc::new("again", 1, 1, Format::Rgba8, ImageUsage::SAMPLED),
    )
    .unwrap();
    assert!(again.texture_index() <= index + 1, "indices are used again");
    drop(again);
    finish(device);
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Draw {
    corners: u64,
    color: [f32; 4],
}

#[test]
fn triangles_are_drawn_with_depth_blend_and_culling() {
    let Some(device) = device(true) else { return };
    let color = Image::new(
        &device,
        &ImageDesc::new(
            "color",
            32,
            32,
            Format::Rgba8,
            ImageUsage::COLOR | ImageUsage::SAMPLED,
        ),
    )
    .unwrap();
    let depth = Image::new(
        &device,
        &ImageDesc::new("depth", 32, 32, Format::D32F, ImageUsage::DEPTH),
    )
    .unwrap();
    let desc = GraphicsDesc {
        color: Some(Format::Rgba8),
        depth: Some(Format::D32F),
        ..GraphicsDesc::new(
            "solid",
            &shaders::TEST_TRIANGLE_VERT,
            &shaders::TEST_TRIANGLE_FRAG,
        )
    };
    let solid = GraphicsPipeline::new(&device, &desc).unwrap();
    let additive = GraphicsPipeline::new(
        &device,
        &GraphicsDesc {
            name: "additive",
            blend: Some((BlendFactor::One, BlendFactor::One)),
            depth_test: DepthTest::Equal,
            depth_write: false,
            ..desc
        },
    )
    .unwrap();
    let front_only = GraphicsPipeline::new(
        &device,
        &GraphicsDesc {
            name: "front only",
            cull: Cull::Back,
            depth_test: DepthTest::Always,
            ..desc
        },
    )
    .unwrap();
    let mut ring = FrameRing::new(&device, 2).unwrap();
    let mut rec = ring.begin().unwrap();
    // Covers the half of the picture below the diagonal from top left to bottom right; clockwise on the screen.
    let half = |z: f32| [[-1.0, -1.0, z], [1.0, 1.0, z], [-1.0, 1.0, z]];
    let near = rec.arena().push(&half(0.25)).unwrap();
    let far = rec.arena().push(&half(0.75)).unwrap();
    let full = rec
        .arena()
        .push(&[[-1.0f32, -1.0, 0.5], [3.0, -1.0, 0.5], [-1.0, 3.0, 0.5]])
        .unwrap();
    let indices = {
        let mut slice = rec.arena().alloc(12, 4).unwrap();
        slice
            .bytes()
            .copy_from_slice(bytemuck::cast_slice(&[0u32, 1, 2]));
        (slice.buffer().clone(), slice.offset)
    };
    let mut pass = rec
        .pass("draw", Access::GRAPHICS, Access::GRAPHICS)
        .unwrap();
    pass.begin_rendering(&Rendering {
        color: Some(&color),
        depth: Some(&depth),
        clear_color: Some([0.0, 0.0, 0.0, 1.0]),
        clear_depth: Some(1.0),
    })
    .unwrap();
    let draw = |pass: &mut Pass<'_>, pipeline: &GraphicsPipeline, corners: u64, color| {
        pass.bind_graphics(pipeline);
        pass.push(&Draw { corners, color });
        pass.bind_index_buffer(&indices.0, indices.1);
        pass.draw_indexed(3, 1, 0, 0, 0);
    };
    draw(&mut pass, &solid, near, [1.0, 0.0, 0.0, 1.0]);
    // Behind: hidden where the first triangle is.
    draw(&mut pass, &solid, full, [0.0, 1.0, 0.0, 1.0]);
    draw(&mut pass, &solid, far, [1.0, 1.0, 1.0, 1.0]);
    // At the same depth: adds to the first triangle only.
    draw(&mut pass, &additive, near, [0.0, 0.0, 1.0, 0.0]);
    // Clockwise on the screen is the back.
    draw(&mut pass, &front_only, near, [1.0, 1.0, 1.0, 1.0]);
    // A scissor of one pixel.
    pass.set_scissor(31, 0, 100, 1);
    draw(&mut pass, &solid, full, [1.0, 1.0, 0.0, 1.0]);
    pass.clear_color_rect([0, 30, 2, 99], [0.2, 0.4, 0.6, 0.8]);
    pass.end_rendering();
    // Outside of rendering: left out, not undefined behaviour.
    pass.draw(3, 1, 0, 0);
    drop(pass);
    ring.end(rec).unwrap();
    let bytes = device.read_image(&color).unwrap();
    let at = |x: usize, y: usize| {
        let i = (y * 32 + x) * 4;
        [bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]
    };
    assert_eq!(at(4, 20), [255, 0, 255, 255], "below the diagonal");
    assert_eq!(at(20, 4), [0, 255, 0, 255], "above the diagonal");
    assert_eq!(at(31, 0), [255, 255, 0, 255], "in the scissor");
    assert_eq!(at(1, 31), [51, 102, 153, 204], "in the cleared rectangle");
    assert_eq!(at(2, 31), [255, 0, 255, 255], "beside it");
    let depths: Vec<f32> = collect(&device.read_image(&depth).unwrap());
    assert_eq!(depths[20 * 32 + 4], 0.25);
    assert_eq!(depths[4 * 32 + 20], 0.5);

    // Blits: enlarge and mirror.
    let double = Image::new(
        &device,
        &ImageDesc::new("double", 64, 64, Format::Rgba8, ImageUsage::COLOR),
    )
    .unwrap();
    device
        .immediate(|rec| {
            let mut pass = rec.pass("blit", Access::TRANSFER, Access::TRANSFER)?;
            pass.clear_image(&double, [0.0; 4]);
            pass.barrier();
            pass.blit_image(&color, [0, 32, 32, -32], &double, [0, 0, 64, 64], false);
            pass.blit_image(&color, [0, 0, 33, 32], &double, [0, 0, 64, 64], false);
            Ok(())
        })
        .unwrap();
    let twice = device.read_image(&double).unwrap();
    let i = (63 * 64 + 63) * 4;
    assert_eq!(
        twice[i..i + 4],
        [255, 255, 0, 255],
        "the top right corner is below now"
    );
    drop((
        color, depth, double, solid, additive, front_only, indices, ring,
    ));
    finish(device);
}

/// Draws a triangle without indices.
fn draw_corners(pass: &mut Pass<'_>, pipeline: &GraphicsPipeline, corners: u64, color: [f32; 4]) {
    pass.bind_graphics(pipeline);
    pass.push(&Draw { corners, color });
    pass.draw(3, 1, 0, 0);
}

#[test]
fn stencils_count_and_masks_hold_channels_back() {
    let Some(device) = device(true) else { return };
    let Some(format) = device.depth_stencil_format() else {
        println!("skipped: no format with stencil");
        return;
    };
    let image = |name, format, usage| {
        Image::new(&device, &ImageDesc::new(name, 32, 32, format, usage)).unwrap()
    };
    let color = image("color", Format::Rgba8, ImageUsage::COLOR);
    let depth = image("depth", format, ImageUsage::DEPTH);
    let desc = GraphicsDesc {
        color: Some(Format::Rgba8),
        depth: Some(format),
        ..GraphicsDesc::new(
            "stencil",
            &shaders::TEST_TRIANGLE_VERT,
            &shaders::TEST_TRIANGLE_FRAG,
        )
    };
    let pipeline = |stencil, color_write| {
        let desc = GraphicsDesc {
            stencil,
            color_write,
            depth_write: false,
            ..desc
        };
        GraphicsPipeline::new(&device, &desc).unwrap()
    };
    let up = pipeline(Some(Stencil::Increment), ColorMask::NONE);
    let down = pipeline(Some(Stencil::Decrement), ColorMask::NONE);
    let shade = pipeline(
        Some(Stencil::NotZero),
        ColorMask {
            red: false,
            ..ColorMask::ALL
        },
    );
    let mut ring = FrameRing::new(&device, 2).unwrap();
    let mut rec = ring.begin().unwrap();
    let full = |z: f32| [[-1.0, -1.0, z], [3.0, -1.0, z], [-1.0, 3.0, z]];
    let half = |z: f32| [[-1.0, -1.0, z], [1.0, 1.0, z], [-1.0, 1.0, z]];
    let all = rec.arena().push(&full(0.5)).unwrap();
    let hidden = rec.arena().push(&full(0.9)).unwrap();
    let lower = rec.arena().push(&half(0.5)).unwrap();
    let mut pass = rec
        .pass("stencil", Access::GRAPHICS, Access::GRAPHICS)
        .unwrap();
    pass.begin_rendering(&Rendering {
        color: Some(&color),
        depth: Some(&depth),
        clear_color: Some([1.0, 0.0, 0.0, 1.0]),
        clear_depth: Some(0.75),
    })
    .unwrap();
    pass.clear_stencil_rect([0, 0, 32, 32]);
    // below the diagonal: 0, not below it and back to 1; above it: 1, then 0
    draw_corners(&mut pass, &down, lower, [0.0; 4]);
    draw_corners(&mut pass, &up, all, [0.0; 4]);
    draw_corners(&mut pass, &up, lower, [0.0; 4]);
    draw_corners(&mut pass, &down, all, [0.0; 4]);
    // behind the depth nothing counts
    draw_corners(&mut pass, &up, hidden, [0.0; 4]);
    // the right half is cleared again
    pass.clear_stencil_rect([16, 0, 16, 32]);
    draw_corners(&mut pass, &shade, all, [0.0, 1.0, 1.0, 1.0]);
    drop(pass);
    ring.end(rec).unwrap();
    let bytes = device.read_image(&color).unwrap();
    let at = |x: usize, y: usize| {
        let i = (y * 32 + x) * 4;
        [bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]
    };
    assert_eq!(at(4, 20), [255, 255, 255, 255], "stencil 1, red kept");
    assert_eq!(at(10, 4), [255, 0, 0, 255], "stencil 0");
    assert_eq!(at(20, 30), [255, 0, 0, 255], "cleared");
    // the depth alone is read back
    let depths = device.read_image(&depth).unwrap();
    assert_eq!(depths.len(), 32 * 32 * 4);
    drop((color, depth, up, down, shade, ring));
    finish(device);
}

#[test]
fn several_samples_are_averaged_along_edges() {
    let Some(device) = device(true) else { return };
    if !device.supports_samples(Format::Rgba8, 4) || !device.supports_samples(Format::D32F, 4) {
        println!("skipped: no multisampling");
        return;
    }
    let image = |name, format, usage, samples| {
        let desc = ImageDesc {
            samples,
            ..ImageDesc::new(name, 32, 32, format, usage)
        };
        Image::new(&device, &desc)
    };
    let several = image("several", Format::Rgba8, ImageUsage::COLOR, 4).unwrap();
    let depth = image("depth", Format::D32F, ImageUsage::DEPTH, 4).unwrap();
    let plain = image("plain", Format::D32F, ImageUsage::DEPTH, 1).unwrap();
    let one = image("one", Format::Rgba8, ImageUsage::COLOR, 1).unwrap();
    assert!(image("odd", Format::Rgba8, ImageUsage::COLOR, 3).is_err());
    let pipeline = GraphicsPipeline::new(
        &device,
        &GraphicsDesc {
            color: Some(Format::Rgba8),
            depth: Some(Format::D32F),
            samples: 4,
            ..GraphicsDesc::new(
                "edges",
                &shaders::TEST_TRIANGLE_VERT,
                &shaders::TEST_TRIANGLE_FRAG,
            )
        },
    )
    .unwrap();
    let mut ring = FrameRing::new(&device, 2).unwrap();
    let mut rec = ring.begin().unwrap();
    let half: [[f32; 3]; 3] = [[-1.0, -1.0, 0.5], [1.0, 1.0, 0.5], [-1.0, 1.0, 0.5]];
    let half = rec.arena().push(&half).unwrap();
    let mut pass = rec
        .pass("edges", Access::GRAPHICS, Access::GRAPHICS)
        .unwrap();
    let target = Rendering {
        color: Some(&several),
        depth: Some(&depth),
        clear_color: Some([0.0, 0.0, 0.0, 1.0]),
        clear_depth: Some(1.0),
    };
    let mixed = Rendering {
        depth: Some(&plain),
        ..target
    };
    assert!(pass.begin_rendering(&mixed).is_err());
    pass.begin_rendering(&target).unwrap();
    draw_corners(&mut pass, &pipeline, half, [1.0; 4]);
    drop(pass);
    let mut pass = rec
        .pass("resolve", Access::TRANSFER, Access::TRANSFER)
        .unwrap();
    pass.resolve_image(&several, &one);
    // left out, because the samples do not fit
    pass.resolve_image(&one, &several);
    drop(pass);
    ring.end(rec).unwrap();
    let bytes = device.read_image(&one).unwrap();
    let red = |x: usize, y: usize| bytes[(y * 32 + x) * 4];
    assert_eq!((red(4, 20), red(20, 4)), (255, 0));
    let edge = red(10, 10);
    assert!(edge > 0 && edge < 255, "{edge}");
    drop((several, depth, plain, one, pipeline, ring));
    finish(device);
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Rays {
    hits: u64,
    scene: u32,
    size: u32,
}

/// What the ray through pixel (x, y) of 64 must report: two instances of a triangle that covers x + y < 1 of the unit
/// square, scaled to a half and moved; candidates whose first barycentric is below 0.25 are holes.
fn expected(x: usize, y: usize) -> [u32; 4] {
    let (px, py) = ((x as f32 + 0.5) / 64.0, (y as f32 + 0.5) / 64.0);
    for (custom, ox, oy) in [(7, 0.0, 0.0), (9, 0.5, 0.5)] {
        let (u, v) = ((px - ox) * 2.0, (py - oy) * 2.0);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            // Counter-clockwise seen from above, where the rays come from: the front.
            return if u < 0.25 {
                [0; 4]
            } else {
                [1, custom, 0, 254]
            };
        }
    }
    [0; 4]
}

#[test]
fn rays_find_triangles_through_pipeline_and_query() {
    let Some(device) = device(true) else { return };
    let info = device.info().clone();
    if info.ray_tracing.is_none() && !info.ray_query {
        let required = std::env::var("RELIGHT_REQUIRE_GPU").is_ok_and(|v| v == "1");
        assert!(!required, "ray tracing is required");
        println!("skipped: {} has no ray tracing", info.name);
        return finish(device);
    }
    let mut ring = FrameRing::new(&device, 2).unwrap();
    let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let vertices =
        Buffer::with_data(&device, "vertices", BufferUsage::ACCEL_INPUT, &positions).unwrap();
    let indices =
        Buffer::with_data(&device, "indices", BufferUsage::ACCEL_INPUT, &[0u32, 1, 2]).unwrap();
    let geometry = [BlasGeometry {
        vertex_address: vertices.address(),
        vertex_stride: 12,
        max_vertex: 2,
        index_address: indices.address(),
        triangle_count: 1,
        opaque: false,
        no_duplicate_any_hit: true,
    }];
    let flags = BlasFlags {
        compact: true,
        ..BlasFlags::default()
    };
    let mut blases: Vec<Blas> = (0..3)
        .map(|i| Blas::new(&device, &format!("static {i}"), flags))
        .collect();
    assert_eq!(blases[0].address(), 0);
    let mut builds: Vec<BlasBuild<'_>> = blases
        .iter_mut()
        .map(|blas| BlasBuild {
            blas,
            geometries: &geometry,
            refit: false,
        })
        .collect();
    device.build_static_blas(&mut builds).unwrap();
    drop(builds);
    let mut moving = Blas::new(
        &device,
        "moving",
        BlasFlags {
            fast_build: true,
            refit: true,
            ..BlasFlags::default()
        },
    );
    let compact = BlasFlags {
        compact: true,
        ..BlasFlags::default()
    };
    let mut kept = Blas::new(&device, "kept", compact);
    let mut asked = None;
    let mut tlas = Tlas::new(&device, "scene");
    let place = |blas: u64, custom_index, x, y| Instance {
        transform: [[0.5, 0.0, 0.0, x], [0.0, 0.5, 0.0, y], [0.0, 0.0, 0.5, 0.0]],
        custom_index,
        ..Instance::new(blas)
    };
    let hits = Buffer::new(
        &device,
        &BufferDesc {
            name: "hits",
            size: 64 * 64 * 16,
            usage: BufferUsage::STORAGE,
            memory: Memory::Device,
        },
    )
    .unwrap();
    let pipeline = info.ray_tracing.is_some().then(|| {
        RayTracingPipeline::new(
            &device,
            &RayTracingDesc {
                name: "rays",
                raygen: &shaders::TEST_RAYS_RGEN,
                miss: &[&shaders::TEST_RAYS_RMISS],
                hit: &[HitGroup {
                    closest_hit: Some(&shaders::TEST_RAYS_RCHIT),
                    any_hit: Some(&shaders::TEST_RAYS_RAHIT),
                }],
                constants: &[],
            },
        )
        .unwrap()
    });
    let query = info
        .ray_query
        .then(|| ComputePipeline::new(&device, "query", &shaders::TEST_QUERY_COMP, &[]).unwrap());
    // Frame 0 has an empty scene; later ones grow, so that storage is made anew while frames are in flight.
    for frame in 0..4usize {
        for by_query in [false, true] {
            let mut rec = ring.begin().unwrap();
            let mut pass = rec
                .pass("build", Access::ACCEL_BUILD, Access::ACCEL_BUILD)
                .unwrap();
            // a refit that was never built is built
            pass.build_blas(&mut [BlasBuild {
                blas: &mut moving,
                geometries: &geometry,
                refit: true,
            }])
            .unwrap();
            // one that stays: built in the first frame, copied to the memory that it needs two frames later
            match (frame, by_query) {
                (0, false) => {
                    pass.build_blas(&mut [BlasBuild {
                        blas: &mut kept,
                        geometries: &geometry,
                        refit: false,
                    }])
                    .unwrap();
                    asked = Some(pass.ask_compacted_sizes(&[&kept]).unwrap());
                }
                (2, false) => {
                    let sizes = asked.take().unwrap().sizes().unwrap();
                    let before = (kept.address(), kept.size());
                    let size = sizes.expect("frame 0 is over")[0];
                    assert!(size > 0 && size <= before.1);
                    pass.compact_blas(&mut kept, size).unwrap();
                    assert_eq!(kept.size(), size);
                    assert_ne!(kept.address(), before.0);
                    pass.barrier();
                }
                _ => {}
            }
            let mut instances = Vec::new();
            if frame > 0 {
                instances.push(place(kept.address(), 7, 0.0, 0.0));
                instances.push(place(moving.address(), 9, 0.5, 0.5));
                // Out of sight; many of them in the end.
                instances.extend(
                    (0..frame * 40).map(|i| place(blases[1].address(), 1, 5.0 + i as f32, 0.0)),
                );
            }
            pass.build_tlas(&mut tlas, &instances).unwrap();
            drop(pass);
            let mut pass = rec
                .pass(
                    "trace",
                    Access::COMPUTE | Access::RAY_TRACING,
                    Access::COMPUTE | Access::RAY_TRACING,
                )
                .unwrap();
            let push = Rays {
                hits: hits.address(),
                scene: tlas.index(),
                size: 64,
            };
            match (&pipeline, &query) {
                (Some(pipeline), _) if !by_query => {
                    pass.bind_rays(pipeline);
                    pass.push(&push);
                    pass.trace_rays(64, 64, 1);
                }
                (_, Some(query)) if by_query => {
                    pass.bind_compute(query);
                    pass.push(&push);
                    pass.dispatch(8, 8, 1);
                }
                _ => {
                    drop(pass);
                    ring.end(rec).unwrap();
                    continue;
                }
            }
            drop(pass);
            ring.end(rec).unwrap();
            let found: Vec<[u32; 4]> = collect(&device.read_buffer(&hits, 0, hits.size()).unwrap());
            let mut count = 0;
            for (i, hit) in found.iter().enumerate() {
                let wanted = if frame == 0 {
                    [0; 4]
                } else {
                    expected(i % 64, i / 64)
                };
                assert_eq!(
                    *hit,
                    wanted,
                    "frame {frame}, query {by_query}, ray {}, {}",
                    i % 64,
                    i / 64
                );
                count += hit[0];
            }
            assert_eq!(count > 0, frame > 0);
        }
    }
    drop((
        blases, moving, kept, tlas, vertices, indices, hits, pipeline, query, ring,
    ));
    finish(device);
}

#[test]
fn a_device_without_ray_tracing_says_so_instead_of_failing_later() {
    let Some(device) = device(false) else { return };
    assert!(device.info().ray_tracing.is_none() && !device.info().ray_query);
    let desc = RayTracingDesc {
        name: "rays",
        raygen: &shaders::TEST_RAYS_RGEN,
        miss: &[],
        hit: &[],
        constants: &[],
    };
    let Err(e) = RayTracingPipeline::new(&device, &desc) else {
        panic!("a pipeline without the extension");
    };
    assert!(e.to_string().contains("rays"), "{e}");
    // Rays declared, nothing traced: the pass must not name stages of the absent extension.
    device
        .immediate(|rec| {
            rec.pass(
                "nothing",
                Access::RAY_TRACING | Access::TRANSFER,
                Access::ACCEL_BUILD,
            )?;
            Ok(())
        })
        .unwrap();
    finish(device);
}

#[test]
fn dropped_objects_wait_for_their_frame_and_no_longer() {
    let Some(device) = device(true) else { return };
    let mut ring = FrameRing::new(&device, 2).unwrap();
    let before = device.memory_report();
    for _ in 0..50 {
        let mut rec = ring.begin().unwrap();
        let a =
            Buffer::with_data(&device, "short-lived", BufferUsage::STORAGE, &[3u8; 4096]).unwrap();
        let b = Image::new(
            &device,
            &ImageDesc::new("short-lived", 16, 16, Format::Rgba8, ImageUsage::SAMPLED),
        )
        .unwrap();
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
    // An image that nothing ever used, and an upload whose target is gone before it runs.
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
    let image = |w, h, format, usage| {
        Image::new(&device, &ImageDesc::new("impossible", w, h, format, usage)).map(|_| ())
    };
    assert!(image(0, 4, Format::Rgba8, ImageUsage::SAMPLED).is_err());
    assert!(image(u32::MAX, 4, Format::Rgba8, ImageUsage::SAMPLED).is_err());
    assert!(image(4, 4, Format::D32F, ImageUsage::COLOR).is_err());
    assert!(image(4, 4, Format::Bc1, ImageUsage::STORAGE).is_err());
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
    let color = Image::new(
        &device,
        &ImageDesc::new("color", 8, 8, Format::Rgba8, ImageUsage::COLOR),
    )
    .unwrap();
    let other = Image::new(
        &device,
        &ImageDesc::new("depth", 8, 9, Format::D32F, ImageUsage::DEPTH),
    )
    .unwrap();
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
    // The size of the failed buffer is the one thing that the layer may have an opinion on.
    device.wait_idle().unwrap();
    let messages = device.validation_messages();
    assert!(
        messages
            .iter()
            .all(|m| m.contains("vkCreateBuffer") || m.contains("vkAllocateMemory")),
        "{messages:#?}"
    );
}

/// Keeps the warnings and errors that were logged on this thread: the allocator's leak reports and what the validation
/// layer says while a device is destroyed come after anybody could ask the device.
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
fn a_device_that_ends_in_the_middle_of_everything_leaves_nothing_behind() {
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
