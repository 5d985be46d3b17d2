//! Reuse of rays between fits.

use super::*;
use crate::occluders::Occluders;

#[test]
fn reused_rays_equal_fresh_ones() {
    let mut world = room(true, Some(&from_hidden));
    for material in &mut world.materials {
        material.albedo = Vec3::splat(0.5);
    }
    let occluders = Occluders::of_world(&world);
    let mut traced = TraceCache::default();
    let mut taken = Vec::new();
    for gamma in [1.0, 2.2, 1.0] {
        world.stored_gamma = gamma;
        let (samples, evidence) = traced.take(&world, &occluders, &sampling(300));
        let anew = samples::take(&world, &occluders, &sampling(300));
        assert_eq!((&samples, evidence), (&anew.0, anew.1));
        let light: Vec<Vec3> = samples.iter().map(|s| s.value).collect();
        let bounced = |transfer: bounce::Transfer| transfer.of(&light, false);
        let known = bounced(traced.transfer(&world, &occluders, &samples, 1, |_| false));
        let new = bounce::Transfer::new(&world, &occluders, &samples, 1, |_| false);
        assert_eq!(known, bounced(new));
        assert!(known.iter().any(|light| light.max_element() > 0.0));
        taken.push(samples);
    }
    assert!(taken[0] != taken[1] && taken[0] == taken[2]);
    // Elsewhere something else is seen.
    let elsewhere = &taken[0][..200];
    let known = traced.transfer(&world, &occluders, elsewhere, 1, |_| false);
    assert_eq!(known.of(&vec![Vec3::ONE; 200], false).len(), 200);
}
