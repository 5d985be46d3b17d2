//! Choice of the tracer by the setting `rt_tracer` and the device.

use crate::gpu::DeviceInfo;
use crate::settings::TracerChoice;

/// Method of tracing rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tracer {
    /// The device's ray tracing pipeline.
    Pipeline,
    /// The device's ray queries, in compute shaders.
    Query,
    /// Our own hierarchies in compute shaders: on any device, and faster on devices that trace in software.
    Compute,
    /// The same with a uniform grid for what stops rays in the map, as on the GPUs of 2005; for comparisons.
    Grid,
}

impl Tracer {
    /// Whether its structures are ours, and not the driver's.
    pub fn has_own_structures(self) -> bool {
        match self {
            Self::Pipeline | Self::Query => false,
            Self::Compute | Self::Grid => true,
        }
    }

    /// Whether a device supports this tracer.
    pub fn is_possible(self, info: &DeviceInfo) -> bool {
        match self {
            Self::Pipeline => info.ray_tracing.is_some(),
            Self::Query => info.ray_query,
            Self::Compute | Self::Grid => true,
        }
    }

    /// The tracer of the setting; if the device does not support it, the fastest supported one, with a warning.
    pub fn of(info: &DeviceInfo, wish: TracerChoice) -> Self {
        let possible = |tracer: Self| tracer.is_possible(info);
        let found = Self::choose(wish, info.software, possible);
        if let Some(wished) = Self::wished(wish).filter(|wished| *wished != found) {
            let name = match wished {
                Self::Pipeline => "ray tracing pipelines",
                Self::Query => "ray queries",
                Self::Compute | Self::Grid => "compute",
            };
            log::warn!("rt_tracer: {} has no {name}; {found:?} is used", info.name);
        }
        found
    }

    fn wished(wish: TracerChoice) -> Option<Self> {
        match wish {
            TracerChoice::Auto => None,
            TracerChoice::Pipeline => Some(Self::Pipeline),
            TracerChoice::Query => Some(Self::Query),
            TracerChoice::Compute => Some(Self::Compute),
            TracerChoice::Grid => Some(Self::Grid),
        }
    }

    /// The wished tracer if possible, otherwise the fastest by measurement: on devices that trace in software, our own
    /// hierarchies. Devices with ray tracing hardware offer ray queries; drivers without such hardware (NVIDIA's for
    /// Pascal, Volta and compute devices) offer ray tracing pipelines only.
    fn choose(wish: TracerChoice, software: bool, possible: impl Fn(Self) -> bool) -> Self {
        let by_programs = software || (possible(Self::Pipeline) && !possible(Self::Query));
        let fastest = [Self::Pipeline, Self::Query].map(|tracer| (!by_programs).then_some(tracer));
        [Self::wished(wish)]
            .into_iter()
            .chain(fastest)
            .flatten()
            .find(|tracer| possible(*tracer))
            .unwrap_or(Self::Compute)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unsupported_tracer_falls_back_to_the_fastest() {
        use Tracer::{Compute, Grid, Pipeline, Query};
        use TracerChoice as W;
        let (none, both) = (&[Compute, Grid][..], &[Pipeline, Query, Compute, Grid]);
        let (query, pipeline) = (&[Query, Compute], &[Pipeline, Compute]);
        for (device, software, wish, found) in [
            (none, false, W::Auto, Compute),
            (none, false, W::Pipeline, Compute),
            (none, false, W::Query, Compute),
            (both, false, W::Auto, Pipeline),
            (both, false, W::Query, Query),
            (both, false, W::Compute, Compute),
            (both, false, W::Grid, Grid),
            (none, true, W::Grid, Grid),
            (query, false, W::Auto, Query),
            (query, false, W::Pipeline, Query),
            (pipeline, false, W::Auto, Compute),
            (pipeline, false, W::Pipeline, Pipeline),
            (both, true, W::Auto, Compute),
            (both, true, W::Pipeline, Pipeline),
            (none, true, W::Pipeline, Compute),
        ] {
            let chosen = Tracer::choose(wish, software, |tracer| device.contains(&tracer));
            assert_eq!(chosen, found, "{wish:?} of {device:?}");
        }
    }
}
