//! The renderer's settings: the values of the cvars, as plain data. The front end owns the cvars (names, ranges,
//! flags) and hands over a fresh copy each frame; what is latched there changes only at `begin_registration`.

/// How a traced light sample picks its light from a cluster's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LightSelection {
    /// Each light with the same probability.
    Uniform,
    /// Resampled importance sampling over a few candidates.
    #[default]
    Resampled,
}

/// What is to follow the rays of the traced look. A device that cannot do it gets the one that `Auto` picks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TracerChoice {
    /// The fastest one on the device.
    #[default]
    Auto,
    /// The device's ray tracing pipeline.
    Pipeline,
    /// Ray queries in compute shaders.
    Query,
    /// Hierarchies of our own, walked by compute shaders.
    Compute,
}

/// Which lights of a map are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum MapLightChoice {
    /// Those that the map's directives tell of, fitted to the light that its compiler stored, and those found there.
    #[default]
    Calibrated,
    /// Those that the map's directives tell of, as strong as these say.
    Prior,
}

/// All settings. Names follow the cvars.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)] // each is documented with its cvar in `ffi`
pub struct Settings {
    // the traced look
    pub rt: bool,
    /// Latched: what follows the rays.
    pub rt_tracer: TracerChoice,
    pub rt_lights: MapLightChoice,
    /// Prints a line of statistics each second.
    pub rt_print_perf_stats: bool,
    /// Off: surfaces show their own colour, without light.
    pub rt_illumination: bool,
    /// Off: every light of the map is a candidate at every point.
    pub rt_cull_lights: bool,
    /// Light samples (shadow rays) a pixel and frame; 0: one for every light that may reach the point.
    pub rt_num_random_dl: u32,
    pub rt_light_selection: LightSelection,
    /// Candidates of resampled selection.
    pub rt_candidates: u32,
    /// Freezes what the traced look shows: view, scene and time.
    pub rt_pause: bool,
    /// Accumulate frames while nothing moves (reference mode): neither denoiser nor TAA, towards the exact picture.
    pub rt_accumulate: bool,
    /// Camera rays go through all of a pixel's area instead of its middle.
    pub rt_antialiasing: bool,
    /// Off: each light is sampled at its middle, so that shadows are sharp.
    pub rt_soft_shadows: bool,
    /// Depth of field by a thin lens.
    pub rt_dof: bool,
    /// Diameter of the lens, units.
    pub rt_aperture: f32,
    /// Distance from the eye of the plane in focus, units.
    pub rt_focal_length: f32,
    /// 0 none, 1 A-SVGF, 2 sparse filter.
    pub rt_denoiser: u32,
    /// A-SVGF's temporal gradients. No cvar: off is the baseline that measurements compare with.
    pub rt_gradients: bool,
    /// Temporal anti-aliasing.
    pub rt_taa: bool,
    /// Pixels traced over pixels shown, along each axis, 0.25 to 1.
    pub rt_scale: f32,
    /// Mirrors and glass on a path.
    pub rt_max_depth: u32,
    /// Diffuse bounces, 0 to 2.
    pub rt_bounces: u32,
    /// Strength of bloom: the part of light that is spread; 0 none.
    pub rt_bloom: f32,
    /// A lamp at the eye.
    pub rt_flashlight: bool,
    /// Number of the debug view in place of the picture; 0 none.
    pub rt_debug: u32,
    /// Exposure in stops; added to automatic exposure.
    pub rt_exposure: f32,
    pub rt_auto_exposure: bool,
    /// Multiplies every light that the map has.
    pub rt_light_scale: f32,
    /// Multiplies the game's dynamic lights.
    pub rt_dlight_scale: f32,
    // textures (latched)
    pub picmip: u32,
    pub round_images_down: bool,
    pub simple_mip_maps: bool,
    pub detail_textures: bool,
    pub intensity: f32,
    pub greyscale: f32,
    pub color_mip_levels: bool,
    pub single_shader: bool,
    pub print_shaders: bool,
    /// Lightmaps as colours by brightness (`r_lightmap 2`).
    pub lightmap_heat: bool,
    pub anisotropy: f32,
    pub texture_mode: String,
    pub map_overbright_bits: u32,
    pub overbright_bits: u32,
    pub vertex_light: bool,
    /// A menu covers the game: what is registered meanwhile keeps its stages with `vertex_light`.
    pub ui_fullscreen: bool,
    pub fullbright: bool,
    pub subdivisions: f32,
    // polled
    pub gamma: f32,
    pub ignore_hw_gamma: bool,
    pub fullscreen: bool,
    pub swap_interval: i32,
    pub lod_bias: i32,
    pub lod_scale: f32,
    pub lod_curve_error: f32,
    pub znear: f32,
    pub fast_sky: bool,
    pub draw_sun: bool,
    pub dynamic_light: bool,
    pub flares: bool,
    pub flare_size: f32,
    pub flare_fade: f32,
    pub flare_coefficient: f32,
    pub shadows: i32,
    /// Samples of a pixel of the classic look that are wished for.
    pub multisample: u32,
    /// `r_anaglyphMode`.
    pub anaglyph: u32,
    /// Distance at which the eyes' pictures meet over that of an eye from the middle.
    pub stereo_separation: f32,
    /// Distance at which the eyes' pictures meet, units.
    pub convergence: f32,
    pub draw_world: bool,
    pub draw_entities: bool,
    pub no_vis: bool,
    pub lock_pvs: bool,
    pub no_cull: bool,
    pub no_curves: bool,
    pub no_portals: bool,
    pub portal_only: bool,
    pub no_refresh: bool,
    pub skip_back_end: bool,
    pub face_plane_cull: bool,
    /// Materials of a greater sort value are left out; 0: none are.
    pub debug_sort: i32,
    pub show_cluster: i32,
    pub no_bind: bool,
    pub measure_overdraw: bool,
    pub show_normals: bool,
    pub show_sky: bool,
    /// 1: all images on a grid; 2: in proportion to their sizes.
    pub show_images: i32,
    pub dlight_backs: bool,
    pub debug_light: bool,
    pub clear: bool,
    pub show_tris: bool,
    pub lightmap: bool,
    pub speeds: i32,
    pub ambient_scale: f32,
    pub directed_scale: f32,
    pub rail_width: f32,
    pub rail_core_width: f32,
    pub rail_segment_length: f32,
    pub marks_on_triangle_meshes: bool,
    pub offset_factor: f32,
    pub offset_units: f32,
}

