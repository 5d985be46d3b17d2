//! Tests of assets and worlds on any Vulkan device, with the validation layer if it is installed.
//!
//! Without a device each test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

use std::sync::Arc;

use crate::api::RefDef;
use crate::assets::{Assets, ImageFlags, ImageSource, Samplers};
use crate::gpu::{Device, DeviceOptions, SurfaceSource};
use crate::scene::{GatherInput, Geometry, Scene};
use crate::world::{World, WorldError};
use crate::{Settings, TextureMode};
use relight::{GameFiles, MemoryFiles};

/// A headless device, or `None` with a report of a skipped test.
fn device() -> Option<Device> {
    let options = DeviceOptions {
        app_name: "asset tests".to_owned(),
        validation: true,
        ..DeviceOptions::default()
    };
    testkit::device(Device::new(&options, SurfaceSource::Headless))
}

fn assets(device: &Device, files: MemoryFiles, settings: &Settings) -> Assets {
    let files: Arc<dyn GameFiles> = Arc::new(files);
    let scripts = Arc::new(relight::Materials::load(&*files).0);
    Assets::new(device, files, scripts, settings).unwrap()
}

/// Checks that the validation layer is silent and that all dropped objects are freed.
fn finish(device: &Device) {
    device.wait_idle().unwrap();
    let messages = device.validation_messages();
    assert!(messages.is_empty(), "validation: {messages:#?}");
    assert_eq!(device.graveyard_len(), 0, "objects that never died");
}

const PIXEL: &[u8] = &[
    0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0, 10, 20, 30,
];

#[test]
fn textures_are_found_once_and_videos_grow() {
    let Some(device) = device() else { return };
    let mut files = MemoryFiles::new();
    files.insert("t/a.tga", PIXEL).unwrap();
    files.insert("t/text.tga", b"no picture").unwrap();
    files
        .insert("scripts/t.shader", "t/film\n{\n{\nvideoMap x.roq\n}\n}\n")
        .unwrap();
    let settings = Settings::full_size();
    let mut assets = assets(&device, files, &settings);

    let found = assets.textures.find("t/a", ImageFlags::WORLD).unwrap();
    assert_eq!(assets.textures.find("t/a", ImageFlags::NO_MIP), Some(found));
    // another spelling is another image, as in the engine
    let other = assets.textures.find("t/a.tga", ImageFlags::WORLD).unwrap();
    assert_ne!(found, other);
    assert_eq!(assets.textures.find("t/none", ImageFlags::WORLD), None);
    assert_eq!(assets.textures.find("t/text.tga", ImageFlags::WORLD), None);
    let mean = assets.textures.mean(found);
    assert!(mean.x > mean.z && mean.w == 1.0, "{mean}");
    assert_eq!(assets.register_shader("t/a", true), 4);
    assert_eq!(assets.register_shader("t/none", true), 0);
    assert_eq!(assets.register_model("m/none.md3"), 0);
    assert_eq!(assets.register_skin("m/none.skin"), 0);

    let film = assets.register_shader("t/film", true);
    let material = assets.material_of_handle(film);
    let (name, client) = {
        let (name, client) = assets.materials.videos().next().unwrap();
        (name.to_owned(), client)
    };
    assert_eq!(name, "x.roq");
    let shown = |assets: &Assets| {
        let stage = assets.materials.stages(assets.materials.get(material))[0];
        assets.materials.arrays().images[stage.image_first as usize]
    };
    assert_eq!(shown(&assets), assets.textures.black());
    let picture = vec![200; 16 * 16 * 4];
    assets
        .update_scratch(client, 16, 16, &picture, true)
        .unwrap();
    let first = shown(&assets);
    assert_eq!(first, assets.textures.scratch(client));
    assert_ne!(first, assets.textures.black());
    assets
        .update_scratch(client, 16, 16, &picture, true)
        .unwrap();
    assert_eq!(shown(&assets), first, "the same size keeps its texture");
    assets.update_scratch(client, 8, 8, &picture, true).unwrap();
    assert_eq!(shown(&assets), assets.textures.scratch(client));
    // too little data changes nothing
    assets
        .update_scratch(client, 64, 64, &picture, true)
        .unwrap();
    assets.update_scratch(client, 0, 0, &[], true).unwrap();

    assets.prepare_frame(&settings).unwrap();
    let addresses = assets.materials.addresses();
    assert!(addresses.materials != 0 && addresses.stages != 0 && addresses.noise != 0);
    assets.prepare_frame(&settings).unwrap();
    assert_eq!(assets.materials.addresses(), addresses, "nothing changed");
    let nearest = Settings {
        texture_mode: TextureMode::Nearest,
        ..settings
    };
    let before = assets.samplers;
    assets.prepare_frame(&nearest).unwrap();
    assert_ne!(assets.samplers, before);
    assert_eq!(assets.samplers.0[2..], before.0[2..]);
    drop(assets);
    finish(&device);
}

#[test]
fn samplers_are_numbered_from_zero() {
    let Some(device) = device() else { return };
    let samplers = Samplers::new(&device, TextureMode::LinearMipLinear, 0.0).unwrap();
    assert_eq!(samplers, Samplers([0, 1, 2, 3, 4]));
    finish(&device);
}

#[test]
fn the_sample_map_loads_and_gathers() {
    let Some(device) = device() else { return };
    let settings = Settings::full_size();
    let mut assets = assets(
        &device,
        relight::sample::Sample::Hall.files().unwrap(),
        &settings,
    );
    let missing = World::load(&device, &mut assets, "maps/none.bsp", &settings);
    assert!(matches!(missing, Err(WorldError::Map(_))));
    let world = World::load(
        &device,
        &mut assets,
        relight::sample::Sample::Hall.map(),
        &settings,
    )
    .unwrap();
    assert!(world.vertex_buffer.size() as usize >= size_of_val(world.vertices.as_slice()));
    let bytes = device
        .read_buffer(&world.index_buffer, 0, world.indices.len() as u64 * 4)
        .unwrap();
    let back: Vec<u32> = bytes
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    assert_eq!(back, world.indices);

    let mut scene = Scene::default();
    let def = RefDef {
        time_ms: 1000,
        ..RefDef::default()
    };
    let views = scene
        .gather_classic(&GatherInput::new(Some(&world), &assets, &settings), &def)
        .unwrap();
    let view = views.last().unwrap();
    assert!(view.has_world && !view.look.surfaces.is_empty());
    let lightmapped = view.look.surfaces.iter().filter(|s| s.lightmap != u32::MAX);
    assert!(lightmapped.count() > 0);
    let drawn = view.look.surfaces.iter().all(|s| match s.geometry {
        Geometry::Static { index_count, .. } | Geometry::Dynamic { index_count, .. } => {
            index_count > 0
        }
    });
    assert!(drawn);
    scene.recycle_classic(views);
    drop((world, assets));
    finish(&device);
}
