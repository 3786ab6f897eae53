//! Poses in the form that the metrics use: positions and rotation matrices.

use nalgebra::{Matrix3, Vector3};

use super::umeyama::Similarity;
use crate::geometry::Pose3;
use crate::geometry::rotation::nearest_rotation;
use crate::io::trajectory::Trajectory;
use crate::{Error, Result};

/// Poses with rotations as matrices. Matrices of a file are not made orthonormal, since evo does not do so either and the last
/// digits of its figures depend on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// m.
    pub positions: Vec<Vector3<f64>>,
    /// As long as the positions, where orientations are known.
    pub rotations: Option<Vec<Matrix3<f64>>>,
    /// s; as long as the positions, where times are known.
    pub stamps: Option<Vec<f64>>,
}

impl Path {
    /// The poses of a trajectory with these indices.
    pub fn of(trajectory: &Trajectory, indices: impl Iterator<Item = usize> + Clone) -> Self {
        let matrices = trajectory.matrices();
        Self {
            positions: indices.clone().map(|index| trajectory.positions[index]).collect(),
            rotations: matrices.map(|matrices| indices.clone().map(|index| matrices[index]).collect()),
            stamps: trajectory.stamps.as_ref().map(|stamps| indices.map(|index| stamps[index]).collect()),
        }
    }

    /// The poses, with the identity for unknown orientations.
    pub fn poses(&self) -> Vec<Pose3> {
        (0..self.len()).map(|index| self.pose(index)).collect()
    }

    pub(super) fn pose(&self, index: usize) -> Pose3 {
        let rotation = self.rotations.as_ref().and_then(|rotations| nearest_rotation(&rotations[index]));
        Pose3::from_parts(self.positions[index].into(), rotation.unwrap_or_default())
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no pose.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The poses after an alignment: positions are scaled, rotated and translated, orientations rotated.
    #[must_use]
    pub fn aligned(&self, by: &Similarity) -> Self {
        let position = |p: &Vector3<f64>| by.rotation * (p * by.scale) + by.translation;
        Self {
            positions: self.positions.iter().map(position).collect(),
            rotations: self.rotations.as_ref().map(|all| all.iter().map(|R| by.rotation * R).collect()),
            stamps: self.stamps.clone(),
        }
    }

    /// Path travelled up to each pose (m), from 0.
    pub fn distances(&self) -> Vec<f64> {
        let mut travelled = 0.0;
        let steps = self.positions.windows(2).map(|pair| (pair[1] - pair[0]).norm());
        let sums = steps.map(|step| {
            travelled += step;
            travelled
        });
        std::iter::once(0.0).chain(sums).take(self.len()).collect()
    }

    /// Path travelled from the first pose to the last (m).
    pub fn length(&self) -> f64 {
        self.positions.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }
}

/// T_a^-1 T_b, with the transpose as the inverse of the rotation.
pub(super) fn relative(
    (R_a, t_a): (&Matrix3<f64>, &Vector3<f64>),
    (R_b, t_b): (&Matrix3<f64>, &Vector3<f64>),
) -> (Matrix3<f64>, Vector3<f64>) {
    // As evo multiplies it out: R_a^T t_b + (-R_a^T t_a).
    let inverse = R_a.transpose();
    (inverse * R_b, inverse * t_b - inverse * t_a)
}

/// The angle (rad) of the rotation nearest to a matrix.
pub(super) fn angle(R: &Matrix3<f64>) -> Result<f64> {
    let rotation = nearest_rotation(R);
    rotation.map(|rotation| rotation.angle()).ok_or_else(|| Error::whole("A matrix is not a rotation", ""))
}
