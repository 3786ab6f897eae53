//! The graph between the anchors of submaps: what is left open between these, without the poses in between.

use nalgebra::Matrix3;

use super::LoopClosure;
use crate::geometry::Pose2;
use crate::graph::pose_graph::{BetweenFactor, PlanarFactor};
use crate::odometry::planar::information::chained;

impl LoopClosure {
    /// The pose of every submap's anchor.
    pub(super) fn anchor_poses(&self) -> Vec<Pose2> {
        self.submaps.iter().map(|submap| self.poses[submap.anchor]).collect()
    }

    /// The graph between anchors: the chain summed up, and the loops. Where only what is certain counts, broken links leave a
    /// radian and a metre open: far more than is certain, and not so much that differences of covariances drown in rounding.
    pub(super) fn anchor_factors(&self, only_certain: bool) -> Vec<PlanarFactor> {
        let mut informations = vec![Matrix3::zeros(); self.poses.len()];
        for factor in self.chain.iter().filter(|factor| !only_certain || !self.links[factor.to].is_broken) {
            informations[factor.to] += factor.information * factor.weight(factor.squared_distance(&self.poses));
        }
        let mut factors = Vec::new();
        for (index, pair) in self.submaps.windows(2).enumerate() {
            let (from, to) = (pair[0].anchor, pair[1].anchor);
            let (mut T, mut covariance) = (Pose2::identity(), Matrix3::zeros());
            let steps = self.poses[from..=to].windows(2).map(|pair| pair[0].inverse() * pair[1]);
            for (step, information) in steps.zip(&informations[from + 1..=to]) {
                let of_step = information.try_inverse().unwrap_or_else(Matrix3::identity);
                covariance = chained((&T, &covariance), &of_step);
                T *= step;
            }
            let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
            factors.push(BetweenFactor { from: index, to: index + 1, T_from_to: T, information, is_switchable: false });
        }
        factors.extend(self.loops.iter().map(|closed| BetweenFactor {
            from: closed.candidate.target,
            to: closed.candidate.source,
            ..closed.factor
        }));
        factors
    }
}
