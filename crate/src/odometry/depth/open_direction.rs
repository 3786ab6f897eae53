//! Directions of motion that the surfaces in view leave open.

use nalgebra::{Matrix3, Vector3};

use super::evidence::FINE_TOLERANCE;
use crate::registration::spatial::SpatialRegistration;

/// A direction is held by the surfaces that face along it at least so much (cosine), ...
const HOLDING_COSINE: f64 = 0.3;
/// ... if they are at least this share of all.
const HOLDING_SHARE: f64 = 0.01;

/// The direction of motion that is known least, where hardly any surface faces along it. Long walls do not add up to one
/// that faces the other way, however many there are and however noisy their normals.
pub(crate) struct OpenDirection {
    pub(crate) direction: Vector3<f64>,
}

impl OpenDirection {
    /// None where enough surfaces hold every direction.
    pub(crate) fn of(registration: &SpatialRegistration) -> Option<Self> {
        let (weakest, share) = Self::weakest(registration);
        (share < HOLDING_SHARE).then_some(weakest)
    }

    /// The direction that is held least, and the share of all surfaces that hold it.
    pub(crate) fn weakest(registration: &SpatialRegistration) -> (Self, f64) {
        let fitting = registration.correspondences.iter().filter(|pair| pair.residual.abs() < FINE_TOLERANCE);
        let normals: Vec<Vector3<f64>> = fitting.filter_map(|pair| pair.normal).collect();
        let spread: Matrix3<f64> = normals.iter().map(|normal| normal * normal.transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let num_holding = normals.iter().filter(|normal| normal.dot(&direction).abs() > HOLDING_COSINE).count();
        (Self { direction }, num_holding as f64 / normals.len().max(1) as f64)
    }

    /// Standard deviation (m) along it as far as the residuals tell, were they independent of each other. They are not, so it
    /// tells which frames are held better than others, and not how far they are off.
    pub(crate) fn deviation(&self, registration: &SpatialRegistration) -> f64 {
        let information = registration.information.fixed_view::<3, 3>(3, 3);
        // Of a single wall nothing is told along it, and rounding may make that less than nothing.
        self.direction.dot(&(information * self.direction)).max(0.0).sqrt().recip()
    }
}
