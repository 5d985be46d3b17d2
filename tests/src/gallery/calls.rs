//! The renderer's calls, one by one: 2D, fonts, films, remaps, queries, views, captures.

use glam::Vec3;
use relight::compare::Rgb8;

use super::board::{Board, MAP, Shape};
use super::{File, Limit, Scene, Stage, model};
use crate::engine::Raised;
use crate::engine::abi::{fontInfo_t, polyVert_t, refEntity_t};
use crate::maps;

const WHOLE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    vec![
        Scene {
            files: || board().files(),
            quick: true,
            ..Scene::new(
                "first-look",
                "Pictures, text and a board of plain surfaces.",
                first_look,
            )
        },
        Scene {
            files: || script(PICTURES),
            quick: true,
            ..Scene::new("2d-pictures", "DrawStretchPic and SetColor.", pictures)
        },
        Scene {
            limit: Limit {
                ssim: 0.9999,
                ..Limit::SAME
            },
            quick: true,
            ..Scene::new(
                "2d-between",
                "Pictures whose edges run through centres of pixels, or near them.",
                between,
            )
        },
        Scene {
            quick: true,
            ..Scene::new("2d-raw", "DrawStretchRaw and UploadCinematic.", raw)
        },
        Scene {
            files: fonts,
            ..Scene::new("2d-font", "RegisterFont and its glyphs.", font)
        },
        Scene {
            files: registered,
            quick: true,
            ..Scene::new("register", "What registering answers.", register)
        },
        Scene {
            files: || remapped().files(),
            quick: true,
            ..Scene::new(
                "remap",
                "RemapShader on surfaces, entities, pictures.",
                remap,
            )
        },
        Scene {
            files: || {
                let mut files = maps::files();
                files.extend(model::files());
                files
            },
            quick: true,
            ..Scene::new("queries", "Answers about the map and models.", queries)
        },
        Scene {
            files: || marked().files(),
            ..Scene::new("marks", "Marks where the map takes them.", marks)
        },
        Scene {
            files: || marked().files(),
            cvars: &[("r_marksOnTriangleMeshes", "1")],
            ..Scene::new("marks-meshes", "Marks on triangle meshes, too.", marks)
        },
        Scene {
            files: || board().files(),
            quick: true,
            ..Scene::new("views", "Several views and pictures in a frame.", views)
        },
        Scene {
            files: || board().files(),
            ..Scene::new(
                "captures",
                "TakeVideoFrame, screenshots, level shots.",
                captures,
            )
        },
    ]
}

fn script(text: &str) -> Vec<File> {
    vec![("scripts/calls.shader".to_string(), text.as_bytes().to_vec())]
}

fn board() -> Board {
    Board::new(4, Shape::Face, ["", "{\nmap g/base.tga\nrgbGen vertex\n}"])
        .and(
            Shape::Squares(2),
            ["", "{\nmap g/base.tga\nrgbGen vertex\n}"],
        )
        .and(
            Shape::Dome(6),
            ["", "{\nmap g/env.tga\ntcGen environment\n}"],
        )
        .and(Shape::Patch, ["", "{\nmap $lightmap\n}"])
}

/// Fills the window with a colour.
fn clear(engine: &mut crate::engine::Engine) -> Result<(), Raised> {
    let white = engine.register_shader("g/white")?;
    engine.set_color(Some([0.2, 0.3, 0.4, 1.0]))?;
    engine.draw_stretch_pic([0.0, 0.0, 640.0, 480.0], WHOLE, white)?;
    engine.set_color(None)
}

fn first_look(stage: &mut Stage) -> Result<(), Raised> {
    let base = stage.register_shader_no_mip("g/base")?;
    let letters = stage.register_shader("gfx/2d/bigchars")?;
    stage.fact("handles", format!("{} {}", base > 0, letters > 0));
    stage.keep("2d", |e| {
        clear(e)?;
        e.draw_stretch_pic([40.0, 40.0, 200.0, 150.0], WHOLE, base)?;
        e.draw_stretch_pic([300.0, 40.0, 256.0, 256.0], WHOLE, letters)
    })?;
    board().play(stage, &[0])
}

