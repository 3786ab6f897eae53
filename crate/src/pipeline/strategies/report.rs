//! What a strategy cost and gained, as plain data, the same for the page, the command line and the API.

use serde::Serialize;

use crate::evaluation::map_quality::MapQuality;
use crate::odometry::assessment::Status;
use crate::odometry::voxel::VoxelOdometrySettings;
use crate::pipeline::report::SpatialPose;

/// What a point of the map counts for: three coordinates in double precision, as NumPy and Open3D hold a cloud. Normals
/// and the index come on top and are not counted: they are the same for every strategy, point by point.
pub(crate) const BYTES_A_POINT: usize = 24;

/// One frame of one strategy.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct StrategyFrame {
    /// Name of the file.
    pub name: String,
    /// Its place in the recording, counted from 0.
    pub index: usize,
    /// Pose of the sensor; the world is the frame of the first one. Of a lost frame, what was predicted.
    pub T_world_sensor: SpatialPose,
    /// How far it is to be trusted.
    pub status: Status,
    /// Why it is not good; empty when it is.
    pub reason: String,
    /// Points of the frame.
    pub num_points: usize,
    /// Those of them that were registered.
    pub num_source: usize,
    /// Pairs that counted in the last iteration, over the points that were registered; 0 for the first frame.
    pub fitness: f64,
    /// Root mean square of their residuals (m).
    pub inlier_rmse: f64,
    /// Iterations.
    pub iterations: usize,
    /// Whether the last step was below both limits.
    pub converged: bool,
    /// Partners were looked for within this distance (m).
    pub threshold: f64,
    /// Points that the map took.
    pub num_added: usize,
    /// Points of the map after it.
    pub map_points: usize,
    /// Bytes of them, 24 a point: three coordinates in double precision. Normals and the index are not counted.
    pub map_bytes: usize,
}

/// A straight line through values over the number of the frame, by least squares.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Trend {
    /// By how much a value grows from one frame to the next.
    pub slope: f64,
    /// Standard error of the slope, from the scatter about the line.
    pub standard_error: f64,
}

impl Trend {
    /// Of values, one a frame from number 0 on. `None` with fewer than three.
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.len() < 3 {
            return None;
        }
        let n = values.len() as f64;
        let (mean_x, mean_y) = ((n - 1.0) / 2.0, values.iter().sum::<f64>() / n);
        let centered = || (0..values.len()).map(|i| i as f64 - mean_x).zip(values.iter().map(|y| y - mean_y));
        let sxx: f64 = centered().map(|(x, _)| x * x).sum();
        let slope = centered().map(|(x, y)| x * y).sum::<f64>() / sxx;
        let residuals: f64 = centered().map(|(x, y)| (y - slope * x).powi(2)).sum();
        Some(Self { slope, standard_error: (residuals / (n - 2.0) / sxx).sqrt() })
    }
}

/// How long the frames took, as the caller measured it. The first frame, which is registered to nothing, does not count.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct StrategyTiming {
    /// Of half the frames it was less (ms).
    pub median: f64,
    /// The last frame (ms).
    pub last: f64,
    /// All frames (ms).
    pub total: f64,
    /// Growth from frame to frame (ms a frame); null with too few frames.
    pub trend: Option<Trend>,
}

impl StrategyTiming {
    /// Of milliseconds, one a frame from the first one on. `None` where no frame was registered.
    pub fn of(milliseconds: &[f64]) -> Option<Self> {
        let registered = milliseconds.get(1..)?;
        let last = *registered.last()?;
        let mut sorted = registered.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        let median =
            if sorted.len() % 2 == 1 { sorted[middle] } else { f64::midpoint(sorted[middle - 1], sorted[middle]) };
        Some(Self { median, last, total: milliseconds.iter().sum(), trend: Trend::of(registered) })
    }
}

/// Errors against the truth, first poses made equal, no other alignment. Lost frames count with what was predicted.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct StrategyErrors {
    /// Frames with a partner in the reference.
    pub num_matched: usize,
    /// Mean distance, APE (m).
    pub ape_mean: f64,
    /// Root mean square distance (m).
    pub ape_rmse: f64,
    /// Largest distance (m).
    pub ape_max: f64,
    /// Relative error from each frame to the next (m), mean; null where the reference has positions alone.
    pub rpe_mean: Option<f64>,
    /// Root mean square of it (m).
    pub rpe_rmse: Option<f64>,
    /// Largest (m).
    pub rpe_max: Option<f64>,
    /// The same of the turns (rad), mean.
    pub rpe_rotation_mean: Option<f64>,
    /// Distance of each frame (m); null without a partner.
    pub errors: Vec<Option<f64>>,
    /// The reference's poses in the strategy's world.
    pub reference: Vec<Option<SpatialPose>>,
    /// How the reference's poses were read, in words.
    pub convention: String,
}

/// Everything that is known of a strategy.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct StrategyResult {
    /// Version of the engine.
    pub version: &'static str,
    /// Its settings.
    pub settings: VoxelOdometrySettings,
    /// One entry a frame, in their order.
    pub frames: Vec<StrategyFrame>,
    /// Frames that could not be placed.
    pub num_lost: usize,
    /// Points of the map.
    pub map_points: usize,
    /// Bytes of them, 24 a point: three coordinates in double precision. Normals and the index are not counted.
    pub map_bytes: usize,
    /// Growth of the map from frame to frame (points a frame), over the second half of the frames; null with too few.
    pub growth: Option<Trend>,
    /// How long it took, where that was measured.
    pub timing: Option<StrategyTiming>,
    /// Errors against the reference, where one was given and fits.
    pub comparison: Option<StrategyErrors>,
    /// Sharpness of the frames at the estimated poses, from the same points for every strategy; null where the points are too
    /// few to tell.
    pub sharpness: Option<MapQuality>,
    /// What else is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_its_slope_and_scatter_makes_it_uncertain() {
        let line: Vec<f64> = (0..20).map(|i| 3.0 + 0.5 * f64::from(i)).collect();
        let trend = Trend::of(&line).unwrap();
        assert!((trend.slope - 0.5).abs() < 1e-12 && trend.standard_error < 1e-12);
        // 1, 2, 4: slope 3/2, residuals 1/6, -1/3, 1/6, so s^2 = 1/6 and the error sqrt(1/6 / 2).
        let trend = Trend::of(&[1.0, 2.0, 4.0]).unwrap();
        assert!((trend.slope - 1.5).abs() < 1e-12 && (trend.standard_error - (1.0_f64 / 12.0).sqrt()).abs() < 1e-12);
        assert_eq!(Trend::of(&[1.0, 2.0]), None);
    }

    #[test]
    fn the_first_frame_does_not_count_for_the_time() {
        let timing = StrategyTiming::of(&[100.0, 1.0, 2.0, 6.0, 3.0]).unwrap();
        assert_eq!((timing.median, timing.last, timing.total), (2.5, 3.0, 112.0));
        assert_eq!(StrategyTiming::of(&[100.0]), None);
        assert_eq!(StrategyTiming::of(&[]), None);
    }
}
