//! Back-projection of every pixel of a depth image to a point.

use glam::Vec3;

use super::depth_surfels::DepthModel;
use crate::camera::{ColorImage, DepthImage, Pinhole};
use crate::geometry::PointCloud;

/// Voxels to which the points of a depth image are thinned (m), which bounds the time and keeps near surfaces from outweighing far ones.
pub const DEPTH_VOXEL: f64 = 0.05;

/// The points (m, camera frame) of the pixels that are usable and within range, row by row, with their colours.
pub fn depth_cloud(
    image: &DepthImage,
    usable: &[bool],
    camera: &Pinhole,
    model: &DepthModel,
    colors: Option<&ColorImage>,
) -> PointCloud {
    let table = camera.ray_table();
    let (mut positions, mut point_colors) = (Vec::with_capacity(image.values.len()), Vec::new());
    for (index, (&value, _)) in image.values.iter().zip(usable).enumerate().filter(|(_, (_, usable))| **usable) {
        let Some(z) = model.depth(value) else { continue };
        let (x, y) = (table.x[index % image.width] * z, table.y[index / image.width] * z);
        positions.push(Vec3::new(x as f32, y as f32, z as f32));
        point_colors.extend(colors.map(|colors| colors.pixels[index]));
    }
    PointCloud { positions, colors: colors.is_some().then_some(point_colors), ..PointCloud::default() }
}
