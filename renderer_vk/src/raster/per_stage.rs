//! Small values of the stages of a draw, in one word.

/// A value below 16 for each stage of a draw, four bits each; the first stage has the lowest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PerStage(u32);

impl PerStage {
    /// Number of bits of a stage.
    const BITS: usize = 4;

    /// 0 for all stages.
    pub const NONE: Self = Self(0);

    /// `value` for the first stage, 0 for the others.
    pub const fn first(value: u32) -> Self {
        Self(value)
    }

    /// Value of a stage.
    pub fn at(self, stage: usize) -> u32 {
        self.0 >> (Self::BITS * stage) & 0xF
    }

    /// Sets the value of a stage.
    pub fn set(&mut self, stage: usize, value: u32) {
        let shift = Self::BITS * stage;
        self.0 = self.0 & !(0xF << shift) | value << shift;
    }

    /// The values as the shaders read them.
    pub const fn bits(self) -> u32 {
        self.0
    }
}
