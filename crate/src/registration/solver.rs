//! The step from normal equations: restricted to a subspace of motions, and damped.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::factors::{Correspondence, Factor, NormalEquations, gauss_newton_step};
use super::target::Target;
use crate::geometry::rotation::twist_about;
use crate::geometry::{Pose3, RigidMotion, SquareMatrix, Vector};

/// Degrees of freedom of a motion in space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Motion {
    /// All six degrees of freedom.
    #[default]
    Free,
    /// A robot on a floor: x, z and the rotation about the y axis of the target's frame, which is normal to the floor.
    Planar,
}

impl Motion {
    /// The undamped solver for these degrees of freedom.
    pub fn solver(self) -> Solver<Pose3> {
        let subspace = match self {
            Self::Free => None,
            Self::Planar => Some(Subspace::spanned_by(&[1, 3, 5])), // wy, x and z
        };
        Solver { subspace, damping: None }
    }

    /// The allowed motion nearest to `T`: itself, or its rotation about y and its x and z.
    pub fn nearest(self, T: &Pose3) -> Pose3 {
        match self {
            Self::Free => *T,
            Self::Planar => {
                let t = T.translation.vector;
                let rotation = twist_about(&T.rotation, &Vector3::y_axis());
                Pose3::from_parts(Vector3::new(t.x, 0.0, t.z).into(), rotation)
            }
        }
    }
}

/// A linear subspace of the tangent space, as the orthogonal projection onto it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Subspace<M: RigidMotion> {
    projection: M::Matrix,
}

impl<M: RigidMotion> Subspace<M> {
    /// The subspace spanned by axes of the tangent space, given by their indices.
    ///
    /// # Panics
    /// When an index is out of range.
    pub(crate) fn spanned_by(axes: &[usize]) -> Self {
        let mut projection = M::Matrix::zeros();
        for &axis in axes {
            projection[(axis, axis)] = 1.0;
        }
        Self { projection }
    }

    /// The part of a subspace orthogonal to a direction; all of it where the direction is orthogonal to it already.
    fn across(projection: &M::Matrix, direction: &M::Tangent) -> Self {
        let held = projection.apply(direction);
        let sq_length = held.norm_squared();
        let held_by = if sq_length > 0.0 { M::Matrix::outer(&held, &held) / sq_length } else { M::Matrix::zeros() };
        Self { projection: *projection - held_by }
    }

    /// The equations whose solution is that of P^T H P x = -P^T b in the subspace, P being a basis of it: directions orthogonal
    /// to it get a stiffness that is decoupled from it.
    pub(crate) fn restrict(&self, equations: &NormalEquations<M>) -> NormalEquations<M> {
        let across = M::Matrix::identity() - self.projection;
        let stiffness = equations.H.trace().max(f64::MIN_POSITIVE);
        NormalEquations {
            H: self.projection * equations.H * self.projection + across * stiffness,
            b: self.projection.apply(&equations.b),
        }
    }
}

/// How the loop computes its next step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solver<M: RigidMotion> {
    /// Subspace of the free perturbations on the left of the estimate; `None`: all are free.
    pub subspace: Option<Subspace<M>>,
    /// Initial damping, as a share of the largest diagonal entry of H; `None`: undamped Gauss-Newton steps, or the closed form
    /// where the factor has one. With damping, a step is accepted only if it reduces the weighted residuals; otherwise the
    /// damping grows tenfold, and it shrinks again after accepted steps (Levenberg 1944).
    pub damping: Option<f64>,
}

/// Most attempts at a damped step; if all fail, these pairs cannot improve the estimate.
const MAX_TRIES: usize = 10;
/// Factor by which the damping grows when a step fails, and shrinks when it is accepted.
pub(crate) const DAMPING_FACTOR: f64 = 10.0;

impl<M: RigidMotion> Default for Solver<M> {
    /// All degrees of freedom, undamped.
    fn default() -> Self {
        Self { subspace: None, damping: None }
    }
}

impl<M: RigidMotion> Solver<M> {
    /// All degrees of freedom, by undamped Gauss-Newton steps even where the factor has a closed form.
    pub fn gauss_newton() -> Self {
        Self { subspace: Some(Subspace { projection: M::Matrix::identity() }), damping: None }
    }

