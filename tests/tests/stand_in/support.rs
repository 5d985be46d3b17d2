//! What these tests share: the engine with the small game, and looking at pictures.

use relight::compare::Rgb8;
use std::cell::Cell;
use tests::engine::{Engine, Message, Options, Tables};
use tests::maps::{self, ROOMS};

thread_local! {
    static TABLES: Cell<Tables> = const { Cell::new(Tables::Ioquake3) };
}

/// Runs a test with the tables of an engine.
pub(super) fn with_tables(tables: Tables, test: fn()) {
    TABLES.set(tables);
    test();
}

/// Makes a test of each function for each engine.
macro_rules! for_every_engine {
    ($($test:ident),* $(,)?) => {
        mod ioquake3 { $( #[test] fn $test() { crate::support::with_tables(tests::engine::Tables::Ioquake3, super::$test); } )* }
        mod openarena { $( #[test] fn $test() { crate::support::with_tables(tests::engine::Tables::OpenArena, super::$test); } )* }
        mod tremulous { $( #[test] fn $test() { crate::support::with_tables(tests::engine::Tables::Tremulous, super::$test); } )* }
        mod quake3e { $( #[test] fn $test() { crate::support::with_tables(tests::engine::Tables::Quake3e, super::$test); } )* }
    };
}
pub(super) use for_every_engine;

/// The small game, and the tables of the engine under test.
pub(super) fn options() -> Options {
    Options {
        files: maps::files(),
        tables: TABLES.get(),
        ..Options::default()
    }
}

/// An engine with the small game, its menu registered.
pub(super) fn engine() -> Engine {
    Engine::start(options()).expect("the library starts")
}

/// The same, in its map.
pub(super) fn engine_in_map() -> Engine {
    let mut engine = engine();
    engine.start_map(ROOMS).expect("the map loads");
    engine
}

pub(super) fn pixel(picture: &Rgb8, x: usize, y: usize) -> [u8; 3] {
    let at = (y * picture.width() + x) * 3;
    let p = picture.pixels();
    [p[at], p[at + 1], p[at + 2]]
}

/// Keeps a picture below `RELIGHT_PICTURES`, for whoever wants to see what a test saw.
pub(super) fn dump(picture: &Rgb8, name: &str) {
    tests::data::keep_picture(picture, name);
}

pub(super) fn near(a: [u8; 3], b: [u8; 3], tolerance: u8) -> bool {
    a.iter().zip(b).all(|(&a, b)| a.abs_diff(b) <= tolerance)
}

pub(super) fn text_of(messages: &[Message]) -> String {
    messages
        .iter()
        .map(|message| message.text.as_str())
        .collect()
}

pub(super) fn image_of(bytes: &[u8], extension: &str) -> Rgb8 {
    let image = relight::image::decode("a picture", extension, bytes).unwrap();
    let pixels = image.pixels().flat_map(|[r, g, b, _]| [r, g, b]).collect();
    Rgb8::new(image.width as usize, image.height as usize, pixels).unwrap()
}
