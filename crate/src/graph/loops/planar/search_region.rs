//! Where one submap may lie in another by the graph's covariance, as windows of the correlative search.
//!
//! After a long way the position is open along one direction far more than across it, and every position goes with its own
//! heading. A wide region is covered by a row of windows, which cost a fraction of the square around them.

use std::f64::consts::{PI, SQRT_2};

use nalgebra::{Matrix2, Matrix3, Vector2};

use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::information::position_covariance;
use crate::registration::correlative::SearchWindow;

/// Half width of what is searched, in standard deviations of the relative pose, ...
const WINDOW_SIGMAS: f64 = 3.0;
/// ... beside this margin (m, rad), ...
const WINDOW_MARGIN: SearchWindow = SearchWindow { translation: 0.2, rotation: 0.03 };
/// ... and its largest translation (m).
pub(super) const MAX_WINDOW: f64 = 24.0;
/// Half width above which a square is replaced by a row of windows (m).
const MAX_SQUARE: f64 = 4.0;
/// Smallest half width of the row, as a share of its half length, and smallest deviation of the heading at a position, as a share
/// of that at all of them: covariances are known to a factor.
const MIN_SHARE: f64 = 0.25;

/// The poses that a submap may have in another one.
#[derive(Debug, Clone)]
pub struct SearchRegion {
    /// The most likely pose.
    pub guess: Pose2,
    /// How far off that may be.
    pub extent: SearchWindow,
    /// Windows that cover the region, each around its most likely pose.
    pub windows: Vec<(Pose2, SearchWindow)>,
}

impl SearchRegion {
    /// By a guess with its covariance (by a perturbation on its left), as far as positions lie within `reach` (m) of the origin.
    pub fn new(guess: Pose2, covariance: &Matrix3<f64>, reach: f64) -> Self {
        let position = position_covariance(&guess, covariance);
        let half = |variance: f64| WINDOW_MARGIN.translation + WINDOW_SIGMAS * variance.max(0.0).sqrt();
        let heading_sigma = covariance[(0, 0)].max(0.0).sqrt();
        let extent = SearchWindow {
            translation: half(position.symmetric_eigenvalues().max()).min(MAX_WINDOW),
            rotation: (WINDOW_MARGIN.rotation + WINDOW_SIGMAS * heading_sigma).min(PI),
        };
        let whole = Self { guess, extent, windows: vec![(guess, extent)] };
        if extent.translation <= MAX_SQUARE {
            return whole;
        }
        Self { windows: whole.row(&position, covariance, reach), ..whole }
    }

    /// Windows along the direction in which the position is open most.
    fn row(&self, position: &Matrix2<f64>, covariance: &Matrix3<f64>, reach: f64) -> Vec<(Pose2, SearchWindow)> {
        let eigen = position.symmetric_eigen();
        let axis: Vector2<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        let (variance, length) = (eigen.eigenvalues.max(), self.extent.translation);
        let across = WINDOW_MARGIN.translation + WINDOW_SIGMAS * eigen.eigenvalues.min().max(0.0).sqrt();
        let width = across.clamp(MIN_SHARE * length, length);
        // The heading that goes with a position along the axis, and what that leaves open.
        let with_heading = Pose2::point_jacobian(&self.guess.translation.vector) * covariance.column(0);
        let slope = axis.dot(&with_heading) / variance;
        let heading_variance = covariance[(0, 0)].max(0.0);
        let left = (heading_variance - slope * slope * variance).max(MIN_SHARE * MIN_SHARE * heading_variance).sqrt();
        let count = (length / width).ceil();
        let half_step = length / count;
        let (cos, sin) = (axis.x.abs(), axis.y.abs());
        let window = SearchWindow {
            translation: (half_step * cos + width * sin).max(half_step * sin + width * cos).min(length),
            rotation: (WINDOW_MARGIN.rotation + WINDOW_SIGMAS * left + slope.abs() * half_step)
                .min(self.extent.rotation),
        };
        let along = (0..count as usize).map(|index| half_step * (2 * index + 1) as f64 - length);
        let placed = along.map(|along| {
            let turn = Pose2::rotation(slope * along).rotation;
            Pose2::from_parts((self.guess.translation.vector + axis * along).into(), turn * self.guess.rotation)
        });
        placed
            .filter(|center| center.translation_norm() < reach + SQRT_2 * window.translation)
            .map(|center| (center, window))
            .collect()
    }

