//! A program whose executable contains Quake3e's text: the library serves it, and refuses tables that are not Quake3e's.

use tests::engine::{Engine, LoadError, Options, Tables};

/// What Quake3e's executable holds, kept although nothing reads it.
#[used]
static TEXT: [u8; 33] = *b"trap_R_AddLinearLightToScene_Q3E\0";

#[test]
fn quake3e_is_served_under_any_file_name() {
    let load = |tables| {
        let options = Options {
            tables,
            ..Options::default()
        };
        Engine::load(&tests::data::library(), options)
    };
    let mut engine = load(Tables::Quake3e).expect("it is served");
    engine.begin_registration().unwrap();
    engine.assert_clean();
    drop(engine);
    // its table, cut off behind that of ioquake3: the rest are no functions
    let Err(LoadError::Refused(said)) = load(Tables::Quake3eCutOff) else {
        panic!("a table of other words is served")
    };
    assert!(
        said.contains("it looks like quake3e, but service 50"),
        "{said}"
    );
    assert!(said.contains("+set cl_renderer opengl\""), "{said}");
    assert!(said.contains("RELIGHT_ENGINE"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}
