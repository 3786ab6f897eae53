//! Colours in the estimate: what is painted on surfaces holds a frame where the surfaces do not.
//!
//! A frame's points are compared with the pictures of key frames rather than with a map of mean colours: nothing is
//! smeared. Brightness and surfaces count by their own uncertainties; where they contradict each other, surfaces win.

use nalgebra::{Matrix6, Vector6};

use super::ColorUse;
use super::evidence::Evidence;
use super::evidence::FINE_TOLERANCE;
use super::hypotheses::best_distinct;
use super::matching::Matching;
use super::pose_hypothesis::PoseHypothesis;
use super::reference_map::ReferenceMap;
use crate::camera::brightness::NUM_LEVELS;
use crate::geometry::{Pose3, RigidMotion};
use crate::map::keyframes::{Keyframe, apart};
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::factors::{Factor, NormalEquations, PointToPlane};
use crate::registration::free_space::FreeSpaceTest;
use crate::registration::photometric::{
    Gaussian, MIN_POINTS, PhotometricResult, ReferenceKeyframe, TexturedPoint, correlation, register_by_brightness,
};
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::sandwich_variance::unit_variance;

/// Pictures that a frame is compared with.
const MAX_REFERENCES: usize = 3;
/// A point is seen in a picture where the surface there is this near (m).
const SAME_SURFACE: f64 = 0.05;
/// Brightness that agrees less than this is of other light or another place.
const MIN_CORRELATION: f64 = 0.6;
/// Where surfaces hold a frame it is off by little: the coarsest level is left out.
const FINE_LEVEL: usize = NUM_LEVELS - 2;
/// Surfaces know better when brightness is off by so many of their standard deviations in the mean of the six directions
/// (squared and summed up), ...
const MAX_SQ_DEVIATIONS: f64 = 6.0 * 5.0 * 5.0;
/// or when so much less of the surfaces agrees there.
const WORSE_AGREEMENT: f64 = 0.005;
/// A move as small as this (m, turns included) changes nothing of what agrees.
const SAME_EVIDENCE: f64 = 0.01;
/// Places along an open direction that are compared, so many either way: as far as a frame may have moved, so that what
/// repeats itself, as tiles do, is seen to. ...
const PLACES: i32 = 32;
/// ... and so far apart (m).
const BETWEEN_PLACES: f64 = 0.05;
/// Places that are not more than so many apart are one.
const APART: i32 = 5;
/// The best place is told from another when brightness agrees so much better, ...
const TELLING_CORRELATION: f64 = 0.15;
/// ... or leaves so many times less unexplained.
const TELLING_RATIO: f64 = 3.0;
/// Brightness that agrees better than this does so by chance.
const LEAST_UNEXPLAINED: f64 = 0.004;
/// Where a place looks less like the pictures than this, others are looked at. ...
const USUAL_CORRELATION: f64 = 0.95;
/// ... A place that looks less like the pictures than this may be another one, as one a tile further is.
pub(super) const SAME_PLACE_CORRELATION: f64 = 0.9;
/// One in so many of the points is to be seen at a place, at the least.
const MIN_COMPARED: usize = 8;
/// A place is held when it is known so well (m).
const HELD_DEVIATION: f64 = 0.03;
/// Colours that are right contradict surfaces by no more than this share of what agrees.
const CONTRADICTION: f64 = 0.02;
/// Side of a patch of surfaces whose errors are not independent (cells).
const PATCH: usize = 16;
/// One pair of surfaces in so many is asked.
const SURFACE_STRIDE: usize = 3;
/// Surfaces are not known better than so (rad and m), however well they fit.
const MIN_DEVIATION: f64 = 2e-4;

/// A frame's points that stand out.
pub(super) struct ColorMatcher<'a> {
    points: &'a [TexturedPoint],
    is_for_open_only: bool,
}

impl<'a> ColorMatcher<'a> {
    /// None where the frame has no colours that are to be used, or nothing in it stands out.
    pub(super) fn new(frame: &'a PreparedSurfels, color: ColorUse) -> Option<Self> {
        let points = if color == ColorUse::NotUsed { &[] } else { &frame.textured[..] };
        let is_for_open_only = color == ColorUse::WhereOpen;
        (points.len() >= MIN_POINTS).then_some(Self { points, is_for_open_only })
    }