const PICTURES: &str = "
p/none { cull none { map g/base.tga } }
p/back { cull back { map g/base.tga } }
p/vertex { { map g/base.tga blendFunc blend rgbGen vertex alphaGen vertex } }
p/add { { map g/env.tga blendFunc add rgbGen vertex } }
p/scroll { nopicmip { map g/base.tga tcMod scroll 0.3 0.1 } }
p/wave { { map g/white.tga rgbGen wave sin 0.5 0.5 0 1 } }
p/equal { { map g/base.tga depthFunc equal } }
p/cut { { map g/cut.tga alphaFunc GE128 rgbGen vertex } }
p/two { { map g/base.tga } { map g/env.tga blendFunc filter } }
p/light { { map $lightmap } { map g/base.tga blendFunc filter } }
p/depth { { map g/base.tga depthWrite } }
";

fn between(stage: &mut Stage) -> Result<(), Raised> {
    let steps = [0.5, 0.0, 0.499, 0.501, 0.4999, 0.5001, 0.25, 0.75];
    stage.keep("edges", |e| {
        clear(e)?;
        let base = e.register_shader("g/base")?;
        let white = e.register_shader("white")?;
        for (column, across) in (0u8..).zip(steps) {
            for (row, down) in (0u8..).zip(steps) {
                let corner = [f32::from(column) * 76.0, f32::from(row) * 56.0];
                let (x, y) = (corner[0] + 6.0 + across, corner[1] + 6.0 + down);
                e.set_color(Some([0.3, 0.9, 0.6, 1.0]))?;
                e.draw_stretch_pic([x, y, 30.0, 20.0], WHOLE, white)?;
                e.draw_stretch_pic([x + 34.0, y, 20.5, 20.5], WHOLE, base)?;
                // one line, which is drawn or not
                e.draw_stretch_pic([x, y + 26.0, 40.0, 1.0], WHOLE, white)?;
                e.draw_stretch_pic([x, y + 30.0, 40.0, 0.5], WHOLE, white)?;
            }
        }
        e.set_color(None)
    })
}

fn pictures(stage: &mut Stage) -> Result<(), Raised> {
    let names = [
        "g/base",
        "p/none",
        "p/back",
        "p/vertex",
        "p/add",
        "p/scroll",
        "p/wave",
        "p/equal",
        "p/cut",
        "p/two",
        "p/light",
        "p/depth",
        "p/missing",
    ];
    let sizes = [(40.0, 40.0), (-40.0, 40.0), (40.0, -40.0), (-40.0, -40.0)];
    for time in [0, 700] {
        stage.set_time(time);
        stage.keep(&format!("sizes-t{time}"), |e| {
            clear(e)?;
            e.set_color(Some([0.9, 0.7, 0.5, 0.6]))?;
            for (row, name) in names.iter().enumerate() {
                let shader = e.register_shader(name)?;
                for (column, (w, h)) in sizes.iter().enumerate() {
                    let corner = |v: f32| if v < 0.0 { 42.0 } else { 2.0 };
                    let (x, y) = (
                        (row % 6) as f32 * 100.0 + (column % 2) as f32 * 46.0 + corner(*w),
                        (row / 6) as f32 * 100.0 + (column / 2) as f32 * 46.0 + corner(*h),
                    );
                    e.draw_stretch_pic([x, y, *w, *h], WHOLE, shader)?;
                }
            }
            e.set_color(None)
        })?;
    }
    let colors = [
        [0.5, 0.5, 0.5, 0.5],
        [1.5, -0.5, 2.0, 1.0],
        [1.003, 0.999, 0.0, 1.0],
        [256.5, -1.0, 0.25, 0.75],
        [0.0039, 0.0078, 0.9961, 1.0],
        [1.0, 1.0, 1.0, -0.25],
        [1e6, -1e6, 3e3, 1.0],
    ];
    stage.keep("colors", |e| {
        clear(e)?;
        let shader = e.register_shader("p/vertex")?;
        for (i, color) in colors.into_iter().enumerate() {
            e.set_color(Some(color))?;
            let x = 10.0 + 85.0 * i as f32;
            e.draw_stretch_pic([x, 20.0, 80.0, 80.0], WHOLE, shader)?;
        }
        e.set_color(None)?;
        e.draw_stretch_pic([10.0, 120.0, 80.0, 80.0], WHOLE, shader)
    })?;
    // it stays from one frame to the next
    stage.set_color(Some([0.3, 0.9, 0.3, 0.8]))?;
    stage.keep("sticky", |e| {
        let shader = e.register_shader("p/vertex")?;
        let white = e.register_shader("g/white")?;
        e.draw_stretch_pic([0.0, 0.0, 640.0, 480.0], WHOLE, white)?;
        e.draw_stretch_pic([10.0, 120.0, 80.0, 80.0], WHOLE, shader)
    })?;
    stage.keep("coordinates", |e| {
        clear(e)?;
        for (row, mip) in [true, false].into_iter().enumerate() {
            for (column, name) in ["g/base", "g/wide", "g/fine", "g/cut"].iter().enumerate() {
                let shader = if mip {
                    e.register_shader(name)?
                } else {
                    e.register_shader_no_mip(&format!("{name}.tga"))?
                };
                let (x, y) = (column as f32 * 160.0, row as f32 * 240.0);
                let mut place = |dx: f32, dy: f32, st| {
                    // no edge through the middle of a pixel
                    e.draw_stretch_pic([x + dx, y + dy, 70.7, 70.4], st, shader)
                };
                place(2.5, 3.25, [0.25, 0.5, 0.75, 1.0])?;
                place(80.0, 3.0, [1.0, 0.0, 0.0, 1.0])?;
                place(2.0, 80.0, [-0.5, -0.5, 1.5, 1.5])?;
                place(80.0, 80.0, [0.0, 2.0, 2.0, 0.0])?;
                place(120.0, 160.0, [0.0, 0.0, 0.1, 0.1])?;
            }
        }
        Ok(())
    })
}

