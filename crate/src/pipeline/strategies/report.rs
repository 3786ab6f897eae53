//! The result of a strategy (map size, time, errors) as plain data, the same for the page, the command line and the API.

use serde::Serialize;

use crate::evaluation::map_quality::MapQuality;
use crate::evaluation::statistics::Statistics;
use crate::odometry::assessment::Status;
use crate::odometry::voxel::VoxelOdometrySettings;
use crate::pipeline::report::SpatialPose;

/// Bytes of a point of the map: three coordinates in double precision, as in NumPy and Open3D. Normals and the index are not
/// counted, since they take the same space per point for every strategy.
pub(crate) const BYTES_A_POINT: usize = 24;

/// One frame of one strategy.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct StrategyFrame {
    /// Name of the file.
    pub name: String,
    /// Index in the recording, from 0.
    pub index: usize,
    /// Pose of the sensor; the world is the frame of the first one. For a lost frame the prediction.
    pub T_world_sensor: SpatialPose,
    /// Assessment of the pose.
    pub status: Status,
    /// Reason for a status other than good; empty otherwise.
    pub reason: String,
    /// Number of points of the frame.
    pub num_points: usize,
    /// Number of points that were registered.
    pub num_source: usize,
    /// Inliers of the last iteration divided by the registered points, 0..=1; 0 for the first frame.
    pub fitness: f64,
    /// Root mean square of their residuals (m).
    pub inlier_rmse: f64,
    /// Number of iterations.
    pub iterations: usize,
    /// Whether the last step was below both limits.
    pub converged: bool,
    /// Largest distance of a pair (m).
    pub threshold: f64,
    /// Number of points added to the map.
    pub num_added: usize,
    /// Number of points of the map after this frame.
    pub map_points: usize,
    /// Size of the map (bytes), 24 per point: three coordinates in double precision, without normals and the index.
    pub map_bytes: usize,
}

/// A straight line through values over the number of the frame, by least squares.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Trend {
    /// Growth of the value per frame.
    pub slope: f64,
    /// Standard error of the slope, from the scatter about the line.
    pub standard_error: f64,
}

impl Trend {
    /// The line through values, one per frame from number 0. `None` with fewer than three.
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

/// Times of the frames, as measured by the caller. The first frame, which is not registered, is left out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct StrategyTiming {
    /// Median (ms).
    pub median: f64,
    /// Time of the last frame (ms).
    pub last: f64,
    /// Sum over all frames (ms).
    pub total: f64,
    /// Growth per frame (ms); null with too few frames.
    pub trend: Option<Trend>,
}

impl StrategyTiming {
    /// From times in milliseconds, one per frame from the first. `None` where no frame was registered.
    pub fn of(milliseconds: &[f64]) -> Option<Self> {
        let registered = milliseconds.get(1..)?;
        let last = *registered.last()?;
        let median = Statistics::of(registered)?.median;
        Some(Self { median, last, total: milliseconds.iter().sum(), trend: Trend::of(registered) })
    }
}

/// Errors against the reference, with the first poses made equal and no other alignment. Lost frames enter with their prediction.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct StrategyErrors {
    /// Number of frames with a partner in the reference.
    pub num_matched: usize,
    /// Mean distance, APE (m).
    pub ape_mean: f64,
    /// Root mean square distance (m).
    pub ape_rmse: f64,
    /// Largest distance (m).
    pub ape_max: f64,
    /// Mean relative translation error from each frame to the next (m); null where the reference has no orientations.
    pub rpe_mean: Option<f64>,
    /// Root mean square of the relative translation error (m).
    pub rpe_rmse: Option<f64>,
    /// Largest relative translation error (m).
    pub rpe_max: Option<f64>,
    /// Mean relative rotation error (rad).
    pub rpe_rotation_mean: Option<f64>,
    /// Distance of each frame (m); null without a partner.
    pub errors: Vec<Option<f64>>,
    /// The reference's poses in the strategy's world.
    pub reference: Vec<Option<SpatialPose>>,
    /// The pose convention of the reference, in words.
    pub convention: String,
}

/// The result of a strategy.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct StrategyResult {
    /// Version of the engine.
    pub version: &'static str,
    /// Its settings.
    pub settings: VoxelOdometrySettings,
    /// One entry per frame, in order.
    pub frames: Vec<StrategyFrame>,
    /// Number of lost frames.
    pub num_lost: usize,
    /// Number of points of the map.
    pub map_points: usize,
    /// Size of the map (bytes), 24 per point: three coordinates in double precision, without normals and the index.
    pub map_bytes: usize,
    /// Growth of the map per frame (points), over the second half of the frames; null with too few.
    pub growth: Option<Trend>,
    /// Times, where they were measured.
    pub timing: Option<StrategyTiming>,
    /// Errors against the reference, where one was given and fits.
    pub comparison: Option<StrategyErrors>,
    /// Sharpness of the frames at the estimated poses, from the same points for every strategy; null with too few points.
    pub sharpness: Option<MapQuality>,
    /// Remarks, in whole sentences.
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
