//! Buffers, images and textures: uploads, compute shaders that read and write them, levels, sampling by index.

use super::support::{collect, device, finish, image, readback};
use crate::gpu::upload::ImageRegion;
use crate::gpu::*;
use bytemuck::{Pod, Zeroable};

#[test]
fn buffers_keep_what_was_uploaded() {
    let Some(device) = device(true) else { return };
    println!("{:#?}", device.info());
    let data: Vec<u32> = (0..100_000).collect();
    let buffer = Buffer::with_data(&device, "numbers", BufferUsage::STORAGE, &data).unwrap();
    // A later upload to the same range overwrites an earlier one, also within one batch.
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
    let added = [(shaders::constant_ids::test::fill::ADDED, 5)];
    let pipeline = ComputePipeline::new(&device, "fill", &shaders::TEST_FILL_COMP, &added).unwrap();
    // Another compilation of the same file, requested by a comment in it.
    let twice =
        ComputePipeline::new(&device, "twice", &shaders::TEST_FILL_COMP_TWICE, &added).unwrap();
    let usage = ImageUsage::STORAGE | ImageUsage::SAMPLED;
    let image = image(&device, "target", [61, 35], Format::Rgba32F, usage);
    let result = readback(&device, "result", 4);
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
            // A discarded frame has no effect.
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
    let texel = |x, y| ImageRegion {
        mip: 0,
        layer: 0,
        x,
        y,
        width: 1,
        height: 1,
    };
    device
        .upload_image_region(&image, texel(3, 2), &[1, 2, 3, 4])
        .unwrap();
    assert!(
        device
            .upload_image_region(&image, texel(4, 0), &[0; 4])
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

#[test]
fn texels_are_the_same_in_another_format() {
    let Some(device) = device(true) else { return };
    let two = |other_format| ImageDesc {
        other_format: Some(other_format),
        ..ImageDesc::new("two", 8, 8, Format::Rgba16F, ImageUsage::STORAGE)
    };
    let before = device.memory_report().allocated;
    let halves = Image::new(&device, &two(Format::Rg32Uint)).unwrap();
    let one = device.memory_report().allocated - before;
    let words = halves.in_other_format().unwrap();
    assert_eq!(device.memory_report().allocated - before, one);
    assert_eq!(words.format(), Format::Rg32Uint);
    assert_ne!(words.storage_index(), halves.storage_index());
    assert_eq!(words.owner().storage_index(), halves.storage_index());
    // the texels live as long as one of both
    drop(halves);
    device
        .immediate(|recorder| {
            let mut pass = recorder.pass("clear", Access::TRANSFER, Access::TRANSFER)?;
            pass.clear_image(words.owner(), [1.0, 2.0, -1.0, 0.0]);
            Ok(())
        })
        .unwrap();
    let texels: Vec<[u16; 4]> = collect(&device.read_image(&words).unwrap());
    assert_eq!(texels, [[0x3C00, 0x4000, 0xBC00, 0]; 64]);
    drop(words);
    device.wait_idle().unwrap();
    assert_eq!(device.memory_report().allocated, before);

    assert!(
        Image::new(&device, &two(Format::R32Uint)).is_err(),
        "half of the size"
    );
    let usage = ImageUsage::STORAGE;
    let plain = Image::new(
        &device,
        &ImageDesc::new("one", 8, 8, Format::Rgba16F, usage),
    )
    .unwrap();
    assert!(plain.in_other_format().is_err());
    assert_eq!(plain.owner().storage_index(), plain.storage_index());
    finish(device);
}
