//! How far the poses of a chain may be off from its first one: errors pass on through the surfaces that frames are registered to.
//!
//! An error e is a small motion of the world, rotation first. A frame is registered to surfaces that earlier frames measured and that
//! are off by those frames' errors. With A_j the part of the normal matrix that comes from the surfaces of frame j,
//!
//! e = sum_j A^-1 A_j e_j + noise, A = sum_j A_j,
//!
//! to first order; the noise is that of the registration itself. The joint covariance of all errors follows frame by frame: a place
//! that is seen again is as certain as it was, and one that is reached over many frames collects the noise of all.

use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3, Vector6};
use rustc_hash::FxHashMap;

use super::color::CORRESPONDENCE_STRIDE;
use super::evidence::FINE_TOLERANCE;
use super::pose_hypothesis::{ERROR_RATIO, PoseHypothesis};
use super::prediction_gate::MAX_STEP;
use super::reference_map::ReferenceMap;
use crate::geometry::Pose3;
use crate::geometry::pose_distance::METRES_PER_RADIAN;
use crate::registration::factors::{Correspondence, Factor, PointToPlane};
use crate::registration::target::Target;

/// Frames whose errors are kept. Of more, every other one is dropped, and the next one kept stands for it: a frame costs a
/// hundred thousand multiplications, however many there are.
pub(super) const MAX_FRAMES: usize = 32;

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
        let shares: Vec<(usize, Matrix6<f64>)> =
            shares(parts).into_iter().map(|(frame, share)| (6 * self.place_of(frame), share)).collect();
        let across = self.across(&shares);
        let covariance = with_passed_on(noise, &shares, &across);
        let covariance = (covariance + covariance.transpose()) / 2.0;
        // For one that is found again after later ones, the next one stands.
        if self.frames.last().is_some_and(|last| *last >= number) {
            return covariance;
        }
        self.append(&across, &covariance);
        self.frames.push(number);
        if self.frames.len() > MAX_FRAMES {
            self.thin_out();
        }
        covariance
    }

    /// The covariance of an error, of which these are the shares of others, with all others.
    #[inline(never)]
    fn across(&self, shares: &[(usize, Matrix6<f64>)]) -> DMatrix<f64> {
        let mut across = DMatrix::zeros(6, self.joint.nrows());
        for (place, share) in shares {
            across += share * self.joint.rows(*place, 6);
        }
        across
    }

    /// The joint covariance with one more error.
    #[inline(never)]
    fn append(&mut self, across: &DMatrix<f64>, covariance: &Matrix6<f64>) {
        let size = self.joint.nrows();
        let mut joint = std::mem::take(&mut self.joint).resize(size + 6, size + 6, 0.0);
        joint.view_mut((size, 0), (6, size)).copy_from(across);
        joint.view_mut((0, size), (size, 6)).copy_from(&across.transpose());
        joint.fixed_view_mut::<6, 6>(size, size).copy_from(covariance);
        self.joint = joint;
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

    /// Adds a registered frame, with the covariance that is open of its position (`None` where nothing bounds it), and returns the
    /// covariance of its error.
    #[inline(never)]
    pub(super) fn add_registered(
        &mut self,
        number: u32,
        hypothesis: &PoseHypothesis,
        reference: &ReferenceMap,
        open: Option<Matrix3<f64>>,
    ) -> Matrix6<f64> {
        let noise = covariance_of_error(&(hypothesis.registration.information / ERROR_RATIO.powi(2)));
        self.add(number, &normal_matrices(hypothesis, reference), &(noise + of_open(open)))
    }
}

