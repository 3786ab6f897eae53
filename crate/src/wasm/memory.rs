//! The engine's memory grows in few large steps instead of many small ones.
//!
//! Each time it grows, V8 in Node counts all of it as newly allocated, and above 64 MB looks through its whole heap for
//! what could be freed: a reconstruction, which keeps something of every frame, would pay for that with every frame.

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

/// Makes the memory larger by a half, at most by 64 MB, if it has grown since the last call. To be called before each piece
/// of a long work. What is not used yet was never touched, so that it takes addresses and no memory.
pub fn grow_ahead() {
    let size = core::arch::wasm32::memory_size::<0>();
    if size == KNOWN_SIZE.get() {
        return;
    }
    let mut room = Vec::<u8>::new();
    // Where there is no room ahead, what is needed may yet fit.
    let _ = room.try_reserve_exact((size * PAGE_SIZE / 2).min(MAX_STEP));
    drop(black_box(room));
    KNOWN_SIZE.set(core::arch::wasm32::memory_size::<0>());
}
