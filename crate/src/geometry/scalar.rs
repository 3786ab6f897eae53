//! Functions of single numbers.

/// The larger of two numbers; the first where either is not one. (`f64::max` is a call of a function in WebAssembly.)
#[inline]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Numbers from -1 to 1 that are spread irregularly, for tests.
#[cfg(test)]
pub(crate) fn wave(i: usize, k: f64) -> f64 {
    (i as f64 * k + 1.0).sin()
}
