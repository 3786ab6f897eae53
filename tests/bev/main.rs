//! Bird's-eye view: the published numbers, a plain matrix evaluation, a sampled reference, and everything degenerate.
#![cfg(not(target_arch = "wasm32"))] // a browser runs tests/browser
#![allow(non_snake_case)] // the names of the equations

mod chance;
mod faults;
mod files;
mod pictures;
mod plain;
mod refinement;
mod regions;
mod transfer;
