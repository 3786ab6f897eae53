//! A cloud prepared for registration.

use std::cell::OnceCell;

use glam::DVec3;
use nalgebra::Vector3;

use super::options::CloudOptions;
use crate::error::Result;
use crate::geometry::PointCloud;
use crate::preprocess::clean::refuse_map_coordinates;
use crate::preprocess::estimate_normals::{estimate_clear_normals, estimate_normals};
use crate::preprocess::voxel_downsample::{voxel_downsample, voxel_downsample_from, voxel_downsample_twice};
use crate::registration::free_space::sphere::SphericalView;
use crate::registration::global::DescribedCloud;
use crate::registration::global::scale::feature_neighborhood;
use crate::registration::icp::Source;
use crate::registration::target::OrientedTarget;
use crate::search::KdTree;

/// A downsampled cloud with normals. Preparing it is most of the work and needs no other cloud.
pub struct PreparedCloud {
    /// With normals: zero for points that are not registered, not a number where a registered one has none.
    cloud: PointCloud,
    /// The registered points ...
    points: Vec<Vector3<f64>>,
    /// ... and their unit normals.
    normals: Vec<Option<Vector3<f64>>>,
    target: OnceCell<OrientedTarget<3>>,
    described: OnceCell<Described>,
    view: OnceCell<SphericalView>,
}

/// The golden ratio: its multiples fall evenly between whole numbers, whatever the period of the points, as that of a lidar's rings.
const GOLDEN_RATIO: f64 = 0.618_033_988_749_895;

/// Relative difference of sides of voxels that are the same, computed in double precision in another order.
const SAME_SIZE: f64 = 1e-12;

impl PreparedCloud {
    /// Downsamples a cloud (sensor frame) and estimates its normals; its own are ignored, as their orientation is unknown.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(cloud: &PointCloud, options: &CloudOptions) -> Result<Self> {
        Ok(Self::with_normals(Self::downsampled(cloud, options)?, options))
    }

    /// The points that [`new`](Self::new) keeps of a cloud, without normals.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn downsampled(cloud: &PointCloud, options: &CloudOptions) -> Result<PointCloud> {
        let corner = Self::corner(cloud, options)?;
        if cloud.normals.is_some() {
            return voxel_downsample_from(&PointCloud { normals: None, ..cloud.clone() }, options.voxel_size, corner);
        }
        voxel_downsample_from(cloud, options.voxel_size, corner)
    }

    /// The [`downsampled`](Self::downsampled) cloud, and one of smaller voxels of this side (m) with the cloud's own normals.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub(crate) fn downsampled_twice(
        cloud: &PointCloud,
        options: &CloudOptions,
        part_size: f64,
    ) -> Result<(PointCloud, PointCloud)> {
        let parts = (options.voxel_size / part_size).round();
        if (parts * part_size - options.voxel_size).abs() > SAME_SIZE * options.voxel_size {
            return Ok((Self::downsampled(cloud, options)?, voxel_downsample(cloud, part_size)?));
        }
        let corner = Self::corner(cloud, options)?;
        let (whole, fine) = voxel_downsample_twice(cloud, (options.voxel_size, parts as i32), corner)?;
        Ok((PointCloud { normals: None, ..whole }, fine))
    }

    /// A corner of the voxels (m).
    fn corner(cloud: &PointCloud, options: &CloudOptions) -> Result<DVec3> {
        options.check()?;
        refuse_map_coordinates(cloud)?;
        let finite = cloud.positions.iter().filter(|p| p.is_finite());
        let lowest = finite.copied().reduce(glam::Vec3::min).unwrap_or_default();
        Ok(lowest.as_dvec3() - 0.5 * options.voxel_size)
    }

    /// Estimates the normals of the points to be registered of a cloud that is [`downsampled`](Self::downsampled).
    pub(crate) fn with_normals(mut cloud: PointCloud, options: &CloudOptions) -> Self {
        let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
        let chosen = evenly_chosen(cloud.len(), options.max_points);
        let normals = if options.clear_normals {
            estimate_clear_normals(&cloud.positions, &tree, &chosen, options.normals, options.viewpoint)
        } else {
            let all = estimate_normals(&cloud.positions, &tree, options.normals, options.viewpoint);
            chosen.iter().map(|&point| all[point]).collect()
        };
        let mut single = vec![glam::Vec3::ZERO; cloud.len()];
        for (&point, normal) in chosen.iter().zip(&normals) {
            single[point] = normal.map_or(glam::Vec3::NAN, |n| DVec3::from(<[f64; 3]>::from(n)).as_vec3());
        }
        cloud.normals = Some(single);
        Self::of_chosen(cloud, &chosen, normals)
    }

    /// From a cloud that was prepared before, as [`cloud`](Self::cloud) gives it, possibly in another worker.
    pub fn from_cloud(cloud: PointCloud) -> Self {
        let given = |point: usize| cloud.normals.as_ref().map_or(glam::Vec3::NAN, |normals| normals[point]);
        let chosen: Vec<usize> = (0..cloud.len()).filter(|&point| given(point) != glam::Vec3::ZERO).collect();
        let known = |&point: &usize| {
            let normal = given(point);
            normal.is_finite().then(|| Vector3::from(normal.as_dvec3().to_array()).normalize())
        };
        let normals = chosen.iter().map(known).collect();
        Self::of_chosen(cloud, &chosen, normals)
    }

    fn of_chosen(cloud: PointCloud, chosen: &[usize], normals: Vec<Option<Vector3<f64>>>) -> Self {
        let points = chosen.iter().map(|&point| double(&cloud.positions[point])).collect();
        Self { cloud, points, normals, target: OnceCell::new(), described: OnceCell::new(), view: OnceCell::new() }
    }

    /// The downsampled points with normals (NaN where there is none, zero where the point is not registered), and with the colours of
    /// the cloud, if any.
    pub fn cloud(&self) -> &PointCloud {
        &self.cloud
    }

    /// The indices of the registered points in that cloud, in the order of the [`source`](Self::source).
    pub(super) fn registered(&self) -> Vec<usize> {
        let normals = self.cloud.normals.iter().flatten().enumerate();
        normals.filter(|(_, normal)| **normal != glam::Vec3::ZERO).map(|(point, _)| point).collect()
    }

    /// The same cloud, where nothing else is needed any more.
    pub fn into_cloud(self) -> PointCloud {
        self.cloud
    }

    /// The points as the source of a registration.
    pub fn source(&self) -> Source<'_, Vector3<f64>> {
        Source { points: &self.points, normals: Some(&self.normals), sigmas: None }
    }

    /// The points as the target of a registration.
    pub fn target(&self) -> &OrientedTarget<3> {
        self.target.get_or_init(|| OrientedTarget::new(self.points.clone(), self.normals.clone()))
    }

    /// Number of registered points that have a normal.
    pub(super) fn num_oriented(&self) -> usize {
        self.normals.iter().flatten().count()
    }

    /// What a global registration compares, in voxels of this side (m), the same in each call.
    pub(super) fn described(&self, options: &CloudOptions, voxel_size: f64) -> &Described {
        self.described.get_or_init(|| Described::new(self, options, voxel_size))
    }

    pub(super) fn view(&self, viewpoint: Vector3<f64>) -> &SphericalView {
        let points = || self.cloud.positions.iter().map(double).collect::<Vec<_>>();
        self.view.get_or_init(|| SphericalView::new(&points(), viewpoint))
    }

    /// At most `most` of its points, in equal steps by index; of these, the points that have a normal.
    pub(crate) fn at_most(&self, most: usize) -> Sample {
        let stride = self.points.len().div_ceil(most).max(1);
        let every = self.points.iter().zip(&self.normals).step_by(stride);
        let (points, normals) = every.filter(|(_, normal)| normal.is_some()).map(|(p, n)| (*p, *n)).unzip();
        Sample { points, normals }
    }
}

