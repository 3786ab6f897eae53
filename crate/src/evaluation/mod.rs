//! How good a result is: sharpness of the map, distance to a reference.

pub mod position_error;
pub mod sharpness;
