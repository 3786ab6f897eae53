//! The cost over two unknowns, and its minima.

use nalgebra::{Translation2, Vector2};
use serde::Serialize;

use super::grid::Grid;
use super::motion::LabMotion;
use crate::geometry::Pose2;
use crate::registration::problem::IcpProblem;
use crate::search::NearestTable;

/// The cost at every node of the grid's rows (m^2): the robust loss with the pairs searched at each.
pub(super) fn costs<M: LabMotion>(problem: &dyn IcpProblem<M>, grid: &Grid<M>) -> Vec<f64> {
    let row = |row| problem.costs(&mut (0..grid.width()).map(|column| grid.pose(row, column)));
    grid.rows().flat_map(row).collect()
}

/// [`costs`] in the plane: where the poses along an axis differ by their translation only, a table finds the partners of a point
/// for the whole row.
pub(super) fn planar_costs(
    problem: &dyn IcpProblem<Pose2>,
    grid: &Grid<Pose2>,
    table: Option<&NearestTable>,
) -> Vec<f64> {
    let is_linear = |nth: &usize| grid.moves_along(*nth) && problem.options().rejection.trim_fraction == 0.0;
    let (Some(nth), Some(table)) = ((0..2).find(is_linear), table) else { return costs(problem, grid) };
    let mut find = |start: &_, shifts: &[_], spans: &mut Vec<_>| table.along(start, shifts, spans);
    let mut line = |poses: Vec<Pose2>| {
        let rotation = Pose2::from_parts(Translation2::identity(), poses[0].rotation);
        let translations: Vec<Vector2<f64>> = poses.iter().map(|pose| pose.translation.vector).collect();
        problem.costs_along(&rotation, &translations, &mut find)
    };
    let (rows, width) = (grid.rows(), grid.width());
    if nth == 0 {
        return rows.flat_map(|row| line((0..width).map(|column| grid.pose(row, column)).collect())).collect();
    }
    let mut costs = vec![0.0; rows.len() * width];
    for column in (0..width).filter(|_| !rows.is_empty()) {
        let along = line(rows.clone().map(|row| grid.pose(row, column)).collect());
        along.into_iter().enumerate().for_each(|(row, cost)| costs[row * width + column] = cost);
    }
    costs
}

/// A node whose neighbours all have a higher cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct LocalMinimum {
    /// Index of the node in its row.
    pub column: usize,
    /// Index of the row.
    pub row: usize,
    /// The cost (m^2).
    pub cost: f64,
    /// Smallest rise in cost (m^2) on a path to a lower node; for the lowest minimum, to the highest node.
    pub prominence: f64,
}

/// All local minima of a landscape of `width` nodes a row, the most prominent first.
///
/// Nodes are added from the lowest to the highest. Where two basins meet, the one with the higher minimum ends; its prominence is
/// the cost of the meeting point minus its minimum (Edelsbrunner, Letscher and Zomorodian, "Topological persistence and
/// simplification", Discrete and Computational Geometry 28, 2002). Nodes that are NaN are left out.
pub fn local_minima(costs: &[f64], width: usize) -> Vec<LocalMinimum> {
    let mut order: Vec<usize> = (0..costs.len()).filter(|&node| !costs[node].is_nan()).collect();
    order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]).then(a.cmp(&b)));
    let mut basin = vec![usize::MAX; costs.len()]; // parent in a forest whose roots are the minima
    let mut minima = Vec::new();
    let minimum = |node: usize, height: f64| {
        let (column, row) = (node % width, node / width);
        LocalMinimum { column, row, cost: costs[node], prominence: height - costs[node] }
    };
    for &node in &order {
        basin[node] = node;
        for neighbor in neighbors(node, width, costs.len()) {
            if basin[neighbor] == usize::MAX {
                continue;
            }
            let (a, b) = (root(&mut basin, node), root(&mut basin, neighbor));
            if a == b {
                continue;
            }
            let is_lower = costs[a].total_cmp(&costs[b]).then(a.cmp(&b)).is_lt();
            let (stays, ends) = if is_lower { (a, b) } else { (b, a) };
            basin[ends] = stays;
            if ends != node {
                minima.push(minimum(ends, costs[node]));
            }
        }
    }
    if let (Some(&lowest), Some(&highest)) = (order.first(), order.last()) {
        minima.push(minimum(lowest, costs[highest]));
    }
    minima.retain(|minimum| minimum.prominence > 0.0);
    minima.sort_by(|a, b| b.prominence.total_cmp(&a.prominence).then(a.cost.total_cmp(&b.cost)));
    minima
}

/// The neighbours of a node, at most eight.
fn neighbors(node: usize, width: usize, count: usize) -> impl Iterator<Item = usize> {
    let (column, row) = (node % width, node / width);
    let rows = row.saturating_sub(1)..(row + 2).min(count / width);
    let columns = column.saturating_sub(1)..(column + 2).min(width);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x)).filter(move |&other| other != node)
}

fn root(basin: &mut [usize], mut node: usize) -> usize {
    while basin[node] != node {
        basin[node] = basin[basin[node]];
        node = basin[node];
    }
    node
}
