//! The pose graph of a file, optimised, and what there is to tell about it.

use serde::{Deserialize, Serialize};

use super::{GraphMotion, Optimization, chordal, optimize, parts, squared_distance};
use crate::geometry::Vector;
use crate::io::pose_graph::{AnyPoseGraph, PoseGraph};

/// Where the search begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum GraphStart {
    /// At both others in turn; the better result counts.
    #[default]
    Both,
    /// At the poses in the file, or those composed along its edges.
    File,
    /// At poses that follow from the edges alone.
    Chordal,
}

/// How a pose graph is optimised.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct GraphOptions {
    /// Where the search begins.
    pub start: GraphStart,
    /// Steps of each search at most.
    pub max_iterations: usize,
}

impl Default for GraphOptions {
    fn default() -> Self {
        Self { start: GraphStart::Both, max_iterations: 200 }
    }
}

/// An edge that the others contradict most.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct WorstEdge {
    /// The node in whose frame the other was measured.
    pub from: u64,
    /// The measured node.
    pub to: u64,
    /// Squared Mahalanobis distance of the measurement from the result.
    pub squared_distance: f64,
}

/// A pose graph and its optimisation.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct GraphReport {
    /// 2 in the plane, 3 in space.
    pub dimension: usize,
    /// Number of poses.
    pub num_nodes: usize,
    /// Number of measured motions.
    pub num_edges: usize,
    /// Number of parts that no edge joins. Each is optimised by itself: how they lie to each other means nothing.
    pub num_parts: usize,
    /// Number of nodes without a pose in the file; theirs was composed along the edges.
    pub num_composed: usize,
    /// Expected value of chi squared where the information matrices are right: equations minus unknowns.
    pub degrees_of_freedom: usize,
    /// The search from the poses in the file.
    pub from_file: Option<Optimization>,
    /// The search from the edges alone.
    pub from_chordal: Option<Optimization>,
    /// The search whose result counts.
    pub used: GraphStart,
    /// At most ten edges, the worst first.
    pub worst_edges: Vec<WorstEdge>,
}

/// Number of edges that are listed.
const NUM_LISTED: usize = 10;

/// Optimises a pose graph; its poses become those of the search that ended with the smaller sum.
pub fn optimize_graph(graph: &mut AnyPoseGraph, options: &GraphOptions) -> GraphReport {
    match graph {
        AnyPoseGraph::Plane(graph) => run(graph, options),
        AnyPoseGraph::Space(graph) => run(graph, options),
    }
}

fn run<M: GraphMotion>(graph: &mut PoseGraph<M>, options: &GraphOptions) -> GraphReport {
    let search = |poses: Vec<M>| {
        let mut own = PoseGraph { poses, ..graph.clone() };
        let optimization = optimize(&mut own, options.max_iterations);
        (optimization, own.poses)
    };
    let begins_at = |start| options.start == start || options.start == GraphStart::Both;
    let chordal = begins_at(GraphStart::Chordal).then(|| chordal::poses(graph)).flatten().map(search);
    // Where the edges alone tell no start, that of the file is left.
    let file = (begins_at(GraphStart::File) || chordal.is_none()).then(|| search(graph.poses.clone()));
    let sum =
        |found: &Option<(Optimization, Vec<M>)>| found.as_ref().map_or(f64::INFINITY, |found| found.0.chi_squared);
    let used = if sum(&chordal) < sum(&file) { GraphStart::Chordal } else { GraphStart::File };
    let [from_file, from_chordal] = [&file, &chordal].map(|found| found.as_ref().map(|found| found.0));
    if let Some((_, poses)) = if used == GraphStart::Chordal { chordal } else { file } {
        graph.poses = poses;
    }
    let num_parts = parts(graph).iter().enumerate().filter(|&(node, &part)| node == part).count();
    let num_unknown = graph.poses.len() - num_parts.max(graph.fixed.len());
    GraphReport {
        dimension: M::Point::LEN,
        num_nodes: graph.poses.len(),
        num_edges: graph.edges.len(),
        num_parts,
        num_composed: graph.poses.len() - graph.num_given,
        degrees_of_freedom: (graph.edges.len() * M::Tangent::LEN).saturating_sub(num_unknown * M::Tangent::LEN),
        from_file,
        from_chordal,
        used,
        worst_edges: worst_edges(graph),
    }
}

fn worst_edges<M: GraphMotion>(graph: &PoseGraph<M>) -> Vec<WorstEdge> {
    let edges = graph.edges.iter().map(|edge| WorstEdge {
        from: graph.ids[edge.from],
        to: graph.ids[edge.to],
        squared_distance: squared_distance(edge, &graph.poses),
    });
    let mut edges: Vec<WorstEdge> = edges.collect();
    edges.sort_by(|a, b| b.squared_distance.total_cmp(&a.squared_distance));
    edges.truncate(NUM_LISTED);
    edges
}
