//! Quake III `.shader` scripts: text to typed materials, and their evaluation.
//!
//! * [`parse_script`] reads one file and never fails as a whole: every fault is a [`Diagnostic`] with file, line
//!   and column, and reading goes on at the next definition.
//! * [`Library`] joins the files of a game by the engine's rules of precedence and finds a [`Shader`] by name.
//! * [`eval`] is the run-time half: waves, noise, colour and texture coordinate generators, vertex deformations.
//!
//! No files are opened here: whether an image exists is for the caller to find out.
//!
//! Source: behaviour of ioquake3's first OpenGL renderer (1.36, November 2022), the one Debian ships.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

pub mod eval;
pub mod surface_params;
pub mod token;

mod collapse;
mod diagnostic;
mod implicit;
mod library;
mod parse;
mod reflection;
mod shader;
mod stage;

pub use glam;

pub use collapse::{Combine, Pass, collapse, collapse_vertex_light};
pub use diagnostic::{Diagnostic, Severity};
pub use implicit::ImplicitKind;
pub use library::{Library, Precedence, strip_extension};
pub use parse::{Script, Variables, parse_script};
pub use reflection::{GlossType, NormalStage, Reflection, SpecularStage};
pub use shader::{
    Cull, Deform, Fog, LightDirectives, Location, Shader, Sky, Sun, UnknownDirective, sort,
};
pub use stage::{
    AlphaFunc, AlphaGen, BlendFactor, DepthFunc, RgbGen, Stage, StageImage, TcGen, TcMod, Wave,
    WaveFunction,
};

/// The example of the README, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
