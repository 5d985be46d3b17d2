//! Errors of the renderer.

use crate::gpu;

/// An error of the renderer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An error of Vulkan, its loader, or the device.
    #[error(transparent)]
    Gpu(#[from] gpu::Error),
    /// A map that cannot be loaded.
    #[error(transparent)]
    World(#[from] crate::world::WorldError),
    /// A second map without a new registration.
    #[error("{name}: a map is loaded already")]
    WorldTwice {
        /// The requested map.
        name: String,
    },
    /// A view of the world without a map.
    #[error("a view of the world is drawn, but no map is loaded")]
    NoWorld,
    /// A call that needs a registration, before the first one.
    #[error("nothing is registered yet")]
    NotRegistered,
    /// A raw picture whose sides are no powers of two.
    #[error("a raw picture has {cols}x{rows} pixels; both must be powers of two")]
    NotPowerOfTwo {
        /// Width.
        cols: u32,
        /// Height.
        rows: u32,
    },
    /// A raw picture with too little data.
    #[error("a raw picture of {cols}x{rows} pixels comes with {length} bytes")]
    ShortPicture {
        /// Width.
        cols: u32,
        /// Height.
        rows: u32,
        /// Bytes in the data.
        length: usize,
    },
    /// An entity of a kind that is never drawn.
    #[error("an entity has a kind that cannot be drawn: {kind}")]
    EntityKind {
        /// The kind.
        kind: String,
    },
}
