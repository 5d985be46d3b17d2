//! What Tremulous alone asks of its renderer: 2D pictures clipped to a region.

use super::support::{options, pixel};
use tests::engine::{Engine, Options, Tables};
use tests::maps::ROOMS;

#[test]
fn pictures_are_clipped_to_a_region() {
    let mut engine = Engine::start(Options {
        tables: Tables::Tremulous,
        ..options()
    })
    .expect("the library starts");
    let white = engine
        .register_shader_no_mip("textures/test/white")
        .unwrap();
    let mut drawn = |region| {
        let picture = engine.picture_of(|engine| {
            // a frame of pictures alone begins with the last one
            engine.set_clip_region(None)?;
            engine.set_color(Some([0.0, 0.0, 0.0, 1.0]))?;
            engine.draw_stretch_pic([0.0, 0.0, 320.0, 240.0], [0.0, 0.0, 1.0, 1.0], white)?;
            engine.set_color(None)?;
            engine.set_clip_region(region)?;
            engine.draw_stretch_pic([40.0, 40.0, 100.0, 100.0], [0.0, 0.0, 1.0, 1.0], white)
        });
        let picture = picture.unwrap();
        [
            (41, 41),
            (60, 60),
            (99, 79),
            (99, 80),
            (100, 79),
            (138, 138),
        ]
        .map(|(x, y)| pixel(&picture, x, y)[0])
    };
    assert_eq!(drawn(None), [255; 6]);
    let region = [60.0, 60.0, 100.0, 80.0];
    assert_eq!(drawn(Some(region))[1..5], [255, 255, 0, 0]);
    assert_eq!(drawn(Some([0.0; 4])), [255; 6], "an empty region");
    drawn(Some(region));
    engine.start_map(ROOMS).unwrap();
    let white = engine
        .register_shader_no_mip("textures/test/white")
        .unwrap();
    let picture = engine
        .picture_of(|engine| {
            engine.draw_stretch_pic([0.0, 0.0, 320.0, 240.0], [0.0, 0.0, 1.0, 1.0], white)
        })
        .unwrap();
    assert_eq!(
        pixel(&picture, 5, 5),
        [255; 3],
        "a new registration does not clip"
    );
    engine.assert_clean();
}
