//! Real maps: they are lit, and equal for every estimator. `RELIGHT_TRACE_PICTURES=folder` stores the pictures;
//! `RELIGHT_TRACE_MAPS=a,b` selects maps, `RELIGHT_TRACE_FRAMES=n` the number of frames, `RELIGHT_TRACE_LIVE` the
//! denoiser in place of accumulation.

use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;
use relight::GameFiles;

use super::harness::Gpu;
use crate::api::RefDef;
use crate::assets::Assets;
use crate::gpu::ColorMask;
use crate::gpu::{Format, Image, ImageDesc, ImageUsage};
use crate::raster::FlareTest;
use crate::scene::{GatherInput, Scene};
use crate::settings::{Look, MapLightChoice, Settings, TracerChoice};
use crate::test_support::openarena;
use crate::trace::ahead::compile_ahead;
use crate::trace::pass_set::PassSet;
use crate::trace::tracer::Tracer;
use crate::trace::{MapView, TraceLook};
use crate::world::World;

const SIZE: [u32; 2] = [320, 240];

/// The view of the first spawn point.
fn camera(world: &World) -> RefDef {
    let entities = world.data.relit.bsp.entities();
    let find = |class: &str| entities.iter().find(|e| e.get("classname") == Some(class));
    let place = find("info_player_deathmatch").or_else(|| find("team_CTF_redspawn"));
    let origin = place.and_then(|e| e.vec3("origin")).unwrap_or(Vec3::ZERO) + Vec3::Z * 26.0;
    let angles = place.and_then(|e| e.vec3("angles")).unwrap_or_else(|| {
        let yaw = place
            .and_then(|e| e.get("angle"))
            .and_then(|v| v.parse().ok());
        Vec3::new(0.0, yaw.unwrap_or(0.0), 0.0)
    });
    let [pitch, yaw] = [angles.x.to_radians(), angles.y.to_radians()];
    let forward = Vec3::new(
        pitch.cos() * yaw.cos(),
        pitch.cos() * yaw.sin(),
        -pitch.sin(),
    );
    let left = Vec3::new(-yaw.sin(), yaw.cos(), 0.0);
    RefDef {
        width: SIZE[0] as i32,
        height: SIZE[1] as i32,
        fov_x: 90.0,
        fov_y: 73.74,
        view_origin: origin,
        view_axis: [forward, left, forward.cross(left)],
        time_ms: 1000,
        ..RefDef::default()
    }
}

/// The game's files and materials, with a device.
struct Game {
    files: Arc<dyn GameFiles>,
    scripts: Arc<relight::Materials>,
    gpu: Gpu,
}

impl Game {
    fn new(tracer: Tracer) -> Option<Self> {
        let files: Arc<dyn GameFiles> = Arc::new(openarena()?);
        let gpu = Gpu::new(tracer)?;
        let scripts = Arc::new(relight::Materials::load(&*files).0);
        Some(Self {
            files,
            scripts,
            gpu,
        })
    }

    fn load(&self, map: &str, settings: &Settings) -> (Assets, World) {
        let (files, scripts) = (Arc::clone(&self.files), Arc::clone(&self.scripts));
        let device = &self.gpu.device;
        let mut assets = Assets::new(device, files, scripts, settings).expect("assets");
        let name = format!("maps/{map}");
        let world = World::load(device, &mut assets, &name, settings).expect("map");
        (assets, world)
    }

