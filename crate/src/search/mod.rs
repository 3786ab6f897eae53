//! Nearest-neighbour search: points in, an index out that answers queries, each tested against brute force.
//!
//! [`KdTree`] for any distance, [`RadiusGrid`] where the largest distance is known. Read [`kd_tree`] first.

pub mod kd_tree;
pub mod neighbourhood;
pub mod radius_grid;

pub use kd_tree::{KdTree, Neighbor};
pub use neighbourhood::Neighbourhood;
pub use radius_grid::RadiusGrid;
