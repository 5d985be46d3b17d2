//! Candidates in front of samples that stay unexplained.

use super::*;
use crate::calibrate::fronts::Fronts;
use crate::calibrate::place::Scene;
use crate::occluders::Occluders;
use samples::Sample;

#[test]
fn what_places_see_is_kept_and_samples_that_join_are_looked_at() {
    let world = room(false, Some(&from_hidden));
    let occluders = Occluders::of_world(&world);
    let (all, _) = samples::take(&world, &occluders, &taking(800));
    let first = all.len() - 100;
    let measured = Measured::new(&all);
    let of_triangle = bounce::surfaces_of_triangles(&world);
    let look = |fronts: &mut Fronts, samples: &[Sample]| {
        let scene = Scene {
            world: &world,
            occluders: &occluders,
            spread: spread::Spread::new(samples),
            measured: &measured,
            of_triangle: &of_triangle,
            candidates: 400,
            linear: false,
            least: 0.0,
        };
        let dark = solve::residual(samples, &[], Vec3::ZERO);
        fronts.candidates(&scene, &dark)
    };
    let mut kept = Fronts::new(first);
    let before = look(&mut kept, &all[..first]);
    let after = look(&mut kept, &all);
    let anew = look(&mut Fronts::new(0), &all);
    let told = |columns: &[columns::Column]| -> Vec<_> {
        let column = |c: &columns::Column| (format!("{:?}", c.source), c.rows.clone(), c.limit);
        columns.iter().map(column).collect()
    };
    assert!(after.len() > 100, "{}", after.len());
    assert!(told(&after) == told(&anew));
    // Places come up again, and what joined is seen from them.
    let again = |c: &&columns::Column| before.iter().any(|b| b.source == c.source);
    let joined = |c: &columns::Column| c.rows.iter().any(|(i, _)| *i as usize >= first);
    let both = after.iter().filter(again).filter(|c| joined(c)).count();
    assert!(both > 20, "{both}");
}
