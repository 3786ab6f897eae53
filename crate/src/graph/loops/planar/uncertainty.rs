//! How far two nodes of a graph may be from where they seem to be, by the best way between them.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::Matrix3;

use crate::geometry::{Pose2, RigidMotion};

/// What one relation, or a chain of them, leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drift {
    /// Variance of the position (m^2).
    pub translation: f64,
    /// Variance of the heading (rad^2).
    pub rotation: f64,
    /// Length of the way (m).
    pub length: f64,
}

/// An error of heading at the beginning of a way moves its end by at most so much of it (m): what lies further back has
/// been seen and corrected.
const LONGEST_LEVER: f64 = 15.0;

impl Drift {
    /// Of a relation with this covariance (rotation first) over this distance (m).
    pub fn new(covariance: &Matrix3<f64>, length: f64) -> Self {
        Self { rotation: covariance[(0, 0)], translation: covariance[(1, 1)] + covariance[(2, 2)], length }
    }

    fn then(self, other: Self) -> Self {
        Self {
            translation: self.translation + other.translation,
            rotation: self.rotation + other.rotation,
            length: self.length + other.length,
        }
    }

    /// Standard deviation of the position (m), an error of heading half-way included.
    pub fn position_sigma(&self) -> f64 {
        let lever = (self.length / 2.0).min(LONGEST_LEVER);
        (self.translation + self.rotation * lever * lever).sqrt()
    }

    /// Standard deviation of the heading (rad).
    pub fn heading_sigma(&self) -> f64 {
        self.rotation.sqrt()
    }

    /// What the shortest way is short in (m^2).
    fn cost(&self) -> f64 {
        self.translation + self.rotation * LONGEST_LEVER
    }
}

struct Visit {
    cost: f64,
    node: usize,
    drift: Drift,
}

impl PartialEq for Visit {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Visit {}
impl PartialOrd for Visit {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Visit {
    /// The cheapest is the greatest: it is visited first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.node.cmp(&self.node))
    }
}

/// The drift from one node to each of `num_nodes` along the ways that leave least open (Dijkstra 1959). `None` where there
/// is no way.
pub fn drifts_from(start: usize, num_nodes: usize, edges: &[(usize, usize, Drift)]) -> Vec<Option<Drift>> {
    let mut neighbors = vec![Vec::new(); num_nodes];
    for &(a, b, drift) in edges {
        neighbors[a].push((b, drift));
        neighbors[b].push((a, drift));
    }
    let mut drifts: Vec<Option<Drift>> = vec![None; num_nodes];
    let mut heap = BinaryHeap::from([Visit { cost: 0.0, node: start, drift: Drift::default() }]);
    while let Some(Visit { node, drift, .. }) = heap.pop() {
        if drifts[node].is_some() {
            continue;
        }
        drifts[node] = Some(drift);
        for &(neighbor, step) in &neighbors[node] {
            if drifts[neighbor].is_none() {
                let further = drift.then(step);
                heap.push(Visit { cost: further.cost(), node: neighbor, drift: further });
            }
        }
    }
    drifts
}

/// Covariance of the motion through a chain of motions, each with its own covariance (perturbations on the left, rotation
/// first): the sum of them, carried to the beginning.
pub fn chained_covariance<'a>(links: impl Iterator<Item = (&'a Pose2, &'a Matrix3<f64>)>) -> Matrix3<f64> {
    let mut T = Pose2::identity();
    let mut sum = Matrix3::zeros();
    for (motion, covariance) in links {
        let adjoint = T.adjoint();
        sum += adjoint * covariance * adjoint.transpose();
        T *= motion;
    }
    sum
}
