//! The renderer's GLSL as SPIR-V, and the structures that it shares with Rust.
//!
//! The sources lie beside this crate's manifest, one folder for each group of passes. The build script compiles them
//! for Vulkan 1.2 and writes a static for each module, named after folder and file: `raster/draw.vert` is
//! [`RASTER_DRAW_VERT`](crate). `build.rs` describes variants.
//!
//! Shared items are written once. Structures and constants are in [`types`] and [`trace_types`], and the build script
//! writes their GLSL. Specialization constants are in GLSL, and the build script writes their ids as [`constant_ids`].

#![forbid(unsafe_code)]

pub mod trace_types;
pub mod types;

/// Bytes aligned to 4, as SPIR-V words require.
#[repr(C, align(4))]
struct Aligned<T: ?Sized>(T);

/// The pipeline stage of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Vertex shader (`.vert`).
    Vertex,
    /// Fragment shader (`.frag`).
    Fragment,
    /// Compute shader (`.comp`).
    Compute,
    /// Ray generation (`.rgen`).
    RayGeneration,
    /// Closest hit (`.rchit`).
    ClosestHit,
    /// Any hit (`.rahit`).
    AnyHit,
    /// Miss (`.rmiss`).
    Miss,
}

/// One compiled module; its entry point is `main`.
pub struct Spirv {
    name: &'static str,
    stage: Stage,
    local_size: [u32; 3],
    bytes: &'static Aligned<[u8]>,
}

impl Spirv {
    /// The source file below the shader folder and the definitions of the variant, for labels and messages.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The pipeline stage of the module.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Work group size of a compute shader along each axis; 1 for other stages.
    pub fn local_size(&self) -> [u32; 3] {
        self.local_size
    }

    /// The words of the module, SPIR-V 1.5.
    pub fn words(&self) -> &'static [u32] {
        // The wrapper aligns the bytes, and SPIR-V consists of whole words, so this cast cannot fail.
        bytemuck::try_cast_slice(&self.bytes.0).unwrap_or_default()
    }
}

impl std::fmt::Debug for Spirv {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Spirv({}, {:?})", self.name, self.stage)
    }
}

/// The modules of a ray generation shader: one for each tracer (`trace/tracer.glsl`).
#[derive(Debug)]
pub struct RayShader {
    /// For a ray tracing pipeline.
    pub pipeline: &'static Spirv,
    /// A compute shader that traverses own hierarchies.
    pub compute: &'static Spirv,
    /// The same with a uniform grid for the map's large part.
    pub grid: &'static Spirv,
    /// A compute shader with ray queries.
    pub query: &'static Spirv,
}

include!(concat!(env!("OUT_DIR"), "/modules.rs"));

/// Ids of specialization constants, by folder and file name of their declaration.
pub mod constant_ids {
    include!(concat!(env!("OUT_DIR"), "/constant_ids.rs"));
}

#[cfg(test)]
mod layout_test;

#[cfg(test)]
#[path = "../build/shared.rs"]
mod shared;

#[cfg(test)]
mod shared_test;
