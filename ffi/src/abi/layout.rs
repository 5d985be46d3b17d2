//! Declares a structure or a table of functions of an engine's ABI together with the offsets of its fields.

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
/// same rows as data; the constant named first lists the structures, for the test with a C compiler.
macro_rules! abi_struct {
    (const $list:ident; $( $(#[$meta:meta])* pub struct $name:ident = $size:literal { $( $offset:literal $fsize:literal $field:ident : $type:ty ),* $(,)? } )*) => { $(
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
            pub const LAYOUT: &'static [$crate::abi::layout::Field] = &[ $( $crate::abi::layout::Field { name: stringify!($field), offset: $offset, size: $fsize } ),* ];
        }
    )*
        /// Name, size and fields of every structure declared here.
        #[cfg(test)]
        pub const $list: &[(&str, usize, &[$crate::abi::layout::Field])] = &[ $( (stringify!($name), $size, $name::LAYOUT) ),* ];
    };
}
pub(crate) use abi_struct;

/// Declares tables of functions from rows of `offset name`; a function's type has its name. Entries of an `optional`
/// table may be null.
macro_rules! function_table {
    (@ optional $type:ident) => { Option<$type> };
    (@ required $type:ident) => { $type };
    (const $list:ident; $( $(#[$meta:meta])* $kind:ident $name:ident = $size:literal { $( $offset:literal $field:ident ),* $(,)? } )*) => {
        $crate::abi::layout::abi_struct! {
            const $list;
            $( $(#[$meta])* pub struct $name = $size {
                $( $offset 8 $field: $crate::abi::layout::function_table!(@ $kind $field) ),*
            } )*
        }
    };
}
pub(crate) use function_table;
