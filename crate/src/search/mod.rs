//! Nearest-neighbour search: points in, an index for queries out.
//!
//! [`KdTree`] serves any distance; [`RadiusGrid`] and [`NearestTable`] (plane) are faster where the largest distance is
//! known beforehand. Each is tested against brute force or the tree. Read `kd_tree` first.

pub(crate) mod kd_tree;
pub(crate) mod nearest_table;
pub(crate) mod neighborhood;
pub(crate) mod order;
pub(crate) mod radius_grid;

pub use kd_tree::{KdTree, Neighbor};
pub use nearest_table::NearestTable;
pub use neighborhood::Neighborhood;
pub use radius_grid::RadiusGrid;
