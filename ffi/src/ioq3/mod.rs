//! The front end for ioquake3: Debian's 1.36, HEAD, and engines whose tables begin with the same entries (World of
//! Padman).

pub mod abi;
mod exports;

#[cfg(test)]
pub(crate) use exports::call_everything as call_everything_for_tests;

use crate::engine::{self, Engine, FrontEnd, Table, renderer_made_window, variable_layout};
use crate::{cvars, system};
use abi::{cvar_t, refexport_t, refimport_t};
use exports::EXPORTS;
use relight::Precedence;
use std::ffi::c_void;
use std::ptr;

/// ioquake3.
pub(crate) static FRONT_END: FrontEnd = FrontEnd {
    name: "ioquake3",
    files: &[],
    marker: None,
    recognizes: Some(keeps_descriptions),
    services: size_of::<refimport_t>() / size_of::<usize>(),
    called: 35,
    install,
    exports: || ptr::from_ref(&EXPORTS).cast(),
    functions: size_of::<refexport_t>() / size_of::<usize>(),
    opengl: &["opengl1", "opengl2"],
    libraries: &["renderer_NAME_ARCH", "renderer_NAME"],
    folders: &["/usr/lib/ioquake3"],
    base_game: c"com_basegame",
    defaults: &[],
    owned: &[],
    scripts: &[],
    precedence: Precedence::First,
};

unsafe fn install(imports: *const c_void) -> Engine {
    // SAFETY: this engine's table by the contract of `FrontEnd::install`. It lies on the engine's stack: it is copied.
    let from = unsafe { imports.cast::<refimport_t>().read_unaligned() };
    let table = Table {
        front_end: Some(&FRONT_END),
        variable: variable_layout!(cvar_t),
        cvar_set_description: from.Cvar_SetDescription,
        ..renderer_made_window!(from)
    };
    // SAFETY: the contract of `FrontEnd::install` is that of `engine::install`.
    unsafe { engine::install(table) }
}

/// Sets a variable's description and tests whether the engine stores it, as engines with ioquake3's tables do. In the
/// other engines of its family, the same entry of the table only searches a variable of that name, and the member is
/// another pointer into the engine's memory.
fn keeps_descriptions(engine: Engine) -> bool {
    let Some(spec) = renderer_vk::settings::row("r_rt").map(|row| &row.spec) else {
        return false;
    };
    let Some(variable) = cvars::get(engine, spec) else {
        return false;
    };
    let text = cvars::c_text(spec.help);
    engine.cvar_describe(variable, &text);
    // SAFETY: the engine's own variable; in the other engines of the family, too, it has a member at this offset.
    let kept = unsafe { (*variable.as_ptr().cast::<cvar_t>()).description };
    // Through the kernel, because in other engines the pointer may be to anything.
    let mut copy = vec![0; text.to_bytes_with_nul().len()];
    system::read_memory(kept.addr(), &mut copy);
    copy == text.to_bytes_with_nul()
}

#[cfg(test)]
mod tests {
    use super::abi;
    use crate::abi::STRUCTURES;
    use crate::c_tests::{compile, scratch, source};
    use std::process::Command;

    #[test]
    fn a_c_compiler_lays_everything_out_the_same() {
        let folder = scratch("layouts");
        let program = folder.join("layouts");
        let Some(()) = compile(
            &source("ioq3/layouts.c"),
            &program,
            &["-std=c99", "-Wall", "-Werror"],
        ) else {
            return;
        };
        let output = Command::new(&program).output().unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        let theirs = String::from_utf8(output.stdout).unwrap();
        let mut ours = String::new();
        for (name, size, fields) in [STRUCTURES, abi::STRUCTURES, abi::TABLES].concat() {
            ours += &format!("{name} - {size} 0\n");
            for field in fields {
                ours += &format!("{name} {} {} {}\n", field.name, field.offset, field.size);
            }
        }
        assert!(theirs.lines().count() > 150);
        for (theirs, ours) in theirs.lines().zip(ours.lines()) {
            assert_eq!(theirs, ours);
        }
        assert_eq!(theirs.lines().count(), ours.lines().count());
    }
}
