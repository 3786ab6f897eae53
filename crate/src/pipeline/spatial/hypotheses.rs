//! The run itself, once for each possible quantisation of the depth, until the data decide.

use super::azimuth_times::AzimuthTimes;
use super::focal_length::FocalLength;
use crate::error::Result;
use crate::geometry::{PointCloud, Pose3};
use crate::graph::loops::clouds::CloudLoops;
use crate::graph::loops::spatial::{FrameMotions, LoopReport, SpatialLoops};
use crate::odometry::assessment::Status;
use crate::odometry::cloud::{CloudEstimate, CloudOdometry, Guess, PreparedCloud, SweepEstimate, SweepOdometry};
use crate::odometry::depth::{DepthOdometry, DepthOptions, PoseUpdate, SpatialEstimate, UnresolvedFrames};
use crate::pipeline::prepared_frame::{DecodeConfig, PreparedFrame, Surfaces};
use crate::pipeline::spatial_settings::{LoopClosing, Method, Quantisation};
use crate::preprocess::azimuth_clock::AzimuthClock;
use crate::registration::free_space::DepthNoise;
use crate::registration::prepared_surfels::PreparedSurfels;
use nalgebra::{Vector3, Vector6};

/// Registered frames that decide how depth was rounded, at the latest. In 83 runs of 8 bits the wrong reading has 1.04 to 3 times the misfit of
/// the other then (docs/measurements/depth_ablations.md).
const DECIDING_FRAMES: usize = 12;
/// Truncated depth, which is what a cast to a whole number gives, is taken for rounded where that fits better by this ratio
/// of the misfits. Half a step too near makes a room that turns about the camera bend; recordings that hardly turn leave
/// it open.
const DECIDING_RATIO: f64 = 1.05;

/// One run, or two while it is open whether depth was rounded or truncated; none before the first frame was looked at.
#[derive(Default)]
pub(super) struct Hypotheses(Vec<QuantisationHypothesis>);

impl Hypotheses {
    /// One for each way of reading that the first frame leaves open.
    pub(super) fn new(config: &DecodeConfig) -> Result<Self> {
        let quantisations = config.depth.as_ref().map_or(&[Quantisation::Rounded][..], |depth| &depth.quantisations);
        let hypotheses = quantisations.iter().map(|&quantisation| QuantisationHypothesis::new(quantisation, config));
        Ok(Self(hypotheses.collect::<Result<_>>()?))
    }

    /// Registers a frame and closes the loops that it completes. Drops the reading that fits worse, once enough frames have
    /// been registered, and returns the one that is left.
    pub(super) fn register(&mut self, frame: &PreparedFrame) -> Option<Quantisation> {
        for hypothesis in &mut self.0 {
            hypothesis.add(frame);
            hypothesis.close_loops();
        }
        let best = self.best_index();
        if let Some(best) = self.0.get_mut(best) {
            best.focal_length.compare();
        }
        if !self.is_decided() {
            return None;
        }
        self.0.swap(0, best);
        self.0.truncate(1);
        self.best().map(|hypothesis| hypothesis.quantisation)
    }

    /// Velocities of the sensor during sweeps (see [`SweepEstimate`]), by the number of the frame, that have been found since the last
    /// call.
    pub(super) fn take_velocities(&mut self) -> Vec<(usize, Vector6<f64>)> {
        self.0.first_mut().map(|hypothesis| std::mem::take(&mut hypothesis.velocities)).unwrap_or_default()
    }

    /// What was done about the motion of the sensor during sweeps, and what became of a gyroscope, in whole sentences.
    pub(super) fn notes_on_sweeps(&self) -> Vec<String> {
        let Some(best) = self.best() else { return Vec::new() };
        let of_sweeps = if let Odometry::Sweep(odometry) = &best.odometry { odometry.notes() } else { Vec::new() };
        best.azimuth_times.note().into_iter().chain(of_sweeps).collect()
    }

    /// By which clouds without times are straightened, if they are.
    pub(super) fn azimuth_clock(&self) -> Option<AzimuthClock> {
        match self.0.first()?.azimuth_times {
            AzimuthTimes::Confirmed(clock) => Some(clock),
            _ => None,
        }
    }

