//! How far the poses of a chain may be off from its first one: errors pass on through the surfaces that frames are registered to.
//!
//! An error e is a small motion of the world, rotation first. A frame is registered to surfaces that earlier frames measured and that
//! are off by those frames' errors. With A_j the part of the normal matrix that comes from the surfaces of frame j,
//!
//! e = sum_j A^-1 A_j e_j + noise, A = sum_j A_j,
//!
//! to first order; the noise is that of the registration itself. The joint covariance of all errors follows frame by frame: a place
//! that is seen again is as certain as it was, and one that is reached over many frames collects the noise of all.

use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};
use rustc_hash::FxHashMap;

use super::pose_hypothesis::{PoseHypothesis, PoseUncertainty};
use super::reference_map::ReferenceMap;
use crate::geometry::Pose3;
use crate::registration::factors::{Correspondence, Factor, PointToPlane};
use crate::registration::target::Target;

/// Frames whose errors are kept. Of more, every other one is dropped, and the next one kept stands for it: a frame costs some
/// hundred thousand multiplications, however many there are.
const MAX_FRAMES: usize = 64;
/// One of this many pairs tells which frames' surfaces a frame lies on.
const PAIR_STRIDE: usize = 4;
/// Variance of an error over that by the residuals as if these were independent: of pairs of one patch they are alike, and in
/// successive frames. See docs/measurements/depth_ablations.md.
const VARIANCE_RATIO: f64 = 60.0;
/// Standard deviation of what nothing bounds (rad, m).
const UNKNOWN: (f64, f64) = (0.3, 1.0);

/// The joint covariance of the errors of frames.
#[derive(Clone)]
pub(super) struct ErrorPropagation {
    /// Numbers of the frames, in ascending order.
    frames: Vec<u32>,
    joint: DMatrix<f64>,
}

impl ErrorPropagation {
    /// Of a chain that begins with this frame, whose pose is exact.
    pub(super) fn from_first(number: u32) -> Self {
        Self { frames: vec![number], joint: DMatrix::zeros(6, 6) }
    }

    /// Adds a frame that is registered to the surfaces of others, each with its part of the normal matrix, and returns the covariance
    /// of its error.
    fn add(&mut self, number: u32, parts: &FxHashMap<u32, Matrix6<f64>>, noise: &Matrix6<f64>) -> Matrix6<f64> {
        let size = self.joint.nrows();
        let whole: Matrix6<f64> = parts.values().sum();
        // A direction that nothing determines is shared evenly: rounding must not decide it.
        let inverse = (whole + Matrix6::identity() * (1e-6 * whole.trace())).try_inverse().unwrap_or_else(Matrix6::zeros);
        let (mut across, mut covariance) = (DMatrix::zeros(6, size), *noise);
        let shares: Vec<(usize, Matrix6<f64>)> =
            parts.iter().map(|(frame, part)| (6 * self.place_of(*frame), inverse * part)).collect();
        for (place, share) in &shares {
            across += share * self.joint.rows(*place, 6);
        }
        for (place, share) in &shares {
            covariance += across.fixed_columns::<6>(*place) * share.transpose();
        }
        let covariance = (covariance + covariance.transpose()) / 2.0;
        let mut joint = std::mem::take(&mut self.joint).resize(size + 6, size + 6, 0.0);
        joint.view_mut((size, 0), (6, size)).copy_from(&across);
        joint.view_mut((0, size), (size, 6)).copy_from(&across.transpose());
        joint.fixed_view_mut::<6, 6>(size, size).copy_from(&covariance);
        self.joint = joint;
        self.frames.push(number);
        if self.frames.len() > MAX_FRAMES {
            self.thin_out();
        }
        covariance
    }

    /// Index of the frame that stands for a number.
    fn place_of(&self, number: u32) -> usize {
        self.frames.partition_point(|frame| *frame < number).min(self.frames.len() - 1)
    }

    /// Drops every other frame; the last one stays.
    fn thin_out(&mut self) {
        let stays = |index: usize| (self.frames.len() - 1 - index).is_multiple_of(2);
        let kept: Vec<usize> = (0..self.frames.len()).filter(|index| stays(*index)).collect();
        let rows: Vec<usize> = kept.iter().flat_map(|index| 6 * index..6 * index + 6).collect();
        self.joint = self.joint.select_rows(&rows).select_columns(&rows);
        self.frames = kept.iter().map(|index| self.frames[*index]).collect();
    }

    /// Adds a registered frame, whose pose may be wrong as told, and returns the covariance of its error.
    pub(super) fn add_registered(
        &mut self,
        number: u32,
        hypothesis: &PoseHypothesis,
        reference: &ReferenceMap,
        uncertainty: Option<&PoseUncertainty>,
    ) -> Matrix6<f64> {
        let registration = &hypothesis.registration;
        let mut pairs: FxHashMap<u32, Vec<Correspondence<Vector3<f64>>>> = FxHashMap::default();
        for pair in registration.correspondences.iter().step_by(PAIR_STRIDE) {
            // The partners of a frame that was tracked or corrected are not those of the map.
            let Some(neighbor) = hypothesis.view.nearest(&pair.moved, super::FINE_TOLERANCE) else { continue };
            let Some(frame) = reference.map.frame_of(hypothesis.view.number(neighbor.index)) else { continue };
            pairs.entry(frame).or_default().push(Correspondence { target: neighbor.index, ..*pair });
        }
        let normal_matrix = |pairs: &Vec<_>| Factor::<Pose3, _>::normal_equations(&PointToPlane, &hypothesis.view, pairs).H;
        let parts = pairs.iter().map(|(frame, pairs)| (*frame, normal_matrix(pairs))).collect();
        let information = registration.information / VARIANCE_RATIO + covariance_of(UNKNOWN.0, UNKNOWN.1, -2);
        let noise = information.try_inverse().unwrap_or_else(|| covariance_of(UNKNOWN.0, UNKNOWN.1, 2));
        self.add(number, &parts, &(noise + uncertainty.map_or_else(Matrix6::zeros, of_uncertain)))
    }
}

/// What an uncertain pose adds.
fn of_uncertain(uncertainty: &PoseUncertainty) -> Matrix6<f64> {
    let Some(position) = uncertainty.covariance() else { return covariance_of(UNKNOWN.0, UNKNOWN.1, 2) };
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&position);
    covariance
}

/// Powers of two standard deviations, of the rotation (rad) and the translation (m), on a diagonal.
fn covariance_of(rotation: f64, translation: f64, power: i32) -> Matrix6<f64> {
    let (r, t) = (rotation.powi(power), translation.powi(power));
    Matrix6::from_diagonal(&Vector6::new(r, r, r, t, t, t))
}
