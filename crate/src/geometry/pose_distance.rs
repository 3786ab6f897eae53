//! The distance of two poses in one number.

use super::Pose3;

/// Translation (m) that changes the view as much as a rotation by a radian: the typical distance of the surfaces that a camera in a
/// room sees.
pub(crate) const METRES_PER_RADIAN: f64 = 2.0;

/// Distance of two poses by its effect on the view (m, `METRES_PER_RADIAN` per radian).
pub(crate) fn pose_distance(a: &Pose3, b: &Pose3) -> f64 {
    let between = a.inverse() * b;
    between.translation.vector.norm() + METRES_PER_RADIAN * between.rotation.angle()
}
