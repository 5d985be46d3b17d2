//! `relight calibration`: agreement of calibrated light with the light that the map compiler stored.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use relight::calibrate::{
    Agreement, CalibrationReport, FOUND_WITHIN, POWER_WITHIN, Recovery, Spots, hide_entities,
    recovery, spots,
};
use relight::{CalibrationCache, CalibrationOptions, Options, RelitWorld};
use serde_json::{Value, json};

use crate::game::Maps;
use crate::scripts::load_scripts;
use crate::view::open;

/// Measure how well traced light agrees with maps' lightmaps, before and after calibration
///
/// Compares traced irradiance (direct, bounced and ambient) with stored light at samples held out of the fit. Prints
/// the median of |log2(traced / stored)| in stops, with lights as the map's directives define them (before) and
/// calibrated (after). `sum` is all traced light over all stored light; `gamma` is the exponent by which the compiler
/// encoded light, 1 for linear light.
///
/// Example: relight calibration oa_dm1 fan --cache ~/.cache/relight
#[derive(Args, Debug)]
pub struct CalibrationArgs {
    #[command(flatten)]
    chosen: Maps,
    /// Number of samples, approximately; more are more exact and take longer
    #[arg(long)]
    samples: Option<usize>,
    /// Seed of the choice of samples
    #[arg(long)]
    seed: Option<u64>,
    /// Cache calibrations in this folder
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Hide the map's light entities from the fit, and count those that it finds again
    #[arg(long)]
    hide_entities: bool,
    /// Count lightmap texels near point lights that these lights make too bright
    #[arg(long)]
    spots: bool,
    /// Print JSON in place of a table: one object a map
    #[arg(long)]
    json: bool,
}

/// Runs the command: prints a line a map, then the medians and the worst of all maps.
///
/// # Errors
/// A map cannot be found or read.
pub fn run(args: &CalibrationArgs) -> Result<()> {
    if !args.json {
        println!(
            "{:20} {:>9} {:>5} {:>7} {:>5} {:>6} {:>7} {:>7} {:>6} {:>7} {:>7} {:>8}",
            "map",
            "evidence",
            "gamma",
            "samples",
            "known",
            "placed",
            "before",
            "after",
            "ratio",
            "sum",
            "sum",
            "seconds"
        );
    }
    let mut reports = Vec::new();
    for map in &args.chosen.maps {
        let (files, path) = open(map, &args.chosen.game)?;
        let (materials, _) = load_scripts(&*files);
        let default = CalibrationOptions::default();
        let calibrate = CalibrationOptions {
            samples: args.samples.unwrap_or(default.samples),
            seed: args.seed.unwrap_or(default.seed),
            cache: args.cache.as_ref().map(CalibrationCache::new),
            ..default
        };
        let options = Options {
            calibrate: None,
            by_hand: false,
            ..Options::default()
        };
        let mut world = RelitWorld::load(&*files, &materials, &path, options)?;
        world.measure_materials(&*files);
        let hidden = args.hide_entities.then(|| hide_entities(&mut world));
        let bar = ProgressBar::new(100).with_message(map.clone());
        bar.set_style(ProgressStyle::with_template("{bar:40} {pos} % {msg}")?);
        let report = &relight::calibrate_with(&mut world, &calibrate, &mut |done| {
            bar.set_position((done * 100.0) as u64);
        });
        bar.finish_and_clear();
        let found = hidden.map(|hidden| recovery(&hidden, &world));
        let spots = args.spots.then(|| spots(&world));
        for warning in &world.warnings {
            log::warn!("{warning}");
        }
        if args.json {
            println!("{}", as_json(map, report, found.as_ref(), spots));
        } else {
            println!(
                "{map:20} {:>9} {:5.1} {:7} {:5} {:6} {:7.3} {:7.3} {:6.2} {:7.3} {:7.3} {:8.2}",
                report.evidence.label(),
                report.gamma,
                report.samples,
                report.known,
                report.placed,
                report.before.median_stops,
                report.after.median_stops,
                ratio(report),
                report.before.sum_ratio,
                report.after.sum_ratio,
                report.seconds
            );
        }
        if let Some(found) = found.filter(|_| !args.json) {
            println!("    {}", in_words(&found));
        }
        if let Some(spots) = spots.filter(|_| !args.json) {
            println!("    {}", spots_in_words(&spots));
        }
        reports.push(report.clone());
    }
    if !args.json && reports.len() > 1 {
        let all = |of: fn(&CalibrationReport) -> f32| {
            let mut values: Vec<f32> = reports.iter().map(of).collect();
            values.sort_by(f32::total_cmp);
            let median = values.get(values.len() / 2).copied().unwrap_or(0.0);
            (median, values.last().copied().unwrap_or(0.0))
        };
        let (before, after) = (
            all(|r| r.before.median_stops),
            all(|r| r.after.median_stops),
        );
        println!(
            "{} maps: median {:.3} before, {:.3} after; worst {:.3} before, {:.3} after",
            reports.len(),
            before.0,
            after.0,
            before.1,
            after.1
        );
    }
    Ok(())
}

/// Error before calibration over error after it.
fn ratio(report: &CalibrationReport) -> f32 {
    report.before.median_stops / report.after.median_stops.max(1e-4)
}

fn in_words(found: &Recovery) -> String {
    format!(
        "{} light entities hidden: {} found within {FOUND_WITHIN} units ({:.1} in the median), {} of them also within {:.0} % of their power; \
         those found had {:.0} % of the power. All placed lights have {:.2} of the hidden power; {} of them, with {:.0} % of their power, are near no hidden light.",
        found.hidden,
        found.found,
        found.median_distance,
        found.found_well,
        POWER_WITHIN * 100.0,
        found.power_found * 100.0,
        found.power_ratio,
        found.invented,
        found.power_invented * 100.0
    )
}

fn spots_in_words(spots: &Spots) -> String {
    format!(
        "{} texels beside point lights, {} of them more than a stop too bright by these alone",
        spots.texels, spots.too_bright
    )
}

fn as_json(
    map: &str,
    report: &CalibrationReport,
    found: Option<&Recovery>,
    spots: Option<Spots>,
) -> Value {
    let agreement = |a: &Agreement| {
        json!({
            "median_stops": a.median_stops,
            "worst_tenth_stops": a.worst_tenth_stops,
            "sum_ratio": a.sum_ratio,
        })
    };
    json!({
        "map": map,
        "evidence": report.evidence.label(),
        "gamma": report.gamma,
        "ends": report.has_cutoff,
        "dirty": report.dirty,
        "samples": report.samples,
        "held_out": report.held_out,
        "known": report.known,
        "placed": report.placed,
        "splashes": report.splashes,
        "before": agreement(&report.before),
        "after": agreement(&report.after),
        "ratio": ratio(report),
        "suns": report.suns,
        "hidden": found.map(|f| json!({
            "lights": f.hidden,
            "found": f.found,
            "found_well": f.found_well,
            "median_distance": f.median_distance,
            "power_found": f.power_found,
            "power_ratio": f.power_ratio,
            "invented": f.invented,
            "power_invented": f.power_invented,
        })),
        "spots": spots.map(|s| json!({ "texels": s.texels, "too_bright": s.too_bright })),
        "cached": report.cached,
        "seconds": report.seconds,
    })
}
