//! Which directions of motion the correspondences determine, and which they leave open.
//!
//! The eigenvectors of the Gauss-Newton matrix with small eigenvalues are the motions that change no residual: along a
//! bare corridor, or a turn inside a round room (Censi, "On achievable accuracy for range-finder localization", ICRA
//! 2007; Zhang, Kaess and Singh, "On degeneracy of optimization-based state estimation problems", ICRA 2016).

use nalgebra::{DMatrix, SMatrix, SVector};

use super::factors::Correspondence;
use crate::geometry::RigidMotion;

/// How well the least determined direction of motion is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observability<const DOF: usize> {
    /// The least determined direction, a unit tangent vector (rotation first) about the centre of the correspondences, in
    /// which a rotation is measured by the metres it moves a point at the correspondences' rms distance from their centre.
    pub weakest_direction: SVector<f64, DOF>,
    /// Share of the correspondences that measure this direction, 0..=1: the smallest eigenvalue of the normalised
    /// matrix, the mean square cosine between the direction's motion and the residual's gradient.
    pub weakest_share: f64,
}

/// Below this share a direction counts as undetermined: noise in the normals of a bare wall alone (5 degrees) gives
/// sin(5 deg)^2 = 0.0076.
pub const UNDETERMINED_SHARE: f64 = 0.01;

impl<const DOF: usize> Observability<DOF> {
    /// Whether the weakest direction is in effect not measured at all.
    pub fn is_undetermined(&self) -> bool {
        self.weakest_share < UNDETERMINED_SHARE
    }
}

/// Analyses the Gauss-Newton matrix `H` (perturbation on the left, rotation first) of these correspondences.
pub fn observability<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>>(
    H: &SMatrix<f64, DOF, DOF>,
    correspondences: &[Correspondence<D>],
) -> Observability<DOF> {
    let weights: f64 = correspondences.iter().map(|c| c.weight).sum();
    let unmeasured = Observability { weakest_direction: SVector::zeros(), weakest_share: 0.0 };
    if weights <= 0.0 {
        return unmeasured;
    }
    let center = correspondences.iter().map(|c| c.moved * c.weight).sum::<SVector<f64, D>>() / weights;
    let sq_radius = correspondences.iter().map(|c| (c.moved - center).norm_squared() * c.weight).sum::<f64>() / weights;
    if sq_radius <= 0.0 {
        return unmeasured;
    }

    // To a perturbation about the centre, where rotation and translation do not mix, with the rotation in metres.
    let to_center = M::from_parts(&SMatrix::identity(), &center).adjoint();
    let rotations = DOF - D;
    let scale = SMatrix::<f64, DOF, DOF>::from_fn(|row, column| match (row == column, row < rotations) {
        (false, _) => 0.0,
        (true, true) => 1.0 / sq_radius.sqrt(),
        (true, false) => 1.0,
    });
    let basis = to_center * scale;
    let normalised = basis.transpose() * H * basis / weights;

    let eigen = DMatrix::from_iterator(DOF, DOF, normalised.iter().copied()).symmetric_eigen();
    let weakest = eigen.eigenvalues.imin();
    Observability {
        weakest_direction: SVector::from_iterator(eigen.eigenvectors.column(weakest).iter().copied()),
        weakest_share: eigen.eigenvalues[weakest].clamp(0.0, 1.0),
    }
}
