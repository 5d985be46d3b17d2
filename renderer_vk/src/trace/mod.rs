//! The traced look: acceleration structures, and the passes from camera rays to the picture.
//!
//! [`view_tracer`] lists the passes of a frame in their order, [`passes`] declares each. Before them, [`accel`] builds
//! structures of moving geometry and the top level, and [`motion`] finds positions of the last frame. Only ray
//! generation shaders launch rays; hit shaders report hits and evaluate alpha tests.
//!
//! Radiometry: light is stored as `L`, the radiance that a white diffuse surface reflects (irradiance divided by pi),
//! in units where 1 is display white. Estimators divide by their probabilities, so that all have the same mean.
#![forbid(unsafe_code)]

pub mod accel;
pub mod ahead;
pub mod antialias;
pub mod bake;
mod bake_lights;
pub mod bake_passes;
pub mod beyond_sky;
pub mod bloom;
mod blue_noise;
mod bodies;
pub mod bvh;
mod cell_grid;
mod cell_light;
pub mod counters;
mod cut_out_boxes;
pub mod cutout;
pub mod denoise;
mod doubled;
mod feedback;
mod first_hits;
pub mod fog;
mod fog_light;
mod frame_lights;
pub mod frame_passes;
pub mod geometry;
mod grid;
pub mod hybrid;
mod indirect;
pub mod input;
pub mod layer_boxes;
mod lifted;
pub mod light_cells;
pub mod light_lists;
pub mod light_normal_bins;
pub mod light_rows;
pub mod light_selection;
pub mod light_tables;
mod light_tree;
mod light_trees;
pub mod light_weights;
pub mod lights;
pub mod look;
mod mirrors;
pub mod motion;
mod nearby;
mod part_mesh;
mod parts;
pub mod pass_set;
pub mod passes;
mod photons;
mod pixel_times;
mod reservoirs;
mod resource;
mod screen;
mod shapes;
mod solids;
mod specular;
pub mod still;
pub mod surroundings;
pub mod targets;
pub mod tracer;
pub mod vertex_light;
mod view_tracer;

pub use look::{MapView, TraceLook};

#[cfg(test)]
mod tests;
