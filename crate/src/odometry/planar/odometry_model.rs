//! What is known of a robot's odometry: one list of its steps with what the scans make of them. From it follow the size of the
//! odometry's metre, its noise, the share of its steps that are wrong, and where it and the scans contradict each other, by one
//! squared Mahalanobis distance.

mod gaps;
mod isolated;

use nalgebra::{Matrix3, Vector3};

use super::belief::Finding;
use super::information::{chained, seen_from, sigmas, softened_covariance};
use super::motion_noise::{Counterpart, EXPECTED_WRONG, MIN_FOR_TAIL, MotionChange, MotionNoise, TAIL};
use super::{FrameEstimate, Link, MIN_FRAMES_KNOWN_MOTION, MeasuredMotion, REGISTRATION_SIGMA, continues, may_follow};
use crate::geometry::mahalanobis;
use crate::geometry::quantile::quantile;
use crate::geometry::{Pose2, RigidMotion};

/// A step counts that is registered to this share of what the odometry is known to; with any that tells more than
/// the odometry, 1 of 1,187 pairs in small pieces of the corridor with `wheels_stop` is wrong (none); ...
const CALIBRATING_SHARE: f64 = 0.5;
/// ... it tells the size where it is this long (m). With shorter ones, ACES with `wheels_stop` has 61 good frames fewer.
const CALIBRATING_LENGTH: f64 = 0.1;
/// Registered steps are themselves too long or too short by up to this share: 0.1 to 0.4 % in the median of four logs.
const REGISTERED_SCALE: f64 = 0.005;
/// Chain and odometry are compared over up to so many steps: each may be likely, and all of them short together.
const MAX_STEPS: usize = 5;
/// Lengths of the stretches of the result that are compared (m). Wheels that slip for a moment contradict a shorter one, and are
/// right again over these.
const STRETCH_LENGTHS: [f64; 3] = [5.0, 10.0, 20.0];
/// What a registration leaves open of a direction that nothing constrains (rad, m). With 0.6 rad, ACES is in 5 pieces (3); with 1.5 m,
/// 145 of 7,347 pairs of the corridor are falsely good in eight draws of `wheels_stop` (100 of 7,322).
pub const UNREGISTERED: (f64, f64) = (1.0, 1.0);
/// Chain or result and odometry contradict each other beyond this squared Mahalanobis distance. Of the six logs at hand no stretch of
/// the result does (17.3 at most); where the ground ahead seems to move on with the robot, 30 and more.
const CONTRADICTS: f64 = mahalanobis::ONE_IN_TEN_THOUSAND;
/// Share of the registrations from scans alone that may be wrong though nothing speaks against them: with more wrong steps of the
/// odometry, a step that contradicts its registration is the likelier of the two to be wrong. None of 2,880 was (`laser_scores --mode
/// alone`, good steps of five logs); this is ten times what that leaves possible.
const FALSE_REGISTRATIONS: f64 = 0.01;
/// Fewer sure steps do not bound the next one: that it is longer than all of so many is as likely as a wrong step. Fewer keyframes that
/// fit each other say as little.
pub const MIN_SURE: usize = EXPECTED_WRONG.recip() as usize;

/// The odometry of a run, step by step.
#[derive(Debug, Clone, Default)]
pub struct OdometryModel {
    /// The motion of the sensor from the frame before to each frame, where the odometry tells it.
    pub steps: Vec<Option<MeasuredMotion>>,
    /// Of the steps that were compared with registrations before the run, how many were wrong and how many there were.
    pub wrong: (usize, usize),
    /// How much the motion changes from one step to the next.
    pub motion_change: Option<MotionChange>,
    /// For the steps in gaps of the odometry, how much a motion there differs from a share of the gap's.
    bridged: Vec<Option<MotionChange>>,
    noise: MotionNoise,
}

/// A stretch of the path by the odometry and by the scans.
struct Stretch {
    first: usize,
    last: usize,
    measured: Pose2,
    registered: Pose2,
    sq_distance: f64,
}

