//! Seeded random fields: hashed lattices with interpolation.

use nalgebra::Vector3;

/// A number of [0, 1) for a place of the lattice (the mixer of SplitMix64, as in `Random`).
pub fn hashed(x: i64, y: i64, z: i64, seed: u64) -> f64 {
    let mut h = seed ^ 0x9E37_79B9_7F4A_7C15;
    for value in [x, y, z] {
        h = (h ^ value as u64).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        h ^= h >> 29;
    }
    h = h.wrapping_mul(0x94D0_49BB_1331_11EB);
    h ^= h >> 32;
    (h >> 11) as f64 / (1u64 << 53) as f64
}

/// Smooth noise of [0, 1] with features of length 1.
pub fn smooth(p: &Vector3<f64>, seed: u64) -> f64 {
    let cell = p.map(f64::floor);
    let share = (p - cell).map(|t| t * t * (3.0 - 2.0 * t));
    let (x, y, z) = (cell.x as i64, cell.y as i64, cell.z as i64);
    let along_x = |y: i64, z: i64| {
        let (a, b) = (hashed(x, y, z, seed), hashed(x + 1, y, z, seed));
        a + (b - a) * share.x
    };
    let along_y = |z: i64| {
        let (a, b) = (along_x(y, z), along_x(y + 1, z));
        a + (b - a) * share.y
    };
    let (a, b) = (along_y(z), along_y(z + 1));
    a + (b - a) * share.z
}

/// Three octaves of [`smooth`], of [0, 1].
pub fn rough(p: &Vector3<f64>, seed: u64) -> f64 {
    let octave = |scale: f64| smooth(&(p * scale), seed);
    (octave(1.0) * 4.0 + octave(2.03) * 2.0 + octave(4.01)) / 7.0
}

#[cfg(test)]
mod tests {
    use super::super::super::random::Random;
    use super::*;

    #[test]
    fn noise_is_smooth_spread_and_differs_with_the_seed() {
        let mut random = Random::new(1);
        let (mut low, mut high, mut differing) = (1.0f64, 0.0f64, 0);
        for _ in 0..2000 {
            let p = Vector3::from_fn(|_, _| random.uniform(-9.0, 9.0));
            let value = smooth(&p, 3);
            low = low.min(value);
            high = high.max(value);
            assert!((smooth(&(p + Vector3::repeat(1e-6)), 3) - value).abs() < 1e-5);
            differing += usize::from((smooth(&p, 4) - value).abs() > 1e-3);
            assert!((0.0..=1.0).contains(&rough(&p, 3)));
        }
        assert!(low < 0.1 && high > 0.9 && differing > 1900, "{low} {high} {differing}");
    }
}
