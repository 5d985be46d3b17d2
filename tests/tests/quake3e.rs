//! A program that identifies itself as Quake3e: the library refuses it by its text, whatever its table.

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
        let Err(LoadError::Refused(text)) = Engine::load(&tests::data::library(), options) else {
            panic!("{tables:?} is served")
        };
        assert!(text.contains("it is Quake3e"), "{text}");
        assert!(text.contains("+set cl_renderer opengl\""), "{text}");
        assert!(text.contains("RELIGHT_ENGINE=ioquake3"), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }
}
