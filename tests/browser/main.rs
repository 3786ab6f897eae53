//! The engine as it runs in the tab: compiled to WebAssembly, in a dedicated worker of a headless browser.
#![cfg(target_arch = "wasm32")]

use wasm_bindgen_test::wasm_bindgen_test_configure;

mod api;
mod estimation;
mod samples;

wasm_bindgen_test_configure!(run_in_dedicated_worker);
