//! The velocity that straightens a sweep and is that of the motion which its registration finds.
//!
//! Where points are straightened by a velocity that differs by `d`, one that was measured `s` after the middle of the sweep moves by `s d`, and the
//! registration answers by `-H^-1 K d`, where `H = sum w g g^T`, `K = sum w s g g^T` and `g` is the gradient of a pair's residual. So Newton's step to the
//! velocity that comes back after the interval `t` from sweep to sweep solves `(H + K / t) d = H e`, where `e` is what registration found less what
//! straightened.

use nalgebra::Vector6;

use super::prepared::PreparedCloud;
use super::sweeps::{FoundSweep, Sweep, SweepOdometry};
use super::{CloudEstimate, CloudOdometry, Found};
use crate::geometry::{Pose3, RigidMotion};
use crate::registration::factors::{Correspondence, Factor, NormalEquations, PointToPlane};

/// A sweep is straightened at most so often, and is doubtful where that is not enough. Nine were needed in four worlds, from rest at 2 rad/s, where
/// each took the velocity that the last one had found; Newton's steps were not counted there.
const MAX_PASSES: usize = 12;
const STILL_CHANGING: &str = "the velocity by which it is straightened was still changing with each registration";

impl SweepOdometry {
    /// Registers a sweep this time (s) after the last one and straightens it by what that finds, until both agree; where it was found before, after this
    /// motion from there.
    pub(super) fn find_after(
        &mut self,
        sweep: &mut Sweep,
        mut velocity: Vector6<f64>,
        (interval, mut motion): (f64, Option<Pose3>),
    ) -> Result<FoundSweep, Box<CloudEstimate>> {
        let mut num_passes = 0;
        loop {
            num_passes += 1;
            let frame = sweep.straight(&velocity, &self.options);
            let mut found = self.clouds.find(&frame, motion.as_ref())?;
            if self.is_refuted() || sweep.span <= 0.0 {
                return Ok((velocity, frame, found));
            }
            let mut times = sweep.times_of(&frame.registered());
            if self.first.is_some() {
                // It is straightened along: what both see at the same time of a sweep moves alike.
                times.fill(0.0);
            }
            let change = self.clouds.agree(&frame, &mut found, &times, (&velocity, interval));
            velocity += change;
            self.straighten_first(&velocity);
            let is_settled = sweep.is_near(&change, &self.options);
            if is_settled || num_passes == MAX_PASSES {
                if !is_settled {
                    found.candidate.assessment.doubt(STILL_CHANGING);
                }
                return Ok((velocity, sweep.straight(&velocity, &self.options), found));
            }
            self.clouds.last_motion = self.clouds.T_world_last.inverse() * found.T_world_sensor;
            motion = Some(self.clouds.last_motion);
        }
    }
}

impl CloudOdometry {
    /// Newton's change of the velocity by which a cloud was straightened that was found `interval` (s) after the last one; moves what was found along.
    /// `times`: of the registered points after the middle of the sweep (s).
    pub(super) fn agree(
        &self,
        frame: &PreparedCloud,
        found: &mut Found,
        times: &[f64],
        (velocity, interval): (&Vector6<f64>, f64),
    ) -> Vector6<f64> {
        let Some(last) = &self.last else { return Vector6::zeros() };
        let ((task, T_world_target), registration) = (self.task(frame, last), &mut found.candidate.registration);
        let T = registration.T_target_source;
        let error = T.adjoint() * ((task.T_target_last.inverse() * T).log() / interval - velocity);
        let information = |share: &dyn Fn(u32) -> f64| {
            let weighted =
                |pair: &Correspondence<_>| Correspondence { weight: pair.weight * share(pair.source), ..*pair };
            let pairs: Vec<_> = registration.correspondences.iter().map(weighted).collect();
            let equations: NormalEquations<Pose3> = PointToPlane.normal_equations(&task.target, &pairs);
            equations.H
        };
        let b = information(&|_| 1.0) * error;
        let H = information(&|source| 1.0 + times[source as usize] / interval);
        let NormalEquations { H, b } = self.options.motion.solver().restricted(NormalEquations { H, b });
        let change = H.cholesky().map_or(error, |H| H.solve(&b));
        let answer = <Pose3 as RigidMotion>::exp(&((change - error) * interval));
        registration.T_target_source = (answer * T).renormalized();
        found.T_world_sensor = (T_world_target * registration.T_target_source).renormalized();
        T.inverse().adjoint() * change
    }
}
