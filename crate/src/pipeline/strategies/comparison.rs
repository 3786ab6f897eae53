//! Several strategies over the same frames, frame by frame.

use glam::Vec3;

use super::report::{BYTES_A_POINT, StrategyErrors, StrategyFrame, StrategyResult, StrategyTiming, Trend};
use crate::error::{Error, Result};
use crate::evaluation::map_quality::{MapQuality, MapQualityOptions, map_quality};
use crate::evaluation::metrics::{PoseRelation, rpe};
use crate::evaluation::pairs::PairOptions;
use crate::evaluation::path::Path;
use crate::evaluation::statistics::Statistics;
use crate::evaluation::trajectory_error::{EstimatedFrame, POSITIONS_ALONE, TrajectoryError, number_in_name};
use crate::geometry::{PointCloud, Pose3};
use crate::io::intrinsics::Intrinsics;
use crate::io::trajectory::Contents;
use crate::odometry::assessment::Status;
use crate::odometry::voxel::VoxelOdometry;
use crate::odometry::voxel::VoxelOdometrySettings;
use crate::pipeline::prepared_frame::{
    DecodeConfig, FrameLabel, FrameNote, PreparedFrame, Surfaces, merged, set_intrinsics,
};
use crate::pipeline::reference::Reference;
use crate::pipeline::report::SpatialPose;
use crate::pipeline::spatial_settings::{Method, SpatialSettings};

/// Points per frame from which the sharpness is computed, the same for every strategy.
const SHARP_POINTS: usize = 2000;
/// Points that are examined, of those of all frames.
const SHARP_QUERIES: usize = 10_000;

/// Strategies side by side.
///
/// [`begin`](Self::begin) reads the first file and returns the configuration for the preparation of frames. Each prepared frame
/// is [offered](Self::offer), and each strategy that continues [steps](Self::step) once; the caller may measure the time and
/// leave out a strategy that has become too slow. Only one frame is held at a time.
pub struct StrategyComparison {
    settings: SpatialSettings,
    decode_config: Option<DecodeConfig>,
    strategies: Vec<Strategy>,
    current: Option<(FrameLabel, PointCloud)>,
    /// Labels of all frames offered, and a few points of each.
    seen: Vec<(FrameLabel, Vec<Vec3>)>,
    reference: Option<Reference>,
    notes: Vec<FrameNote>,
}

struct Strategy {
    odometry: VoxelOdometry,
    /// Whether the frame on offer was placed.
    has_stepped: bool,
    /// For each of `frames`, its place among those offered.
    places: Vec<usize>,
    frames: Vec<StrategyFrame>,
}

impl StrategyComparison {
    /// A comparison without frames. `settings` define how frames are read: the camera, the depth, the range, and in `voxel_size` the
    /// downsampling before every strategy.
    ///
    /// # Errors
    /// When a setting is out of its limits.
    pub fn new(strategies: Vec<VoxelOdometrySettings>, mut settings: SpatialSettings) -> Result<Self> {
        settings.validate()?;
        settings.method = Method::CloudMap;
        let strategy = |settings: VoxelOdometrySettings| {
            settings.validate()?;
            let odometry = VoxelOdometry::new(settings);
            Ok(Strategy { odometry, has_stepped: true, places: Vec::new(), frames: Vec::new() })
        };
        Ok(Self {
            settings,
            decode_config: None,
            strategies: strategies.into_iter().map(strategy).collect::<Result<_>>()?,
            current: None,
            seen: Vec::new(),
            reference: None,
            notes: Vec::new(),
        })
    }

    /// Sets camera and depth scale from a file beside the images, unless the settings have them.
    ///
    /// # Errors
    /// After [`begin`](Self::begin): frames have been prepared with another camera.
    pub fn set_intrinsics(&mut self, intrinsics: Intrinsics) -> Result<()> {
        set_intrinsics(&mut self.settings, self.decode_config.as_ref(), intrinsics)
    }

    /// Reads the first file, a depth image or a cloud, given as its bytes, and returns the configuration for the preparation of
    /// frames. Only the first call has an effect.
    ///
    /// # Errors
    /// When it is neither, holds nothing, or the settings make no camera.
    pub fn begin(&mut self, name: &str, first: &[u8]) -> Result<&DecodeConfig> {
        let decode_config = match self.decode_config.take() {
            Some(known) => known,
            None => DecodeConfig::new(&self.settings, name, first)?.with_whole_clouds(),
        };
        let (spacing, is_camera) = (decode_config.settings.voxel_size, decode_config.depth.is_some());
        self.strategies.iter_mut().for_each(|strategy| strategy.odometry.expect_frames(spacing, is_camera));
        Ok(self.decode_config.insert(decode_config))
    }