    /// The pictures of key frames that see most of the points from about this pose.
    fn references<'s>(&self, seen: &'s ReferenceMap, T_world_camera: &Pose3) -> Vec<ReferenceKeyframe<'s>> {
        let views = seen.keyframes.near(T_world_camera).into_iter();
        let reference = |view: &'s Keyframe| {
            let picture = view.picture()?;
            let T_view_camera = view.T_world_camera.inverse() * T_world_camera;
            let (R, t) = (T_view_camera.rotation.to_rotation_matrix().into_inner(), T_view_camera.translation.vector);
            let is_seen = |&index: &u32| {
                let point = R * self.points[index as usize].point + t;
                matches!(view.view().classify(&point, SAME_SURFACE), FreeSpaceTest::Agreeing(_))
            };
            let seen: Vec<u32> = (0..self.points.len() as u32).filter(is_seen).collect();
            (seen.len() >= MIN_POINTS).then_some(ReferenceKeyframe {
                picture,
                T_world_camera: view.T_world_camera,
                seen,
            })
        };
        views.filter_map(reference).take(MAX_REFERENCES).collect()
    }
}

/// What the surfaces of a registration tell of the pose. The errors of a patch of them are one error.
fn surfaces_of(matching: &Matching<'_>, found: &PoseHypothesis) -> Gaussian {
    let Matching { frame, fine, solver, .. } = matching;
    let camera = frame.image.cell_camera();
    let (columns, rows) = (frame.image.columns.div_ceil(PATCH).max(1), frame.image.rows.div_ceil(PATCH).max(1));
    let mut patches = vec![Vector6::zeros(); columns * rows];
    let mut sum = NormalEquations::<Pose3>::zeros();
    for pair in found.registration.correspondences.iter().step_by(SURFACE_STRIDE) {
        let equations: NormalEquations<Pose3> = PointToPlane.normal_equations(&found.view, std::slice::from_ref(pair));
        let Some(place) = camera.project(&fine.points[pair.source as usize]) else { continue };
        let (column, row) = (place.x.max(0.0) as usize / PATCH, place.y.max(0.0) as usize / PATCH);
        sum.H += equations.H;
        patches[row.min(rows - 1) * columns + column.min(columns - 1)] += equations.b;
    }
    let variance = unit_variance(&solver.restricted(sum).H, &patches).max(MIN_DEVIATION * MIN_DEVIATION);
    Gaussian { T_world_camera: found.registration.T_target_source, information: sum.H / variance }
}

