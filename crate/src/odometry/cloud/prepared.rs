//! A cloud made ready for registration.

use std::cell::OnceCell;

use glam::DVec3;
use nalgebra::Vector3;

use super::options::CloudOptions;
use crate::error::Result;
use crate::geometry::PointCloud;
use crate::preprocess::clean::refuse_map_coordinates;
use crate::preprocess::estimate_normals::estimate_normals;
use crate::preprocess::voxel_downsample::voxel_downsample_from;
use crate::registration::free_space::sphere::SphericalView;
use crate::registration::global::DescribedCloud;
use crate::registration::icp::Source;
use crate::registration::target::OrientedTarget;
use crate::search::KdTree;

/// A cloud made ready: thinned, with normals and an index. Making it is most of the work and needs no other cloud.
pub struct PreparedCloud {
    cloud: PointCloud,
    target: OrientedTarget<3>,
    described: OnceCell<DescribedCloud>,
    view: OnceCell<SphericalView>,
}

impl PreparedCloud {
    /// Thins a cloud (sensor frame) and finds its normals. Normals that it has are not used: they may point anywhere.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(cloud: &PointCloud, options: &CloudOptions) -> Result<Self> {
        options.check()?;
        refuse_map_coordinates(cloud)?;
        let finite = cloud.positions.iter().filter(|p| p.is_finite());
        let lowest = finite.copied().reduce(glam::Vec3::min).unwrap_or_default();
        let corner = lowest.as_dvec3() - 0.5 * options.voxel_size;
        let mut cloud = if cloud.normals.is_some() {
            voxel_downsample_from(&PointCloud { normals: None, ..cloud.clone() }, options.voxel_size, corner)?
        } else {
            voxel_downsample_from(cloud, options.voxel_size, corner)?
        };
        let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
        let normals = estimate_normals(&cloud.positions, &tree, options.normals, options.viewpoint);
        let single = |normal: &Option<Vector3<f64>>| {
            normal.map_or(glam::Vec3::NAN, |n| DVec3::from(<[f64; 3]>::from(n)).as_vec3())
        };
        cloud.normals = Some(normals.iter().map(single).collect());
        Ok(Self::with_tree(cloud, normals, tree))
    }

    /// A cloud made ready before: what [`cloud`](Self::cloud) gave, in another worker perhaps.
    pub fn from_cloud(cloud: PointCloud) -> Self {
        let known =
            |normal: &glam::Vec3| normal.is_finite().then(|| Vector3::from(normal.as_dvec3().to_array()).normalize());
        let none = vec![None; cloud.len()];
        let normals = cloud.normals.as_ref().map_or(none, |normals| normals.iter().map(known).collect());
        let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
        Self::with_tree(cloud, normals, tree)
    }

    fn with_tree(cloud: PointCloud, normals: Vec<Option<Vector3<f64>>>, tree: KdTree<3>) -> Self {
        let points = cloud.positions.iter().map(|p| Vector3::from(p.as_dvec3().to_array())).collect();
        Self {
            target: OrientedTarget::with_tree(points, normals, tree),
            cloud,
            described: OnceCell::new(),
            view: OnceCell::new(),
        }
    }

    /// The thinned points with normals (not a number where there is none) and colours, if the cloud had them.
    pub fn cloud(&self) -> &PointCloud {
        &self.cloud
    }

    /// The points as something to register.
    pub fn source(&self) -> Source<'_, Vector3<f64>> {
        Source { points: self.target.points(), normals: Some(self.target.normals()), sigmas: None }
    }

    /// The points as something to register to.
    pub fn target(&self) -> &OrientedTarget<3> {
        &self.target
    }

    pub(super) fn described(&self, options: &CloudOptions) -> &DescribedCloud {
        self.described.get_or_init(|| {
            let (normals, tree) = (self.target.normals(), self.target.tree());
            DescribedCloud::new(&self.cloud.positions, normals, tree, options.feature_neighbourhood())
        })
    }

    pub(super) fn view(&self, viewpoint: Vector3<f64>) -> &SphericalView {
        self.view.get_or_init(|| SphericalView::new(self.target.points(), viewpoint))
    }

    /// Every so many of its points with a normal, so that there are about `most`.
    pub(super) fn at_most(&self, most: usize) -> Sample {
        let stride = self.target.points().len().div_ceil(most).max(1);
        let every = self.target.points().iter().zip(self.target.normals()).step_by(stride);
        let (points, normals) = every.filter(|(_, normal)| normal.is_some()).map(|(p, n)| (*p, *n)).unzip();
        Sample { points, normals }
    }
}

/// Points with their normals.
pub(super) struct Sample {
    pub(super) points: Vec<Vector3<f64>>,
    pub(super) normals: Vec<Option<Vector3<f64>>>,
}
