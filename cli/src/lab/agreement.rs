//! `relight-lab agreement`: stored light of two maps with one layout, place by place.

mod covered;
mod statistics;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use glam::Vec3;
use q3bsp::{Bsp, GridPoint};
use relight::SearchPath;
use relight::bake::store::deluxe;
use relight::compare::Rgb8;
use serde::Serialize;

use self::covered::{covered, page_of, same_layout};
use self::statistics::{Decoding, Differences, percentile};
use crate::pictures;

/// Compare the stored light of two maps that have the same surfaces and lightmap coordinates
///
/// Compares covered lightmap texels (those whose middle lies on a surface), the colours of vertices that have no
/// lightmap, and points of the light grid. Light is linear, as map compilers compute it: 255 is the brightest. For each
/// the median of the second map's luminance over the first's (bias), the median and the 95th percentile of its absolute
/// value, in stops; the percentage within half a stop; and the largest difference of a channel in bytes. Luminance
/// below --floor counts as equally dark. Of deluxe maps the angles between the directions at covered texels. Lightmaps beside a map (lm_0000.tga) are read where it has none inside.
///
/// Example: relight-lab agreement q3map2/fan.bsp ours/fan.bsp -o fan.png
#[derive(Args, Debug)]
pub struct AgreementArgs {
    /// The map to compare with (.bsp)
    a: PathBuf,
    /// The map to compare (.bsp)
    b: PathBuf,
    /// Luminance below which light counts as equally dark, of 255
    #[arg(long, value_name = "V", default_value_t = 2.0, value_parser = crate::numbers::positive)]
    floor: f32,
    /// The compiler's -gamma
    #[arg(long, value_name = "G", default_value_t = 1.0, value_parser = crate::numbers::positive)]
    gamma: f32,
    /// The compiler's -compensate
    #[arg(long, value_name = "C", default_value_t = 1.0, value_parser = crate::numbers::positive)]
    compensate: f32,
    /// Materials to list: those with the largest error
    #[arg(long, value_name = "N", default_value_t = 0)]
    materials: usize,
    /// Write a picture: pages of both maps side by side, then their signed difference, four times, on grey
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// Print JSON in place of a table
    #[arg(long)]
    json: bool,
}

/// What is printed.
#[derive(Debug, Serialize)]
struct Report {
    a: String,
    b: String,
    floor: f32,
    lightmaps: Option<Differences>,
    vertices: Option<Differences>,
    grid_ambient: Option<Differences>,
    grid_directed: Option<Differences>,
    /// Median and 95th percentile of the angle between directions of the grid, degrees.
    grid_degrees: Option<[f64; 2]>,
    /// Median and 95th percentile of the angle between the directions of deluxe maps, degrees.
    deluxe_degrees: Option<[f64; 2]>,
    materials: Vec<(String, Differences)>,
}

/// Stored colours of two maps at one place.
type Pair = ([u8; 3], [u8; 3]);

/// Runs the command.
///
/// # Errors
/// A map cannot be read, the layouts differ, or the picture cannot be written.
pub fn run(args: &AgreementArgs) -> Result<()> {
    if let Some(path) = &args.output {
        pictures::check_name(path)?;
    }
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    same_layout(&a, &b)
        .with_context(|| format!("{} and {}", args.a.display(), args.b.display()))?;
    let pages = covered(&a);
    let report = report(args, &a, &b, &pages);
    if let Some(path) = &args.output
        && let Some(picture) = picture(&a, &b, &pages)?
    {
        pictures::write(path, &picture)?;
    }
    if args.json {
        println!("{}", serde_json::to_string(&report)?);
    } else {
        print(&report);
    }
    Ok(())
}

/// A map with the lightmaps beside it.
fn read(path: &Path) -> Result<Bsp> {
    let name = path.display();
    let bytes = std::fs::read(path).with_context(|| name.to_string())?;
    let mut bsp = Bsp::parse(&bytes).with_context(|| name.to_string())?;
    // engines look for maps/NAME/lm_0000.tga in the game's folder, which holds the folder maps
    let (folder, stem) = (path.parent(), path.file_stem());
    if let (Some(game), Some(stem)) = (folder.and_then(Path::parent), stem) {
        let mut files = SearchPath::new();
        files.add_game_folder(match game.as_os_str().is_empty() {
            true => Path::new("."),
            false => game,
        })?;
        let map = format!("maps/{}.bsp", stem.to_string_lossy());
        relight::external_lightmaps(&mut bsp, &files, &map).map_err(anyhow::Error::msg)?;
    }
    Ok(bsp)
}

