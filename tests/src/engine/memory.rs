//! The engine's three kinds of memory, with the checks that the real engine lacks: what it would silently corrupt is
//! written down as a violation.

use std::alloc::{Layout, alloc_zeroed, dealloc};
use std::collections::HashMap;
use std::ffi::c_void;
use std::ptr;

/// What freed memory is filled with, so that later reads are visible.
const POISON: u8 = 0xDD;

/// One allocation.
struct Block {
    start: *mut u8,
    layout: Layout,
}

impl Block {
    fn new(size: usize) -> Option<Self> {
        let layout = Layout::from_size_align(size.max(1), 32).ok()?;
        // SAFETY: the layout's size is not zero.
        let start = unsafe { alloc_zeroed(layout) };
        (!start.is_null()).then_some(Self { start, layout })
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        // SAFETY: `start` and `layout` are those of the allocation, which ends here.
        unsafe {
            ptr::write_bytes(self.start, POISON, self.layout.size());
            dealloc(self.start, self.layout);
        }
    }
}

/// Hunk, temporary and zone memory.
#[derive(Default)]
pub struct Memory {
    hunk: Vec<Block>,
    temporary: Vec<Block>,
    zone: HashMap<usize, Block>,
    /// What the renderer did and must not do.
    pub violations: Vec<String>,
}

impl Memory {
    /// `Hunk_Alloc`: zeroed, 32-byte aligned, gone with [`Memory::clear_hunk`].
    pub fn hunk(&mut self, size: usize) -> *mut c_void {
        let Some(block) = Block::new(size) else {
            return ptr::null_mut();
        };
        let start = block.start;
        self.hunk.push(block);
        start.cast()
    }

    /// Discards the hunk wholesale, as the engine does at every change of map or video mode.
    pub fn clear_hunk(&mut self) {
        self.hunk.clear();
        if !self.temporary.is_empty() {
            self.violations.push(format!(
                "{} temporary blocks were never freed",
                self.temporary.len()
            ));
            self.temporary.clear();
        }
    }

    /// `Hunk_AllocateTempMemory` and the buffers of `FS_ReadFile`: a stack.
    pub fn push_temporary(&mut self, size: usize) -> *mut c_void {
        let Some(block) = Block::new(size) else {
            return ptr::null_mut();
        };
        let start = block.start;
        self.temporary.push(block);
        start.cast()
    }

    /// Frees the newest temporary block; anything else is a violation.
    pub fn pop_temporary(&mut self, start: *mut c_void) {
        match self
            .temporary
            .iter()
            .rposition(|b| ptr::eq(b.start, start.cast()))
        {
            Some(i) => {
                if i + 1 != self.temporary.len() {
                    self.violations
                        .push("temporary memory was not freed in reverse order".into());
                }
                self.temporary.remove(i);
            }
            None => self
                .violations
                .push("a block that is no temporary memory was freed as such".into()),
        }
    }

    /// `Malloc`.
    pub fn zone(&mut self, size: usize) -> *mut c_void {
        let Some(block) = Block::new(size) else {
            return ptr::null_mut();
        };
        let start = block.start;
        self.zone.insert(start.addr(), block);
        start.cast()
    }

    /// `Free`.
    pub fn free_zone(&mut self, start: *mut c_void) {
        if self.zone.remove(&start.addr()).is_none() {
            self.violations
                .push("a block that is no zone memory was freed as such".into());
        }
    }

    /// Zone blocks that are in use.
    pub fn zone_blocks(&self) -> usize {
        self.zone.len()
    }

    /// Bytes of hunk memory in use.
    pub fn hunk_bytes(&self) -> usize {
        self.hunk.iter().map(|b| b.layout.size()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn temporary_memory_is_a_stack() {
        let mut memory = Memory::default();
        let (a, b) = (memory.push_temporary(10), memory.push_temporary(0));
        memory.pop_temporary(b);
        memory.pop_temporary(a);
        assert!(memory.violations.is_empty());
        let (a, b) = (memory.push_temporary(10), memory.push_temporary(20));
        memory.pop_temporary(a);
        assert_eq!(memory.violations.len(), 1);
        memory.pop_temporary(b);
        memory.pop_temporary(b);
        assert_eq!(memory.violations.len(), 2);
    }

    #[test]
    fn blocks_are_zeroed_and_aligned() {
        let mut memory = Memory::default();
        let start = memory.hunk(100);
        assert_eq!(start.addr() % 32, 0);
        // SAFETY: 100 bytes were asked for.
        let bytes = unsafe { std::slice::from_raw_parts(start.cast::<u8>(), 100) };
        assert!(bytes.iter().all(|&b| b == 0));
        assert_eq!(memory.hunk_bytes(), 100);
        let zone = memory.zone(8);
        memory.free_zone(zone);
        memory.free_zone(zone);
        assert_eq!((memory.zone_blocks(), memory.violations.len()), (0, 1));
        memory.push_temporary(1);
        memory.clear_hunk();
        assert_eq!((memory.hunk_bytes(), memory.violations.len()), (0, 2));
    }
}
