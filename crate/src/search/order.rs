//! Sorting of indices by a number each.

/// Indices of the numbers, sorted from the smallest number to the largest by `total_cmp`; among equal numbers the smaller
/// index comes first.
///
/// All modules share this one sort, because the compiler emits about 8 kB of WebAssembly for each combination of element type
/// and comparison.
pub(crate) fn ascending(numbers: impl IntoIterator<Item = f64>) -> Vec<usize> {
    let mut keys: Vec<(u64, u32)> = (0..).zip(numbers).map(|(index, number)| (sort_key(number), index)).collect();
    keys.sort_unstable();
    keys.into_iter().map(|(_, index)| index as usize).collect()
}

/// An integer that orders numbers as `total_cmp` does.
fn sort_key(number: f64) -> u64 {
    let bits = number.to_bits();
    // The bits of negative numbers ascend as the numbers descend: invert all bits. Otherwise set the sign bit.
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ascending_equals_a_stable_sort_by_total_cmp() {
        let numbers = [2.5, -0.0, 1e300, 0.0, -3.0, f64::NAN, 2.5, f64::NEG_INFINITY, -f64::NAN, 1e-310, -3.0];
        let mut expected: Vec<usize> = (0..numbers.len()).collect();
        expected.sort_by(|&a, &b| numbers[a].total_cmp(&numbers[b]));
        assert_eq!(ascending(numbers), expected);
        assert_eq!(ascending([]), [0; 0]);
    }
}
