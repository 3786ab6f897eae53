//! The size of a point's neighbourhood.

/// Which points are the neighbours of a point; the point itself is one of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighborhood {
    /// Largest number of neighbours, the nearest first.
    pub max_neighbors: usize,
    /// Largest distance of a neighbour (m); infinity sets no limit.
    pub radius: f64,
}
