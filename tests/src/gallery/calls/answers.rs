//! What calls answer: handles, remaps, the map's light and visibility, marks.

use glam::Vec3;

use super::script;
use crate::engine::Raised;
use crate::engine::abi::polyVert_t;
use crate::gallery::board::{Board, MAP, Shape};
use crate::gallery::{File, Stage, model};
use crate::maps;

pub(super) fn registered() -> Vec<File> {
    let mut files = model::files();
    files.extend(script(
        "r/good { { map g/base.tga } }
         r/gone { { map g/nothing.tga } }
         r/empty { surfaceparm nomarks }
         r/fog { surfaceparm fog fogparms ( 1 0 0 ) 100 }
         r/bad { { map g/base.tga } frobnicate }
         r/Upper { { map g/base.tga } }
         r/name.ext { { map g/base.tga } }
         r/nine { {map g/base.tga} {map g/base.tga} {map g/base.tga} {map g/base.tga} {map g/base.tga}
                  {map g/base.tga} {map g/base.tga} {map g/base.tga} {map g/base.tga} }",
    ));
    files.extend([
        ("r/broken.md3".to_string(), b"IDP3 but short".to_vec()),
        ("r/one.skin".to_string(), b"body,g/base\ntag_x,\n".to_vec()),
        ("r/empty.skin".to_string(), b"tag_x,\n".to_vec()),
    ]);
    files
}

pub(super) fn register(stage: &mut Stage) -> Result<(), Raised> {
    let names = [
        "g/base",
        "g/base.tga",
        "g/base.jpg",
        "G/BASE",
        "g/nothing",
        "g/nothing.tga",
        "r/good",
        "r/good.tga",
        "r/GOOD",
        "r/gone",
        "r/empty",
        "r/fog",
        "r/bad",
        "r/upper",
        "r/name.ext",
        "r/name",
        "r/nine",
        "white",
        "*white",
        "",
    ];
    let mut handles = Vec::new();
    for name in names {
        handles.push(stage.register_shader(name)?);
        handles.push(stage.register_shader_no_mip(name)?);
    }
    // numbers are the renderer's own; which of them are the same is not
    for (i, handle) in handles.iter().enumerate() {
        let first = handles.iter().position(|h| h == handle).unwrap_or(i);
        let label = format!("shader {:?} {}", names[i / 2], ["mip", "no mip"][i % 2]);
        stage.fact(
            &label,
            if *handle == 0 {
                "none".into()
            } else {
                first.to_string()
            },
        );
    }
    for name in [
        "g/dome.md3",
        "g/dome",
        "g/nothing.md3",
        "r/broken.md3",
        "*0",
        "*1",
        "",
    ] {
        let handle = stage.register_model(name)?;
        let again = stage.register_model(name)? == handle;
        stage.fact(
            &format!("model {name:?}"),
            format!("{} {again}", handle > 0),
        );
        let (low, high) = stage.model_bounds(handle)?;
        stage.fact(&format!("bounds {name:?}"), format!("{low} {high}"));
        let tag = stage.lerp_tag(handle, [0, 1], 0.25, "tag_tip")?;
        stage.fact(
            &format!("tag {name:?}"),
            format!("{tag:?}").replace([',', '[', ']'], " "),
        );
    }
    for name in [
        "r/one.skin",
        "r/ONE.skin",
        "r/empty.skin",
        "r/none.skin",
        "g/base",
        "",
    ] {
        let handle = stage.register_skin(name)?;
        let again = stage.register_skin(name)? == handle;
        stage.fact(&format!("skin {name:?}"), format!("{} {again}", handle > 0));
    }
    Ok(())
}

pub(super) fn remapped() -> Board {
    let mut board = Board::new(
        3,
        Shape::Face,
        [
            "{\nmap g/base.tga\n}",
            "{\nmap $lightmap\n}\n{\nmap g/base.tga\nblendFunc filter\n}",
            "",
        ],
    )
    .and(Shape::Model, ["{\nmap g/base.tga\n}"])
    .and(Shape::Sprite, ["{\nmap g/base.tga\n}"])
    .and(Shape::Picture, ["{\nmap g/base.tga\n}"]);
    board.script = "m/wave { { map g/white.tga rgbGen wave sawtooth 0 1 0 0.1 } }
        m/see { sort additive { map g/env.tga blendFunc add } }\n"
        .into();
    board
}

