//! Nearest-neighbour search: points in, an index out that answers queries, each tested against brute force.
//!
//! [`KdTree`] for any distance, [`RadiusGrid`] and [`NearestTable`] (plane) where the largest distance is
//! known. Read `kd_tree` first.

pub(crate) mod kd_tree;
pub(crate) mod nearest_table;
pub(crate) mod neighbourhood;
pub(crate) mod order;
pub(crate) mod radius_grid;

pub use kd_tree::{KdTree, Neighbor};
pub use nearest_table::NearestTable;
pub use neighbourhood::Neighbourhood;
pub use radius_grid::RadiusGrid;
