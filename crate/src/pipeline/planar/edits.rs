//! Steps by which a map is mended, and what is told of them, as plain data.

use serde::{Deserialize, Serialize};

use super::anchor::KnownPlace;
use super::plan::PlanPoint;
use crate::graph::loops::planar::GraphState;
use crate::map::occupancy_grid::Cell;
use crate::pipeline::report::PlanarPose;

/// A step of mending. Scans are counted from 0; points are x and y (m) in the map as the steps before it have turned it.
///
/// Loops are taken out and put in first, whatever comes between. What follows changes no pose but by [`Rotate`](Self::Rotate) and
/// [`Anchor`](Self::Anchor): the painted and cropped grid is that of the main piece.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "action", rename_all = "snake_case", deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Edit {
    /// Takes out the loop between the places of two scans.
    RemoveLoop {
        /// A scan of the one place.
        target: usize,
        /// A scan of the other place.
        source: usize,
    },
    /// Puts a loop in between the places of two scans.
    AddLoop {
        /// The scan in whose frame the other one is.
        target: usize,
        /// The other scan.
        source: usize,
        /// Where it is, as far as the eye can tell: the match is searched for within 1 m and 0.3 rad.
        T_target_source: PlanarPose,
        /// Puts it in as it is given, without a match or a test. All poses are doubtful then.
        #[serde(default)]
        unchecked: bool,
    },
    /// Makes the cells along a straight line what they are said to be.
    PaintLine {
        /// What they are.
        cells: Cell,
        /// Where it begins and ends.
        ends: [[f64; 2]; 2],
        /// Its width (m); all cells that it passes through are painted at least.
        width: f64,
    },
    /// Makes the cells in a rectangle along the map's axes what they are said to be.
    PaintRectangle {
        /// What they are.
        cells: Cell,
        /// Two opposite corners.
        corners: [[f64; 2]; 2],
    },
    /// Makes the cells in a closed line what they are said to be.
    PaintPolygon {
        /// What they are.
        cells: Cell,
        /// Its corners, three at least.
        corners: Vec<[f64; 2]>,
    },
    /// Cuts off what lies outside a rectangle along the map's axes.
    Crop {
        /// Two opposite corners.
        corners: [[f64; 2]; 2],
    },
    /// Turns the map about its origin, with all poses.
    Rotate {
        /// Counter-clockwise (rad); by default as little as it takes to lay most walls along the axes.
        #[serde(default)]
        angle: Option<f64>,
    },
    /// Moves the map onto places with known coordinates, with all poses: the rigid motion that fits best in the sense of least squares.
    Anchor {
        /// Two at least.
        pairs: Vec<KnownPlace>,
        /// Standard deviation of a coordinate of these places, of the map's and the world's together (m); by default a cell of the
        /// grid, 0.05. Pairs that fit worse are an error.
        #[serde(default)]
        accuracy: Option<f64>,
    },
    /// Lays a building plan behind the map, in place of one that was laid before: the turn, shift and scale that fit best in the sense
    /// of least squares. Nothing of the map changes.
    LayPlan {
        /// Name of the picture.
        picture: String,
        /// Three at least.
        points: Vec<PlanPoint>,
        /// Standard deviation of a coordinate of these points (m); by default that of a cell of the grid and a pixel of the picture
        /// together. Points that fit worse are told.
        #[serde(default)]
        accuracy: Option<f64>,
    },
    /// Takes the building plan off.
    RemovePlan,
    /// Leaves scans out of the map and its grid. Their poses stay.
    LeaveOut {
        /// The first of them.
        first: usize,
        /// The last of them.
        last: usize,
    },
}

/// A step that was not taken.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct RefusedEdit {
    /// Its place in the list, from 0.
    pub index: usize,
    /// Why.
    pub reason: String,
}

/// A loop of the graph.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct GraphLoop {
    /// The scan in whose frame the other one was found.
    pub target: usize,
    /// The other scan.
    pub source: usize,
    /// Where it was found.
    pub T_target_source: PlanarPose,
    /// Standard deviation of its heading (rad).
    pub heading_sigma: f64,
    /// Standard deviation of its position (m).
    pub position_sigma: f64,
    /// Squared Mahalanobis distance (three degrees of freedom) from what the rest of the graph tells; 0 where that tells nothing.
    pub chi_squared: f64,
    /// Share of the returns seen from both places that agree, 0..=1.
    pub agreement: f64,
    /// Whether it was put in by hand.
    pub is_added: bool,
    /// Whether it was put in without a match.
    pub is_unchecked: bool,
}

/// The loops of a map's graph.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct GraphLoops {
    /// Sum of the squared Mahalanobis distances of all measured motions.
    pub chi_squared: f64,
    /// Number of these motions.
    pub num_motions: usize,
    /// The scans that are nodes.
    pub nodes: Vec<usize>,
    /// The loops.
    pub loops: Vec<GraphLoop>,
    /// Loops of the run that were taken out or no longer fit: pairs of scans.
    pub left_out: Vec<[usize; 2]>,
}

/// What a step would change, by the graph before the scans are registered jointly.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct Consequence {
    /// Why the step would not be taken; null where it would.
    pub refusal: Option<String>,
    /// The graph's sum of squared Mahalanobis distances, before and after.
    pub chi_squared: [f64; 2],
    /// The scan that moves furthest.
    pub furthest: usize,
    /// How far it moves (m).
    pub furthest_moves: f64,
    /// How far the scans move in the mean (m).
    pub mean_moves: f64,
    /// Number of the certain pieces of the map, before and after.
    pub num_pieces: [usize; 2],
    /// How many scans are no longer good.
    pub num_no_longer_good: usize,
    /// How many scans become good.
    pub num_becoming_good: usize,
    /// Loops that would no longer fit: pairs of scans.
    pub left_out: Vec<[usize; 2]>,
}

impl Edit {
    /// The scans that stand for the places of a loop; `None` for a step that is not about loops.
    pub(super) fn scans(&self) -> Option<[usize; 2]> {
        match *self {
            Self::RemoveLoop { target, source } | Self::AddLoop { target, source, .. } => Some([target, source]),
            _ => None,
        }
    }
}

/// What a run keeps to be mended.
#[derive(Default)]
pub struct BeforeMending {
    /// How many findings each frame had before the pieces were told apart.
    pub num_findings: Vec<usize>,
    /// The graph as the run left it; `None` before it was looked at.
    pub graph: Option<GraphState>,
    /// The steps about loops that were given, and what became of them.
    pub loops: Vec<Edit>,
    pub applied: Applied,
}

/// What became of steps about loops, without loops that were put in and taken out again.
#[derive(Default)]
pub struct Applied {
    pub num_added: usize,
    pub num_removed: usize,
    /// By their places among these steps.
    pub refused: Vec<RefusedEdit>,
}
