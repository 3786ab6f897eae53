//! Poses as the lab moves them: by coordinates that a reader knows.

use nalgebra::{Translation2, Translation3, UnitComplex, UnitQuaternion, Vector3, Vector6};

use crate::geometry::{Embedding, Pose2, Pose3};

/// A motion by offsets from another: (theta, x, y) in the plane, (wx, wy, wz, x, y, z) in space. The source turns about its own
/// origin, around the axes of the target's frame, and moves along those. Offsets are coordinates and no tangent vector: x and y
/// do not depend on the turn.
pub trait LabMotion: Embedding {
    /// This pose, turned and moved.
    #[must_use]
    fn offset(&self, offsets: &Self::Tangent) -> Self;
    /// The offsets that lead to `other`.
    fn offsets_to(&self, other: &Self) -> Self::Tangent;
    /// x, y and z of a point; z is 0 in the plane.
    fn xyz(point: &Self::Point) -> [f64; 3];
}

impl LabMotion for Pose2 {
    fn offset(&self, offsets: &Vector3<f64>) -> Self {
        let translation = Translation2::from(self.translation.vector + offsets.yz());
        Self::from_parts(translation, UnitComplex::new(offsets.x) * self.rotation)
    }

    fn offsets_to(&self, other: &Self) -> Vector3<f64> {
        let moved = other.translation.vector - self.translation.vector;
        Vector3::new((other.rotation * self.rotation.inverse()).angle(), moved.x, moved.y)
    }

    fn xyz(point: &nalgebra::Vector2<f64>) -> [f64; 3] {
        [point.x, point.y, 0.0]
    }
}

impl LabMotion for Pose3 {
    fn offset(&self, offsets: &Vector6<f64>) -> Self {
        let translation = Translation3::from(self.translation.vector + offsets.fixed_rows::<3>(3));
        let turn = UnitQuaternion::from_scaled_axis(offsets.fixed_rows::<3>(0).into_owned());
        Self::from_parts(translation, turn * self.rotation)
    }

    fn offsets_to(&self, other: &Self) -> Vector6<f64> {
        let turn = (other.rotation * self.rotation.inverse()).scaled_axis();
        let moved = other.translation.vector - self.translation.vector;
        Vector6::new(turn.x, turn.y, turn.z, moved.x, moved.y, moved.z)
    }

    fn xyz(point: &Vector3<f64>) -> [f64; 3] {
        (*point).into()
    }
}
