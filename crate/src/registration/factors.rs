//! Metrics: what a correspondence measures, and the step that a set of them asks for.

use nalgebra::{SMatrix, SVector};

use super::projective::ProjectiveTarget;
use super::target::{OrientedTarget, PointTarget, Target};
use crate::geometry::RigidMotion;

/// A source point, moved into the target frame, and its partner.
#[derive(Debug, Clone, Copy)]
pub struct Correspondence<const D: usize> {
    /// Index of the source point.
    pub source: u32,
    /// Index of the target point.
    pub target: u32,
    /// The source point in the target frame, under the current estimate (m).
    pub moved: SVector<f64, D>,
    /// Its unit normal, turned likewise, where it is known.
    pub normal: Option<SVector<f64, D>>,
    /// The metric's residual (m).
    pub residual: f64,
    /// Weight in the least squares, 0..=1.
    pub weight: f64,
}

/// Gauss-Newton's `H delta = -b` (rotation first), with H = sum w J^T J and b = sum w J^T r.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalEquations<const DOF: usize> {
    /// Sum of w J^T J.
    pub H: SMatrix<f64, DOF, DOF>,
    /// Sum of w J^T r.
    pub b: SVector<f64, DOF>,
}

/// A metric of correspondences between a source and a [`Target`].
pub trait Metric<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>> {
    /// What it needs to know of the target.
    type Target: Target<D>;

    /// Residual (m) of a source point in the target frame, with its unit normal there where it is known; `None` where the
    /// target point cannot measure it.
    fn residual(
        target: &Self::Target,
        index: u32,
        moved: &SVector<f64, D>,
        normal: Option<&SVector<f64, D>>,
    ) -> Option<f64>;

    /// The motion to apply after the current estimate, from weighted correspondences; `None` where they fix nothing.
    fn step(target: &Self::Target, correspondences: &[Correspondence<D>]) -> Option<M>;

    /// The normal equations of the weighted residuals by a perturbation on the left of the estimate.
    fn normal_equations(target: &Self::Target, correspondences: &[Correspondence<D>]) -> NormalEquations<DOF>;
}

/// Distance to the nearest point; the step in closed form (Umeyama 1991 without scale).
pub struct PointToPoint;

/// Distance along the target's normal (Chen and Medioni 1992): to a line in the plane, to a plane in space; the step by
/// Gauss-Newton. In the plane this is called point-to-line.
pub struct PointToPlane;

/// Point-to-plane against pieces of surface looked up by projection.
pub struct PointToSurfel;

impl<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>> Metric<D, DOF, M> for PointToPoint {
    type Target = PointTarget<D>;

    fn residual(
        target: &Self::Target,
        index: u32,
        moved: &SVector<f64, D>,
        _normal: Option<&SVector<f64, D>>,
    ) -> Option<f64> {
        Some((moved - target.point(index)).norm())
    }

    fn step(target: &Self::Target, correspondences: &[Correspondence<D>]) -> Option<M> {
        best_rigid_motion(correspondences.iter().map(|c| (c.moved, target.point(c.target), c.weight)))
    }

    fn normal_equations(target: &Self::Target, correspondences: &[Correspondence<D>]) -> NormalEquations<DOF> {
        let mut sums = NormalEquations { H: SMatrix::zeros(), b: SVector::zeros() };
        for c in correspondences {
            let J = M::point_jacobian(&c.moved);
            sums.H += J.tr_mul(&J) * c.weight;
            sums.b += J.tr_mul(&(c.moved - target.point(c.target))) * c.weight;
        }
        sums
    }
}

impl<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>> Metric<D, DOF, M> for PointToPlane {
    type Target = OrientedTarget<D>;

    fn residual(
        target: &Self::Target,
        index: u32,
        moved: &SVector<f64, D>,
        _normal: Option<&SVector<f64, D>>,
    ) -> Option<f64> {
        plane_residual(target, index, moved)
    }

    fn step(target: &Self::Target, correspondences: &[Correspondence<D>]) -> Option<M> {
        gauss_newton_step(&plane_equations::<D, DOF, M>(target, correspondences))
    }

    fn normal_equations(target: &Self::Target, correspondences: &[Correspondence<D>]) -> NormalEquations<DOF> {
        plane_equations::<D, DOF, M>(target, correspondences)
    }
}

impl<const DOF: usize, M: RigidMotion<3, DOF>> Metric<3, DOF, M> for PointToSurfel {
    type Target = ProjectiveTarget;

    fn residual(
        target: &Self::Target,
        index: u32,
        moved: &SVector<f64, 3>,
        _normal: Option<&SVector<f64, 3>>,
    ) -> Option<f64> {
        plane_residual(target, index, moved)
    }

    fn step(target: &Self::Target, correspondences: &[Correspondence<3>]) -> Option<M> {
        gauss_newton_step(&plane_equations::<3, DOF, M>(target, correspondences))
    }

    fn normal_equations(target: &Self::Target, correspondences: &[Correspondence<3>]) -> NormalEquations<DOF> {
        plane_equations::<3, DOF, M>(target, correspondences)
    }
}

/// Plane to plane: Segal, Haehnel and Thrun, "Generalized-ICP", RSS 2009, with the covariances of both points regularised to
/// the eigenvalues [`PLANE_THICKNESS`], 1 and 1, so that their normals say it all; the step by Gauss-Newton.
///
/// The residual is scaled to metres: where both normals agree, it is the distance along them. A source point without a
/// normal is taken to face as its partner does.
pub struct PlaneToPlane;

/// Variance of a surface along its normal, over that along the surface.
pub const PLANE_THICKNESS: f64 = 1e-3;

