//! What `npm run bench` times: one registry of benchmarks, compiled natively and to WebAssembly.
//!
//! A benchmark is prepared once and then run again and again by a harness that holds the clock: `src/main.rs` natively,
//! `scripts/bench_wasm.mjs` under Node. Both do the same: warm up, choose how many runs make a sample long enough for
//! the clock, take the samples.
#![allow(non_snake_case)] // T_world_sensor, as in the crate itself

mod benchmark;
mod benchmarks;
#[cfg(feature = "peers")]
mod peers;
mod spatial;
#[cfg(target_arch = "wasm32")]
mod wasm;

pub use benchmark::{Benchmark, Prepared};
pub use benchmarks::benchmarks;
