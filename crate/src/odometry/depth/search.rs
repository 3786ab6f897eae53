//! The search for a frame's pose: hypotheses are scored, the best are refined with more and more points, and the one with the
//! best evidence is returned.

use nalgebra::{Isometry3, Vector3};

use super::color::{MAX_AGREEMENT_LOSS, MIN_NCC, SAME_OFFSET_STEPS, is_distinct};
use super::evidence::FINE_TOLERANCE;
use super::evidence::score;
use super::frame_matcher::{FrameMatcher, SAME_POSE_DISTANCE, middle_options, rough_options};
use super::grid_search::{self, best_poses};
use super::hypotheses::{best_distinct, grid_around, motion_penalty};
use super::pose_hypothesis::PoseHypothesis;
use crate::geometry::Pose3;
use crate::map::keyframes::apart;
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::icp::IcpOptions;
use crate::registration::prepared_surfels::SurfelCloud;
use crate::registration::projective::ProjectiveTarget;

/// Points of the first score of a hypothesis.
const FIRST_SCORE_POINTS: usize = 80;
/// One of this many hypotheses, the best, is scored again with all sparse points.
const RESCORED_RATIO: usize = 4;
/// Hypotheses that are registered with sparse points, and of these with more, near a prediction ...
const NUM_REFINED: [usize; 2] = [8, 3];
/// ... and without one.
const NUM_REFINED_ANYWHERE: [usize; 2] = [24, 5];
/// Poses near keyframes that are refined for a frame that may be anywhere.
const NUM_KEYFRAME_POSES: usize = 6;
/// Poses of which the final registration is computed, at the most.
const NUM_FINELY_REGISTERED: usize = 3;
/// Photometric correlation (-1..=1) above which the other hypotheses are not compared by brightness.
const CLEAR_NCC: f64 = 0.95;

/// Refined poses with their support.
#[derive(Default)]
struct Refined {
    /// By few points.
    rough: Vec<(f64, Pose3)>,
    /// The best of them by more points.
    middle: Vec<(f64, Pose3)>,
}

impl Refined {
    fn extend(&mut self, other: Self) {
        self.rough.extend(other.rough);
        self.middle.extend(other.middle);
    }
}

