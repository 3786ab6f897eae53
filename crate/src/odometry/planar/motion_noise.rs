//! How well measured motion is known: a model of wheels' noise, fitted to what the scans say.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use super::information::chained;
use super::{MeasuredMotion, UNKNOWN_SIGMA};
use crate::geometry::mahalanobis;
use crate::geometry::quantile::{MEDIAN_TO_SIGMA, MIN_SAMPLE, TENTH_BEYOND, quantile};
use crate::geometry::{Pose2, RigidMotion};

/// Variances of measured motion: what is added by every step, by every metre of the way and by every radian of a turn, so
/// that many small steps are known as well as one large one (Thrun, Burgard and Fox, "Probabilistic Robotics" (2005),
/// section 5.4). The shape is that of a plain robot; the two scales are the log's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionNoise {
    /// Factor on the position's standard deviation.
    pub translation_scale: f64,
    /// Factor on the heading's.
    pub rotation_scale: f64,
}

/// Standard deviation of a position after a step (m), a metre (m) and a turn by a radian (m) ...
const TRANSLATION: (f64, f64, f64) = (0.004, 0.05, 0.05);
/// ... and of a heading after a step (rad), a turn by a radian (rad) and a metre (rad).
const ROTATION: (f64, f64, f64) = (0.004, 0.07, 0.03);
/// Before anything is known of the wheels, they are trusted half as much as those of a plain robot; none are trusted twice as much.
const UNKNOWN: f64 = 2.0;
/// Share of the steps that are wrong, before anything is known.
pub const EXPECTED_WRONG: f64 = 0.05;
/// The noise is told from the median and from the tail beyond which this share lies: of more wrong steps it would be told from these.
pub const TAIL: f64 = 0.1;

/// A measured motion of one or more steps, and the registration of the same motion.
#[derive(Debug, Clone)]
pub struct Counterpart {
    /// The steps measured.
    pub steps: Vec<Pose2>,
    /// The motion registered, and its covariance by a perturbation on the left, rotation first.
    pub registered: (Pose2, Matrix3<f64>),
}

impl Default for MotionNoise {
    fn default() -> Self {
        Self { translation_scale: UNKNOWN, rotation_scale: UNKNOWN }
    }
}

impl MotionNoise {
    /// The noise of the counterparts, and how many are wrong steps: those that are likelier as such than by the noise of unknown wheels.
    /// The default where there are too few.
    pub fn fitted(counterparts: &[Counterpart]) -> (Self, usize) {
        let count = counterparts.len();
        let explained = |noise: Self| counterparts.iter().filter(move |c| noise.explains(c)).collect::<Vec<_>>();
        let num_wrong = count - explained(Self::default()).len();
        if count < MIN_SAMPLE {
            return (Self::default(), num_wrong);
        }
        let all: Vec<&Counterpart> = counterparts.iter().collect();
        // Wheels may be worse than unknown ones: most of their steps are no wrong ones.
        let most = Self::of(&all, 0.5);
        let right = explained(Self {
            translation_scale: most.translation_scale.max(UNKNOWN),
            rotation_scale: most.rotation_scale.max(UNKNOWN),
        });
        let has_many = (right.len() as f64) < (1.0 - TAIL) * count as f64 && right.len() >= MIN_SAMPLE;
        (Self::of(if has_many { &right } else { &all }, 1.0 - TAIL), num_wrong)
    }

    /// Fits the scales robustly, by the median and, of a larger share of the errors, the tail, whichever is larger.
    fn of(counterparts: &[&Counterpart], share: f64) -> Self {
        let unit = Self { translation_scale: 1.0, rotation_scale: 1.0 };
        let (mut translations, mut rotations) = (Vec::new(), Vec::new());
        for counterpart in counterparts {
            let (mut sq_translation, mut sq_rotation, mut measured) = (0.0, 0.0, Pose2::identity());
            for step in &counterpart.steps {
                let (translation, rotation) = unit.sigmas(step);
                sq_translation += translation * translation;
                sq_rotation += rotation * rotation;
                measured *= step;
            }
            let off = measured.inverse() * counterpart.registered.0;
            let lever = measured.translation_norm() / 2.0;
            translations.push(off.translation_norm() / (sq_translation + lever * lever * sq_rotation / 2.0).sqrt());
            rotations.push(off.rotation_angle() / sq_rotation.sqrt());
        }
        let scale = |values: &mut [f64], median: f64, tail: f64| {
            let mut of = |share| quantile(values, share).unwrap_or(0.0);
            let scale = (of(0.5) / median).max(if share > 0.5 { of(share) / tail } else { 0.0 });
            scale.max(1.0 / UNKNOWN)
        };
        // What this share of the errors of unit deviation in the plane exceeds (Rayleigh).
        let in_plane = |beyond: f64| (-2.0 * beyond.ln()).sqrt();
        Self {
            translation_scale: scale(&mut translations, in_plane(0.5), in_plane(TAIL)),
            rotation_scale: scale(&mut rotations, 1.0 / MEDIAN_TO_SIGMA, TENTH_BEYOND),
        }
    }

