//! How far a registered pose may slide along the direction that the walls leave most open.
//!
//! Gauss-Newton linearises about one pose: along a bare corridor the normals of ragged walls, which point anywhere, tell it of a motion that
//! the nearest walls do not hold fast, and of two poses that fit it knows one. Here the likelihood itself is compared along that direction
//! (Olson, "Real-Time Correlative Scan Matching" (2009), section III.E): where it is flat, the prior alone tells the position, and where it has
//! a second maximum, both count.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::field::MapField;
use super::likelihood::{Beam, BeamModel};
use super::refine::{INDEPENDENT_BEAMS, Prior, Refined, inverse};
use crate::geometry::quantile::THREE_SIGMA;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::information::CERTAIN_SIGMA;
use crate::odometry::planar::motion_noise::EXPECTED_WRONG;

/// Poses are compared as far as one whose position is certain may be off (m).
const REACH: f64 = THREE_SIGMA * CERTAIN_SIGMA.1;
/// Cells of the map across the direction, to each side: as far as a registered wall's cells are looked at for its normal.
const CELLS_ACROSS: i32 = 2;

/// What is known of the position of a registered pose along the direction that is known least.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slide {
    /// That direction, in the frame of the pose, rotation first.
    direction: Vector3<f64>,
    /// The mean of all positions that were compared, from the registered one in its frame (m), ...
    mean: Vector2<f64>,
    /// ... that along the direction (m), ...
    along: f64,
    /// ... and the variance about it (m^2).
    variance: f64,
}

impl Slide {
    /// Of beams that were registered from a prior.
    pub(super) fn of(field: &MapField, model: &BeamModel, beams: &[Beam], refined: &Refined, prior: &Prior) -> Self {
        let axes = axes(refined);
        let density_before = DensityBefore::new(refined, prior, &axes);
        let compared = offsets(field.resolution).map(|off| {
            let pose = refined.pose * Pose2::new(axes * off, 0.0);
            let score: f64 = beams.iter().map(|beam| field.score_of_end(model, &pose.act(&beam.end))).sum();
            (off, INDEPENDENT_BEAMS * score + density_before.log_at(&off))
        });
        let mut weighed: Vec<(Vector2<f64>, f64)> = compared.collect();
        let largest = weighed.iter().fold(f64::MIN, |largest, (_, log)| largest.max(*log));
        for (_, weight) in &mut weighed {
            *weight = (*weight - largest).exp();
        }
        let sum: f64 = weighed.iter().map(|(_, weight)| weight).sum();
        let mean = weighed.iter().map(|(off, weight)| off * *weight).sum::<Vector2<f64>>() / sum;
        let variance = weighed.iter().map(|(off, weight)| weight * (off.x - mean.x).powi(2)).sum::<f64>() / sum;
        Self { direction: in_frame(&axes.column(0).into_owned()), mean: axes * mean, along: mean.x, variance }
    }

    /// A pose moved to the mean.
    pub(super) fn moved(&self, pose: &Pose2) -> Pose2 {
        (pose * Pose2::new(self.mean, 0.0)).renormalized()
    }

    /// A covariance of the pose whose variance along the direction is no less than this one.
    pub(super) fn widened(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        self.with_variance(covariance, self.variance)
    }

    /// The covariance before the beams, where they contradict it: it is no less than the square of what they move the pose by.
    pub(super) fn contradicted(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        self.with_variance(covariance, self.variance + self.along * self.along)
    }

    fn with_variance(&self, covariance: &Matrix3<f64>, variance: f64) -> Matrix3<f64> {
        let missing = variance - self.direction.dot(&(covariance * self.direction));
        covariance + missing.max(0.0) * self.direction * self.direction.transpose()
    }
}

/// The positions that are compared (m), along the direction and across it.
fn offsets(step: f64) -> impl Iterator<Item = Vector2<f64>> {
    let num = (REACH / step).ceil() as i32;
    let along = move |across: i32| (-num..=num).map(move |along| step * Vector2::new(along.into(), across.into()));
    (-CELLS_ACROSS..=CELLS_ACROSS).flat_map(along)
}

/// The density of a position before the beams: of a normal distribution, but that measured motion is wrong now and then, and a map is torn.
struct DensityBefore {
    mean: Vector2<f64>,
    information: Matrix2<f64>,
    /// At the mean, of those that are not wrong.
    peak: f64,
    /// Of those that are.
    wrong: f64,
}

