//! What the maps become in the one model.

use super::exercise::exercise;
use super::room::{FORMATS, room, textures, two};
use glam::{Vec2, Vec3};
use q3bsp::quake::Texinfo;
use q3bsp::{Bsp, Format, content_flags, lightmap_index, surface_flags};

#[test]
fn rooms_become_maps_of_the_one_model() {
    for format in FORMATS {
        let bsp = Bsp::parse(&room(format).write()).unwrap();
        assert_eq!(bsp.warnings, [], "{format}");
        assert_eq!(bsp.format, format);
        exercise(&bsp);
        assert_eq!(bsp.surfaces.len(), 6);
        for surface in &bsp.surfaces {
            let vertices = bsp.surface_vertices(surface);
            let normal = surface.lightmap_vecs[2];
            // Faces look inwards, and their triangles are clockwise.
            assert!(vertices[0].position.dot(normal) < 0.0, "{format}");
            for corner in bsp.surface_indices(surface).chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|at| vertices[corner[at] as usize].position);
                assert!(
                    (c - a).cross(b - a).normalize().dot(normal) > 0.99,
                    "{format}"
                );
            }
        }
        let wall = &bsp.surfaces[0];
        let size = if two(format) { 1.0 } else { 16.0 };
        for v in bsp.surface_vertices(wall) {
            let p = v.position;
            assert_eq!(
                v.st * size,
                Vec2::new(p.x + p.y + 32.0, 16.0 - p.z),
                "{format}"
            );
            // 64 units are four cells and five texels, and corners lie in the middles of texels.
            let texel =
                v.lightmap * 512.0 - Vec2::new(wall.lightmap_x as f32, wall.lightmap_y as f32);
            let expected = Vec2::new((p.y + 32.0) / 16.0 + 0.5, (32.0 - p.z) / 16.0 + 0.5);
            assert!(
                texel.abs_diff_eq(expected, 1e-3),
                "{format}: {texel} {expected}"
            );
        }
        assert_eq!([wall.lightmap_width, wall.lightmap_height], [5, 5]);
        let page = &bsp.lightmaps[wall.lightmap as usize];
        let stored = if matches!(format, Format::Quake | Format::Bsp2 | Format::TwoPsb) {
            [1, 1, 1]
        } else {
            [2, 2, 3]
        };
        assert_eq!(
            page.texel(wall.lightmap_x as usize + 1, wall.lightmap_y as usize),
            stored,
            "{format}"
        );
        let layers = bsp.layers.surfaces[0];
        assert_eq!(layers.lightmap_styles, [0, 7, 255, 255]);
        let second = page.texel(layers.lightmap_x[0] as usize, layers.lightmap_y[0] as usize);
        let expected = if stored[2] == 1 {
            [13; 3]
        } else {
            [38, 38, 39]
        };
        assert_eq!(second, expected, "{format}");
        assert_eq!(bsp.surfaces[5].lightmap, lightmap_index::WHITE);
        let flags = |surface: usize| bsp.shader(bsp.surfaces[surface].shader).surface_flags;
        assert!(flags(5) & surface_flags::SKY != 0 && flags(0) & surface_flags::SKY == 0);
        let contents = bsp.shader(bsp.surfaces[4].shader).content_flags;
        assert_eq!(
            contents,
            if two(format) {
                content_flags::WATER
            } else {
                content_flags::LAVA
            }
        );
        assert_eq!((bsp.num_clusters(), bsp.cluster_at(Vec3::ZERO)), (1, 0));
        // It is written as a format that has place for all of it.
        let again = Bsp::parse(&bsp.write()).unwrap();
        assert_eq!(again.format, Format::Fbsp);
        assert_eq!(
            (&again.vertices, &again.surfaces),
            (&bsp.vertices, &bsp.surfaces)
        );
        assert_eq!(
            (&again.layers.surfaces, &again.lightmaps),
            (&bsp.layers.surfaces, &bsp.lightmaps)
        );
    }
}

#[test]
fn names_and_flags_become_materials() {
    let mut map = room(Format::Quake);
    map.textures = textures(
        &[
            ("{grate", 255),
            ("*slime", 0),
            ("sky1", 0),
            ("+0lamp", 230),
            ("+1lamp", 1),
        ],
        Format::Quake,
    );
    map.texinfos.push(Texinfo {
        texture: 3,
        ..map.texinfos[0].clone()
    });
    map.faces[3].texinfo = 3;
    let bsp = Bsp::parse(&map.write()).unwrap();
    let script = bsp.material_script();
    for part in [
        "textures/{grate\n{",
        "alphaFunc GE128",
        "textures/*slime\n{\n\tsurfaceparm slime",
        "tcMod turb",
        "map textures/sky1_back",
        "animMap 5 textures/+0lamp textures/+1lamp",
        "map textures/+0lamp_glow",
    ] {
        assert!(script.contains(part), "{part} in\n{script}");
    }
    let palette = vec![9; 768];
    let holes = bsp.embedded_textures[0].rgba(&palette).unwrap();
    assert_eq!(holes[..4], [9, 9, 9, 0]);
    assert_eq!(
        bsp.embedded_textures[3].glow(&palette).unwrap()[..4],
        [9, 9, 9, 255]
    );
    assert_eq!(bsp.embedded_textures[4].glow(&palette), None);

    let bsp = Bsp::parse(&room(Format::Quake2).write()).unwrap();
    let script = bsp.material_script();
    for part in [
        "textures/e1/pool+warp+66+light300\n{",
        "alphaGen const 0.66",
        "q3map_surfacelight 300",
        "skyparms env/night - -",
        "surfaceparm water",
    ] {
        assert!(script.contains(part), "{part} in\n{script}");
    }
    assert!(!script.contains("stone"));
    let gold = Bsp::parse(&room(Format::GoldSrc).write()).unwrap();
    assert_eq!(
        gold.embedded_textures[0].rgba(&[]).unwrap()[..4],
        [3, 3, 3, 255]
    );
    assert!(
        gold.material_script()
            .contains("skyparms gfx/env/night - -")
    );
}

#[test]
fn sizes_of_textures_are_told_afterwards() {
    let mut bsp = Bsp::parse(&room(Format::Quake2).write()).unwrap();
    let before = bsp.vertices[1].st;
    assert!(bsp.texel_coordinates);
    bsp.resolve_texture_sizes(|name| (name == "textures/e1/stone").then_some((32, 128)));
    assert_eq!(bsp.vertices[1].st * Vec2::new(32.0, 128.0), before);
    bsp.resolve_texture_sizes(|_| Some((1000, 1000)));
    assert_eq!(bsp.vertices[1].st * Vec2::new(32.0, 128.0), before);
}