    /// Draws frames of the view of the first spawn point: the last picture, and the look.
    fn draw(
        &mut self,
        (assets, world): (&mut Assets, &World),
        passes: &Arc<PassSet>,
        settings: &Settings,
        [width, height]: [u32; 2],
        frames: u32,
    ) -> (Vec<u8>, TraceLook) {
        let device = &self.gpu.device;
        let mut look =
            TraceLook::new(passes, settings.rt_grid_cells, world, assets).expect("structures");
        compile_ahead(passes, settings, look.needs(world, assets)).expect("pipelines");
        let ahead = device.compiled_pipelines();
        assets
            .materials
            .upload(device, &assets.samplers)
            .expect("materials");
        let def = RefDef {
            width: width as i32,
            height: height as i32,
            ..camera(world)
        };
        let view = Scene::default()
            .gather_traced(&GatherInput::new(Some(world), assets, settings), &def)
            .expect("view");
        let usage = ImageUsage::STORAGE | ImageUsage::COLOR;
        let desc = ImageDesc::new("picture", width, height, Format::Rgba8, usage);
        let target = Image::new(device, &desc).expect("image");
        for _ in 0..frames {
            let mut rec = self.gpu.ring.begin().expect("frame");
            look.record(
                &mut rec,
                MapView {
                    scene: &view,
                    world,
                    assets,
                    settings,
                    target: &target,
                    flares: FlareTest::default(),
                    mask: ColorMask::ALL,
                },
            )
            .expect("recorded");
            self.gpu.ring.end(rec).expect("submitted");
        }
        device.wait_idle().expect("done");
        // those of the draws of first hits are compiled by the first frame that needs them
        let draws = if settings.rt_first_hits { 2 } else { 0 };
        let compiled = device.compiled_pipelines();
        assert_eq!(compiled, ahead + draws, "passes that a frame compiled");
        (device.read_image(&target).expect("read"), look)
    }
}

#[test]
fn maps_are_lit() {
    let Some(mut game) = Game::new(Tracer::Compute) else {
        return;
    };
    let device = &game.gpu.device.clone();
    let frames: u32 = std::env::var("RELIGHT_TRACE_FRAMES")
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(4);
    let chosen = std::env::var("RELIGHT_TRACE_MAPS").ok();
    let maps: Vec<String> = match &chosen {
        Some(list) => list.split(',').map(|m| format!("{m}.bsp")).collect(),
        None => game
            .files
            .list("maps", ".bsp")
            .into_iter()
            .step_by(30)
            .collect(),
    };
    let settings = Settings {
        rt: Look::Traced,
        rt_accumulate: std::env::var_os("RELIGHT_TRACE_LIVE").is_none(),
        ..Settings::full_size()
    };
    let passes = Arc::clone(&game.gpu.passes);
    for map in maps {
        let (mut assets, mut world) = game.load(&map, &settings);
        world.light_by(settings.rt_lights, &mut assets, None);
        let drawn = (&mut assets, &world);
        let (pixels, look) = game.draw(drawn, &passes, &settings, SIZE, frames);
        let hdr: Vec<f32> = bytemuck::pod_collect_to_vec(
            &device
                .read_image(look.hdr().expect("traced"))
                .expect("read"),
        );
        let radiance = hdr.chunks_exact(4).map(|p| p[1]).sum::<f32>() / (hdr.len() / 4) as f32;
        let mean = pixels.chunks_exact(4).map(|p| f32::from(p[1])).sum::<f32>()
            / (pixels.len() / 4) as f32;
        let relit = &world.data.relit;
        println!(
            "{map}: mean green {mean:.1} of 255, mean radiance {radiance:.3}; {} lights {} points {} suns {} clusters; {:?}",
            relit.lights.len(),
            relit.point_lights.len(),
            relit.suns.len(),
            relit.light_lists.clusters(),
            device.timings()
        );
        if let Some(folder) = std::env::var_os("RELIGHT_TRACE_PICTURES") {
            let path = PathBuf::from(folder).join(map.replace(".bsp", ".png"));
            image::save_buffer(path, &pixels, SIZE[0], SIZE[1], image::ColorType::Rgba8)
                .expect("saved");
        }
        // a single view may be dark
        assert!(mean > 0.5 && mean < 230.0, "{map}: {mean}");
        let mut colors: Vec<&[u8]> = pixels.chunks_exact(4).collect();
        colors.sort_unstable();
        colors.dedup();
        assert!(colors.len() > 100, "{map}: {} colours", colors.len());
    }
    game.gpu.check_messages();
}