    /// Offers the next frame to every strategy.
    ///
    /// # Errors
    /// When it comes before the last one in the recording, or was prepared for something else.
    pub fn offer(&mut self, frame: PreparedFrame) -> Result<()> {
        let PreparedFrame { label, surfaces, notes, .. } = frame;
        let Surfaces::Cloud(cloud) = surfaces else {
            let problem = "The frame was not prepared for a comparison of strategies";
            return Err(Error::whole(problem, "Prepare it with what begin returned").in_file(&label.name));
        };
        label.check_order(self.seen.last().map(|(last, _)| last.index))?;
        self.notes.extend(notes);
        let stride = cloud.len().div_ceil(SHARP_POINTS).max(1);
        self.seen.push((label.clone(), cloud.positions.iter().copied().step_by(stride).collect()));
        self.current = Some((label, cloud));
        self.strategies.iter_mut().for_each(|strategy| strategy.has_stepped = false);
        Ok(())
    }

    /// Registers the offered frame by one strategy. `None` where there is no such strategy, or it has already registered that frame.
    pub fn step(&mut self, strategy: usize) -> Option<&StrategyFrame> {
        let (label, cloud) = self.current.as_ref()?;
        let strategy = self.strategies.get_mut(strategy).filter(|strategy| !strategy.has_stepped)?;
        strategy.has_stepped = true;
        let estimate = strategy.odometry.register_frame(cloud);
        let registration = estimate.registration.as_ref();
        let map_points = strategy.odometry.map().points().len();
        strategy.places.push(self.seen.len() - 1);
        strategy.frames.push(StrategyFrame {
            name: label.name.clone(),
            index: label.index,
            T_world_sensor: estimate.T_world_sensor.into(),
            status: estimate.status,
            reason: estimate.reason,
            num_points: cloud.len(),
            num_source: estimate.num_source,
            fitness: registration.map_or(0.0, |r| r.fitness),
            inlier_rmse: registration.map_or(0.0, |r| r.last.inlier_rmse),
            iterations: registration.map_or(0, |r| r.history.len()),
            converged: registration.is_none_or(|r| r.converged),
            threshold: estimate.threshold,
            num_added: estimate.num_added,
            map_points,
            map_bytes: BYTES_A_POINT * map_points,
        });
        strategy.frames.last()
    }

    /// Sets the trajectory to compare with; it is used for nothing else. `num_recorded` is the number of frames of the
    /// recording, whether they could be used or not. The convention of its poses is derived from the data, or set.
    pub fn set_reference(&mut self, name: &str, contents: Contents, num_recorded: usize) {
        self.reference = Some(Reference { name: name.to_owned(), contents, num_recorded });
    }

    /// Number of strategies.
    pub fn len(&self) -> usize {
        self.strategies.len()
    }

    /// Whether there is no strategy.
    pub fn is_empty(&self) -> bool {
        self.strategies.is_empty()
    }

    /// The result of a strategy so far, with the times of its frames (ms) that the caller has measured. `None` where there is no such
    /// strategy.
    pub fn result(&self, strategy: usize, milliseconds: &[f64]) -> Option<StrategyResult> {
        let Strategy { odometry, frames, places, .. } = self.strategies.get(strategy)?;
        let mut notes = merged(&self.notes);
        let comparison = self.reference.as_ref().filter(|_| !frames.is_empty()).and_then(|reference| {
            let errors = self.compare(frames, places, reference);
            errors.map_err(|error| notes.push(error.in_file(&reference.name).to_string())).ok()
        });
        let map_points = odometry.map().points().len();
        let later: Vec<f64> = frames[frames.len() / 2..].iter().map(|frame| frame.map_points as f64).collect();
        Some(StrategyResult {
            version: env!("CARGO_PKG_VERSION"),
            settings: odometry.settings().clone(),
            num_lost: frames.iter().filter(|frame| frame.status == Status::Lost).count(),
            map_points,
            map_bytes: BYTES_A_POINT * map_points,
            growth: Trend::of(&later),
            timing: StrategyTiming::of(milliseconds),
            comparison,
            sharpness: self.sharpness(frames, places),
            frames: frames.clone(),
            notes,
        })
    }