impl OdometryModel {
    /// Odometry of these steps, by the counterparts that some stretches of it have.
    pub fn new(steps: &[Option<Pose2>], counterparts: &[Counterpart]) -> Self {
        let (noise, num_wrong) = MotionNoise::fitted(counterparts);
        let known = |step: &Pose2| MeasuredMotion { T_before_sensor: *step, covariance: noise.covariance(step) };
        let motion_change = MotionChange::of(steps.windows(2).filter_map(|pair| Some((pair[0]?, pair[1]?))));
        let bridged = vec![None; steps.len()];
        let steps = steps.iter().map(|step| step.as_ref().map(known)).collect();
        Self { steps, wrong: (num_wrong, counterparts.len()), motion_change, bridged, noise }
    }

    /// No odometry of as many frames.
    pub fn unmeasured(num_frames: usize) -> Self {
        Self { steps: vec![None; num_frames], bridged: vec![None; num_frames], ..Self::default() }
    }

    /// Whether the odometry tells any step.
    pub fn is_measured(&self) -> bool {
        self.steps.iter().any(Option::is_some)
    }

    /// The motion from one frame to a later one, where the odometry tells all of its steps.
    pub fn between(&self, first: usize, last: usize) -> Option<MeasuredMotion> {
        let mut sum = (Pose2::identity(), Matrix3::zeros());
        for step in &self.steps[first + 1..=last] {
            let step = step.as_ref()?;
            sum.1 = chained((&sum.0, &sum.1), &step.covariance);
            sum.0 *= step.T_before_sensor;
        }
        Some(MeasuredMotion { T_before_sensor: sum.0, covariance: sum.1 })
    }

    /// Takes what a chain of registrations tells of the odometry: its wrong steps, the size of its metre and its noise. Steps of the
    /// chain that contradict it, or are longer than any sure one where it tells nothing, become doubtful. Returns the odometry for
    /// the graph, in which unusual and contradicted steps are known less well.
    #[must_use]
    pub fn compare_with_chain(&mut self, estimates: &mut [FrameEstimate]) -> Self {
        self.calibrate(estimates);
        let mut of_graph = self.clone();
        of_graph.weigh_isolated(estimates);
        for (frame, estimate) in estimates.iter().enumerate() {
            let Some(expected) = estimate.instead_of_odometry else { continue };
            of_graph.steps[frame] = Some(expected);
            // What the scans refute is nothing to compare the result with.
            let T_before_sensor = estimates[frame - 1].T_world_sensor.inverse() * estimate.T_world_sensor;
            self.steps[frame] = Some(MeasuredMotion { T_before_sensor, ..expected });
        }
        of_graph.doubt_contradicted_steps(estimates);
        self.doubt_long_steps(estimates);
        of_graph
    }

    /// The scale of the metre and the noise by all registered steps. Wheels are off by a few parts in a hundred, which adds up over a
    /// way that the walls leave open.
    fn calibrate(&mut self, estimates: &[FrameEstimate]) {
        let mut counterparts: Vec<Counterpart> =
            (1..self.steps.len()).filter_map(|frame| self.counterpart(frame, estimates)).collect();
        let ratio = |counterpart: &Counterpart| {
            let measured = counterpart.steps[0].translation.vector;
            let ratio = counterpart.registered.0.translation.vector.dot(&measured) / measured.norm_squared();
            (measured.norm() > CALIBRATING_LENGTH).then_some(ratio)
        };
        let mut ratios: Vec<f64> = counterparts.iter().filter_map(ratio).collect();
        let Some(median) = quantile(&mut ratios, 0.5).filter(|_| ratios.len() >= MIN_FOR_TAIL) else {
            return;
        };
        let off = median - 1.0;
        let scale = 1.0 + off.signum() * (off.abs() - REGISTERED_SCALE).max(0.0);
        let scaled = |motion: &Pose2| Pose2 { translation: (motion.translation.vector * scale).into(), ..*motion };
        for counterpart in &mut counterparts {
            counterpart.steps[0] = scaled(&counterpart.steps[0]);
        }
        self.noise = MotionNoise::fitted(&counterparts).0;
        for (step, change) in self.steps.iter_mut().zip(&self.bridged) {
            let Some(step) = step else { continue };
            let motion = scaled(&step.T_before_sensor);
            let of_gap = change.map_or_else(Matrix3::zeros, |change| change.covariance(&motion));
            *step = MeasuredMotion { T_before_sensor: motion, covariance: self.noise.covariance(&motion) + of_gap };
        }
    }

