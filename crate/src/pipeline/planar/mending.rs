//! A map mended by hand: loops taken out and put in after the run, on the graph that it kept.
//!
//! The graph is solved, its pieces told apart and the scans registered jointly by what the run itself does this with. A list of steps
//! always begins at the graph of the run: the same list gives the same bytes, and without its last step it is undone.

use std::collections::{HashMap, HashSet};

use super::Reconstruction;
use super::edits::{Applied, Consequence, Edit, GraphLoop, GraphLoops, RefusedEdit};
use super::keyframe_graph::KeyframeGraph;
use super::run::Run;
use crate::error::{Error, Result};
use crate::geometry::Pose2;
use crate::geometry::mahalanobis::ONE_IN_HUNDRED_THOUSAND;
use crate::graph::loops::planar::{GraphState, LoopEvidence, Refusal};
use crate::io::pose_graph::AnyPoseGraph;
use crate::odometry::assessment::{Assessment, Status};
use crate::odometry::planar::FrameEstimate;
use crate::odometry::planar::belief::Finding;
use crate::pipeline::report::Stage;
use crate::pipeline::settings::Settings;
use crate::registration::icp::IcpOptions;

impl Reconstruction {
    /// The loops of the graph.
    ///
    /// # Errors
    /// Where there is no graph.
    pub fn graph_loops(&mut self) -> Result<GraphLoops> {
        let run = done(self.run.as_mut())?;
        let edits = run.before_mending.loops.clone();
        Ok(Mending::of(run, &self.settings)?.loops(&edits))
    }

    /// The graph as a g2o file: nodes are scans, counted from 0, edges have the information that the graph gives them. `None` where there is no
    /// graph yet.
    pub fn graph_g2o(&self) -> Option<String> {
        let run = self.run.as_ref()?;
        let mut graph = run.graph.as_ref()?.pose_graph();
        graph.poses.iter_mut().for_each(|pose| *pose = run.map_edits.in_map(*pose));
        Some(AnyPoseGraph::Plane(graph).to_g2o())
    }

    /// What the last of these steps, one about a loop, would change after those before it. The map stays as it is.
    ///
    /// # Errors
    /// Where there is no graph or no such step, or a step is not valid.
    pub fn preview_edit(&mut self, edits: &[Edit]) -> Result<Consequence> {
        let run = done(self.run.as_mut())?;
        run.check(edits)?;
        if edits.last().is_none_or(|edit| edit.scans().is_none()) {
            return Err(Error::whole("There is no step about a loop", "Give one as the last"));
        }
        Mending::of(run, &self.settings)?.preview(&about_loops(edits).1)
    }

    /// Takes these steps, and none that were taken before. Call [`step`](Self::step) then until it says [`Stage::Done`]. Returns the
    /// steps about loops that were not taken; [`unused_edits`](Self::unused_edits) tells the others.
    ///
    /// # Errors
    /// Where a step is not valid, or is about loops and there is no graph; all stays as it is.
    pub fn set_edits(&mut self, edits: &[Edit]) -> Result<Vec<RefusedEdit>> {
        let run = done(self.run.as_mut())?;
        run.check(edits)?;
        let (numbers, loops) = about_loops(edits);
        if loops != run.before_mending.loops {
            run.before_mending.applied = Mending::of(run, &self.settings)?.apply(&loops);
            run.before_mending.loops = loops;
            run.end_loops_again();
        }
        run.map_edits.set(edits);
        run.lay_map();
        let refused = run.before_mending.applied.refused.iter();
        Ok(refused.map(|refused| RefusedEdit { index: numbers[refused.index], ..refused.clone() }).collect())
    }
}

/// The run, where it is done.
pub(super) fn done(run: Option<&mut Run>) -> Result<&mut Run> {
    let run = run.filter(|run| run.stage == Stage::Done);
    run.ok_or_else(|| Error::whole("The run is not done", "Call step() until it is"))
}