    /// The step for these correspondences; `None` where they do not determine one. `damping` is carried from step to step.
    pub(super) fn step<T, F>(
        &self,
        factor: &F,
        target: &T,
        correspondences: &[Correspondence<M::Point>],
        damping: &mut f64,
    ) -> Option<M>
    where
        T: Target<Point = M::Point>,
        F: Factor<M, T>,
    {
        if self.subspace.is_none() && self.damping.is_none() {
            return factor.step(target, correspondences);
        }
        let equations = self.restricted(factor.normal_equations(target, correspondences));
        if self.damping.is_none() {
            return gauss_newton_step(&equations);
        }
        let cost =
            |step: Option<&M>| -> f64 { correspondences.iter().map(|c| sq_residual(factor, target, c, step)).sum() };
        let (before, scale) = (cost(None), largest(&equations.H.diagonal()));
        for _ in 0..MAX_TRIES {
            let mut damped = equations;
            damped.H += M::Matrix::identity() * (*damping * scale);
            let step: M = gauss_newton_step(&damped)?;
            if cost(Some(&step)) <= before {
                *damping /= DAMPING_FACTOR;
                return Some(step);
            }
            *damping = (*damping * DAMPING_FACTOR).max(f64::EPSILON);
        }
        Some(M::identity())
    }

    /// The solver with one more direction of perturbations fixed, so that only the others are solved for (Zhang, Kaess and
    /// Singh, "On degeneracy of optimization-based state estimation problems", ICRA 2016).
    pub(crate) fn holding(&self, direction: &M::Tangent) -> Self {
        let projection = self.subspace.map_or_else(M::Matrix::identity, |subspace| subspace.projection);
        Self { subspace: Some(Subspace::across(&projection, direction)), ..*self }
    }

    /// The normal equations restricted to the free directions.
    pub(crate) fn restricted(&self, equations: NormalEquations<M>) -> NormalEquations<M> {
        self.subspace.as_ref().map_or(equations, |subspace| subspace.restrict(&equations))
    }
}

/// The largest entry of a vector.
fn largest(vector: &impl Vector) -> f64 {
    vector.as_slice().iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// The weighted square of a correspondence's residual after a step.
fn sq_residual<M, T, F>(factor: &F, target: &T, correspondence: &Correspondence<M::Point>, step: Option<&M>) -> f64
where
    M: RigidMotion,
    T: Target<Point = M::Point>,
    F: Factor<M, T>,
{
    let Correspondence { target: index, moved, normal, residual, weight, .. } = correspondence;
    let residual = step.map_or(*residual, |step| {
        let normal = normal.map(|normal| step.rotate(&normal));
        factor.residual(target, *index, &step.act(moved), normal.as_ref()).unwrap_or(0.0)
    });
    weight * residual * residual
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use nalgebra::{Matrix3, Matrix6, SMatrix, Vector6};

    #[test]
    fn the_restricted_solution_is_that_in_a_basis_of_the_subspace() {
        let A = Matrix6::from_fn(|row, column| ((row * 7 + column * 3 + 1) as f64).sin());
        let (H, b) = (A * A.transpose() + Matrix6::identity(), Vector6::from_fn(|row, _| (row as f64).cos()));
        let restricted = Subspace::<Pose3>::spanned_by(&[1, 3, 5]).restrict(&NormalEquations { H, b });
        let found = -restricted.H.cholesky().unwrap().solve(&restricted.b);
        let P = SMatrix::<f64, 6, 3>::from_fn(|row, column| f64::from(row == 2 * column + 1));
        let expected = -(P * (P.transpose() * H * P).cholesky().unwrap().solve(&(P.transpose() * b)));
        assert!((found - expected).norm() < 1e-12, "{found}");
    }

    #[test]
    fn the_nearest_planar_motion_keeps_the_rotation_about_y() {
        let T = Pose3::exp(&Vector6::new(0.0, 2.5, 0.0, 1.0, 0.0, -2.0));
        assert!((Motion::Planar.nearest(&T).inverse() * T).log().norm() < 1e-12);
        let tilted = T * Pose3::exp(&Vector6::new(0.1, 0.0, -0.05, 0.0, 0.3, 0.0));
        let planar = Motion::Planar.nearest(&tilted);
        assert!(planar.translation.y.abs() < 1e-15);
        let R: Matrix3<f64> = planar.rotation.to_rotation_matrix().into_inner();
        let closeness = |R: &Matrix3<f64>| (R.transpose() * tilted.rotation.to_rotation_matrix().matrix()).trace();
        for turn in [-1e-3, 1e-3] {
            let other = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn) * planar.rotation;
            assert!(closeness(&R) > closeness(&other.to_rotation_matrix().into_inner()));
        }
        assert_eq!(Motion::Free.nearest(&tilted), tilted);
    }
}
