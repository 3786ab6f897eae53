//! The same registry for JavaScript, which holds the clock there.

use js_sys::Uint8Array;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::{Prepared, benchmarks};

/// A benchmark made ready to run.
#[wasm_bindgen]
pub struct PreparedBenchmark(Prepared);

#[wasm_bindgen]
impl PreparedBenchmark {
    /// Prepares the benchmark of this name; files are named and given one after the other.
    ///
    /// # Errors
    /// When no benchmark has the name, or the files do not suit it.
    #[wasm_bindgen(constructor)]
    #[allow(clippy::needless_pass_by_value, reason = "arrays of objects cross by value")]
    pub fn new(name: &str, file_names: Vec<String>, file_contents: Vec<Uint8Array>) -> Result<Self, String> {
        let benchmark = benchmarks()
            .find(|benchmark| benchmark.name == name)
            .ok_or_else(|| format!("no benchmark is called {name:?}"))?;
        let files = file_names.into_iter().zip(file_contents.iter().map(Uint8Array::to_vec)).collect();
        (benchmark.prepare)(files).map(Self)
    }

    /// The work of one run: amount and unit, or `- -`.
    pub fn work(&self) -> String {
        self.0.work_text()
    }

    /// Does the work `runs` times.
    pub fn run(&mut self, runs: u32) {
        for _ in 0..runs {
            (self.0.run)();
        }
    }
}
