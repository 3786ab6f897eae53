//! From raw points to points fit for registration: cleaning and normals.

pub mod beam_normals;
pub mod clean;
pub mod planar_scan;
