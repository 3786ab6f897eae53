//! Graduated non-convexity with truncated least squares: all matches count at first, and those that do not fit less and
//! less.
//!
//! Yang, Antonante, Tzoumas and Carlone, "Graduated non-convexity for robust spatial perception: from non-minimal
//! solvers to global outlier rejection", RA-L 2020, proposition 4 and remark 5.

use nalgebra::{Point3, Vector3};
use scanstitch::geometry::Pose3;
use scanstitch::registration::factors::best_rigid_motion;

/// The convex surrogate turns into the truncated squares by this factor an iteration.
const GRADUATION: f64 = 1.4;
const MAX_ITERATIONS: usize = 100;
/// Weights that change less than this have been found.
const SAME_WEIGHT: f64 = 1e-6;

/// The motion that pairs (source, target) agree with to within `max_distance` (m), as far as a descent from all of them
/// finds it.
pub fn graduated_motion(pairs: &[(Vector3<f64>, Vector3<f64>)], max_distance: f64) -> Option<Pose3> {
    let sq_limit = max_distance * max_distance;
    let sq_residual =
        |T: &Pose3, (p, q): &(Vector3<f64>, Vector3<f64>)| (T * Point3::from(*p) - q).coords.norm_squared();
    let motion = |weights: &[f64]| -> Option<Pose3> {
        best_rigid_motion(pairs.iter().zip(weights).map(|((p, q), &weight)| (*p, *q, weight)))
    };
    let mut weights = vec![1.0; pairs.len()];
    let mut T = motion(&weights)?;
    let worst = pairs.iter().map(|pair| sq_residual(&T, pair)).fold(0.0, f64::max);
    if worst <= sq_limit {
        return Some(T);
    }
    let mut mu = sq_limit / (2.0 * worst - sq_limit);
    for _ in 0..MAX_ITERATIONS {
        let (low, high) = (mu / (mu + 1.0) * sq_limit, (mu + 1.0) / mu * sq_limit);
        let mut change: f64 = 0.0;
        for (weight, pair) in weights.iter_mut().zip(pairs) {
            let sq_residual = sq_residual(&T, pair);
            let next = if sq_residual <= low {
                1.0
            } else if sq_residual >= high {
                0.0
            } else {
                (sq_limit * mu * (mu + 1.0) / sq_residual).sqrt() - mu
            };
            change = change.max((next - *weight).abs());
            *weight = next;
        }
        T = motion(&weights)?;
        if change < SAME_WEIGHT && mu > 1.0 {
            break;
        }
        mu *= GRADUATION;
    }
    Some(T)
}