    /// Tries one of the frames again that were not found; whether there may be more.
    #[inline(never)]
    pub(super) fn relocalize_next(&mut self) -> bool {
        let best = self.best_index();
        self.0.get_mut(best).is_some_and(QuantisationHypothesis::relocalize_next)
    }

    /// Closes the last loop, after which no frame follows.
    #[inline(never)]
    pub(super) fn finish(&mut self) {
        for hypothesis in &mut self.0 {
            hypothesis.loops.iter_mut().for_each(SpatialLoops::finish);
            hypothesis.cloud_loops.iter_mut().for_each(CloudLoops::finish);
            hypothesis.close_loops();
        }
    }

    /// What the frames say of the focal length that was assumed.
    pub(super) fn focal_length(&self) -> Option<&FocalLength> {
        self.best().map(|hypothesis| &hypothesis.focal_length)
    }

    /// The one that fits better so far.
    pub(super) fn best(&self) -> Option<&QuantisationHypothesis> {
        self.0.get(self.best_index())
    }

    /// Whether the colours are not those of the depth's pixels.
    pub(super) fn have_misaligned_colors(&self) -> bool {
        let odometry = self.best().map(|hypothesis| &hypothesis.odometry);
        matches!(odometry, Some(Odometry::Depth(odometry)) if odometry.has_misaligned_colors())
    }

    /// The frames with uncertain positions that no later frame has resolved.
    pub(super) fn unresolved(&self) -> Option<UnresolvedFrames> {
        match &self.best()?.odometry {
            Odometry::Depth(odometry) => odometry.unresolved(),
            Odometry::Cloud(_) | Odometry::Sweep(_) => None,
        }
    }

    /// Numbers of the clouds outside the largest set of clouds that are certain relative to each other.
    pub(super) fn outside_majority(&self) -> Vec<usize> {
        let Some(hypothesis) = self.best() else { return Vec::new() };
        let are_inside = match &hypothesis.odometry {
            Odometry::Depth(_) => return Vec::new(),
            Odometry::Cloud(odometry) => odometry.are_in_largest_part(),
            Odometry::Sweep(odometry) => odometry.are_in_largest_part(),
        };
        let registered = (0..).zip(&hypothesis.estimates).filter(|(_, estimate)| estimate.is_in_map);
        registered.zip(are_inside).filter(|(_, is_inside)| !is_inside).map(|((number, _), _)| number).collect()
    }

    /// Whether a frame fitted about as well at another position within reach of the sensor.
    pub(super) fn surfaces_repeat(&self) -> bool {
        let odometry = self.best().map(|hypothesis| &hypothesis.odometry);
        matches!(odometry, Some(Odometry::Depth(odometry)) if odometry.surfaces_repeat())
    }

    /// Whether enough frames have been registered, or one reading fits better by so much that its likelihood exceeds the other's by as much as
    /// that many frames would let it at the least ratio (Wald, "Sequential tests of statistical hypotheses", 1945).
    fn is_decided(&self) -> bool {
        let [first, others @ ..] = &self.0[..] else { return false };
        let num_registered = first.num_registered as f64;
        // Misfits are sums: those of as many frames.
        let other = others.first().filter(|other| other.num_registered == first.num_registered);
        let log_ratio = other.map_or(0.0, |other| (first.misfit / other.misfit).ln().abs());
        let most = DECIDING_FRAMES as f64;
        num_registered >= most || num_registered * log_ratio > most * DECIDING_RATIO.ln()
    }

    fn best_index(&self) -> usize {
        match &self.0[..] {
            [truncated, rounded] if truncated.misfit > DECIDING_RATIO * rounded.misfit => 1,
            _ => 0,
        }
    }
}

/// A run with one way of reading the depth. Clouds have one.
pub(super) struct QuantisationHypothesis {
    pub quantisation: Quantisation,
    odometry: Odometry,
    pub estimates: Vec<SpatialEstimate>,
    loops: Option<SpatialLoops>,
    cloud_loops: Option<CloudLoops>,
    azimuth_times: AzimuthTimes,
    /// Velocities of the sensor during sweeps, by the number of the frame, that have been found since they were last taken.
    velocities: Vec<(usize, Vector6<f64>)>,
    focal_length: FocalLength,
    /// Sum over the registered frames of the mean square residual over the mean square depth: a reading that makes
    /// everything smaller makes the residuals smaller, too.
    misfit: f64,
    num_registered: usize,
}

