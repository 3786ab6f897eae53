//! Loops that a person takes out or puts in, after the search: put in by the same match and the same tests as a loop that was searched for.

use std::rc::Rc;

use nalgebra::Matrix3;

use super::acceptance::MAX_WINDOW_ALONE;
use super::consistency::{Candidate, Cycle, Relation, consistent_set, cycle, relation};
use super::matching::{MATCH_SIGMA, Pair, SourceStretch, SubmapMatch, match_stretches};
use super::submap::Keyframe;
use super::{Loop, LoopClosure, Origin, TrialOutcome};
use crate::geometry::connected_parts::connected_parts;
use crate::geometry::{Pose2, RigidMotion, mahalanobis};
use crate::graph::pose_graph::total_loss;
use crate::odometry::planar::information::sigmas;
use crate::registration::icp::IcpOptions;

/// The poses and loops of a graph at one time.
#[derive(Clone)]
pub struct GraphState {
    poses: Vec<Pose2>,
    loops: Vec<Loop>,
}

/// A loop and how far the rest of the graph contradicts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopEvidence {
    /// What was measured between its ends.
    pub T_target_source: Pose2,
    /// Standard deviation of its heading (rad).
    pub heading_sigma: f64,
    /// Standard deviation of its position (m).
    pub position_sigma: f64,
    /// Squared Mahalanobis distance (three degrees of freedom) of what was measured from what the rest of the graph tells; 0 where
    /// that tells nothing.
    pub chi_squared: f64,
    /// Share of the returns seen by both stretches that agree, 0..=1.
    pub agreement: f64,
    /// Whether it was put in by hand without a match.
    pub is_unchecked: bool,
}

/// Why a loop is not put in.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// There is one between these places.
    Exists,
    /// Both scans belong to one submap.
    SamePlace,
    /// The scans do not match there, with the figure that says so.
    NoMatch(String),
    /// The graph contradicts it, by this squared Mahalanobis distance.
    ContradictsGraph(f64),
    /// It contradicts the loop between these keyframes, by this squared Mahalanobis distance.
    ContradictsLoop([usize; 2], f64),
    /// It does not fit the graph that is solved with it.
    DoesNotFit,
    /// The loop between these keyframes would no longer fit.
    Displaces([usize; 2]),
}

impl LoopClosure {
    /// The graph as it is.
    pub fn state(&self) -> GraphState {
        GraphState { poses: self.poses.clone(), loops: self.loops.clone() }
    }

    /// Puts back what was kept.
    pub fn restore(&mut self, state: &GraphState) {
        self.poses.clone_from(&state.poses);
        self.loops.clone_from(&state.loops);
    }

    /// The keyframes of the loops of such a graph.
    pub fn ends(&self, state: &GraphState) -> Vec<[usize; 2]> {
        state.loops.iter().map(|closed| self.anchors(closed)).collect()
    }

    /// Makes the scans ready to be matched again.
    pub fn recall_scans(&mut self) {
        if self.keyframes.len() < self.links.len() {
            self.keyframes = self.links.iter().map(|link| Keyframe::new(Rc::clone(&link.scan))).collect();
        }
    }

    /// Sum of the squared Mahalanobis distances of all factors, less for those that are switched off, and number of these factors.
    pub fn chi_squared(&self) -> (f64, usize) {
        let factors = self.factors();
        (total_loss(&self.poses, &factors), factors.len())
    }

    /// Whether a loop was put in without a match.
    pub fn has_unchecked_loop(&self) -> bool {
        self.loops.iter().any(|closed| closed.origin == Origin::Unchecked)
    }

    /// For each keyframe, whether one loop that was put in by hand tells alone where its part lies: the smaller of the two that the loop
    /// connects. Where places repeat, a match near a wrong guess fits as well as one near the right one; that two agree is no chance.
    pub fn hang_by_one_hand(&self) -> Vec<bool> {
        let mut hang = vec![false; self.submaps.len()];
        for (index, closed) in self.loops.iter().enumerate().filter(|(_, closed)| closed.origin == Origin::Hand) {
            let parts = connected_parts(self.submaps.len(), self.connections(Some(index)));
            let [a, b] = [closed.candidate.target, closed.candidate.source].map(|submap| parts[submap]);
            let size = |part: usize| parts.iter().filter(|of| **of == part).count();
            let smaller = if size(a) < size(b) { a } else { b };
            hang.iter_mut().zip(&parts).for_each(|(hangs, part)| *hangs |= a != b && *part == smaller);
        }
        self.of_keyframes(&hang)
    }

    /// The submaps of two keyframes, the earlier one first.
    pub fn places(&self, keyframes: [usize; 2]) -> [usize; 2] {
        let of = |keyframe: usize| self.submaps.partition_point(|submap| submap.keyframes.end <= keyframe);
        let [a, b] = keyframes.map(of);
        [a.min(b), a.max(b)]
    }

