//! Two clouds prepared for registration, with the metric chosen at run time.
//!
//! A [`Problem`] holds all inputs of the loop. The trait [`IcpProblem`] hides the types of its metric and target, so that the
//! analysis of a registration (iterations, cost, basin of attraction) is written once.

use super::correspondences::{CorrespondenceSearch, Rejected, RejectionReason, face_apart};
use super::cost::{RowSums, cost};
use super::factors::{Correspondence, Factor, NormalEquations};
use super::icp::{IcpOptions, Registration, Source, register_with};
use super::solver::Solver;
use super::target::{LastSearch, Target};
use crate::geometry::RigidMotion;
use crate::search::nearest_table::Span;

/// A source, its target, and the options of the registration.
#[derive(Debug, Clone)]
pub struct Problem<M: RigidMotion, T, F> {
    /// Points of the source (m).
    pub points: Vec<M::Point>,
    /// Their unit normals, where known; `None` where no point has a normal.
    pub normals: Option<Vec<Option<M::Point>>>,
    /// The target.
    pub target: T,
    /// Number of the target's points.
    pub num_target: usize,
    /// The residual of a correspondence.
    pub factor: F,
    /// Rejection and weighting of pairs, and the criteria of convergence.
    pub options: IcpOptions,
    /// How the next step is computed.
    pub solver: Solver<M>,
}

/// One iteration of the loop from a given pose, before and after its step.
#[derive(Debug, Clone)]
pub struct Iteration<M: RigidMotion> {
    /// The pose at which the pairs were found.
    pub T_target_source: M,
    /// Number of source points that were used.
    pub num_points: usize,
    /// The pairs that were not rejected.
    pub correspondences: Vec<Correspondence<M::Point>>,
    /// Source points that were left out, in the order of their rejection.
    pub rejected: Vec<Rejected>,
    /// Pairs within the distance limit.
    pub num_correspondences: usize,
    /// The normal equations of the pairs, restricted to the free directions of the solver.
    pub equations: NormalEquations<M>,
    /// The motion that the loop applies after the pose; `None` where the pairs do not determine it.
    pub step: Option<M>,
    /// The cost of the pose (m^2).
    pub cost: f64,
}

/// Finds the nearest target points to a point shifted by many translations (m).
pub type FindAlong<'a, P> = dyn FnMut(&P, &[P], &mut Vec<Span>) + 'a;

/// A problem for [`register_with`], of any metric and target, with motions `M`.
pub trait IcpProblem<M: RigidMotion> {
    /// The whole loop from an initial guess.
    fn register(&self, init_T_target_source: M) -> Registration<M>;
    /// The same with every `stride`-th source point only.
    fn every(&self, stride: usize) -> Box<dyn IcpProblem<M>>;
    /// The iteration that the loop would do at this pose, with every `stride`-th source point only.
    fn iteration(&self, T_target_source: &M, stride: usize) -> Iteration<M>;
    /// The cost of each of these poses, with pairs searched at each.
    fn costs(&self, poses: &mut dyn Iterator<Item = M>) -> Vec<f64>;
    /// The same for poses with one rotation, `rotation` (without translation), and these translations (m). `find` is called with
    /// each rotated source point and returns its partners for all translations.
    fn costs_along(&self, rotation: &M, translations: &[M::Point], find: &mut FindAlong<M::Point>) -> Vec<f64>;
    /// Points of the source (m).
    fn source_points(&self) -> &[M::Point];
    /// Points of the target (m) with their unit normals, where they have one.
    fn target_points(&self) -> Vec<(M::Point, Option<M::Point>)>;
    /// The gradients of the residuals of pairs for a perturbation on the left of the estimate.
    fn normal_equations(&self, correspondences: &[Correspondence<M::Point>]) -> NormalEquations<M>;
    /// The options of the loop.
    fn options(&self) -> &IcpOptions;
}

impl Rejected {
    /// Whether the point contributes to the cost as if it were at the distance limit: it has no partner, or one whose normal
    /// differs too much. Points without a residual and trimmed ones do not contribute.
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
        let min_normal_cosine = self.options.rejection.max_normal_angle.cos();
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
                    Some(partner) if face_apart(normal.as_ref(), self.target.normal(partner), min_normal_cosine) => {
                        sums.charge(places, &losses);
                    }
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
