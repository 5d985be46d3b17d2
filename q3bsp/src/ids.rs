//! Indices of records as types.
//!
//! A file may hold any number where an index is expected. [`Bsp::validate`](crate::Bsp::validate), and so
//! [`Bsp::parse`](crate::Bsp::parse), refuses a map with an index outside its lump.

use crate::bytes::{Fields, Put, Record};

macro_rules! ids {
    ($($id:ident: $accessor:ident in $list:ident;)+) => { $(
        #[doc = concat!("Index of one of [`Bsp::", stringify!($list), "`](crate::Bsp::", stringify!($list), "); see [`Bsp::", stringify!($accessor), "`](crate::Bsp::", stringify!($accessor), ").")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub struct $id(pub(crate) i32);

        impl $id {
            /// From the stored number, which [`Bsp::validate`](crate::Bsp::validate) checks.
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
    )+ };
}

ids! {
    ShaderId: shader in shaders;
    PlaneId: plane in planes;
    NodeId: node in nodes;
    LeafId: leaf in leafs;
    SurfaceId: surface in surfaces;
    BrushId: brush in brushes;
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

    #[test]
    fn children_keep_the_stored_number() {
        for raw in [i32::MIN, -2, -1, 0, 1, i32::MAX] {
            assert_eq!(Child::from_raw(raw).raw(), raw);
        }
        assert_eq!(Child::from_raw(5), Child::Node(NodeId(5)));
        assert_eq!(Child::from_raw(-3), Child::Leaf(LeafId(2)));
    }
}
