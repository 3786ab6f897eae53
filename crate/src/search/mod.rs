//! Nearest-neighbour indices, each tested against brute force.

pub mod kd_tree;
pub mod neighbourhood;

pub use kd_tree::{KdTree, Neighbor};
pub use neighbourhood::Neighbourhood;
