//! The covariance of the pose of one node of a pose graph relative to another.

use nalgebra::Matrix3;

use crate::geometry::{Pose2, RigidMotion};
use crate::graph::pose_graph::PlanarFactor;
use crate::graph::sparse::{BlockCholesky, BlockMatrix};

/// The covariances of poses in the graph of anchors, one row of blocks at a time.
pub struct RelativeCovariances {
    poses: Vec<Pose2>,
    /// `rows[i][j]`, j <= i: covariance of the perturbations on the left of pose i and pose j.
    rows: Vec<Vec<Matrix3<f64>>>,
}

impl RelativeCovariances {
    /// Of all pairs. `None` where the factors leave a pose open altogether.
    #[inline(never)]
    pub fn new(poses: &[Pose2], factors: &[PlanarFactor]) -> Option<Self> {
        let num_variables = poses.len().checked_sub(1)?;
        let mut H = BlockMatrix::<Matrix3<f64>>::new(num_variables);
        for factor in factors {
            let adjoint = poses[factor.from].inverse().adjoint();
            let weight = factor.weight(factor.squared_distance(poses));
            let block = adjoint.tr_mul(&(factor.information * adjoint)) * weight;
            H.add_between(factor.from, factor.to, &block);
        }
        let mut solver = BlockCholesky::new(&H);
        let factored = solver.factor(&H).ok()?;
        let mut rows: Vec<Vec<Matrix3<f64>>> = (1..=poses.len()).map(|length| vec![Matrix3::zeros(); length]).collect();
        for variable in 0..num_variables {
            let columns = factored.inverse_columns(variable);
            for (block, column) in rows[variable + 1][1..].iter_mut().zip(&columns) {
                *block = column.transpose();
            }
        }
        Some(Self { poses: poses.to_vec(), rows })
    }

    /// Covariance of the pose of `b` in the frame of `a`, by a perturbation on its left.
    pub fn between(&self, a: usize, b: usize) -> Matrix3<f64> {
        let rows = &self.rows;
        let both = rows[a.max(b)][a.min(b)];
        let sum = rows[a][a] + rows[b][b] - both - both.transpose();
        let adjoint = self.poses[a].inverse().adjoint();
        adjoint * sum * adjoint.transpose()
    }
}
