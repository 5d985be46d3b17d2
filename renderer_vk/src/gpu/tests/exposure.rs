//! Functions of `relight::exposure` and `relight::overbright` that repeat those of the shaders.

use super::support::{collect, compute, device, finish, readback};
use crate::gpu::*;
use relight::exposure::{BRIGHT_PART, DARK_PART, DARKEST, tone_curve};
use relight::overbright::{from_linear, to_linear};
use shaders::trace_types::FilterStep;

#[test]
fn constants_and_curves_are_those_of_the_shaders() {
    let Some(device) = device(false) else { return };
    let shader = &shaders::TEST_EXPOSURE_COMP;
    let pipeline = ComputePipeline::new(&device, "exposure", shader, &[]).unwrap();
    const STEPS: u32 = 256;
    let mut expected = vec![DARKEST, DARK_PART, BRIGHT_PART];
    for step in 0..STEPS {
        let x = step as f32 / 64.0;
        expected.extend([tone_curve(x), to_linear(x), from_linear(x)]);
    }
    let mut bytes = vec![0; size_of_val(&expected[..])];
    let buffer = readback(&device, "results", bytes.len());
    let push = FilterStep {
        target: buffer.address(),
        spacing: STEPS,
        ..FilterStep::default()
    };
    compute(&device, &pipeline, &push, STEPS);
    buffer.read(0, &mut bytes).unwrap();
    let found: Vec<f32> = collect(&bytes);
    for (found, expected) in found.iter().zip(&expected) {
        let near = (found - expected).abs() <= 1e-5 * expected.abs().max(1.0);
        assert!(near, "{found}, not {expected}");
    }
    drop((pipeline, buffer));
    finish(device);
}
