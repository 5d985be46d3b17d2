//! Settings with a few values, each with its number or name.

use shaders::trace_types::constants as t;

use super::row::Kind;
use super::value::{Given, Value, named, numbered};

numbered! {
    /// A look of a view.
    Look {
        /// As the engine's own renderer draws it.
        Classic = 0,
        /// Ray traced.
        Traced = 1,
        /// The classic look with traced shadows of models and of dynamic lights, and traced reflections.
        Hybrid = 2,
    }
}

impl Look {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Classic => "classic",
            Self::Traced => "traced",
            Self::Hybrid => "hybrid",
        }
    }
}

numbered! {
    /// How a traced light sample selects its light.
    LightSelection {
        /// Resampled importance sampling among a few candidates.
        Resampled = 1,
        /// Each light with the same probability.
        Uniform = 0,
        /// As `Resampled`, with candidates from a tree over all lights.
        Tree = 2,
        /// As `Resampled`, with the samples of neighbouring pixels and of the last frame.
        Reused = 3,
    }
}

numbered! {
    /// Feedback of rays on the structures of bodies.
    HitFeedback {
        /// None.
        None = 0,
        /// Bodies that few rays meet are refitted seldom or left out.
        Acts = 1,
        /// Rays are counted, for statistics.
        Counts = 2,
    }
}

numbered! {
    /// Filter of traced light.
    DenoiserChoice {
        /// No filter.
        None = 0,
        /// Adaptive spatiotemporal variance-guided filter.
        ASvgf = 1,
        /// The cheaper sparse filter.
        Sparse = 2,
    }
}

numbered! {
    /// Output for displays that show more than white.
    HdrChoice {
        /// None: 8 bits a channel.
        Off = 0,
        /// What the display offers, HDR10 first.
        Any = 1,
        /// Rec. 2020 primaries and SMPTE ST 2084, 10 bits a channel.
        Hdr10 = 2,
        /// Linear Rec. 709 in half floats; 1 is 80 cd/m².
        ScRgb = 3,
    }
}

numbered! {
    /// How many frames wait for the GPU and the display.
    LowLatency {
        /// Two.
        Off = 0,
        /// One.
        One = 1,
        /// One, and the engine is delayed until the GPU is about to need its next frame.
        JustInTime = 2,
    }
}

numbered! {
    /// Output of the traced look.
    DebugOutput {
        /// The picture.
        None = 0,
        /// Albedo of the surface times the transmission in front of it.
        Albedo = t::DEBUG_ALBEDO,
        /// Normals.
        Normals = t::DEBUG_NORMALS,
        /// View distance.
        Depth = t::DEBUG_DEPTH,
        /// Motion since the last frame.
        Motion = t::DEBUG_MOTION,
        /// Clusters of the map's visibility.
        Clusters = t::DEBUG_CLUSTERS,
        /// Lights that may reach the point.
        Lights = t::DEBUG_LIGHTS,
        /// Mean number of light samples.
        Samples = t::DEBUG_SAMPLES,
        /// Relative deviation of a frame's light.
        Variance = t::DEBUG_VARIANCE,
        /// Changed part of the light.
        Gradients = t::DEBUG_GRADIENTS,
        /// Rays of all passes.
        Rays = t::DEBUG_RAYS,
        /// Reflections and refractions: mirrors, portals, glass, liquids and glossy surfaces.
        Specular = t::DEBUG_SPECULAR,
        /// Time of each pixel's invocations, without the filters.
        Time = t::DEBUG_TIME,
        /// The part of it that rays take.
        RayTime = t::DEBUG_RAY_TIME,
    }
}

numbered! {
    /// Channels of the left and of the right eye in anaglyph stereo.
    Anaglyph {
        /// No stereo.
        None = 0,
        /// Red, cyan.
        RedCyan = 1,
        /// Red, blue.
        RedBlue = 2,
        /// Red, green.
        RedGreen = 3,
        /// Green, magenta.
        GreenMagenta = 4,
        /// Cyan, red.
        CyanRed = 5,
        /// Blue, red.
        BlueRed = 6,
        /// Green, red.
        GreenRed = 7,
        /// Magenta, green.
        MagentaGreen = 8,
    }
}

numbered! {
    /// Shadows of models in the classic look.
    ModelShadows {
        /// No shadows.
        None = 0,
        /// A dark spot, drawn by the game.
        Spot = 1,
        /// Stencil shadow volumes.
        Volumes = 2,
        /// Flattened onto the plane below the model.
        Planar = 3,
    }
}

named! {
    /// Preferred tracer. On a device that does not support it, `Auto` selects another one.
    TracerChoice, other: None, {
        /// The fastest one on the device.
        #[default]
        Auto = "auto",
        /// The device's ray tracing pipeline.
        Pipeline = "pipeline",
        /// Ray queries in compute shaders.
        Query = "query",
        /// Own hierarchies in compute shaders.
        Compute = "compute",
        /// The same with a uniform grid for the map.
        Grid = "grid",
    }
}

named! {
    /// Which lights of a map are traced.
    MapLightChoice, other: Some(Self::Calibrated), {
        /// Lights of the map's directives and lights found by calibration, fitted to the map's stored light.
        #[default]
        Calibrated = "calibrated",
        /// Lights of the map's directives, at their stated strength.
        Prior = "prior",
    }
}

named! {
    /// Filter of textures.
    TextureMode, other: None, {
        /// Nearest texel, no mip levels.
        Nearest = "GL_NEAREST",
        /// Bilinear, no mip levels.
        Linear = "GL_LINEAR",
        /// Nearest texel of the nearest mip level.
        NearestMipNearest = "GL_NEAREST_MIPMAP_NEAREST",
        /// Bilinear in the nearest mip level.
        LinearMipNearest = "GL_LINEAR_MIPMAP_NEAREST",
        /// Nearest texels of two mip levels.
        NearestMipLinear = "GL_NEAREST_MIPMAP_LINEAR",
        /// Trilinear.
        #[default]
        LinearMipLinear = "GL_LINEAR_MIPMAP_LINEAR",
    }
}