    /// Takes the loops between two places out and solves the graph anew, from where the poses are. Whether there was one.
    pub fn remove_loop(&mut self, keyframes: [usize; 2]) -> bool {
        let places = self.places(keyframes);
        let before = self.loops.len();
        self.loops.retain(|closed| [closed.candidate.target, closed.candidate.source] != places);
        let is_removed = self.loops.len() < before;
        if is_removed {
            self.solve(self.loops.len());
        }
        is_removed
    }

    /// Puts a loop in between the places of two keyframes, where the second lies about at this pose in the frame of the first, if the
    /// scans match there and nothing contradicts the match. What nothing certain connects with the first is moved there.
    ///
    /// # Errors
    /// Why it is not put in; the graph is then as before.
    pub fn add_loop(&mut self, keyframes: [usize; 2], T: &Pose2, options: &IcpOptions) -> Result<(), Refusal> {
        let before = self.state();
        let added = self.pair_at(keyframes, T).and_then(|pair| {
            let found = self.match_at(&pair, options)?;
            let candidate = Candidate { target: pair.target, source: pair.source, found };
            if !self.move_unconnected(&candidate) {
                self.check_against_graph(&candidate)?;
            }
            self.check_against_loops(&candidate)?;
            self.enter_alone(candidate)
        });
        if added.is_err() {
            self.restore(&before);
        }
        added
    }

    /// Puts a loop in as it is given, without a match or a test; nothing outweighs it.
    ///
    /// # Errors
    /// Why it is not put in.
    pub fn add_unchecked_loop(&mut self, keyframes: [usize; 2], T: &Pose2) -> Result<(), Refusal> {
        let pair = self.pair_at(keyframes, T)?;
        let (heading, position) = MATCH_SIGMA;
        let covariance = Matrix3::from_diagonal(&[heading, position, position].map(|sigma| sigma * sigma).into());
        let found = SubmapMatch { T_target_source: pair.guess, covariance, agreement: 0.0, fitness: 0.0, rival: 0.0 };
        self.enter(Candidate { target: pair.target, source: pair.source, found });
        let last = self.loops.len() - 1;
        self.loops[last].origin = Origin::Unchecked;
        self.loops[last].factor.is_switchable = false;
        self.solve(last);
        Ok(())
    }

    /// Squared Mahalanobis distance of a loop of another state from what the graph tells now; 0 where it tells nothing.
    pub fn contradiction_of(&self, state: &GraphState, index: usize) -> f64 {
        self.distance_from_graph(&state.loops[index].candidate).unwrap_or(0.0)
    }

    /// How far the rest of the graph contradicts each loop, in the order of [`ends`](Self::ends).
    pub fn loop_evidence(&self) -> Vec<LoopEvidence> {
        let covariances = self.relative_covariances(false);
        let evidence = |closed: &Loop| {
            let Candidate { target, source, found } = &closed.candidate;
            let (heading_sigma, position_sigma) = sigmas(&found.T_target_source, &found.covariance);
            let between = covariances.as_ref().map(|all| all.between(*target, *source));
            LoopEvidence {
                T_target_source: found.T_target_source,
                heading_sigma,
                position_sigma,
                chi_squared: between.map_or(0.0, |between| self.contradiction(closed, &between)),
                agreement: found.agreement,
                is_unchecked: closed.origin == Origin::Unchecked,
            }
        };
        self.loops.iter().map(evidence).collect()
    }

    /// Squared Mahalanobis distance of a loop from what the graph would tell without it, by the solved graph's covariance between its
    /// ends. That graph is the other one with the loop added, so the loop is taken from its information, and from its poses by the inverse
    /// of the step that the loop moved them.
    fn contradiction(&self, closed: &Loop, between: &Matrix3<f64>) -> f64 {
        let factor = &closed.factor;
        let residual = factor.residual(&self.poses[factor.from], &self.poses[factor.to]);
        let own = factor.information * factor.weight(residual.dot(&(factor.information * residual)));
        let rest = between.try_inverse().map(|all| all - own);
        let Some(without) = rest.and_then(Matrix3::try_inverse) else { return 0.0 };
        let off = residual + without * own * residual;
        let covariance = without + closed.candidate.found.covariance;
        covariance.cholesky().map_or(0.0, |cholesky| off.dot(&cholesky.solve(&off)))
    }

