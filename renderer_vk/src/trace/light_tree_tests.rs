use super::*;

/// A one-sided triangle of side `size` around a place.
fn triangle(at: Vec3, normal: Vec3, size: f32, strength: f32) -> t::TriangleLight {
    let (x, y) = normal.normalize().any_orthonormal_pair();
    t::TriangleLight {
        corners: [at, at + x * size, at + y * size],
        radiance: Vec3::splat(strength),
        ..t::TriangleLight::default()
    }
}

/// Lights of many strengths and directions, from a sequence without a pattern.
fn crowd(count: u32) -> Vec<t::TriangleLight> {
    let part = |n: u32| (f64::from(n) * 0.618_033_988_749_895).fract() as f32;
    (0..count)
        .map(|i| {
            let at = Vec3::new(part(i), part(i * 7 + 1), part(i * 13 + 2)) * 1000.0;
            let normal = Vec3::new(part(i * 3) - 0.5, part(i * 5) - 0.5, part(i * 11) - 0.3);
            triangle(at, normal, 1.0 + 20.0 * part(i * 17), 1.0 + (i % 9) as f32)
        })
        .collect()
}

fn numbered(lights: &[t::TriangleLight]) -> Vec<(u32, Emission)> {
    (0..)
        .zip(lights.iter().map(Emission::of_triangle))
        .collect()
}

/// Whether the bounds of each node contain those of the lights below it, and powers add up. Returns the lights found.
fn check(nodes: &[t::LightTreeNode], lights: &[t::TriangleLight]) -> Vec<u32> {
    fn below(nodes: &[t::LightTreeNode], at: usize, found: &mut Vec<u32>) {
        match nodes[at].first as usize {
            0 => found.push(nodes[at].light),
            first => {
                assert!(first > at);
                below(nodes, first, found);
                below(nodes, first + 1, found);
            }
        }
    }
    for (at, node) in nodes.iter().enumerate() {
        let mut found = Vec::new();
        below(nodes, at, &mut found);
        let mut power = 0.0;
        for light in found {
            let light = &lights[light as usize];
            let emission = Emission::of_triangle(light);
            power += emission.power;
            for corner in light.corners {
                assert!(corner.distance(node.centre) <= node.radius * 1.0001 + 1.0e-2);
            }
            let cosine = emission.axis.dot(node.axis);
            assert!(
                cosine >= node.cos_spread,
                "{at}: {cosine} {}",
                node.cos_spread
            );
        }
        assert!((node.power / power - 1.0).abs() < 1.0e-3);
    }
    let mut found = Vec::new();
    below(nodes, 0, &mut found);
    found.sort_unstable();
    found
}

#[test]
fn each_light_is_in_one_leaf_within_the_bounds_of_all_nodes_above() {
    for count in [1, 2, 3, 64, 500] {
        let lights = crowd(count);
        let nodes = LightTree::new(&numbered(&lights)).shader_nodes();
        assert_eq!(nodes.len(), 2 * lights.len() - 1);
        assert_eq!(check(&nodes, &lights), (0..count).collect::<Vec<_>>());
    }
    assert!(LightTree::new(&[]).shader_nodes().is_empty());
}

#[test]
fn a_refitted_tree_has_the_present_bounds_and_no_absent_light() {
    let lights = crowd(64);
    let tree = LightTree::new(&numbered(&lights));
    let moved: Vec<t::TriangleLight> = (lights.iter().zip(0..))
        .map(|(light, i)| t::TriangleLight {
            corners: light.corners.map(|p| Vec3::new(p.y, p.x + i as f32, -p.z)),
            ..*light
        })
        .collect();
    let present = |which: fn(&u32) -> bool| {
        let of = |i: u32| (i as usize, i, Emission::of_triangle(&moved[i as usize]));
        (0..64).filter(which).map(of).collect::<Vec<_>>()
    };
    let nodes = tree.refitted(present(|_| true)).shader_nodes();
    assert_eq!(check(&nodes, &moved).len(), 64);
    // of a third of the lights
    let nodes = tree.refitted(present(|i| i % 3 == 0)).shader_nodes();
    let lit = nodes.iter().filter(|n| n.first == 0 && n.power > 0.0);
    let mut lit: Vec<u32> = lit.map(|n| n.light).collect();
    lit.sort_unstable();
    assert_eq!(lit, (0..64).filter(|i| i % 3 == 0).collect::<Vec<_>>());
    let power = |i: u32| Emission::of_triangle(&moved[i as usize]).power;
    let sum: f32 = lit.iter().map(|&i| power(i)).sum();
    assert!((nodes[0].power / sum - 1.0).abs() < 1.0e-3);
}

#[test]
fn splits_separate_distant_groups_and_opposite_directions() {
    // two groups far apart: the first split separates them, however their numbers alternate
    let lights: Vec<t::TriangleLight> = (0..16u8)
        .map(|i| {
            let at = Vec3::X * (f32::from(i % 2) * 1000.0 + f32::from(i));
            triangle(at, Vec3::Z, 4.0, 1.0)
        })
        .collect();
    let nodes = LightTree::new(&numbered(&lights)).shader_nodes();
    assert!(nodes[1].radius < 20.0 && nodes[2].radius < 20.0);
    // two layers that face up and down, each wide: the heuristic separates the directions
    let lights: Vec<t::TriangleLight> = (0..64u8)
        .map(|i| {
            let at = Vec3::new(
                f32::from(i % 8),
                f32::from(i / 8 % 4),
                f32::from(i / 32) * 5.0,
            ) * 20.0;
            triangle(at, if i < 32 { Vec3::Z } else { -Vec3::Z }, 1.0, 1.0)
        })
        .collect();
    let nodes = LightTree::new(&numbered(&lights)).shader_nodes();
    assert!(nodes[0].cos_spread < -0.9);
    assert!(nodes[1].cos_spread > 0.9 && nodes[2].cos_spread > 0.9);
}

#[test]
fn degenerate_lights_make_a_finite_tree() {
    let same = triangle(Vec3::ONE, Vec3::Z, 2.0, 1.0);
    let flat = t::TriangleLight {
        corners: [Vec3::ZERO; 3],
        ..same
    };
    let endless = t::TriangleLight {
        corners: [Vec3::INFINITY, Vec3::NAN, Vec3::ZERO],
        ..same
    };
    let lights: Vec<t::TriangleLight> = [same, flat, endless].repeat(10_000);
    let nodes = LightTree::new(&numbered(&lights)).shader_nodes();
    assert_eq!(nodes.len(), 2 * lights.len() - 1);
    for node in &nodes {
        let numbers = [node.radius, node.power, node.cos_spread];
        assert!(numbers.iter().all(|n| n.is_finite()), "{node:?}");
        assert!(node.centre.is_finite() && node.axis.is_finite());
    }
}
