//! The direction along which most walls of a map run, by the normals of its returns.
//!
//! In most buildings walls are parallel or at right angles to each other (Coughlan and Yuille, "Manhattan World", ICCV 1999): normals
//! are compared modulo a right angle.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector2;

/// Bins of the histogram over a right angle: 0.25 degrees each.
const BINS: usize = 360;
/// Standard deviation of the histogram's smoothing, in bins: 1 degree, a few times less than the scatter of single normals, so that two
/// wings of a building that differ by some degrees stay two peaks.
const SMOOTHING: f64 = 4.0;
/// Largest angle from the peak of the normals whose mean is taken, in bins: 4 degrees, so that the mean is about those of the peak alone.
const AROUND_PEAK: usize = 16;

/// The angle from the world's axes to most walls, -pi/4 to pi/4. Each normal counts by its length. `None` where there are none.
pub fn wall_direction(normals: impl Iterator<Item = Vector2<f64>>) -> Option<f64> {
    let mut weights = vec![0.0; BINS];
    for normal in normals {
        let turns = normal.y.atan2(normal.x) / FRAC_PI_2;
        weights[(turns.rem_euclid(1.0) * BINS as f64) as usize % BINS] += normal.norm();
    }
    let smoothed: Vec<f64> = (0..BINS).map(|bin| smoothed_at(&weights, bin)).collect();
    let peak = (0..BINS).max_by(|&a, &b| smoothed[a].total_cmp(&smoothed[b]).then(b.cmp(&a)))?;
    if smoothed[peak] == 0.0 {
        return None;
    }
    // As angles four times as large, the bins are a circle.
    let angle = |bin: usize| (bin as f64 + 0.5) / BINS as f64 * TAU;
    let near = (0..=2 * AROUND_PEAK).map(|step| (peak + BINS + step - AROUND_PEAK) % BINS);
    let mean = near.fold(Vector2::zeros(), |sum, bin| {
        let (sin, cos) = angle(bin).sin_cos();
        sum + Vector2::new(cos, sin) * weights[bin]
    });
    Some(mean.y.atan2(mean.x) / 4.0)
}

/// The weights about a bin, by a Gaussian.
fn smoothed_at(weights: &[f64], bin: usize) -> f64 {
    let reach = (3.0 * SMOOTHING) as usize;
    let near = (0..=2 * reach).map(|step| {
        let off = (step as f64 - reach as f64) / SMOOTHING;
        weights[(bin + BINS + step - reach) % BINS] * (-0.5 * off * off).exp()
    });
    near.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitComplex;

    /// Normals of walls in four directions and of a third as many in another one, with scatter.
    fn normals(angle: f64) -> impl Iterator<Item = Vector2<f64>> {
        (0..4000).map(move |i| {
            let scatter = 0.03 * f64::from(i * 37 % 101 - 50) / 25.0;
            let wall = if i % 4 == 3 { 0.5 } else { f64::from(i % 4) * FRAC_PI_2 };
            UnitComplex::new(angle + wall + scatter) * Vector2::new(2.0, 0.0)
        })
    }

    #[test]
    fn the_direction_of_most_walls_is_found_at_any_turn_and_others_do_not_draw_it() {
        for degrees in -44..=44 {
            let turned = f64::from(degrees).to_radians();
            let found = wall_direction(normals(turned)).unwrap();
            assert!((found - turned).abs() < 0.1_f64.to_radians(), "{degrees}: {}", found.to_degrees());
        }
        let found = wall_direction(normals(FRAC_PI_2 / 2.0)).unwrap();
        assert!((found.abs() - FRAC_PI_2 / 2.0).abs() < 0.002, "{found}");
        assert_eq!(wall_direction(std::iter::empty()), None);
    }
}
