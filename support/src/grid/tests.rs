use super::*;
use crate::random::Random;

/// Random triangles of about `size` within `spread` of a point, some of them in planes of constant coordinates, as
/// walls of maps are.
fn soup(seed: u64, count: usize, centre: Vec3, spread: Vec3, size: f32) -> Vec<[Vec3; 3]> {
    let mut random = Random::new(seed);
    (0..count)
        .map(|number| {
            let middle = centre + random.signed_point() * spread;
            let mut corners = [0; 3].map(|_| middle + random.signed_point() * size);
            if number % 3 == 0 {
                let axis = number / 3 % 3;
                let level = corners[0][axis].round();
                corners.iter_mut().for_each(|corner| corner[axis] = level);
            }
            corners
        })
        .collect()
}

fn around(corners: &[[Vec3; 3]], cells: u32) -> Layout {
    let bounds = Aabb::of(corners.iter().flatten().copied());
    Layout::around(bounds, cells).expect("finite")
}

fn built(corners: &[[Vec3; 3]], cells: u32) -> Grid {
    Grid::new(corners, around(corners, cells), usize::MAX).expect("small")
}

/// Distance to a triangle (Möller and Trumbore, 1997), in 64-bit floats.
fn hit(origin: Vec3, direction: Vec3, corners: [Vec3; 3]) -> Option<f64> {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let inverse = ab.dot(p).recip();
    let s = origin - a;
    let u = s.dot(p) * inverse;
    let q = s.cross(ab);
    let v = direction.dot(q) * inverse;
    let distance = ac.dot(q) * inverse;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0 && distance.is_finite())
        .then_some(distance)
}

/// The walk of `shaders/trace/grid.glsl` in the same 32-bit arithmetic: nearest hit, and cells visited.
fn walk(grid: &Grid, corners: &[[Vec3; 3]], origin: Vec3, direction: Vec3) -> (Option<f64>, u32) {
    let layout = &grid.layout;
    let along = Vec3::select(
        direction.abs().cmplt(Vec3::splat(1.0e-20)),
        Vec3::splat(1.0e-20),
        direction,
    );
    let inverse = along.recip();
    let base = (layout.origin - origin) * inverse;
    let delta = layout.edge * inverse;
    let end = base + layout.counts.as_vec3() * delta;
    let enter = base.min(end).max_element().max(0.0);
    let leave = base.max(end).min_element();
    if enter.partial_cmp(&leave).is_none_or(|order| order.is_gt()) {
        return (None, 0);
    }
    let place = (origin + enter * direction - layout.origin) / layout.edge;
    let counts = layout.counts.as_ivec3();
    let mut cell = place
        .floor()
        .as_ivec3()
        .clamp(glam::IVec3::ZERO, counts - 1);
    let back = along.cmplt(Vec3::ZERO);
    let mut nearest: Option<f64> = None;
    let mut visited = 0;
    loop {
        visited += 1;
        for &number in grid.triangles(cell.as_uvec3()) {
            let found = hit(origin, direction, corners[number as usize]);
            nearest = [nearest, found].into_iter().flatten().reduce(f64::min);
        }
        let ahead = Vec3::select(back, Vec3::ZERO, Vec3::ONE);
        let next = (cell.as_vec3() + ahead) * delta + base;
        let least = next.min_element();
        if nearest.is_some_and(|t| t <= f64::from(least)) {
            break;
        }
        let axis = (0..3)
            .find(|&axis| next[axis] == least)
            .expect("not a number");
        cell[axis] += if back.test(axis) { -1 } else { 1 };
        if cell[axis] < 0 || cell[axis] >= counts[axis] {
            break;
        }
    }
    assert!(visited <= layout.counts.element_sum() + 1, "{visited}");
    (nearest, visited)
}

