//! From raw points to points fit for registration: cleaning and normals.

pub mod beam_normals;
pub mod clean;
pub mod depth_cloud;
pub mod depth_surfels;
pub mod estimate_normals;
pub mod map_image;
pub mod planar_scan;
pub mod voxel_downsample;
pub mod wrap_around;
