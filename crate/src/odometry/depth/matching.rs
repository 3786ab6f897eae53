//! A frame that is being looked for in a map.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::color::ColorMatcher;
use super::evidence::FINE_TOLERANCE;
use super::evidence::{Evidence, score};
use super::grid_search::{self, best_poses};
use super::hypotheses::{best_distinct, grid_around, motion_penalty};
use super::pose_hypothesis::PoseHypothesis;
use super::reference_map::ReferenceMap;
use super::{DepthOptions, SAME_PLACE};
use crate::geometry::Pose3;
use crate::map::keyframes::apart;
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::factors::PointToPlane;
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Weighting, register_with};
use crate::registration::prepared_surfels::{PreparedSurfels, SurfelCloud};
use crate::registration::projective::ProjectiveTarget;
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::Solver;
use crate::registration::spatial::SpatialRegistration;

/// Points that tell which guesses are worth to be scored by more, ...
const FIRST_POINTS: usize = 80;
/// ... which is one in so many.
const RESCORED_SHARE: usize = 4;
/// Guesses that are refined with few points, ...
const ROUGH_GUESSES: usize = 8;
/// ... and of these with more.
const REFINED_GUESSES: usize = 3;
/// Guesses of a frame of which nothing is known that are refined with few points, ...
const GUESSES_ANYWHERE: usize = 24;
/// ... and of these with more.
const REFINED_ANYWHERE: usize = 5;
/// Places that look most like a frame that is nowhere near: so many are looked at.
const PLACES_ANYWHERE: usize = 6;
/// Places along an open direction that are compared, so many either way ...
const PLACES: i32 = 10;
/// ... and so far apart (m).
const BETWEEN_PLACES: f64 = 0.1;
/// Where more than this agrees, no other place is asked for.
const CLEAR_AGREEMENT: f64 = 0.998;
/// Where more than this share of the surfaces face along the direction that is held least, they hold it. Of 1486 frames of
/// generated flats that agreed by 0.95 none with more was off by over 8 cm, but for one after a frame that was.
const AMPLE_SHARE: f64 = 0.05;
/// Where fewer do, they hold it if their residuals say that it is known so well (m): of 295 such frames of
/// generated flats one was off by 4 cm, the others by less than 3, ...
const CERTAIN_DEVIATION: f64 = 1e-3;
/// ... and above this they do not: errors of decimetres are as common there as small ones. ...
const OPEN_DEVIATION: f64 = 2e-3;
/// ... In between the frame is pushed so far along it either way (m), ...
const PUSHED: f64 = 0.075;
/// ... and is to come back as near to where it was (m, turns included): noise alone does not lead back.
const BACK: f64 = 0.02;
/// A place is told from another when it agrees so much better.
pub(super) const TELLING_AGREEMENT: f64 = 0.01;

/// A frame that is being looked for in a map.
pub(super) struct Matching<'a> {
    pub(super) seen: &'a ReferenceMap,
    pub(super) frame: &'a PreparedSurfels,
    /// The frame as its own camera sees it: what the map's surfaces are held against.
    own_view: ProjectiveTarget,
    sparse: SurfelCloud,
    pub(super) middle: SurfelCloud,
    pub(super) fine: SurfelCloud,
    pub(super) solver: Solver<Pose3>,
    /// What stands out of it, where its colours are to be used.
    pub(super) color_matcher: Option<ColorMatcher<'a>>,
}

impl<'a> Matching<'a> {
    pub(super) fn new(seen: &'a ReferenceMap, frame: &'a PreparedSurfels, options: DepthOptions) -> Self {
        Self {
            seen,
            frame,
            own_view: ProjectiveTarget::of_frame(&frame.image, 1),
            sparse: frame.sparse(),
            middle: frame.middle(),
            fine: frame.fine(),
            solver: options.motion.solver(),
            color_matcher: ColorMatcher::new(frame, options.color),
        }
    }

    /// The registration that the best of these guesses leads to; the map is seen from `T_world_view` at first.
    pub(super) fn best_of(&self, hypotheses: &[Pose3], T_world_view: &Pose3) -> PoseHypothesis {
        let view = self.seen.map.view(&self.frame.image, T_world_view);
        self.refine(&view, self.scored(&view, hypotheses.iter().copied()), T_world_view)
    }

