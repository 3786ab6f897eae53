//! Memory that is in use at the same time, counted by the allocator: what reading an input takes over its size.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// An input may take so many times its bytes, and so much beyond that (bytes).
const MAX_TIMES: usize = 20;
const MAX_MORE: usize = 64 << 20;
/// A peak is printed where it is so much above those before (bytes).
const TOLD_STEP: usize = 1 << 16;

static IN_USE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
static TOLD: AtomicUsize = AtomicUsize::new(0);

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: everything is left to the system's allocator; what it gives is only counted.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(IN_USE.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Reads an input, and panics where that takes too much.
pub fn watched(bytes: &[u8], read: impl FnOnce(&[u8])) {
    let before = IN_USE.load(Relaxed);
    PEAK.store(before, Relaxed);
    read(bytes);
    let taken = PEAK.load(Relaxed) - before;
    assert!(taken <= MAX_TIMES * bytes.len() + MAX_MORE, "{taken} bytes of memory for {} bytes", bytes.len());
    if taken > TOLD.load(Relaxed) + TOLD_STEP {
        TOLD.store(taken, Relaxed);
        eprintln!("peak: {taken} bytes of memory for {} bytes", bytes.len());
    }
}
