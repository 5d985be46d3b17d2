//! `relight-lab curves`: exact curves beside their tessellations.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use glam::Vec3;
use q3bsp::Bsp;
use relight::curves::{
    CurveRay, Facet, Piece, Shape, SurfaceHit, Tree, errors_along_normals, facets, pieces,
    rays_around,
};
use serde_json::{Value, json};

use crate::game::Maps;
use crate::pictures::write_rgb;
use crate::view::{Camera, map_name, open};

/// Bend from which a piece counts as curved, units.
const CURVED: f32 = 0.1;

/// Compare exact curves with their tessellations: error, rays a second, bytes
///
/// Intersects rays on one core with the patches of a map as biquadratic Bézier surfaces and as triangles of several values
/// of r_subdivisions, in hierarchies of one kind. Prints JSON, one object for each: surfaces, bytes, the median rays a second
/// of several turns; and for points of curved surfaces the distance along the normal to the triangles,
/// and the angle between the exact normal and those of the triangles, interpolated and flat.
///
/// Example: relight-lab curves oa_dm5 --tessellations 4,1 -o out
#[derive(Args, Debug)]
pub struct CurvesArgs {
    #[command(flatten)]
    chosen: Maps,
    /// Values of r_subdivisions
    #[arg(long, value_name = "UNITS,…", value_delimiter = ',', default_value = "40,8,4,1,0.25", value_parser = crate::numbers::positive)]
    tessellations: Vec<f32>,
    /// Halvings of each exact piece along both sides before the hierarchy is built
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "0,1,2", value_parser = clap::value_parser!(u32).range(0..=4))]
    split: Vec<u32>,
    /// Number of rays, and of points of curves
    #[arg(long, default_value_t = 100_000, value_parser = crate::numbers::count)]
    points: usize,
    /// Number of turns of each
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = crate::numbers::count)]
    turns: usize,
    /// Folder for pictures of the normals from the map's first view
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
}

/// Surfaces that rays are traced to.
enum Surfaces {
    Exact(Tree<Piece>),
    Facets(Tree<Facet>),
}

impl Surfaces {
    fn nearest(&self, ray: &CurveRay, limit: f32) -> Option<SurfaceHit> {
        match self {
            Self::Exact(tree) => tree.nearest(ray, limit),
            Self::Facets(tree) => tree.nearest(ray, limit),
        }
    }

    /// Number and bytes.
    fn size(&self) -> (usize, usize) {
        fn of<S: Shape + Copy>(tree: &Tree<S>) -> (usize, usize) {
            (tree.len(), tree.bytes())
        }
        match self {
            Self::Exact(tree) => of(tree),
            Self::Facets(tree) => of(tree),
        }
    }
}

/// One way to represent the curves.
struct Variant {
    name: String,
    surfaces: Surfaces,
    build_ms: f64,
    /// Rays a second of each run.
    rates: Vec<f64>,
}

/// Runs the command.
///
/// # Errors
/// A map cannot be read or has no curves, or a picture cannot be written.
pub fn run(args: &CurvesArgs) -> Result<()> {
    for map in &args.chosen.maps {
        let (files, path) = open(map, &args.chosen.game)?;
        let bytes = files.read(&path)?.with_context(|| path.clone())?;
        let bsp = Bsp::parse(&bytes).with_context(|| path.clone())?;
        measure(args, &bsp, map_name(&path))?;
    }
    Ok(())
}

