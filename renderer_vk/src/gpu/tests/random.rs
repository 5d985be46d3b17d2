//! The shaders' random numbers: stratified over frames, otherwise independent.

use super::support::{collect, compute, device, finish, readback};
use crate::gpu::*;
use bytemuck::{Pod, Zeroable};

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Drawn {
    pair: [f32; 2],
    single: f32,
    second_pair: [f32; 2],
    independent: f32,
    picked: u32,
    left: f32,
    happened: u32,
    last: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    draws: u64,
    first: u32,
    count: u32,
    pixels: u32,
    stream: u32,
}

struct Source {
    device: Device,
    pipeline: ComputePipeline,
}

impl Source {
    fn new() -> Option<Self> {
        let device = device(true)?;
        Some(Self {
            pipeline: ComputePipeline::new(&device, "random", &shaders::TEST_RANDOM_COMP, &[])
                .unwrap(),
            device,
        })
    }

    /// The numbers of each of `pixels` pixels in `count` frames from `first` on, frame by frame.
    fn draw(&self, first: u32, count: u32, pixels: u32, stream: u32) -> Vec<Drawn> {
        let size = (count * pixels) as usize * size_of::<Drawn>();
        let draws = readback(&self.device, "draws", size);
        let push = Push {
            draws: draws.address(),
            first,
            count,
            pixels,
            stream,
        };
        compute(&self.device, &self.pipeline, &push, count * pixels);
        let mut bytes = vec![0; size];
        draws.read(0, &mut bytes).unwrap();
        collect(&bytes)
    }

    fn finish(self) {
        drop(self.pipeline);
        finish(self.device);
    }
}

/// Asserts that each of the equal intervals of [0, 1) holds one of the numbers.
fn assert_one_each(numbers: impl ExactSizeIterator<Item = f32>, what: &str) {
    let count = numbers.len();
    let mut met = vec![false; count];
    for number in numbers {
        let interval = (number * count as f32) as usize;
        assert!(
            !std::mem::replace(&mut met[interval], true),
            "{what}: {number} is the second in its interval of {count}"
        );
    }
}

#[test]
fn each_elementary_interval_has_one_point_of_a_row_of_frames() {
    let Some(source) = Source::new() else {
        return;
    };
    // the first frames, and runs of 2^k frames that begin at a multiple of 2^k, late enough to use all digits
    for first in [0, 1 << 10, 0xABCD_E400] {
        for drawn in source.draw(first, 1 << 10, 3, 5).chunks(1 << 10) {
            for k in 0..=10 {
                for row in drawn.chunks(1 << k) {
                    assert_one_each(row.iter().map(|d| d.single), "single");
                    for pair in [|d: &Drawn| d.pair, |d: &Drawn| d.second_pair] {
                        for across in 0..=k {
                            // number of the box that a point lies in
                            let (wide, high) = ((1 << across) as f32, (1 << (k - across)) as f32);
                            let boxes = row.iter().map(|d| {
                                let [x, y] = pair(d);
                                let number = (x * wide).floor() * high + (y * high).floor();
                                (number + 0.5) / (wide * high)
                            });
                            assert_one_each(boxes, "pair");
                        }
                    }
                }
            }
        }
    }
    source.finish();
}

/// Asserts that pairs of numbers are distributed over the unit square as independent ones are.
fn assert_independent(pairs: impl Iterator<Item = (f32, f32)>, what: &str) {
    const SIDE: usize = 8;
    let mut boxes = [0.0f64; SIDE * SIDE];
    let mut count = 0.0;
    for (x, y) in pairs {
        assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y), "{what}");
        boxes[(x * SIDE as f32) as usize * SIDE + (y * SIDE as f32) as usize] += 1.0;
        count += 1.0;
    }
    let expected = count / boxes.len() as f64;
    let squares: f64 = boxes
        .iter()
        .map(|n| (n - expected).powi(2) / expected)
        .sum();
    // for 64 boxes the mean is 63, the deviation 11.2; six deviations do not occur
    assert!(squares < 63.0 + 6.0 * 11.2, "{what}: chi squared {squares}");
}