/// Compares everything.
fn report(args: &AgreementArgs, a: &Bsp, b: &Bsp, pages: &[Vec<u32>]) -> Report {
    let decoding = Decoding {
        gamma: args.gamma,
        compensate: args.compensate,
        floor: args.floor,
    };
    let texels = texels(a, b, pages);
    let mut by_material: BTreeMap<&str, Vec<Pair>> = BTreeMap::new();
    for (surface, pair) in &texels {
        let surface = a.surfaces.get(*surface as usize);
        if let Some(surface) = surface {
            let name = a.shader(surface.shader).name.as_str();
            by_material.entry(name).or_default().push(*pair);
        }
    }
    let mut materials: Vec<(String, Differences)> = by_material
        .into_iter()
        .filter_map(|(name, pairs)| Some((name.to_owned(), Differences::of(&pairs, decoding)?)))
        .collect();
    // the excess over the bound of half a stop, over all places of a material
    let weight = |d: &Differences| (1.0 - d.within_half_stop) * d.places as f64;
    materials.sort_by(|(_, x), (_, y)| weight(y).total_cmp(&weight(x)));
    materials.truncate(args.materials);
    let texels: Vec<Pair> = texels.into_iter().map(|(_, pair)| pair).collect();
    let grid: Vec<(&GridPoint, &GridPoint)> = (a.light_grid.iter().zip(&b.light_grid))
        .filter(|(p, q)| [p.ambient, p.directed, q.ambient, q.directed] != [[0; 3]; 4])
        .collect();
    let of = |take: fn(&GridPoint) -> [u8; 3]| -> Option<Differences> {
        let pairs: Vec<Pair> = grid.iter().map(|(p, q)| (take(p), take(q))).collect();
        Differences::of(&pairs, decoding)
    };
    let mut angles: Vec<f32> = grid
        .iter()
        .filter(|(p, q)| p.directed != [0; 3] && q.directed != [0; 3])
        .map(|(p, q)| direction(p).angle_between(direction(q)).to_degrees())
        .collect();
    let mut turned = deluxe_angles(a, b, pages);
    let of_angles = |angles: &mut Vec<f32>| {
        let median = percentile(angles, 0.5)?;
        Some([median, percentile(angles, 0.95)?])
    };
    Report {
        a: args.a.display().to_string(),
        b: args.b.display().to_string(),
        floor: args.floor,
        lightmaps: Differences::of(&texels, decoding),
        vertices: Differences::of(&vertices(a, b), decoding),
        grid_ambient: of(|p| p.ambient),
        grid_directed: of(|p| p.directed),
        grid_degrees: of_angles(&mut angles),
        deluxe_degrees: of_angles(&mut turned),
        materials,
    }
}

/// Angles between the directions at covered texels, degrees; none if one of the maps has no deluxe maps.
fn deluxe_angles(a: &Bsp, b: &Bsp, pages: &[Vec<u32>]) -> Vec<f32> {
    if deluxe::space_of(a).is_none() || deluxe::space_of(b).is_none() {
        return Vec::new();
    }
    let mut found = Vec::new();
    let odd = a.lightmaps.iter().zip(&b.lightmaps).skip(1).step_by(2);
    for ((p, q), page) in odd.zip(pages.iter().step_by(2)) {
        let texels = p.0.as_chunks::<3>().0.iter().zip(q.0.as_chunks::<3>().0);
        let covered = texels
            .zip(page)
            .filter(|(_, surface)| **surface != u32::MAX);
        found.extend(covered.map(|((p, q), _)| {
            let (p, q) = (deluxe::direction(*p), deluxe::direction(*q));
            p.angle_between(q).to_degrees()
        }));
    }
    found
}

