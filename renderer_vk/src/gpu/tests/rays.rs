//! Acceleration structures, traced by pipeline and by query, and devices without them.

use super::support::{collect, device, finish};
use crate::gpu::*;
use bytemuck::{Pod, Zeroable};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Rays {
    hits: u64,
    scene: u32,
    size: u32,
}

/// Expected result of the ray through pixel (x, y) of 64: two instances of a triangle that covers x + y < 1 of the unit
/// square, scaled to a half and moved; candidates whose first barycentric is below 0.25 are holes.
fn expected(x: usize, y: usize) -> [u32; 4] {
    let (px, py) = ((x as f32 + 0.5) / 64.0, (y as f32 + 0.5) / 64.0);
    for (custom, ox, oy) in [(7, 0.0, 0.0), (9, 0.5, 0.5)] {
        let (u, v) = ((px - ox) * 2.0, (py - oy) * 2.0);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            // Counter-clockwise from above, the rays' origin: the front.
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
        let why = format!("{} has no ray tracing", info.name);
        testkit::absent(testkit::Need::Gpu, why);
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
    // Frame 0 has an empty scene; later ones grow, so that storage is reallocated while frames are in flight.
    for frame in 0..4usize {
        for by_query in [false, true] {
            let mut rec = ring.begin().unwrap();
            let mut pass = rec
                .pass("build", Access::ACCEL_BUILD, Access::ACCEL_BUILD)
                .unwrap();
            // a refit of a structure that was never built is a build
            pass.build_blas(&mut [BlasBuild {
                blas: &mut moving,
                geometries: &geometry,
                refit: true,
            }])
            .unwrap();
            // a static structure: built in the first frame, compacted two frames later
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
                // Outside of the view; many of them in the end.
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
    // Rays are declared, but none is traced: the pass must not name stages of the absent extension.
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
