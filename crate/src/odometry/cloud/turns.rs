//! Turns between sweeps that the last velocity does not predict.
//!
//! Straightened by a wrong velocity, a sweep of a lidar that has begun to spin fits nowhere, or fits a look-alike: a corridor looks the same
//! turned by half a turn. Where the last velocity leads to no sound pose, rates of turn are tried; and where the lidar may have turned by
//! another half of a turn since the last sweep, a pose counts only if the sweep does not fit the map turned like that.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{UnitQuaternion, Vector3, Vector6};

use super::candidates::Candidate;
use super::prepared::PreparedCloud;
use super::sweeps::{FoundSweep, Sweep, SweepOdometry};
use super::{CloudEstimate, CloudOdometry, MIN_LEAD, MIN_POINTS};
use crate::geometry::{Pose3, RigidMotion};

/// Most that a lidar turns during a sweep (rad): twice as much moves the two ends of what it sees to opposite sides.
const MAX_TURN: f64 = FRAC_PI_2;
/// Rates that are tried, either way, up to that turn: 15 degrees a sweep apart, so that each is within reach of the next one, as the
/// search of turns without straightening takes for 0.15 rad either way.
const NUM_RATES: i32 = 6;
const LOOKS_ALIKE: &str = "it fits the map about as well turned by half a turn, and the turn since the last sweep is not known well enough to tell";
const UNKNOWN_TURN: &str =
    "sweeps before it were lost, and the turn since the last one is not known well enough to straighten it";

impl SweepOdometry {
    /// Registers a sweep by other rates of turn about the upright axis of the sensor, where the pose by the last velocity is not sound, and
    /// keeps the better one.
    pub(super) fn find_turned(
        &mut self,
        sweep: &mut Sweep,
        predicted: Result<FoundSweep, Box<CloudEstimate>>,
    ) -> Result<FoundSweep, Box<CloudEstimate>> {
        let is_found = predicted.as_ref().is_ok_and(|(.., found)| found.candidate.is_sound());
        if is_found || sweep.span <= 0.0 || self.is_refuted() {
            return predicted;
        }
        let motion = self.clouds.last_motion;
        let Some(velocity) = self.best_rate(sweep) else { return predicted };
        self.clouds.last_motion = <Pose3 as RigidMotion>::exp(&(velocity * self.interval(sweep)));
        self.straighten_first(&velocity);
        let turned = self.find_from(sweep, velocity);
        match (turned, predicted) {
            (Ok(turned), Err(_)) => Ok(turned),
            (Ok(turned), Ok(predicted)) if !predicted.2.candidate.is_no_worse_than(&turned.2.candidate) => Ok(turned),
            (_, predicted) => {
                self.clouds.last_motion = motion;
                let velocity = predicted.as_ref().map_or(self.velocity.unwrap_or_default(), |found| found.0);
                self.straighten_first(&velocity);
                predicted
            }
        }
    }

    /// The velocity with the rate of turn from which a few of the points fit best; `None` where the sweep has too few points.
    fn best_rate(&mut self, sweep: &mut Sweep) -> Option<Vector6<f64>> {
        let (interval, span) = (self.interval(sweep), sweep.span);
        let before = self.velocity.unwrap_or_default();
        let turns = (1..=NUM_RATES).flat_map(|step| [step, -step]);
        let rates = turns.map(|step| MAX_TURN / f64::from(NUM_RATES) * f64::from(step) / span);
        let mut best: Option<(f64, Vector6<f64>)> = None;
        for rate in rates.filter(|rate| rate.abs() * interval < PI) {
            let velocity = Vector6::new(0.0, 0.0, rate, before[3], before[4], before[5]);
            self.straighten_first(&velocity);
            let frame = sweep.straight(&velocity, &self.options);
            let motion = <Pose3 as RigidMotion>::exp(&(velocity * interval));
            let score = self.clouds.rough_fit(&frame, &motion)?.0.score();
            if best.is_none_or(|best| score > best.0) {
                best = Some((score, velocity));
            }
        }
        best.map(|(_, velocity)| velocity)
    }

    /// Doubts a pose after lost sweeps, and one that the sweep fits as well turned by half a turn, where neither the last velocity, if its
    /// sweep was good, nor a gyroscope tells how far the lidar has turned: after lost sweeps the velocity that straightens it is unknown, too.
    pub(super) fn doubt_look_alike(&self, sweep: &Sweep, (_, frame, found): &mut FoundSweep) {
        let motion = self.clouds.T_world_last.inverse() * found.T_world_sensor;
        let interval = self.interval(sweep);
        let may_have_turned = PI - motion.rotation_angle() <= MAX_TURN * interval / sweep.span;
        if !found.candidate.is_good() || sweep.span <= 0.0 || self.is_refuted() || !may_have_turned {
            return;
        }
        let by_velocity =
            || self.velocity.filter(|_| self.is_last_good).map(|last| RigidMotion::exp(&(last * interval)));
        let by_gyro = || self.motion_by_gyro(sweep).filter(|_| self.gyro.is_confirmed());
        let predicted: Option<Pose3> = by_gyro().or_else(by_velocity);
        if predicted.is_some_and(|predicted| (predicted.inverse() * motion).rotation_angle() < FRAC_PI_2) {
            return;
        }
        if self.is_after_lost {
            found.candidate.assessment.doubt(UNKNOWN_TURN);
        } else if self.clouds.fits_turned(frame, &motion) {
            found.candidate.assessment.doubt(LOOKS_ALIKE);
        }
    }
}

impl CloudOdometry {
    /// Registers a few points of a cloud from this motion since the last one: the result, and the motion that it found. `None` with too few
    /// points.
    fn rough_fit(&self, frame: &PreparedCloud, motion: &Pose3) -> Option<(Candidate, Pose3)> {
        let last = self.last.as_ref().filter(|_| frame.num_oriented() >= MIN_POINTS)?;
        let (task, _) = self.task(frame, last);
        let rough = self.register_sample(&task, task.T_target_last * motion);
        let motion = task.T_target_last.inverse() * rough.registration.T_target_source;
        Some((rough, motion))
    }

    /// Whether a cloud that has moved like this fits about as well turned by half a turn about the upright axis of the sensor.
    fn fits_turned(&self, frame: &PreparedCloud, motion: &Pose3) -> bool {
        let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI);
        let fits = [*motion, motion * half_turn].map(|motion| self.rough_fit(frame, &motion));
        let [Some((here, _)), Some((there, turned))] = fits else { return false };
        let is_elsewhere = (motion.inverse() * turned).rotation_angle() > FRAC_PI_2;
        is_elsewhere && there.is_sound() && here.score() - there.score() < MIN_LEAD
    }
}
