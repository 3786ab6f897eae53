//! Growth of the engine's memory in few large steps.
//!
//! Each time the memory grows, V8 in Node counts all of it as newly allocated, and above 64 MB runs a full garbage collection: a
//! reconstruction, which stores data of every frame, would cause one with every frame.

use std::cell::Cell;
use std::hint::black_box;

/// A page of the memory, in bytes.
const PAGE_SIZE: usize = 1 << 16;
/// The most that a step makes room for.
const MAX_STEP: usize = 64 << 20;

thread_local! {
    /// Pages of the memory after the last step.
    static KNOWN_SIZE: Cell<usize> = const { Cell::new(0) };
}

/// Enlarges the memory by a half, at most by 64 MB, if it has grown since the last call. To be called before each step of a long
/// computation. Pages that are not used yet take address space but no physical memory.
pub fn grow_ahead() {
    let size = core::arch::wasm32::memory_size::<0>();
    if size != KNOWN_SIZE.get() {
        make_room((size * PAGE_SIZE / 2).min(MAX_STEP));
    }
}

/// Enlarges the memory so that there is room for this many bytes in one place: before a step that takes much at once.
pub fn make_room(num_bytes: usize) {
    let mut room = Vec::<u8>::new();
    // If this fails, a smaller allocation may still succeed.
    let _ = room.try_reserve_exact(num_bytes);
    drop(black_box(room));
    KNOWN_SIZE.set(core::arch::wasm32::memory_size::<0>());
}
