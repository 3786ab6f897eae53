//! Drift as in the KITTI odometry benchmark: mean relative errors over stretches of the path of several lengths (Geiger, Lenz
//! and Urtasun, "Are we ready for autonomous driving?", CVPR 2012).

use nalgebra::Matrix3;
use serde::Serialize;

use super::path::{Path, angle, relative};
use crate::{Error, Result};

/// Number of lengths of stretches: 1 to 8 times a unit, 100 m in the benchmark.
const MULTIPLES: usize = 8;
/// The benchmark's unit (m).
const KITTI_UNIT: f64 = 100.0;
/// In the benchmark a stretch begins at every tenth pose, which is one a second.
const KITTI_STEP: usize = 10;

/// Mean errors of stretches of one length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct DriftOfLength {
    /// Length of the stretches (m).
    pub length: f64,
    /// Number of stretches.
    pub num_stretches: usize,
    /// Mean translation error divided by the length (percent).
    pub translation: f64,
    /// Mean rotation error divided by the length (deg/m).
    pub rotation: f64,
}

/// Mean errors of stretches of all lengths.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Drift {
    /// Whether lengths and starts are the benchmark's, 100 to 800 m and every tenth pose; otherwise they are scaled to
    /// the path.
    pub is_kitti: bool,
    /// Number of stretches.
    pub num_stretches: usize,
    /// Mean error of the translation over all stretches (percent).
    pub translation: f64,
    /// Mean error of the rotation over all stretches (deg/m).
    pub rotation: f64,
    /// By length, for the lengths that fit into the path.
    pub by_length: Vec<DriftOfLength>,
}

/// The drift of an estimate, poses of equal index corresponding.
///
/// A stretch begins at every tenth pose and ends at the first pose that lies further along the reference's path than its
/// length: 100, 200, ... 800 m. Where the reference's path is shorter than 200 m, it begins at every pose, and the unit
/// is the largest of 50, 20, 10, 5, ... m of which eight fit into the path.
///
/// # Errors
/// Without orientations, and when no stretch fits.
pub fn drift(reference: &Path, estimate: &Path) -> Result<Drift> {
    drift_of_numbered(reference, estimate, &(0..reference.len()).collect::<Vec<_>>())
}

/// The same for poses with these numbers, as of an estimate that lacks some frames: a stretch begins at every pose whose number is
/// a multiple of ten.
///
/// # Errors
/// As [`drift`].
pub fn drift_of_numbered(reference: &Path, estimate: &Path, numbers: &[usize]) -> Result<Drift> {
    let (Some(R_reference), Some(R_estimate)) = (&reference.rotations, &estimate.rotations) else {
        let problem = "Drift compares orientations, and one of the two has positions alone";
        return Err(Error::whole(problem, "Use the absolute error of the translation part"));
    };
    let distances = reference.distances();
    let total = distances.last().copied().unwrap_or_default();
    let is_kitti = total >= 2.0 * KITTI_UNIT;
    let (unit, step) = if is_kitti { (KITTI_UNIT, KITTI_STEP) } else { (unit_for(total)?, 1) };

    let starts: Vec<usize> = (0..reference.len()).filter(|&index| numbers[index].is_multiple_of(step)).collect();
    let mut by_length: Vec<DriftOfLength> = Vec::new();
    for multiple in 1..=MULTIPLES {
        let length = multiple as f64 * unit;
        let errors = stretch_errors((reference, R_reference), (estimate, R_estimate), &distances, length, &starts)?;
        if !errors.is_empty() {
            let n = errors.len() as f64;
            let (translation, rotation) =
                errors.iter().fold((0.0, 0.0), |sum, error| (sum.0 + error.0, sum.1 + error.1));
            let (translation, rotation) = (100.0 * translation / n, rotation / n);
            by_length.push(DriftOfLength { length, num_stretches: errors.len(), translation, rotation });
        }
    }
    let num_stretches: usize = by_length.iter().map(|of| of.num_stretches).sum();
    if num_stretches == 0 {
        return Err(too_short(total));
    }
    let mean = |value: fn(&DriftOfLength) -> f64| {
        by_length.iter().map(|of| value(of) * of.num_stretches as f64).sum::<f64>() / num_stretches as f64
    };
    let (translation, rotation) = (mean(|of| of.translation), mean(|of| of.rotation));
    Ok(Drift { is_kitti, num_stretches, translation, rotation, by_length })
}

/// For each stretch of a length (m), the errors of its motion divided by the length: translation (1) and rotation (deg/m).
fn stretch_errors(
    (reference, R_reference): (&Path, &[Matrix3<f64>]),
    (estimate, R_estimate): (&Path, &[Matrix3<f64>]),
    distances: &[f64],
    length: f64,
    starts: &[usize],
) -> Result<Vec<(f64, f64)>> {
    let mut errors = Vec::new();
    for &first in starts {
        let end = distances[first] + length;
        let last = first + distances[first..].partition_point(|&distance| distance <= end);
        if last == reference.len() {
            break;
        }
        let motion = |R: &[Matrix3<f64>], path: &Path| {
            relative((&R[first], &path.positions[first]), (&R[last], &path.positions[last]))
        };
        let (of_reference, of_estimate) = (motion(R_reference, reference), motion(R_estimate, estimate));
        let (R, t) = relative((&of_estimate.0, &of_estimate.1), (&of_reference.0, &of_reference.1));
        errors.push((t.norm() / length, angle(&R)?.to_degrees() / length));
    }
    Ok(errors)
}

/// The largest of 50, 20, 10, 5, ... m of which eight fit into the path.
fn unit_for(total: f64) -> Result<f64> {
    let mut decade = 10.0;
    while decade >= 1e-4 {
        for digit in [5.0, 2.0, 1.0] {
            if digit * decade * MULTIPLES as f64 <= total {
                return Ok(digit * decade);
            }
        }
        decade /= 10.0;
    }
    Err(too_short(total))
}

fn too_short(total: f64) -> Error {
    Error::whole(format!("The reference's path is {total} m long: too short for drift"), "Use the relative error")
}
