//! Everything that can be asked of a map.

use glam::Vec3;
use q3bsp::{Bsp, DrawVert, SurfaceKind};

/// Uses everything that a map offers.
pub fn exercise(bsp: &Bsp) {
    let clusters = bsp.num_clusters();
    for (at, leaf) in bsp.leafs.iter().enumerate() {
        assert!(i64::from(leaf.cluster) < clusters as i64, "leaf {at}");
        for surface in bsp.leaf_surface_ids(leaf) {
            let _ = bsp.surfaces[surface.index()];
        }
        for brush in bsp.leaf_brush_ids(leaf) {
            let _ = bsp.brushes[brush.index()];
        }
    }
    for surface in &bsp.surfaces {
        let _ = &bsp.shaders[surface.shader.index()];
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
            assert_eq!(bsp.surface_triangles(surface).count() * 3, corners.len());
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
            let _ = (bsp.plane(side.plane), bsp.shader(side.shader));
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
        assert!(bsp.leaf_at(p).index() < bsp.leafs.len());
        bsp.cluster_sees(bsp.cluster_at(p), 0);
    }
    assert_eq!(bsp.cluster_surfaces().len(), clusters);
    for entity in bsp.entities() {
        entity.vec3("origin");
        entity.brush_model();
    }
}