/// Covered texels of both maps, with their surface.
fn texels(a: &Bsp, b: &Bsp, pages: &[Vec<u32>]) -> Vec<(u32, Pair)> {
    let mut found = Vec::new();
    for ((p, q), page) in a.lightmaps.iter().zip(&b.lightmaps).zip(pages) {
        let bytes = p.0.as_chunks::<3>().0.iter().zip(q.0.as_chunks::<3>().0);
        let covered = bytes.zip(page).filter(|(_, surface)| **surface != u32::MAX);
        found.extend(covered.map(|((p, q), surface)| (*surface, (*p, *q))));
    }
    found
}

/// Colours of the vertices of surfaces without a lightmap that have triangles.
fn vertices(a: &Bsp, b: &Bsp) -> Vec<Pair> {
    let lit = a.surfaces.iter().filter(|surface| {
        page_of(surface).is_none() && surface.num_indices > 0 && surface.lightmap == -3
    });
    lit.flat_map(|surface| {
        let first = usize::try_from(surface.first_vert).unwrap_or(0);
        let count = usize::try_from(surface.num_verts).unwrap_or(0);
        let of = move |bsp: &Bsp| -> Vec<[u8; 3]> {
            let vertices = bsp.vertices.iter().skip(first).take(count);
            vertices
                .map(|v| [v.color[0], v.color[1], v.color[2]])
                .collect()
        };
        of(a).into_iter().zip(of(b))
    })
    .collect()
}

/// Unit vector towards the light of a grid point.
fn direction(point: &GridPoint) -> Vec3 {
    let turn = |byte: u8| f32::from(byte) * std::f32::consts::TAU / 256.0;
    let (from_z, about_z) = (turn(point.longitude), turn(point.latitude));
    let (sin, cos) = from_z.sin_cos();
    Vec3::new(about_z.cos() * sin, about_z.sin() * sin, cos)
}

/// Pages of the first map, of the second, and the signed difference, from left to right; one row a page. Texels that
/// no surface covers are black.
fn picture(a: &Bsp, b: &Bsp, pages: &[Vec<u32>]) -> Result<Option<Rgb8>> {
    let size = a.lightmap_size();
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for ((p, q), page) in a.lightmaps.iter().zip(&b.lightmaps).zip(pages) {
        let bytes = p.0.as_chunks::<3>().0.iter().zip(q.0.as_chunks::<3>().0);
        for ((p, q), surface) in bytes.zip(page) {
            let signed: [u8; 3] = std::array::from_fn(|c| {
                let difference = i32::from(q[c]) - i32::from(p[c]);
                (128 + 4 * difference).clamp(0, 255) as u8
            });
            let shown = match *surface {
                u32::MAX => [[0; 3]; 3],
                _ => [*p, *q, signed],
            };
            for (column, bytes) in columns.iter_mut().zip(shown) {
                column.extend(bytes);
            }
        }
    }
    let height = size * a.lightmaps.len().min(b.lightmaps.len());
    if height == 0 {
        return Ok(None);
    }
    let mut shown = Vec::new();
    for column in columns {
        shown.push(Rgb8::new(size, height, column)?);
    }
    Ok(Rgb8::side_by_side(&shown, 4))
}