impl Settings {
    /// Overbright bits in force: only a full-screen window with a gamma ramp shows colours doubled.
    pub fn effective_overbright_bits(&self) -> u32 {
        if self.ignore_hw_gamma || !self.fullscreen {
            0
        } else {
            self.overbright_bits.min(2)
        }
    }

    /// The gamma that the finished picture is shown with.
    pub fn display_gamma(&self) -> f32 {
        if self.ignore_hw_gamma {
            1.0
        } else {
            self.gamma.clamp(0.5, 3.0)
        }
    }

    /// The gamma that images get when they are loaded.
    pub fn software_gamma(&self) -> f32 {
        if self.ignore_hw_gamma {
            self.gamma.clamp(0.5, 3.0)
        } else {
            1.0
        }
    }

    /// What the engine calls identity light: the brightness that shows as white.
    pub fn identity_light(&self) -> f32 {
        1.0 / (1 << self.effective_overbright_bits()) as f32
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rt: false,
            rt_tracer: TracerChoice::Auto,
            rt_lights: MapLightChoice::Calibrated,
            rt_print_perf_stats: false,
            rt_illumination: true,
            rt_cull_lights: true,
            rt_num_random_dl: 1,
            rt_light_selection: LightSelection::Resampled,
            rt_candidates: 8,
            rt_pause: false,
            rt_accumulate: false,
            rt_antialiasing: true,
            rt_soft_shadows: true,
            rt_dof: false,
            rt_aperture: 4.0,
            rt_focal_length: 256.0,
            rt_denoiser: 1,
            rt_gradients: true,
            rt_taa: true,
            rt_scale: 1.0,
            rt_max_depth: 4,
            rt_bounces: 1,
            rt_bloom: 0.05,
            rt_flashlight: false,
            rt_debug: 0,
            rt_exposure: 0.0,
            rt_auto_exposure: true,
            rt_light_scale: 1.0,
            rt_dlight_scale: 1.0,
            picmip: 0,
            round_images_down: true,
            simple_mip_maps: true,
            detail_textures: true,
            intensity: 1.0,
            greyscale: 0.0,
            color_mip_levels: false,
            single_shader: false,
            print_shaders: false,
            lightmap_heat: false,
            anisotropy: 0.0,
            texture_mode: "GL_LINEAR_MIPMAP_LINEAR".into(),
            map_overbright_bits: 2,
            overbright_bits: 0,
            vertex_light: false,
            ui_fullscreen: false,
            fullbright: false,
            subdivisions: 4.0,
            gamma: 1.0,
            ignore_hw_gamma: false,
            fullscreen: false,
            swap_interval: 0,
            lod_bias: 0,
            lod_scale: 5.0,
            lod_curve_error: 250.0,
            znear: 4.0,
            fast_sky: false,
            draw_sun: false,
            dynamic_light: true,
            flares: false,
            flare_size: 40.0,
            flare_fade: 7.0,
            flare_coefficient: 150.0,
            shadows: 1,
            multisample: 0,
            anaglyph: 0,
            stereo_separation: 64.0,
            convergence: 64.0,
            draw_world: true,
            draw_entities: true,
            no_vis: false,
            lock_pvs: false,
            no_cull: false,
            no_curves: false,
            no_portals: false,
            portal_only: false,
            no_refresh: false,
            skip_back_end: false,
            face_plane_cull: true,
            debug_sort: 0,
            show_cluster: 0,
            no_bind: false,
            measure_overdraw: false,
            show_normals: false,
            show_sky: false,
            show_images: 0,
            dlight_backs: true,
            debug_light: false,
            clear: false,
            show_tris: false,
            lightmap: false,
            speeds: 0,
            ambient_scale: 0.6,
            directed_scale: 1.0,
            rail_width: 16.0,
            rail_core_width: 6.0,
            rail_segment_length: 32.0,
            marks_on_triangle_meshes: false,
            offset_factor: -1.0,
            offset_units: -2.0,
        }
    }
}