/// At most `most` of `count` points, evenly spread over their order.
pub(crate) fn evenly_chosen(count: usize, most: usize) -> Vec<usize> {
    let share = most as f64 / count.max(1) as f64;
    (0..count).filter(|&point| (GOLDEN_RATIO * point as f64).fract() < share).collect()
}

fn double(point: &glam::Vec3) -> Vector3<f64> {
    Vector3::from(point.as_dvec3().to_array())
}

/// Points with features, and an index of them.
pub(super) struct Described {
    pub(super) cloud: DescribedCloud,
    /// Of the described points; `None` where these are all points of the cloud.
    tree: Option<KdTree<3>>,
}

impl Described {
    fn new(prepared: &PreparedCloud, options: &CloudOptions, voxel_size: f64) -> Self {
        let around = feature_neighborhood(voxel_size);
        let is_whole = prepared.points.len() == prepared.cloud.len();
        let coarse = (voxel_size > options.voxel_size).then(|| voxel_downsample(&prepared.cloud, voxel_size).ok());
        let Some(coarse) = coarse.flatten().or_else(|| (!is_whole).then(|| prepared.cloud.clone())) else {
            let (normals, tree) = (&prepared.normals, prepared.target().tree());
            let cloud = DescribedCloud::new(&prepared.cloud.positions, normals, tree, around);
            return Self { cloud, tree: None };
        };
        let tree = KdTree::build(bytemuck::cast_slice(&coarse.positions));
        let normals = estimate_normals(&coarse.positions, &tree, options.normals, options.viewpoint);
        Self { cloud: DescribedCloud::new(&coarse.positions, &normals, &tree, around), tree: Some(tree) }
    }

    /// The index of the described points of this cloud.
    pub(super) fn tree<'a>(&'a self, prepared: &'a PreparedCloud) -> &'a KdTree<3> {
        self.tree.as_ref().unwrap_or_else(|| prepared.target().tree())
    }
}

/// Points with their normals.
pub(crate) struct Sample {
    pub(crate) points: Vec<Vector3<f64>>,
    pub(crate) normals: Vec<Option<Vector3<f64>>>,
}

impl Sample {
    pub(super) fn source(&self) -> Source<'_, Vector3<f64>> {
        Source { points: &self.points, normals: Some(&self.normals), sigmas: None }
    }
}
