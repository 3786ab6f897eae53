//! What the programs that score the depth engine have in common.

pub mod ablations;
pub mod disturbances;
pub mod picture;
pub mod processor_time;
pub mod recordings;
pub mod scores;
pub mod stand_ins;
pub mod tables;