    /// The logarithm of the ratio of two likelihoods of a motion that is registered with this covariance, where these steps are
    /// measured: by this noise, and as wrong steps.
    pub fn log_likelihood_ratio(&self, steps: &[Pose2], (registered, covariance): &(Pose2, Matrix3<f64>)) -> f64 {
        let (mut measured, mut noise) = (Pose2::identity(), Matrix3::zeros());
        for step in steps {
            noise = chained((&measured, &noise), &self.covariance(step));
            measured *= step;
        }
        let covariance = noise + covariance;
        let sq_distance = mahalanobis::squared(&(measured * registered.inverse()).log(), &covariance);
        let log_density = -0.5 * (sq_distance + (TAU.powi(3) * covariance.determinant()).ln());
        // A wrong step may be any motion within the window of the usual search.
        let (rotation, translation) = UNKNOWN_SIGMA;
        log_density + (8.0 * rotation * translation * translation).ln()
    }

    /// Whether a counterpart is likelier by this noise than as a wrong step.
    fn explains(&self, counterpart: &Counterpart) -> bool {
        let odds = EXPECTED_WRONG / (1.0 - EXPECTED_WRONG);
        self.log_likelihood_ratio(&counterpart.steps, &counterpart.registered) > odds.ln()
    }

    /// Standard deviations of a step's position in each direction (m) and of its heading (rad).
    pub fn sigmas(&self, motion: &Pose2) -> (f64, f64) {
        let (way, turn) = (motion.translation_norm(), motion.rotation_angle());
        let root = |(of_step, of_first, of_second): (f64, f64, f64), first: f64, second: f64| {
            (of_step * of_step + of_first * of_first * first + of_second * of_second * second).sqrt()
        };
        (self.translation_scale * root(TRANSLATION, way, turn), self.rotation_scale * root(ROTATION, turn, way))
    }

    /// Covariance of a measured motion, by a perturbation on its left, rotation first. The error arises on the way: it is
    /// put in its middle.
    pub fn covariance(&self, motion: &Pose2) -> Matrix3<f64> {
        let (translation, rotation) = self.sigmas(motion);
        let at_middle = Pose2::exp(&(motion.log() * 0.5)).adjoint();
        let diagonal = Vector3::new(rotation * rotation, translation * translation, translation * translation);
        at_middle * Matrix3::from_diagonal(&diagonal) * at_middle.transpose()
    }
}

/// Of fewer numbers too few lie in the tail to tell it.
pub const MIN_FOR_TAIL: usize = (MIN_SAMPLE as f64 / TAIL) as usize;

/// How much a robot's motion changes: variances of the heading (rad^2) and the position (m^2) in the frame at its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionChange {
    variances: Vector3<f64>,
}

impl MotionChange {
    /// Of many motions and what each was expected to be; `None` of too few. The tail decides: a robot goes straight and then turns.
    pub fn of(changes: impl Iterator<Item = (Pose2, Pose2)>) -> Option<Self> {
        let offs: Vec<Vector3<f64>> = changes.map(|(expected, motion)| (expected.inverse() * motion).log()).collect();
        let sigma = |axis: usize| {
            let mut sizes: Vec<f64> = offs.iter().map(|off| off[axis].abs()).collect();
            quantile(&mut sizes, 1.0 - TAIL).map_or(0.0, |size| size / TENTH_BEYOND)
        };
        let variances = Vector3::from_fn(|axis, _| sigma(axis).powi(2));
        (offs.len() >= MIN_FOR_TAIL).then_some(Self { variances })
    }

    /// Whether a motion may change by so much, in the frame at its end.
    pub fn allows(&self, change: &Vector3<f64>) -> bool {
        mahalanobis::squared(change, &Matrix3::from_diagonal(&self.variances)) < mahalanobis::ONE_IN_THOUSAND
    }

