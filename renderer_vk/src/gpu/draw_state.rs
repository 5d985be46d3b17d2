//! The fixed steps of drawing as plain types: blending, depth, stencil, channels, culling, topology.

use ash::vk;

/// Factor of a blend, of the colour and of the alpha channel alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)] // the names say it
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

/// When a fragment passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum DepthTest {
    /// Always.
    Always,
    /// At the stored depth or nearer.
    #[default]
    LessEqual,
    /// At exactly the stored depth.
    Equal,
}

impl DepthTest {
    pub(super) fn vk(self) -> vk::CompareOp {
        match self {
            Self::Always => vk::CompareOp::ALWAYS,
            Self::LessEqual => vk::CompareOp::LESS_OR_EQUAL,
            Self::Equal => vk::CompareOp::EQUAL,
        }
    }
}

/// What a draw does with the stencil, where it passes all tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stencil {
    /// Passes everywhere; where depth passes too, adds one, up to 255.
    Increment,
    /// Passes everywhere; where depth passes too, takes one, down to 0.
    Decrement,
    /// Passes where the stencil is not 0, and leaves it.
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

/// Which channels of the colour attachment a draw writes.
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

/// Which triangles are left out. The front is where the corners go counter-clockwise as they lie on the screen.
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

/// What the vertices make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Topology {
    /// Three for a triangle.
    #[default]
    Triangles,
    /// Each with the two before it.
    TriangleStrip,
    /// Two for a line.
    Lines,
    /// One for a point.
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