    /// The map of a strategy with its normals, not finite where unknown. `None` where there is no such strategy.
    pub fn map(&self, strategy: usize) -> Option<PointCloud> {
        let map = self.strategies.get(strategy)?.odometry.map();
        let single = |v: &nalgebra::Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        Some(PointCloud {
            positions: map.points().iter().map(single).collect(),
            normals: Some(map.normals().iter().map(|n| n.as_ref().map_or(Vec3::NAN, single)).collect()),
            ..PointCloud::default()
        })
    }

    /// The poses that a strategy found, with the times of their frames where all have one.
    pub fn trajectory(&self, strategy: usize) -> Option<(Option<Vec<f64>>, Vec<Pose3>)> {
        let Strategy { frames, places, .. } = self.strategies.get(strategy)?;
        let times = places.iter().map(|&place| self.seen[place].0.time).collect();
        Some((times, frames.iter().map(|frame| Pose3::from(frame.T_world_sensor)).collect()))
    }

    fn compare(&self, frames: &[StrategyFrame], places: &[usize], reference: &Reference) -> Result<StrategyErrors> {
        let estimated: Vec<EstimatedFrame> = frames
            .iter()
            .zip(places)
            .map(|(frame, &place)| EstimatedFrame {
                index: frame.index,
                number: number_in_name(&self.seen[place].0.name),
                time: self.seen[place].0.time,
                T_world_sensor: Some(frame.T_world_sensor.into()),
                is_good: true,
            })
            .collect();
        let error = reference.error(&estimated, self.settings.known_convention())?;
        let relative =
            (!error.convention.starts_with(POSITIONS_ALONE)).then(|| relative_errors(&estimated, &error)).flatten();
        let (moved, turned) = relative.unzip();
        Ok(StrategyErrors {
            num_matched: error.num_matched,
            ape_mean: error.mean,
            ape_rmse: error.rmse,
            ape_max: error.max,
            rpe_mean: moved.as_ref().map(|moved| moved.mean),
            rpe_rmse: moved.as_ref().map(|moved| moved.rmse),
            rpe_max: moved.as_ref().map(|moved| moved.max),
            rpe_rotation_mean: turned.map(|turned| turned.mean),
            errors: error.errors,
            reference: error.reference.into_iter().map(|pose| pose.map(SpatialPose::from)).collect(),
            convention: error.convention,
        })
    }

    fn sharpness(&self, frames: &[StrategyFrame], places: &[usize]) -> Option<MapQuality> {
        let mut points = Vec::new();
        for (frame, &place) in frames.iter().zip(places).filter(|(frame, _)| frame.status != Status::Lost) {
            let T = Pose3::from(frame.T_world_sensor);
            let placed = |point: &Vec3| {
                let moved = T * nalgebra::Point3::from(point.as_dvec3().to_array());
                [moved.x as f32, moved.y as f32, moved.z as f32]
            };
            points.extend(self.seen[place].1.iter().map(placed));
        }
        map_quality(&points, &MapQualityOptions { max_points: SHARP_QUERIES, ..MapQualityOptions::default() }).ok()
    }
}

/// Relative errors from each frame with a partner to the next one: translation (m) and rotation (rad).
fn relative_errors(estimated: &[EstimatedFrame], error: &TrajectoryError<Pose3>) -> Option<(Statistics, Statistics)> {
    let pairs: Vec<(Pose3, Pose3)> = estimated
        .iter()
        .zip(&error.reference)
        .filter_map(|(frame, partner)| Some((frame.T_world_sensor?, (*partner)?)))
        .collect();
    let path = |poses: &mut dyn Iterator<Item = Pose3>| {
        let (positions, rotations) =
            poses.map(|pose| (pose.translation.vector, pose.rotation.to_rotation_matrix().into_inner())).unzip();
        Path { positions, rotations: Some(rotations), stamps: None }
    };
    let (estimate, reference) =
        (path(&mut pairs.iter().map(|pair| pair.0)), path(&mut pairs.iter().map(|pair| pair.1)));
    let of = |relation| {
        let errors = rpe(&reference, &estimate, relation, &PairOptions::default()).ok()?;
        Statistics::of(&errors.errors)
    };
    Some((of(PoseRelation::TranslationPart)?, of(PoseRelation::RotationAngleRad)?))
}