enum Odometry {
    Depth(Box<DepthOdometry>),
    Cloud(Box<CloudOdometry>),
    Sweep(Box<SweepOdometry>),
}

impl Odometry {
    /// A motion of the odometry's world as one of the world of the poses.
    fn of_poses(&self, motion: &Pose3) -> Pose3 {
        match self {
            Self::Depth(_) | Self::Cloud(_) => *motion,
            Self::Sweep(odometry) => odometry.of_poses(motion),
        }
    }
}

impl QuantisationHypothesis {
    fn new(quantisation: Quantisation, config: &DecodeConfig) -> Result<Self> {
        let settings = &config.settings;
        let noise = DepthNoise { square_noise: config.depth.as_ref().map_or(0.0, |depth| depth.square_noise) };
        let odometry = match settings.method {
            Method::SurfelMap => {
                Odometry::Depth(Box::new(DepthOdometry::new(DepthOptions { noise, ..settings.depth_options() })))
            }
            _ if config.cloud.as_ref().is_some_and(|cloud| cloud.clock.is_some() || cloud.has_gyro) => {
                Odometry::Sweep(Box::new(SweepOdometry::new(config.cloud_options())?))
            }
            _ => Odometry::Cloud(Box::new(CloudOdometry::new(config.cloud_options())?)),
        };
        let is_closing = |method| settings.method == method && settings.loop_closing == LoopClosing::On;
        Ok(Self {
            quantisation,
            odometry,
            estimates: Vec::new(),
            loops: is_closing(Method::SurfelMap).then(|| SpatialLoops::new(settings.motion)),
            cloud_loops: is_closing(Method::CloudMap).then(|| CloudLoops::new(config.cloud_options())),
            azimuth_times: AzimuthTimes::new(config),
            velocities: Vec::new(),
            focal_length: FocalLength::new(config),
            misfit: 0.0,
            num_registered: 0,
        })
    }

    fn add(&mut self, frame: &PreparedFrame) {
        let estimate = match &frame.surfaces {
            Surfaces::Surfels(images) => self.register_image(images),
            Surfaces::Cloud(cloud) => self.register_cloud(cloud, frame),
        };
        let Some(mut estimate) = estimate else { return };
        if let Some(registration) = &mut estimate.registration {
            // The bulk of a result, and nobody asks for it.
            registration.correspondences = Vec::new();
        }
        self.estimates.push(estimate);
    }

    fn register_image(&mut self, images: &[(Quantisation, PreparedSurfels)]) -> Option<SpatialEstimate> {
        // Preparation, which knows the method, makes no image for another odometry.
        let Odometry::Depth(odometry) = &mut self.odometry else { return None };
        let (_, surfels) = images.iter().find(|(quantisation, _)| *quantisation == self.quantisation)?;
        let estimate = odometry.register_frame(surfels);
        apply_pose_updates_of(odometry, &mut self.estimates, self.loops.as_mut());
        if let Some(loops) = &mut self.loops {
            loops.add(self.estimates.len() as u32, surfels, &estimate);
        }
        self.focal_length.record(surfels, &estimate);
        // Frames outside the map say nothing of the quantisation.
        if let Some(registration) = estimate.registration.as_ref().filter(|_| estimate.is_in_map) {
            let sq_depth = surfels.image.mean_square_depth().max(f64::MIN_POSITIVE);
            self.misfit += registration.last.inlier_rmse.powi(2) / sq_depth;
            self.num_registered += 1;
        }
        Some(estimate)
    }

    #[inline(never)]
    fn register_cloud(&mut self, cloud: &PointCloud, frame: &PreparedFrame) -> Option<SpatialEstimate> {
        let stamp = frame.label.time;
        let estimate = match &mut self.odometry {
            Odometry::Depth(_) => return None,
            Odometry::Cloud(odometry) => odometry.register_frame(PreparedCloud::from_cloud(cloud.clone())),
            Odometry::Sweep(odometry) => {
                odometry.add_gyro(&readings_of(frame));
                let mut cloud = cloud.clone();
                if let AzimuthTimes::Confirmed(clock) = &self.azimuth_times {
                    cloud.times = Some(clock.times(&cloud.positions));
                }
                let SweepEstimate { estimate, velocities, earlier } = odometry.register_sweep(cloud, stamp);
                self.velocities.extend(velocities);
                for (number, pose) in earlier {
                    self.estimates[number].T_world_sensor = pose;
                }
                estimate
            }
        };
        let mut estimate = of_cloud(estimate);
        self.add_to_cloud_loops(&mut estimate);
        self.test_azimuth(stamp, &estimate);
        Some(estimate)
    }

