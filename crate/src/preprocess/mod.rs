//! From raw points to points fit for registration: cleaning and normals.

pub mod clean;
