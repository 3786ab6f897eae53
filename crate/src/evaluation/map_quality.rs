//! Sharpness of a map without a reference, by two metrics that grow as errors of the poses blur its surfaces:
//!
//! - Mean map entropy: Droeschel and Behnke, "Local multi-resolution surfel grids for MAV motion estimation and 3D
//!   mapping", IAS-13 (2014).
//! - Mean plane variance: Razlaw, Droeschel, Holz and Behnke, "Evaluation of registration methods for sparse 3D laser
//!   scans", ECMR 2015.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::geometry::jacobi::eigenpairs;
use crate::search::KdTree;
use crate::{Error, Result};

/// Size of the neighbourhoods, and the number of points that are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(default, deny_unknown_fields)]
pub struct MapQualityOptions {
    /// Radius of the neighbourhood (m).
    pub radius: f64,
    /// Fewest points of a neighbourhood, the point itself included, for which the point is evaluated.
    pub min_neighbors: usize,
    /// Most points that are evaluated, evenly spread over the map; neighbours are searched among all points. 0: all.
    pub max_points: usize,
}

impl Default for MapQualityOptions {
    /// 0.3 m, five neighbours, 50,000 points.
    fn default() -> Self {
        Self { radius: 0.3, min_neighbors: 5, max_points: 50_000 }
    }
}

/// The metrics of a map; lower is sharper. Only maps of the same scans can be compared by them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct MapQuality {
    /// Mean map entropy, the mean of 1/2 ln |2 pi e Sigma| over the points, Sigma being the covariance of a point's
    /// neighbourhood (nats).
    pub mean_map_entropy: f64,
    /// Mean plane variance, the mean of the smallest eigenvalue of Sigma (m^2).
    pub mean_plane_variance: f64,
    /// Number of points evaluated: the plane variance is the mean over them.
    pub num_points: usize,
    /// Number of these whose covariance has a positive determinant: the entropy is the mean over them, minus infinity if none.
    pub num_with_volume: usize,
    /// Number of points with too few neighbours to be evaluated.
    pub num_sparse: usize,
}

/// The metrics of a map of points in `D` dimensions (m). Where `D` is 2, the plane variance is the variance across lines.
///
/// # Errors
/// When the radius is not positive and finite, or no point has enough neighbours.
pub fn map_quality<const D: usize>(points: &[[f32; D]], options: &MapQualityOptions) -> Result<MapQuality> {
    let MapQualityOptions { radius, min_neighbors, max_points } = *options;
    if !(radius > 0.0 && radius.is_finite()) {
        return Err(Error::whole(format!("radius is {radius} m"), "Give a positive radius"));
    }
    let tree = KdTree::build(points);
    let num_queries = if max_points == 0 { points.len() } else { max_points.min(points.len()) };
    let least = min_neighbors.max(D + 1);
    let mut sums = Sums::default();
    let mut neighbors = Vec::new();
    for query in 0..num_queries {
        let center = &points[spread_evenly(query, num_queries, points.len())];
        if center.iter().any(|value| !value.is_finite()) {
            continue;
        }
        tree.within(center, radius as f32, &mut neighbors);
        if neighbors.len() < least {
            sums.num_sparse += 1;
            continue;
        }
        // Relative to the query point, so that no digits are lost far from the origin.
        let offset = |index: u32| {
            SVector::<f64, D>::from_fn(|axis, _| f64::from(points[index as usize][axis]) - f64::from(center[axis]))
        };
        sums.add(&covariance(neighbors.iter().map(|neighbor| offset(neighbor.index))));
    }
    if sums.num_points == 0 {
        let problem = format!("No point has {least} points within {radius} m");
        return Err(Error::whole(problem, "Give a larger radius, or a map of more points"));
    }
    Ok(sums.quality())
}

/// Index of the `query`-th of `num_queries` points spread evenly over `num_points`. The product exceeds the 32 bits of a
/// `usize` in WebAssembly.
fn spread_evenly(query: usize, num_queries: usize, num_points: usize) -> usize {
    (query as u64 * num_points as u64 / num_queries as u64) as usize
}

/// Sums over the points evaluated; fields as in [`MapQuality`].
#[derive(Default)]
struct Sums {
    entropy: f64,
    variance: f64,
    num_points: usize,
    num_with_volume: usize,
    num_sparse: usize,
}

impl Sums {
    /// Adds a point by the covariance of its neighbourhood (m^2).
    fn add<const D: usize>(&mut self, covariance: &SMatrix<f64, D, D>) {
        let (smallest, determinant) = spread(covariance);
        self.variance += smallest;
        self.num_points += 1;
        if determinant > 0.0 {
            let two_pi_e = std::f64::consts::TAU * std::f64::consts::E;
            self.entropy += 0.5 * (D as f64 * two_pi_e.ln() + determinant.ln());
            self.num_with_volume += 1;
        }
    }

    fn quality(&self) -> MapQuality {
        let Self { entropy, variance, num_points, num_with_volume, num_sparse } = *self;
        MapQuality {
            mean_map_entropy: if num_with_volume > 0 { entropy / num_with_volume as f64 } else { f64::NEG_INFINITY },
            mean_plane_variance: variance / num_points as f64,
            num_points,
            num_with_volume,
            num_sparse,
        }
    }
}

fn covariance<const D: usize>(offsets: impl Iterator<Item = SVector<f64, D>>) -> SMatrix<f64, D, D> {
    let (mut n, mut sum, mut outer) = (0.0, SVector::<f64, D>::zeros(), SMatrix::<f64, D, D>::zeros());
    for offset in offsets {
        n += 1.0;
        sum += offset;
        outer += offset * offset.transpose();
    }
    let mean = sum / n;
    outer / n - mean * mean.transpose()
}

/// The smallest eigenvalue and the determinant of a covariance. Eigenvalues within the rounding error of zero are set to zero.
fn spread<const D: usize>(covariance: &SMatrix<f64, D, D>) -> (f64, f64) {
    let pairs = eigenpairs(*covariance);
    let largest = pairs.last().map_or(0.0, |(value, _)| *value);
    let exact = pairs.iter().map(|(value, _)| if *value <= largest * f64::EPSILON * 8.0 { 0.0 } else { *value });
    (exact.clone().next().unwrap_or(0.0), exact.product())
}