/// Prints the tables.
fn print(report: &Report) {
    println!("{} -> {}, floor {}", report.a, report.b, report.floor);
    println!("{}", Differences::heads());
    for (name, differences) in [
        ("lightmap texels", &report.lightmaps),
        ("vertices", &report.vertices),
        ("grid, ambient", &report.grid_ambient),
        ("grid, directed", &report.grid_directed),
    ] {
        if let Some(differences) = differences {
            println!("{}", differences.row(name));
        }
    }
    if let Some([median, p95]) = report.grid_degrees {
        println!("grid, direction: median {median:.1} degrees, 95 % {p95:.1}");
    }
    if let Some([median, p95]) = report.deluxe_degrees {
        println!("deluxe maps, direction: median {median:.1} degrees, 95 % {p95:.1}");
    }
    for (name, differences) in &report.materials {
        println!("{}", differences.row(name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use q3bsp::Lightmap;
    use q3bsp::builder::MapBuilder;

    fn room() -> Bsp {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 1);
        map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
        let mut bsp = map.build();
        let size = bsp.format.lightmap_size();
        bsp.lightmaps = vec![Lightmap(vec![40; size * size * 3].into())];
        // the first wall covers the left upper quarter of the page, the others nothing
        for (index, surface) in bsp.surfaces.iter_mut().enumerate() {
            surface.lightmap = if index == 0 { 0 } else { -3 };
        }
        let surface = bsp.surfaces[0];
        let first = surface.first_vert as usize;
        let corners = [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)];
        for (vertex, (s, t)) in bsp.vertices[first..first + 4].iter_mut().zip(corners) {
            vertex.lightmap = glam::Vec2::new(s, t);
        }
        bsp
    }

    fn args() -> AgreementArgs {
        AgreementArgs {
            a: "a".into(),
            b: "b".into(),
            floor: 2.0,
            gamma: 1.0,
            compensate: 1.0,
            materials: 3,
            output: None,
            json: false,
        }
    }

    #[test]
    fn covered_texels_alone_count() {
        let (a, mut b) = (room(), room());
        let size = a.lightmap_size();
        // twice the light on the covered quarter's upper half, nonsense on texels that nothing covers
        for (texel, bytes) in b.lightmaps[0]
            .0
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .enumerate()
        {
            let (x, y) = (texel % size, texel / size);
            *bytes = match (x < size / 2 && y < size / 2, y < size / 4) {
                (true, true) => [80; 3],
                (true, false) => [40; 3],
                _ => [255; 3],
            };
        }
        let pages = covered(&a);
        let report = report(&args(), &a, &b, &pages);
        let found = report.lightmaps.unwrap();
        assert_eq!(found.places, size * size / 4);
        assert!((found.within_half_stop - 0.5).abs() < 1e-6, "{found:?}");
        assert!((found.p95_stops - 1.0).abs() < 1e-6);
        assert_eq!(found.most_bytes, 40.0);
        assert_eq!(report.materials[0].0, "t/wall");
        let picture = picture(&a, &b, &pages).unwrap().unwrap();
        assert_eq!(picture.width(), 3 * size + 8);
        let at = |x: usize, y: usize| picture.pixels()[(y * picture.width() + x) * 3];
        assert_eq!([at(0, 0), at(size + 4, 0)], [40, 80]);
        assert_eq!(
            [at(2 * size + 8, 0), at(2 * size + 8, size / 2 - 1)],
            [255, 128]
        );
        assert_eq!(at(size - 1, 0), 0);
    }

    #[test]
    fn other_layouts_are_refused() {
        let (a, mut b) = (room(), room());
        assert!(same_layout(&a, &b).is_ok());
        let first = b.surfaces[0].first_vert as usize;
        b.vertices[first].lightmap.x += 0.01;
        let error = same_layout(&a, &b).unwrap_err().to_string();
        assert!(error.contains("surface 0"), "{error}");
        b.surfaces.pop();
        assert!(same_layout(&a, &b).is_err());
    }

    #[test]
    fn directions_of_deluxe_maps_are_compared() {
        let (mut a, mut b) = (room(), room());
        for (map, texel) in [(&mut a, [127, 127, 255]), (&mut b, [127, 255, 127])] {
            map.lightmaps.truncate(1);
            let size = map.lightmap_size();
            map.lightmaps
                .push(Lightmap(texel.repeat(size * size).into()));
        }
        let report = report(&args(), &a, &b, &covered(&a));
        let [median, p95] = report.deluxe_degrees.unwrap();
        assert!((median - 90.0).abs() < 1.0 && median == p95, "{median}");
    }

    #[test]
    fn directions_of_the_grid_are_compared() {
        let (mut a, mut b) = (room(), room());
        let up = GridPoint {
            ambient: [10; 3],
            directed: [20; 3],
            longitude: 0,
            latitude: 0,
        };
        let side = GridPoint {
            longitude: 64,
            ..up
        };
        let wall = GridPoint {
            ambient: [0; 3],
            directed: [0; 3],
            ..up
        };
        a.light_grid = vec![up, wall];
        b.light_grid = vec![side, wall];
        let report = report(&args(), &a, &b, &covered(&a));
        let [median, _] = report.grid_degrees.unwrap();
        assert!((median - 90.0).abs() < 1e-3, "{median}");
        assert_eq!(report.grid_ambient.unwrap().places, 1);
    }
}
