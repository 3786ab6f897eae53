//! Nearest-neighbour indices, each tested against brute force.

pub mod kd_tree;
pub mod neighbourhood;
pub mod reach_grid;

pub use kd_tree::{KdTree, Neighbor};
pub use neighbourhood::Neighbourhood;
pub use reach_grid::ReachGrid;
