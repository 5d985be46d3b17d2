//! Maps of the game itself, where its data is there.

use crate::calibrate::CalibrationOptions;
use crate::files::{GameFiles, Pk3, SearchPath};
use crate::load::*;
use crate::materials::Materials;
use crate::world::*;

/// Every map of OpenArena has light, everything is finite, and no light is missing from a list: checked from the
/// places where entities stand, against the visibility matrix itself.
#[test]
fn every_openarena_map_has_light() {
    let Some(game) = testkit::game() else {
        return;
    };
    let files = SearchPath::open(&[&game.folder]).unwrap();
    let (materials, _) = Materials::load(&files);
    let maps = files.list("maps", ".bsp");
    // every map takes a minute and a half of two cores
    let step = if testkit::is_set("RELIGHT_FULL") {
        1
    } else {
        4
    };
    let mut checked = 0;
    for map in maps.iter().step_by(step) {
        let world = load(&files, &materials, map).unwrap();
        assert!(world.light_count() > 0, "{map} is dark");
        assert!(!world.report.fallback, "{map} needs the fallback");
        checked += check_world(map, &world);
    }
    println!("{checked} pairs of place and light");
    if game.exact() {
        assert_eq!(maps.len(), 72);
        assert!(
            checked > 10_000 / step,
            "only {checked} pairs of place and light"
        );
    }
}

/// What holds for any map, whoever made it. What is no map is refused, with a line that names it.
#[test]
fn maps_of_other_packs_are_finite_and_whole() {
    let Some(game) = testkit::game() else {
        return;
    };
    for pack in &game.others {
        let mut files = SearchPath::open(&[&game.folder]).unwrap();
        if let Err(error) = files.add_pk3(pack) {
            println!("{error}");
            continue;
        }
        let (materials, _) = Materials::load(&files);
        for map in Pk3::open(pack).unwrap().list("maps", ".bsp") {
            match load(&files, &materials, &map) {
                Ok(world) => {
                    let checked = check_world(&map, &world);
                    println!("{map}: {checked} pairs of place and light");
                }
                Err(error) => println!("{map} is refused: {error}"),
            }
        }
    }
}

fn load(files: &SearchPath, materials: &Materials, map: &str) -> Result<RelitWorld, LoadError> {
    let calibrate = CalibrationOptions {
        samples: 200,
        candidates: 100,
        ..Default::default()
    };
    let options = Options {
        calibrate: Some(calibrate),
        ..Options::default()
    };
    RelitWorld::load(files, materials, &format!("maps/{map}"), options)
}

/// Checks that all of the world is finite and its lists are whole; returns how many pairs of place and light it saw.
fn check_world(map: &str, world: &RelitWorld) -> usize {
    for light in &world.lights {
        assert!(
            light.radiance.is_finite() && light.radiance.max_element() > 0.0,
            "{map}: {light:?}"
        );
        assert!(
            light.vertices.iter().all(|v| v.is_finite()),
            "{map}: {light:?}"
        );
        assert!(
            (light.normal().length() - 1.0).abs() < 1e-4,
            "{map}: {light:?}"
        );
    }
    for vertex in &world.vertices {
        assert!(
            vertex.position.is_finite() && vertex.st.is_finite() && vertex.lightmap.is_finite()
        );
        assert!(
            (vertex.normal.length() - 1.0).abs() < 1e-4,
            "{map}: {vertex:?}"
        );
    }
    assert_eq!(world.indices.len() % 3, 0);
    assert!(
        world
            .indices
            .iter()
            .all(|&i| (i as usize) < world.vertices.len())
    );
    check_lists(map, world)
}

fn check_lists(map: &str, world: &RelitWorld) -> usize {
    let lists = &world.light_lists;
    assert_eq!(lists.clusters(), world.bsp.num_clusters());
    assert!(lists.offsets.is_sorted());
    assert_eq!(
        lists.row(-1).len(),
        world.lights.len() + world.point_lights.len()
    );
    let of_cluster = world.bsp.cluster_surfaces();
    let mut checked = 0;
    for entity in world.bsp.entities().iter().step_by(7) {
        let Some(place) = entity.vec3("origin") else {
            continue;
        };
        let cluster = world.bsp.cluster_at(place);
        if cluster < 0 {
            continue;
        }
        let row = lists.row(cluster);
        for (index, light) in (0u32..).zip(&world.lights).filter(|(_, l)| l.model == 0) {
            let center = light.vertices.into_iter().sum::<Vec3>() / 3.0;
            let from = world.bsp.cluster_at(center + light.normal());
            let in_front = (place - center).dot(light.normal()) > 1.0 || light.two_sided;
            if from >= 0 && in_front && world.bsp.cluster_sees(from, cluster) {
                // Surfaces that no leaf of the cluster in front lists are never drawn from there.
                let listed = of_cluster
                    .get(from as usize)
                    .is_some_and(|l| l.iter().any(|id| id.index() == light.surface as usize));
                assert!(
                    !listed || row.binary_search(&index).is_ok(),
                    "{map}: light {index} at {center} is missing at {place}"
                );
                checked += 1;
            }
        }
        if checked > 500 {
            break;
        }
    }
    checked
}
