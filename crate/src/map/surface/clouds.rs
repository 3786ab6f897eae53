//! Clouds into a field: the plane of the points in and around each cell of space, and the distances of voxels from those planes.
//!
//! Hoppe, DeRose, Duchamp, McDonald and Stuetzle, "Surface reconstruction from unorganized points", SIGGRAPH 1992, with the planes
//! weighted as in Kolluri, "Provably good moving least squares", SODA 2005. It differs from those in two ways:
//!
//! - Planes face the sensors that saw their points, so nothing has to be propagated from one to the next.
//! - A sweep counts once in a cell, however many points it has there: they share the error of its pose.

use std::collections::BTreeMap;

use glam::Vec3;

use super::SurfaceOptions;
use super::blocks::{Blocks, Layers};
use super::cells::{Cells, MAX_TILT};
use super::extraction::extract;
use super::fusion::{BLOCK_BYTES, COLOR_BYTES};
use super::pixels::WEIGHT_INFORMATION;
use crate::error::Result;
use crate::geometry::{PointCloud, Pose3, TriangleMesh};

/// Cells grow at least by this until they hold enough points.
const GROWTH: f32 = 1.25;
/// Sizes of cells, each twice as large as the one before. The largest bridge gaps of twelve voxels between the rings of a lidar on the ground.
const NUM_SCALES: usize = 4;

/// A surface of clouds at their poses. It is made of all of them at once.
#[derive(Debug, Clone)]
pub struct CloudFusion {
    options: SurfaceOptions,
    /// Of the sensor, in the frame of its clouds (m).
    viewpoint: Vec3,
    /// Side of the smallest voxel that the points allow (m).
    min_voxel_size: f32,
    voxel_size: f32,
    clouds: BTreeMap<usize, (PointCloud, Pose3)>,
}

impl CloudFusion {
    /// Without clouds, whose sensor is at `viewpoint` (m, in their frame) and of whose points one is left in each cube of side
    /// `spacing` (m).
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(options: SurfaceOptions, viewpoint: Vec3, spacing: f64) -> Result<Self> {
        options.check()?;
        let min_voxel_size = options.voxel_size.max(spacing) as f32;
        Ok(Self { options, viewpoint, min_voxel_size, voxel_size: min_voxel_size, clouds: BTreeMap::new() })
    }

    /// Puts a cloud in at its pose, in place of the one with this number.
    pub fn put(&mut self, number: usize, cloud: PointCloud, T_world_cloud: Pose3) {
        if T_world_cloud.to_homogeneous().iter().all(|entry| entry.is_finite()) {
            self.clouds.insert(number, (cloud, T_world_cloud));
        }
    }

    /// Takes a cloud out.
    pub fn take_out(&mut self, number: usize) {
        self.clouds.remove(&number);
    }

    /// Number of clouds.
    pub fn num_frames(&self) -> usize {
        self.clouds.len()
    }

    /// Memory of their points (bytes).
    pub fn num_bytes(&self) -> usize {
        let bytes_a_point = |cloud: &PointCloud| size_of::<Vec3>() + if cloud.colors.is_some() { 3 } else { 0 };
        self.clouds.values().map(|(cloud, _)| cloud.len() * bytes_a_point(cloud)).sum()
    }

    /// Side of a voxel of the last [mesh](Self::mesh) (m): that of the options, or larger where the points are too few for it or the
    /// memory is not enough.
    pub fn voxel_size(&self) -> f64 {
        f64::from(self.voxel_size)
    }

    /// The surface.
    pub fn mesh(&mut self) -> TriangleMesh {
        let blocks = self.field();
        // Planes reach beyond the corner of a room, where rims would stand out.
        let mut mesh = extract(Layers(&[&blocks]), self.voxel_size, 1.0 / WEIGHT_INFORMATION, false);
        mesh = mesh.without_islands(self.options.min_island_area(self.voxel_size), TriangleMesh::area);
        mesh.set_normals();
        mesh
    }

    /// The field in the smallest voxels that the points and the memory allow.
    fn field(&mut self) -> Blocks {
        self.voxel_size = self.min_voxel_size;
        let max_bytes = (1e6 * self.options.max_megabytes) as usize;
        let has_colors = self.clouds.values().any(|(cloud, _)| cloud.colors.is_some());
        let bytes_a_block = BLOCK_BYTES + if has_colors { COLOR_BYTES } else { 0 };
        // With so many in the 27 cells around most points, a plane's direction is known well enough where points scatter from it by half as
        // much as they do along it.
        let enough = (0.5 / MAX_TILT).powi(2);
        loop {
            let mut growth = GROWTH;
            if let Some(cells) = self.cells(max_bytes) {
                let density = cells.density();
                // Fewer points lie as densely as they can where all are around each.
                if density >= enough.min(cells.num_points() as f64) {
                    let blocks = field_of(cells);
                    if blocks.len() * bytes_a_block <= max_bytes {
                        return blocks;
                    }
                } else {
                    // Of a surface, four times as many lie in cells twice as large.
                    growth = growth.max((enough / density).sqrt() as f32 / GROWTH);
                }
            }
            self.voxel_size *= growth;
        }
    }

    /// Cells as large as the voxels; `None` where they take more than this (bytes).
    fn cells(&self, max_bytes: usize) -> Option<Cells> {
        let mut cells = Cells::new(self.voxel_size);
        for (number, (cloud, pose)) in (1..).zip(self.clouds.values()) {
            cells.add(number, cloud, pose, self.viewpoint);
            if cells.num_bytes() > max_bytes {
                return None;
            }
        }
        Some(cells)
    }
}

/// The field of the planes of cells, where the points are too few for that of cells twice as large, and so on.
fn field_of(mut cells: Cells) -> Blocks {
    let mut blocks = Blocks::default();
    for _ in 0..NUM_SCALES {
        cells.add_to(&mut blocks);
        cells = cells.coarser();
    }
    blocks
}
