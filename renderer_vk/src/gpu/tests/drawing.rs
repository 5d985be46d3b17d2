//! Graphics pipelines: depth, blending, culling, stencils, channel masks, multisampling.

use super::support::{
    Draw, collect, device, draw_corners, finish, image, pixel, rendering, triangles,
};
use crate::gpu::*;

#[test]
fn triangles_are_drawn_with_depth_blend_and_culling() {
    let Some(device) = device(true) else { return };
    let usage = ImageUsage::COLOR | ImageUsage::SAMPLED;
    let color = image(&device, "color", [32; 2], Format::Rgba8, usage);
    let depth = image(&device, "depth", [32; 2], Format::D32F, ImageUsage::DEPTH);
    let desc = triangles("solid", Format::D32F);
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
    let target = Rendering {
        color: Some(&color),
        depth: Some(&depth),
        clear_color: Some([0.0, 0.0, 0.0, 1.0]),
        clear_depth: Some(1.0),
    };
    let mut pass = rendering(&mut rec, &target);
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
    // Outside of rendering: omitted with a warning.
    pass.draw(3, 1, 0, 0);
    drop(pass);
    ring.end(rec).unwrap();
    let bytes = device.read_image(&color).unwrap();
    let at = |x, y| pixel(&bytes, x, y);
    assert_eq!(at(4, 20), [255, 0, 255, 255], "below the diagonal");
    assert_eq!(at(20, 4), [0, 255, 0, 255], "above the diagonal");
    assert_eq!(at(31, 0), [255, 255, 0, 255], "in the scissor");
    assert_eq!(at(1, 31), [51, 102, 153, 204], "in the cleared rectangle");
    assert_eq!(at(2, 31), [255, 0, 255, 255], "beside it");
    let depths: Vec<f32> = collect(&device.read_image(&depth).unwrap());
    assert_eq!(depths[20 * 32 + 4], 0.25);
    assert_eq!(depths[4 * 32 + 20], 0.5);

    // Blits: enlarge and mirror.
    let double = image(&device, "double", [64; 2], Format::Rgba8, ImageUsage::COLOR);
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

#[test]
fn stencils_count_and_masks_hold_channels_back() {
    let Some(device) = device(true) else { return };
    let format = device.depth_format(true);
    let color = image(&device, "color", [32; 2], Format::Rgba8, ImageUsage::COLOR);
    let depth = image(&device, "depth", [32; 2], format, ImageUsage::DEPTH);
    let pipeline = |stencil, color_write| {
        let desc = GraphicsDesc {
            stencil,
            color_write,
            depth_write: false,
            ..triangles("stencil", format)
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
    let target = Rendering {
        color: Some(&color),
        depth: Some(&depth),
        clear_color: Some([1.0, 0.0, 0.0, 1.0]),
        clear_depth: Some(0.75),
    };
    let mut pass = rendering(&mut rec, &target);
    pass.clear_stencil_rect([0, 0, 32, 32]);
    // below the diagonal: 0, not below it and back to 1; above it: 1, then 0
    draw_corners(&mut pass, &down, lower, [0.0; 4]);
    draw_corners(&mut pass, &up, all, [0.0; 4]);
    draw_corners(&mut pass, &up, lower, [0.0; 4]);
    draw_corners(&mut pass, &down, all, [0.0; 4]);
    // fragments behind the depth do not count
    draw_corners(&mut pass, &up, hidden, [0.0; 4]);
    // the right half is cleared again
    pass.clear_stencil_rect([16, 0, 16, 32]);
    draw_corners(&mut pass, &shade, all, [0.0, 1.0, 1.0, 1.0]);
    drop(pass);
    ring.end(rec).unwrap();
    let bytes = device.read_image(&color).unwrap();
    let at = |x, y| pixel(&bytes, x, y);
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
        testkit::skip("the device has no multisampling");
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
    let desc = GraphicsDesc {
        samples: 4,
        ..triangles("edges", Format::D32F)
    };
    let pipeline = GraphicsPipeline::new(&device, &desc).unwrap();
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
    // omitted, because the numbers of samples do not match
    pass.resolve_image(&one, &several);
    drop(pass);
    ring.end(rec).unwrap();
    let bytes = device.read_image(&one).unwrap();
    let red = |x, y| pixel(&bytes, x, y)[0];
    assert_eq!((red(4, 20), red(20, 4)), (255, 0));
    let edge = red(10, 10);
    assert!(edge > 0 && edge < 255, "{edge}");
    drop((several, depth, plain, one, pipeline, ring));
    finish(device);
}
