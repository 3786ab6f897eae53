//! Functions of single numbers.

/// The larger of two numbers; the first where either is not one. (`f64::max` is a call of a function in WebAssembly.)
#[inline]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Bound of the relative error of distances that are computed in single precision.
pub(crate) const SINGLE_ERROR: f64 = 1e-4;

/// 1.5 * 2^23: adding it to a number in single precision of less than 2^22 rounds it to an integer, which is then in the last bits.
pub(crate) const ROUND_BY: f32 = 12_582_912.0;

/// Numbers from -1 to 1 that are spread irregularly, for tests.
#[cfg(test)]
pub(crate) fn wave(i: usize, k: f64) -> f64 {
    (i as f64 * k + 1.0).sin()
}
