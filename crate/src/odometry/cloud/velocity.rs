//! The velocity that straightens a sweep and is that of the motion which its registration finds.
//!
//! Where points are straightened by a velocity that differs by `d`, one that was measured `s` after the middle of the sweep moves by `s d`, and the
//! registration answers by `-H^-1 K d`, where `H = sum w g g^T`, `K = sum w s g g^T` and `g` is the gradient of a pair's residual. So Newton's step to the
//! velocity that comes back after the interval `t` from sweep to sweep solves `(H + K / t) d = H e`, where `e` is what registration found less what
//! straightened.

use nalgebra::Vector6;

use super::prepared::PreparedCloud;
use super::{CloudOdometry, Found};
use crate::geometry::{Pose3, RigidMotion};
use crate::registration::factors::{Correspondence, Factor, NormalEquations, PointToPlane};

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