    /// The motion that is expected after another one.
    pub fn after(&self, last: &Pose2) -> MeasuredMotion {
        MeasuredMotion { T_before_sensor: *last, covariance: self.covariance(last) }
    }

    /// Covariance of an expected motion, by a perturbation on its left, rotation first.
    pub fn covariance(&self, expected: &Pose2) -> Matrix3<f64> {
        let adjoint = expected.adjoint();
        adjoint * Matrix3::from_diagonal(&self.variances) * adjoint.transpose()
    }
}

/// How far a step differs from both its neighbours in the same direction, in the frame at its end, rotation first: an error of the
/// odometry, which may come late, or a robot that stopped or turned for just this step.
pub fn isolated(before: &Pose2, step: &Pose2, after: &Pose2) -> Vector3<f64> {
    let [a, b] = [before, after].map(|neighbor| (neighbor.inverse() * step).log());
    a.zip_map(&b, |a, b| if a * b > 0.0 { a.signum() * a.abs().min(b.abs()) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counterparts of odometry with this noise; the first `num_wrong` are half a metre and 20 degrees off.
    fn counterparts(truth: &MotionNoise, num_wrong: usize) -> Vec<Counterpart> {
        let mut state = 1_u32;
        let mut normal = || {
            let sum: f64 = (0..12)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    f64::from(state >> 8) / f64::from(1 << 24)
                })
                .sum();
            sum - 6.0
        };
        let counterpart = |index: usize| {
            let motion = Pose2::exp(&Vector3::new(0.3 * normal(), 0.02 * (index % 9) as f64, 0.0));
            let (translation, rotation) = truth.sigmas(&motion);
            let wrong = if index < num_wrong { Vector3::new(0.35, 0.5, 0.0) } else { Vector3::zeros() };
            let off = wrong + Vector3::new(rotation * normal(), translation * normal(), translation * normal());
            let covariance = Matrix3::from_diagonal(&Vector3::repeat(1e-6));
            Counterpart { steps: vec![motion], registered: (motion * Pose2::exp(&off), covariance) }
        };
        (0..400).map(counterpart).collect()
    }

    #[test]
    fn the_scales_are_those_of_the_errors_and_wrong_steps_are_told_apart() {
        let truth = MotionNoise { translation_scale: 1.7, rotation_scale: 3.0 };
        // Up to one in ten, wrong steps make the tail longer; of more they are left out.
        for (num_wrong, tolerance) in [(0, 0.4), (20, 0.8), (60, 0.4)] {
            let (fitted, wrong) = MotionNoise::fitted(&counterparts(&truth, num_wrong));
            let off = (fitted.translation_scale - 1.7).abs().max((fitted.rotation_scale - 3.0).abs());
            assert!(off < tolerance, "{num_wrong} wrong: {fitted:?}");
            assert!(wrong.abs_diff(num_wrong) <= 4, "{wrong} of {num_wrong}");
        }
        assert_eq!(MotionNoise::fitted(&counterparts(&truth, 0)[..3]), (MotionNoise::default(), 0));
    }

    #[test]
    fn isolated_is_what_a_step_has_unlike_both_its_neighbours() {
        let step = |turn: f64, way: f64| Pose2::new([way, 0.0].into(), turn);
        let of = |steps: [Pose2; 3]| isolated(&steps[0], &steps[1], &steps[2]);
        let late = of([step(0.0, 1.0), step(0.0, 0.4), step(0.0, 1.1)]);
        assert!((late - Vector3::new(0.0, -0.6, 0.0)).norm() < 1e-9, "{late}");
        for turn in
            [of([step(0.0, 1.0), step(0.3, 1.0), step(0.3, 1.0)]), of([step(0.0, 1.0), step(0.0, 0.7), step(0.0, 0.4)])]
        {
            assert!(turn.norm() < 1e-9, "a robot that begins to turn or slows down: {turn}");
        }
    }

    #[test]
    fn the_covariance_grows_with_the_way_and_is_symmetric() {
        let noise = MotionNoise::default();
        let step = |way: f64| noise.covariance(&Pose2::exp(&Vector3::new(0.2, way, 0.0)));
        assert!(step(2.0).trace() > step(1.0).trace() && (step(1.0) - step(1.0).transpose()).norm() < 1e-15);
        assert!(step(1.0).symmetric_eigenvalues().min() > 0.0);
    }
}