    /// Guesses with what speaks for them, by few points and, where that is much, by more.
    fn scored(&self, view: &ProjectiveTarget, hypotheses: impl Iterator<Item = Pose3>) -> Vec<(f64, Pose3)> {
        let (few, more) = (self.sparse.at_most(FIRST_POINTS).point_batch(), self.sparse.point_batch());
        let mut scored: Vec<(f64, Pose3)> = hypotheses.map(|guess| (score(view, &few, &guess), guess)).collect();
        let rescored = scored.len() / RESCORED_SHARE;
        if rescored > 0 {
            scored.select_nth_unstable_by(rescored, |a, b| b.0.total_cmp(&a.0));
        }
        let rescored = if rescored > 0 { rescored } else { scored.len() };
        for (support, guess) in &mut scored[..rescored] {
            *support = score(view, &more, guess);
        }
        scored
    }

    /// The same for turns by any angle and moves of up to a metre around a pose.
    pub(super) fn best_of_all_around(&self, T_world_last: &Pose3) -> PoseHypothesis {
        let quarters = [0, 1, 2, 3].map(|quarter| {
            let turned = T_world_last * Isometry3::rotation(Vector3::y() * f64::from(quarter) * 90f64.to_radians());
            let view = self.seen.map.view(&self.frame.image, &turned);
            let hypotheses = grid_around(&turned, -6..=6, 7.5f64.to_radians(), 4, 4);
            self.refine(&view, self.scored(&view, hypotheses), T_world_last)
        });
        let [first, others @ ..] = quarters;
        others.into_iter().fold(first, |best, next| if next.support > best.support { next } else { best })
    }

    /// The same for turns by any angle about the view's vertical and moves of up to four metres ahead and aside, near or far
    /// alike: for a frame of which nothing is known.
    pub(super) fn best_of_anywhere(&self, T_world_view: &Pose3) -> PoseHypothesis {
        let view = self.seen.map.view(&self.frame.image, T_world_view);
        let places = best_poses(&view, &self.sparse.at_most(grid_search::POINTS), T_world_view);
        self.refine_best(&view, places, [GUESSES_ANYWHERE, REFINED_ANYWHERE], |_| 0.0)
    }

    /// From scored guesses to one registration: few points for many guesses, more points for few.
    fn refine(&self, view: &ProjectiveTarget, scored: Vec<(f64, Pose3)>, T_world_last: &Pose3) -> PoseHypothesis {
        self.refine_best(view, scored, [ROUGH_GUESSES, REFINED_GUESSES], |pose| motion_penalty(T_world_last, pose))
    }

    /// The same for so many guesses with few points and with more; `motion_penalty` is taken off what speaks for a pose.
    fn refine_best(
        &self,
        view: &ProjectiveTarget,
        scored: Vec<(f64, Pose3)>,
        [num_rough, num_refined]: [usize; 2],
        motion_penalty: impl Fn(&Pose3) -> f64,
    ) -> PoseHypothesis {
        let refined = |hypotheses: Vec<Pose3>, cloud: &SurfelCloud, options: &IcpOptions| -> Vec<(f64, Pose3)> {
            let refined = hypotheses.into_iter().map(|guess| {
                let refined = self.register_to(view, cloud, guess, options).T_target_source;
                (self.evidence(view, cloud, &refined).support - motion_penalty(&refined), refined)
            });
            refined.collect()
        };
        let rough = refined(best_distinct(scored, num_rough), &self.sparse, &rough_options());
        let middle = refined(best_distinct(rough.clone(), num_refined), &self.middle, &middle_options());
        let best = self.best_settled(middle);
        self.choose_by_color(best, rough)
    }

