//! What the sample promises, and that its map is one that engines accept.

use std::collections::BTreeSet;

use glam::{Vec2, Vec3};
use q3bsp::{Bsp, SurfaceKind, content_flags};

use super::*;
use crate::files::GameFiles;
use crate::materials::by_hand::MaterialsByHand;
use crate::materials::finish::Finish;
use crate::materials::light::{self, SurfaceClass};
use crate::occluders::Occluders;
use crate::{Materials, Options, RelitWorld, image, viewpoints};

fn bsp_of(sample: Sample) -> Bsp {
    let files = sample.files().unwrap();
    Bsp::parse(&files.read(sample.map()).unwrap().unwrap()).unwrap()
}

fn world_of(sample: Sample) -> RelitWorld {
    let files = sample.files().unwrap();
    let (materials, diagnostics) = Materials::load(&files);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    RelitWorld::load(&files, &materials, sample.map(), options).unwrap()
}

#[test]
fn the_map_is_valid_and_its_faces_look_inwards() {
    for (sample, fogs) in [(Sample::Hall, 1), (Sample::Surfaces, 0)] {
        let bsp = bsp_of(sample);
        assert_eq!(bsp.warnings, []);
        assert_eq!(bsp.fogs.len(), fogs);
        // ioquake3: SHADER_MAX_VERTEXES and SHADER_MAX_INDEXES
        for surface in &bsp.surfaces {
            assert!(surface.num_verts < 1000 && surface.num_indices < 6000);
        }
        // whichever way one looks, there is a surface, and one sees its front
        let occluders = Occluders::of_world(&world_of(sample));
        let entities = bsp.entities();
        let views = viewpoints::intermission(&entities)
            .into_iter()
            .chain(viewpoints::spawn_views(&entities));
        for eye in views
            .map(|view| view.origin)
            .chain([Vec3::new(0.0, 0.0, 196.0)])
        {
            for at in 0..2000 {
                let (z, turn) = (at as f32 / 1000.0 - 0.9995, at as f32 * 2.399_963);
                let direction = (Vec2::from_angle(turn) * (1.0 - z * z).sqrt()).extend(z);
                let hit = occluders.nearest(eye, direction, 4096.0);
                let hit = hit.unwrap_or_else(|| panic!("nothing from {eye} towards {direction}"));
                let place = eye + direction * hit.t;
                assert!(hit.front, "a back at {place} from {eye}");
            }
        }
    }
}

#[test]
fn players_stand_in_clusters_on_brushes() {
    let walls = [
        (Sample::Hall, Vec3::new(-455.0, 0.0, 90.0)),
        (Sample::Hall, Vec3::new(0.0, 144.0, 60.0)),
        (Sample::Hall, Vec3::new(60.0, 120.0, -8.0)),
        (Sample::Surfaces, Vec3::new(290.0, 0.0, 90.0)),
        (Sample::Surfaces, Vec3::new(0.0, 134.0, 40.0)),
    ];
    for sample in Sample::ALL {
        let bsp = bsp_of(sample);
        let solid = |p: Vec3| {
            bsp.brushes.iter().any(|brush| {
                let stops = bsp.shader(brush.shader).content_flags & content_flags::SOLID != 0;
                let inside = |side: &q3bsp::BrushSide| bsp.plane(side.plane).distance(p) <= 0.0;
                stops && bsp.sides_of(brush).iter().all(inside)
            })
        };
        let mut spawns = 0;
        for entity in bsp.entities() {
            if !entity.classname().starts_with("info_player") {
                continue;
            }
            let origin = entity.vec3("origin").unwrap();
            let cluster = bsp.cluster_at(origin);
            assert!(cluster >= 0, "{origin}");
            assert!(!solid(origin), "{origin}");
            if entity.classname() == "info_player_deathmatch" {
                spawns += 1;
                let below = (0..64).any(|down| solid(origin - Vec3::Z * down as f32));
                assert!(below, "{origin}: nothing to stand on");
            }
            // everyone sees everything: the hall has no closed rooms
            let clusters = bsp.num_clusters() as i32;
            assert!((0..clusters).all(|other| bsp.cluster_sees(cluster, other)));
        }
        assert!(spawns >= 4);
        for (_, wall) in walls.iter().filter(|(of, _)| *of == sample) {
            assert!(solid(*wall), "{wall}");
        }
    }
}

#[test]
fn every_promised_thing_is_there() {
    let world = world_of(Sample::Hall);
    assert_eq!(world.warnings, Vec::<String>::new());
    let patches = world
        .bsp
        .surfaces
        .iter()
        .filter(|s| s.kind == SurfaceKind::Patch);
    assert!(patches.count() > 10);
    let of_class = |class: SurfaceClass| {
        let is =
            |s: &&crate::WorldSurface| world.materials[s.material as usize].class.class == class;
        world.surfaces.iter().filter(is).count()
    };
    for class in [
        SurfaceClass::Mirror,
        SurfaceClass::Glass,
        SurfaceClass::Liquid,
        SurfaceClass::CutOut,
        SurfaceClass::Fog,
        SurfaceClass::Sky,
    ] {
        assert!(of_class(class) > 0, "{class:?}");
    }
    let shader = |name: &str| {
        let found = world.materials.iter().find(|m| m.name == name);
        &found.unwrap_or_else(|| panic!("{name}")).resolved.shader
    };
    assert_eq!(
        light::refraction_index(shader("sample/glass_ruby")),
        Some(light::INDEX_GLASS)
    );
    assert!(light::filters_light(shader("sample/glass_ruby")));
    assert_eq!(
        light::refraction_index(shader("sample/water")),
        Some(light::INDEX_WATER)
    );
    assert!(light::ripple_slope(shader("sample/water")) > 0.0);
    assert_eq!(light::ripple_slope(shader("sample/crystal")), 0.0);
    assert!(light::refraction_index(shader("sample/crystal")).is_some());
    let floor = shader("sample/floor");
    assert!(
        floor
            .stages
            .iter()
            .any(|stage| light::is_reflection(floor, stage))
    );
    // the mirror is one: an entity stands before it
    let (mirror, _) = furniture::MIRROR;
    let near = |e: &q3bsp::Entity| e.vec3("origin").is_some_and(|o| o.distance(mirror) < 64.0);
    let mut portals = world
        .bsp
        .entities()
        .into_iter()
        .filter(|e| e.classname() == "misc_portal_surface");
    assert!(portals.any(|e| near(&e)));
    assert!(world.suns.len() == 1 && world.suns[0].angular_radius > 0.005);
}

