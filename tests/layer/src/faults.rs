//! Counts calls, lists them, and makes one of them fail.

use std::io::Write;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};

use ash::vk;

use crate::calls::{CALLS, Call};
use crate::chain::Chain;

/// What happens to a call.
pub enum Strike {
    /// Nothing.
    Nothing,
    /// It is not made, and returns this.
    Instead(vk::Result),
    /// It is made, and returns this if it succeeds.
    After(vk::Result),
}

/// The call that fails.
struct Fault {
    function: String,
    number: u32,
    result: vk::Result,
}

static FAULT: LazyLock<Option<Fault>> = LazyLock::new(|| {
    let text = std::env::var("RELIGHT_LAYER_FAULT").ok()?;
    let mut words = text.split(' ');
    let (function, number, name) = (words.next()?, words.next()?, words.next()?);
    let result = *RESULTS.iter().find(|r| format!("{r:?}") == name)?;
    Some(Fault {
        function: function.to_owned(),
        number: number.parse().ok()?,
        result,
    })
});

static LOG: LazyLock<Option<Mutex<std::fs::File>>> = LazyLock::new(|| {
    let path = std::env::var_os("RELIGHT_LAYER_LOG")?;
    let file = std::fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(path);
    file.ok().map(Mutex::new)
});

/// Number of calls so far of each of [`CALLS`].
static COUNTS: [AtomicU32; CALLS.len()] = [const { AtomicU32::new(0) }; CALLS.len()];

/// Sizes of the window, see the module `window`; where there are some, each picture that is shown is suboptimal.
pub static SIZES: LazyLock<Vec<vk::Extent2D>> = LazyLock::new(|| {
    let text = std::env::var("RELIGHT_LAYER_SIZES").unwrap_or_default();
    let sizes = text.split(' ').filter_map(|size| {
        let (width, height) = size.split_once('x')?;
        let (width, height) = (width.parse().ok()?, height.parse().ok()?);
        Some(vk::Extent2D { width, height })
    });
    sizes.collect()
});

/// The results that are injected.
const RESULTS: [vk::Result; 8] = [
    vk::Result::ERROR_OUT_OF_HOST_MEMORY,
    vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
    vk::Result::ERROR_INITIALIZATION_FAILED,
    vk::Result::ERROR_DEVICE_LOST,
    vk::Result::ERROR_SURFACE_LOST_KHR,
    vk::Result::ERROR_OUT_OF_DATE_KHR,
    vk::Result::SUBOPTIMAL_KHR,
    vk::Result::TIMEOUT,
];

/// The results that a letter stands for.
fn results(letter: char) -> &'static [vk::Result] {
    match letter {
        'H' => &RESULTS[..1],
        'D' => &RESULTS[1..2],
        'I' => &RESULTS[2..3],
        'L' => &RESULTS[3..4],
        'S' => &RESULTS[4..5],
        'O' => &RESULTS[5..7],
        'T' => &RESULTS[7..8],
        _ => &[],
    }
}

/// Writes a line to the log, if there is one.
pub fn log(line: &str) {
    if let Some(file) = &*LOG {
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        // A log that cannot be written is short, and the test that reads it fails.
        let _ = file.write_all(format!("{line}\n").as_bytes());
    }
}

/// Counts a call of a function of [`CALLS`], and says what becomes of it.
pub fn strike(call: usize, chain: Option<&Chain>) -> Strike {
    let row = &CALLS[call];
    let name = row.name.to_str().unwrap_or_default();
    if row.errors.is_empty() {
        return Strike::Nothing;
    }
    let number = COUNTS[call].fetch_add(1, Ordering::Relaxed) + 1;
    if LOG.is_some() {
        let errors: Vec<String> = (row.errors.chars())
            .flat_map(results)
            .map(|result| format!("{result:?}"))
            .collect();
        log(&format!("{} {number} {}", name, errors.join(",")));
    }
    if let Some(chain) = chain
        && chain.lost.load(Ordering::Relaxed)
        && row.errors.contains('L')
    {
        return Strike::Instead(vk::Result::ERROR_DEVICE_LOST);
    }
    let shown = match SIZES.is_empty() {
        false if call == Call::vkQueuePresentKHR as usize => {
            Strike::After(vk::Result::SUBOPTIMAL_KHR)
        }
        _ => Strike::Nothing,
    };
    let Some(fault) = &*FAULT else {
        return shown;
    };
    if fault.function != name || fault.number != number {
        return shown;
    }
    log(&format!("struck {name} {number}"));
    match fault.result {
        vk::Result::ERROR_DEVICE_LOST => {
            if let Some(chain) = chain {
                // Nothing that the application submitted runs on a lost device.
                chain.wait();
                chain.lost.store(true, Ordering::Relaxed);
            }
            Strike::Instead(fault.result)
        }
        vk::Result::SUBOPTIMAL_KHR => Strike::After(fault.result),
        // The semaphores of a presentation are waited for, and its image is given back, also where these are returned.
        vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_SURFACE_LOST_KHR
            if call == Call::vkQueuePresentKHR as usize =>
        {
            Strike::After(fault.result)
        }
        result => Strike::Instead(result),
    }
}
