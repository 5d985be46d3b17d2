//! What is drawn in two dimensions: pictures, raw frames, fonts.

use super::support::{dump, engine, near, pixel};

#[test]
fn pictures_land_where_they_are_drawn() {
    let mut engine = engine();
    let red = engine.register_shader_no_mip("gfx/2d/red").unwrap();
    let quarters = engine.register_shader_no_mip("gfx/2d/quarters").unwrap();
    let tinted = engine.register_shader("gfx/2d/tinted").unwrap();
    assert!(red > 0 && quarters > 0 && tinted > 0);
    assert_eq!(engine.register_shader_no_mip("gfx/2d/red").unwrap(), red);
    assert_eq!(engine.register_shader("gfx/2d/nothing-here").unwrap(), 0);
    let whole = [0.0, 0.0, 1.0, 1.0];
    let picture = engine
        .picture_of(|e| {
            e.set_color(None)?;
            e.draw_stretch_pic([10.0, 20.0, 100.0, 50.0], whole, red)?;
            e.draw_stretch_pic([160.0, 120.0, 160.0, 120.0], whole, quarters)?;
            e.set_color(Some([0.0, 1.0, 0.0, 1.0]))?;
            e.draw_stretch_pic([10.0, 180.0, 40.0, 40.0], whole, tinted)?;
            e.set_color(None)?;
            // half of the picture's width
            e.draw_stretch_pic([200.0, 10.0, 100.0, 40.0], [0.5, 0.0, 1.0, 0.5], quarters)?;
            e.draw_stretch_pic([0.0, 0.0, 1.0, 1.0], whole, red)
        })
        .unwrap();
    assert!(near(pixel(&picture, 60, 45), [255, 0, 0], 1));
    for (x, y) in [(8, 45), (112, 45), (60, 18), (60, 72)] {
        assert!(near(pixel(&picture, x, y), [0; 3], 1), "{x} {y}");
    }
    // columns go right and rows go down
    assert!(near(pixel(&picture, 180, 140), [200, 200, 40], 2));
    assert!(near(pixel(&picture, 300, 140), [0, 200, 40], 2));
    assert!(near(pixel(&picture, 180, 220), [200, 0, 40], 2));
    assert!(near(pixel(&picture, 30, 200), [0, 255, 0], 1));
    dump(&picture, "pictures");
    let corner = pixel(&picture, 280, 30);
    assert!(near(corner, [0, 200, 40], 2), "{corner:?}");
    engine.assert_clean();
}

#[test]
fn raw_pictures_are_drawn_and_replaced() {
    let mut engine = engine();
    let flat = |color: [u8; 4]| color.repeat(32 * 32);
    let picture = engine.picture_of(|e| {
        e.draw_stretch_raw([40, 40, 100, 100], 32, &flat([0, 80, 160, 255]), 0, true)
    });
    assert!(near(pixel(&picture.unwrap(), 90, 90), [0, 80, 160], 1));
    // not dirty: what was uploaded before is shown
    let picture = engine
        .picture_of(|e| e.draw_stretch_raw([0, 0, 320, 240], 32, &flat([9, 9, 9, 255]), 0, false));
    assert!(near(pixel(&picture.unwrap(), 300, 200), [0, 80, 160], 1));
    engine
        .upload_cinematic(32, &flat([160, 0, 80, 255]), 0)
        .unwrap();
    let picture = engine
        .picture_of(|e| e.draw_stretch_raw([0, 0, 320, 240], 32, &flat([9, 9, 9, 255]), 0, false));
    assert!(near(pixel(&picture.unwrap(), 300, 200), [160, 0, 80], 1));
    engine.assert_clean();
    // a side that is no power of two drops the game
    let raised = engine
        .draw_stretch_raw([0, 0, 320, 240], 24, &[0; 24 * 24 * 4], 1, true)
        .unwrap_err();
    assert_eq!(raised.level, 1);
    assert!(raised.message.contains("24"), "{raised}");
}

#[test]
fn fonts_have_their_glyphs() {
    let mut engine = engine();
    let font = engine.register_font("", 12).unwrap();
    let a = &font.glyphs[usize::from(b'A')];
    assert_eq!((a.height, a.top, a.xSkip, a.imageWidth), (12, 10, 9, 8));
    assert!((font.glyphScale - 0.5 * 48.0 / 12.0).abs() < 10.0 && font.glyphScale > 0.0);
    assert!(a.glyph > 0, "a glyph has no shader");
    engine.assert_clean();
}
