//! Declares a structure of the engine's ABI together with the offsets of its fields.

/// A field in the engine's layout, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The engine's name.
    pub name: &'static str,
    /// Offset from the start of the structure.
    pub offset: usize,
    /// Size of the field.
    pub size: usize,
}

/// Declares `#[repr(C)]` structures from rows of `offset size name: type`. The numbers are the engine's, independent of
/// the Rust types; a row that differs from the compiler's layout is a build error. Each structure has `LAYOUT`, the
/// same rows as data, for the test with a C compiler.
macro_rules! abi_struct {
    ($( $(#[$meta:meta])* pub struct $name:ident = $size:literal { $( $offset:literal $fsize:literal $field:ident : $type:ty ),* $(,)? } )*) => { $(
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy)]
        #[allow(non_camel_case_types, non_snake_case, missing_docs)] // the engine's names
        pub struct $name { $( pub $field: $type ),* }

        // The tables describe only machines with 8-byte pointers.
        #[cfg(target_pointer_width = "64")]
        const _: () = {
            assert!(size_of::<$name>() == $size, concat!("size of ", stringify!($name)));
            $(
                assert!(std::mem::offset_of!($name, $field) == $offset, concat!(stringify!($name), ".", stringify!($field)));
                assert!(size_of::<$type>() == $fsize, concat!("size of ", stringify!($name), ".", stringify!($field)));
            )*
        };

        impl $name {
            /// The engine's offsets and sizes, in declaration order.
            #[cfg_attr(not(test), allow(dead_code))]
            pub const LAYOUT: &'static [$crate::ioq3::layout::Field] = &[ $( $crate::ioq3::layout::Field { name: stringify!($field), offset: $offset, size: $fsize } ),* ];
        }
    )*
        /// Name, size and fields of every structure declared here.
        #[cfg(test)]
        pub const STRUCTURES: &[(&str, usize, &[$crate::ioq3::layout::Field])] = &[ $( (stringify!($name), $size, $name::LAYOUT) ),* ];
    };
}
pub(crate) use abi_struct;

#[cfg(test)]
mod tests {
    use super::super::abi::STRUCTURES;
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
        for (name, size, fields) in STRUCTURES {
            ours += &format!("{name} - {size} 0\n");
            for field in *fields {
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