#[test]
fn tracers_agree_on_maps() {
    let Some(mut game) = Game::new(Tracer::Pipeline) else {
        return;
    };
    let device = &game.gpu.device.clone();
    let maps: Vec<String> = game.files.list("maps", ".bsp");
    for map in maps.iter().skip(32).take(1) {
        let mut pictures: Vec<Vec<u8>> = Vec::new();
        for rt_tracer in [
            TracerChoice::Pipeline,
            TracerChoice::Query,
            TracerChoice::Compute,
            TracerChoice::Grid,
        ] {
            let settings = Settings {
                rt: Look::Traced,
                rt_accumulate: true,
                rt_bounces: 1,
                rt_auto_exposure: false,
                rt_tracer,
                ..Settings::full_size()
            };
            let tracer = Tracer::of(device.info(), rt_tracer);
            let passes = Arc::new(PassSet::new(device, tracer));
            let (mut assets, world) = game.load(map, &settings);
            let drawn = (&mut assets, &world);
            let (pixels, look) = game.draw(drawn, &passes, &settings, [64, 48], 2);
            pictures.push(pixels);
            // the cost of the second frame is available when its place in the ring is used again
            let ring = &mut game.gpu.ring;
            ring.begin().and_then(|rec| ring.end(rec)).expect("frame");
            let passes = [
                "trace_primary_rays",
                "trace_primary",
                "trace_direct",
                "trace_bounce_rays",
            ];
            let timings = device.timings();
            let took: Vec<_> = timings
                .iter()
                .filter(|(name, _)| passes.contains(&name.as_str()))
                .collect();
            println!("{map} {rt_tracer:?}: {took:?}; {:?}", look.accel_memory());
        }
        let differing = |other: &[u8]| {
            let pairs = pictures[0].chunks_exact(4).zip(other.chunks_exact(4));
            pairs
                .filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 4))
                .count()
        };
        let lit = pictures[0].chunks_exact(4).filter(|p| p[1] > 8).count();
        assert!(lit > 100, "{map}: {lit}");
        for (other, name) in pictures[1..].iter().zip(["query", "compute", "grid"]) {
            let count = differing(other);
            println!("{map}: {count} of {} differ with {name}", 64 * 48);
            // rays that graze an edge may hit or miss it, with all consequences
            assert!(count < 64 * 48 / 40, "{map} {name}: {count}");
        }
    }
    game.gpu.check_messages();
}

/// Share of pixels that differ from rays by more than a step of 4 of 255: those at edges.
#[test]
fn first_hits_of_a_map_are_those_of_rays() {
    for tracer in [Tracer::Pipeline, Tracer::Query, Tracer::Compute] {
        let Some(mut game) = Game::new(tracer) else {
            return;
        };
        let passes = Arc::clone(&game.gpu.passes);
        let [traced, drawn] = [false, true].map(|rt_first_hits| {
            let settings = Settings {
                rt: Look::Traced,
                rt_accumulate: true,
                rt_antialiasing: false,
                rt_auto_exposure: false,
                rt_bounces: 0,
                rt_lights: MapLightChoice::Prior,
                rt_first_hits,
                ..Settings::full_size()
            };
            let (mut assets, mut world) = game.load("oa_dm1.bsp", &settings);
            world.light_by(settings.rt_lights, &mut assets, None);
            game.draw((&mut assets, &world), &passes, &settings, SIZE, 1)
                .0
        });
        let pairs = traced.chunks_exact(4).zip(drawn.chunks_exact(4));
        let differs = |(a, b): &(&[u8], &[u8])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 4);
        let count = pairs.filter(differs).count();
        let pixels = traced.len() / 4;
        println!("{tracer:?}: {count} of {pixels} differ");
        assert!(count < pixels / 1000, "{tracer:?}: {count}");
        game.gpu.check_messages();
    }
}