    /// A step that nothing refutes with its registration, where that one tells more than the odometry.
    fn counterpart(&self, frame: usize, estimates: &[FrameEstimate]) -> Option<Counterpart> {
        let (measured, registered) = self.compared(frame, estimates)?;
        let is_refuted = estimates[frame].instead_of_odometry.is_some();
        (!is_refuted).then(|| Counterpart { steps: vec![measured.T_before_sensor], registered })
    }

    /// A step that the odometry itself tells, and its registration with the covariance, where that one tells more than the odometry.
    fn compared(&self, frame: usize, estimates: &[FrameEstimate]) -> Option<(MeasuredMotion, (Pose2, Matrix3<f64>))> {
        let measured = self.steps[frame].filter(|_| self.bridged[frame].is_none())?;
        let estimate = Some(&estimates[frame]).filter(|estimate| estimate.link == Link::Registered)?;
        let position = |covariance: &Matrix3<f64>| sigmas(&measured.T_before_sensor, covariance).1;
        let covariance = chain_covariance(frame, estimates);
        let registered =
            estimates[frame - 1].T_world_sensor.inverse() * estimate.registration.as_ref()?.T_target_source;
        (position(&covariance) < CALIBRATING_SHARE * position(&measured.covariance))
            .then_some((measured, (registered, covariance)))
    }

    /// Marks as doubtful the least likely step of every stretch along which chain and odometry contradict each other, and adds their
    /// difference to its covariance: the ground ahead of a robot may seem to move with it, or wheels may slip, and nothing shows
    /// which.
    fn doubt_contradicted_steps(&mut self, estimates: &mut [FrameEstimate]) {
        let found: Vec<(usize, Stretch)> =
            (1..self.steps.len()).filter_map(|last| self.contradicted_step(last, estimates)).collect();
        for (frame, stretch) in found {
            let apart = stretch.measured * stretch.registered.inverse();
            let (off, num_steps) = (apart.log(), stretch.last - stretch.first);
            let finding =
                Finding::ChainContradictsOdometry(num_steps, apart.translation_norm(), apart.rotation_angle());
            estimates[frame].link = Link::Doubted;
            estimates[frame].findings.push(finding);
            if let Some(step) = &mut self.steps[frame] {
                step.covariance += off * off.transpose();
            }
        }
    }

    /// The shortest stretch up to this frame along which chain and odometry contradict each other, and its least likely step.
    fn contradicted_step(&self, last: usize, estimates: &[FrameEstimate]) -> Option<(usize, Stretch)> {
        let registered =
            |first: usize, last: usize| estimates[first].T_world_sensor.inverse() * estimates[last].T_world_sensor;
        let (mut measured, mut covariance) = (Pose2::identity(), Matrix3::zeros());
        for frame in (1..=last).rev().take(MAX_STEPS) {
            let step = self.steps[frame].as_ref().filter(|_| estimates[frame].link == Link::Registered)?;
            let of_step = step.covariance + chain_covariance(frame, estimates);
            covariance = chained((&step.T_before_sensor, &of_step), &covariance);
            measured = step.T_before_sensor * measured;
            let stretch = Stretch::new(frame - 1, last, measured, registered(frame - 1, last), &covariance);
            if frame < last && stretch.sq_distance > CONTRADICTS {
                let of_step = |frame: usize| {
                    let step = self.steps[frame].unwrap_or(*step);
                    let registered = registered(frame - 1, frame);
                    Stretch::new(frame - 1, frame, step.T_before_sensor, registered, &step.covariance).sq_distance
                };
                let least = (frame..=last).max_by(|&a, &b| of_step(a).total_cmp(&of_step(b)))?;
                return Some((least, stretch));
            }
        }
        None
    }

