//! Geometry: normals, patches, fogs.

use super::{by_directives, ceiling_lamp, game, relight};
use crate::load::*;
use crate::materials::Materials;
use crate::world::*;
use glam::Vec2;
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, surface_flags};

#[test]
fn invisible_patches_are_left_out_by_their_own_flags() {
    let mut map = MapBuilder::new();
    let drawn = map.add_shader("t/wall", 0, 1);
    let hidden = map.add_shader("t/wall", surface_flags::NODRAW, 1);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    let bump = |x: i32, y: i32| {
        Vec3::new(
            x as f32 * 32.0,
            y as f32 * 32.0,
            if x == 1 { 40.0 } else { 0.0 },
        )
    };
    let points: Vec<DrawVert> = (0..9)
        .map(|i| DrawVert {
            position: bump(i % 3, i / 3),
            st: Vec2::ZERO,
            lightmap: Vec2::ZERO,
            normal: Vec3::Z,
            color: [255; 4],
        })
        .collect();
    let a = map.add_patch(drawn, 3, 3, &points);
    let b = map.add_patch(hidden, 3, 3, &points);
    let world = relight(map);
    assert!(world.surfaces[a].num_indices > 0);
    assert_eq!(world.surfaces[b].num_indices, 0);
    assert_ne!(world.surfaces[a].material, world.surfaces[b].material);
    assert_eq!(world.surfaces[a].maxs.z, 20.0);
}

#[test]
fn fogs_are_numbered_from_one() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    let haze = map.add_shader("t/haze", 0, q3bsp::content_flags::FOG);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    let fog = map.add_fog_brush(haze, Vec3::splat(-64.0), Vec3::new(64.0, 64.0, 0.0), 5);
    let inside = map.add_quad(wall, ceiling_lamp(16.0, -8.0));
    let outside = map.add_quad(wall, ceiling_lamp(16.0, 8.0));
    map.set_fog(inside, fog);
    map.set_fog(outside, -1);
    let world = relight(map);
    assert_eq!(world.fogs.len(), 1);
    assert_eq!(world.fogs[0].color, Vec3::new(0.25, 0.5, 1.0));
    assert_eq!(world.fogs[0].depth, 300.0);
    assert_eq!(
        (world.surfaces[inside].fog, world.surfaces[outside].fog),
        (1, 0)
    );
}

#[test]
fn a_fog_that_nothing_describes_hides_nothing_where_it_fills_the_world() {
    let with = |material: &str, brush: Option<i32>| {
        let mut map = MapBuilder::new();
        let haze = map.add_shader(material, 0, q3bsp::content_flags::FOG);
        map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
        map.add_fog_brush(haze, Vec3::splat(-64.0), Vec3::splat(64.0), 5);
        let missing = map.add_shader("t/nowhere", 0, 0);
        map.add_quad(missing, ceiling_lamp(64.0, 0.0));
        let mut bsp = map.build();
        if let Some(brush) = brush {
            bsp.fogs[0].brush = brush;
        }
        let files = game();
        let (materials, _) = Materials::load(&files);
        let world = RelitWorld::from_bsp(&files, &materials, "test", bsp, by_directives());
        let names_fog = |w: &String| w.contains("left out the fog") && w.contains(material);
        let warned = world.warnings.iter().any(names_fog);
        // a game warns of what is wrong with the map, and of materials as it registers them
        let (of_map, all) = (world.map_warnings().count(), world.warnings.len());
        let faults = world
            .materials
            .iter()
            .filter(|m| m.resolved.fault.is_some());
        assert_eq!(of_map, usize::from(warned));
        assert_eq!(all - of_map, faults.count());
        (world.fogs[0].depth, warned)
    };
    assert_eq!(with("t/haze", None), (300.0, false));
    assert_eq!(with("t/haze", Some(-1)), (300.0, false));
    assert_eq!(with("0.2 0.25 0.3 0", None), (1.0, false));
    let (depth, warned) = with("0.2 0.25 0.3 0", Some(-1));
    assert!(depth > 1.0e6 && warned);
}

#[test]
fn bent_planar_surfaces_keep_the_normals_of_their_vertices() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    let flat = map.add_quad(wall, ceiling_lamp(64.0, 0.0));
    let bent = map.add_quad(wall, ceiling_lamp(64.0, 100.0));
    for surface in [flat, bent] {
        map.surface_mut(surface).unwrap().lightmap_vecs[2] = Vec3::ZERO;
        for (i, vertex) in map.vertices_mut(surface).iter_mut().enumerate() {
            vertex.normal = Vec3::new(i as f32, 0.0, -4.0);
        }
    }
    // one corner pulled down: the two triangles of the quad now face apart
    map.vertices_mut(bent)[1].position.z -= 60.0;
    let world = relight(map);
    let normals = |surface: usize| {
        let surface = &world.surfaces[surface];
        let first = surface.first_vertex as usize;
        world.vertices[first..first + surface.num_vertices as usize]
            .iter()
            .map(|v| v.normal)
            .collect::<Vec<_>>()
    };
    assert!(world.surfaces[flat].plane.is_some());
    assert!(normals(flat).windows(2).all(|pair| pair[0] == pair[1]));
    assert_eq!(world.surfaces[bent].plane, None);
    for (i, normal) in normals(bent).into_iter().enumerate() {
        let stored = Vec3::new(i as f32, 0.0, -4.0).normalize();
        assert!(normal.abs_diff_eq(stored, 1e-6), "{normal}");
    }
}

#[test]
fn posters_lie_on_their_walls() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    let poster = map.add_shader("t/poster", 0, 1);
    let sky = map.add_shader("t/sky", surface_flags::SKY, 1);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    let on_wall = map.add_quad(poster, ceiling_lamp(16.0, 8.0));
    let under = map.add_quad(wall, ceiling_lamp(32.0, 8.0));
    let off = map.add_quad(poster, ceiling_lamp(16.0, -8.0));
    let heaven = map.add_quad(sky, ceiling_lamp(32.0, -8.0));
    let stacked = relight(map).stacked();
    let place = |below, above| coplanar::Stacked {
        below,
        above,
        on_back: false,
    };
    assert_eq!(stacked[on_wall], place(1, 0));
    assert_eq!(stacked[under], place(0, 1));
    assert_eq!((stacked[off], stacked[heaven]), (place(0, 0), place(0, 0)));
}