/// The steps about loops among others, and where they are.
fn about_loops(edits: &[Edit]) -> (Vec<usize>, Vec<Edit>) {
    let numbered = edits.iter().enumerate().filter(|(_, edit)| edit.scans().is_some());
    numbered.map(|(number, edit)| (number, edit.clone())).unzip()
}

impl Run {
    /// Tells pieces and verdicts anew, by the graph that steps have made. What comes next is the joint registration.
    fn end_loops_again(&mut self) {
        for (estimate, count) in self.estimates.iter_mut().zip(&self.before_mending.num_findings) {
            estimate.findings.truncate(*count);
        }
        (self.joint, self.meter, self.sharpness) = (None, None, None);
        self.end_loops();
        if let Some(graph) = &self.graph {
            graph
                .hang_by_one_hand()
                .into_iter()
                .for_each(|frame| self.estimates[frame].findings.push(Finding::OneHand));
            if graph.closure.has_unchecked_loop() {
                self.estimates.iter_mut().for_each(|estimate| estimate.findings.push(Finding::UncheckedLoop));
            }
        }
    }
}

/// What steps of mending work on: the graph of a run that is done.
struct Mending<'a> {
    graph: &'a mut KeyframeGraph,
    /// The graph as the run left it.
    unedited: GraphState,
    estimates: &'a [FrameEstimate],
    /// How many findings each frame had before the pieces were told apart.
    num_findings: &'a [usize],
    poses: &'a [Pose2],
    T_laser_robot: &'a [Pose2],
    options: IcpOptions,
}

/// What the graph tells, by scan.
struct Told {
    poses: Vec<Pose2>,
    chi_squared: f64,
    pieces: Vec<usize>,
    is_good: Vec<bool>,
    loops: Vec<[usize; 2]>,
}

impl<'a> Mending<'a> {
    fn of(run: &'a mut Run, settings: &Settings) -> Result<Self> {
        let Some(graph) = &mut run.graph else {
            return Err(Error::whole("The map has no graph", "Use the joint strategy: strategy=joint"));
        };
        graph.closure.recall_scans();
        Ok(Self {
            unedited: run.before_mending.graph.get_or_insert_with(|| graph.closure.state()).clone(),
            graph,
            estimates: &run.estimates,
            num_findings: &run.before_mending.num_findings,
            poses: &run.poses,
            T_laser_robot: &run.T_laser_robot,
            options: settings.icp_options(),
        })
    }

    /// `edits`: those about loops that were taken.
    fn loops(&mut self, edits: &[Edit]) -> GraphLoops {
        let evidence = self.evidence(edits);
        let closure = &self.graph.closure;
        let (chi_squared, num_motions) = closure.chi_squared();
        let (present, of_run) = (self.scans_of(&closure.state()), self.scans_of(&self.unedited));
        let of_loop = |(evidence, scans): (LoopEvidence, &[usize; 2])| {
            let [target, source] = scans.map(|scan| self.T_laser_robot[scan]);
            GraphLoop {
                target: scans[0],
                source: scans[1],
                T_target_source: (target.inverse() * evidence.T_target_source * source).into(),
                heading_sigma: evidence.heading_sigma,
                position_sigma: evidence.position_sigma,
                chi_squared: evidence.chi_squared,
                agreement: evidence.agreement,
                is_added: !of_run.contains(scans),
                is_unchecked: evidence.is_unchecked,
            }
        };
        GraphLoops {
            chi_squared,
            num_motions,
            nodes: self.graph.nodes.clone(),
            loops: evidence.into_iter().zip(&present).map(of_loop).collect(),
            left_out: of_run.into_iter().filter(|scans| !present.contains(scans)).collect(),
        }
    }

