//! Which points around a point count as its neighbours.

/// The neighbours of a point, the point itself among them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbourhood {
    /// Number of nearest points, ...
    pub max_neighbors: usize,
    /// ... but none further away than this (m); infinity sets no limit.
    pub radius: f64,
}
