//! Factors: the residual of a correspondence, and the step that minimises the residuals of a set of correspondences.

use super::target::{SurfaceTarget, Target};
use crate::geometry::{Jacobian, RigidMotion, SquareMatrix, Vector};

/// A source point, transformed into the target frame, and its partner.
#[derive(Debug, Clone, Copy)]
pub struct Correspondence<P> {
    /// Index of the source point.
    pub source: u32,
    /// Index of the target point.
    pub target: u32,
    /// The source point in the target frame, under the current estimate (m).
    pub moved: P,
    /// Its unit normal in the target frame, where it is known.
    pub normal: Option<P>,
    /// The factor's residual (m).
    pub residual: f64,
    /// Weight in the least squares, 0..=1.
    pub weight: f64,
}

/// Gauss-Newton's `H delta = -b` (rotation first), with H = sum w J^T J and b = sum w J^T r.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalEquations<M: RigidMotion> {
    /// Sum of w J^T J.
    pub H: M::Matrix,
    /// Sum of w J^T r.
    pub b: M::Tangent,
}

impl<M: RigidMotion> NormalEquations<M> {
    /// The equations without correspondences: zero.
    pub fn zeros() -> Self {
        Self { H: M::Matrix::zeros(), b: M::Tangent::zeros() }
    }
}

/// The residual of a correspondence with a target of type `T`, the source being moved by `M`.
pub trait Factor<M: RigidMotion, T: Target<Point = M::Point>> {
    /// Residual (m) of a source point in the target frame, with its unit normal there where it is known; `None` where it is
    /// undefined, for example because the target point has no normal.
    fn residual(&self, target: &T, index: u32, moved: &M::Point, normal: Option<&M::Point>) -> Option<f64>;

    /// The motion to apply after the current estimate, from weighted correspondences; `None` where they do not determine it.
    fn step(&self, target: &T, correspondences: &[Correspondence<M::Point>]) -> Option<M> {
        gauss_newton_step(&self.normal_equations(target, correspondences))
    }

    /// The normal equations of the weighted residuals for a perturbation on the left of the estimate.
    fn normal_equations(&self, target: &T, correspondences: &[Correspondence<M::Point>]) -> NormalEquations<M>;
}

/// Distance to the nearest point; the step in closed form (Umeyama 1991 without scale).
#[derive(Debug, Clone, Copy, Default)]
pub struct PointToPoint;

/// Distance along the target's normal (Chen and Medioni 1992): to a line in the plane, to a plane in space; the step by
/// Gauss-Newton. In the plane this is called point-to-line.
#[derive(Debug, Clone, Copy, Default)]
pub struct PointToPlane;

impl<M: RigidMotion, T: Target<Point = M::Point>> Factor<M, T> for PointToPoint {
    fn residual(&self, target: &T, index: u32, moved: &M::Point, _normal: Option<&M::Point>) -> Option<f64> {
        Some((*moved - target.point(index)).norm())
    }

    fn step(&self, target: &T, correspondences: &[Correspondence<M::Point>]) -> Option<M> {
        best_rigid_motion(correspondences.iter().map(|c| (c.moved, target.point(c.target), c.weight)))
    }

    fn normal_equations(&self, target: &T, correspondences: &[Correspondence<M::Point>]) -> NormalEquations<M> {
        let mut sums = NormalEquations::zeros();
        for c in correspondences {
            let J = M::point_jacobian(&c.moved);
            sums.H += J.gramian() * c.weight;
            sums.b += J.pull_back(&(c.moved - target.point(c.target))) * c.weight;
        }
        sums
    }
}

impl<M: RigidMotion, T: SurfaceTarget<Point = M::Point>> Factor<M, T> for PointToPlane {
    /// n . (p - q).
    fn residual(&self, target: &T, index: u32, moved: &M::Point, _normal: Option<&M::Point>) -> Option<f64> {
        target.normal(index).map(|normal| normal.dot(&(*moved - target.point(index))))
    }

    fn normal_equations(&self, target: &T, correspondences: &[Correspondence<M::Point>]) -> NormalEquations<M> {
        let mut sums = NormalEquations::zeros();
        for c in correspondences {
            let Some(normal) = target.normal(c.target) else { continue };
            let gradient = M::gradient_along(&c.moved, &normal); // of n . (exp(delta) p - q)
            let weighted = gradient * c.weight;
            sums.H += M::Matrix::outer(&weighted, &gradient);
            sums.b += weighted * c.residual;
        }
        sums
    }
}