impl Matching<'_> {
    /// Moved by what colours tell, where there are any and they agree.
    pub(super) fn color_matcher(&self, mut found: PoseHypothesis) -> PoseHypothesis {
        let Some(color_matcher) = &self.color_matcher else { return found };
        let weakest = || DegenerateDirection::weakest(&found.registration.correspondences, FINE_TOLERANCE).0;
        let degenerate = if found.is_degenerate {
            Some(weakest())
        } else {
            DegenerateDirection::of(&found.registration.correspondences, FINE_TOLERANCE)
        };
        if let Some(degenerate) = degenerate
            && let Some(told) = self.place_of(color_matcher, &found, &degenerate)
        {
            if let Some(placed) = self.placed(color_matcher, &found, &degenerate, told) {
                return placed;
            }
            // Colours say that it is elsewhere, surfaces that it is not there either.
            found.is_degenerate |= told.place.abs() > APART;
        }
        if color_matcher.is_for_open_only {
            return found;
        }
        let surfaces = surfaces_of(self, &found);
        let Some(result) = self.by_brightness(color_matcher, &surfaces, FINE_LEVEL) else { return found };
        let off = (result.T_world_camera * surfaces.T_world_camera.inverse()).log();
        if off.dot(&(surfaces.information * off)) > MAX_SQ_DEVIATIONS {
            return found;
        }
        self.moved(found, &result)
    }

    /// Where surfaces leave a direction open and colours do not tell the place along it, or where brightness contradicts the
    /// place, it may be another one altogether: that of the guesses which looks most like the pictures.
    pub(super) fn choose_by_color(&self, mut found: PoseHypothesis, hypotheses: Vec<(f64, Pose3)>) -> PoseHypothesis {
        let is_asked = |color_matcher: &&ColorMatcher| found.is_degenerate || !color_matcher.is_for_open_only;
        let Some(color_matcher) = self.color_matcher.as_ref().filter(is_asked) else { return found };
        found.photometric_ncc = self.photometric_ncc(color_matcher, &found.registration.T_target_source);
        let here = found.photometric_ncc.unwrap_or(0.0);
        if !found.is_degenerate
            && found.photometric_ncc.is_none_or(|photometric_ncc| photometric_ncc > USUAL_CORRELATION)
        {
            return found;
        }
        if !found.is_degenerate {
            let (weakest, _) = DegenerateDirection::weakest(&found.registration.correspondences, FINE_TOLERANCE);
            if let Some(told) = self.place_of(color_matcher, &found, &weakest).filter(|told| told.place.abs() > APART) {
                if let Some(placed) = self.placed(color_matcher, &found, &weakest, told) {
                    return placed;
                }
                // As where a direction is open.
                found.is_degenerate = true;
            }
        }
        let num_guesses = hypotheses.len();
        let refined = best_distinct(hypotheses, num_guesses).into_iter().map(|guess| {
            let refined = self.register_to_middle(&found.view, guess);
            (self.photometric_ncc(color_matcher, &refined).unwrap_or(0.0), refined)
        });
        let best =
            refined.fold(
                (here, None),
                |best, (photometric_ncc, pose)| {
                    if photometric_ncc > best.0 { (photometric_ncc, Some(pose)) } else { best }
                },
            );
        let (ncc_there, Some(pose)) = best else { return found };
        if ncc_there < MIN_CORRELATION || !is_told(ncc_there, here) {
            return found;
        }
        let mut there = self.settled(pose);
        there.photometric_ncc = self.photometric_ncc(color_matcher, &there.registration.T_target_source);
        let is_better = !there.is_degenerate
            && is_told(there.photometric_ncc.unwrap_or(0.0), here)
            && there.agreement > found.agreement - CONTRADICTION;
        if is_better { there } else { found }
    }

    /// Whether the pictures leave half as much unexplained at one place as at the other; false without colours.
    pub(super) fn has_better_photometric_ncc(&self, there: &PoseHypothesis, here: &PoseHypothesis) -> bool {
        self.color_matcher.as_ref().is_some_and(|color_matcher| {
            let unexplained = |found: &PoseHypothesis| {
                1.0 - self.photometric_ncc(color_matcher, &found.registration.T_target_source).unwrap_or(0.0)
            };
            2.0 * unexplained(there) < unexplained(here)
        })
    }

    /// How well the brightness at a pose agrees with the pictures, by the coarsest level; none where too little is seen.
    fn photometric_ncc(&self, color_matcher: &ColorMatcher, T_world_camera: &Pose3) -> Option<f64> {
        let references = color_matcher.references(self.seen, T_world_camera);
        let (correlation, num_compared) =
            correlation(color_matcher.points, &references, T_world_camera, NUM_LEVELS - 1);
        (num_compared * MIN_COMPARED > color_matcher.points.len()).then_some(correlation)
    }

    /// The likeliest pose near that of the surfaces, where the pictures agree.
    fn by_brightness(
        &self,
        color_matcher: &ColorMatcher,
        surfaces: &Gaussian,
        coarsest: usize,
    ) -> Option<PhotometricResult> {
        let references = color_matcher.references(self.seen, &surfaces.T_world_camera);
        let result = register_by_brightness(color_matcher.points, &references, surfaces, coarsest, &self.solver)?;
        (result.correlation > MIN_CORRELATION).then_some(result)
    }

    /// A registration moved to where brightness holds it, unless the surfaces agree less there.
    fn moved(&self, mut found: PoseHypothesis, result: &PhotometricResult) -> PoseHypothesis {
        if apart(&found.registration.T_target_source, &result.T_world_camera) > SAME_EVIDENCE {
            let Evidence { support, overlap, agreement } =
                self.evidence(&found.view, &self.middle, &result.T_world_camera);
            if agreement < found.agreement - WORSE_AGREEMENT {
                return found;
            }
            found = PoseHypothesis { support, overlap, agreement, ..found };
        }
        found.registration.T_target_source = result.T_world_camera;
        // Surfaces alone may go round in a circle.
        found.registration.converged |= result.converged;
        found
    }

    /// Where surfaces leave a direction open, pictures may tell the place along it: so many places away. None where they do
    /// not.
    fn place_of(
        &self,
        color_matcher: &ColorMatcher,
        found: &PoseHypothesis,
        degenerate: &DegenerateDirection,
    ) -> Option<Told> {
        let places: Vec<(f64, i32)> = (-PLACES..=PLACES)
            .map(|place| (self.photometric_ncc(color_matcher, &along(found, degenerate, place)).unwrap_or(0.0), place))
            .collect();
        let best = places.iter().copied().fold((0.0, 0), |best, next| if next.0 > best.0 { next } else { best });
        let elsewhere = places.iter().filter(|(_, place)| (place - best.1).abs() > APART);
        let second = elsewhere.map(|(correlation, _)| *correlation).fold(0.0, f64::max);
        (best.0 > MIN_CORRELATION && is_told(best.0, second)).then_some(Told { place: best.1, runner_up_ncc: second })
    }

    /// The registration so many places along an open direction, if colours and surfaces both hold it there.
    fn placed(
        &self,
        color_matcher: &ColorMatcher,
        found: &PoseHypothesis,
        degenerate: &DegenerateDirection,
        told: Told,
    ) -> Option<PoseHypothesis> {
        let surfaces = Gaussian { T_world_camera: along(found, degenerate, told.place), ..surfaces_of(self, found) };
        let result = self.held_by_color(color_matcher, degenerate, &surfaces)?;
        // The surfaces there are other ones.
        let again = self.register_finely(result.T_world_camera);
        let result = self.held_by_color(color_matcher, degenerate, &surfaces_of(self, &again))?;
        let mut placed = self.moved(again, &result);
        placed.photometric_ncc = self.photometric_ncc(color_matcher, &placed.registration.T_target_source);
        let is_there = placed.registration.T_target_source == result.T_world_camera
            && placed.photometric_ncc.is_some_and(|photometric_ncc| is_told(photometric_ncc, told.runner_up_ncc));
        (is_there && placed.agreement > found.agreement - CONTRADICTION).then_some(placed)
    }

    /// The likeliest pose if colours know the place along a direction; surfaces have no say in that.
    fn held_by_color(
        &self,
        color_matcher: &ColorMatcher,
        degenerate: &DegenerateDirection,
        surfaces: &Gaussian,
    ) -> Option<PhotometricResult> {
        let along = &degenerate.direction;
        let direction = Vector6::new(0.0, 0.0, 0.0, along.x, along.y, along.z);
        let across = Matrix6::identity() - direction * direction.transpose();
        let information = across * surfaces.information * across;
        let result = self.by_brightness(color_matcher, &Gaussian { information, ..*surfaces }, NUM_LEVELS - 1)?;
        let known = self.solver.restricted(NormalEquations { H: information + result.information, b: direction });
        let variance = direction.dot(&known.H.cholesky()?.solve(&known.b));
        (variance < HELD_DEVIATION * HELD_DEVIATION).then_some(result)
    }
}

/// A place along a direction that brightness tells from all others, and how well it agrees with the best of those.
#[derive(Clone, Copy)]
struct Told {
    place: i32,
    runner_up_ncc: f64,
}

/// Whether brightness tells one place from another: what is left unexplained does where both look much the same.
fn is_told(photometric_ncc: f64, runner_up_ncc: f64) -> bool {
    let unexplained = (1.0 - photometric_ncc).max(LEAST_UNEXPLAINED);
    photometric_ncc - runner_up_ncc > TELLING_CORRELATION || 1.0 - runner_up_ncc > TELLING_RATIO * unexplained
}

/// The pose so many places along an open direction.
fn along(found: &PoseHypothesis, degenerate: &DegenerateDirection, place: i32) -> Pose3 {
    let moved = degenerate.direction * (f64::from(place) * BETWEEN_PLACES);
    Pose3::translation(moved.x, moved.y, moved.z) * found.registration.T_target_source
}
