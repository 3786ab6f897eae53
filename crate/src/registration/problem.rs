//! Two clouds made ready for registration, whatever they are registered by: the metric is chosen when it runs.
//!
//! A [`Problem`] holds all that the loop is given. Behind [`IcpProblem`] its metric and its target are out of sight, and
//! what looks into a registration (its iterations, its cost, its basin) is written once.

use super::correspondences::{CorrespondenceSearch, Rejected, RejectionReason};
use super::cost::{RowSums, cost};
use super::factors::{Correspondence, Factor, NormalEquations};
use super::icp::{IcpOptions, Registration, Source, register_with};
use super::solver::Solver;
use super::target::{LastSearch, Target};
use crate::geometry::{RigidMotion, Vector};
use crate::search::nearest_table::Span;

/// A source with what it is registered to, and how.
#[derive(Debug, Clone)]
pub struct Problem<M: RigidMotion, T, F> {
    /// Points of the source (m).
    pub points: Vec<M::Point>,
    /// Their unit normals, where they are known; `None` where there are none at all.
    pub normals: Option<Vec<Option<M::Point>>>,
    /// What they are registered to.
    pub target: T,
    /// Number of the target's points.
    pub num_target: usize,
    /// What a correspondence measures.
    pub factor: F,
    /// When a pair is a correspondence, how much it counts, when the loop ends.
    pub options: IcpOptions,
    /// How the next step is found.
    pub solver: Solver<M>,
}

/// One iteration of the loop from a given pose, before and after its step.
#[derive(Debug, Clone)]
pub struct Iteration<M: RigidMotion> {
    /// The pose that the pairs were found under.
    pub T_target_source: M,
    /// Number of source points that were looked at.
    pub num_points: usize,
    /// The pairs that count.
    pub correspondences: Vec<Correspondence<M::Point>>,
    /// Source points without a say, in the order in which they were left out.
    pub rejected: Vec<Rejected>,
    /// Pairs within the distance limit.
    pub num_correspondences: usize,
    /// The normal equations of the pairs, with what is not free to move held fast.
    pub equations: NormalEquations<M>,
    /// What the loop applies after the pose; `None` where the pairs fix nothing.
    pub step: Option<M>,
    /// The cost of the pose (m^2).
    pub cost: f64,
}

/// Finds the nearest target points to a point moved by many translations (m).
pub type FindAlong<'a, P> = dyn FnMut(&P, &[P], &mut Vec<Span>) + 'a;

/// Whatever is registered by [`register_with`], with motions `M`.
pub trait IcpProblem<M: RigidMotion> {
    /// The whole loop from a first guess.
    fn register(&self, init_T_target_source: M) -> Registration<M>;
    /// The same with every `stride`-th source point alone.
    fn every(&self, stride: usize) -> Box<dyn IcpProblem<M>>;
    /// The one iteration that the loop would do next at this pose; of every `stride`-th source point alone where `stride` is above 1.
    fn iteration(&self, T_target_source: &M, stride: usize) -> Iteration<M>;
    /// The cost of each of these poses, the pairs being searched anew at each.
    fn costs(&self, poses: &mut dyn Iterator<Item = M>) -> Vec<f64>;
    /// The same for poses of one rotation, `rotation` (without translation), and these translations (m), where something else finds
    /// the partners: `find` is called with each source point, rotated, and tells them for all translations.
    fn costs_along(&self, rotation: &M, translations: &[M::Point], find: &mut FindAlong<M::Point>) -> Vec<f64>;
    /// Points of the source (m).
    fn source_points(&self) -> &[M::Point];
    /// Points of the target (m) with their unit normals, where they have one.
    fn target_points(&self) -> Vec<(M::Point, Option<M::Point>)>;
    /// The gradients of the residuals of pairs by a perturbation on the left of the estimate.
    fn normal_equations(&self, correspondences: &[Correspondence<M::Point>]) -> NormalEquations<M>;
    /// The options of the loop.
    fn options(&self) -> &IcpOptions;
}

impl Rejected {
    /// Whether the point counts in the cost: it has no partner, or one that faces another way. A point whose partner has no
    /// normal is not measured, and one that was trimmed is not to be looked at.
    fn is_charged(&self) -> bool {
        matches!(self.reason, RejectionReason::TooFar | RejectionReason::Normals)
    }
}

impl<M, T, F> Problem<M, T, F>
where
    M: RigidMotion,
    T: Target<Point = M::Point>,
    F: Factor<M, T>,
{
    fn source(&self) -> Source<'_, M::Point> {
        Source { points: &self.points, normals: self.normals.as_deref(), sigmas: None }
    }

    fn search<'a>(&'a self, source: Source<'a, M::Point>) -> CorrespondenceSearch<'a, M::Point, T, F> {
        let IcpOptions { rejection, weighting, .. } = self.options;
        CorrespondenceSearch { source, target: &self.target, factor: &self.factor, rejection, weighting }
    }

    /// Every `stride`-th point of the source.
    fn sampled_points(&self, stride: usize) -> Vec<M::Point> {
        self.points.iter().step_by(stride).copied().collect()
    }

    /// Their normals.
    fn sampled_normals(&self, stride: usize) -> Option<Vec<Option<M::Point>>> {
        self.normals.as_ref().map(|normals| normals.iter().step_by(stride).copied().collect())
    }

    /// Whether the normals of a pair differ by more than the limit.
    fn face_apart(&self, normal: Option<&M::Point>, partner: u32) -> bool {
        let (Some(normal), Some(target_normal)) = (normal, self.target.normal(partner)) else { return false };
        normal.dot(&target_normal) < self.options.rejection.max_normal_angle.cos()
    }
}

