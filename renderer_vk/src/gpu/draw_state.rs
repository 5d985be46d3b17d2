//! Fixed-function state of draws as plain types: blending, depth, stencil, channels, culling, topology.

use ash::vk;

/// Blend factor, for colour and alpha alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)] // names are Vulkan's
pub enum BlendFactor {
    Zero,
    One,
    SrcColor,
    OneMinusSrcColor,
    DstColor,
    OneMinusDstColor,
    SrcAlpha,
    OneMinusSrcAlpha,
    DstAlpha,
    OneMinusDstAlpha,
    SrcAlphaSaturate,
}

impl BlendFactor {
    pub(super) fn vk(self) -> vk::BlendFactor {
        use vk::BlendFactor as F;
        match self {
            Self::Zero => F::ZERO,
            Self::One => F::ONE,
            Self::SrcColor => F::SRC_COLOR,
            Self::OneMinusSrcColor => F::ONE_MINUS_SRC_COLOR,
            Self::DstColor => F::DST_COLOR,
            Self::OneMinusDstColor => F::ONE_MINUS_DST_COLOR,
            Self::SrcAlpha => F::SRC_ALPHA,
            Self::OneMinusSrcAlpha => F::ONE_MINUS_SRC_ALPHA,
            Self::DstAlpha => F::DST_ALPHA,
            Self::OneMinusDstAlpha => F::ONE_MINUS_DST_ALPHA,
            Self::SrcAlphaSaturate => F::SRC_ALPHA_SATURATE,
        }
    }
}

/// Depth comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum DepthTest {
    /// Always.
    Always,
    /// At most the stored depth.
    #[default]
    LessEqual,
    /// Exactly the stored depth.
    Equal,
    /// At least the stored depth.
    GreaterEqual,
}

impl DepthTest {
    pub(super) fn vk(self) -> vk::CompareOp {
        match self {
            Self::Always => vk::CompareOp::ALWAYS,
            Self::LessEqual => vk::CompareOp::LESS_OR_EQUAL,
            Self::Equal => vk::CompareOp::EQUAL,
            Self::GreaterEqual => vk::CompareOp::GREATER_OR_EQUAL,
        }
    }
}

/// Stencil operation for fragments that pass all tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stencil {
    /// Always passes; increments if depth passes, up to 255.
    Increment,
    /// Always passes; decrements if depth passes, down to 0.
    Decrement,
    /// Passes if the stencil is not 0; keeps it.
    NotZero,
}

impl Stencil {
    pub(super) fn vk(self) -> vk::StencilOpState {
        let (compare, pass) = match self {
            Self::Increment => (vk::CompareOp::ALWAYS, vk::StencilOp::INCREMENT_AND_CLAMP),
            Self::Decrement => (vk::CompareOp::ALWAYS, vk::StencilOp::DECREMENT_AND_CLAMP),
            Self::NotZero => (vk::CompareOp::NOT_EQUAL, vk::StencilOp::KEEP),
        };
        vk::StencilOpState {
            fail_op: vk::StencilOp::KEEP,
            pass_op: pass,
            depth_fail_op: vk::StencilOp::KEEP,
            compare_op: compare,
            compare_mask: 0xFF,
            write_mask: 0xFF,
            reference: 0,
        }
    }
}

/// Written channels of the colour attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ColorMask {
    /// Red.
    pub red: bool,
    /// Green.
    pub green: bool,
    /// Blue.
    pub blue: bool,
    /// Alpha.
    pub alpha: bool,
}

impl ColorMask {
    /// Every channel.
    pub const ALL: Self = Self {
        red: true,
        green: true,
        blue: true,
        alpha: true,
    };
    /// No channel.
    pub const NONE: Self = Self {
        red: false,
        green: false,
        blue: false,
        alpha: false,
    };

    pub(super) fn vk(self) -> vk::ColorComponentFlags {
        use vk::ColorComponentFlags as C;
        [
            (self.red, C::R),
            (self.green, C::G),
            (self.blue, C::B),
            (self.alpha, C::A),
        ]
        .into_iter()
        .filter(|(on, _)| *on)
        .fold(C::empty(), |all, (_, channel)| all | channel)
    }
}

/// Culled faces. Front faces are counter-clockwise on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Cull {
    /// None.
    #[default]
    None,
    /// Front faces.
    Front,
    /// Back faces.
    Back,
}

impl Cull {
    pub(super) fn vk(self) -> vk::CullModeFlags {
        match self {
            Self::None => vk::CullModeFlags::NONE,
            Self::Front => vk::CullModeFlags::FRONT,
            Self::Back => vk::CullModeFlags::BACK,
        }
    }
}

/// Primitive topology.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Topology {
    /// A triangle for each three vertices.
    #[default]
    Triangles,
    /// A triangle for each vertex with the two before it.
    TriangleStrip,
    /// A line for each two vertices.
    Lines,
    /// A point for each vertex.
    Points,
}

impl Topology {
    pub(crate) fn vk(self) -> vk::PrimitiveTopology {
        match self {
            Self::Triangles => vk::PrimitiveTopology::TRIANGLE_LIST,
            Self::TriangleStrip => vk::PrimitiveTopology::TRIANGLE_STRIP,
            Self::Lines => vk::PrimitiveTopology::LINE_LIST,
            Self::Points => vk::PrimitiveTopology::POINT_LIST,
        }
    }
}
