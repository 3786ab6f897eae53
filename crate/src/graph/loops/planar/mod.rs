//! Loops of a long drive: places that come into view again, found, verified and taken into the graph.
//!
//! Scans in a row are joined to submaps (Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016). Each is looked
//! for wherever the graph's covariance allows that it came back, the surest pairs first. A match has to be seen by both
//! sides in the same way, to be the only one of its window, and to agree with the other matches; where the window was wide,
//! others have to support it. Then the graph is solved, what no longer fits is taken back, and with the covariances that
//! have shrunk the search begins again, until nothing more is found.

use std::rc::Rc;

use crate::geometry::{Pose2, RigidMotion};
use crate::graph::joint_scan_registration::MAX_NEIGHBOR_DISTANCE;
use crate::graph::pose_graph::{PlanarFactor, optimize_poses};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::SearchWindow;
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::icp::IcpOptions;

mod acceptance;
mod anchors;
mod certainty;
mod consistency;
mod edits;
mod joining;
mod matching;
mod pairs;
mod submap;
mod trial;
mod uncertainty;

pub use certainty::Uncertainty;
use consistency::Candidate;
pub use edits::{GraphState, LoopEvidence, Refusal};
use matching::{Pair, SourceStretch, TargetStretch, free_space_between, match_stretches};
pub use submap::MAX_COMPARED_RANGE;
use submap::{Keyframe, Submap};
pub use trial::{LoopTrial, LoopTrials, TrialOutcome};
use uncertainty::RelativeCovariances;

/// A scan of the chain, as it comes in.
pub struct ChainLink {
    /// Its returns.
    pub scan: Rc<PlanarScan>,
    /// Where the chain put it.
    pub T_world_sensor: Pose2,
    /// Whether no uncontradicted registration connects it to the scan before.
    pub is_weak: bool,
    /// Whether nothing certain connects it to that one: neither such a registration nor measured motion.
    pub is_broken: bool,
    /// Whether another recording begins with it: the way from that one is not known at all.
    pub begins_recording: bool,
}

/// Number of scans after which a submap ends, however near to each other they are (see `pairs::MAX_CANDIDATES`). Without it, ACES is in
/// 4 pieces (3), and the largest has 6690 scans (7312).
const SUBMAP_SCANS: usize = 40;
/// What searches may cost for each keyframe, in windows of a metre and a tenth of a radian: at most about two milliseconds. With
/// half of it the search ended before the loops of the infinite corridor played backwards were closed.
const SEARCH_BUDGET: f64 = 120.0;

/// A loop of the graph.
#[derive(Clone)]
struct Loop {
    candidate: Candidate,
    factor: PlanarFactor,
    origin: Origin,
}

/// How a loop came into the graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// The search found it.
    Search,
    /// It was put in by hand, and the scans match there.
    Hand,
    /// It was put in by hand without a match.
    Unchecked,
}

/// The search for loops.
pub struct LoopClosure {
    keyframes: Vec<Keyframe>,
    links: Vec<ChainLink>,
    /// Between keyframes that follow each other.
    chain: Vec<PlanarFactor>,
    /// Pose of each keyframe, as the graph has it now.
    poses: Vec<Pose2>,
    submaps: Vec<Submap>,
    covariances: Option<RelativeCovariances>,
    loops: Vec<Loop>,
    /// Matches that are no loops yet, with the window each was found in.
    pool: Vec<(Candidate, SearchWindow)>,
    /// For each source the windows that were searched for it, in vain or with success: (target, half width (m)).
    searched: Vec<Vec<(usize, f64)>>,
    queue: Vec<Pair>,
    trials: LoopTrials,
    /// What searches have cost, in the unit of [`matching::search_cost`].
    spent: f64,
    num_queued: usize,
    round: usize,
    is_done: bool,
}

impl LoopClosure {
    /// Joins the links of a chain to submaps. `chain` has the factors between keyframes that follow each other.
    pub fn new(links: Vec<ChainLink>, chain: Vec<PlanarFactor>) -> Self {
        let keyframes: Vec<Keyframe> = links.iter().map(|link| Keyframe::new(Rc::clone(&link.scan))).collect();
        let mut poses: Vec<Pose2> = links.iter().map(|link| link.T_world_sensor).collect();
        optimize_poses(&mut poses, &chain);
        let submaps = joined(&links, &keyframes, &poses);
        Self {
            keyframes,
            links,
            chain,
            poses,
            searched: vec![Vec::new(); submaps.len()],
            submaps,
            covariances: None,
            loops: Vec::new(),
            pool: Vec::new(),
            queue: Vec::new(),
            trials: LoopTrials::default(),
            spent: 0.0,
            num_queued: 0,
            round: 0,
            is_done: false,
        }
    }

