//! Emulates `VK_KHR_present_id` and `VK_KHR_present_wait`, which software drivers lack. `RELIGHT_LAYER_DISPLAY` is the
//! display's refresh interval in milliseconds; it shows presented pictures in order, and queues at most two. With `mute`
//! waits always time out, as for a covered window. The log gets a line `queued N` for each acquisition, N: pictures that
//! are presented and not shown yet; and a line `waits` for each wait with a timeout above zero.

use std::collections::VecDeque;
use std::ffi::{CStr, c_char};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ash::{khr, vk};

use crate::calls::Call;
use crate::chain::{self, Chain};
use crate::faults::{self, Strike};
use crate::limits;

/// What the display does.
#[derive(Clone, Copy)]
enum Display {
    Mute,
    Every(Duration),
}

static DISPLAY: LazyLock<Option<Display>> = LazyLock::new(|| {
    let text = std::env::var("RELIGHT_LAYER_DISPLAY").ok()?;
    match text.as_str() {
        "mute" => Some(Display::Mute),
        ms => Some(Display::Every(Duration::from_millis(ms.parse().ok()?))),
    }
});

/// Pictures and when they are shown.
struct Shown {
    start: Instant,
    /// Pictures that wait: number and time.
    waiting: VecDeque<(u64, Instant)>,
    /// Number of the last picture that is not in the list.
    number: u64,
    /// The swapchain of these pictures.
    swapchain: vk::SwapchainKHR,
}

static SHOWN: LazyLock<Mutex<Shown>> = LazyLock::new(|| {
    Mutex::new(Shown {
        start: Instant::now(),
        waiting: VecDeque::new(),
        number: 0,
        swapchain: vk::SwapchainKHR::null(),
    })
});

/// Pictures that may wait.
const WAITING: usize = 2;

impl Shown {
    /// Adds a picture that is ready now.
    fn add(&mut self, number: u64, interval: Duration) {
        let interval = interval.max(Duration::from_millis(1));
        let passed = self.start.elapsed().as_nanos() / interval.as_nanos() + 1;
        let next = self.start + interval * u32::try_from(passed).unwrap_or(u32::MAX);
        let after = self.waiting.back().map(|(_, last)| *last + interval);
        self.waiting
            .push_back((number, after.map_or(next, |after| after.max(next))));
    }

    /// Forgets what was shown before `now`.
    fn pass(&mut self, now: Instant) {
        while let Some((number, _)) = self.waiting.front().filter(|(_, time)| *time <= now) {
            self.number = *number;
            self.waiting.pop_front();
        }
    }
}

fn shown() -> std::sync::MutexGuard<'static, Shown> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The extensions of the display, if there is one.
pub fn extensions() -> Vec<vk::ExtensionProperties> {
    let property = |name: &CStr| {
        let mut property = vk::ExtensionProperties {
            spec_version: 1,
            ..Default::default()
        };
        for (to, byte) in property.extension_name.iter_mut().zip(name.to_bytes()) {
            *to = *byte as c_char;
        }
        property
    };
    match *DISPLAY {
        Some(_) => EXTENSIONS.map(property).to_vec(),
        None => Vec::new(),
    }
}

const EXTENSIONS: [&CStr; 2] = [khr::present_id::NAME, khr::present_wait::NAME];

/// Whether the layer's function of this name needs none of the next layer.
pub fn has(name: &CStr) -> bool {
    DISPLAY.is_some() && name == c"vkWaitForPresentKHR"
}

/// The structures that the next layers do not know.
const STRUCTURES: [vk::StructureType; 3] = [
    vk::StructureType::PHYSICAL_DEVICE_PRESENT_ID_FEATURES_KHR,
    vk::StructureType::PHYSICAL_DEVICE_PRESENT_WAIT_FEATURES_KHR,
    vk::StructureType::PRESENT_ID_KHR,
];