pub(super) fn remap(stage: &mut Stage) -> Result<(), Raised> {
    let board = remapped();
    stage.start_map(MAP)?;
    let view = board.view(stage);
    let show = |stage: &mut Stage, name: &str| stage.keep(name, |e| board.draw(e, &view));
    show(stage, "before")?;
    for tile in 0..6 {
        stage.remap_shader(&Board::name(tile), "m/wave", None)?;
    }
    show(stage, "wave")?;
    stage.remap_shader("tile/0", "m/wave", Some("5"))?;
    show(stage, "offset")?;
    stage.remap_shader("tile/1", "g/env", Some("0"))?;
    stage.remap_shader("g/base", "m/see", Some("2.5x"))?;
    stage.remap_shader("TILE/3", "m/see.tga", None)?;
    stage.remap_shader("tile/4", "g/nothing", None)?;
    show(stage, "others")?;
    for tile in 0..6 {
        stage.remap_shader(&Board::name(tile), &Board::name(tile), None)?;
    }
    show(stage, "back")
}

pub(super) fn queries(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(maps::ROOMS)?;
    let points = [
        maps::HERE,
        maps::ELSEWHERE,
        Vec3::new(10.0, 20.0, 30.0),
        Vec3::new(-250.0, 250.0, 250.0),
        Vec3::new(0.0, 0.0, 5000.0),
        Vec3::splat(-9000.0),
    ];
    for (i, point) in points.into_iter().enumerate() {
        let light = stage.light_for_point(point)?;
        stage.fact(
            &format!("light {i}"),
            format!("{light:?}").replace([',', '(', ')', '[', ']'], " "),
        );
        for (j, other) in points.into_iter().enumerate() {
            let seen = stage.in_pvs(point, other)?;
            stage.fact(&format!("pvs {i} {j}"), seen);
        }
    }
    let square = |center: Vec3, x: Vec3, y: Vec3| {
        [
            center - x - y,
            center + x - y,
            center + x + y,
            center - x + y,
        ]
    };
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let marks = [
        ("floor", square(Vec3::ZERO, x * 20.0, y * 20.0), -z * 20.0),
        (
            "corner",
            square(Vec3::new(250.0, 250.0, 1.0), x * 20.0, y * 20.0),
            -z * 20.0,
        ),
        (
            "wall",
            square(Vec3::new(250.0, 0.0, 100.0), y * 16.0, z * 16.0),
            x * 20.0,
        ),
        (
            "patch",
            square(Vec3::new(185.0, 0.0, 60.0), y * 16.0, z * 16.0),
            x * 20.0,
        ),
        (
            "wall backwards",
            square(Vec3::new(250.0, 0.0, 100.0), z * 16.0, y * 16.0),
            x * 20.0,
        ),
        ("away", square(Vec3::ZERO, x * 20.0, y * 20.0), z * 20.0),
        (
            "lamp",
            square(Vec3::new(40.0, 40.0, 250.0), y * 30.0, x * 30.0),
            z * 20.0,
        ),
        (
            "slanted",
            square(
                Vec3::new(0.0, 0.0, 4.0),
                Vec3::new(15.0, 0.0, 5.0),
                y * 15.0,
            ),
            Vec3::new(3.0, 0.0, -18.0),
        ),
        ("large", square(Vec3::ZERO, x * 400.0, y * 400.0), -z * 20.0),
    ];
    for (name, points, direction) in marks {
        for (most_points, most) in [(384, 128), (8, 2), (3, 1)] {
            let (corners, fragments) =
                stage.mark_fragments(&points, direction, most_points, most)?;
            let label = format!("mark {name} {most}");
            let sizes: Vec<i32> = fragments.iter().map(|f| f.numPoints).collect();
            stage.fact(&format!("{label} sizes"), format!("{sizes:?}"));
            for (i, corner) in corners.iter().enumerate() {
                stage.fact(
                    &format!("{label} {i}"),
                    format!("{:.2} {:.2} {:.2}", corner.x, corner.y, corner.z),
                );
            }
        }
    }
    for i in 0..40 {
        let token = stage.entity_token()?;
        stage.fact(&format!("token {i}"), format!("{token:?}"));
    }
    for name in ["g/dome.md3", "models/test.md3", "*0"] {
        let handle = stage.register_model(name)?;
        let (low, high) = stage.model_bounds(handle)?;
        stage.fact(
            &format!("bounds {name}"),
            format!("{low} {high}").replace([',', '[', ']'], " "),
        );
        for (frames, fraction) in [
            ([0, 1], 0.5),
            ([1, 0], 0.25),
            ([0, 0], 0.0),
            ([0, 1], 1.0),
            ([5, 9], 0.5),
            ([0, 1], 1.5),
        ] {
            for tag in ["tag_tip", "tag_top", "TAG_TOP", "tag_none", ""] {
                let found = stage.lerp_tag(handle, frames, fraction, tag)?;
                let text = format!("{found:?}").replace([',', '[', ']'], " ");
                stage.fact(&format!("tag {name} {frames:?} {fraction} {tag}"), text);
            }
        }
    }
    Ok(())
}

