//! The pairs of poses that the relative error compares: those `delta` apart, chosen as in evo.

use serde::{Deserialize, Serialize};

use super::path::{Path, angle, relative};
use crate::geometry::rotation::nearest_rotation;
use crate::{Error, Result};

/// Most pairs (all pairs by angle); more would exceed the memory of a browser tab.
const MAX_PAIRS: usize = 20_000_000;

/// The unit of `delta`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum DeltaUnit {
    /// Poses.
    #[default]
    Frames,
    /// Path length (m).
    Meters,
    /// Time (s). evo has no such unit; pairs are chosen as by path length, with time in its place.
    Seconds,
    /// Rotation angle (deg).
    Degrees,
    /// Rotation angle (rad).
    Radians,
}

/// How pairs are chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairOptions {
    /// Separation of the two poses of a pair, in `delta_unit`.
    pub delta: f64,
    /// Unit of `delta`.
    pub delta_unit: DeltaUnit,
    /// Whether a pair begins at every pose. Otherwise each pair begins where the last one ended.
    pub all_pairs: bool,
    /// With all pairs: largest deviation of a pair's separation from `delta`, as a share of `delta`.
    pub delta_tolerance: f64,
    /// Whether path and angle are measured along the reference rather than the estimate.
    pub pairs_from_reference: bool,
}

impl Default for PairOptions {
    /// evo's defaults: each pose with the next.
    fn default() -> Self {
        Self {
            delta: 1.0,
            delta_unit: DeltaUnit::Frames,
            all_pairs: false,
            delta_tolerance: 0.1,
            pairs_from_reference: false,
        }
    }
}

/// The pairs (i, j), i < j.
///
/// # Errors
/// When there is no pair, `delta` is out of range, or the poses lack the times or orientations that its unit needs.
pub fn index_pairs(path: &Path, options: &PairOptions) -> Result<Vec<(usize, usize)>> {
    let PairOptions { delta, delta_unit, all_pairs, delta_tolerance, .. } = *options;
    if !(delta >= 0.0 && delta.is_finite()) {
        return Err(Error::whole(format!("delta is {delta}"), "Give a positive number"));
    }
    let tolerance = delta * delta_tolerance;
    let pairs = match delta_unit {
        DeltaUnit::Frames => by_index(path.len(), delta, all_pairs)?,
        DeltaUnit::Meters if all_pairs => all_by_progress(&path.distances(), delta, tolerance),
        DeltaUnit::Meters => {
            let steps = path.positions.windows(2).map(|pair| (pair[1] - pair[0]).norm());
            consecutive(steps, delta)
        }
        DeltaUnit::Seconds => by_time(path, delta, tolerance, all_pairs)?,
        DeltaUnit::Degrees | DeltaUnit::Radians => {
            let radians = |value: f64| if delta_unit == DeltaUnit::Degrees { value.to_radians() } else { value };
            if radians(delta) > std::f64::consts::PI + 1e-12 {
                return Err(Error::whole(
                    format!("delta is {delta} {}, and two poses are turned by 180 deg at the most", unit(delta_unit)),
                    "Give a smaller delta",
                ));
            }
            by_angle(path, radians(delta), radians(tolerance), all_pairs)?
        }
    };
    if pairs.is_empty() {
        return Err(Error::whole(
            format!("No two of the {} poses are {delta} {} apart", path.len(), unit(delta_unit)),
            "Give a smaller delta, or a larger tolerance",
        ));
    }
    Ok(pairs)
}

fn unit(unit: DeltaUnit) -> &'static str {
    match unit {
        DeltaUnit::Frames => "frames",
        DeltaUnit::Meters => "m",
        DeltaUnit::Seconds => "s",
        DeltaUnit::Degrees => "deg",
        DeltaUnit::Radians => "rad",
    }
}

fn by_index(num_poses: usize, delta: f64, all_pairs: bool) -> Result<Vec<(usize, usize)>> {
    if delta.fract() != 0.0 || delta < 1.0 {
        return Err(Error::whole(format!("delta is {delta} frames"), "Give a whole number from 1"));
    }
    let delta = delta.min(num_poses as f64) as usize;
    let starts = (0..num_poses.saturating_sub(delta)).step_by(if all_pairs { 1 } else { delta.max(1) });
    Ok(starts.map(|i| (i, i + delta)).collect())
}