#[test]
fn every_cell_lists_the_triangles_that_touch_it() {
    let mut random = Random::new(3);
    for (seed, count, spread, size, cells) in [
        (1, 60, 100.0, 40.0, 12),
        (2, 200, 4000.0, 300.0, 16),
        (3, 40, 1.0, 0.01, 20),
        (4, 12, 30.0, 500.0, 9),
    ] {
        let spread = Vec3::new(spread, 0.5 * spread, 0.2 * spread);
        let corners = soup(seed, count, Vec3::new(700.0, -90.0, 3.0), spread, size);
        let grid = built(&corners, cells);
        let layout = &grid.layout;
        assert_eq!(layout.counts.max_element(), cells);
        assert_eq!(grid.starts.len(), layout.cells() + 1);
        let bounds = Aabb::of(corners.iter().flatten().copied());
        let end = layout.origin + layout.counts.as_vec3() * layout.edge;
        assert!(layout.origin.cmplt(bounds.mins).all() && end.cmpgt(bounds.maxs).all());
        // points of each triangle lie in cells that list it
        for (number, corners) in (0..).zip(&corners) {
            for _ in 0..200 {
                let [u, v] = [random.uniform(), random.uniform()];
                let [u, v] = if u + v > 1.0 {
                    [1.0 - u, 1.0 - v]
                } else {
                    [u, v]
                };
                let [a, b, c] = *corners;
                let point = a + (b - a) * u + (c - a) * v;
                let cell = ((point - layout.origin) / layout.edge).floor().as_uvec3();
                let cell = cell.min(layout.counts - 1);
                assert!(grid.triangles(cell).contains(&number), "{number} {cell}");
            }
        }
        // cells that list a triangle touch it: no plane of the 13 axes separates them, by all cells
        let half = f64::from(0.5 * layout.edge + layout.margin);
        let tests: Vec<Separation> = (corners.iter())
            .map(|c| Separation::new(c.map(|p| p.as_dvec3()), half))
            .collect();
        let mut cell = UVec3::ZERO;
        for index in 0..layout.cells() as u32 {
            cell.x = index % layout.counts.x;
            cell.y = index / layout.counts.x % layout.counts.y;
            cell.z = index / (layout.counts.x * layout.counts.y);
            assert_eq!(layout.index(cell), index as usize);
            let middle = layout.middle(cell);
            let touching = (0u32..)
                .zip(&tests)
                .filter(|(_, test)| test.touches(middle));
            let touching: Vec<u32> = touching.map(|(number, _)| number).collect();
            assert_eq!(grid.triangles(cell), touching);
        }
    }
}

#[test]
fn triangles_and_boxes_that_touch_are_told_from_those_that_do_not() {
    let test = |corners: [[f64; 3]; 3]| {
        Separation::new(corners.map(DVec3::from), 0.5).touches(DVec3::ZERO)
    };
    // a corner inside; the plane through the middle with all corners outside; an edge that cuts an edge
    assert!(test([[0.1, 0.2, 0.3], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]]));
    assert!(test([[-9.0, -9.0, 0.1], [9.0, -9.0, 0.1], [0.0, 9.0, 0.1]]));
    assert!(test([[0.4, 0.55, 0.0], [0.55, 0.4, 0.0], [9.0, 9.0, 0.0]]));
    // apart along a face, the triangle's plane, and a product of edges alone
    assert!(!test([[0.6, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, -1.0, 0.0]]));
    assert!(!test([[1.6, 0.0, 0.0], [0.0, 1.6, 0.0], [0.0, 0.0, 1.6]]));
    assert!(!test([[0.7, 0.4, -9.0], [0.4, 0.7, 9.0], [0.9, 0.9, 0.0]]));
    // faces that coincide touch
    assert!(test([[0.5, -0.1, -0.1], [0.5, 0.1, -0.1], [0.5, 0.0, 0.1]]));
}

#[test]
fn walks_find_what_all_triangles_give() {
    let mut random = Random::new(11);
    let mut hits = 0;
    for (seed, count, cells, spread) in [
        (21, 300, 16, Vec3::splat(100.0)),
        (22, 300, 40, Vec3::new(2000.0, 1500.0, 200.0)),
        (23, 100, 1, Vec3::splat(50.0)),
        // flat: all triangles near a plane
        (24, 100, 32, Vec3::new(800.0, 0.0, 600.0)),
    ] {
        let centre = Vec3::new(-300.0, 64.0, 8.0);
        let size = spread.max_element() * 0.4;
        let size = if spread.y == 0.0 { 200.0 } else { size };
        let mut corners = soup(seed, count, centre, spread, size);
        if spread.y == 0.0 {
            corners.iter_mut().flatten().for_each(|p| p.y = centre.y);
        }
        let grid = built(&corners, cells);
        for ray in 0..1500 {
            let mut origin = centre + random.signed_point() * spread * 1.2;
            let mut direction = random.signed_point().normalize_or(Vec3::X);
            let axis = ray % 3;
            match ray % 8 {
                // parallel to an axis, to a plane of axes, and nearly so
                0 => direction = [Vec3::X, Vec3::NEG_Y, Vec3::Z][axis],
                1 => direction[axis] = 0.0,
                2 => direction[axis] = 1.0e-7,
                // from a boundary between cells, and from a face of the grid
                3 => {
                    let cell = (random.uniform() * 9.0).floor();
                    origin[axis] = grid.layout.origin[axis] + cell * grid.layout.edge;
                    direction[(axis + 1) % 3] = 0.0;
                }
                4 => origin[axis] = grid.layout.origin[axis],
                // from outside
                5 => origin += direction * -3.0 * spread.max_element(),
                _ => {}
            }
            let all = corners.iter().filter_map(|&c| hit(origin, direction, c));
            let expected = all.reduce(f64::min);
            let (found, _) = walk(&grid, &corners, origin, direction);
            assert_eq!(found, expected, "{ray}: {origin} {direction}");
            hits += usize::from(found.is_some());
        }
    }
    assert!(hits > 2000, "{hits}");
}