    /// How far the rest of the graph contradicts each loop. One that was put in without a test may have torn the graph, which tells nothing
    /// of it then: that one is compared with the graph that the other steps make.
    fn evidence(&mut self, edits: &[Edit]) -> Vec<LoopEvidence> {
        let mut all = self.graph.closure.loop_evidence();
        let present = self.graph.closure.state();
        let scans = self.scans_of(&present);
        for (index, evidence) in all.iter_mut().enumerate().filter(|(_, evidence)| evidence.is_unchecked) {
            let is_other = |edit: &&Edit| edit.scans().map(|of| self.places(of)) != Some(self.places(scans[index]));
            let others: Vec<Edit> = edits.iter().filter(is_other).cloned().collect();
            self.apply(&others);
            evidence.chi_squared = self.graph.closure.contradiction_of(&present, index);
            self.graph.closure.restore(&present);
        }
        all
    }

    fn preview(&mut self, edits: &[Edit]) -> Result<Consequence> {
        let Some((edit, before)) = edits.split_last() else {
            return Err(Error::whole("There is no step", "Give one at least"));
        };
        let present = self.graph.closure.state();
        self.apply(before);
        let old = self.told();
        let applied = self.apply(edits);
        let new = self.told();
        self.graph.closure.restore(&present);
        let refusal = applied.refused.into_iter().find(|refused| refused.index == before.len());
        let moved = |&scan: &usize| (old.poses[scan].translation.vector - new.poses[scan].translation.vector).norm();
        let placed: Vec<usize> = (0..self.poses.len()).filter(|&scan| self.is_placed(scan)).collect();
        let furthest = placed.iter().copied().max_by(|a, b| moved(a).total_cmp(&moved(b))).unwrap_or(0);
        let (was_good, is_good) = (&old.is_good, &new.is_good);
        let changed = |was: bool| placed.iter().filter(move |&&scan| was_good[scan] == was && is_good[scan] != was);
        let num_pieces = |told: &Told| placed.iter().map(|&scan| told.pieces[scan]).collect::<HashSet<_>>().len();
        let is_lost = |scans: &[usize; 2]| {
            !new.loops.contains(scans) && Some(self.places(*scans)) != edit.scans().map(|of| self.places(of))
        };
        Ok(Consequence {
            refusal: refusal.map(|refused| refused.reason),
            chi_squared: [old.chi_squared, new.chi_squared],
            furthest,
            furthest_moves: moved(&furthest),
            mean_moves: placed.iter().map(moved).sum::<f64>() / placed.len().max(1) as f64,
            num_pieces: [num_pieces(&old), num_pieces(&new)],
            num_no_longer_good: changed(true).count(),
            num_becoming_good: changed(false).count(),
            left_out: old.loops.iter().copied().filter(is_lost).collect(),
        })
    }

    /// What the graph tells now.
    fn told(&self) -> Told {
        let (graph, mut poses) = (&self.graph, self.poses.to_vec());
        graph.place(&graph.closure.solved_poses(), &mut poses);
        let pieces = graph.pieces();
        let is_checked = !graph.closure.has_unchecked_loop();
        let by_chain =
            |(estimate, &count): (&FrameEstimate, &usize)| estimate.assessment_by(&estimate.findings[..count]);
        let is_good = |assessment: Assessment| is_checked && assessment.status == Status::Good;
        let mut is_good: Vec<bool> = self.estimates.iter().zip(self.num_findings).map(by_chain).map(is_good).collect();
        let doubted = graph.in_small_pieces(&pieces).into_iter().chain(graph.hang_by_one_hand());
        doubted.for_each(|scan| is_good[scan] = false);
        let (chi_squared, _) = graph.closure.chi_squared();
        Told { poses, chi_squared, pieces, is_good, loops: self.scans_of(&graph.closure.state()) }
    }

    /// Puts the graph to what these steps make of that of the run.
    fn apply(&mut self, loops: &[Edit]) -> Applied {
        self.graph.closure.restore(&self.unedited);
        let mut applied = Applied::default();
        for index in self.lasting(loops) {
            let Some(scans) = loops[index].scans() else { continue };
            match (self.take(&loops[index], scans), &loops[index]) {
                (Err(reason), _) => applied.refused.push(RefusedEdit { index, reason }),
                (Ok(()), Edit::AddLoop { .. }) => applied.num_added += 1,
                (Ok(()), _) => applied.num_removed += 1,
            }
        }
        applied
    }