fn raw(stage: &mut Stage) -> Result<(), Raised> {
    let ramp = |columns: usize, rows: usize, blue: u8| -> Vec<u8> {
        (0..columns * rows)
            .flat_map(|at| {
                let (x, y) = (at % columns * 255 / columns, at / columns * 255 / rows);
                [x as u8, y as u8, blue, (255 - x) as u8]
            })
            .collect()
    };
    let base = stage.register_shader_no_mip("g/base")?;
    stage.keep("sizes", |e| {
        clear(e)?;
        e.draw_stretch_pic([0.0, 0.0, 300.0, 100.0], WHOLE, base)?;
        e.draw_stretch_raw([20, 20, 200, 150], 64, &ramp(64, 64, 10), 0, true)?;
        e.draw_stretch_raw([230, 20, 200, 150], 16, &ramp(16, 4, 200), 1, true)?;
        e.draw_stretch_raw([440, 20, 190, 150], 4, &ramp(4, 8, 90), 2, true)?;
        // what is uploaded is kept
        e.draw_stretch_raw([20, 190, 100, 100], 64, &ramp(64, 64, 255), 0, false)?;
        // of another size it is made anew, dirty or not
        e.draw_stretch_raw([130, 190, 100, 100], 32, &ramp(32, 32, 255), 1, false)?;
        e.upload_cinematic(16, &ramp(16, 16, 128), 3)?;
        e.draw_stretch_raw([240, 190, 100, 100], 16, &ramp(16, 16, 0), 3, false)?;
        // pictures go on over it
        e.draw_stretch_pic([300.0, 100.0, 200.0, 200.0], WHOLE, base)?;
        e.draw_stretch_raw([350, 300, 300, 200], 64, &ramp(64, 64, 60), 0, true)?;
        e.draw_stretch_raw([-20, 400, 100, 100], 64, &ramp(64, 64, 60), 0, false)
    })?;
    for (columns, rows) in [(24, 32), (32, 24)] {
        let raised = stage.draw_stretch_raw(
            [0, 0, 9, 9],
            columns,
            &ramp(columns as usize, rows, 0),
            0,
            true,
        );
        let level = raised.err().map_or(-1, |e| e.level);
        stage.fact(&format!("raised by {columns}x{rows}"), level);
    }
    Ok(())
}

