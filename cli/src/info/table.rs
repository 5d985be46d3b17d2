//! Descriptions of maps as text.

use std::fmt::Display;

use super::describe::{Calibration, Emitter, MapInfo};

/// Prints one map in full.
pub fn print_map(info: &MapInfo, emitters: bool) {
    let row = |name: &str, text: String| println!("{name:12} {text}");
    println!("{}", info.map);
    row("format", format!("{}, {} bytes", info.format, info.bytes));
    print_lumps(info);
    if let Some([mins, maxs]) = info.bounds {
        row("bounds", format!("{} to {}", vector(mins), vector(maxs)));
    }
    let kinds = counts(info.surfaces_by_kind.iter());
    row(
        "surfaces",
        format!("{} ({kinds}), {} triangles", info.surfaces, info.triangles),
    );
    row(
        "models",
        format!("{}, {} brushes", info.models, info.brushes),
    );
    row("entities", info.entities.to_string());
    for (class, count) in &info.entities_by_class {
        println!("    {count:>5} {class}");
    }
    row(
        "materials",
        format!("{}, {} missing", info.materials, info.missing.len()),
    );
    for name in &info.missing {
        println!("    missing: {name}");
    }
    row("lightmaps", lightmaps(info));
    let grid = info.light_grid.as_ref().map(|grid| {
        let [x, y, z] = grid.counts;
        let spacing = vector(grid.spacing);
        format!(
            "{x} x {y} x {z} points, {spacing} apart, {} in walls",
            grid.dark
        )
    });
    row("light grid", grid.unwrap_or_else(|| "none".to_owned()));
    row("fogs", info.fogs.len().to_string());
    for fog in &info.fogs {
        println!(
            "    {}: {} to {}, depth {}, colour {}",
            fog.material,
            vector(fog.mins),
            vector(fog.maxs),
            fog.depth,
            vector(fog.color)
        );
    }
    let seen = info.clusters_seen.as_ref().map(|seen| {
        format!(
            "visible from each: mean {:.1} ({:.0} %), median {}, {} to {}",
            seen.mean,
            100.0 * seen.mean / info.clusters.max(1) as f64,
            seen.median,
            seen.least,
            seen.most
        )
    });
    let seen = seen.unwrap_or_else(|| "no visibility data".to_owned());
    row("clusters", format!("{}; {seen}", info.clusters));
    let sources = match counts(info.lights_by_source.iter()) {
        list if list.is_empty() => list,
        list => format!(" ({list})"),
    };
    row(
        "lights",
        format!(
            "{} triangles{sources}, {} points, {} suns, ambient {}",
            info.triangle_lights,
            info.point_lights,
            info.suns,
            vector(info.ambient)
        ),
    );
    row(
        "light lists",
        format!(
            "{:.1} in the mean, {} at most",
            info.mean_list_length, info.longest_list
        ),
    );
    if let Some(calibration) = &info.calibration {
        row("calibration", calibration_line(calibration));
    }
    if emitters {
        info.emitters.iter().for_each(print_emitter);
    }
    row("warnings", info.warnings.len().to_string());
    for warning in &info.warnings {
        println!("    {warning}");
    }
}

fn print_lumps(info: &MapInfo) {
    for lump in info.lumps.iter().filter(|lump| lump.bytes > 0) {
        let records = lump.records.map(|count| count.to_string());
        println!(
            "    {:14} {:>9} {:>10} bytes at {}",
            lump.name,
            records.unwrap_or_default(), // blank for bytes and text
            lump.bytes,
            lump.offset
        );
    }
    let empty = info.lumps.iter().filter(|lump| lump.bytes <= 0);
    let empty: Vec<&str> = empty.map(|lump| lump.name).collect();
    if !empty.is_empty() {
        println!("    empty: {}", empty.join(", "));
    }
}

fn lightmaps(info: &MapInfo) -> String {
    let l = &info.lightmaps;
    let mut text = format!(
        "{} of {} x {} texels{}; {} surfaces with one, {} lit by vertex, {} without either",
        l.pages,
        l.size,
        l.size,
        if l.beside { ", beside the map" } else { "" },
        l.surfaces_with_page,
        l.surfaces_by_vertex,
        l.surfaces_without
    );
    if !l.styles.is_empty() {
        let styles: Vec<String> = l.styles.iter().map(u8::to_string).collect();
        text += &format!("; light styles {}", styles.join(", "));
    }
    text
}

/// `12 planar, 3 patch`.
fn counts<'a, K: Display + 'a>(items: impl Iterator<Item = (&'a K, &'a usize)>) -> String {
    let parts: Vec<String> = items
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    parts.join(", ")
}

fn vector(v: [f32; 3]) -> String {
    let [x, y, z] = v;
    format!("({x} {y} {z})")
}

fn calibration_line(c: &Calibration) -> String {
    format!(
        "{}: {} samples ({} held out), {} known sources, {} lights placed; median error {:.3} -> {:.3} stops, \
         worst tenth {:.3} -> {:.3}; sum over stored {:.3} -> {:.3}; {:.2} s{}",
        c.evidence,
        c.samples,
        c.held_out,
        c.known_sources,
        c.placed_lights,
        c.before.median_stops,
        c.after.median_stops,
        c.before.worst_tenth_stops,
        c.after.worst_tenth_stops,
        c.before.sum_ratio,
        c.after.sum_ratio,
        c.seconds,
        if c.cached { ", from the cache" } else { "" }
    )
}

fn print_emitter(e: &Emitter) {
    let [r, g, b] = e.radiance;
    println!(
        "    {:12} {:5} triangles, area {:10.0}, radiance {r:.3} {g:.3} {b:.3}  {}",
        e.source, e.triangles, e.area, e.material
    );
}

/// Prints a line for each map.
pub fn print_table(infos: &[MapInfo], emitters: bool) {
    let width = infos.iter().map(|i| i.map.len()).max().unwrap_or(0).max(3);
    println!(
        "{:width$} {:>8} {:>9} {:>9} {:>7} {:>6} {:>6} {:>4} {:>8} {:>9} {:>7} {:>6}",
        "map",
        "surfaces",
        "triangles",
        "materials",
        "missing",
        "lights",
        "points",
        "suns",
        "clusters",
        "mean list",
        "longest",
        "ms"
    );
    for info in infos {
        println!(
            "{:width$} {:>8} {:>9} {:>9} {:>7} {:>6} {:>6} {:>4} {:>8} {:>9.1} {:>7} {:>6}",
            info.map,
            info.surfaces,
            info.triangles,
            info.materials,
            info.missing.len(),
            info.triangle_lights,
            info.point_lights,
            info.suns,
            info.clusters,
            info.mean_list_length,
            info.longest_list,
            info.milliseconds
        );
        if !info.missing.is_empty() {
            println!("    missing: {}", info.missing.join(", "));
        }
        if let Some(calibration) = &info.calibration {
            println!("    {}", calibration_line(calibration));
        }
        if emitters {
            info.emitters.iter().for_each(print_emitter);
        }
    }
    let dark = infos
        .iter()
        .filter(|i| i.triangle_lights + i.point_lights + i.suns == 0)
        .count();
    println!("{} maps, {dark} without any light", infos.len());
}
