//! Rooms whose baked light lies in images that scripts name, and in light styles.

use super::*;

/// What light is multiplied by, so that no texel of an image is at its end: an image stores a quarter of a page's range.
const DIM: f32 = 0.5;

/// A room whose faces have a material each, `t/0` and on, of `stages`; there `PAGE` is the path of the face's own image,
/// which shows `shown`. `stored`: the light of the map's own pages.
fn room_with_images(
    stored: Option<&dyn Fn(Vec3, Vec3) -> Vec3>,
    shown: &dyn Fn(Vec3, Vec3) -> Vec3,
    stages: &str,
) -> RelitWorld {
    // The map's pages hold a quarter of light: what they store is shown four times as bright.
    let quarter = |at: Vec3, normal: Vec3| shown(at, normal) * 4.0;
    let images = room_map("t/wall", false, usize::MAX, Some(&quarter)).build();
    let mut builder = room_map(
        "t/wall",
        false,
        usize::MAX,
        Some(stored.unwrap_or(&quarter)),
    );
    let shaders: Vec<_> = (0..images.lightmaps.len())
        .map(|face| builder.add_shader(&format!("t/{face}"), 0, 1))
        .collect();
    let mut map = builder.build();
    if stored.is_none() {
        map.lightmaps.clear();
    }
    let mut files = MemoryFiles::new();
    let mut script = String::new();
    for (face, page) in images.lightmaps.iter().enumerate() {
        let path = format!("maps/room/lm_{face:04}.tga");
        // bottom row first, blue first
        let mut tga = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128, 0, 128, 0, 24, 0];
        let rows = page.0.as_chunks::<3>().0.chunks(page.size()).rev();
        tga.extend(rows.flatten().flat_map(|&[r, g, b]| [b, g, r]));
        files.insert(&path, tga).unwrap();
        script += &format!("t/{face}\n{{\n{}\n}}\n", stages.replace("PAGE", &path));
        map.surfaces[face].shader = shaders[face];
        if stored.is_none() {
            map.surfaces[face].lightmap = q3bsp::lightmap_index::BY_VERTEX;
        }
    }
    files.insert("scripts/room.shader", script).unwrap();
    let (materials, diagnostics) = Materials::load(&files);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let options = Options {
        light_color: LightColor::Stored,
        calibrate: None,
        ..Options::default()
    };
    RelitWorld::from_bsp(&files, &materials, "maps/room.bsp", map, options)
}

/// Light of some hidden lights.
fn light_of(lights: std::ops::Range<usize>) -> impl Fn(Vec3, Vec3) -> Vec3 {
    move |at, normal| {
        let seen = HIDDEN[lights.clone()]
            .iter()
            .filter(|(o, _)| !in_pillar(at, *o));
        let light = seen.map(|(origin, intensity)| {
            let offset = *origin - at;
            *intensity * (normal.dot(offset).max(0.0) / offset.length().powi(3) / PI)
        });
        light.sum::<Vec3>() * DIM
    }
}

/// Within 10 % of some hidden lights together, and some light near each.
fn assert_found(found: &[PointLight], hidden: std::ops::Range<usize>) {
    let sum: Vec3 = found.iter().map(|l| l.intensity).sum();
    let meant: Vec3 = HIDDEN[hidden.clone()].iter().map(|(_, i)| *i * DIM).sum();
    let off = (sum / meant - 1.0).abs().max_element();
    assert!(off < 0.1, "{sum} for {meant}: {found:?}");
    for (origin, _) in &HIDDEN[hidden] {
        let nearest = found.iter().map(|l| l.origin.distance(*origin));
        let nearest = nearest.fold(f32::INFINITY, f32::min);
        assert!(nearest < 32.0, "{nearest} units from {origin}: {found:?}");
    }
}

#[test]
fn pages_that_scripts_name_are_measured() {
    let stages = "{\nmap PAGE\ntcGen lightmap\n}\n{\nmap *white\nblendFunc filter\n}";
    let mut world = room_with_images(None, &light_of(0..3), stages);
    let report = calibrate(&mut world, &small());
    assert_eq!(report.evidence, Evidence::Lightmaps);
    assert!(report.after.median_stops < 0.05, "{report:?}");
    assert_found(&world.point_lights, 0..3);
    // baked light is no part of what surfaces throw back
    assert_eq!(world.materials[0].resolved.shader.stages.len(), 2);
}

#[test]
fn light_of_styles_is_found_by_itself_and_pulses() {
    let stages = "{\nmap $lightmap\n}\n\
        {\nmap PAGE\nblendFunc GL_SRC_ALPHA GL_ONE\nrgbGen wave square 0.5 0.5 0 1\ntcGen lightmap\n}\n\
        {\nmap *white\nblendFunc filter\n}";
    let mut world = room_with_images(Some(&light_of(0..1)), &light_of(1..3), stages);
    let before = world.surfaces.clone();
    calibrate(&mut world, &small());
    assert_eq!((before, world.pages.len()), (world.surfaces.clone(), 12));
    let (pulsing, steady): (Vec<PointLight>, Vec<PointLight>) =
        world.point_lights.iter().partition(|l| l.pulse.is_some());
    assert_found(&steady, 0..1);
    // half of the time at full strength
    let full: Vec<PointLight> = (pulsing.iter())
        .map(|light| PointLight {
            intensity: light.intensity * light.pulse.unwrap().scale(0.25),
            ..*light
        })
        .collect();
    assert_found(&full, 1..3);
    assert!(pulsing.iter().all(|l| l.pulse.unwrap().scale(0.75) == 0.0));
    assert_eq!(world.light_lists.row(-1).len(), world.point_lights.len());
}
