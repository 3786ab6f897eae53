//! What is known of where a scan was taken.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::field::MapField;
use super::likelihood::Fit;
use crate::geometry::Pose2;
use crate::odometry::assessment::Status;

/// A place where a scan may have been taken, with its probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Pose of the sensor in the world of the map.
    pub T_world_sensor: Pose2,
    /// Covariance of x, y (m) and heading (rad) in the world.
    pub covariance: Matrix3<f64>,
    /// 0..=1.
    pub probability: f64,
}

/// Where a scan was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Location {
    /// The most likely place; `None` where there is none.
    pub place: Option<Place>,
    /// Its rivals, the most likely one first.
    pub rivals: Vec<Place>,
    /// Probability that it was taken elsewhere: outside of the map, or where the map has changed beyond recognition.
    pub elsewhere: f64,
    /// Good, doubtful or lost.
    pub status: Status,
    /// Why, in plain English; empty when good.
    pub reason: String,
    /// Share of its beams that end on a wall of the map, 0..=1.
    pub agreement: f64,
    /// Whether the place was known when the scan came: else later scans told it.
    pub is_known_at_once: bool,
}

/// What is known after all scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Verdict {
    /// Some scan's place is certain.
    Found,
    /// Several places are possible, or too little was seen.
    Undecided,
    /// The scans were not taken in this map, or it has changed beyond recognition.
    NotInMap,
}

impl Location {
    /// Of a scan without a place.
    pub(super) fn unknown(reason: &str) -> Self {
        Self {
            place: None,
            rivals: Vec::new(),
            elsewhere: 0.5,
            status: Status::Lost,
            reason: reason.to_owned(),
            agreement: 0.0,
            is_known_at_once: false,
        }
    }
}

impl Place {
    /// Of a pose in the grid's frame with its covariance (perturbation on the right, rotation first), and of beams that were taken there.
    pub(super) fn new(field: &MapField, pose: &Pose2, covariance: &Matrix3<f64>, fit: &Fit, probability: f64) -> Self {
        let T_world_sensor = field.in_world(pose);
        let (sin, cos) = T_world_sensor.rotation.angle().sin_cos();
        let to_world = Matrix3::new(0.0, cos, -sin, 0.0, sin, cos, 1.0, 0.0, 0.0);
        let (heading, position) = fit.shared_variances();
        let of_map = Matrix3::from_diagonal(&Vector3::new(position, position, heading));
        let covariance = to_world * covariance * to_world.transpose() + of_map;
        Self { T_world_sensor, covariance, probability }
    }

    /// Standard deviation of the position (m) and of the heading (rad).
    pub fn sigmas(&self) -> (f64, f64) {
        let sigma = |variance: f64| variance.max(0.0).sqrt();
        (sigma(self.covariance[(0, 0)] + self.covariance[(1, 1)]), sigma(self.covariance[(2, 2)]))
    }
}
