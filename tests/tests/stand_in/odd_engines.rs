//! Engines that are not what they claim to be: a line of text, and no crash.

use super::support::{options, text_of};
use std::ffi::{c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::rc::Rc;
use std::sync::atomic::AtomicUsize;
use std::{fs, ptr};
use tests::engine::{Engine, Lies, LoadError, Options, Tables, View};
use tests::maps::{HERE, ROOMS};

/// File name of a program.
const ENGINE: &str = if cfg!(windows) {
    "engine.exe"
} else {
    "engine"
};

/// Set in the process of [`apart`].
const APART: &str = "RELIGHT_TEST_APART";

/// What `GetRefAPI` prints before it returns no table.
fn refusal(options: Options) -> String {
    match Engine::load(&tests::data::library(), options) {
        Err(LoadError::Refused(printed)) => printed,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("such an engine is served"),
    }
}

fn lying(lies: Lies) -> Options {
    Options { lies, ..options() }
}

fn with_table(change: impl Fn(&mut [usize]) + 'static) -> Options {
    lying(Lies {
        table: Some(Rc::new(change)),
        ..Lies::default()
    })
}

/// Runs a test of this program in a process of its own, whose program has another file name. Returns what it prints;
/// `None` in that process.
fn apart(test: &str, program: &str, vulkan: bool) -> Option<String> {
    if std::env::var_os(APART).is_some() {
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join(program);
    fs::copy(std::env::current_exe().unwrap(), &program).unwrap();
    let mut command = Command::new(program);
    command
        .args(["--exact", test, "--nocapture"])
        .env(APART, "1")
        .env("RELIGHT_LIBRARY", tests::data::library());
    if !vulkan {
        for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            command.env(variable, "/nonexistent");
        }
    }
    let output = command.output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8_lossy(&text).into_owned();
    assert!(output.status.success(), "{}: {text}", output.status);
    assert!(text.contains("1 passed"), "{text}");
    Some(text)
}

/// A copy of the library in a folder.
fn copy(folder: &Path, name: &str) -> PathBuf {
    let copy = folder.join(format!("{name}{}", std::env::consts::DLL_SUFFIX));
    fs::copy(tests::data::library(), &copy).unwrap();
    copy
}

/// A frame of the small map, which is not black.
fn assert_draws(engine: &mut Engine) {
    engine.start_map(ROOMS).unwrap();
    let picture = engine.picture(&View::new(HERE, 30.0)).unwrap();
    assert!(picture.mean_luminance() > 4.0);
}

#[test]
fn engines_with_other_tables_are_refused_before_their_services_are_called() {
    let claims = |tables, version: &str| Options {
        tables,
        cvars: vec![("version".to_owned(), version.to_owned())],
        ..options()
    };
    for (tables, version, found) in [
        (Tables::OpenArena, "SG 1.1", "its version is \"SG 1.1\""),
        // under a file name that other engines load, too
        (Tables::Quake3e, "Q3 1.32e", "52 services"),
    ] {
        let printed = refusal(claims(tables, version));
        assert!(printed.contains(found), "{printed}");
        assert!(printed.contains("+set cl_renderer opengl1"), "{printed}");
        assert_eq!(printed.lines().count(), 1, "{printed}");
    }
    // what an engine calls itself does not matter where its tables tell
    for tables in [Tables::WorldOfPadman, Tables::Ioquake3] {
        let options = claims(tables, "OpenArena 0.8.8 oa2020");
        let engine = Engine::start_with(&tests::data::library(), options);
        assert_draws(&mut engine.expect("it has ioquake3's services"));
    }
}

#[test]
fn other_versions_of_the_interface_are_named() {
    for version in [i32::MIN, 0, 7, 9] {
        let printed = refusal(lying(Lies {
            version: Some(version),
            ..Lies::default()
        }));
        let both = format!(
            "supports version 8 of the renderer interface, this engine has version {version}\n"
        );
        assert!(printed.ends_with(&both), "{printed}");
    }
    // with the table of such an engine, which has another function there or none
    let printed = refusal(lying(Lies {
        version: Some(7),
        table: Some(Rc::new(|words| words[0] = 5)),
        ..Lies::default()
    }));
    assert_eq!(printed, "");
}

#[test]
fn engines_without_a_table_are_refused() {
    let said = apart(
        "odd_engines::engines_without_a_table_are_refused",
        ENGINE,
        true,
    );
    if let Some(said) = said {
        let line = "Relight: GetRefAPI got no table of services";
        assert_eq!(said.matches(line).count(), 3, "{said}");
        return;
    }
    let no_table = Lies {
        no_table: true,
        ..Lies::default()
    };
    assert_eq!(refusal(lying(no_table)), "");
    for word in [0, 1] {
        assert_eq!(refusal(with_table(move |words| words.fill(word))), "");
    }
}

#[test]
fn short_tables_are_refused_unless_they_have_what_drawing_needs() {
    for count in 1..34 {
        // numbers behind the last service
        let printed = refusal(with_table(move |words| words[count..].fill(5)));
        let odd = format!("service {count} of its table is no function");
        assert!(printed.contains(&odd), "{printed}");
        assert_eq!(printed.lines().count(), 1, "{printed}");
    }
    // zeros: Error, Cvar_Get, FS_ReadFile and FS_FreeFile are services 1, 8, 22 and 23
    for (count, absent) in [
        (1, "Error"),
        (8, "Cvar_Get"),
        (22, "FS_ReadFile"),
        (23, "FS_FreeFile"),
    ] {
        let printed = refusal(with_table(move |words| words[count..].fill(0)));
        assert!(
            printed.contains(&format!("its table has no {absent}")),
            "{printed}"
        );
    }
    let alone = with_table(|words| {
        // with Cvar_SetDescription, by which this engine is recognized
        let needed = |at| matches!(at, 0 | 1 | 8 | 12 | 22 | 23);
        for (at, word) in words.iter_mut().enumerate() {
            if !needed(at) {
                *word = 0;
            }
        }
    });
    let mut engine = Engine::start_with(&tests::data::library(), alone).unwrap();
    engine.start_map(ROOMS).unwrap();
    // without the command that takes a picture
    engine.begin_frame(0).unwrap();
    engine.clear_scene().unwrap();
    engine.render_scene(&View::new(HERE, 30.0)).unwrap();
    engine.end_frame().unwrap();
}

/// `Cvar_Get` of an engine whose variables begin otherwise.
extern "C" fn variable(_: *const c_char, _: *const c_char, _: c_int) -> *mut c_void {
    static WORDS: [AtomicUsize; 32] = [const { AtomicUsize::new(0x5555_5555) }; 32];
    WORDS.as_ptr().cast_mut().cast()
}

/// The same with null pointers.
extern "C" fn empty_variable(_: *const c_char, _: *const c_char, _: c_int) -> *mut c_void {
    static WORDS: [AtomicUsize; 32] = [const { AtomicUsize::new(0) }; 32];
    WORDS.as_ptr().cast_mut().cast()
}

/// The same with text and numbers that do not belong together: all words point at words with 49, which is `1` as text.
extern "C" fn mixed_variable(_: *const c_char, _: *const c_char, _: c_int) -> *mut c_void {
    static TEXT: AtomicUsize = AtomicUsize::new(49);
    static WORDS: [AtomicUsize; 32] = [const { AtomicUsize::new(0) }; 32];
    for word in &WORDS {
        word.store(
            (&raw const TEXT).expose_provenance(),
            std::sync::atomic::Ordering::Relaxed,
        );
    }
    WORDS.as_ptr().cast_mut().cast()
}

extern "C" fn no_variable(_: *const c_char, _: *const c_char, _: c_int) -> *mut c_void {
    ptr::null_mut()
}

extern "C" fn unreadable_variable(_: *const c_char, _: *const c_char, _: c_int) -> *mut c_void {
    ptr::without_provenance_mut(8)
}

#[test]
fn variables_of_another_layout_are_refused() {
    type CvarGet = extern "C" fn(*const c_char, *const c_char, c_int) -> *mut c_void;
    let services: [CvarGet; 5] = [
        variable,
        empty_variable,
        mixed_variable,
        no_variable,
        unreadable_variable,
    ];
    for service in services {
        // the address is the function's own in this program
        let address = (service as *const ()).expose_provenance();
        let printed = refusal(with_table(move |words| words[8] = address));
        assert!(
            printed.contains("its variables have another layout"),
            "{printed}"
        );
        assert_eq!(printed.lines().count(), 1, "{printed}");
    }
}

#[test]
fn a_thread_that_did_not_load_the_library_is_told_once() {
    let test = "odd_engines::a_thread_that_did_not_load_the_library_is_told_once";
    if let Some(said) = apart(test, ENGINE, true) {
        let line = "Relight draws nothing for a thread that did not call GetRefAPI";
        assert_eq!(said.matches(line).count(), 1, "{said}");
        return;
    }
    let mut engine = Engine::start_with(
        &tests::data::library(),
        lying(Lies {
            other_thread: true,
            ..Lies::default()
        }),
    )
    .unwrap();
    assert_eq!(engine.config().vidWidth, 0);
    engine.start_map(ROOMS).unwrap();
    engine.begin_frame(0).unwrap();
    engine.render_scene(&View::new(HERE, 0.0)).unwrap();
    engine.end_frame().unwrap();
    engine.shutdown(true).unwrap();
}

#[test]
fn a_library_may_be_loaded_twice() {
    let folder = tempfile::tempdir().unwrap();
    let own = tests::data::library();
    let other = copy(folder.path(), "renderer_other_x86_64");
    let mut engine = Engine::start_with(&own, options()).unwrap();
    assert_draws(&mut engine);
    let picture = engine.picture(&View::new(HERE, 30.0)).unwrap();
    // another file has a state of its own
    assert!(engine.load_beside(&other).unwrap());
    assert_eq!(engine.picture(&View::new(HERE, 30.0)).unwrap(), picture);
    // the same file starts anew, without a Shutdown
    engine.load_library().unwrap();
    engine.end_frame().unwrap();
    engine.begin_registration().unwrap();
    assert_draws(&mut engine);
    engine.assert_clean();
    drop(engine);
    assert_draws(&mut Engine::start_with(&other, options()).unwrap());
}

#[test]
fn copies_of_the_library_are_no_substitutes_for_it() {
    let test = "odd_engines::copies_of_the_library_are_no_substitutes_for_it";
    if cfg!(windows) {
        // the variables that hide drivers do not reach the loader below wine
        testkit::skip("drivers cannot be hidden under wine");
        return;
    }
    // the program, too, has the name of a renderer
    let program = format!("renderer_opengl1{}", std::env::consts::DLL_SUFFIX);
    if apart(test, &program, false).is_some() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let library = copy(folder.path(), "renderer_vk_x86_64");
    for name in ["renderer_opengl1_x86_64", "renderer_opengl2_x86_64"] {
        copy(folder.path(), name);
    }
    // an installed engine's renderer may be one
    let engine = Engine::load(&library, options()).unwrap();
    let printed = text_of(&engine.messages());
    assert!(printed.contains("Relight needs Vulkan 1.2"), "{printed}");
    assert!(
        !printed.contains(folder.path().to_str().unwrap()),
        "{printed}"
    );
}

#[test]
fn a_program_may_have_the_name_of_a_renderer() {
    let test = "odd_engines::a_program_may_have_the_name_of_a_renderer";
    let mut apart = ["quake3e_vk_x86_64", "renderer_vk_x86_64"]
        .map(|name| {
            apart(
                test,
                &format!("{name}{}", std::env::consts::EXE_SUFFIX),
                true,
            )
        })
        .into_iter();
    if apart.any(|said| said.is_none()) {
        assert_draws(&mut Engine::start(options()).unwrap());
    }
}
