//! The parts of an evaluation one by one: association, alignment, drift, relations, map quality, and what they say of
//! input that makes no sense.
#![cfg(not(target_arch = "wasm32"))] // it reads files
#![allow(non_snake_case)]

mod alignment;
mod association;
#[path = "../common/mod.rs"]
mod common;
mod map_crispness;
mod refusals;
mod relative;
mod samples;