#[test]
fn walks_along_boundaries_of_cells_miss_nothing() {
    let mut random = Random::new(31);
    let centre = Vec3::new(900.0, -2000.0, 70.0);
    let half = Vec3::new(310.0, 250.0, 130.0);
    let bounds = Aabb::new(centre - half, centre + half);
    let layout = Layout::around(bounds, 13).expect("finite");
    let inner = (layout.counts - 1).as_vec3();
    let boundary = |random: &mut Random, reach: f32| {
        let place = [0; 3].map(|_| random.uniform());
        layout.origin
            + (Vec3::ONE + (Vec3::from(place) * (inner - 1.0) * reach).round()) * layout.edge
    };
    // corners at corners of cells; many triangles lie in planes between cells
    let corners: Vec<[Vec3; 3]> = (0..250)
        .map(|number| {
            let first = boundary(&mut random, 1.0);
            let mut corners = [first; 3];
            for corner in corners.iter_mut().skip(1) {
                let away = random.signed_point() * 2.6 * layout.edge;
                *corner = first + (away / layout.edge).round() * layout.edge;
            }
            if number % 2 == 0 {
                let axis = number / 2 % 3;
                corners.iter_mut().for_each(|c| c[axis] = first[axis]);
            }
            corners.map(|c| c.clamp(bounds.mins, bounds.maxs))
        })
        .collect();
    let grid = Grid::new(&corners, layout, usize::MAX).expect("small");
    let mut hits = 0;
    for ray in 0..4000 {
        let origin = boundary(&mut random, 1.0);
        let mut direction = (boundary(&mut random, 1.0) - origin) / layout.edge;
        match ray % 4 {
            // in a plane of boundaries, and along an edge of cells
            0 => direction[ray / 4 % 3] = 0.0,
            1 => direction = [Vec3::X, Vec3::NEG_Z, Vec3::Y][ray / 4 % 3],
            _ => {}
        }
        if direction == Vec3::ZERO {
            continue;
        }
        let all = corners.iter().filter_map(|&c| hit(origin, direction, c));
        let expected = all.reduce(f64::min);
        let (found, _) = walk(&grid, &corners, origin, direction);
        assert_eq!(found, expected, "{ray}: {origin} {direction}");
        hits += usize::from(found.is_some());
    }
    assert!(hits > 1000, "{hits}");
}

#[test]
fn odd_boxes_and_triangles_are_borne() {
    let [x, y] = [Vec3::X * 40.0, Vec3::Y * 40.0];
    // one flat triangle, one without area, one that is not finite
    let corners = [
        [Vec3::ZERO, x, y],
        [x, x, y],
        [Vec3::ZERO, x, 2.0 * x],
        [Vec3::NAN, x, y],
    ];
    let bounds = Aabb::of([Vec3::ZERO, x, y]);
    let layout = Layout::around(bounds, 4).expect("finite");
    assert_eq!(layout.counts, UVec3::new(4, 4, 1));
    let grid = Grid::new(&corners, layout, 100).expect("small");
    assert!(grid.entries.iter().all(|&number| number == 0));
    // 4 + 3 + 2 + 1 cells on and below the diagonal, and those that the diagonal touches at corners
    assert!((10..=13).contains(&grid.entries.len()));
    assert!(Grid::new(&corners, layout, 9).is_none(), "a bound");
    let point = Layout::around(Aabb::of([Vec3::ONE]), 256).expect("a point");
    assert!(point.edge > 0.0 && point.counts.min_element() >= 1);
    for bad in [
        Aabb::EMPTY,
        Aabb::of([Vec3::splat(1.0e8)]),
        Aabb::new(Vec3::NAN, Vec3::ONE),
    ] {
        assert_eq!(Layout::around(bad, 16), None);
    }
    let none = Grid::new(&[], layout, 0).expect("empty");
    assert_eq!(none.entries.len(), 0);
    assert_eq!(none.bytes(), 4 * 17);
}

#[test]
fn density_gives_cells_a_triangle() {
    let cube = Aabb::new(Vec3::ZERO, Vec3::splat(1000.0));
    assert_eq!(cells_by_density(cube, 2000, 4.0), 20);
    assert_eq!(cells_by_density(cube, 0, 4.0), 1);
    assert_eq!(cells_by_density(cube, 1 << 30, 4.0), MOST_CELLS);
    let flat = Aabb::new(Vec3::ZERO, Vec3::new(1000.0, 1000.0, 0.0));
    let cells = cells_by_density(flat, 2000, 4.0);
    assert!((100..=MOST_CELLS).contains(&cells), "{cells}");
    assert_eq!(cells_by_density(Aabb::of([Vec3::ONE]), 5, 4.0), 1);
}
