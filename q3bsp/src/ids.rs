//! Indices of records as types, and the records that they name.
//!
//! A file may hold any number where an index is expected. [`Bsp::validate`], and so [`Bsp::parse`], refuses a map with an
//! index outside its lump; the accessors here therefore return a record and not an option. For a map that was changed by
//! hand and not validated, an index outside its lump fails an assertion in debug builds; in release builds it names a
//! record whose fields are all zero.

use crate::Bsp;
use crate::bytes::{Fields, Put};
use crate::lumps::{Brush, Leaf, Node, Plane, Record, ShaderRef};
use crate::surface::Surface;
use std::sync::LazyLock;

macro_rules! ids {
    ($($id:ident: $accessor:ident in $list:ident, $record:ident;)+) => { $(
        #[doc = concat!("Index of one of [`Bsp::", stringify!($list), "`]; see [`Bsp::", stringify!($accessor), "`].")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub struct $id(pub(crate) i32);

        impl $id {
            /// From the stored number, which [`Bsp::validate`] checks.
            pub const fn from_raw(raw: i32) -> $id {
                $id(raw)
            }

            /// The stored number.
            pub const fn raw(self) -> i32 {
                self.0
            }

            /// The number as an index of a list that is as long as the lump.
            pub const fn index(self) -> usize {
                // Negative numbers become indices that no list has.
                self.0 as usize
            }
        }

        impl Record for $id {
            const STRIDE: usize = 4;
            fn decode(mut f: Fields<'_>) -> Self {
                $id(f.i32())
            }
            fn encode(&self, out: &mut Vec<u8>) {
                out.put_i32(self.0);
            }
        }

        impl Bsp {
            #[doc = concat!("The record of [`Bsp::", stringify!($list), "`] under an index of this map.")]
            pub fn $accessor(&self, id: $id) -> &$record {
                static ZEROS: LazyLock<$record> =
                    LazyLock::new(|| $record::decode(Fields::new(&[])));
                self.$list.get(id.index()).unwrap_or_else(|| {
                    debug_assert!(false, "{id:?} of {}", self.$list.len());
                    &ZEROS
                })
            }
        }
    )+ };
}

ids! {
    ShaderId: shader in shaders, ShaderRef;
    PlaneId: plane in planes, Plane;
    NodeId: node in nodes, Node;
    LeafId: leaf in leafs, Leaf;
    SurfaceId: surface in surfaces, Surface;
    BrushId: brush in brushes, Brush;
}

impl NodeId {
    /// The root of the tree.
    pub const ROOT: NodeId = NodeId(0);
}

/// What lies on one side of a node's plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "i32", into = "i32")
)]
pub enum Child {
    /// A further node; stored as its index.
    Node(NodeId),
    /// A leaf; stored as `-1 - index`.
    Leaf(LeafId),
}

impl Child {
    /// From the stored number.
    pub const fn from_raw(raw: i32) -> Child {
        match raw {
            0.. => Child::Node(NodeId(raw)),
            // `!raw` is `-1 - raw`.
            _ => Child::Leaf(LeafId(!raw)),
        }
    }

    /// The stored number.
    pub const fn raw(self) -> i32 {
        match self {
            Child::Node(node) => node.0,
            Child::Leaf(leaf) => !leaf.0,
        }
    }
}

#[cfg(feature = "serde")]
impl From<i32> for Child {
    fn from(raw: i32) -> Child {
        Child::from_raw(raw)
    }
}

#[cfg(feature = "serde")]
impl From<Child> for i32 {
    fn from(child: Child) -> i32 {
        child.raw()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::MapBuilder;

    #[test]
    fn children_keep_the_stored_number() {
        for raw in [i32::MIN, -2, -1, 0, 1, i32::MAX] {
            assert_eq!(Child::from_raw(raw).raw(), raw);
        }
        assert_eq!(Child::from_raw(5), Child::Node(NodeId(5)));
        assert_eq!(Child::from_raw(-3), Child::Leaf(LeafId(2)));
    }

    #[test]
    #[cfg_attr(debug_assertions, should_panic(expected = "ShaderId(-1) of 1"))]
    fn an_index_that_was_not_validated_names_a_record_of_zeros() {
        let bsp = MapBuilder::new().build();
        assert_eq!(bsp.shader(ShaderId(0)).name, "noshader");
        assert_eq!(bsp.shader(ShaderId(-1)).name, "");
    }
}