/// Consecutive pairs: each ends at the first pose that is `delta` or more from its start, where the next one begins.
fn consecutive(steps: impl Iterator<Item = f64>, delta: f64) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    let (mut start, mut travelled) = (0, 0.0);
    for (index, step) in steps.enumerate() {
        travelled += step;
        if travelled >= delta {
            pairs.push((start, index + 1));
            (start, travelled) = (index + 1, 0.0);
        }
    }
    pairs
}

/// Pairs each pose with the later one whose progress, which never decreases, is nearest to `delta` (the first of equally near
/// ones), if it is within the tolerance.
fn all_by_progress(progress: &[f64], delta: f64, tolerance: f64) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for (i, &start) in progress.iter().enumerate() {
        let later = &progress[i + 1..];
        let off = |progress: &f64| (progress - start - delta).abs();
        let beyond = later.partition_point(|&progress| progress - start < delta);
        let before = beyond.checked_sub(1).map(|last| {
            let best = off(&later[last]);
            later[..=last].partition_point(|progress| off(progress) > best)
        });
        let candidates = before.into_iter().chain((beyond < later.len()).then_some(beyond));
        let nearest = candidates.min_by(|&a, &b| off(&later[a]).total_cmp(&off(&later[b])));
        if let Some(j) = nearest.filter(|&j| off(&later[j]) <= tolerance) {
            pairs.push((i, i + 1 + j));
        }
    }
    pairs
}

fn by_time(path: &Path, delta: f64, tolerance: f64, all_pairs: bool) -> Result<Vec<(usize, usize)>> {
    let stamps = path.stamps.as_ref().ok_or_else(|| {
        Error::whole("delta is in seconds, and the poses have no times", "Give delta in frames or metres")
    })?;
    if let Some(index) = stamps.windows(2).position(|pair| pair[1] < pair[0]) {
        let problem = format!("delta is in seconds, and the times go back at pose {}", index + 2);
        return Err(Error::whole(problem, "Sort the poses by time, or give delta in frames or metres"));
    }
    let first = stamps.first().copied().unwrap_or_default();
    let elapsed: Vec<f64> = stamps.iter().map(|stamp| stamp - first).collect();
    if all_pairs {
        return Ok(all_by_progress(&elapsed, delta, tolerance));
    }
    let mut pairs = Vec::new();
    let mut start = 0;
    for (index, &now) in elapsed.iter().enumerate().skip(1) {
        // Unix times in double precision are rounded to 0.24 microseconds.
        if now - elapsed[start] >= delta - 1e-6 {
            pairs.push((start, index));
            start = index;
        }
    }
    Ok(pairs)
}

/// Consecutive pairs by the sum of rotation angles along the path; all pairs by the angle between the two poses.
fn by_angle(path: &Path, delta: f64, tolerance: f64, all_pairs: bool) -> Result<Vec<(usize, usize)>> {
    let rotations = path.rotations.as_ref().ok_or_else(|| {
        Error::whole("delta is an angle, and the poses have no orientations", "Give delta in frames or metres")
    })?;
    if !all_pairs {
        let origin = nalgebra::Vector3::zeros();
        let turn = |pair: &[nalgebra::Matrix3<f64>]| angle(&relative((&pair[0], &origin), (&pair[1], &origin)).0);
        let turns = rotations.windows(2).map(turn).collect::<Result<Vec<f64>>>()?;
        return Ok(consecutive(turns.into_iter(), delta));
    }
    let quaternions: Option<Vec<_>> = rotations.iter().map(nearest_rotation).collect();
    let quaternions = quaternions.ok_or_else(|| Error::whole("A matrix is not a rotation", ""))?;
    let (low, high) = (delta - tolerance, delta + tolerance);
    // |q_i . q_j| = cos(angle / 2) decreases with the angle; the angle itself is computed only near a bound.
    let cosine = |angle: f64| (angle.clamp(0.0, std::f64::consts::PI) / 2.0).cos();
    let (above, below) = (cosine(high) - 1e-9, cosine(low) + 1e-9);
    let mut pairs = Vec::new();
    for (i, q_i) in quaternions.iter().enumerate() {
        for (j, q_j) in quaternions.iter().enumerate().skip(i + 1) {
            let cosine = q_i.coords.dot(&q_j.coords).abs();
            if cosine < above || cosine > below {
                continue;
            }
            let angle = (q_i.inverse() * q_j).angle();
            if low <= angle && angle <= high {
                pairs.push((i, j));
            }
        }
        if pairs.len() > MAX_PAIRS {
            let problem = format!("More than {MAX_PAIRS} pairs of poses are turned against each other by this angle");
            return Err(Error::whole(problem, "Use consecutive pairs, or a smaller tolerance"));
        }
    }
    Ok(pairs)
}
