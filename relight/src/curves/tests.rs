//! Hits beside closed forms, and beside fine tessellations.

use super::*;
use glam::Vec2;
use support::random::Random;

/// A vault over x from 0 to 2 with z = 4 h x/2 (1 - x/2), and y from 0 to 3.
fn vault(height: f32) -> Piece {
    let row = |y: f32| {
        [
            Vec3::new(0.0, y, 0.0),
            Vec3::new(1.0, y, 2.0 * height),
            Vec3::new(2.0, y, 0.0),
        ]
    };
    Piece {
        points: [row(0.0), row(1.5), row(3.0)],
    }
}

#[test]
fn rays_meet_a_parabola_where_its_equation_does() {
    let mut random = Random::new(3);
    let (mut hits, mut missed) = (0, 0);
    for height in [0.01f32, 1.0, 50.0] {
        let piece = vault(height);
        for _ in 0..3000 {
            let origin = Vec3::new(
                random.uniform() * 4.0 - 1.0,
                random.uniform() * 3.0,
                (random.uniform() * 4.0 - 1.5) * height,
            );
            let target = Vec3::new(
                random.uniform() * 2.0,
                random.uniform() * 3.0,
                random.uniform() * height,
            );
            let ray = CurveRay::new(origin, target - origin);
            // z - 2 h x + h x^2 = 0 along the ray
            let (o, d) = (origin.as_dvec3(), ray.direction.as_dvec3());
            let h = f64::from(height);
            let a = h * d.x * d.x;
            let b = d.z - 2.0 * h * d.x + 2.0 * h * o.x * d.x;
            let c = o.z - 2.0 * h * o.x + h * o.x * o.x;
            let squared = b * b - 4.0 * a * c;
            let root = squared.sqrt();
            let inside = |t: &f64| {
                let p = o + d * *t;
                *t >= 0.0 && (0.0..=2.0).contains(&p.x) && (0.0..=3.0).contains(&p.y)
            };
            let near_end = |t: f64| {
                let p = o + d * t;
                [p.x, p.x - 2.0, p.y, p.y - 3.0, t]
                    .iter()
                    .any(|end| end.abs() < 2e-3)
            };
            let roots = [(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)];
            if roots.iter().any(|&t| near_end(t))
                || squared.abs() < 2e-2 * (b * b + (4.0 * a * c).abs())
            {
                continue;
            }
            let exact = roots.iter().filter(|t| inside(t)).copied().reduce(f64::min);
            let found = piece.nearest(&ray, 1e6);
            assert_eq!(
                exact.is_some(),
                found.is_some(),
                "{height} {ray:?} {roots:?}"
            );
            let Some((exact, found)) = exact.zip(found) else {
                missed += 1;
                continue;
            };
            let x = o.x + d.x * exact;
            let normal = Vec3::new((2.0 * h * (x - 1.0)) as f32, 0.0, 1.0).normalize();
            // across the surface, because rays along it magnify rounding
            let error = (exact - f64::from(found.t)).abs() as f32 * normal.dot(ray.direction).abs();
            assert!(error < 1e-4, "{height}: {exact} {found:?}");
            assert!(found.normal.dot(normal).abs() > 0.999, "{found:?} {normal}");
            hits += 1;
        }
    }
    assert!(hits > 2000 && missed > 100, "{hits} {missed}");
}

#[test]
fn hits_are_those_of_a_fine_tessellation() {
    let mut random = Random::new(11);
    let (mut compared, mut others) = (0, 0);
    for _ in 0..20 {
        let mut around = |at: Vec3| at + random.signed_point() * 12.0;
        let points =
            [0, 1, 2].map(|j| [0, 1, 2].map(|i| around(Vec3::new(i as f32, j as f32, 0.0) * 20.0)));
        let piece = Piece { points };
        const FINE: usize = 64;
        let at = |i: usize, j: usize| piece.point(i as f32 / FINE as f32, j as f32 / FINE as f32);
        let mut facets = Vec::new();
        for j in 0..FINE {
            for i in 0..FINE {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
                for corners in [[a, c, b], [b, c, d]] {
                    let normals = [Vec3::Z; 3];
                    facets.push(Facet { corners, normals });
                }
            }
        }
        let (fine, exact, parts) = (
            Tree::new(&facets),
            Tree::new(&[piece]),
            Tree::new(&piece.split(2)),
        );
        for _ in 0..200 {
            let target = piece.point(random.uniform(), random.uniform());
            let origin = target + random.signed_point() * 80.0;
            let ray = CurveRay::new(origin, target - origin + random.signed_point());
            let [by_facets, whole, split] = [
                fine.nearest(&ray, 1e6),
                exact.nearest(&ray, 1e6),
                parts.nearest(&ray, 1e6),
            ];
            let Some((by_facets, whole, split)) =
                by_facets.zip(whole).zip(split).map(|((a, b), c)| (a, b, c))
            else {
                continue;
            };
            // rays along the surface meet the facets elsewhere
            if by_facets.face.dot(ray.direction).abs() < 0.2 {
                continue;
            }
            compared += 1;
            let near = |hit: &SurfaceHit| (hit.t - by_facets.t).abs() < 0.2;
            let agrees = near(&whole) && near(&split) && by_facets.face.dot(whole.normal) > 0.98;
            others += usize::from(!agrees);
        }
    }
    // at edges and outlines, which the facets have a little elsewhere
    println!("{others} of {compared}");
    assert!(
        compared > 1500 && others * 200 < compared,
        "{others} of {compared}"
    );
}

#[test]
fn degenerate_surfaces_do_no_harm() {
    let point = Vec3::new(1.0, 2.0, 3.0);
    let line = [0, 1, 2].map(|j| [point * j as f32; 3]);
    let broken = [[Vec3::splat(f32::NAN); 3]; 3];
    for points in [[[point; 3]; 3], line, broken] {
        let piece = Piece { points };
        let ray = CurveRay::new(point - Vec3::X * 9.0, Vec3::X);
        let hit = Tree::new(&[piece]).nearest(&ray, 100.0);
        assert!(hit.is_none_or(|hit| (hit.t - 9.0).abs() < 0.1), "{hit:?}");
        let _ = piece.normal(0.5, 0.5);
    }
    let empty = Tree::<Piece>::new(&[]);
    assert!(
        empty.is_empty()
            && empty
                .nearest(&CurveRay::new(point, Vec2::ONE.extend(0.0)), 9.0)
                .is_none()
    );
}