    /// Doubts all frames along stretches whose motion by `poses` (`T_world_sensor`) contradicts the odometry: several steps in a row
    /// may each be too short by as much as its noise explains, and loops confirm what is wrong in both rounds.
    pub fn doubt_contradicted_stretches(&self, poses: &[Pose2], estimates: &mut [FrameEstimate]) {
        let path = MeasuredPath::new(&self.right_steps(poses, estimates));
        for length in STRETCH_LENGTHS {
            let stretches: Vec<Stretch> =
                (0..self.steps.len()).filter_map(|first| path.stretch(first, length, poses)).collect();
            let mut distances: Vec<f64> = stretches.iter().map(|stretch| stretch.sq_distance).collect();
            let usual = quantile(&mut distances, 1.0 - TAIL).filter(|_| stretches.len() >= MIN_FOR_TAIL);
            // Errors of odometry that add up along the path make the distances of all larger.
            let scale = usual.map_or(1.0, |distance| (distance / mahalanobis::ONE_IN_TEN).max(1.0));
            for stretch in stretches.iter().filter(|stretch| stretch.sq_distance > scale * CONTRADICTS) {
                // One reason is enough.
                let unsuspected = |estimate: &&mut FrameEstimate| estimate.findings.is_empty();
                for estimate in estimates[stretch.first..=stretch.last].iter_mut().filter(unsuspected) {
                    estimate.findings.push(stretch.finding());
                }
            }
        }
    }

    /// The steps to compare the result with. Where more of them are wrong than registrations, those that contradict it on their own are:
    /// the result's take their place, known as badly as these are off.
    fn right_steps(&self, poses: &[Pose2], estimates: &[FrameEstimate]) -> Vec<Option<MeasuredMotion>> {
        let num_refuted = estimates.iter().filter(|estimate| estimate.instead_of_odometry.is_some()).count();
        let mut steps = self.steps.clone();
        if num_refuted as f64 <= FALSE_REGISTRATIONS * steps.iter().flatten().count() as f64 {
            return steps;
        }
        for (frame, step) in steps.iter_mut().enumerate().skip(1) {
            let Some(step) = step else { continue };
            let T_before_sensor = poses[frame - 1].inverse() * poses[frame];
            let off = (step.T_before_sensor * T_before_sensor.inverse()).log();
            if mahalanobis::squared(&off, &step.covariance) > mahalanobis::ONE_IN_HUNDRED {
                *step = MeasuredMotion { T_before_sensor, covariance: step.covariance + off * off.transpose() };
            }
        }
        steps
    }

    /// Takes registrations without measured motion for implausible that lie further from the frame before than what would continue
    /// the longest sure step. Such a place was found by a search over metres and all headings, where one that looks alike is found
    /// as well; and the right place cannot be compared with it where the scan, after a turn, sees next to nothing of the map. Those
    /// that were doubtful before count as well: the place tells nothing of where loops are to be looked for.
    fn doubt_long_steps(&self, estimates: &mut [FrameEstimate]) {
        let step = |frame: usize, estimates: &[FrameEstimate]| {
            estimates[frame - 1].T_world_sensor.inverse() * estimates[frame].T_world_sensor
        };
        let is_sure = |&frame: &usize| {
            frame > MIN_FRAMES_KNOWN_MOTION
                && (frame - MIN_FRAMES_KNOWN_MOTION..=frame).all(|frame| estimates[frame].link == Link::Registered)
                && continues(&step(frame - 1, estimates), &step(frame, estimates))
        };
        let sure = (1..estimates.len()).filter(is_sure);
        let lengths: Vec<f64> = sure.map(|frame| step(frame, estimates).translation_norm()).collect();
        if lengths.len() < MIN_SURE {
            return;
        }
        let longest = lengths.into_iter().fold(0.0, f64::max);
        for frame in 1..estimates.len() {
            let moved = step(frame, estimates).translation_norm();
            let is_registered = matches!(estimates[frame].link, Link::Registered | Link::Doubted);
            if self.steps[frame].is_none() && is_registered && !may_follow(moved, longest) {
                let estimate = &mut estimates[frame];
                estimate.link = Link::Implausible;
                estimate.findings.push(Finding::LongStep(moved, longest));
            }
        }
    }
}

