//! Poses as the metrics take them.

use nalgebra::{Matrix3, Vector3};

use super::umeyama::Similarity;
use crate::io::trajectory::Trajectory;

/// Poses with their rotations as matrices, which are kept as the file has them: rounded ones are not made whole, since
/// evo does not either, and the last digits of its figures depend on it.
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

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no pose.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The poses after an alignment: positions are scaled, turned and moved, rotations turned.
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
