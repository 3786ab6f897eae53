//! PLY reading and writing, on real files, on files made here, and on broken ones.
#![cfg(not(target_arch = "wasm32"))] // a browser runs tests/browser

mod broken_files;
#[path = "../common/mod.rs"]
mod common;
mod known_files;
mod random_files;
mod rules;
mod texts;
mod values;
