//! The registration of a frame's proposals: the one with the best evidence is returned.

use super::color::DistinctOffset;
use super::evidence::{MIN_AGREEMENT_DIFFERENCE, MIN_NCC, is_distinct, is_same_place};
use super::frame_matcher::{FrameMatcher, middle_options};
use super::hypotheses::{SAME_POSE_DISTANCE, best_distinct};
use super::pose_hypothesis::PoseHypothesis;
use super::propose::{NUM_REFINED, Proposals};
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;

/// Agreement (0..=1) of a frame without noise above which other proposals are not registered. Without it a frame of a stereo camera before a
/// bare wall is good and 0.11 m off.
const CLEAR_AGREEMENT: f64 = 0.998;

impl FrameMatcher<'_> {
    /// The registration near a guess, with degenerate directions resolved and refined by brightness.
    pub(super) fn register_at(&self, guess: Pose3) -> PoseHypothesis {
        self.refine_by_color(self.resolve_degeneracy(self.register_finely(guess)))
    }

    /// The final registration of the best proposal near a prediction. Where the view does not constrain it, others are compared
    /// with it.
    pub(super) fn best_near(&self, proposals: Proposals) -> PoseHypothesis {
        self.best_among(proposals, PoseHypothesis::is_degenerate)
    }

    /// The final registration of the best proposal of a wide search. Where the evidence contradicts it, others are compared
    /// with it, each in the view from its own pose: so far they were scored in a common view.
    pub(super) fn best_of(&self, proposals: Proposals) -> PoseHypothesis {
        self.best_among(proposals, |_| true)
    }

    /// The final registration of the best proposal, or of another one while `is_compared` holds of it.
    fn best_among(
        &self,
        Proposals { rough, mut middle }: Proposals,
        is_compared: impl Fn(&PoseHypothesis) -> bool,
    ) -> PoseHypothesis {
        middle.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut poses = middle.iter().map(|(_, pose)| *pose).take(NUM_REFINED[1]);
        let mut best = self.register_at(poses.next().unwrap_or_else(Pose3::identity));
        for pose in poses {
            if best.agreement > CLEAR_AGREEMENT || !is_compared(&best) {
                break;
            }
            if pose_distance(&pose, best.T_world_sensor()) < SAME_POSE_DISTANCE {
                continue;
            }
            let other = self.register_at(pose);
            let is_better = other.agreement > best.agreement && other.support > best.support;
            if is_better && other.is_degenerate() <= best.is_degenerate() {
                best = other;
            }
        }
        self.choose_by_color(best, rough)
    }

    /// Chooses among the hypotheses by brightness, where neither surfaces nor brightness determine the position along one
    /// direction, or where brightness contradicts the pose.
    fn choose_by_color(&self, mut best: PoseHypothesis, hypotheses: Vec<(f64, Pose3)>) -> PoseHypothesis {
        let Some(textured) =
            self.textured.as_ref().filter(|textured| best.is_degenerate() || !textured.is_for_degenerate_only)
        else {
            return best;
        };
        best.photometric_ncc = self.photometric_ncc(textured, best.T_world_sensor());
        let best_ncc = best.photometric_ncc.unwrap_or(0.0);
        if !best.is_degenerate() && best.photometric_ncc.is_none_or(is_same_place) {
            return best;
        }
        if !best.is_degenerate() {
            let weakest = best.weakest;
            let offset = self.offset_along(textured, &best, &weakest);
            if let Some(offset) = offset.filter(DistinctOffset::is_elsewhere) {
                if let Some(moved) = self.register_at_offset(textured, &best, &weakest, offset) {
                    return moved;
                }
                // Surfaces and brightness contradict each other: the position along this direction is unknown.
                best = self.mark_degenerate(best);
            }
        }
        let Some(pose) = self.best_by_ncc(&best, best_ncc, hypotheses) else { return best };
        let mut other = self.register_at(pose);
        other.photometric_ncc = self.photometric_ncc(textured, other.T_world_sensor());
        let is_better = !other.is_degenerate()
            && is_distinct(other.photometric_ncc.unwrap_or(0.0), best_ncc)
            && other.agreement > best.agreement - MIN_AGREEMENT_DIFFERENCE;
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
