//! A map with something in every lump, and everything that can be asked of a map.

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{Bsp, DrawVert, GridPoint, SurfaceKind, content_flags};

pub fn vert(x: f32, y: f32, z: f32) -> DrawVert {
    DrawVert {
        position: Vec3::new(x, y, z),
        st: Vec2::new(x, y),
        lightmap: Vec2::ZERO,
        normal: Vec3::Z,
        color: [255; 4],
    }
}

/// A map with something in every lump.
pub fn sample() -> Bsp {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("textures/wall", 0, content_flags::SOLID);
    let fog = map.add_shader("textures/fog", 0, content_flags::FOG);
    let one = map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let two = map.add_room(
        wall,
        Vec3::new(128.0, -64.0, -64.0),
        Vec3::new(256.0, 64.0, 64.0),
    );
    map.set_sees(one, two, false);
    let arch: Vec<DrawVert> = (0..9)
        .map(|at| {
            let (x, y) = ((at % 3) as f32, (at / 3) as f32);
            vert(x * 40.0, y * 40.0, if x == 1.0 { 60.0 } else { 0.0 })
        })
        .collect();
    map.add_patch(wall, 3, 3, &arch);
    map.add_soup(
        wall,
        &[
            vert(0.0, 0.0, 0.0),
            vert(0.0, 9.0, 0.0),
            vert(9.0, 0.0, 0.0),
        ],
        &[0, 1, 2],
    );
    map.add_flare(wall, Vec3::ZERO, Vec3::Z, Vec3::ONE);
    map.add_box_brush(wall, Vec3::splat(-130.0), Vec3::splat(-128.0));
    let volume = map.add_fog_brush(fog, Vec3::splat(-128.0), Vec3::splat(0.0), 5);
    let page = map.add_lightmap([10, 20, 30]);
    map.set_lightmap(0, page);
    map.set_fog(1, volume);
    let model = map.begin_model();
    map.add_box_faces(wall, Vec3::splat(-8.0), Vec3::splat(8.0), false);
    map.add_entity(&[("classname", "func_door"), ("model", &format!("*{model}"))]);
    map.build_with_grid(Vec3::new(64.0, 64.0, 128.0), |_| GridPoint {
        ambient: [10; 3],
        directed: [20; 3],
        longitude: 30,
        latitude: 40,
    })
}

/// Uses everything that a map offers.
pub fn exercise(bsp: &Bsp) {
    let clusters = bsp.num_clusters();
    for (at, leaf) in bsp.leafs.iter().enumerate() {
        assert!(i64::from(leaf.cluster) < clusters as i64, "leaf {at}");
        for &surface in bsp.leaf_surface_indices(leaf) {
            let _ = bsp.surfaces[surface as usize];
        }
        for &brush in bsp.leaf_brush_indices(leaf) {
            let _ = bsp.brushes[brush as usize];
        }
    }
    for surface in &bsp.surfaces {
        let _ = &bsp.shaders[surface.shader as usize];
        if surface.fog >= 0 {
            let _ = &bsp.fogs[surface.fog as usize];
        }
        if surface.lightmap >= 0 {
            assert_eq!(
                bsp.lightmaps[surface.lightmap as usize].size(),
                bsp.lightmap_size()
            );
            let _ = bsp.lightmaps[surface.lightmap as usize].texel(127, 127);
        }
        let vertices = &bsp.vertices[surface.first_vert as usize..][..surface.num_verts as usize];
        assert_eq!(vertices.len(), bsp.surface_vertices(surface).len());
        let corners = &bsp.indices[surface.first_index as usize..][..surface.num_indices as usize];
        if !matches!(surface.kind, SurfaceKind::Patch | SurfaceKind::Flare) {
            assert_eq!(corners.len() % 3, 0);
            for &corner in corners {
                assert!((corner as usize) < vertices.len());
            }
        }
    }
    for layers in &bsp.layers.surfaces {
        for page in layers.lightmaps {
            assert!(page < 0 || (page as usize) < bsp.lightmaps.len());
        }
    }
    for surface in &bsp.surfaces {
        if let Some((vertices, corners)) = bsp.foliage_mesh(surface) {
            assert_eq!(corners.len() % 3, 0);
            assert!(corners.iter().all(|&c| (c as usize) < vertices.len()));
        }
    }
    for model in &bsp.models {
        let _ = &bsp.surfaces[bsp.model_surfaces(model)];
    }
    for brush in &bsp.brushes {
        for side in bsp.sides_of(brush) {
            assert!(bsp.plane_of(side).is_some());
        }
    }
    for volume in bsp.fog_volumes() {
        assert!(volume.mins.is_finite() && volume.maxs.is_finite());
    }
    for mesh in bsp.patch_meshes(4.0).into_iter().flatten() {
        assert!(mesh.vertices.iter().all(DrawVert::is_finite));
        let count = mesh.vertices.len() as u32;
        assert!(mesh.indices_at(0.01).into_iter().all(|at| at < count));
    }
    if let Some(layout) = bsp.light_grid() {
        for p in [Vec3::ZERO, Vec3::splat(1e30), Vec3::splat(-1e30)] {
            if let Some(sample) = layout.sample(&bsp.light_grid, p) {
                assert!(sample.ambient.is_finite());
            }
        }
    }
    for p in [Vec3::ZERO, Vec3::splat(1e9), Vec3::NAN] {
        assert!(bsp.leaf_at(p) < bsp.leafs.len());
        bsp.cluster_sees(bsp.cluster_at(p), 0);
    }
    assert_eq!(bsp.cluster_surfaces().len(), clusters);
    for entity in bsp.entities() {
        entity.vec3("origin");
        entity.brush_model();
    }
}

/// Reads; a map must work and be written back as it was.
pub fn survive(bytes: &[u8]) -> bool {
    match Bsp::parse(bytes) {
        Ok(bsp) => {
            exercise(&bsp);
            assert!(bsp.write() == bytes, "not written back as it was");
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}
