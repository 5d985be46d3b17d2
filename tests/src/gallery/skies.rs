//! Skies: boxes, clouds, both, in all directions and through a window.

use glam::Vec3;
use q3bsp::builder::MapBuilder;

use super::textures::tga_with_alpha;
use super::{File, Scene, Stage};
use crate::engine::Raised;
use crate::maps::tga;

const MAP: &str = "maps/sky.bsp";

/// A box without one side, clouds alone, clouds over a box, the same in a fog, and a sky that is in no map: the height
/// of its clouds is that of all, for it is read last.
const SCRIPT: &str = "
sky/box
{
    surfaceparm sky
    skyParms s/box - -
}
sky/clouds
{
    surfaceparm sky
    skyParms - 256 -
    {
        map g/env.tga
        tcMod scale 2 3
        tcMod scroll 0.05 0.02
        rgbGen identity
    }
    {
        map s/cloud.tga
        blendFunc blend
        tcMod scroll -0.1 0.03
        tcMod scale 4 4
    }
}
sky/both
{
    surfaceparm sky
    skyParms s/box 128 s/box
    {
        map s/cloud.tga
        blendFunc add
        tcMod rotate 5
    }
}
sky/boxless
{
    surfaceparm sky
    skyParms s/nothing 512 -
    {
        map g/env.tga
    }
}
sky/foggy
{
    surfaceparm sky
    skyParms s/box 128 -
    {
        map s/cloud.tga
        blendFunc blend
        tcMod scale 3 3
    }
}
sky/mist
{
    surfaceparm fog
    fogparms ( 0.7 0.3 0.1 ) 900
}
sky/low
{
    surfaceparm sky
    skyParms - 64 -
    {
        map g/env.tga
    }
}
";

const SKIES: [&str; 5] = ["sky/box", "sky/clouds", "sky/both", "sky/boxless", FOGGY];
/// Half of its surfaces are stored with a fog, which lies over the clouds there.
const FOGGY: &str = "sky/foggy";

fn files() -> Vec<File> {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("g/wall", 0, 1);
    let page = map.add_lightmap([50, 52, 54]);
    // one room for each, far from the next
    for (i, name) in SKIES.iter().enumerate() {
        let at = Vec3::X * (i as f32 * 4096.0);
        let sky = map.add_shader(name, 4, 1);
        let (low, high) = (at - 256.0, at + 256.0);
        let sides = map.add_box_faces(sky, low, high, true);
        map.add_cell(low, high);
        if *name == FOGGY {
            let mist = map.add_shader("sky/mist", 0, 0);
            let fog = map.add_fog_brush(mist, low, Vec3::new(high.x, high.y, -20.0), 5);
            for side in [1, 3, 4] {
                map.set_fog(sides[side], fog);
            }
        }
        // a post before the sky, and a wall with a window
        let window = |low: Vec3, high: Vec3| (at + low, at + high);
        for (low, high) in [
            window(
                Vec3::new(60.0, -90.0, -256.0),
                Vec3::new(80.0, -60.0, 100.0),
            ),
            window(
                Vec3::new(-80.0, -100.0, -256.0),
                Vec3::new(-70.0, 100.0, 10.0),
            ),
            window(Vec3::new(-80.0, 20.0, 10.0), Vec3::new(-70.0, 100.0, 60.0)),
        ] {
            let first = map.add_box_faces(wall, low, high, false);
            for face in first {
                map.set_lightmap(face, page);
            }
        }
    }
    let mut files = vec![
        (MAP.to_string(), map.build().write()),
        ("scripts/sky.shader".to_string(), SCRIPT.as_bytes().to_vec()),
        (
            "s/cloud.tga".to_string(),
            tga_with_alpha(64, 64, |x, y| {
                let thick = (x.abs_diff(32) * 4 + y.abs_diff(32) * 3).min(255);
                [230, 220, 200, 255 - thick as u8]
            }),
        ),
    ];
    // `lf` is missing
    for (i, side) in ["rt", "bk", "ft", "up", "dn"].iter().enumerate() {
        let picture = tga(64, 64, move |x, y| {
            let tone = (i as u16 * 45 + 40) as u8;
            [tone, (x * 4) as u8, (y * 4) as u8]
        });
        files.push((format!("s/box_{side}.tga"), picture));
    }
    files
}

fn look(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    stage.register_shader("sky/low")?;
    for (i, name) in SKIES.iter().enumerate() {
        for (direction, pitch, yaw) in [
            ("right", 0.0, 0.0),
            ("back", -15.0, 75.0),
            ("window", -5.0, 180.0),
            ("up", -80.0, 30.0),
            ("down", 70.0, -45.0),
        ] {
            let mut view = stage.view(Vec3::X * (i as f32 * 4096.0), yaw);
            view.angles.x = pitch;
            stage.set_time(700);
            let name = format!("{}-{direction}", name.trim_start_matches("sky/"));
            stage.keep_view(&name, &view, |_| Ok(()))?;
        }
    }
    Ok(())
}

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    let scene = |name, about, cvars| Scene {
        files,
        cvars,
        size: (320, 240),
        ..Scene::new(name, about, look)
    };
    vec![
        Scene {
            quick: true,
            ..scene("sky", "Skies in all directions.", &[])
        },
        scene(
            "sky-fast",
            "The same with r_fastsky.",
            &[("r_fastsky", "1")],
        ),
    ]
}
