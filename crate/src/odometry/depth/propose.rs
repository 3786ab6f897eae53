//! Proposals for a frame's pose: hypotheses are scored, and the best are refined with more and more points.

use nalgebra::{Isometry3, Vector3};

use super::evidence::{NUM_SCORED_POINTS, score, score_within};
use super::frame_matcher::{FrameMatcher, middle_options, rough_options};
use super::hypotheses::{
    GRID_STEP, MIN_DISTANCE, REACH_ALL_AROUND, REACH_ANYWHERE, best_distinct, grid_around, motion_penalty,
};
use crate::geometry::Pose3;
use crate::registration::icp::IcpOptions;
use crate::registration::prepared_surfels::SurfelCloud;
use crate::registration::projective::{PointBatch, ProjectiveTarget};

/// One of this many hypotheses, the best, is scored again with all sparse points.
const RESCORED_RATIO: usize = 4;
/// Hypotheses that are registered with sparse points, and of these with more and finally with all points, near a prediction ...
pub(super) const NUM_REFINED: [usize; 2] = [8, 3];
/// ... and without one.
const NUM_REFINED_ANYWHERE: [usize; 2] = [24, 5];

/// Refined poses with their support.
#[derive(Default)]
pub(super) struct Proposals {
    /// By few points.
    pub(super) rough: Vec<(f64, Pose3)>,
    /// The best of them by more points.
    pub(super) middle: Vec<(f64, Pose3)>,
}

impl Proposals {
    fn extend(&mut self, other: Self) {
        self.rough.extend(other.rough);
        self.middle.extend(other.middle);
    }
}

impl FrameMatcher<'_> {
    /// From these hypotheses; they are scored in the view from `T_world_view`.
    pub(super) fn propose_near(&self, hypotheses: &[Pose3], T_world_view: &Pose3) -> Proposals {
        let view = self.view_from(T_world_view);
        let scored = self.scored(&view, hypotheses.iter().copied());
        self.refine(&view, scored, NUM_REFINED, true, |pose| motion_penalty(T_world_view, pose))
    }

    /// From all rotations about the vertical and translations by up to [`REACH_ALL_AROUND`] around a pose.
    pub(super) fn propose_all_around(&self, T_world_last: &Pose3) -> Proposals {
        let mut proposals = Proposals::default();
        for quadrant in 0..4 {
            let T_quadrant = Isometry3::rotation(Vector3::y() * f64::from(quadrant) * 90f64.to_radians());
            let T_world_view = T_world_last * T_quadrant;
            let view = self.view_from(&T_world_view);
            let around = grid_around(&T_world_view, -6..=6, 7.5, [REACH_ALL_AROUND; 2], GRID_STEP);
            let scored = self.scored(&view, around);
            proposals.extend(self.refine(&view, scored, NUM_REFINED, false, |pose| motion_penalty(T_world_last, pose)));
        }
        proposals
    }

    /// From all rotations about the vertical and translations by up to four metres forward, back and sideways, without
    /// preference for near ones: for a frame without a prediction.
    pub(super) fn propose_anywhere(&self, T_world_view: &Pose3) -> Proposals {
        let view = self.view_from(T_world_view);
        let points = self.sparse.at_most(NUM_SCORED_POINTS).point_batch();
        let poses = grid_around(T_world_view, -18..=17, 10.0, [REACH_ANYWHERE; 2], MIN_DISTANCE);
        let scored = poses.map(|pose| (score_within(&view, &points, &pose, MIN_DISTANCE / 2.0), pose)).collect();
        self.refine(&view, scored, NUM_REFINED_ANYWHERE, true, |_| 0.0)
    }

    /// From the poses near all keyframes, if there are any.
    pub(super) fn propose_near_keyframes(&self) -> Option<Proposals> {
        let (mut scored, sparse) = (Vec::new(), self.sparse.point_batch());
        for keyframe in self.reference.keyframes.all() {
            for T_keyframe_camera in grid_around(&Pose3::identity(), -2..=2, 15.0, [GRID_STEP; 2], GRID_STEP) {
                let score = score(keyframe.view(), &sparse, &T_keyframe_camera);
                scored.push((score, keyframe.T_world_camera * T_keyframe_camera));
            }
        }
        let mut proposals = Proposals::default();
        for guess in best_distinct(scored, NUM_REFINED[0]) {
            proposals.extend(self.refine(&self.view_from(&guess), vec![(0.0, guess)], NUM_REFINED, false, |_| 0.0));
        }
        (!proposals.middle.is_empty()).then_some(proposals)
    }

    /// Hypotheses with their scores by few points and, for the best of them, by more; where they are few, for all of them.
    fn scored(&self, view: &ProjectiveTarget, hypotheses: impl Iterator<Item = Pose3>) -> Vec<(f64, Pose3)> {
        let mut scored: Vec<(f64, Pose3)> = hypotheses.map(|pose| (0.0, pose)).collect();
        let num_rescored = scored.len() / RESCORED_RATIO;
        let score_all = |scored: &mut [(f64, Pose3)], points: &PointBatch| {
            for (support, pose) in scored {
                *support = score(view, points, pose);
            }
        };
        if num_rescored == 0 {
            score_all(&mut scored, &self.sparse.point_batch());
            return scored;
        }
        score_all(&mut scored, &self.sparse.at_most(NUM_SCORED_POINTS).point_batch());
        scored.select_nth_unstable_by(num_rescored, |a, b| b.0.total_cmp(&a.0));
        score_all(&mut scored[..num_rescored], &self.sparse.point_batch());
        scored
    }

    /// Refines scored hypotheses: few points for many of them, more points for few. A single one gets no support where they are all
    /// that is compared.
    fn refine(
        &self,
        view: &ProjectiveTarget,
        scored: Vec<(f64, Pose3)>,
        [num_rough, num_middle]: [usize; 2],
        are_all: bool,
        penalty: impl Fn(&Pose3) -> f64,
    ) -> Proposals {
        let refined = |hypotheses: Vec<Pose3>, cloud: &SurfelCloud, options: &IcpOptions| -> Vec<(f64, Pose3)> {
            let is_compared = !are_all || hypotheses.len() > 1;
            let support = |pose: &Pose3| self.evidence(view, cloud, pose).support - penalty(pose);
            let refined = hypotheses.into_iter().map(|guess| {
                let refined = self.register(view, cloud, guess, options).T_target_source;
                (if is_compared { support(&refined) } else { 0.0 }, refined)
            });
            refined.collect()
        };
        let rough = refined(best_distinct(scored, num_rough), &self.sparse, &rough_options());
        let middle = refined(best_distinct(rough.clone(), num_middle), &self.middle, &middle_options());
        Proposals { rough, middle }
    }
}