pub(super) fn marked() -> Board {
    let mut board = Board::new(4, Shape::Face, ["{\nmap g/base.tga\n}", ""])
        .and(Shape::Squares(1), [WALL])
        .and(Shape::Squares(4), [WALL])
        .and(Shape::Dome(1), [WALL])
        .and(Shape::Dome(6), [WALL, WALL])
        .and(Shape::Patch, [WALL]);
    board.script =
        "t/mark\n{\npolygonOffset\n{\nmap g/alpha.tga\nblendFunc blend\nrgbGen vertex\n}\n}\n"
            .to_string();
    board
}

/// Body of a shader that is lit by vertex.
const WALL: &str = "{\nmap g/base.tga\nrgbGen vertex\n}";

/// Asks for a mark on each tile, as a shot from the camera would leave one, and draws what is answered.
pub(super) fn marks(stage: &mut Stage) -> Result<(), Raised> {
    let board = marked();
    stage.start_map(MAP)?;
    let shader = stage.register_shader("t/mark")?;
    let view = board.view(stage);
    let mut polygons: Vec<Vec<polyVert_t>> = Vec::new();
    for tile in 0..board.tiles.len() {
        // those of the second row fall in aslant
        let aslant = if tile < 4 { 0.0 } else { 0.4 };
        let direction = Vec3::new(1.0, aslant, 0.0).normalize();
        let (right, up) = (Vec3::new(aslant, -1.0, 0.0).normalize(), Vec3::Z);
        let center = board.center(tile) - Vec3::X * 4.0 + Vec3::new(0.0, 9.0, 6.0);
        let corner = |a: f32, b: f32| center + right * a * 16.0 + up * b * 16.0;
        let square =
            [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(a, b)| corner(a, b));
        let (points, fragments) = stage.mark_fragments(&square, direction * 32.0, 384, 128)?;
        let sizes: Vec<i32> = fragments.iter().map(|f| f.numPoints).collect();
        stage.fact(&format!("mark {tile}"), format!("{sizes:?}"));
        for fragment in fragments {
            let (first, count) = (fragment.firstPoint as usize, fragment.numPoints as usize);
            let corners = points.iter().skip(first).take(count);
            polygons.push(
                corners
                    .map(|p| polyVert_t {
                        xyz: p.to_array(),
                        st: [right, up].map(|axis| 0.5 + (*p - center).dot(axis) / 32.0),
                        modulate: [255, 60, 20, 255],
                    })
                    .collect(),
            );
        }
    }
    stage.keep_view("marked", &view, |engine| {
        for polygon in &polygons {
            engine.add_poly(shader, polygon, polygon.len())?;
        }
        Ok(())
    })
}