    /// The pair of places of two keyframes, with where the second lies.
    fn pair_at(&self, [first, second]: [usize; 2], T_first_second: &Pose2) -> Result<Pair, Refusal> {
        let [target, source] = self.places([first, second]);
        if target == source {
            return Err(Refusal::SamePlace);
        }
        let is_same = |closed: &Loop| closed.candidate.target == target && closed.candidate.source == source;
        if self.loops.iter().any(is_same) {
            return Err(Refusal::Exists);
        }
        let from =
            |submap: usize, keyframe: usize| self.poses[self.submaps[submap].anchor].inverse() * self.poses[keyframe];
        let (a, b, T) =
            if first < second { (first, second, *T_first_second) } else { (second, first, T_first_second.inverse()) };
        let guess = from(target, a) * T * from(source, b).inverse();
        Ok(Pair { target, source, guess, window: MAX_WINDOW_ALONE })
    }

    /// The match of a pair, if there is one.
    fn match_at(&self, pair: &Pair, options: &IcpOptions) -> Result<SubmapMatch, Refusal> {
        let source = &self.submaps[pair.source];
        let source = SourceStretch::new(source.keyframes.clone(), source.anchor, &self.keyframes, &self.poses);
        let target = self.target(pair.target);
        let found = match_stretches(&target, &source, &self.keyframes, &pair.guess, pair.window, options);
        let outcome = TrialOutcome::of(found.as_ref());
        match found {
            Some(found) if outcome == TrialOutcome::Matched => Ok(found),
            found => Err(Refusal::NoMatch(outcome.figure(found.as_ref()))),
        }
    }

    /// Moves the source to where it was found, with all that certain links and loops connect with it, unless they connect it with
    /// the target. Whether they do not.
    fn move_unconnected(&mut self, found: &Candidate) -> bool {
        let parts = connected_parts(self.submaps.len(), self.connections(None));
        let (into, piece) = (parts[found.target], parts[found.source]);
        if into == piece {
            return false;
        }
        let poses = self.anchor_poses();
        let motion = poses[found.target] * found.found.T_target_source * poses[found.source].inverse();
        self.move_piece(&self.of_keyframes(&parts), piece, into, &motion);
        true
    }

    fn check_against_graph(&self, candidate: &Candidate) -> Result<(), Refusal> {
        match self.distance_from_graph(candidate) {
            Some(sq_distance) if sq_distance > mahalanobis::ONE_IN_HUNDRED_THOUSAND => {
                Err(Refusal::ContradictsGraph(sq_distance))
            }
            _ => Ok(()),
        }
    }

    /// Squared Mahalanobis distance of what was found from what the graph tells; `None` where that tells nothing.
    fn distance_from_graph(&self, candidate: &Candidate) -> Option<f64> {
        let (target, source) = (candidate.target, candidate.source);
        let off = (candidate.found.T_target_source * self.motion(target, source).inverse()).log();
        let covariance = candidate.found.covariance + self.relative_covariances(false)?.between(target, source);
        Some(mahalanobis::squared(&off, &covariance))
    }

    /// By the test that the matches of a search pass.
    fn check_against_loops(&self, candidate: &Candidate) -> Result<(), Refusal> {
        let Some(covariances) = self.relative_covariances(false) else { return Ok(()) };
        let poses = self.anchor_poses();
        let to_loop = |closed: &Loop| cycle(candidate, &closed.candidate, &poses, &covariances);
        let cycles: Vec<Option<Cycle>> = self.loops.iter().map(to_loop).collect();
        let relations: Vec<Relation> = cycles.iter().map(|cycle| relation(cycle.as_ref())).collect();
        if consistent_set(&[relations], self.loops.len())[0].is_some() {
            return Ok(());
        }
        let distance = |index: &usize| cycles[*index].map_or(0.0, |cycle| cycle.sq_distance);
        let worst = (0..cycles.len()).max_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
        Err(Refusal::ContradictsLoop(self.anchors(&self.loops[worst]), distance(&worst)))
    }

    /// Puts a match into the graph and solves it, where it and all loops before it fit then.
    fn enter_alone(&mut self, candidate: Candidate) -> Result<(), Refusal> {
        let places = (candidate.target, candidate.source);
        let before: Vec<Loop> = self.loops.clone();
        self.enter(candidate);
        self.loops[before.len()].origin = Origin::Hand;
        self.solve(before.len());
        let stays = |of: (usize, usize)| {
            self.loops.iter().any(|closed| (closed.candidate.target, closed.candidate.source) == of)
        };
        if !stays(places) {
            return Err(Refusal::DoesNotFit);
        }
        let displaced = before.iter().find(|closed| !stays((closed.candidate.target, closed.candidate.source)));
        displaced.map_or(Ok(()), |closed| Err(Refusal::Displaces(self.anchors(closed))))
    }

    /// The keyframes of a loop.
    fn anchors(&self, closed: &Loop) -> [usize; 2] {
        [closed.candidate.target, closed.candidate.source].map(|submap| self.submaps[submap].anchor)
    }
}