    /// The registration that the best of a few scored poses leads to; where something contradicts it, the others are held
    /// against it, each with the map as it is seen from there: so far they have all been seen from one place.
    fn best_settled(&self, mut scored: Vec<(f64, Pose3)>) -> PoseHypothesis {
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut poses = scored.iter().map(|(_, pose)| *pose);
        let mut best = self.settled(poses.next().unwrap_or_else(Pose3::identity));
        for pose in poses {
            if best.agreement > CLEAR_AGREEMENT {
                break;
            }
            if apart(&pose, &best.registration.T_target_source) < SAME_PLACE {
                continue;
            }
            let other = self.settled(pose);
            let is_less_contradicted = 2.0 * (1.0 - other.agreement) < 1.0 - best.agreement;
            let is_likelier = other.support > best.support || self.has_better_photometric_ncc(&other, &best);
            if is_less_contradicted && is_likelier && other.is_degenerate <= best.is_degenerate {
                best = other;
            }
        }
        best
    }

    /// In the places of all key frames: where this frame looks like one of them, if anywhere.
    pub(super) fn best_of_everywhere(&self) -> Option<PoseHypothesis> {
        let (mut scored, sparse) = (Vec::new(), self.sparse.point_batch());
        for keyframe in self.seen.keyframes.all() {
            for T_key_camera in grid_around(&Pose3::identity(), -2..=2, 15f64.to_radians(), 1, 1) {
                scored.push((score(keyframe.view(), &sparse, &T_key_camera), keyframe.T_world_camera * T_key_camera));
            }
        }
        let found = best_distinct(scored, PLACES_ANYWHERE).into_iter().map(|guess| {
            let view = self.seen.map.view(&self.frame.image, &guess);
            self.refine(&view, vec![(0.0, guess)], &guess)
        });
        found.max_by(|a, b| a.support.total_cmp(&b.support))
    }

    /// The registration near a guess, with places along a direction that it leaves open compared.
    pub(super) fn settled(&self, guess: Pose3) -> PoseHypothesis {
        self.color_matcher(self.settle(self.register_finely(guess)))
    }

    pub(super) fn register_finely(&self, guess: Pose3) -> PoseHypothesis {
        self.register_finely_by(&self.solver, guess)
    }

    /// The same, but along a direction it stays where the guess is.
    pub(super) fn register_across(&self, degenerate: &DegenerateDirection, guess: Pose3) -> PoseHypothesis {
        // A turn about the world's origin moves the camera as well.
        let (turned, moved) = (guess.translation.vector.cross(&degenerate.direction), degenerate.direction);
        let along = Vector6::new(turned.x, turned.y, turned.z, moved.x, moved.y, moved.z);
        self.register_finely_by(&self.solver.holding(&along), guess)
    }

    fn register_finely_by(&self, solver: &Solver<Pose3>, guess: Pose3) -> PoseHypothesis {
        let view = self.seen.map.view(&self.frame.image, &guess);
        let registration = register(solver, &view, &self.fine, guess, &fine_options());
        let Evidence { support, overlap, agreement } =
            self.evidence(&view, &self.middle, &registration.T_target_source);
        PoseHypothesis { registration, view, support, overlap, agreement, is_degenerate: false, photometric_ncc: None }
    }

    /// Where hardly any surface holds a direction, the borders of things may: the registration does not see them, but what
    /// stands in free space tells. Places along that direction are compared by it, and not by how much of the map they
    /// see: that is most where nothing new is in view.
    fn settle(&self, found: PoseHypothesis) -> PoseHypothesis {
        let (weakest, share) = DegenerateDirection::weakest(&found.registration.correspondences, FINE_TOLERANCE);
        if self.is_constrained(&found, &weakest, share) {
            return found;
        }
        let here = self.agreement_at(&found, &weakest, 0).0;
        let elsewhere = self.best_elsewhere(&found, &weakest);
        let (mut found, mut is_told) = (found, elsewhere.0 < here - TELLING_AGREEMENT);
        if elsewhere.0 > here + TELLING_AGREEMENT {
            let other = self.register_finely(elsewhere.1);
            if other.agreement > found.agreement + TELLING_AGREEMENT {
                is_told = self.best_elsewhere(&other, &weakest).0 < other.agreement - TELLING_AGREEMENT;
                found = other;
            }
        }
        // What is still moving moves along it.
        found.is_degenerate = !is_told || !found.registration.converged;
        found
    }

