//! Poses that a scan may have, compared with each other.

use nalgebra::Vector2;

use super::belief::Finding;
use crate::geometry::RigidMotion;
use crate::map::local::PlanarRegistration;
use crate::odometry::assessment::Assessment;

/// About this number of points of a scan or submap are used in a correlative search.
pub const NUM_SEARCHED_POINTS: usize = 160;
/// One hypothesis fits about as well as another one when its returns disagree by no more than this beyond those of the other.
/// With 0.7 and 1.4 times as much: `docs/measurements/laser.md`, leave one out and thresholds.
const RIVAL_DISAGREEMENT: f64 = 0.04;

/// A pose that a scan may have, by a registration, with its assessment.
pub struct Hypothesis {
    /// The registration.
    pub registration: PlanarRegistration,
    /// How far it is to be trusted.
    pub assessment: Assessment,
}

/// Whether about as many returns agree at one pose as at another one.
pub fn agrees_as_well(agreement: f64, other: f64) -> bool {
    agreement > other - RIVAL_DISAGREEMENT
}

/// Whether one hypothesis fits about as well as another one: as many of its returns agree, and it lies on the map with at
/// least this share of what the other does.
pub fn fits_as_well(one: &Hypothesis, other: &Hypothesis, share: f64) -> bool {
    agrees_as_well(one.assessment.agreement, other.assessment.agreement)
        && one.registration.fitness > share * other.registration.fitness
}

/// What a second place where the scan fits about as well says of the first.
pub fn rival_of_best(best: &Hypothesis, rival: &Hypothesis) -> Finding {
    let off = best.registration.T_target_source.inverse() * rival.registration.T_target_source;
    let agreement = (rival.assessment.agreement, best.assessment.agreement);
    Finding::Rival { distance: off.translation_norm(), turn: off.rotation_angle(), agreement }
}

/// At least `about` of a scan's points, and fewer than twice as many, in equal steps by index; all where there are fewer.
pub fn thinned(points: &[Vector2<f64>], about: usize) -> Vec<Vector2<f64>> {
    points.iter().copied().step_by((points.len() / about).max(1)).collect()
}
