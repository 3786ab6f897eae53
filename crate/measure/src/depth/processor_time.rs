//! How long a piece of work takes, other programs apart.

use std::sync::LazyLock;
use std::time::Instant;

/// Processor time of this thread where the system tells (s), or the time on the wall.
pub fn seconds_used() -> f64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| START.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

/// Processor time of a piece of work (s), and what it gave.
pub fn timed<T>(run: impl FnOnce() -> T) -> (f64, T) {
    let start = seconds_used();
    let done = run();
    (seconds_used() - start, done)
}