fn fonts() -> Vec<File> {
    let mut files: Vec<File> = maps::files()
        .into_iter()
        .filter(|(name, _)| name.starts_with("fonts/"))
        .collect();
    if let Some((_, bytes)) = files.iter().find(|(name, _)| name.ends_with(".dat")) {
        let short = bytes[..20_000].to_vec();
        files.push(("fonts/fontImage_16.dat".into(), short));
    }
    files.retain(|(name, _)| !name.ends_with(".tga"));
    let letters = super::textures::files()
        .into_iter()
        .find(|(name, _)| name.contains("bigchars"));
    files.extend(letters.map(|(_, bytes)| ("fonts/fontImage_0_12.tga".to_string(), bytes)));
    files
}

fn tell_font(stage: &mut Stage, label: &str, font: &fontInfo_t) {
    let text: String = font
        .name
        .iter()
        .take_while(|&&c| c != 0)
        .map(|&c| char::from(c as u8))
        .collect();
    stage.fact(
        &format!("{label} font"),
        format!("{} {text}", font.glyphScale),
    );
    for code in [0usize, 32, 65, 255] {
        let g = &font.glyphs[code];
        let line = format!(
            "{} {} {} {} {} {} {} {} {} {} {} {}",
            g.height,
            g.top,
            g.bottom,
            g.pitch,
            g.xSkip,
            g.imageWidth,
            g.imageHeight,
            g.s,
            g.t,
            g.s2,
            g.t2,
            g.glyph > 0
        );
        stage.fact(&format!("{label} glyph {code}"), line);
    }
}

fn font(stage: &mut Stage) -> Result<(), Raised> {
    let font = stage.register_font("fonts/font", 12)?;
    tell_font(stage, "twelve", &font);
    for (label, points) in [
        ("default", 0),
        ("negative", -5),
        ("absent", 40),
        ("short", 16),
    ] {
        let other = stage.register_font("fonts/other", points)?;
        tell_font(stage, label, &other);
    }
    stage.keep("text", |e| {
        clear(e)?;
        e.set_color(Some([1.0, 0.9, 0.4, 0.9]))?;
        let mut x = 20.0;
        for byte in b"The quick brown fox" {
            let g = &font.glyphs[usize::from(*byte)];
            let size = [g.imageWidth as f32 * 2.0, g.imageHeight as f32 * 2.0];
            e.draw_stretch_pic(
                [x, 60.0 - g.top as f32, size[0], size[1]],
                [g.s, g.t, g.s2, g.t2],
                g.glyph,
            )?;
            x += g.xSkip as f32 * 2.0;
        }
        e.set_color(None)
    })
}

