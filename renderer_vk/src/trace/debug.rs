//! `rt_debug`: a step of the traced look in place of the picture.

/// Names of the views, by their numbers in `rt_debug` from 1 on.
pub const DEBUG_VIEWS: [&str; 11] = [
    "albedo",
    "normals",
    "depth",
    "motion",
    "clusters",
    "lights per pixel",
    "samples",
    "variance",
    "gradients",
    "rays per pixel",
    "reflections",
];