#[test]
fn lamps_have_colours_and_change_slowly() {
    let world = world_of(Sample::Hall);
    let mut colors = BTreeSet::new();
    let mut animated = 0;
    for material in world.materials.iter().filter(|m| !m.is_sky()) {
        let Some(emission) = material.emission else {
            continue;
        };
        let color = emission.strength / emission.strength.max_element();
        colors.insert(color.to_array().map(|c| (c * 4.0).round() as i32));
        animated += usize::from(material.resolved.shader.stages.iter().any(|stage| {
            matches!(stage.rgb_gen, shaderscript::RgbGen::Wave(wave) if wave.frequency <= 0.5)
        }));
    }
    assert!(colors.len() >= 3, "{colors:?}");
    assert!(animated >= 2);
    // the script's sun is the one that the lightmaps show
    assert!(world.suns[0].direction.distance(super::light::SUN) < 1e-3);
}

#[test]
fn images_have_their_size_and_detail() {
    let files = Sample::Hall.files().unwrap();
    for (name, _) in textures::images() {
        let (picture, _) = image::load(&files, &name).unwrap().unwrap();
        let side = picture.width as usize;
        assert_eq!(picture.height as usize, side, "{name}");
        assert!(
            (textures::SMALL / 4..=textures::LARGE).contains(&side),
            "{name}"
        );
    }
    for wall in ["stone_image", "floor_image", "clouds"] {
        let name = format!("sample/{wall}.tga");
        let (picture, _) = image::load(&files, &name).unwrap().unwrap();
        assert_eq!(picture.width as usize, textures::LARGE, "{name}");
        let colors: BTreeSet<_> = picture.rgba.chunks_exact(4).collect();
        assert!(colors.len() > 1000, "{name}: {} colours", colors.len());
    }
}

#[test]
fn the_same_game_every_time() {
    for sample in Sample::ALL {
        assert!(sample.entries() == sample.entries());
    }
}

#[test]
fn surfaces_are_stated_by_files_and_images() {
    let files = Sample::Surfaces.files().unwrap();
    let (materials, diagnostics) = Materials::load(&files);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let (stated, faults) = MaterialsByHand::load(&files, Sample::Surfaces.map());
    assert_eq!(faults, Vec::<String>::new());
    let world = world_of(Sample::Surfaces);
    let names: Vec<&str> = world.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(
        stated.unmatched(Sample::Surfaces.map(), &names),
        Vec::<String>::new()
    );
    let finish = |name: &str| {
        let material = world.materials.iter().find(|m| m.name == name).unwrap();
        let exists = |image: &str| image::find(&files, image).is_some();
        let of_pack = materials.of_pack(name, &material.resolved.shader, &exists);
        stated.finish(name, &of_pack)
    };
    let brick = finish("surfaces/brick");
    assert!(brick.normals.is_some() && brick.surface.is_some_and(|map| map.is_specular()));
    let floor = finish("surfaces/floor");
    assert!(floor.normals.is_some() && floor.surface.is_some());
    assert_eq!(finish("surfaces/plaster"), Finish::default());
    let ball = finish("surfaces/metal3");
    assert_eq!((ball.roughness, ball.metal), (Some(0.5), Some(1.0)));
    assert!(finish("surfaces/frosted").glass.is_some());
    // most of it is the vertices of the balls
    let bytes: usize = Sample::Surfaces
        .entries()
        .iter()
        .map(|(_, bytes)| bytes.len())
        .sum();
    assert!(bytes < 2_500_000, "{bytes}");
}

#[test]
fn stored_light_has_colours_and_shadows() {
    let bsp = bsp_of(Sample::Hall);
    assert!(
        (1..=4).contains(&bsp.lightmaps.len()),
        "{}",
        bsp.lightmaps.len()
    );
    let texels = || {
        bsp.lightmaps
            .iter()
            .flat_map(|page| page.0.as_chunks::<3>().0)
    };
    let lit = texels().filter(|t| **t != [0; 3]).count();
    let share = |test: fn(&[i32; 3]) -> bool| {
        let found = texels().filter(|t| test(&t.map(i32::from))).count();
        found as f32 / lit as f32
    };
    assert!(
        share(|[r, g, b]| r.max(g).max(b) > &250) < 0.02,
        "too bright"
    );
    assert!(
        share(|[r, g, b]| *r > 2 * b && g > &20) > 0.01,
        "no warm light"
    );
    assert!(
        share(|[r, g, b]| *b > r + r / 2 && g > &20) > 0.01,
        "no cold light"
    );
    assert!(
        share(|[r, g, b]| r + g + b > 10 && r.max(g).max(b) < &16) > 0.1,
        "no shadow"
    );
    assert!(bsp.light_grid().is_some());
}