    /// Whether surfaces hold a frame along its weakest direction: where only `share` of them face along it, they must fit so
    /// well that its place is known, or lead back to where it is from both sides.
    fn is_constrained(&self, found: &PoseHypothesis, weakest: &DegenerateDirection, share: f64) -> bool {
        let deviation = weakest.sigma(&found.registration.information);
        let comes_back = || [-PUSHED, PUSHED].iter().all(|far| self.comes_back(found, weakest.direction * *far));
        share > AMPLE_SHARE
            || found.registration.converged
                && (is_well_constrained(share, deviation) || (deviation < OPEN_DEVIATION && comes_back()))
    }

    /// Whether the registration leads back to where it was found from so far away; where it ends elsewhere, that must be
    /// contradicted.
    fn comes_back(&self, found: &PoseHypothesis, push: Vector3<f64>) -> bool {
        let T_world_found = &found.registration.T_target_source;
        let again = self.register_finely(Pose3::translation(push.x, push.y, push.z) * T_world_found);
        apart(T_world_found, &again.registration.T_target_source) < BACK
            || again.agreement < found.agreement - TELLING_AGREEMENT
    }

    /// The agreement so many places along an open direction, and where that is.
    fn agreement_at(&self, found: &PoseHypothesis, degenerate: &DegenerateDirection, place: i32) -> (f64, Pose3) {
        let moved = degenerate.direction * (f64::from(place) * BETWEEN_PLACES);
        let pose = Pose3::translation(moved.x, moved.y, moved.z) * found.registration.T_target_source;
        (self.evidence(&found.view, &self.middle, &pose).agreement, pose)
    }

    fn best_elsewhere(&self, found: &PoseHypothesis, degenerate: &DegenerateDirection) -> (f64, Pose3) {
        let places = (-PLACES..=PLACES).filter(|place| *place != 0);
        let agreements = places.map(|place| self.agreement_at(found, degenerate, place));
        agreements.fold((0.0, Pose3::identity()), |best, next| if next.0 > best.0 { next } else { best })
    }

    pub(super) fn register_to_middle(&self, view: &ProjectiveTarget, guess: Pose3) -> Pose3 {
        self.register_to(view, &self.middle, guess, &middle_options()).T_target_source
    }

    fn register_to(
        &self,
        view: &ProjectiveTarget,
        cloud: &SurfelCloud,
        guess: Pose3,
        options: &IcpOptions,
    ) -> SpatialRegistration {
        register(&self.solver, view, cloud, guess, options)
    }

    pub(super) fn evidence(&self, view: &ProjectiveTarget, cloud: &SurfelCloud, T_world_camera: &Pose3) -> Evidence {
        Evidence::gather(self.seen, view, cloud, &self.own_view, T_world_camera)
    }
}

/// Whether surfaces hold a direction that this share of them face along, by their residuals to this deviation (m).
pub(super) fn is_well_constrained(share: f64, deviation: f64) -> bool {
    share > AMPLE_SHARE || deviation < CERTAIN_DEVIATION
}

fn register(
    solver: &Solver<Pose3>,
    view: &ProjectiveTarget,
    cloud: &SurfelCloud,
    guess: Pose3,
    options: &IcpOptions,
) -> SpatialRegistration {
    register_with(cloud.source(), view, guess, &PointToPlane, options, solver)
}

fn rough_options() -> IcpOptions {
    options((0.4, 0.7), 0.15, Criteria { max_iterations: 8, rotation_eps: 3e-3, translation_eps: 5e-3 })
}

pub(crate) fn middle_options() -> IcpOptions {
    options((0.3, 0.6), 0.08, Criteria { max_iterations: 15, rotation_eps: 1e-3, translation_eps: 2e-3 })
}

pub(crate) fn fine_options() -> IcpOptions {
    options((0.15, 0.5), 0.03, Criteria { max_iterations: 30, rotation_eps: 1e-4, translation_eps: 1e-4 })
}

/// Pairs within a distance (m) and an angle (rad), the kernel's width (m), and when to end.
fn options(
    (max_correspondence_distance, max_normal_angle): (f64, f64),
    robust_kernel_width: f64,
    criteria: Criteria,
) -> IcpOptions {
    IcpOptions {
        rejection: Rejection { max_correspondence_distance, max_normal_angle, trim_fraction: 0.0 },
        weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width },
        criteria,
    }
}
