//! Colours in the estimate: texture constrains a frame where its surfaces do not.
//!
//! A frame's textured points are compared with the images of keyframes, not with a map of mean colours, which would blur
//! them. Brightness and surfaces are weighted by their uncertainties; where they contradict each other, surfaces decide.

use nalgebra::{Matrix6, Vector6};

use super::evidence::{FINE_TOLERANCE, MIN_AGREEMENT_DIFFERENCE, MIN_NCC, PoseEvidence, is_distinct};
use super::frame_matcher::FrameMatcher;
use super::hypotheses::{GRID_STEP, SAME_POSE_DISTANCE, steps_within, translated};
use super::pose_hypothesis::PoseHypothesis;
use super::prediction_gate::MAX_STEP;
use super::textured_frame::TexturedFrame;
use crate::camera::brightness::NUM_LEVELS;
use crate::geometry::Pose3;
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::factors::{Factor, NormalEquations, PointToPlane};
use crate::registration::photometric::{Gaussian, MIN_POINTS, PhotometricResult, correlation, register_by_brightness};
use crate::registration::sandwich_variance::unit_variance;

/// Side of a patch of surfaces with a common error (cells).
const PATCH_SIDE: usize = 16;
/// One of this many correspondences is used for the information of the surfaces. With all of them, of the first floor with five strangers in
/// a row 9 frames are doubtful and 11 lost (5 lost).
pub(super) const CORRESPONDENCE_STRIDE: usize = 3;

/// A position along a direction that brightness distinguishes from all others.
#[derive(Clone, Copy)]
pub(super) struct DistinctOffset {
    /// From the pose along the direction (m).
    distance: f64,
    /// The highest correlation at any other position.
    runner_up_ncc: f64,
}

impl DistinctOffset {
    /// Whether registration does not lead there.
    pub(super) fn is_elsewhere(&self) -> bool {
        self.distance.abs() > GRID_STEP
    }
}

