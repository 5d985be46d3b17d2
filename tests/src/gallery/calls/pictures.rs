//! What is drawn in window pixels: pictures, raw pictures, fonts.

use super::{WHOLE, clear};
use crate::engine::Raised;
use crate::engine::abi::fontInfo_t;
use crate::gallery::{File, Stage, textures};
use crate::maps;

pub(super) const PICTURES: &str = "
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

pub(super) fn between(stage: &mut Stage) -> Result<(), Raised> {
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

pub(super) fn pictures(stage: &mut Stage) -> Result<(), Raised> {
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

pub(super) fn raw(stage: &mut Stage) -> Result<(), Raised> {
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

pub(super) fn fonts() -> Vec<File> {
    let mut files: Vec<File> = maps::files()
        .into_iter()
        .filter(|(name, _)| name.starts_with("fonts/"))
        .collect();
    if let Some((_, bytes)) = files.iter().find(|(name, _)| name.ends_with(".dat")) {
        let short = bytes[..20_000].to_vec();
        files.push(("fonts/fontImage_16.dat".into(), short));
    }
    files.retain(|(name, _)| !name.ends_with(".tga"));
    let letters = textures::files()
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

pub(super) fn font(stage: &mut Stage) -> Result<(), Raised> {
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
