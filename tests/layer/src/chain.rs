//! The next layer's functions, by instance and device.

use std::collections::HashMap;
use std::ffi::{CStr, c_void};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use ash::vk::{self, Handle};

use crate::calls::{CALLS, Call, Row};
use crate::profile::Profile;

/// Bytes in use of each heap, and the heap and size of each allocation.
#[derive(Default)]
pub struct Used {
    pub heaps: HashMap<u32, u64>,
    pub allocations: HashMap<vk::DeviceMemory, (u32, u64)>,
}

/// The functions below the layer, of an instance or of a device.
pub struct Chain {
    look_up: LookUp,
    /// The pointer of each of [`CALLS`]; null if the next layer has none.
    functions: Vec<*const c_void>,
    /// What limits the device.
    pub profile: Option<&'static Profile>,
    /// Its memory in use.
    pub used: Mutex<Used>,
    /// The device answers no more.
    pub lost: AtomicBool,
}

// SAFETY: the pointers are functions, which any thread may call.
unsafe impl Send for Chain {}
// SAFETY: as above.
unsafe impl Sync for Chain {}

/// How the next layer is asked for its functions.
#[derive(Clone, Copy)]
pub enum LookUp {
    Instance(vk::PFN_vkGetInstanceProcAddr, vk::Instance),
    Device(vk::PFN_vkGetDeviceProcAddr, vk::Device),
}

impl Chain {
    fn new(look_up: LookUp, profile: Option<&'static Profile>) -> Self {
        let mut chain = Self {
            look_up,
            profile,
            used: Default::default(),
            functions: Vec::new(),
            lost: AtomicBool::new(false),
        };
        let found = |call: &Row| {
            let function = chain.function(call.name);
            function.map_or(std::ptr::null(), |f| f as *const c_void)
        };
        chain.functions = CALLS.iter().map(found).collect();
        chain
    }

    /// The next layer's function of this name.
    pub fn function(&self, name: &CStr) -> vk::PFN_vkVoidFunction {
        // SAFETY (both calls): the chain exists only as long as its instance or device; the name is NUL-terminated.
        match self.look_up {
            // SAFETY: see above.
            LookUp::Instance(get, instance) => unsafe { get(instance, name.as_ptr()) },
            // SAFETY: see above.
            LookUp::Device(get, device) => unsafe { get(device, name.as_ptr()) },
        }
    }

    /// The pointer of the next layer's function; not null where the application could get ours.
    pub fn below(&self, call: usize) -> *const c_void {
        self.functions[call]
    }

    /// The same as a function.
    ///
    /// # Safety
    /// `T` must be the type of this function.
    pub unsafe fn next<T: Copy>(&self, call: Call) -> T {
        let pointer = self.below(call as usize);
        // SAFETY: a function pointer has the size of a pointer, and the caller promises the type.
        unsafe { std::mem::transmute_copy(&pointer) }
    }

    /// Waits for what the device executes.
    pub fn wait(&self) {
        if let LookUp::Device(_, device) = self.look_up {
            // SAFETY: this is its type.
            let wait: vk::PFN_vkDeviceWaitIdle = unsafe { self.next(Call::vkDeviceWaitIdle) };
            // SAFETY: the device is alive. Its queues are not in use: the application waits for the present call.
            let _ = unsafe { wait(device) };
        }
    }
}

/// The chains, by the first word of their handles: the loader writes its dispatch table there, and the handles of an
/// instance or a device share it.
static CHAINS: RwLock<Vec<(usize, Arc<Chain>)>> = RwLock::new(Vec::new());

fn key(handle: usize) -> usize {
    if handle == 0 {
        return 0;
    }
    // SAFETY: a dispatchable handle is a pointer to a structure whose first word is the loader's.
    unsafe { *(handle as *const usize) }
}

/// The chain of a dispatchable handle.
pub fn at(handle: usize) -> Option<Arc<Chain>> {
    let key = key(handle);
    let chains = CHAINS.read().unwrap_or_else(PoisonError::into_inner);
    chains
        .iter()
        .find(|(k, _)| *k == key)
        .map(|(_, chain)| chain.clone())
}

/// The chain of an instance, a device or what was made from them.
pub fn of(handle: impl Handle) -> Option<Arc<Chain>> {
    at(handle.as_raw() as usize)
}

/// Keeps what a creation made.
pub fn add(handle: usize, look_up: LookUp, profile: Option<&'static Profile>) {
    let (key, chain) = (key(handle), Arc::new(Chain::new(look_up, profile)));
    let mut chains = CHAINS.write().unwrap_or_else(PoisonError::into_inner);
    chains.retain(|(k, _)| *k != key);
    chains.push((key, chain));
}

/// Removes the chain of an instance or a device that is being destroyed, and returns it.
pub fn remove(handle: usize) -> Option<Arc<Chain>> {
    let key = key(handle);
    let mut chains = CHAINS.write().unwrap_or_else(PoisonError::into_inner);
    let place = chains.iter().position(|(k, _)| *k == key)?;
    Some(chains.swap_remove(place).1)
}