impl<M, T, F> IcpProblem<M> for Problem<M, T, F>
where
    M: RigidMotion + 'static,
    T: Target<Point = M::Point> + Clone + 'static,
    F: Factor<M, T> + Clone + 'static,
{
    fn register(&self, init_T_target_source: M) -> Registration<M> {
        register_with(self.source(), &self.target, init_T_target_source, &self.factor, &self.options, &self.solver)
    }

    fn every(&self, stride: usize) -> Box<dyn IcpProblem<M>> {
        Box::new(Self {
            points: self.sampled_points(stride),
            normals: self.sampled_normals(stride),
            target: self.target.clone(),
            factor: self.factor.clone(),
            ..*self
        })
    }

    fn iteration(&self, T_target_source: &M, stride: usize) -> Iteration<M> {
        let (points, normals) = (self.sampled_points(stride), self.sampled_normals(stride));
        let (mut correspondences, mut rejected) = (Vec::with_capacity(points.len()), Vec::new());
        let last_searches = &mut vec![LastSearch::None; points.len()];
        let search = self.search(Source { points: &points, normals: normals.as_deref(), sigmas: None });
        let reject = |left_out: Rejected| rejected.push(left_out);
        let num_correspondences = search.find(T_target_source, last_searches, &mut correspondences, reject);
        let charged: Vec<u32> = rejected.iter().filter(|left_out| left_out.is_charged()).map(|r| r.source).collect();
        let cost = cost(&correspondences, &charged, points.len(), &self.options);
        for pair in &mut correspondences {
            pair.source *= stride as u32;
        }
        for left_out in &mut rejected {
            left_out.source *= stride as u32;
        }
        let mut damping = self.solver.damping.unwrap_or_default();
        Iteration {
            T_target_source: *T_target_source,
            num_points: points.len(),
            num_correspondences,
            equations: self.solver.restricted(self.factor.normal_equations(&self.target, &correspondences)),
            step: self.solver.step(&self.factor, &self.target, &correspondences, &mut damping),
            cost,
            correspondences,
            rejected,
        }
    }

    fn costs(&self, poses: &mut dyn Iterator<Item = M>) -> Vec<f64> {
        let (mut correspondences, mut charged) = (Vec::with_capacity(self.points.len()), Vec::new());
        let last_searches = &mut vec![LastSearch::None; self.points.len()];
        let search = self.search(self.source());
        let cost = |T_target_source: M| {
            charged.clear();
            let charge = |left_out: Rejected| charged.extend(left_out.is_charged().then_some(left_out.source));
            search.find(&T_target_source, last_searches, &mut correspondences, charge);
            cost(&correspondences, &charged, self.points.len(), &self.options)
        };
        poses.map(cost).collect()
    }

    fn costs_along(&self, rotation: &M, translations: &[M::Point], find: &mut FindAlong<M::Point>) -> Vec<f64> {
        let losses = self.options.losses();
        let mut sums = RowSums::new(translations.len(), &losses);
        let mut spans = Vec::new();
        for (index, point) in self.points.iter().enumerate() {
            let rotated = rotation.act(point);
            find(&rotated, translations, &mut spans);
            let normal =
                self.normals.as_ref().and_then(|normals| normals[index]).map(|normal| rotation.rotate(&normal));
            let mut first = 0;
            for Span { end, nearest } in spans.drain(..) {
                let places = first..end;
                first = end;
                match nearest {
                    None => sums.charge(places, &losses),
                    Some(partner) if self.face_apart(normal.as_ref(), partner) => sums.charge(places, &losses),
                    Some(partner) => sums.add(places, &losses, |place| {
                        let moved = rotated + translations[place];
                        self.factor.residual(&self.target, partner, &moved, normal.as_ref())
                    }),
                }
            }
            if (index + 1) % losses.batch() == 0 {
                sums.flush(&losses);
            }
        }
        sums.flush(&losses);
        sums.means()
    }

    fn source_points(&self) -> &[M::Point] {
        &self.points
    }

    fn target_points(&self) -> Vec<(M::Point, Option<M::Point>)> {
        (0..self.num_target as u32).map(|index| (self.target.point(index), self.target.normal(index))).collect()
    }

    fn normal_equations(&self, correspondences: &[Correspondence<M::Point>]) -> NormalEquations<M> {
        self.factor.normal_equations(&self.target, correspondences)
    }

    fn options(&self) -> &IcpOptions {
        &self.options
    }
}