    /// The steps without loops that are put in and taken out again later, which must leave nothing behind.
    fn lasting(&self, edits: &[Edit]) -> Vec<usize> {
        // For each pair of places with a loop the step that put it in; none where the run closed it.
        let of_run = self.scans_of(&self.unedited).into_iter().map(|scans| (self.places(scans), None));
        let mut present: HashMap<[usize; 2], Option<usize>> = of_run.collect();
        let mut lasts = vec![true; edits.len()];
        for (index, edit) in edits.iter().enumerate() {
            let Some(places) = edit.scans().map(|scans| self.places(scans)) else { continue };
            if matches!(edit, Edit::AddLoop { .. }) {
                present.entry(places).or_insert(Some(index));
            } else if let Some(Some(added)) = present.remove(&places) {
                (lasts[added], lasts[index]) = (false, false);
            }
        }
        (0..edits.len()).filter(|&index| lasts[index]).collect()
    }

    fn take(&mut self, edit: &Edit, scans: [usize; 2]) -> std::result::Result<(), String> {
        if let Some(lost) = scans.into_iter().find(|&scan| !self.is_placed(scan)) {
            return Err(format!("scan {lost} has no pose"));
        }
        let [(a, T_a_target), (b, T_b_source)] = scans.map(|scan| self.graph.attached(scan));
        let closure = &mut self.graph.closure;
        let added = match edit {
            Edit::AddLoop { T_target_source, unchecked, .. } => {
                let [target, source] = scans.map(|scan| self.T_laser_robot[scan]);
                let T = target * Pose2::from(*T_target_source) * source.inverse();
                let T_a_b = T_a_target * T * T_b_source.inverse();
                if *unchecked {
                    closure.add_unchecked_loop([a, b], &T_a_b)
                } else {
                    closure.add_loop([a, b], &T_a_b, &self.options)
                }
            }
            _ if closure.remove_loop([a, b]) => Ok(()),
            _ => return Err("there is no loop between the places of these scans".to_owned()),
        };
        added.map_err(|refusal| self.reason(&refusal))
    }

    fn reason(&self, refusal: &Refusal) -> String {
        let scans = |[target, source]: [usize; 2]| {
            format!("scans {} and {}", self.graph.nodes[target], self.graph.nodes[source])
        };
        match refusal {
            Refusal::Exists => "there is a loop between these places already: take it out first".to_owned(),
            Refusal::SamePlace => "the scans are of one place: choose scans that are further apart in time".to_owned(),
            Refusal::NoMatch(figure) => format!("the scans do not match there: {figure}"),
            Refusal::ContradictsGraph(chi_squared) => {
                format!("it contradicts what the rest of the graph tells: {}", beyond_chance(*chi_squared))
            }
            Refusal::ContradictsLoop(ends, chi_squared) => {
                format!("it contradicts the loop between {}: {}", scans(*ends), beyond_chance(*chi_squared))
            }
            Refusal::DoesNotFit => "it does not fit the graph that is solved with it".to_owned(),
            Refusal::Displaces(ends) => {
                format!("the loop between {} would no longer fit: take it out first if it is wrong", scans(*ends))
            }
        }
    }

    fn is_placed(&self, scan: usize) -> bool {
        self.estimates[scan].assessment().status != Status::Lost
    }

    /// The places of two scans.
    fn places(&self, scans: [usize; 2]) -> [usize; 2] {
        self.graph.closure.places(scans.map(|scan| self.graph.attached(scan).0))
    }

    /// The scans of the loops of a graph.
    fn scans_of(&self, state: &GraphState) -> Vec<[usize; 2]> {
        let nodes = &self.graph.nodes;
        self.graph.closure.ends(state).into_iter().map(|ends| ends.map(|node| nodes[node])).collect()
    }
}

fn beyond_chance(chi_squared: f64) -> String {
    format!("chi-squared is {chi_squared:.0}, and that of one right loop in 100,000 is above {ONE_IN_HUNDRED_THOUSAND}")
}