    /// Adds the cloud that was registered last to those among which loops are closed, and corrects its pose by these.
    fn add_to_cloud_loops(&mut self, estimate: &mut SpatialEstimate) {
        let Some(loops) = &mut self.cloud_loops else { return };
        let registered = match &self.odometry {
            Odometry::Depth(_) => None,
            Odometry::Cloud(odometry) => odometry.last_registered(),
            Odometry::Sweep(odometry) => odometry.last_registered(),
        };
        if let Some(registered) = registered.filter(|_| estimate.is_in_map) {
            loops.add(self.estimates.len() as u32, &registered);
        }
        estimate.T_world_sensor = self.odometry.of_poses(&loops.correction()) * estimate.T_world_sensor;
    }

    /// Tests whether a cloud without times is bent as its azimuth would have it; goes on with straightened ones where that is so.
    fn test_azimuth(&mut self, stamp: Option<f64>, estimate: &SpatialEstimate) {
        let (AzimuthTimes::Open(guess, options), Odometry::Cloud(odometry)) =
            (&mut self.azimuth_times, &mut self.odometry)
        else {
            return;
        };
        let number = self.estimates.len();
        let Some(registered) = odometry.last_registered().filter(|_| estimate.assessment.status == Status::Good) else {
            return;
        };
        match guess.add((number, stamp), &registered, options) {
            Guess::Open => {}
            Guess::Dropped(is_refuted) => self.azimuth_times = AzimuthTimes::Dropped { is_refuted },
            Guess::Confirmed(clock, velocities) => {
                let mut last = registered.cloud.cloud().clone();
                last.times = Some(clock.times(&last.positions));
                let velocity = velocities.last().map(|(_, velocity)| *velocity).unwrap_or_default();
                let Ok(empty) = CloudOdometry::new(**options) else { return };
                let clouds = std::mem::replace(&mut **odometry, empty);
                let Ok(resumed) = SweepOdometry::resumed(clouds, (last, stamp), velocity, number + 1) else { return };
                self.odometry = Odometry::Sweep(Box::new(resumed));
                self.velocities = velocities;
                self.azimuth_times = AzimuthTimes::Confirmed(clock);
            }
        }
    }

    /// Moves all frames, and what they have shown, to where open loops want them.
    fn close_loops(&mut self) {
        let of_depth = self.loops.as_mut().and_then(SpatialLoops::close);
        let Some(motions) = of_depth.or_else(|| self.close_cloud_loops()) else { return };
        let motion_of = |frame: u32| {
            let place = motions.partition_point(|(first, _)| *first <= frame);
            place.checked_sub(1).map_or_else(Pose3::identity, |place| motions[place].1)
        };
        for (frame, estimate) in (0..).zip(&mut self.estimates) {
            estimate.T_world_sensor = motion_of(frame) * estimate.T_world_sensor;
        }
        if let Odometry::Depth(odometry) = &mut self.odometry {
            odometry.apply_corrections(motion_of);
        }
    }

    #[inline(never)]
    fn close_cloud_loops(&mut self) -> Option<FrameMotions> {
        let loops = self.cloud_loops.as_mut()?;
        let motions = loops.close()?;
        for clouds in loops.connections() {
            match &mut self.odometry {
                Odometry::Depth(_) => {}
                Odometry::Cloud(odometry) => odometry.connect(clouds),
                Odometry::Sweep(odometry) => odometry.connect(clouds),
            }
        }
        Some(motions.into_iter().map(|(frame, motion)| (frame, self.odometry.of_poses(&motion))).collect())
    }

    /// The loops that have been closed.
    pub(super) fn loop_report(&self) -> LoopReport {
        let of_clouds = self.cloud_loops.as_ref().map(CloudLoops::report);
        self.loops.as_ref().map(SpatialLoops::report).or(of_clouds).unwrap_or_default()
    }