    /// Pairs of this round that are done, and all.
    pub fn progress(&self) -> (usize, usize) {
        (self.num_queued - self.queue.len(), self.num_queued.max(1))
    }

    /// Whether nothing more is found.
    pub fn is_done(&self) -> bool {
        self.is_done
    }

    /// Returns of a scan of the chain.
    pub fn num_points(&self, link: usize) -> usize {
        self.keyframes[link].scan.points.len()
    }

    /// How two scans of the chain look from each other, the second at this pose in the frame of the first.
    pub fn free_space(&self, first: usize, second: usize, T_first_second: &Pose2) -> FreeSpaceTally {
        free_space_between(&self.keyframes[first], &self.keyframes[second], T_first_second)
    }

    /// The pose of every keyframe.
    pub fn solved_poses(&self) -> Vec<Pose2> {
        self.poses.clone()
    }

    /// The chain's factors, and the loops between anchors.
    pub fn factors(&self) -> Vec<PlanarFactor> {
        self.chain.iter().chain(self.loops.iter().map(|closed| &closed.factor)).copied().collect()
    }

    /// Frees the scans: nothing is matched or compared any more.
    pub fn forget_scans(&mut self) {
        self.keyframes = Vec::new();
    }

    /// One piece of work: matches the pairs of one target, or begins the next round.
    pub fn advance(&mut self, options: &IcpOptions) {
        if let Some(pair) = self.queue.last().copied() {
            let target = self.target(pair.target);
            while let Some(pair) = self.queue.pop_if(|next| next.target == pair.target) {
                self.match_pair(&target, &pair, options);
            }
            return;
        }
        let has_news = self.round == 0 || self.accept();
        if !has_news {
            self.is_done = true;
            return;
        }
        self.begin_round();
    }

    /// Looks which submaps may show the same place by the covariances that the graph has now.
    fn begin_round(&mut self) {
        self.round += 1;
        self.covariances = self.relative_covariances(false);
        self.queue = self.pairs();
        self.num_queued = self.queue.len();
        self.is_done = self.queue.is_empty();
    }

    fn relative_covariances(&self, only_certain: bool) -> Option<RelativeCovariances> {
        RelativeCovariances::new(&self.anchor_poses(), &self.anchor_factors(only_certain))
    }

    /// A submap with those next to it.
    fn target(&self, target: usize) -> TargetStretch {
        let mut range = self.submaps[target].keyframes.clone();
        if target > 0 && !self.links[range.start].is_weak {
            range.start = self.submaps[target - 1].keyframes.start;
        }
        if target + 1 < self.submaps.len() && !self.links[range.end].is_weak {
            range.end = self.submaps[target + 1].keyframes.end;
        }
        TargetStretch::new(range, self.submaps[target].anchor, &self.keyframes, &self.poses)
    }

    fn match_pair(&mut self, target: &TargetStretch, pair: &Pair, options: &IcpOptions) {
        let submap = &self.submaps[pair.source];
        let source = SourceStretch::new(submap.keyframes.clone(), submap.anchor, &self.keyframes, &self.poses);
        let found = match_stretches(target, &source, &self.keyframes, &pair.guess, pair.window, options);
        let outcome = TrialOutcome::of(found.as_ref());
        self.note_trial(pair, found.as_ref(), outcome);
        if let Some(found) = found.filter(|_| outcome == TrialOutcome::Matched) {
            self.pool.push((Candidate { target: pair.target, source: pair.source, found }, pair.window));
        }
    }
}

/// Links in a row joined to submaps of neighbours: none reaches across a weak link.
fn joined(links: &[ChainLink], keyframes: &[Keyframe], poses: &[Pose2]) -> Vec<Submap> {
    let mut submaps = Vec::new();
    let (mut start, mut driven) = (0, 0.0);
    for index in 1..=links.len() {
        let is_end = index == links.len();
        driven += if is_end { 0.0 } else { (poses[index - 1].inverse() * poses[index]).translation_norm() };
        if is_end || driven > MAX_NEIGHBOR_DISTANCE || index - start >= SUBMAP_SCANS || links[index].is_weak {
            submaps.push(Submap::new(start..index, keyframes, poses));
            (start, driven) = (index, 0.0);
        }
    }
    submaps
}
