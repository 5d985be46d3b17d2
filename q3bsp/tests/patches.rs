//! Patches by hand: shape, facing and what stitching does.

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, PatchMesh, surface_flags, tessellate_patch};

fn vert(position: Vec3, st: Vec2) -> DrawVert {
    DrawVert {
        position,
        st,
        lightmap: st,
        normal: Vec3::ZERO,
        color: [200, 100, 51, 255],
    }
}

/// Half a cylinder of radius 64 around the y axis, bulging up, `height` rows along y.
fn arch(height: usize) -> Vec<DrawVert> {
    let profile = [
        (-64.0, 0.0),
        (-64.0, 64.0),
        (0.0, 64.0),
        (64.0, 64.0),
        (64.0, 0.0),
    ];
    (0..height)
        .flat_map(|row| {
            profile.iter().enumerate().map(move |(column, &(x, z))| {
                let at = Vec2::new(column as f32, row as f32);
                vert(Vec3::new(x, row as f32 * 32.0, z), at)
            })
        })
        .collect()
}

/// Twice the area of the triangles as seen from above: positive when they face up.
fn area_from_above(mesh: &PatchMesh) -> f32 {
    mesh.indices()
        .chunks(3)
        .map(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|at| mesh.vertices[at as usize].position);
            (c - a).cross(b - a).z
        })
        .sum()
}

#[test]
fn flat_patches_keep_only_the_joints() {
    let points: Vec<DrawVert> = (0..15)
        .map(|at| {
            let (x, y) = ((at % 5) as f32, (at / 5) as f32);
            vert(Vec3::new(x * 16.0, y * 16.0, 3.0), Vec2::new(x, y))
        })
        .collect();
    let mesh = tessellate_patch(&points, 5, 3, 4.0).unwrap();
    // The middle columns say nothing; the column between the two patches of the row stays.
    assert_eq!((mesh.width, mesh.height), (3, 2));
    assert_eq!(mesh.indices().len(), 12);
    assert!(
        mesh.vertices
            .iter()
            .all(|v| v.normal.abs_diff_eq(mesh.vertices[0].normal, 1e-6))
    );
    assert_eq!(mesh.vertices[5].st, Vec2::new(4.0, 2.0));
    assert_eq!(mesh.vertices[5].color, [200, 100, 51, 255]);
}

#[test]
fn finer_settings_follow_the_curve_better() {
    let mut previous = f32::INFINITY;
    for subdivisions in [80.0, 10.0, 4.0, 1.0] {
        let mesh = tessellate_patch(&arch(3), 5, 3, subdivisions).unwrap();
        assert_eq!(mesh.height, 2, "the straight direction needs no points");
        assert!(mesh.width % 2 == 1);
        for v in &mesh.vertices {
            let (x, z) = (v.position.x.abs() / 64.0, v.position.z / 64.0);
            // (1-t)² on one axis means t² on the other: √(1-x) + √(1-z) = 1.
            assert!(
                ((1.0 - x).sqrt() + (1.0 - z).sqrt() - 1.0).abs() < 1e-3,
                "{v:?}"
            );
        }
        let longest = mesh.vertices[..mesh.width]
            .windows(2)
            .map(|v| v[0].position.distance(v[1].position))
            .fold(0.0, f32::max);
        assert!(longest < previous);
        previous = longest;
    }
}

#[test]
fn facing_does_not_depend_on_the_longer_side() {
    let wide = tessellate_patch(&arch(3), 5, 3, 4.0).unwrap();
    let points = arch(3);
    // The same patch with rows and columns exchanged and mirrored, so that its front stays.
    let turned: Vec<DrawVert> = (0..5)
        .flat_map(|column| (0..3).rev().map(move |row| row * 5 + column))
        .map(|at| points[at])
        .collect();
    let tall = tessellate_patch(&turned, 3, 5, 4.0).unwrap();
    assert_eq!((wide.width, wide.height), (tall.width, tall.height));
    assert!(area_from_above(&wide) > 0.0);
    assert!((area_from_above(&wide) - area_from_above(&tall)).abs() < 1.0);
    for mesh in [wide, tall] {
        for v in &mesh.vertices {
            let radial = Vec3::new(v.position.x, 0.0, v.position.z);
            assert!(v.normal.dot(radial) > 0.0, "normals point to the front");
        }
    }
}

#[test]
fn coarser_detail_leaves_inner_points_out() {
    let mesh = tessellate_patch(&arch(3), 5, 3, 1.0).unwrap();
    let full = mesh.indices().len();
    let counts: Vec<usize> = [f32::INFINITY, 0.5, 0.1, -1.0]
        .iter()
        .map(|&limit| mesh.indices_at(limit).len())
        .collect();
    assert_eq!(counts[0], full);
    assert!(counts.windows(2).all(|c| c[0] >= c[1]), "{counts:?}");
    assert_eq!(counts[3], 6, "the corners always stay");
}

/// Two patches that share an edge, on which one has a middle point and the other has none.
#[test]
fn neighbours_get_the_same_points() {
    let row = |z: f32, y: f32, bulge: f32| {
        [(0.0, 0.0), (32.0, bulge), (64.0, 0.0)]
            .map(|(x, up)| vert(Vec3::new(x, y, z + up), Vec2::ZERO))
    };
    // Bulges by 2 units on the common edge (kept, one middle point); the other is flat but for its far
    // edge, which has nothing to do with it: its middle column would be removed.
    let curved: Vec<DrawVert> =
        [row(0.0, 0.0, 4.0), row(0.0, 32.0, 4.0), row(0.0, 64.0, 4.0)].concat();
    let mut flat: Vec<DrawVert> = [
        row(0.0, 64.0, 0.0),
        row(0.0, 96.0, 0.0),
        row(0.0, 128.0, 0.0),
    ]
    .concat();
    let mut map = MapBuilder::new();
    let shader = map.add_shader("a", 0, 0);
    let hidden = map.add_shader("a", surface_flags::NODRAW, 0);
    let one = map.add_patch(shader, 3, 3, &curved);
    let two = map.add_patch(shader, 3, 3, &flat);
    let copy = map.add_patch(hidden, 3, 3, &flat);
    flat.reverse();
    let other_group = map.add_patch(shader, 3, 3, &flat);
    for surface in [one, two] {
        map.surface_mut(surface).unwrap().lightmap_vecs =
            [Vec3::ZERO, Vec3::splat(128.0), Vec3::ZERO];
    }
    let bsp = map.build();
    let plain = bsp.patch_mesh(&bsp.surfaces[two], 4.0).unwrap();
    assert_eq!((plain.width, plain.height), (2, 2));
    let meshes = bsp.patch_meshes(4.0);
    assert!(meshes[copy].is_none());
    assert_eq!(
        meshes[other_group].as_ref().unwrap().vertices.len(),
        4,
        "other groups are left alone"
    );
    let (one, two) = (meshes[one].as_ref().unwrap(), meshes[two].as_ref().unwrap());
    assert_eq!(two.vertices.len(), 6);
    let middle = one
        .vertices
        .iter()
        .find(|v| v.position.x == 32.0 && v.position.y == 64.0)
        .unwrap();
    assert!(two.vertices.iter().any(|v| v.position == middle.position));
    assert_eq!(one.lod_origin, Vec3::splat(64.0));
    // Both leave the point out at the same distance.
    let inner = |mesh: &PatchMesh| {
        let errors = if mesh.width == 3 {
            &mesh.column_errors
        } else {
            &mesh.row_errors
        };
        errors[1]
    };
    assert_eq!(inner(one), inner(two));
    assert_eq!(inner(one), 0.5);
}
