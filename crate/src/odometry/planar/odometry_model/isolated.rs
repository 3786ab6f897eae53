//! Steps unlike both their neighbours: odometry that comes late, or a robot that stopped for just one step.

use nalgebra::{Matrix3, Vector3};

use super::super::FrameEstimate;
use super::super::motion_noise::isolated;
use super::OdometryModel;
use crate::geometry::quantile::MIN_SAMPLE;
use crate::geometry::{Pose2, RigidMotion, mahalanobis};

impl OdometryModel {
    /// What is isolated in each step; nothing where a neighbour is missing.
    fn isolated(&self) -> Vec<Vector3<f64>> {
        let step = |frame: usize| Some(self.steps.get(frame)?.as_ref()?.T_before_sensor);
        let isolated = |frame: usize| Some(isolated(&step(frame.checked_sub(1)?)?, &step(frame)?, &step(frame + 1)?));
        (0..self.steps.len()).map(|frame| isolated(frame).unwrap_or_default()).collect()
    }

    /// The motion that the steps before and after one let expect, where that is unlike both beyond its noise.
    pub fn as_neighbors(&self, frame: usize) -> Option<Pose2> {
        let step = |frame: usize| self.steps.get(frame)?.as_ref();
        let measured = step(frame)?;
        let [before, after] = [frame.checked_sub(1)?, frame + 1].map(step);
        let isolated = isolated(&before?.T_before_sensor, &measured.T_before_sensor, &after?.T_before_sensor);
        let off = measured.T_before_sensor.adjoint() * isolated;
        (mahalanobis::squared(&off, &measured.covariance) > mahalanobis::ONE_IN_HUNDRED)
            .then(|| measured.T_before_sensor * Pose2::exp(&-isolated))
    }

    /// Adds to each step's covariance what is isolated in it, by the share of that which is an error where registrations tell it.
    pub(super) fn weigh_isolated(&mut self, estimates: &[FrameEstimate]) {
        let isolated = self.isolated();
        let (mut sq_isolated, mut sq_errors, mut count) = (0.0, 0.0, 0);
        for (frame, isolated) in isolated.iter().enumerate().skip(1) {
            let Some((measured, (registered, covariance))) = self.compared(frame, estimates) else { continue };
            let covariance = measured.covariance + covariance;
            let squared = |off: &Vector3<f64>| mahalanobis::squared(off, &covariance);
            let isolated = squared(&(measured.T_before_sensor.adjoint() * isolated));
            if isolated > mahalanobis::ONE_IN_HUNDRED {
                count += 1;
                sq_isolated += isolated;
                // The mean of a usual step is the number of its directions.
                sq_errors += squared(&(measured.T_before_sensor * registered.inverse()).log()) - 3.0;
            }
        }
        let share = if count < MIN_SAMPLE { 0.0 } else { (sq_errors / sq_isolated).clamp(0.0, 1.0) };
        for (step, isolated) in self.steps.iter_mut().zip(&isolated) {
            let Some(step) = step else { continue };
            let (adjoint, variances) = (step.T_before_sensor.adjoint(), share * isolated.component_mul(isolated));
            step.covariance += adjoint * Matrix3::from_diagonal(&variances) * adjoint.transpose();
        }
    }
}
