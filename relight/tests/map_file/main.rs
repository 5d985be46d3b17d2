//! A `.map` is the compiled map again: its brushes are made into solids as a compiler does it, and compared with the
//! compiled map's own lumps.

mod read;
mod solid;

use glam::{DVec2, DVec3, Vec3};
use q3bsp::{Brush, Bsp, DrawVert, SurfaceKind, surface_flags};
use read::{Entity, Face, Patch};
use relight::export::{Brushes, Export, ExportOptions, Format, ImageStore, export};
use relight::{GameFiles, Materials, MemoryFiles, Options, Pk3, RelitWorld, SearchPath};
use std::collections::HashMap;

/// A part of a repetition: a texel of an image of 512.
const TEXEL: f64 = 1.0 / 512.0;

fn write(files: &dyn GameFiles, map: &str, brushes: Brushes) -> (String, RelitWorld) {
    let (materials, _) = Materials::load(files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    let world = RelitWorld::load(files, &materials, map, options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.map");
    let source = Export {
        world: &world,
        files,
        materials: &materials,
        images: &ImageStore::default(),
        options: ExportOptions {
            brushes,
            ..ExportOptions::default()
        },
    };
    export(&source, Format::Map, &path).unwrap();
    (std::fs::read_to_string(&path).unwrap(), world)
}

/// What was compared.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
struct Agreement {
    entities: usize,
    brushes: usize,
    /// Brushes of the map that are no solids, and left out.
    open: usize,
    /// Brushes that are no closed solids when they are made of what is written.
    unclosed: usize,
    /// Brushes whose bounds differ from those that the compiler wrote by more than a tenth of a unit.
    other_bounds: usize,
    /// Brushes marked as detail.
    detail: usize,
    patches: usize,
    /// Drawn triangles of flat surfaces.
    triangles: usize,
    /// Of these, those that lie on faces of brushes with the material's name. The others are curves and models that the
    /// compiler made triangles of, and what it scaled for the sky.
    on_faces: usize,
    /// Of these, those on which the faces' textures lie as they are drawn.
    aligned: usize,
}

impl Agreement {
    fn add(&mut self, other: &Agreement) {
        for (mine, others) in [
            (&mut self.entities, other.entities),
            (&mut self.brushes, other.brushes),
            (&mut self.open, other.open),
            (&mut self.unclosed, other.unclosed),
            (&mut self.other_bounds, other.other_bounds),
            (&mut self.detail, other.detail),
            (&mut self.patches, other.patches),
            (&mut self.triangles, other.triangles),
            (&mut self.on_faces, other.on_faces),
            (&mut self.aligned, other.aligned),
        ] {
            *mine += others;
        }
    }
}

/// A face with its polygon.
struct Made<'a> {
    face: &'a Face,
    polygon: Vec<DVec3>,
}

/// Size of the image of a face's material.
fn image_of(face: &Face, world: &RelitWorld, files: &dyn GameFiles) -> Option<DVec2> {
    let named = |name: &str| {
        let name = name.to_ascii_lowercase();
        name.strip_prefix("textures/").unwrap_or(&name) == face.name.to_ascii_lowercase()
    };
    let material = world.materials.iter().find(|m| named(&m.name))?;
    // as editors: the image of the material's name, otherwise that of its first stage
    let stage = (material.resolved.script.as_ref()).and_then(|script| script.image_names().next());
    let mut names = [Some(material.name.as_str()), stage].into_iter().flatten();
    let (width, height) = names.find_map(|name| relight::image::texture_size(files, name))?;
    Some(DVec2::new(width.into(), height.into()))
}

fn agreement(text: &str, world: &RelitWorld, files: &dyn GameFiles) -> Agreement {
    let bsp = &world.bsp;
    let mut out = Agreement::default();
    let mut file = read::read(text);
    for face in file.iter_mut().flat_map(|e| e.brushes.iter_mut().flatten()) {
        face.image = image_of(face, world, files).unwrap_or(face.image);
    }
    let entities = bsp.entities();
    assert_eq!(file.len(), entities.len());
    out.entities = file.len();
    for (number, (entity, found)) in entities.iter().zip(&file).enumerate() {
        let model = match number {
            0 => Some(0),
            _ => entity.brush_model().filter(|&n| n < bsp.models.len()),
        };
        same_keys(&entity.pairs, found, model);
        if let Some(model) = model {
            same_model(bsp, model, found, &mut out);
        } else {
            assert!(found.brushes.is_empty() && found.patches.is_empty());
        }
    }
    out
}

/// All keys but the number of the model, and the version of the form.
fn same_keys(pairs: &[(String, String)], found: &Entity, model: Option<usize>) {
    let clean = |text: &str| text.replace(['"', '\n', '\r'], " ");
    let of_compiler = |key: &str| model.is_some_and(|n| n > 0) && key.eq_ignore_ascii_case("model");
    let expected = pairs
        .iter()
        .filter(|(key, value)| !of_compiler(key) && !key.is_empty() && !value.is_empty())
        .map(|(key, value)| (clean(key), clean(value)));
    let found = found.pairs.iter().filter(|(key, _)| key != "mapversion");
    let mut found: Vec<_> = found.cloned().collect();
    let mut expected: Vec<_> = expected.filter(|(key, _)| key != "mapversion").collect();
    // Some editors give names to entities, and sort keys.
    found.retain(|pair| pair.0 != "name" || expected.contains(pair));
    found.sort();
    expected.sort();
    assert_eq!(expected, found);
}

fn same_model(bsp: &Bsp, model: usize, found: &Entity, out: &mut Agreement) {
    let origin = if model == 0 {
        DVec3::ZERO
    } else {
        found.origin()
    };
    let stored = &bsp.models[model];
    let brushes = &bsp.brushes[stored.first_brush as usize..][..stored.num_brushes as usize];
    let mut made: HashMap<String, Vec<Made<'_>>> = HashMap::new();
    let mut written = found.brushes.as_slice();
    let mut left_out = brushes.len() - written.len();
    let mut brushes = brushes.iter().peekable();
    while let Some(brush) = brushes.next() {
        let Some((faces, rest)) = written.split_first() else {
            out.open += 1;
            continue;
        };
        let polygons = solid::polygons(faces);
        let off = |brush| bounds_off(bsp, brush, &polygons, origin);
        let error = off(brush);
        let next = brushes.peek().map_or(f64::INFINITY, |&next| off(next));
        if left_out > 0 && next < error {
            left_out -= 1;
            out.open += 1;
            continue;
        }
        written = rest;
        out.brushes += 1;
        out.other_bounds += usize::from(error > 0.1);
        out.detail += usize::from(faces.iter().any(|f| f.contents != 0));
        out.unclosed += usize::from(!closed(faces, &polygons));
        for (face, polygon) in faces.iter().zip(polygons) {
            let list = made.entry(face.name.to_ascii_lowercase()).or_default();
            list.push(Made { face, polygon });
        }
    }
    assert!(written.is_empty(), "brushes that the map does not have");
    let mut patches = found.patches.iter();
    for surface in bsp.surfaces_of(stored) {
        let shader = bsp.shader(surface.shader);
        let name = shader.name.to_ascii_lowercase();
        let name = name.strip_prefix("textures/").unwrap_or(&name).to_owned();
        let vertices = bsp.surface_vertices(surface);
        match surface.kind {
            SurfaceKind::Patch => {
                let size = [surface.patch_width, surface.patch_height].map(|v| v as usize);
                same_patch(vertices, size, patches.next().unwrap(), &name, origin);
                out.patches += 1;
            }
            SurfaceKind::Planar if shader.surface_flags & surface_flags::NODRAW == 0 => {
                let list = made.get(&name).map_or(&[][..], Vec::as_slice);
                for corners in bsp.surface_triangles(surface) {
                    let corners = corners.map(|i| vertices[i as usize]);
                    triangle(corners, list, origin, out);
                }
            }
            _ => {}
        }
    }
    assert!(patches.next().is_none());
}

/// How far the bounds of polygons are from those that the compiler wrote for a brush, its first six planes; 0 where it
/// wrote none.
fn bounds_off(bsp: &Bsp, brush: &Brush, polygons: &[Vec<DVec3>], origin: DVec3) -> f64 {
    let planes = bsp.sides_of(brush).iter().map(|s| bsp.plane(s.plane));
    let planes: Vec<_> = planes.take(6).collect();
    let along = |direction: Vec3| {
        let found = planes.iter().find(|p| p.normal.dot(direction) > 0.999_999);
        found.map(|p| f64::from(p.dist))
    };
    let corners = || polygons.iter().flatten();
    [
        Vec3::X,
        Vec3::Y,
        Vec3::Z,
        Vec3::NEG_X,
        Vec3::NEG_Y,
        Vec3::NEG_Z,
    ]
    .into_iter()
    .filter_map(|direction| {
        let dist = along(direction)?;
        let direction = direction.as_dvec3();
        let reach = corners().map(|p| (*p - origin).dot(direction));
        Some((reach.fold(f64::NEG_INFINITY, f64::max) - dist).abs())
    })
    .fold(0.0, f64::max)
}

/// Whether faces are a closed convex solid: all have an area, and their areas times their normals cancel out.
fn closed(faces: &[Face], polygons: &[Vec<DVec3>]) -> bool {
    let (mut sum, mut area, mut empty) = (DVec3::ZERO, 0.0, 0);
    for (face, polygon) in faces.iter().zip(polygons) {
        let size = solid::area_vector(polygon).length();
        empty += usize::from(size <= 0.0);
        (sum, area) = (sum + face.normal * size, area + size);
    }
    empty == 0 && sum.length() < 1e-3 * area + 0.5
}

fn same_patch(
    stored: &[DrawVert],
    [width, height]: [usize; 2],
    found: &Patch,
    name: &str,
    origin: DVec3,
) {
    assert_eq!((found.width, found.height), (width, height));
    assert_eq!(found.name.to_ascii_lowercase(), name);
    for (vertex, &(p, st)) in stored.iter().zip(&found.points) {
        let vertex = vertex.finite();
        assert!(
            (vertex.position.as_dvec3() + origin - p).length() < 1e-4,
            "{p}"
        );
        let off = vertex.st.as_dvec2() - st;
        assert!(off.length() < 1e-4 * (1.0 + st.length()), "{st}");
    }
}

/// Looks for the face that a drawn triangle lies on, and compares the texture at its corners.
fn triangle(corners: [DrawVert; 3], list: &[Made<'_>], origin: DVec3, out: &mut Agreement) {
    let [a, b, c] = corners.map(|v| v.position.as_dvec3() + origin);
    let front = (c - a).cross(b - a);
    if front.length() < 1.0 {
        return;
    }
    let (normal, middle) = (front.normalize(), (a + b + c) / 3.0);
    out.triangles += 1;
    let on = |made: &&Made<'_>| {
        // Some are drawn from behind: the inside of a fog.
        made.face.normal.dot(normal).abs() > 0.999
            && [a, b, c]
                .iter()
                .all(|p| (p.dot(made.face.normal) - made.face.dist).abs() < 0.25)
            && solid::contains(&made.polygon, made.face.normal, middle)
    };
    let stored = corners.map(|v| v.st.as_dvec2());
    let (mut lies, mut fits) = (false, false);
    for made in list.iter().filter(on) {
        lies = true;
        // Whole repetitions look the same, if they are so everywhere.
        let off = [a, b, c].map(|p| made.face.st(p));
        let off: [DVec2; 3] = std::array::from_fn(|k| off[k] - stored[k]);
        let whole = off[0].round();
        fits |= off.iter().all(|o| (*o - whole).abs().max_element() < TEXEL);
    }
    out.on_faces += usize::from(lies);
    out.aligned += usize::from(fits);
}

#[test]
fn the_sample_map_comes_back() {
    let files: MemoryFiles = relight::sample::Sample::Hall.files().unwrap();
    for brushes in [Brushes::Usual, Brushes::Valve, Brushes::Classic] {
        let (text, world) = write(&files, relight::sample::Sample::Hall.map(), brushes);
        let found = agreement(&text, &world, &files);
        println!("{found:?}");
        assert!(found.open == 0 && found.brushes > 0 && found.patches > 0);
        assert!(found.on_faces > 0 && found.aligned == found.on_faces);
    }
}

#[test]
fn real_maps_come_back() {
    let Some(folder) = testkit::folder() else {
        return;
    };
    let files = SearchPath::open(&[folder]).unwrap();
    for name in ["oa_bases3cl", "q3dm6ish", "kaos"] {
        let (text, world) = write(&files, &format!("maps/{name}.bsp"), Brushes::Usual);
        let found = agreement(&text, &world, &files);
        println!("{name}: {found:?}");
        assert_eq!(found.open, 0);
        assert_eq!((found.unclosed, found.other_bounds), (0, 0), "{name}");
        assert!(
            found.on_faces * 100 > found.triangles * 90,
            "{name}: {found:?}"
        );
        assert!(
            found.aligned * 100 > found.on_faces * 94,
            "{name}: {found:?}"
        );
    }
}

/// A file that an editor saved is still the map: `MAP_FILE` names the file, `MAP` its map in the game.
#[test]
#[ignore = "needs a file saved by an editor"]
fn a_file_saved_by_an_editor_is_the_map() {
    let (Some(folder), Ok(file), Ok(map)) = (
        testkit::folder(),
        std::env::var("MAP_FILE"),
        std::env::var("MAP"),
    ) else {
        testkit::skip("MAP_FILE and MAP name the file and its map");
        return;
    };
    let files = SearchPath::open(&[folder]).unwrap();
    let (text, world) = write(&files, &format!("maps/{map}.bsp"), Brushes::Usual);
    let ours = agreement(&text, &world, &files);
    let found = agreement(&std::fs::read_to_string(file).unwrap(), &world, &files);
    println!("{map}: {found:?}");
    // Editors write projections in texels, which are unknown without the images.
    let without = |a: Agreement| Agreement { aligned: 0, ..a };
    assert_eq!(without(found), without(ours));
}

/// `cargo test --release -p relight --test map_file -- --ignored --nocapture all_maps`.
#[test]
#[ignore = "writes and reads back every map of every pack"]
fn all_maps_come_back() {
    let Some(game) = testkit::game() else {
        return;
    };
    let mut all = Agreement::default();
    let mut count = 0;
    for pack in game.all_packs() {
        let mut files = SearchPath::open(std::slice::from_ref(&game.folder)).unwrap();
        files.add_pk3(pack).unwrap();
        for map in Pk3::open(pack).unwrap().list("maps", ".bsp") {
            let (text, world) = write(&files, &format!("maps/{map}"), Brushes::Usual);
            let found = agreement(&text, &world, &files);
            println!("{map}: {found:?}");
            count += 1;
            all.add(&found);
        }
    }
    println!("{count} maps: {all:?}");
    assert!(count > 0);
    assert!(all.unclosed * 1000 < all.brushes && all.other_bounds * 100 < all.brushes);
    assert!(all.on_faces * 100 > all.triangles * 85);
    assert!(all.aligned * 1000 > all.on_faces * 990);
}
