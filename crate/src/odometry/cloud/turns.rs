//! Turns between sweeps that the last velocity does not predict.
//!
//! Straightened by a wrong velocity, a sweep of a lidar that has begun to spin fits nowhere, or fits a look-alike: where the last velocity leads to no
//! sound pose, rates of turn are tried. And two sweeps that are straightened alike fit one another at several rates where the surroundings look the
//! same turned by a part of a turn, as a corridor does by half of one: a beam that turns by `2 pi + a` in a sweep sees them as one that turns by
//! `2 pi + b` sees others that are stretched by the ratio of the two, and the next sweep fits both if `a - b (2 pi + a) / (2 pi + b)` is that part. So
//! `a` is `b + (2 pi + b) / n`, and the stretched surroundings look the same turned by one part in `n + 1`.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{UnitQuaternion, Vector3, Vector6};

use super::candidates::Candidate;
use super::prepared::PreparedCloud;
use super::sweeps::{FoundSweep, Sweep, SweepOdometry};
use super::{CloudEstimate, CloudOdometry, Found, MIN_LEAD, MIN_POINTS};
use crate::geometry::{Pose3, RigidMotion};

/// Most that a lidar turns during a sweep (rad): twice as much moves the two ends of what it sees to opposite sides.
const MAX_TURN: f64 = FRAC_PI_2;
/// Rates that are tried, either way, up to that turn: 15 degrees a sweep apart, so that each is within reach of the next one, as the
/// search of turns without straightening takes for 0.15 rad either way.
const NUM_RATES: i32 = 6;
const LOOKS_ALIKE: &str = "the first sweeps fit one another about as well at another rate of turn";
const UNKNOWN_TURN: &str =
    "the lidar has turned farther since the last sweep than can be told without a gyroscope or a good sweep before it";

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
        let turns = (1..=NUM_RATES).flat_map(|step| [step, -step]);
        let rates = turns.map(|step| MAX_TURN / f64::from(NUM_RATES) * f64::from(step) / sweep.span);
        let rates: Vec<f64> = rates.filter(|rate| rate.abs() * self.interval(sweep) < PI).collect();
        let Some((_, velocity)) = self.best_rate(sweep, &rates) else { return predicted };
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

    /// The velocity with the one of these rates of turn (rad/s) from which a few of the points fit best, after their score; `None` where the sweep
    /// has too few points.
    fn best_rate(&mut self, sweep: &mut Sweep, rates: &[f64]) -> Option<(f64, Vector6<f64>)> {
        let interval = self.interval(sweep);
        let before = self.velocity.unwrap_or_default();
        let mut best: Option<(f64, Vector6<f64>)> = None;
        for rate in rates {
            let velocity = Vector6::new(0.0, 0.0, *rate, before[3], before[4], before[5]);
            self.straighten_first(&velocity);
            let frame = sweep.straight(&velocity, &self.options);
            let motion = <Pose3 as RigidMotion>::exp(&(velocity * interval));
            let score = self.clouds.rough_fit(&frame, &motion)?.0.score();
            if best.is_none_or(|best| score > best.0) {
                best = Some((score, velocity));
            }
        }
        best
    }

    /// The first two sweeps by the other rate of turn at which they may fit one another, where that fits better: where they look the same turned by a
    /// third or a fifth of a turn, the surroundings by that rate do by a half or a quarter. Doubtful where both fit about as well, as is what follows.
    pub(super) fn without_look_alike(&mut self, sweep: &mut Sweep, found: FoundSweep) -> FoundSweep {
        if self.first.is_none() || sweep.span <= 0.0 || self.is_refuted() {
            return found;
        }
        let (velocity, frame, Found { T_world_sensor, .. }) = &found;
        let (velocity, motion) = (*velocity, self.clouds.T_world_last.inverse() * T_world_sensor);
        let Some((here, _)) = self.clouds.rough_fit(frame, &motion) else { return found };
        let fits = |parts: &f64| self.clouds.fits_turned(frame, &motion, here.score(), TAU / (parts + 1.0));
        let Some(parts) = [2.0, 4.0].into_iter().find(fits) else { return found };
        // Whichever way the beam turns.
        let interval = self.interval(sweep);
        let other = |way: f64| velocity[2] + (way * TAU + velocity[2] * sweep.span) / (parts * interval);
        let best = self.best_rate(sweep, &[1.0, -1.0].map(other));
        let turned = best.filter(|(score, _)| *score > here.score()).and_then(|(_, other)| {
            self.straighten_first(&other);
            self.clouds.last_motion = <Pose3 as RigidMotion>::exp(&(other * interval));
            self.find_from(sweep, other).ok()
        });
        if turned.is_none() {
            self.straighten_first(&velocity);
        }
        let mut found = turned.unwrap_or(found);
        if best.is_some_and(|(score, _)| (score - here.score()).abs() < MIN_LEAD) {
            self.is_rate_open = true;
            found.2.candidate.assessment.doubt(LOOKS_ALIKE);
        }
        found
    }

    /// Doubts a pose farther from the last one than a lidar is taken to turn, or on a map whose rate of turn is open, where neither the last velocity,
    /// if its sweep was good, nor a gyroscope tells of that turn: straightened by another one the sweep may look alike.
    pub(super) fn doubt_unknown_turn(&self, sweep: &Sweep, (_, _, found): &mut FoundSweep) {
        let motion = self.clouds.T_world_last.inverse() * found.T_world_sensor;
        let interval = self.interval(sweep);
        let may_have_turned = PI - motion.rotation_angle() <= MAX_TURN * interval / sweep.span;
        if !found.candidate.is_good()
            || sweep.span <= 0.0
            || self.is_refuted()
            || !(may_have_turned || self.is_rate_open)
        {
            return;
        }
        let by_velocity =
            || self.velocity.filter(|_| self.is_last_good).map(|last| RigidMotion::exp(&(last * interval)));
        let by_gyro = || self.motion_by_gyro(sweep).filter(|_| self.gyro.is_confirmed());
        let predicted: Option<Pose3> = by_gyro().or_else(by_velocity);
        if predicted.is_none_or(|predicted| (predicted.inverse() * motion).rotation_angle() >= FRAC_PI_2) {
            found.candidate.assessment.doubt(UNKNOWN_TURN);
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

    /// Whether a cloud that fits with this score where it has moved like this fits about as well turned by an angle about the upright axis of the sensor.
    fn fits_turned(&self, frame: &PreparedCloud, motion: &Pose3, score: f64, angle: f64) -> bool {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let Some((there, turned)) = self.rough_fit(frame, &(motion * turn)) else { return false };
        let is_elsewhere = (motion.inverse() * turned).rotation_angle() > 0.5 * angle;
        is_elsewhere && there.is_sound() && score - there.score() < MIN_LEAD
    }
}