impl FrameMatcher<'_> {
    /// Refines a registration by brightness, where there is texture and it agrees.
    pub(super) fn refine_by_color(&self, mut hypothesis: PoseHypothesis) -> PoseHypothesis {
        let Some(textured) = &self.textured else { return hypothesis };
        let is_unconstrained = hypothesis.is_degenerate() || !hypothesis.weakest.is_constrained();
        if let Some(open) = is_unconstrained.then_some(hypothesis.weakest)
            && let Some(offset) = self.offset_along(textured, &hypothesis, &open)
        {
            if let Some(moved) = self.register_at_offset(textured, &hypothesis, &open, offset) {
                return moved;
            }
            // Brightness contradicts this position, surfaces the other one.
            if offset.is_elsewhere() {
                hypothesis = self.mark_degenerate(hypothesis);
            }
        }
        if textured.is_for_degenerate_only {
            return hypothesis;
        }
        let surfaces = self.surface_information(&hypothesis);
        // Where surfaces constrain the frame, its error is small: the coarsest images are not needed.
        let Some(result) = self.register_by_brightness(textured, &surfaces, NUM_LEVELS - 2) else { return hypothesis };
        self.moved_to(hypothesis, &result)
    }

    /// Correlation of the brightness at a pose with the keyframe images, on the coarsest level; `None` where too little is
    /// visible.
    pub(super) fn photometric_ncc(&self, textured: &TexturedFrame, T_world_camera: &Pose3) -> Option<f64> {
        let references = textured.references(self.reference, T_world_camera);
        let (ncc, num_compared) = correlation(textured.points, &references, T_world_camera, NUM_LEVELS - 1);
        (num_compared >= MIN_POINTS).then_some(ncc)
    }

    /// The position along a direction that brightness distinguishes from all others, if there is one: from those as far as half of the
    /// largest step, so that the period of a repetitive texture, such as tiles, is seen, each another pose than the next.
    pub(super) fn offset_along(
        &self,
        textured: &TexturedFrame,
        hypothesis: &PoseHypothesis,
        along: &DegenerateDirection,
    ) -> Option<DistinctOffset> {
        let distance = |steps: i32| f64::from(steps) * SAME_POSE_DISTANCE;
        let ncc_at = |steps: i32| {
            let pose = translated(hypothesis.T_world_sensor(), &along.direction, distance(steps));
            (self.photometric_ncc(textured, &pose).unwrap_or(0.0), steps)
        };
        let offsets: Vec<(f64, i32)> = steps_within(MAX_STEP / 2.0, SAME_POSE_DISTANCE).map(ncc_at).collect();
        let best = offsets.iter().copied().fold((0.0, 0), |best, next| if next.0 > best.0 { next } else { best });
        let elsewhere = offsets.iter().filter(|(_, steps)| distance(steps - best.1).abs() > GRID_STEP);
        let runner_up_ncc = elsewhere.map(|(ncc, _)| *ncc).fold(0.0, f64::max);
        (best.0 > MIN_NCC && is_distinct(best.0, runner_up_ncc))
            .then_some(DistinctOffset { distance: distance(best.1), runner_up_ncc })
    }

    /// The registration at an offset along a direction, if brightness and surfaces both confirm it there.
    pub(super) fn register_at_offset(
        &self,
        textured: &TexturedFrame,
        hypothesis: &PoseHypothesis,
        along: &DegenerateDirection,
        offset: DistinctOffset,
    ) -> Option<PoseHypothesis> {
        let T_world_camera = translated(hypothesis.T_world_sensor(), &along.direction, offset.distance);
        let surfaces = Gaussian { T_world_camera, ..self.surface_information(hypothesis) };
        let result = self.register_along_by_brightness(textured, along, &surfaces)?;
        // Other surfaces correspond there.
        let again = self.register_finely(result.T_world_camera);
        let result = self.register_along_by_brightness(textured, along, &self.surface_information(&again))?;
        let mut moved = self.moved_to(again, &result);
        moved.photometric_ncc = self.photometric_ncc(textured, moved.T_world_sensor());
        moved.is_placed_by_brightness = true;
        let is_confirmed = *moved.T_world_sensor() == result.T_world_camera
            && moved.photometric_ncc.is_some_and(|ncc| is_distinct(ncc, offset.runner_up_ncc));
        (is_confirmed && moved.agreement > hypothesis.agreement - MIN_AGREEMENT_DIFFERENCE).then_some(moved)
    }

    /// The most likely pose if brightness constrains the position along a direction; the surfaces are ignored along it.
    fn register_along_by_brightness(
        &self,
        textured: &TexturedFrame,
        along: &DegenerateDirection,
        surfaces: &Gaussian,
    ) -> Option<PhotometricResult> {
        let along = &along.direction;
        let direction = Vector6::new(0.0, 0.0, 0.0, along.x, along.y, along.z);
        let across = Matrix6::identity() - direction * direction.transpose();
        let information = across * surfaces.information * across;
        let result = self.register_by_brightness(textured, &Gaussian { information, ..*surfaces }, NUM_LEVELS - 1)?;
        let joint = self.solver.restricted(NormalEquations { H: information + result.information, b: direction });
        let variance = direction.dot(&joint.H.cholesky()?.solve(&joint.b));
        (variance < FINE_TOLERANCE * FINE_TOLERANCE).then_some(result)
    }

    /// The most likely pose near that of the surfaces, where the keyframe images agree.
    fn register_by_brightness(
        &self,
        textured: &TexturedFrame,
        surfaces: &Gaussian,
        coarsest: usize,
    ) -> Option<PhotometricResult> {
        let references = textured.references(self.reference, &surfaces.T_world_camera);
        let result = register_by_brightness(textured.points, &references, surfaces, coarsest, &self.solver)?;
        (result.correlation > MIN_NCC).then_some(result)
    }

    /// A hypothesis moved to the photometric pose, unless the surfaces agree less there.
    fn moved_to(&self, mut hypothesis: PoseHypothesis, result: &PhotometricResult) -> PoseHypothesis {
        let PoseEvidence { support, overlap, agreement, normal_repeatability } =
            self.evidence(&hypothesis.view, &self.middle, &result.T_world_camera);
        if agreement < hypothesis.agreement - MIN_AGREEMENT_DIFFERENCE {
            return hypothesis;
        }
        hypothesis = PoseHypothesis { support, overlap, agreement, normal_repeatability, ..hypothesis };
        hypothesis.registration.T_target_source = result.T_world_camera;
        // ICP on surfaces alone may cycle without converging.
        hypothesis.registration.converged |= result.converged;
        hypothesis
    }

    /// The pose by surfaces with its information matrix. Surfaces of one patch share one error.
    fn surface_information(&self, hypothesis: &PoseHypothesis) -> Gaussian {
        let image = &self.frame.image;
        let camera = image.cell_camera();
        let columns = image.columns.div_ceil(PATCH_SIDE).max(1);
        let rows = image.rows.div_ceil(PATCH_SIDE).max(1);
        let mut patches = vec![Vector6::zeros(); columns * rows];
        let mut sum = NormalEquations::<Pose3>::zeros();
        for pair in hypothesis.registration.correspondences.iter().step_by(CORRESPONDENCE_STRIDE) {
            let equations: NormalEquations<Pose3> =
                PointToPlane.normal_equations(&hypothesis.view, std::slice::from_ref(pair));
            let Some(pixel) = camera.project(&self.fine.points[pair.source as usize]) else { continue };
            let (column, row) = (pixel.x.max(0.0) as usize / PATCH_SIDE, pixel.y.max(0.0) as usize / PATCH_SIDE);
            sum.H += equations.H;
            patches[row.min(rows - 1) * columns + column.min(columns - 1)] += equations.b;
        }
        // The same image again leaves no residuals.
        let variance = unit_variance(&self.solver.restricted(sum).H, &patches).max(f64::EPSILON);
        Gaussian { T_world_camera: *hypothesis.T_world_sensor(), information: sum.H / variance }
    }
}