    /// Tries one of the frames again that were not found; whether there may be more.
    fn relocalize_next(&mut self) -> bool {
        let Odometry::Depth(odometry) = &mut self.odometry else { return false };
        let is_more = odometry.relocalize_next();
        apply_pose_updates_of(odometry, &mut self.estimates, self.loops.as_mut());
        is_more
    }
}

/// What a gyroscope measured around a frame, by the clock of the frames.
fn readings_of(frame: &PreparedFrame) -> Vec<(f64, Vector3<f64>)> {
    let Some(stamp) = frame.label.time else { return Vec::new() };
    frame.gyro.iter().map(|&[time, x, y, z]| (stamp + time, Vector3::new(x, y, z))).collect()
}

fn of_cloud(estimate: CloudEstimate) -> SpatialEstimate {
    let CloudEstimate { T_world_sensor, registration, overlap, assessment, .. } = estimate;
    let is_in_map = assessment.status != Status::Lost;
    SpatialEstimate { T_world_sensor, registration, overlap, assessment, covariance: None, is_in_map }
}

/// What has been found out of frames before the last one.
fn apply_pose_updates_of(
    odometry: &mut DepthOdometry,
    estimates: &mut [SpatialEstimate],
    loops: Option<&mut SpatialLoops>,
) {
    let pose_updates = odometry.take_pose_updates();
    if pose_updates.is_empty() {
        return;
    }
    let is_another_chain = pose_updates.iter().any(|update| update.is_replaced);
    for PoseUpdate { frame, T_world_sensor, assessment, registered, .. } in pose_updates {
        let Some(estimate) = estimates.get_mut(frame as usize) else { continue };
        let is_in_map = estimate.is_in_map;
        if let Some(registered) = registered {
            *estimate = SpatialEstimate { is_in_map, ..*registered };
            estimate.registration.iter_mut().for_each(|registration| registration.correspondences = Vec::new());
        }
        (estimate.T_world_sensor, estimate.assessment) = (T_world_sensor, assessment);
    }
    match loops {
        Some(loops) if is_another_chain => loops.clear(),
        Some(loops) => loops.apply_pose_updates(|frame| estimates[frame as usize].T_world_sensor),
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::spatial_settings::SpatialSettings;

    /// After so many frames, of which truncated depth has this many times the misfit of rounded depth.
    fn after(num_registered: usize, ratio: f64) -> Hypotheses {
        let image = [b"P5 64 48 255\n".as_slice(), &[100; 64 * 48]].concat();
        let config = DecodeConfig::new(&SpatialSettings::default(), "0.pgm", &image).unwrap();
        let mut hypotheses = Hypotheses::new(&config).unwrap();
        assert_eq!(hypotheses.0.len(), 2);
        for (hypothesis, misfit) in hypotheses.0.iter_mut().zip([ratio, 1.0]) {
            (hypothesis.misfit, hypothesis.num_registered) = (misfit * num_registered as f64, num_registered);
        }
        hypotheses
    }

    /// Which of the two readings is left then.
    fn decided(num_registered: usize, ratio: f64) -> Option<Quantisation> {
        let hypotheses = after(num_registered, ratio);
        hypotheses.is_decided().then(|| hypotheses.best().unwrap().quantisation)
    }

    #[test]
    fn how_depth_was_rounded_is_decided_once_one_reading_fits_better_by_enough() {
        use Quantisation::{Rounded, Truncated};
        assert_eq!(decided(0, 2.0), None);
        assert_eq!([1.7, 1.9, 0.6, 0.5].map(|ratio| decided(1, ratio)), [None, Some(Rounded), None, Some(Truncated)]);
        assert_eq!([1.2, 1.25, 0.85, 0.8].map(|ratio| decided(3, ratio)), [None, Some(Rounded), None, Some(Truncated)]);
        assert_eq!([1.0, 1.04, 1.06].map(|ratio| decided(11, ratio)), [None, None, Some(Rounded)]);
        assert_eq!([1.0, 1.04].map(|ratio| decided(12, ratio)), [Some(Truncated); 2], "at the latest");
    }

    #[test]
    fn a_reading_by_which_fewer_frames_are_registered_does_not_fit_better() {
        let mut hypotheses = after(6, 1.0);
        (hypotheses.0[1].misfit, hypotheses.0[1].num_registered) = (2.0, 2);
        assert!(!hypotheses.is_decided());
    }
}
