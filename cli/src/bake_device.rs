//! What computes the light of `relight bake`.

use std::sync::Arc;

use anyhow::{Context, Result};
use relight::bake::{Gather, Rays};
use relight::{GameFiles, RelitWorld};
use renderer_vk::{GatherOptions, GpuGather, probe};

/// What computes the light of a world. `device`: `cpu`, `gpu` or part of a Vulkan device's name; `None`: a GPU, or the CPU
/// where there is none.
///
/// # Errors
/// The device is absent or out of memory.
pub fn gather<'a>(
    device: Option<&str>,
    files: &Arc<dyn GameFiles>,
    world: &'a RelitWorld,
) -> Result<Box<dyn Gather + 'a>> {
    let on = |device: Option<&str>| {
        let options = GatherOptions {
            device: device.map(str::to_owned),
            ..GatherOptions::default()
        };
        GpuGather::new(&options, Arc::clone(files), world)
    };
    match device {
        Some("cpu") => Ok(Box::new(Rays::new(world))),
        Some(name) => {
            let made = on((name != "gpu").then_some(name));
            Ok(Box::new(made.with_context(|| format!("--device {name}"))?))
        }
        // a software device is slower than the CPU's own rays
        None if probe(None).is_ok_and(|info| !info.software) => match on(None) {
            Ok(made) => Ok(Box::new(made)),
            Err(error) => {
                log::warn!("the CPU computes the light, because the GPU cannot: {error}");
                Ok(Box::new(Rays::new(world)))
            }
        },
        None => Ok(Box::new(Rays::new(world))),
    }
}