/// The inverse of C_target + C_source with C = I - (1 - e) n n^T, scaled by 2e. The sum's eigenvectors are a + b, a - b and
/// their cross product for unit normals a and b, so the inverse is isotropic + sum.1 sum.0 sum.0^T + difference.1
/// difference.0 difference.0^T without a division that could fail.
struct Precision<const D: usize> {
    sum: (SVector<f64, D>, f64),
    difference: (SVector<f64, D>, f64),
}

impl<const D: usize> Precision<D> {
    const ISOTROPIC: f64 = PLANE_THICKNESS;

    fn new(target: &SVector<f64, D>, source: &SVector<f64, D>) -> Self {
        // The side a normal points to does not matter to its covariance.
        let cosine = target.dot(source);
        let share = 1.0 - PLANE_THICKNESS;
        let factor = |cosine: f64| 2.0 * PLANE_THICKNESS * share / (4.0 * (2.0 - share * (1.0 + cosine)));
        Self { sum: (target + source, factor(cosine)), difference: (target - source, factor(-cosine)) }
    }

    fn sq_length(&self, vector: &SVector<f64, D>) -> f64 {
        let (sum, difference) = (self.sum.0.dot(vector), self.difference.0.dot(vector));
        Self::ISOTROPIC * vector.norm_squared() + self.sum.1 * sum * sum + self.difference.1 * difference * difference
    }
}

impl<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>> Metric<D, DOF, M> for PlaneToPlane {
    type Target = OrientedTarget<D>;

    fn residual(
        target: &Self::Target,
        index: u32,
        moved: &SVector<f64, D>,
        normal: Option<&SVector<f64, D>>,
    ) -> Option<f64> {
        let target_normal = target.normal(index)?;
        let precision = Precision::new(&target_normal, normal.unwrap_or(&target_normal));
        Some(precision.sq_length(&(moved - target.point(index))).sqrt())
    }

    fn step(target: &Self::Target, correspondences: &[Correspondence<D>]) -> Option<M> {
        gauss_newton_step(&<Self as Metric<D, DOF, M>>::normal_equations(target, correspondences))
    }

    fn normal_equations(target: &Self::Target, correspondences: &[Correspondence<D>]) -> NormalEquations<DOF> {
        let mut sums = NormalEquations { H: SMatrix::zeros(), b: SVector::zeros() };
        for c in correspondences {
            let Some(target_normal) = target.normal(c.target) else { continue };
            let precision = Precision::new(&target_normal, c.normal.as_ref().unwrap_or(&target_normal));
            let (J, d) = (M::point_jacobian(&c.moved), c.moved - target.point(c.target));
            let isotropic = Precision::<D>::ISOTROPIC * c.weight;
            sums.H += J.tr_mul(&J) * isotropic;
            sums.b += J.tr_mul(&d) * isotropic;
            for (direction, factor) in [precision.sum, precision.difference] {
                let gradient = J.tr_mul(&direction);
                sums.H += gradient * gradient.transpose() * (factor * c.weight);
                sums.b += gradient * (direction.dot(&d) * factor * c.weight);
            }
        }
        sums
    }
}

/// n . (p - q).
pub(crate) fn plane_residual<const D: usize>(
    target: &impl Target<D>,
    index: u32,
    moved: &SVector<f64, D>,
) -> Option<f64> {
    target.normal(index).map(|normal| normal.dot(&(moved - target.point(index))))
}

pub(crate) fn plane_equations<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>>(
    target: &impl Target<D>,
    correspondences: &[Correspondence<D>],
) -> NormalEquations<DOF> {
    let mut sums = NormalEquations { H: SMatrix::zeros(), b: SVector::zeros() };
    for c in correspondences {
        let Some(normal) = target.normal(c.target) else { continue };
        let gradient = M::point_jacobian(&c.moved).tr_mul(&normal); // of n . (exp(delta) p - q)
        sums.H += gradient * gradient.transpose() * c.weight;
        sums.b += gradient * (c.residual * c.weight);
    }
    sums
}

pub(crate) fn gauss_newton_step<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>>(
    equations: &NormalEquations<DOF>,
) -> Option<M> {
    let damping = SMatrix::identity() * (RELATIVE_DAMPING * equations.H.trace());
    (equations.H + damping).cholesky().map(|factor| M::exp(&-factor.solve(&equations.b)))
}

/// Damping (Levenberg 1944) over the trace of H: so little that it holds back only what nothing measures.
pub const RELATIVE_DAMPING: f64 = 1e-9;

/// The motion with the least weighted sum of squared distances between `motion * source` and `target`.
///
/// Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 13 (1991),
/// eqs. 34-42 with scale 1. `None` when no pair has weight or a coordinate is not finite; where the pairs leave the
/// rotation open (one pair, or all in one point), it is one of the best.
pub fn best_rigid_motion<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>>(
    pairs: impl Iterator<Item = (SVector<f64, D>, SVector<f64, D>, f64)> + Clone,
) -> Option<M> {
    let (mut sum, mut source_mean, mut target_mean) = (0.0, SVector::<f64, D>::zeros(), SVector::<f64, D>::zeros());
    for (source, target, weight) in pairs.clone() {
        sum += weight;
        source_mean += source * weight;
        target_mean += target * weight;
    }
    if sum <= 0.0 {
        return None;
    }
    source_mean /= sum;
    target_mean /= sum;

    let covariance = pairs.fold(SMatrix::<f64, D, D>::zeros(), |covariance, (source, target, weight)| {
        covariance + (target - target_mean) * (source - source_mean).transpose() * (weight / sum) // eq. 38
    });
    let R = M::best_rotation(&covariance)?; // eq. 40
    Some(M::from_parts(&R, &(target_mean - R * source_mean))) // eq. 41
}
