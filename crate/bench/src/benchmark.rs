//! A benchmark: its name, its input and the work of one run.

/// A named benchmark.
pub struct Benchmark {
    /// What `npm run bench -- NAME` calls it.
    pub name: &'static str,
    /// What one run does, in a few words.
    pub about: &'static str,
    /// Prepares its input from the files given (name and bytes); most benchmarks need none.
    pub prepare: fn(Files) -> Result<Prepared, String>,
}

/// Names and contents of the files a benchmark is given.
pub type Files = Vec<(String, Vec<u8>)>;

/// A benchmark with its input ready.
pub struct Prepared {
    /// The work of one run, from which a rate is computed: amount and unit. Bytes give MB/s.
    pub work: Option<(f64, &'static str)>,
    /// One run.
    pub run: Box<dyn FnMut()>,
}

impl Prepared {
    /// The work of one run, as both harnesses print it: amount and unit, or `- -`.
    pub fn work_text(&self) -> String {
        self.work.map_or_else(|| "- -".into(), |(amount, unit)| format!("{amount} {unit}"))
    }
}
