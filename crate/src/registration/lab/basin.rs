//! The basin of attraction: the results of registrations that start at every node of a grid, grouped by minimum.

use serde::Serialize;

use super::grid::Grid;
use super::motion::LabMotion;
use crate::error::Result;
use crate::geometry::{Pose3, Vector};
use crate::registration::icp::EndReason;
use crate::registration::problem::IcpProblem;
use crate::search::KdTree;

/// The results of registrations, in the order of their starts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ends {
    /// The final pose of each: 4 x 4, row by row.
    pub T_target_source: Vec<[f64; 16]>,
    /// Why each loop ended.
    pub end_reason: Vec<EndReason>,
    /// Number of iterations of each.
    pub iterations: Vec<u16>,
    /// Mean robust loss at each final pose (m^2).
    pub cost: Vec<f64>,
}

/// Results grouped by minimum.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Basin {
    /// Index in `minima` for each start; -1 where the loop neither converged nor ran in a cycle.
    pub labels: Vec<i16>,
    /// The minima: the reference's first, the others by the number of starts that end there.
    pub minima: Vec<Minimum>,
    /// Share of all starts that end in the reference's minimum.
    pub share_home: f64,
}

/// A minimum in which registrations end.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct Minimum {
    /// Number of starts that end there.
    pub count: usize,
    /// The final pose with the lowest cost, 4 x 4, row by row, and its mean robust loss (m^2); null where no start ends there.
    pub lowest: Option<([f64; 16], f64)>,
}

/// Registers from every node of the grid's rows.
pub(super) fn ends<M: LabMotion>(
    problem: &dyn IcpProblem<M>,
    grid: &Grid<M>,
    to_absolute: &impl Fn(&Pose3) -> Result<[f64; 16]>,
) -> Result<Ends> {
    let mut ends = Ends::default();
    for row in grid.rows() {
        for column in 0..grid.width() {
            let registration = problem.register(grid.pose(row, column));
            let pose = registration.T_target_source;
            ends.T_target_source.push(to_absolute(&pose.in_space())?);
            ends.end_reason.push(registration.end_reason);
            ends.iterations.push(registration.history.len().min(usize::from(u16::MAX)) as u16);
            ends.cost.extend(problem.costs(&mut std::iter::once(pose)));
        }
    }
    Ok(ends)
}

/// Two final poses are the same minimum where the source's points, at their rms distance from its origin, differ by less than the
/// spacing of the target's points (the median distance to the nearest other), so that they have the same partners. The
/// reference's minimum gets all final poses around it, then the lowest remaining one those around itself, and so on.
pub(super) fn labelled<M: LabMotion>(
    problem: &dyn IcpProblem<M>,
    ends: &Ends,
    reference: &Pose3,
    to_relative: &impl Fn(&[f64; 16]) -> Result<Pose3>,
) -> Result<Basin> {
    let (tolerance, radius) = (median_spacing(problem), rms_distance(problem.source_points()));
    let is_same = |a: &M, b: &M| {
        let away = a.offsets_to(b);
        let num_rotations = M::Tangent::LEN - M::Point::LEN;
        let scaled = away.as_slice().iter().enumerate().map(|(i, x)| if i < num_rotations { x * radius } else { *x });
        scaled.map(|x| x * x).sum::<f64>() <= tolerance * tolerance
    };
    let poses =
        ends.T_target_source.iter().map(|rows| Ok(M::from_space(&to_relative(rows)?))).collect::<Result<Vec<M>>>()?;
    let mut waiting: Vec<usize> = (0..poses.len()).filter(|&end| is_at_rest(ends.end_reason[end])).collect();
    waiting.sort_by(|&a, &b| ends.cost[a].total_cmp(&ends.cost[b]));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut center = M::from_space(reference);
    loop {
        let (here, elsewhere) = waiting.into_iter().partition(|&end| is_same(&center, &poses[end]));
        groups.push(here);
        waiting = elsewhere;
        let Some(&lowest) = waiting.first() else { break };
        center = poses[lowest];
    }
    groups[1..].sort_by_key(|group| std::cmp::Reverse(group.len()));
    Ok(basin_of(ends, &groups))
}

fn basin_of(ends: &Ends, groups: &[Vec<usize>]) -> Basin {
    let mut labels = vec![-1; ends.end_reason.len()];
    let mut minima = Vec::new();
    for (label, group) in groups.iter().enumerate() {
        for &end in group {
            labels[end] = i16::try_from(label).unwrap_or(i16::MAX);
        }
        let lowest = group.first().map(|&end| (ends.T_target_source[end], ends.cost[end]));
        minima.push(Minimum { count: group.len(), lowest });
    }
    Basin { share_home: groups[0].len() as f64 / labels.len().max(1) as f64, labels, minima }
}

/// Median distance of the target's points to their nearest neighbour (m), from a thousand evenly spread points.
fn median_spacing<M: LabMotion>(problem: &dyn IcpProblem<M>) -> f64 {
    const NUM_SAMPLES: usize = 1000;
    let points: Vec<[f32; 3]> = problem.target_points().iter().map(|(p, _)| M::xyz(p).map(|x| x as f32)).collect();
    let tree = KdTree::build(&points);
    let to_other = |(index, point): (usize, &[f32; 3])| {
        let other = tree.nearest_where(point, f32::INFINITY, |other| other as usize != index)?;
        Some(f64::from(other.sq_distance).sqrt())
    };
    let step = points.len().div_ceil(NUM_SAMPLES).max(1);
    let mut distances: Vec<f64> = points.iter().enumerate().step_by(step).filter_map(to_other).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or_default()
}

fn is_at_rest(end_reason: EndReason) -> bool {
    matches!(end_reason, EndReason::Converged | EndReason::Cycle)
}

/// Root of the mean squared distance of points from the origin (m).
fn rms_distance<P: Vector>(points: &[P]) -> f64 {
    (points.iter().map(P::norm_squared).sum::<f64>() / points.len().max(1) as f64).sqrt()
}