impl FrameMatcher<'_> {
    /// The registration near a guess, with degenerate directions resolved and refined by brightness.
    pub(super) fn register_at(&self, guess: Pose3) -> PoseHypothesis {
        self.refine_by_color(self.resolve_degeneracy(self.register_finely(guess)))
    }

    /// The best of these hypotheses; they are scored in the view from `T_world_view`.
    pub(super) fn best_of(&self, hypotheses: &[Pose3], T_world_view: &Pose3) -> PoseHypothesis {
        let view = self.view_from(T_world_view);
        let scored = self.scored(&view, hypotheses.iter().copied());
        self.best_of_refined(self.refine(&view, scored, NUM_REFINED, |pose| motion_penalty(T_world_view, pose)))
    }

    /// The best of all rotations about the vertical and translations by up to a metre around a pose.
    pub(super) fn best_of_all_around(&self, T_world_last: &Pose3) -> PoseHypothesis {
        let mut refined = Refined::default();
        for quadrant in 0..4 {
            let T_quadrant = Isometry3::rotation(Vector3::y() * f64::from(quadrant) * 90f64.to_radians());
            let T_world_view = T_world_last * T_quadrant;
            let view = self.view_from(&T_world_view);
            let scored = self.scored(&view, grid_around(&T_world_view, -6..=6, 7.5f64.to_radians(), 4, 4));
            refined.extend(self.refine(&view, scored, NUM_REFINED, |pose| motion_penalty(T_world_last, pose)));
        }
        self.best_of_refined(refined)
    }

    /// The best of all rotations about the vertical and translations by up to four metres forward, back and sideways, without
    /// preference for near ones: for a frame without a prediction.
    pub(super) fn best_of_anywhere(&self, T_world_view: &Pose3) -> PoseHypothesis {
        let view = self.view_from(T_world_view);
        let poses = best_poses(&view, &self.sparse.at_most(grid_search::NUM_POINTS), T_world_view);
        self.best_of_refined(self.refine(&view, poses, NUM_REFINED_ANYWHERE, |_| 0.0))
    }

    /// The best of the poses near all keyframes, if there are any.
    pub(super) fn best_of_everywhere(&self) -> Option<PoseHypothesis> {
        let (mut scored, sparse) = (Vec::new(), self.sparse.point_batch());
        for keyframe in self.reference.keyframes.all() {
            for T_keyframe_camera in grid_around(&Pose3::identity(), -2..=2, 15f64.to_radians(), 1, 1) {
                let score = score(keyframe.view(), &sparse, &T_keyframe_camera);
                scored.push((score, keyframe.T_world_camera * T_keyframe_camera));
            }
        }
        let mut refined = Refined::default();
        for guess in best_distinct(scored, NUM_KEYFRAME_POSES) {
            refined.extend(self.refine(&self.view_from(&guess), vec![(0.0, guess)], NUM_REFINED, |_| 0.0));
        }
        (!refined.middle.is_empty()).then(|| self.best_of_refined(refined))
    }

    /// Hypotheses with their scores by few points and, for the best of them, by more.
    fn scored(&self, view: &ProjectiveTarget, hypotheses: impl Iterator<Item = Pose3>) -> Vec<(f64, Pose3)> {
        let (few, more) = (self.sparse.at_most(FIRST_SCORE_POINTS).point_batch(), self.sparse.point_batch());
        let mut scored: Vec<(f64, Pose3)> = hypotheses.map(|pose| (score(view, &few, &pose), pose)).collect();
        let num_rescored = scored.len() / RESCORED_RATIO;
        if num_rescored > 0 {
            scored.select_nth_unstable_by(num_rescored, |a, b| b.0.total_cmp(&a.0));
        }
        let num_rescored = if num_rescored > 0 { num_rescored } else { scored.len() };
        for (support, pose) in &mut scored[..num_rescored] {
            *support = score(view, &more, pose);
        }
        scored
    }

    /// Refines scored hypotheses: few points for many of them, more points for few.
    fn refine(
        &self,
        view: &ProjectiveTarget,
        scored: Vec<(f64, Pose3)>,
        [num_rough, num_middle]: [usize; 2],
        penalty: impl Fn(&Pose3) -> f64,
    ) -> Refined {
        let refined = |hypotheses: Vec<Pose3>, cloud: &SurfelCloud, options: &IcpOptions| -> Vec<(f64, Pose3)> {
            let refined = hypotheses.into_iter().map(|guess| {
                let refined = self.register(view, cloud, guess, options).T_target_source;
                (self.evidence(view, cloud, &refined).support - penalty(&refined), refined)
            });
            refined.collect()
        };
        let rough = refined(best_distinct(scored, num_rough), &self.sparse, &rough_options());
        let middle = refined(best_distinct(rough.clone(), num_middle), &self.middle, &middle_options());
        Refined { rough, middle }
    }

    /// The final registration of the best of a few refined poses. Where the evidence contradicts it, others are compared with
    /// it, each in the view from its own pose: so far they were scored in a common view.
    fn best_of_refined(&self, Refined { rough, mut middle }: Refined) -> PoseHypothesis {
        middle.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut poses = middle.iter().map(|(_, pose)| *pose).take(NUM_FINELY_REGISTERED);
        let mut best = self.register_at(poses.next().unwrap_or_else(Pose3::identity));
        for pose in poses {
            if best.agreement > self.clear_agreement {
                break;
            }
            if apart(&pose, best.T_world_sensor()) < SAME_POSE_DISTANCE {
                continue;
            }
            let other = self.register_at(pose);
            let is_less_contradicted = 2.0 * (1.0 - other.agreement) < 1.0 - best.agreement;
            let is_likelier = other.support > best.support || self.explains_brightness_better(&other, &best);
            if is_less_contradicted && is_likelier && other.is_degenerate <= best.is_degenerate {
                best = other;
            }
        }
        self.choose_by_color(best, rough)
    }

    /// Chooses among the hypotheses by brightness, where neither surfaces nor brightness determine the position along one
    /// direction, or where brightness contradicts the pose.
    fn choose_by_color(&self, mut best: PoseHypothesis, hypotheses: Vec<(f64, Pose3)>) -> PoseHypothesis {
        let Some(textured) = self.textured.as_ref().filter(|textured| best.is_degenerate || !textured.is_for_open_only)
        else {
            return best;
        };
        best.photometric_ncc = self.photometric_ncc(textured, best.T_world_sensor());
        let best_ncc = best.photometric_ncc.unwrap_or(0.0);
        if !best.is_degenerate && best.photometric_ncc.is_none_or(|ncc| ncc > CLEAR_NCC) {
            return best;
        }
        if !best.is_degenerate {
            let (weakest, _) = DegenerateDirection::weakest(&best.registration.correspondences, FINE_TOLERANCE);
            let offset = self.offset_along(textured, &best, &weakest);
            if let Some(offset) = offset.filter(|offset| offset.steps.abs() > SAME_OFFSET_STEPS) {
                if let Some(moved) = self.register_at_offset(textured, &best, &weakest, offset) {
                    return moved;
                }
                // Surfaces and brightness contradict each other: the position along this direction is unknown.
                best.is_degenerate = true;
            }
        }
        let Some(pose) = self.best_by_ncc(&best, best_ncc, hypotheses) else { return best };
        let mut other = self.register_at(pose);
        other.photometric_ncc = self.photometric_ncc(textured, other.T_world_sensor());
        let is_better = !other.is_degenerate
            && is_distinct(other.photometric_ncc.unwrap_or(0.0), best_ncc)
            && other.agreement > best.agreement - MAX_AGREEMENT_LOSS;
        if is_better { other } else { best }
    }

    /// The hypothesis with the highest photometric correlation, if that is distinctly higher than the best pose's.
    fn best_by_ncc(&self, best: &PoseHypothesis, best_ncc: f64, hypotheses: Vec<(f64, Pose3)>) -> Option<Pose3> {
        let textured = self.textured.as_ref()?;
        let num_hypotheses = hypotheses.len();
        let refined = best_distinct(hypotheses, num_hypotheses).into_iter().map(|guess| {
            let refined = self.register(&best.view, &self.middle, guess, &middle_options()).T_target_source;
            (self.photometric_ncc(textured, &refined).unwrap_or(0.0), refined)
        });
        let highest =
            refined.fold((best_ncc, None), |best, (ncc, pose)| if ncc > best.0 { (ncc, Some(pose)) } else { best });
        highest.1.filter(|_| highest.0 >= MIN_NCC && is_distinct(highest.0, best_ncc))
    }
}
