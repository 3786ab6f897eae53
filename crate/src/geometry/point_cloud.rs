//! Points in space, with the normals and colours that the file holds.

use glam::{DVec3, Vec3};

use super::point_times::PointTimes;

/// Points in metres in one frame, with normals and colours where the source has them.
///
/// `normals`, `colors`, `rounded_off` and `times` are either absent or as long as `positions`.
/// Positions are stored in single precision relative to `origin`, which is zero unless the coordinates are so large
/// (map projections) that single precision would cost more than a fraction of a millimetre.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointCloud {
    /// Point positions (m), relative to `origin`.
    pub positions: Vec<Vec3>,
    /// Unit normals, in the frame of the positions.
    pub normals: Option<Vec<Vec3>>,
    /// Red, green, blue, 0..=255.
    pub colors: Option<Vec<[u8; 3]>>,
    /// Offset to add to every position (m).
    pub origin: DVec3,
    /// Rounding error of each position (m): the file's double minus `origin` and minus the entry of `positions`. Absent where
    /// all of them are zero.
    pub rounded_off: Option<Vec<Vec3>>,
    /// When each point was measured, in the unit of the file or, once that is known, in seconds from the frame's time stamp.
    pub times: Option<PointTimes>,
}

impl PointCloud {
    /// Largest |z| of a point of a planar scan (m): the rounding error of a scan that was rotated into the plane.
    const MAX_OFF_PLANE: f32 = 1e-6;

    /// A cloud of positions alone.
    pub fn from_positions(positions: Vec<Vec3>) -> Self {
        Self { positions, ..Self::default() }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The points with these indices.
    #[must_use]
    pub(crate) fn selected(&self, kept: &[usize]) -> Self {
        fn of<T: Copy>(all: &[T], kept: &[usize]) -> Vec<T> {
            kept.iter().map(|&point| all[point]).collect()
        }
        Self {
            positions: of(&self.positions, kept),
            normals: self.normals.as_ref().map(|normals| of(normals, kept)),
            colors: self.colors.as_ref().map(|colors| of(colors, kept)),
            origin: self.origin,
            rounded_off: self.rounded_off.as_ref().map(|rest| of(rest, kept)),
            times: self.times.as_ref().map(|times| times.selected(kept)),
        }
    }

    /// A point in the precision of the file (m), relative to `origin`.
    ///
    /// # Panics
    /// When `index` is out of range.
    pub fn point(&self, index: usize) -> DVec3 {
        let rounded_off = self.rounded_off.as_ref().map_or(DVec3::ZERO, |all| all[index].as_dvec3());
        self.positions[index].as_dvec3() + rounded_off
    }

    /// A point with the origin in it (m).
    ///
    /// # Panics
    /// When `index` is out of range.
    pub(crate) fn absolute_point(&self, index: usize) -> DVec3 {
        self.point(index) + self.origin
    }

    /// Whether absolute points need double precision: the cloud has an origin, or was read from doubles.
    pub(crate) fn needs_doubles(&self) -> bool {
        self.origin != DVec3::ZERO || self.rounded_off.is_some()
    }

    /// The finite points in the precision of the file (m), relative to `origin`, with their indices.
    pub fn finite_points(&self) -> impl Iterator<Item = (usize, DVec3)> {
        let finite = (0..self.len()).filter(|&index| self.positions[index].is_finite());
        finite.map(|index| (index, self.point(index)))
    }

    /// Whether all points lie in the plane z = 0, to within a micrometre: the cloud is then a planar laser scan.
    /// Non-finite points do not count; an empty cloud is not planar.
    pub fn is_planar(&self) -> bool {
        let mut finite = self.positions.iter().filter(|p| p.is_finite()).peekable();
        finite.peek().is_some() && self.origin.z == 0.0 && finite.all(|p| p.z.abs() <= Self::MAX_OFF_PLANE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planar_means_every_finite_z_is_zero() {
        let cloud = |points: &[[f32; 3]]| PointCloud::from_positions(points.iter().map(|&p| Vec3::from(p)).collect());
        assert!(cloud(&[[1.0, 2.0, 0.0], [f32::NAN, 0.0, f32::NAN], [3.0, 4.0, -0.0]]).is_planar());
        assert!(cloud(&[[1.0, 2.0, 1e-9], [3.0, 4.0, -1e-7]]).is_planar());
        assert!(!cloud(&[[1.0, 2.0, 0.0], [1.0, 2.0, 1e-3]]).is_planar());
        assert!(!cloud(&[]).is_planar());
        assert!(!cloud(&[[f32::NAN; 3]]).is_planar());
    }
}
