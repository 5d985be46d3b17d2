//! A structure of the engine's ABI declared together with the offsets that its fields must have.

/// One field as the engine lays it out, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The engine's name of it.
    pub name: &'static str,
    /// From the start of the structure.
    pub offset: usize,
    /// Of the field.
    pub size: usize,
}

/// Declares `#[repr(C)]` structures from rows of `offset size name: type`. The numbers are the engine's, written down
/// independently of the Rust types; a row that disagrees with what the compiler does is a build error. Each
/// structure gets `LAYOUT`, the same rows as data, for the test that asks a C compiler.
macro_rules! abi_struct {
    ($( $(#[$meta:meta])* pub struct $name:ident = $size:literal { $( $offset:literal $fsize:literal $field:ident : $type:ty ),* $(,)? } )*) => { $(
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy)]
        #[allow(non_camel_case_types, non_snake_case, missing_docs)] // the engine's names, so that they can be looked up
        pub struct $name { $( pub $field: $type ),* }

        // Only `GetRefAPI` on a machine with 8-byte pointers is described by the tables.
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
