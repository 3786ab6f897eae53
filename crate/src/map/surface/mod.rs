//! Depth images, or clouds, at their poses to a surface of triangles.
//!
//! A truncated signed distance field: Curless and Levoy, "A volumetric method for building complex models from range images",
//! SIGGRAPH 1996, in hashed blocks as in Niessner, Zollhoefer, Izadi and Stamminger, "Real-time 3D reconstruction at scale using voxel
//! hashing", ACM TOG 32 (2013). It differs from those in four ways:
//!
//! - The distance of a voxel is that to the tangent plane of the surface at its pixel, not along the ray: where a wall is seen at
//!   a slant, the distance along the ray is too long by the cosine, and differs from frame to frame.
//! - Frames count by their information, the inverse variance of the sensor's depth, so that far views do not blur near ones, and
//!   the sum of it gives the standard deviation of each vertex.
//! - The field is truncated at three standard deviations of the depth, and at least at two voxels, which the extraction needs. The
//!   noise is that between the first keyframes, where it is larger than within an image.
//! - Depths count in voxels up to four times as large, where a pixel sees as much: most of a room is far away, and smaller voxels would
//!   each repeat one pixel. Before the surface is extracted, they are spread to the finest ones (`spread`).
//!
//! The surface is extracted as a dual mesh with a vertex a cell (Gibson, "Constrained elastic surface nets", MICCAI 1998).
//!
//! Read `fusion` first, then `view`; for clouds, `clouds`.

mod blocks;
mod cells;
mod clouds;
mod depth_tiles;
mod extraction;
mod fusion;
mod holes;
mod level;
mod pixels;
mod scatter;
mod spread;
mod view;

pub use clouds::CloudFusion;
pub use fusion::{SurfaceFusion, SurfaceOptions};