/// Plane to plane: Segal, Haehnel and Thrun, "Generalized-ICP", RSS 2009, with the covariances of both points regularised to
/// the eigenvalues [`PLANE_THICKNESS`], 1 and 1, so that they depend on the normals only; the step by Gauss-Newton.
///
/// The residual is scaled to metres: where both normals agree, it is the distance along them. A source point without a normal is
/// given that of its partner.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlaneToPlane;

/// Variance of a point along the normal of its surface, divided by that along the surface.
pub const PLANE_THICKNESS: f64 = 1e-3;

/// The inverse of C_target + C_source with C = I - (1 - e) n n^T, scaled by 2e. The sum's eigenvectors are a + b, a - b and
/// their cross product for unit normals a and b, so the inverse is isotropic + sum.1 sum.0 sum.0^T + difference.1
/// difference.0 difference.0^T without a division that could fail.
struct Precision<P> {
    sum: (P, f64),
    difference: (P, f64),
}

impl<P: Vector> Precision<P> {
    fn new(target: &P, source: &P) -> Self {
        // The covariance does not depend on the sign of the normal.
        let cosine = target.dot(source);
        let share = 1.0 - PLANE_THICKNESS;
        let factor = |cosine: f64| 2.0 * PLANE_THICKNESS * share / (4.0 * (2.0 - share * (1.0 + cosine)));
        Self { sum: (*target + *source, factor(cosine)), difference: (*target - *source, factor(-cosine)) }
    }

    fn sq_length(&self, vector: &P) -> f64 {
        let (sum, difference) = (self.sum.0.dot(vector), self.difference.0.dot(vector));
        PLANE_THICKNESS * vector.norm_squared() + self.sum.1 * sum * sum + self.difference.1 * difference * difference
    }
}

impl<M: RigidMotion, T: SurfaceTarget<Point = M::Point>> Factor<M, T> for PlaneToPlane {
    fn residual(&self, target: &T, index: u32, moved: &M::Point, normal: Option<&M::Point>) -> Option<f64> {
        let target_normal = target.normal(index)?;
        let precision = Precision::new(&target_normal, normal.unwrap_or(&target_normal));
        Some(precision.sq_length(&(*moved - target.point(index))).sqrt())
    }

    fn normal_equations(&self, target: &T, correspondences: &[Correspondence<M::Point>]) -> NormalEquations<M> {
        let mut sums = NormalEquations::zeros();
        for c in correspondences {
            let Some(target_normal) = target.normal(c.target) else { continue };
            let precision = Precision::new(&target_normal, c.normal.as_ref().unwrap_or(&target_normal));
            let (J, d) = (M::point_jacobian(&c.moved), c.moved - target.point(c.target));
            let isotropic = PLANE_THICKNESS * c.weight;
            sums.H += J.gramian() * isotropic;
            sums.b += J.pull_back(&d) * isotropic;
            for (direction, factor) in [precision.sum, precision.difference] {
                let gradient = J.pull_back(&direction);
                sums.H += M::Matrix::outer(&gradient, &gradient) * (factor * c.weight);
                sums.b += gradient * (direction.dot(&d) * factor * c.weight);
            }
        }
        sums
    }
}

pub(crate) fn gauss_newton_step<M: RigidMotion>(equations: &NormalEquations<M>) -> Option<M> {
    let damping = M::Matrix::identity() * (RELATIVE_DAMPING * equations.H.trace());
    (equations.H + damping).solve_cholesky(&equations.b).map(|step| M::exp(&-step))
}

/// Damping (Levenberg 1944) divided by the trace of H: so small that it affects only undetermined directions.
pub(crate) const RELATIVE_DAMPING: f64 = 1e-9;

/// The motion with the least weighted sum of squared distances between `motion * source` and `target`.
///
/// Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 13 (1991),
/// eqs. 34-42 with scale 1. `None` when no pair has weight or a coordinate is not finite; where the pairs do not determine the
/// rotation (one pair, or all in one point), it is one of the best ones.
pub fn best_rigid_motion<M: RigidMotion>(pairs: impl Iterator<Item = (M::Point, M::Point, f64)> + Clone) -> Option<M> {
    let (mut sum, mut source_mean, mut target_mean) = (0.0, M::Point::zeros(), M::Point::zeros());
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

    let covariance = pairs.fold(M::PointMatrix::zeros(), |covariance, (source, target, weight)| {
        covariance + M::PointMatrix::outer(&(target - target_mean), &(source - source_mean)) * (weight / sum) // eq. 38
    });
    let R = M::best_rotation(&covariance)?; // eq. 40
    Some(M::from_parts(&R, &(target_mean - R.apply(&source_mean)))) // eq. 41
}
