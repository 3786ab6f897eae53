//! Voxelised GICP: plane to plane against a grid of Gaussians, with a look-up in place of a nearest-neighbour search.
//!
//! Koide, Yokozuka, Oishi and Banno, "Voxelized GICP for Fast and Accurate 3D Point Cloud Registration", ICRA 2021: a voxel
//! stands for the points in it, with the mean of their positions and of their covariances, and each source point is paired with
//! the voxel that it lies in.

use nalgebra::{Matrix3, Vector3};

use super::factors::{Correspondence, Factor, NormalEquations, PLANE_THICKNESS};
use super::target::{LastSearch, Target};
use crate::geometry::{Pose3, RigidMotion};
use crate::preprocess::voxel_hash::{Voxel, VoxelHash};
use crate::search::Neighbor;

/// Points with normals as Gaussians, one per voxel.
#[derive(Debug, Clone)]
pub struct GaussianVoxels {
    hash: VoxelHash,
    voxels: Vec<GaussianVoxel>,
}

#[derive(Debug, Clone, Copy)]
struct GaussianVoxel {
    voxel: Voxel,
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl GaussianVoxels {
    /// From points (m) with their unit normals; points without are left out. `voxel_size` (m) is positive.
    ///
    /// # Panics
    /// When there is not one entry of `normals` for each point.
    pub fn new(points: &[Vector3<f64>], normals: &[Option<Vector3<f64>>], voxel_size: f64) -> Self {
        assert_eq!(points.len(), normals.len(), "one normal a point");
        let mut grid = Self { hash: VoxelHash::new(voxel_size), voxels: Vec::new() };
        let mut counts: Vec<f64> = Vec::new();
        for (point, normal) in points.iter().zip(normals) {
            let (Some(normal), Some(voxel)) = (normal, grid.hash.voxel(point)) else { continue };
            let index = grid.hash.insert(voxel) as usize;
            if index == counts.len() {
                grid.voxels.push(GaussianVoxel { voxel, mean: Vector3::zeros(), covariance: Matrix3::zeros() });
                counts.push(0.0);
            }
            grid.voxels[index].mean += point;
            grid.voxels[index].covariance += covariance(normal);
            counts[index] += 1.0;
        }
        for (voxel, count) in grid.voxels.iter_mut().zip(counts) {
            voxel.mean /= count;
            voxel.covariance /= count;
        }
        grid
    }

    /// Number of voxels that hold a point.
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    /// The mean covariance of the points in a voxel: of no unit, [`PLANE_THICKNESS`] along their normals and 1 across.
    pub fn covariance(&self, index: u32) -> &Matrix3<f64> {
        &self.voxels[index as usize].covariance
    }

    fn partner(&self, index: u32, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        let sq_distance = (query - self.voxels[index as usize].mean).norm_squared();
        (sq_distance <= max_distance * max_distance).then_some(Neighbor { index, sq_distance: sq_distance as f32 })
    }
}

/// Covariance of a point on a surface with this unit normal, as in Segal, Haehnel and Thrun, "Generalized-ICP", RSS 2009.
fn covariance(normal: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() - normal * normal.transpose() * (1.0 - PLANE_THICKNESS)
}

/// The partner of a point is the voxel it lies in, if its mean is within the distance. Voxels have no normals, so no pair is
/// rejected by its normals.
impl Target for GaussianVoxels {
    type Point = Vector3<f64>;

    fn nearest(&self, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        let index = self.hash.number(&self.hash.voxel(query)?)?;
        self.partner(index, query, max_distance)
    }

    fn nearest_again(
        &self,
        query: &Vector3<f64>,
        max_distance: f64,
        last: &mut LastSearch<Vector3<f64>>,
    ) -> Option<Neighbor> {
        let voxel = self.hash.voxel(query)?;
        let index = match *last {
            LastSearch::Nearest(index) if self.voxels[index as usize].voxel == voxel => index,
            _ => self.hash.number(&voxel)?,
        };
        *last = LastSearch::Nearest(index);
        self.partner(index, query, max_distance)
    }

    fn point(&self, index: u32) -> Vector3<f64> {
        self.voxels[index as usize].mean
    }

    fn normal(&self, _index: u32) -> Option<Vector3<f64>> {
        None
    }
}

/// Distance of a point's Gaussian to a voxel's (Koide et al. 2021); the step by Gauss-Newton.
///
/// The residual is scaled to metres as [that of plane to plane](super::factors::PlaneToPlane). A source point without a normal is
/// given the covariance of its voxel.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlaneToVoxel;

/// The inverse of C_target + C_source, scaled by 2e.
#[inline]
fn precision(target: &Matrix3<f64>, source: Option<&Vector3<f64>>) -> Matrix3<f64> {
    let C = target + source.map_or(*target, covariance);
    // Symmetric: six cofactors. Both covariances are positive definite, and the determinant is at least 8 e^3.
    let (xx, xy, xz) = (C.m22 * C.m33 - C.m23 * C.m23, C.m13 * C.m23 - C.m12 * C.m33, C.m12 * C.m23 - C.m13 * C.m22);
    let (yy, yz, zz) = (C.m11 * C.m33 - C.m13 * C.m13, C.m12 * C.m13 - C.m11 * C.m23, C.m11 * C.m22 - C.m12 * C.m12);
    let scale = 2.0 * PLANE_THICKNESS / (C.m11 * xx + C.m12 * xy + C.m13 * xz);
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * scale
}

impl Factor<Pose3, GaussianVoxels> for PlaneToVoxel {
    fn residual(
        &self,
        target: &GaussianVoxels,
        index: u32,
        moved: &Vector3<f64>,
        normal: Option<&Vector3<f64>>,
    ) -> Option<f64> {
        let d = moved - target.point(index);
        Some(d.dot(&(precision(target.covariance(index), normal) * d)).sqrt())
    }

    fn normal_equations(
        &self,
        target: &GaussianVoxels,
        correspondences: &[Correspondence<Vector3<f64>>],
    ) -> NormalEquations<Pose3> {
        let mut sums = NormalEquations::zeros();
        for c in correspondences {
            let weighted = precision(target.covariance(c.target), c.normal.as_ref()) * c.weight;
            let (J, d) = (Pose3::point_jacobian(&c.moved), c.moved - target.point(c.target));
            let projected = weighted * J; // symmetric
            sums.H += J.tr_mul(&projected);
            sums.b += projected.tr_mul(&d);
        }
        sums
    }
}