impl DensityBefore {
    fn new(refined: &Refined, prior: &Prior, axes: &Matrix2<f64>) -> Self {
        let covariance: Matrix2<f64> = inverse(&prior.information).fixed_view::<2, 2>(1, 1).into_owned();
        let information = axes.transpose() * covariance.try_inverse().unwrap_or_default() * axes;
        let mean = axes.transpose() * (refined.pose.inverse() * prior.pose).translation.vector;
        let peak = (1.0 - EXPECTED_WRONG) * information.determinant().max(0.0).sqrt() / TAU;
        Self { mean, information, peak, wrong: EXPECTED_WRONG / (2.0 * REACH).powi(2) }
    }

    fn log_at(&self, off: &Vector2<f64>) -> f64 {
        let off = off - self.mean;
        (self.peak * (-0.5 * off.dot(&(self.information * off))).exp() + self.wrong).ln()
    }
}

/// The directions in which beams tell least and most of the position of a pose, whatever its heading.
fn axes(refined: &Refined) -> Matrix2<f64> {
    let information = &refined.information;
    let of_heading = Vector2::new(information[(1, 0)], information[(2, 0)]);
    let by_heading = of_heading * of_heading.transpose() / information[(0, 0)].max(f64::MIN_POSITIVE);
    let of_position: Matrix2<f64> = information.fixed_view::<2, 2>(1, 1) - by_heading;
    let eigen = of_position.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    Matrix2::new(least.x, -least.y, least.y, least.x)
}

/// A direction as a perturbation, rotation first.
fn in_frame(direction: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(0.0, direction.x, direction.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::occupancy_grid::{OccupancyGrid, RESOLUTION};
    use crate::odometry::localization::refine::refine;
    use crate::preprocess::planar_scan::PlanarScan;

    /// Returns from the rough walls of a corridor along x, 2 m wide; with doors' frames every metre and a half where it is not bare.
    fn ends_from(at: f64, is_bare: bool) -> Vec<Vector2<f64>> {
        let rough = |x: f64| 0.03 * (37.0 * x).sin() * (11.0 * x).cos();
        let frame = |x: f64| if is_bare || (x / 1.5).fract().abs() > 0.2 { 0.0 } else { 0.15 };
        let seen = (-80..=80).map(|step| at + 0.05 * f64::from(step));
        seen.flat_map(|x| [1.0, -1.0].map(|side| Vector2::new(x - at, side * (1.0 - frame(x)) + rough(x)))).collect()
    }

    /// The standard deviation along the corridor of a scan that is registered in its map, known before to 0.2 m.
    fn sigma_along(is_bare: bool) -> f64 {
        let places = [-4.0, -2.0, 0.0, 2.0, 4.0];
        let scans = places.map(|x| PlanarScan::new(ends_from(x, is_bare)));
        let placed: Vec<_> =
            scans.iter().zip(places).map(|(scan, x)| (scan, Pose2::new(Vector2::new(x, 0.0), 0.0))).collect();
        let grid = OccupancyGrid::new(&placed, &[], RESOLUTION);
        let field = MapField::new(&grid);
        let model = BeamModel::of(&field);
        let beam = |end: &Vector2<f64>| Beam { origin: Vector2::zeros(), end: *end };
        let beams: Vec<Beam> = ends_from(0.7, is_bare).iter().step_by(3).map(beam).collect();
        let pose = grid.T_world_grid().inverse() * Pose2::new(Vector2::new(0.7, 0.0), 0.0);
        let information = Matrix3::from_diagonal(&Vector3::new(1e4, 25.0, 25.0));
        let prior = Prior { pose, information };
        let refined = refine(&field, &model, &beams, &pose, Some(&prior));
        let slide = Slide::of(&field, &model, &beams, &refined, &prior);
        slide.widened(&inverse(&(refined.information + information)))[(1, 1)].sqrt()
    }

    #[test]
    fn rough_walls_of_a_bare_corridor_tell_nothing_of_the_position_along_it() {
        let (bare, framed) = (sigma_along(true), sigma_along(false));
        assert!(bare > 0.1, "a bare corridor: {bare}");
        assert!(framed < 0.05, "with frames: {framed}");
    }
}