    /// Whether a pose lies in the square of the region, or no further off than this.
    pub fn holds(&self, T_target_source: &Pose2, at_least: SearchWindow) -> bool {
        let off = self.guess.inverse() * T_target_source;
        off.translation_norm() <= SQRT_2 * self.extent.translation.max(at_least.translation)
            && off.rotation_angle() <= self.extent.rotation.max(at_least.rotation)
    }

    /// What its search costs, in windows of a metre and a tenth of a radian.
    pub fn cost(&self) -> f64 {
        self.windows.iter().map(|(_, window)| 1.0 + window.translation.powi(2) * (window.rotation / 0.1)).sum()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::odometry::planar::information::chained;

    /// A straight way of 200 m, its covariance added up from steps that are known to these deviations (rad, m).
    fn way(heading: f64, position: f64) -> (Pose2, Matrix3<f64>) {
        let step = Matrix3::from_diagonal(&Vector3::new(heading, position, position).map(|sigma| sigma * sigma));
        let sum = (0..200).fold((Pose2::identity(), Matrix3::zeros()), |(T, covariance), _| {
            (T * Pose2::translation(1.0, 0.0), chained((&T, &covariance), &step))
        });
        // As if it came back: the same uncertainty, seen from near the start.
        let back = Pose2::translation(-198.0, 0.0);
        let adjoint = back.adjoint();
        (back * sum.0, adjoint * sum.1 * adjoint.transpose())
    }

    #[test]
    fn a_narrow_region_is_one_square() {
        let (guess, covariance) = way(2e-4, 0.01);
        let region = SearchRegion::new(guess, &covariance, 10.0);
        assert!(region.extent.translation < MAX_SQUARE, "{:?}", region.extent);
        assert_eq!(region.windows, [(guess, region.extent)]);
    }

    #[test]
    fn a_row_of_windows_holds_what_errors_of_heading_add_up_to_and_costs_a_fraction() {
        let (heading, position) = (4e-3, 0.01);
        let (guess, covariance) = way(heading, position);
        let region = SearchRegion::new(guess, &covariance, 30.0);
        assert!(region.extent.translation > 10.0 && region.windows.len() > 2, "{:?}", region.extent);
        let square = SearchRegion { windows: vec![(guess, region.extent)], ..region.clone() };
        assert!(region.cost() < 0.3 * square.cost(), "{} of {}", region.cost(), square.cost());
        let mut state = 7_u32;
        let mut normal = || {
            let uniform = |state: &mut u32| {
                *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(*state >> 8) / f64::from(1 << 24)
            };
            (0..12).map(|_| uniform(&mut state)).sum::<f64>() - 6.0
        };
        let mut num_held = 0;
        for _ in 0..500 {
            let drifted = (0..200).fold(Pose2::identity(), |pose, _| {
                let off = Vector3::new(heading * normal(), position * normal(), position * normal());
                pose * Pose2::exp(&off) * Pose2::translation(1.0, 0.0)
            });
            let pose = Pose2::translation(-198.0, 0.0) * drifted;
            let is_in = |(center, window): &(Pose2, SearchWindow)| {
                let off = pose.translation.vector - center.translation.vector;
                let turn = (center.rotation.inverse() * pose.rotation).angle();
                off.amax() <= window.translation && turn.abs() <= window.rotation
            };
            num_held += usize::from(region.windows.iter().any(is_in));
        }
        assert!(num_held > 480, "{num_held} of 500");
    }

    #[test]
    fn windows_out_of_reach_are_left_out() {
        let (guess, covariance) = way(4e-3, 0.01);
        let (near, far) = (SearchRegion::new(guess, &covariance, 2.0), SearchRegion::new(guess, &covariance, 60.0));
        assert!(near.windows.len() < far.windows.len(), "{} {}", near.windows.len(), far.windows.len());
    }
}
