//! The GPU stages that a pass uses, for its barrier.

use std::ops::BitOr;

use ash::vk;

use super::select::Abilities;

/// Kinds of work in a pass, joined with `|`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Access(u32);

impl Access {
    /// No work.
    pub const NONE: Self = Self(0);
    /// Compute shaders, and the parameters of indirect dispatches.
    pub const COMPUTE: Self = Self(1);
    /// Shaders of ray tracing pipelines.
    pub const RAY_TRACING: Self = Self(2);
    /// All drawing: vertex and fragment shaders, attachments, indices, indirect parameters.
    pub const GRAPHICS: Self = Self(4);
    /// Building acceleration structures and reading build inputs.
    pub const ACCEL_BUILD: Self = Self(8);
    /// Copies, fills, clears, blits.
    pub const TRANSFER: Self = Self(16);
    /// Reads by the CPU after the frame.
    pub const HOST: Self = Self(32);

    /// Whether the CPU may read the results: copies may write to mapped memory.
    pub(crate) fn reaches_host(self) -> bool {
        self.0 & (Self::HOST.0 | Self::TRANSFER.0) != 0
    }

    /// The pipeline stages, without those of disabled extensions.
    pub(crate) fn stages(self, abilities: Abilities) -> vk::PipelineStageFlags {
        use vk::PipelineStageFlags as S;
        let has = |kind: Self| self.0 & kind.0 != 0;
        let mut stages = S::empty();
        if has(Self::COMPUTE) {
            stages |= S::COMPUTE_SHADER | S::DRAW_INDIRECT;
        }
        if has(Self::RAY_TRACING) && abilities.pipeline {
            stages |= S::RAY_TRACING_SHADER_KHR;
        }
        if has(Self::GRAPHICS) {
            stages |= S::ALL_GRAPHICS;
        }
        if has(Self::ACCEL_BUILD) && abilities.acceleration {
            stages |= S::ACCELERATION_STRUCTURE_BUILD_KHR;
        }
        if has(Self::TRANSFER) {
            stages |= S::TRANSFER;
        }
        if has(Self::HOST) {
            stages |= S::HOST;
        }
        stages
    }
}

impl BitOr for Access {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// The barrier rule: one global memory barrier at the beginning of each pass.
///
/// The validation layer does not detect hazards between dispatches, so that the rule is simple enough to verify by
/// reading: a pass waits for all work recorded or submitted before it, and all earlier writes are visible to the stages
/// that it declares. Layouts need no transitions, because each image keeps one layout. `reads` and `writes` have the
/// same effect; a pass that declares neither has no barrier.
pub(crate) fn pass_barrier(
    abilities: Abilities,
    reads: Access,
    writes: Access,
) -> Option<(vk::PipelineStageFlags, vk::MemoryBarrier<'static>)> {
    let stages = (reads | writes).stages(abilities);
    (!stages.is_empty()).then(|| {
        let barrier = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE);
        (stages, barrier)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use vk::PipelineStageFlags as S;

    #[test]
    fn a_pass_waits_with_the_stages_of_its_reads_and_writes() {
        let rt = Abilities {
            acceleration: true,
            pipeline: true,
            ..Abilities::default()
        };
        let stages = |a, r, w| pass_barrier(a, r, w).map(|b| b.0);
        assert_eq!(
            stages(
                rt,
                Access::ACCEL_BUILD | Access::TRANSFER,
                Access::RAY_TRACING
            ),
            Some(S::ACCELERATION_STRUCTURE_BUILD_KHR | S::TRANSFER | S::RAY_TRACING_SHADER_KHR)
        );
        // Stages of a disabled extension must not appear.
        assert_eq!(
            stages(Abilities::default(), Access::RAY_TRACING, Access::GRAPHICS),
            Some(S::ALL_GRAPHICS)
        );
        assert_eq!(stages(rt, Access::NONE, Access::NONE), None);
    }
}
