//! The traced look compared with closed forms, on any Vulkan device (Mesa's lavapipe in continuous integration).
//! Without one the tests are skipped; with `RELIGHT_REQUIRE_GPU=1` they fail.

mod ambient;
mod antialias_variants;
mod antialiasing;
mod blooming;
mod bounces;
mod caustics;
mod coplanar;
mod cut_outs;
mod denoising;
mod dielectrics;
mod eyes;
mod feedback;
mod fewer_rays;
mod fog;
mod gradients;
mod grids;
mod harness;
mod inspection;
mod layers;
mod lighting;
mod lights;
mod maps;
mod memory;
mod mirrors;
mod models;
mod motion;
mod parts;
mod reservoirs;
mod rough;
mod screen_hits;
mod sides;
mod skies;
mod structures;
mod texture_filter;
mod views;