/// The part of the normal matrix that comes from the surfaces of each frame, by the frame's number.
#[inline(never)]
fn normal_matrices(hypothesis: &PoseHypothesis, reference: &ReferenceMap) -> FxHashMap<u32, Matrix6<f64>> {
    let view = &hypothesis.view;
    let mut pairs: FxHashMap<u32, Vec<Correspondence<Vector3<f64>>>> = FxHashMap::default();
    for pair in hypothesis.registration.correspondences.iter().step_by(CORRESPONDENCE_STRIDE) {
        // The partners of a frame that was tracked or corrected are not those of the map.
        let Some(neighbor) = view.nearest(&pair.moved, FINE_TOLERANCE) else { continue };
        let Some(frame) = reference.map.frame_of(view.number(neighbor.index)) else { continue };
        pairs.entry(frame).or_default().push(Correspondence { target: neighbor.index, ..*pair });
    }
    let normal_matrix = |pairs: &Vec<_>| Factor::<Pose3, _>::normal_equations(&PointToPlane, view, pairs).H;
    pairs.iter().map(|(frame, pairs)| (*frame, normal_matrix(pairs))).collect()
}

/// The share of each frame's error in that of a frame that lies on their surfaces.
#[inline(never)]
fn shares(normal_matrices: &FxHashMap<u32, Matrix6<f64>>) -> Vec<(u32, Matrix6<f64>)> {
    let whole: Matrix6<f64> = normal_matrices.values().sum();
    // Rounding must not decide what nothing determines.
    let inverse = (whole + Matrix6::identity() * (1e-6 * whole.trace())).try_inverse().unwrap_or_else(Matrix6::zeros);
    normal_matrices.iter().map(|(frame, part)| (*frame, inverse * part)).collect()
}

/// The covariance of an error, of which these are the shares of others, with its own noise.
#[inline(never)]
fn with_passed_on(noise: &Matrix6<f64>, shares: &[(usize, Matrix6<f64>)], across: &DMatrix<f64>) -> Matrix6<f64> {
    let mut covariance = *noise;
    for (place, share) in shares {
        covariance += across.fixed_columns::<6>(*place) * share.transpose();
    }
    covariance
}

/// What the open covariance of a position (m^2) adds; `None` where nothing bounds it.
fn of_open(open: Option<Matrix3<f64>>) -> Matrix6<f64> {
    let Some(position) = open else { return of_pose_distance(MAX_STEP, 2) };
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&position);
    covariance
}

/// The covariance of a pose's error by an information matrix; where that says nothing, a step in any direction.
pub(crate) fn covariance_of_error(information: &Matrix6<f64>) -> Matrix6<f64> {
    (information + of_pose_distance(MAX_STEP, -2)).try_inverse().unwrap_or_else(|| of_pose_distance(MAX_STEP, 2))
}

