//! Preprocessing: raw points or images in; cleaned points, normals and surfels, which registration uses, out.
//!
//! - Planar scans: [`clean`], `beam_normals`, [`planar_scan`].
//! - Clouds: [`voxel_downsample`] with its `voxel_hash`, [`estimate_normals`]; of a lidar that moves while it turns [`point_clock`],
//!   [`azimuth_clock`], [`deskew`].
//! - Depth images: [`wrap_around`], [`depth_noise`], [`color_registration`], [`depth_surfels`], [`depth_cloud`], [`map_image`].
//!
//! Read [`planar_scan`] first.

pub mod azimuth_clock;
pub(crate) mod beam_normals;
pub mod clean;
pub mod color_registration;
pub mod depth_cloud;
pub mod depth_noise;
pub mod depth_surfels;
pub mod deskew;
pub mod estimate_normals;
pub mod map_image;
pub mod planar_scan;
pub mod point_clock;
pub mod voxel_downsample;
pub(crate) mod voxel_hash;
pub mod wrap_around;