/// Takes the display's structures out of the chain that begins with `head` while `call` runs, then gives each to
/// `look`.
///
/// # Safety
/// `head` must be the first structure of a chain of valid structures that may be written to.
unsafe fn without<T>(
    head: *mut vk::BaseOutStructure<'_>,
    call: impl FnOnce() -> T,
    mut look: impl FnMut(*mut vk::BaseOutStructure<'static>),
) -> T {
    let mut taken = Vec::new();
    let mut place = head.cast::<vk::BaseOutStructure<'static>>();
    if DISPLAY.is_some() {
        loop {
            // SAFETY: every structure of a chain begins with its type and the next one.
            let next = unsafe { (*place).p_next };
            if next.is_null() {
                break;
            }
            // SAFETY: as above.
            if STRUCTURES.contains(unsafe { &(*next).s_type }) {
                taken.push((place, next));
                // SAFETY: as above.
                unsafe { (*place).p_next = (*next).p_next };
            } else {
                place = next;
            }
        }
    }
    let result = call();
    for (place, next) in taken.into_iter().rev() {
        // SAFETY: the structure was taken out after this place.
        unsafe { (*place).p_next = next };
        look(next);
    }
    result
}

/// Asks the next layer for features, to which those of the display come.
///
/// # Safety
/// That of `vkGetPhysicalDeviceFeatures2`.
pub unsafe fn features2(answer: *mut vk::PhysicalDeviceFeatures2<'_>, next: impl FnOnce()) {
    let look = |structure: *mut vk::BaseOutStructure<'static>| {
        // SAFETY: both structures have one flag, after the common beginning.
        unsafe {
            (*structure.cast::<vk::PhysicalDevicePresentIdFeaturesKHR<'_>>()).present_id = vk::TRUE;
        }
    };
    // SAFETY: the caller's chain.
    unsafe { without(answer.cast(), next, look) }
}

/// Makes a device without the display's extensions and features.
///
/// # Safety
/// That of `vkCreateDevice`; `create` gets its information.
pub unsafe fn device(
    mut info: vk::DeviceCreateInfo<'_>,
    create: impl FnOnce(&vk::DeviceCreateInfo<'_>) -> vk::Result,
) -> vk::Result {
    let mut names: Vec<*const c_char> = Vec::new();
    if DISPLAY.is_some() {
        // SAFETY: the caller's list.
        let all = unsafe {
            limits::names(
                info.pp_enabled_extension_names,
                info.enabled_extension_count,
            )
        };
        names.extend((all.into_iter().filter(|n| !EXTENSIONS.contains(n))).map(CStr::as_ptr));
        info.pp_enabled_extension_names = names.as_ptr();
        info.enabled_extension_count = names.len() as u32;
    }
    let info = &raw mut info;
    // SAFETY: a copy of the caller's information, whose chain is the application's.
    unsafe { without(info.cast(), || create(&*info), |_| {}) }
}

/// # Safety
/// That of `vkQueuePresentKHR`.
pub unsafe extern "system" fn present(
    queue: vk::Queue,
    info: *const vk::PresentInfoKHR<'_>,
) -> vk::Result {
    let Some(chain) = chain::of(queue) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    let struck = faults::strike(Call::vkQueuePresentKHR as usize, Some(&chain));
    if let Strike::Instead(result) = struck {
        return result;
    }
    // SAFETY: this is its type.
    let next: vk::PFN_vkQueuePresentKHR = unsafe { chain.next(Call::vkQueuePresentKHR) };
    let mut number = None;
    let look = |structure: *mut vk::BaseOutStructure<'static>| {
        // SAFETY: the structure of presentations, with a number for each swapchain; the renderer has one.
        number = unsafe {
            (*structure.cast::<vk::PresentIdKHR<'_>>())
                .p_present_ids
                .as_ref()
        };
    };
    // SAFETY: the caller's structure.
    let mut info = unsafe { *info };
    let info = &raw mut info;
    // SAFETY: the caller's arguments.
    let result = unsafe { without(info.cast(), || next(queue, info), look) };
    if let (Some(number), Some(Display::Every(interval)), true) =
        (number, *DISPLAY, result.as_raw() >= 0)
    {
        shown().add(*number, interval);
    }
    match struck {
        Strike::After(struck) if result == vk::Result::SUCCESS => struck,
        _ => result,
    }
}

/// Waits for the display to have room.
///
/// # Safety
/// That of `vkAcquireNextImageKHR`.
pub unsafe extern "system" fn acquire(
    device: vk::Device,
    swapchain: vk::SwapchainKHR,
    timeout: u64,
    semaphore: vk::Semaphore,
    fence: vk::Fence,
    index: *mut u32,
) -> vk::Result {
    let Some(chain) = chain::of(device) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    let struck = faults::strike(Call::vkAcquireNextImageKHR as usize, Some(&chain));
    if let Strike::Instead(result) = struck {
        return result;
    }
    let room = {
        let mut shown = shown();
        if shown.swapchain != swapchain {
            // what an earlier one has presented is not shown any more
            shown.swapchain = swapchain;
            shown.waiting.clear();
        }
        shown.pass(Instant::now());
        if DISPLAY.is_some() {
            faults::log(&format!("queued {}", shown.waiting.len()));
        }
        let full = shown.waiting.len().checked_sub(WAITING);
        full.and_then(|place| shown.waiting.get(place).map(|(_, time)| *time))
    };
    if let Some(room) = room {
        std::thread::sleep(room.saturating_duration_since(Instant::now()));
    }
    // SAFETY: this is its type.
    let next: vk::PFN_vkAcquireNextImageKHR = unsafe { chain.next(Call::vkAcquireNextImageKHR) };
    // SAFETY: the caller's arguments.
    let result = unsafe { next(device, swapchain, timeout, semaphore, fence, index) };
    match struck {
        Strike::After(struck) if result == vk::Result::SUCCESS => struck,
        _ => result,
    }
}

/// # Safety
/// That of `vkWaitForPresentKHR`.
pub unsafe extern "system" fn wait(
    device: vk::Device,
    swapchain: vk::SwapchainKHR,
    number: u64,
    timeout: u64,
) -> vk::Result {
    let Some(chain) = chain::of(device) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    let struck = faults::strike(Call::vkWaitForPresentKHR as usize, Some(&chain));
    if let Strike::Instead(result) = struck {
        return result;
    }
    let Some(display) = *DISPLAY else {
        return next_wait(&chain, device, swapchain, number, timeout);
    };
    if timeout > 0 {
        faults::log("waits");
    }
    let now = Instant::now();
    let time = match display {
        Display::Mute => None,
        Display::Every(_) => {
            let mut shown = shown();
            shown.pass(now);
            match shown.number >= number {
                true => Some(now),
                false => (shown.waiting.iter())
                    .find(|(n, _)| *n >= number)
                    .map(|(_, time)| *time),
            }
        }
    };
    let until = now + Duration::from_nanos(timeout);
    let in_time = time.filter(|time| *time <= until);
    std::thread::sleep(in_time.unwrap_or(until).saturating_duration_since(now));
    match (in_time, struck) {
        (None, _) => vk::Result::TIMEOUT,
        (Some(_), Strike::After(struck)) => struck,
        (Some(_), _) => vk::Result::SUCCESS,
    }
}

/// The driver's own, where there is no display of ours.
fn next_wait(
    chain: &Chain,
    device: vk::Device,
    swapchain: vk::SwapchainKHR,
    number: u64,
    timeout: u64,
) -> vk::Result {
    // SAFETY: this is its type, and without a display of ours the application gets our function only if there is one.
    let next: vk::PFN_vkWaitForPresentKHR = unsafe { chain.next(Call::vkWaitForPresentKHR) };
    // SAFETY: the caller's arguments.
    unsafe { next(device, swapchain, number, timeout) }
}