/// A power of standard deviations that are the same distance (m, two metres per radian) along and about all axes.
pub(crate) fn of_pose_distance(distance: f64, power: i32) -> Matrix6<f64> {
    let (r, t) = ((distance / METRES_PER_RADIAN).powi(power), distance.powi(power));
    Matrix6::from_diagonal(&Vector6::new(r, r, r, t, t, t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{DepthImage, Pinhole};
    use crate::geometry::RigidMotion;
    use crate::odometry::depth::DepthOptions;
    use crate::odometry::depth::frame_matcher::FrameMatcher;
    use crate::preprocess::depth_surfels::{DepthModel, depth_surfels};
    use crate::registration::prepared_surfels::PreparedSurfels;

    fn on(parts: &[(u32, f64)]) -> FxHashMap<u32, Matrix6<f64>> {
        parts.iter().map(|&(frame, weight)| (frame, Matrix6::identity() * weight)).collect()
    }

    #[test]
    fn noise_adds_up_along_a_chain_and_not_where_a_place_is_seen_again() {
        let mut errors = ErrorPropagation::from_first(0);
        let noise = Matrix6::identity() * 1e-4;
        for number in 1..10 {
            let covariance = errors.add(number, &on(&[(number - 1, 100.0)]), &noise);
            assert!((covariance[(4, 4)] / 1e-4 - f64::from(number)).abs() < 1e-3, "{covariance}");
        }
        let again = errors.add(10, &on(&[(0, 100.0)]), &noise);
        assert!((again[(4, 4)] / 1e-4 - 1.0).abs() < 1e-3, "{again}");
        // Half of it goes with frame 9, half with frame 0, whose errors are independent.
        let between = errors.add(11, &on(&[(0, 50.0), (9, 50.0)]), &noise);
        assert!((between[(4, 4)] / 1e-4 - (1.0 + 9.0 / 4.0)).abs() < 1e-3, "{between}");
        // Two frames with the same error are no more certain together.
        let both = errors.add(12, &on(&[(8, 50.0), (9, 50.0)]), &noise);
        assert!(both[(4, 4)] > 9.0 * 1e-4, "{both}");
    }

    #[test]
    fn of_many_frames_others_stand_for_those_that_are_dropped() {
        let mut errors = ErrorPropagation::from_first(0);
        let noise = Matrix6::identity() * 1e-4;
        let mut last = Matrix6::zeros();
        for number in 1..300 {
            last = errors.add(number, &on(&[(number - 1, 70.0), (number.saturating_sub(3), 30.0)]), &noise);
            assert!(errors.frames.len() <= MAX_FRAMES && errors.joint.nrows() == 6 * errors.frames.len());
        }
        // An error is passed on over 1.6 frames in the mean, so 1 / 1.6 of each one stays.
        let expected = 300.0 / 1.6_f64.powi(2) * 1e-4;
        assert!((0.9..1.2).contains(&(last[(3, 3)] / expected)), "{} {expected}", last[(3, 3)]);
        let again = errors.add(150, &on(&[(149, 100.0)]), &noise);
        assert!(errors.frames.is_sorted() && again[(3, 3)] < last[(3, 3)], "one that is found again: {again}");
        let early = errors.add(300, &on(&[(1, 100.0)]), &noise);
        assert!(early[(3, 3)] > 2.0 * 1e-4 * 0.999, "what stands for frame 1 is no more certain: {early}");
    }

    /// A wavy wall, of which these columns have depth.
    fn wall(columns: std::ops::Range<usize>) -> PreparedSurfels {
        let camera = Pinhole::from_field_of_view(320, 240, 1.2).unwrap();
        let depth = |pixel: usize| {
            let (column, row) = ((pixel % 320) as f64, (pixel / 320) as f64);
            let depth = 2000.0 + 300.0 * (column / 30.0).sin() + 250.0 * (row / 25.0).cos();
            if columns.contains(&(pixel % 320)) { depth as u16 } else { 0 }
        };
        let image = DepthImage { width: 320, height: 240, bits: 16, values: (0..320 * 240).map(depth).collect() };
        let model = DepthModel { step: 1e-3, offset: 0.0, square_noise: 1e-3, min_range: 0.1, max_range: 10.0 };
        DepthOptions::default().prepared(depth_surfels(&image, &vec![true; image.values.len()], &camera, &model))
    }

    #[test]
    fn a_frame_takes_over_the_errors_of_the_surfaces_that_it_lies_on() {
        let error = Vector6::new(1e-3, -2e-3, 1.5e-3, 4e-3, -3e-3, 5e-3);
        let mut reference = ReferenceMap::default();
        for (number, frame, T) in
            [(0, wall(0..160), Pose3::identity()), (1, wall(160..320), <Pose3 as RigidMotion>::exp(&error))]
        {
            let view = reference.map.view(&frame.image, &T);
            reference.insert(&frame, number, &T, &view);
        }
        let frame = wall(0..320);
        let found = FrameMatcher::new(&reference, &frame, DepthOptions::default()).register_at(Pose3::identity());
        let matrices = normal_matrices(&found, &reference);
        assert_eq!(matrices.len(), 2);
        let (_, share) = shares(&matrices).into_iter().find(|(frame, _)| *frame == 1).unwrap();
        let (expected, actual) = (share * error, found.T_world_sensor().log());
        assert!((actual - expected).norm() < 0.15 * error.norm(), "{actual} {expected}");
        assert!(expected.norm() > 0.3 * error.norm() && (expected - error).norm() > 0.3 * error.norm());
    }
}
