//! Candidates in front of samples with a large residual.

use super::*;
use crate::calibrate::placement::Scene;
use crate::calibrate::residual_candidates::ResidualCandidates;
use crate::occluders::Occluders;
use samples::Sample;

#[test]
fn candidate_rows_are_reused_and_extended_by_new_samples() {
    let world = room(false, Some(&from_hidden));
    let occluders = Occluders::of_world(&world);
    let (all, _) = samples::take(&world, &occluders, &sampling(800));
    let first = all.len() - 100;
    let measured = MeasuredSpace::new(&all);
    let of_triangle = world.surfaces_of_triangles();
    let look = |residual_candidates: &mut ResidualCandidates, samples: &[Sample]| {
        let scene = Scene {
            world: &world,
            occluders: &occluders,
            soa: sample_soa::SampleSoa::new(samples),
            measured: &measured,
            of_triangle: &of_triangle,
            candidates: 400,
            linear: false,
            cutoff: 0.0,
        };
        let dark = solve::residual(samples, &[], Vec3::ZERO);
        residual_candidates.candidates(&scene, &dark)
    };
    let mut kept = ResidualCandidates::new(first);
    let before = look(&mut kept, &all[..first]);
    let after = look(&mut kept, &all);
    let anew = look(&mut ResidualCandidates::new(0), &all);
    let values = |columns: &[columns::Column]| -> Vec<_> {
        let column = |c: &columns::Column| (format!("{:?}", c.source), c.rows.clone(), c.limit);
        columns.iter().map(column).collect()
    };
    assert!(after.len() > 100, "{}", after.len());
    assert!(values(&after) == values(&anew));
    // Places come up again, and what joined is seen from them.
    let again = |c: &&columns::Column| before.iter().any(|b| b.source == c.source);
    let joined = |c: &columns::Column| c.rows.iter().any(|(i, _)| *i as usize >= first);
    let both = after.iter().filter(again).filter(|c| joined(c)).count();
    assert!(both > 20, "{both}");
}