/// Covariance of a frame's registered motion from the frame before.
fn chain_covariance(frame: usize, estimates: &[FrameEstimate]) -> Matrix3<f64> {
    let information = seen_from(&estimates[frame].information, &estimates[frame - 1].T_world_sensor);
    softened_covariance(&information, REGISTRATION_SIGMA, UNREGISTERED)
}

impl Stretch {
    fn new(first: usize, last: usize, measured: Pose2, registered: Pose2, covariance: &Matrix3<f64>) -> Self {
        let off: Vector3<f64> = (measured * registered.inverse()).log();
        Self { first, last, measured, registered, sq_distance: mahalanobis::squared(&off, covariance) }
    }

    fn finding(&self) -> Finding {
        let told = |motion: &Pose2| (motion.translation_norm(), motion.rotation.angle());
        let (result, odometry) = (told(&self.registered), told(&self.measured));
        Finding::ResultContradictsOdometry { frames: (self.first, self.last), result, odometry }
    }
}

/// The odometry added up, so that the motion between any two frames and its covariance are differences of two sums.
struct MeasuredPath {
    poses: Vec<Pose2>,
    /// Sums of the steps' covariances, by a perturbation on the left of the pose.
    covariances: Vec<Matrix3<f64>>,
    /// Lengths of the path up to each frame (m).
    lengths: Vec<f64>,
    /// For each frame the first one from which on no motion is missing.
    unbroken_since: Vec<usize>,
}

impl MeasuredPath {
    fn new(steps: &[Option<MeasuredMotion>]) -> Self {
        let mut path =
            Self { poses: Vec::new(), covariances: Vec::new(), lengths: Vec::new(), unbroken_since: Vec::new() };
        let (mut pose, mut covariance, mut length, mut since) = (Pose2::identity(), Matrix3::zeros(), 0.0, 0);
        for (frame, step) in steps.iter().enumerate() {
            if let Some(step) = step.as_ref().filter(|_| frame > 0) {
                let adjoint = pose.adjoint();
                covariance += adjoint * step.covariance * adjoint.transpose();
                pose *= step.T_before_sensor;
                length += step.T_before_sensor.translation_norm();
            } else {
                since = frame;
            }
            path.poses.push(pose);
            path.covariances.push(covariance);
            path.lengths.push(length);
            path.unbroken_since.push(since);
        }
        path
    }

    /// The stretch of this length (m) from a frame on; `None` where the path ends before, or a motion in it is missing.
    fn stretch(&self, first: usize, length: f64, poses: &[Pose2]) -> Option<Stretch> {
        let end = self.lengths[first] + length;
        let last = first + self.lengths[first..].partition_point(|&reached| reached < end);
        if last == self.lengths.len() || self.unbroken_since[last] > first {
            return None;
        }
        let measured = self.poses[first].inverse() * self.poses[last];
        let registered = poses[first].inverse() * poses[last];
        let adjoint = self.poses[first].inverse().adjoint();
        let covariance = adjoint * (self.covariances[last] - self.covariances[first]) * adjoint.transpose();
        // A covariance holds as far as a sine is nearly its angle: where a heading that contradicts is less than a radian off.
        let is_linear = covariance[(0, 0)] * CONTRADICTS < 1.0;
        is_linear.then(|| Stretch::new(first, last, measured, registered, &covariance))
    }
}

#[cfg(test)]
mod tests;
