//! A program that says that it is Quake3e: the library refuses it by its text, whatever its table.

use tests::engine::{Engine, LoadError, Options, Tables};

/// What Quake3e's executable holds, kept although nothing reads it.
#[used]
static TEXT: [u8; 33] = *b"trap_R_AddLinearLightToScene_Q3E\0";

#[test]
fn quake3e_is_named_and_told_the_way_back() {
    for tables in [Tables::Quake3e, Tables::OpenArena, Tables::Ioquake3] {
        let options = Options {
            tables,
            ..Options::default()
        };
        let Err(LoadError::Refused(said)) = Engine::load(&tests::data::library(), options) else {
            panic!("{tables:?} is served")
        };
        assert!(said.contains("it is Quake3e"), "{said}");
        assert!(said.contains("+set cl_renderer opengl\""), "{said}");
        assert!(said.contains("RELIGHT_ENGINE=ioquake3"), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}
