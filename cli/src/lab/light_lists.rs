//! `relight-lab light-lists`: quality of maps' light lists, measured by rays.

use std::time::Instant;

use anyhow::Result;
use clap::Args;
use relight::light::{
    LightLists, ListJudgement, judge, lists_by_geometry, lists_by_visibility, sweep,
};
use serde_json::json;

use crate::lit_maps::LitMaps;

/// Measure the quality of maps' light lists by rays, and print JSON: one object a map and kind of list
///
/// A pair of a light and a cluster is visible if a ray from a point of the cluster to a point of the light hits no
/// opaque triangle and crosses no solid of the map (pairs visible only through a solid without drawn walls are counted
/// separately). Prints for lists from the potentially visible sets alone, with geometry, and swept by rays: recall
/// (listed pairs among the visible ones; also among those with more than a fifth of a percent of their cluster's light,
/// the bound below which lights are omitted), precision (visible pairs among the listed ones) and its ratio to that of
/// the potentially visible sets, the share of arriving light from unlisted lights, the largest such share of a cluster,
/// and the lengths of the lists. The rays differ from those of the sweep.
///
/// Example: relight-lab light-lists oa_dm1 kaos2 --rays 256
#[derive(Args, Debug)]
pub struct LightListsArgs {
    #[command(flatten)]
    maps: LitMaps,
    /// Rays for a pair of light and cluster
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..))]
    rays: u32,
    /// Number of clusters to measure, spread evenly over the map's list
    #[arg(long, default_value_t = 64, value_parser = crate::numbers::count)]
    clusters: usize,
}

/// Runs the command.
///
/// # Errors
/// A map cannot be found or read.
pub fn run(args: &LightListsArgs) -> Result<()> {
    for map in &args.maps.chosen.maps {
        let (mut world, map) = args.maps.load(map)?;
        let begin = Instant::now();
        let visible = lists_by_visibility(&world);
        let visible_seconds = begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        let geometric = lists_by_geometry(&world);
        let geometric_seconds = begin.elapsed().as_secs_f64();
        let swept = sweep(&mut world, args.maps.cache().as_ref());
        let lists: [(&str, &LightLists, f64); 3] = [
            ("pvs", &visible, visible_seconds),
            ("pvs+geometry", &geometric, geometric_seconds),
            ("pvs+geometry+rays", &world.light_lists, swept.seconds),
        ];
        eprintln!("{map}: {swept:?}");
        let clusters = world.light_lists.clusters();
        let step = clusters.div_ceil(args.clusters.max(1));
        let judged = judge(&world, &lists.map(|l| l.1), args.rays, step);
        let plain = judged.first().map_or(0.0, ListJudgement::precision);
        for ((name, lists, seconds), judged) in lists.iter().zip(judged) {
            let line = json!({
                "map": map,
                "lists": name,
                "lights": world.lights.len() + world.point_lights.len(),
                "clusters": clusters,
                "recall": judged.recall(),
                "recall_of_mattering": judged.recall_of_mattering(),
                "precision": judged.precision(),
                "precision_over_pvs": judged.precision() / plain.max(1.0e-9),
                "light_lost": 1.0 - judged.light_found,
                "worst_cluster_lost": judged.worst_loss,
                "mean_length": lists.mean_length(),
                "longest": lists.longest(),
                "seconds": seconds,
                "pairs_judged": judged.pairs,
                "pairs_visible": judged.visible,
                "pairs_visible_through_solid": judged.through_solid,
                "pairs_mattering": judged.mattering,
            });
            println!("{line}");
        }
    }
    Ok(())
}