fn registered() -> Vec<File> {
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

fn register(stage: &mut Stage) -> Result<(), Raised> {
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

fn remapped() -> Board {
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

fn remap(stage: &mut Stage) -> Result<(), Raised> {
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

fn queries(stage: &mut Stage) -> Result<(), Raised> {
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

fn marked() -> Board {
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
fn marks(stage: &mut Stage) -> Result<(), Raised> {
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

fn views(stage: &mut Stage) -> Result<(), Raised> {
    let board = board();
    stage.start_map(MAP)?;
    let base = stage.register_shader_no_mip("g/alpha")?;
    let dome = stage.register_model("g/dome.md3")?;
    let whole = board.view(stage);
    let head = refEntity_t {
        hModel: dome,
        origin: [80.0, 0.0, 0.0],
        frame: 1,
        ..refEntity_t::default()
    };
    stage.set_color(None)?;
    let mut inset = stage.view(Vec3::ZERO, 0.0);
    (inset.place, inset.width, inset.height) = ([400, 20], 200, 150);
    inset.flags = 1;
    inset.fov = 60.0;
    stage.keep("inset", |e| {
        e.clear_scene()?;
        e.render_scene(&whole)?;
        e.draw_stretch_pic([300.0, 0.0, 200.0, 200.0], WHOLE, base)?;
        e.clear_scene()?;
        e.add_entity(&head)?;
        e.add_light(Vec3::new(40.0, 30.0, 0.0), 100.0, Vec3::new(1.0, 0.2, 0.1))?;
        e.render_scene(&inset)?;
        e.draw_stretch_pic([450.0, 100.0, 100.0, 100.0], WHOLE, base)
    })?;
    // without ClearScene the next scene starts empty all the same
    stage.keep("marks", |e| {
        clear(e)?;
        e.clear_scene()?;
        e.add_entity(&head)?;
        e.render_scene(&inset)?;
        let mut second = inset;
        second.place = [20, 200];
        e.render_scene(&second)?;
        e.add_entity(&head)?;
        second.place = [240, 300];
        e.render_scene(&second)
    })?;
    let mut left = whole;
    (left.width, left.fov) = (320, 60.0);
    let mut right = left;
    (right.place, right.angles.y) = ([320, 0], 20.0);
    stage.keep("split", |e| {
        clear(e)?;
        e.clear_scene()?;
        e.render_scene(&left)?;
        e.clear_scene()?;
        e.render_scene(&right)
    })?;
    for (name, flags) in [("hyperspace", 5), ("hyperspace-world", 4)] {
        let mut view = whole;
        view.flags = flags;
        stage.keep(name, |e| {
            e.clear_scene()?;
            e.add_entity(&refEntity_t {
                origin: [-20.0, 0.0, 0.0],
                ..head
            })?;
            e.render_scene(&view)
        })?;
    }
    for (name, angles) in [
        ("rolled", Vec3::new(5.0, -10.0, 40.0)),
        ("down", Vec3::new(80.0, 30.0, 0.0)),
    ] {
        let mut view = whole;
        view.angles = angles;
        stage.keep(name, |e| {
            e.clear_scene()?;
            e.render_scene(&view)
        })?;
    }
    Ok(())
}

fn captures(stage: &mut Stage) -> Result<(), Raised> {
    let board = board();
    stage.start_map(MAP)?;
    let view = board.view(stage);
    let (width, height) = stage.size();
    for jpeg in [false, true] {
        let name = if jpeg { "jpeg" } else { "raw" };
        let mut capture = vec![0; (width * height * 4) as usize + 64];
        let mut encode = capture.clone();
        stage.begin_frame(0)?;
        board.draw(stage, &view)?;
        stage.take_video_frame(width, height, &mut capture, &mut encode, jpeg)?;
        stage.end_frame()?;
        let frames = stage.take_video();
        stage.fact(&format!("{name} frames"), frames.len());
        let Some(bytes) = frames.first() else {
            continue;
        };
        let pixels: Vec<u8> = if jpeg {
            let image = image::load_from_memory(bytes).expect("a picture").to_rgb8();
            stage.fact("jpeg size", format!("{:?}", image.dimensions()));
            image.into_raw()
        } else {
            stage.fact("raw bytes", bytes.len());
            let row = width as usize * 3;
            let rows = bytes.chunks_exact(row).rev();
            rows.flat_map(|row| row.chunks_exact(3).flat_map(|p| [p[2], p[1], p[0]]))
                .collect()
        };
        let picture = Rgb8::new(width as usize, height as usize, pixels).expect("its size");
        stage.keep_picture(name, &picture);
    }
    for (command, file) in [
        ("screenshotJPEG shot", "screenshots/shot.jpg"),
        ("screenshot levelshot", "levelshots/board.tga"),
        ("screenshot", "screenshots/shot0000.tga"),
    ] {
        stage.begin_frame(0)?;
        board.draw(stage, &view)?;
        stage.command(command)?;
        stage.end_frame()?;
        let bytes = stage.read_file(file);
        stage.fact(&format!("{file} there"), bytes.is_some());
        let Some(bytes) = bytes else { continue };
        let extension = &file[file.len() - 3..];
        let image = relight::image::decode(file, extension, &bytes).expect("a picture");
        let pixels = image.pixels().flat_map(|[r, g, b, _]| [r, g, b]).collect();
        let picture =
            Rgb8::new(image.width as usize, image.height as usize, pixels).expect("its size");
        stage.keep_picture(&file.replace(['/', '.'], "-"), &picture);
    }
    Ok(())
}
