//! Blending, culling and depth tests of successive draws, on devices with these as dynamic state and on devices
//! without.

use super::support::{device, draw_corners, finish, image, poor_device, rendering, triangles};
use crate::gpu::*;

const SIZE: u32 = 32;

/// Effect of a draw on its own pixel.
#[derive(Clone, Copy)]
struct State {
    cull: Cull,
    test: DepthTest,
    write: bool,
    blend: Option<(BlendFactor, BlendFactor)>,
}

/// All combinations, in an order in which each part changes alone and with others.
fn states() -> Vec<State> {
    let mut all = Vec::new();
    for blend in [
        None,
        Some((BlendFactor::One, BlendFactor::One)),
        Some((BlendFactor::DstColor, BlendFactor::Zero)),
    ] {
        for test in [
            DepthTest::Always,
            DepthTest::LessEqual,
            DepthTest::Equal,
            DepthTest::GreaterEqual,
        ] {
            for write in [false, true] {
                for cull in [Cull::None, Cull::Front, Cull::Back] {
                    all.push(State {
                        cull,
                        test,
                        write,
                        blend,
                    });
                }
            }
        }
    }
    let count = all.len();
    (0..count * 7)
        .map(|i| all[i * (1 + i / count) % count])
        .collect()
}

/// Value of a pixel of 0.4 at depth 0.5 after a clockwise draw of 0.6 at depth `z`; blue shows whether a later draw at
/// depth 0.6 passes.
fn expected(state: State, z: f32) -> [u8; 3] {
    let near_enough = match state.test {
        DepthTest::Always => true,
        DepthTest::LessEqual => z <= 0.5,
        DepthTest::Equal => z == 0.5,
        DepthTest::GreaterEqual => z >= 0.5,
    };
    let passes = near_enough && state.cull != Cull::Back;
    let red = match state.blend {
        _ if !passes => 0.4,
        None => 0.6,
        Some((BlendFactor::One, _)) => 0.4 + 0.6,
        Some(_) => 0.4 * 0.6f32,
    };
    let depth = if passes && state.write { z } else { 0.5 };
    [
        (red * 255.0).round() as u8,
        0,
        if depth >= 0.6 { 255 } else { 0 },
    ]
}

fn draws_keep_their_own_state(device: Device) {
    let color = image(
        &device,
        "color",
        [SIZE; 2],
        Format::Rgba8,
        ImageUsage::COLOR,
    );
    let depth = image(&device, "depth", [SIZE; 2], Format::D32F, ImageUsage::DEPTH);
    let make = |state: State| {
        let desc = GraphicsDesc {
            cull: state.cull,
            depth_test: state.test,
            depth_write: state.write,
            blend: state.blend,
            ..triangles("state", Format::D32F)
        };
        GraphicsPipeline::new(&device, &desc).unwrap()
    };
    let cases: Vec<(State, f32)> = states()
        .into_iter()
        .zip([0.25, 0.75, 0.5, 0.75].into_iter().cycle())
        .collect();
    assert!(cases.len() <= (SIZE * SIZE) as usize);
    let pipelines: Vec<_> = cases.iter().map(|(state, _)| make(*state)).collect();
    let probe = make(State {
        cull: Cull::None,
        test: DepthTest::LessEqual,
        write: false,
        blend: Some((BlendFactor::One, BlendFactor::One)),
    });
    let mut ring = FrameRing::new(&device, 2).unwrap();
    let mut rec = ring.begin().unwrap();
    // clockwise on the screen, which is the back
    let mut corners = |z: f32| {
        let all = [[-1.0, -1.0, z], [3.0, -1.0, z], [-1.0, 3.0, z]];
        rec.arena().push(&all).unwrap()
    };
    let places: Vec<u64> = cases.iter().map(|(_, z)| corners(*z)).collect();
    let tested = corners(0.6);
    let target = Rendering {
        color: Some(&color),
        depth: Some(&depth),
        clear_color: Some([0.4, 0.0, 0.0, 1.0]),
        clear_depth: Some(0.5),
    };
    let mut pass = rendering(&mut rec, &target);
    for (i, (pipeline, corners)) in (0..).zip(pipelines.iter().zip(places)) {
        pass.set_scissor(i % SIZE as i32, i / SIZE as i32, 1, 1);
        draw_corners(&mut pass, pipeline, corners, [0.6, 0.0, 0.0, 1.0]);
    }
    pass.set_scissor(0, 0, SIZE, SIZE);
    draw_corners(&mut pass, &probe, tested, [0.0, 0.0, 1.0, 0.0]);
    drop(pass);
    ring.end(rec).unwrap();
    let bytes = device.read_image(&color).unwrap();
    for ((state, z), pixel) in cases.iter().zip(bytes.chunks_exact(4)) {
        let State {
            cull,
            test,
            write,
            blend,
        } = state;
        assert!(
            pixel[..3]
                .iter()
                .zip(expected(*state, *z))
                .all(|(a, b)| a.abs_diff(b) <= 1),
            "{cull:?} {test:?} write {write} {blend:?} at {z}: {pixel:?}"
        );
    }
    drop((color, depth, pipelines, probe, ring));
    finish(device);
}

#[test]
fn draws_keep_their_own_state_whatever_was_drawn_before() {
    let Some(rich) = device(true) else { return };
    draws_keep_their_own_state(rich);
    draws_keep_their_own_state(poor_device().unwrap());
}
