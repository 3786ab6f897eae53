//! Nearest-neighbour indices, each tested against brute force.

pub mod kd_tree;

pub use kd_tree::{KdTree, Neighbor};