#[test]
fn random_numbers_of_one_frame_are_independent() {
    let Some(source) = Source::new() else {
        return;
    };
    const PIXELS: u32 = 64 * 256;
    for frame in [0, 1, 77] {
        let drawn = source.draw(frame, 1, PIXELS, 1);
        let other = source.draw(frame, 1, PIXELS, 2);
        let next = source.draw(frame + 2, 1, PIXELS, 1);
        let independent = |what, of: &dyn Fn(usize) -> (f32, f32)| {
            assert_independent((0..drawn.len() - 64).map(of), what);
        };
        independent("in a pair", &|i| drawn[i].pair.into());
        independent("in another", &|i| drawn[i].second_pair.into());
        independent("pairs", &|i| (drawn[i].pair[0], drawn[i].second_pair[0]));
        independent("pairs across", &|i| {
            (drawn[i].pair[1], drawn[i].second_pair[0])
        });
        independent("single", &|i| (drawn[i].pair[0], drawn[i].single));
        independent("kinds", &|i| (drawn[i].single, drawn[i].independent));
        independent("passes", &|i| (drawn[i].pair[0], other[i].pair[0]));
        independent("passes, single", &|i| (drawn[i].single, other[i].single));
        independent("a pixel and that beside it", &|i| {
            (drawn[i].pair[0], drawn[i + 1].pair[0])
        });
        independent("a pixel and that below", &|i| {
            (drawn[i].single, drawn[i + 64].single)
        });
        independent("frames", &|i| (drawn[i].independent, next[i].independent));
        independent("what a choice leaves", &|i| {
            (
                (drawn[i].picked as f32 + drawn[i].single) / 7.0,
                drawn[i].left,
            )
        });
        independent("what a decision leaves", &|i| {
            (drawn[i].last, drawn[i].single)
        });
    }
    source.finish();
}

#[test]
fn random_sequences_of_a_pixel_are_independent() {
    let Some(source) = Source::new() else {
        return;
    };
    for pixel in source.draw(0, 1 << 14, 4, 1).chunks(1 << 14) {
        let independent = |what, of: &dyn Fn(&Drawn) -> (f32, f32)| {
            assert_independent(pixel.iter().map(of), what);
        };
        independent("pairs", &|d| (d.pair[0], d.second_pair[0]));
        independent("pairs across", &|d| (d.pair[1], d.second_pair[0]));
        independent("second numbers", &|d| (d.pair[1], d.second_pair[1]));
        independent("single", &|d| (d.pair[0], d.single));
        // a selection by one number from frame to frame does not select by another
        independent("choice", &|d| {
            ((d.picked as f32 + d.independent) / 7.0, d.single)
        });
        // every fourth frame is like all frames: passes that alternate over frames get all parts of the numbers
        for turn in 0..4 {
            let frames = pixel.iter().skip(turn).step_by(4);
            assert_independent(frames.clone().map(|d| d.pair.into()), "turns, pairs");
            assert_independent(frames.map(|d| (d.single, d.independent)), "turns");
        }
    }
    source.finish();
}

#[test]
fn choices_by_one_number_take_their_share_and_leave_it_uniform() {
    let Some(source) = Source::new() else {
        return;
    };
    const FRAMES: u32 = 7 << 9;
    for pixel in source.draw(0, FRAMES, 4, 1).chunks(FRAMES as usize) {
        for choice in 0..7 {
            let chosen: Vec<_> = pixel.iter().filter(|d| d.picked == choice).collect();
            // an interval deviates by a few of the points near its ends
            let share = chosen.len() as f32 / FRAMES as f32 * 7.0;
            assert!((share - 1.0).abs() < 0.02, "{choice}: {share}");
            let mean = chosen.iter().map(|d| d.left).sum::<f32>() / chosen.len() as f32;
            assert!((mean - 0.5).abs() < 0.01, "{choice}: {mean}");
        }
        for happened in [0, 1] {
            let those: Vec<_> = pixel.iter().filter(|d| d.happened == happened).collect();
            let share = those.len() as f32 / FRAMES as f32;
            let chance = if happened == 1 { 0.3 } else { 0.7 };
            assert!((share - chance).abs() < 0.01, "{happened}: {share}");
            let mean = those.iter().map(|d| d.last).sum::<f32>() / those.len() as f32;
            assert!((mean - 0.5).abs() < 0.01, "{happened}: {mean}");
        }
    }
    source.finish();
}