fn measure(args: &CurvesArgs, bsp: &Bsp, map: &str) -> Result<()> {
    let exact = pieces(bsp);
    if exact.is_empty() {
        bail!("{map}: no curves");
    }
    let curved: Vec<Piece> = (exact.iter().copied())
        .filter(|piece| piece.curvature() > CURVED)
        .collect();
    eprintln!(
        "{map}: {} pieces, {} of them curved",
        exact.len(),
        curved.len()
    );
    let mut variants = variants(args, bsp, &exact);
    let rays = rays_around(&exact, args.points);
    let mut hits = vec![0usize; variants.len()];
    for _ in 0..args.turns {
        for (variant, hits) in variants.iter_mut().zip(&mut hits) {
            let begin = Instant::now();
            let surfaces = &variant.surfaces;
            *hits = (rays.iter())
                .filter(|ray| surfaces.nearest(ray, f32::MAX).is_some())
                .count();
            variant
                .rates
                .push(rays.len() as f64 / begin.elapsed().as_secs_f64());
        }
    }
    for (variant, hits) in variants.iter_mut().zip(hits) {
        let (count, bytes) = variant.surfaces.size();
        variant.rates.sort_by(f64::total_cmp);
        let mut errors = errors_along_normals(&curved, args.points, |ray, limit| {
            variant.surfaces.nearest(ray, limit)
        });
        let line = json!({
            "map": map,
            "curves": variant.name,
            "surfaces": count,
            "bytes": bytes,
            "build_ms": variant.build_ms,
            "rays_a_second": variant.rates.get(variant.rates.len() / 2),
            "rays_a_second_least": variant.rates.first(),
            "rays_a_second_most": variant.rates.last(),
            "hits": hits as f64 / rays.len() as f64,
            "points": errors.points,
            "points_missed": errors.missed as f64 / errors.points.max(1) as f64,
            "distance": values(&mut errors.distance),
            "normal_degrees": values(&mut errors.normal),
            "face_degrees": values(&mut errors.face),
        });
        println!("{line}");
        if let Some(folder) = &args.output {
            let name = format!("{map} {}.png", variant.name).replace([' ', ','], "-");
            picture(bsp, &variant.surfaces, &folder.join(name))?;
        }
    }
    Ok(())
}

fn variants(args: &CurvesArgs, bsp: &Bsp, exact: &[Piece]) -> Vec<Variant> {
    let timed = |name: String, make: &dyn Fn() -> Surfaces| {
        let begin = Instant::now();
        let surfaces = make();
        Variant {
            name,
            surfaces,
            build_ms: begin.elapsed().as_secs_f64() * 1e3,
            rates: Vec::new(),
        }
    };
    let of_exact = args.split.iter().map(|&levels| {
        timed(format!("exact, split {levels}"), &|| {
            let parts: Vec<Piece> = exact.iter().flat_map(|p| p.split(levels)).collect();
            Surfaces::Exact(Tree::new(&parts))
        })
    });
    let of_facets = args.tessellations.iter().map(|&subdivisions| {
        timed(format!("r_subdivisions {subdivisions}"), &|| {
            Surfaces::Facets(Tree::new(&facets(bsp, subdivisions)))
        })
    });
    of_exact.chain(of_facets).collect()
}

/// Mean, 99th percentile and maximum.
fn values(values: &mut [f32]) -> Value {
    values.sort_by(f32::total_cmp);
    let sum: f64 = values.iter().map(|&x| f64::from(x)).sum();
    json!({
        "mean": sum / values.len().max(1) as f64,
        "p99": values.get(values.len() * 99 / 100),
        "most": values.last(),
    })
}

/// Draws the normals of the curves from the map's first view, shaded by their distance.
fn picture(bsp: &Bsp, surfaces: &Surfaces, path: &Path) -> Result<()> {
    const SIZE: [u32; 2] = [640, 480];
    let camera = Camera::of_map(bsp).context("the map has no view")?;
    let [forward, left, up] = camera.axis();
    let [width, height] = SIZE.map(|n| n as f32);
    let mut rgb = Vec::new();
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let across = (x as f32 + 0.5) / width * 2.0 - 1.0;
            let down = ((y as f32 + 0.5) / height * 2.0 - 1.0) * height / width;
            let ray = CurveRay::new(camera.origin, forward - left * across - up * down);
            let color = match surfaces.nearest(&ray, f32::MAX) {
                Some(hit) => {
                    let face = hit.face * -hit.face.dot(ray.direction).signum();
                    (face * 0.5 + 0.5) * (256.0 / (256.0 + hit.t)).sqrt()
                }
                None => Vec3::ZERO,
            };
            rgb.extend(color.to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0) as u8));
        }
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    write_rgb(path, &rgb, SIZE[0], SIZE[1])
}
