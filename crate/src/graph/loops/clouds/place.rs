//! What is kept of a place along the way of a lidar, and how one is found in another.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Pose3, RigidMotion};
use crate::map::cloud::CloudMap;
use crate::odometry::cloud::{CloudOptions, FREE_SPACE_TOLERANCE, PreparedCloud, ROUGH_POINTS};
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::free_space::sphere::SphericalView;
use crate::registration::icp::Source;
use crate::registration::spatial::{SpatialRegistration, register_in_space};

/// A place is kept in voxels of so many of those of the odometry: a tenth of the memory.
const COARSENESS: f64 = 2.0;

/// The clouds of a stretch of the way, in the frame of the first one.
pub(super) struct Place {
    /// Node of the first cloud.
    pub node: usize,
    points: Vec<Vector3<f32>>,
    normals: Vec<Vector3<f32>>,
    /// Points of the first cloud, ...
    sample: Vec<Vector3<f64>>,
    /// ... and what it saw.
    view: SphericalView,
}

/// A place while it is driven through.
pub(super) struct Stretch {
    place: Place,
    map: CloudMap,
    T_world_first: Pose3,
    pub path_length: f64,
}

/// How well a place fits another one under a motion.
pub(super) struct Fit {
    pub registration: SpatialRegistration,
    /// Share of what both saw that agrees.
    pub agreement: f64,
}

impl Fit {
    /// By which fits are compared: overlap, less twice the share of points that contradict free space, as in the odometry.
    pub fn score(&self) -> f64 {
        self.registration.fitness - 2.0 * (1.0 - self.agreement)
    }
}

/// The options by which places are registered, of those of the odometry.
pub(super) fn options_of_places(options: &CloudOptions) -> CloudOptions {
    let [voxel_size, max_correspondence_distance] =
        [options.voxel_size, options.max_correspondence_distance].map(|length| COARSENESS * length);
    CloudOptions { voxel_size, max_correspondence_distance, ..*options }
}

impl Stretch {
    /// Begins with a cloud, at this path length (m).
    pub fn new(
        node: usize,
        cloud: &PreparedCloud,
        T_world_cloud: Pose3,
        path_length: f64,
        options: &CloudOptions,
    ) -> Self {
        let positions = cloud.cloud().positions.iter();
        let all: Vec<Vector3<f64>> = positions.map(|point| Vector3::from(point.as_dvec3().to_array())).collect();
        let view = SphericalView::new(&all, Vector3::from(options.viewpoint.to_array()));
        let sample = cloud.at_most(ROUGH_POINTS).points;
        let place = Place { node, points: Vec::new(), normals: Vec::new(), sample, view };
        let mut stretch =
            Self { place, map: CloudMap::new(options.voxel_size), T_world_first: T_world_cloud, path_length };
        stretch.add(cloud, &T_world_cloud);
        stretch
    }

    /// Adds a cloud of the stretch.
    pub fn add(&mut self, cloud: &PreparedCloud, T_world_cloud: &Pose3) {
        self.map.insert((0, 0.0), &cloud.source(), &(self.T_world_first.inverse() * T_world_cloud));
    }

    pub fn into_place(self) -> Place {
        let (points, normals) = self.map.points().map(|(point, normal)| (point.cast(), normal.cast())).unzip();
        Place { points, normals, ..self.place }
    }
}

impl Place {
    /// The map of it, as a target.
    pub fn map(&self, options: &CloudOptions) -> CloudMap {
        let mut map = CloudMap::new(options.voxel_size);
        let (points, normals) = self.oriented(1);
        map.insert((0, 0.0), &Source { points: &points, normals: Some(&normals), sigmas: None }, &Pose3::identity());
        map
    }

    /// Every so many of its points, with their normals.
    fn oriented(&self, stride: usize) -> (Vec<Vector3<f64>>, Vec<Option<Vector3<f64>>>) {
        let every = self.points.iter().zip(&self.normals).step_by(stride);
        every.map(|(point, normal)| (point.cast(), Some(normal.cast::<f64>().normalize()))).unzip()
    }

    /// A sample of its points, with their normals.
    pub fn sample(&self) -> (Vec<Vector3<f64>>, Vec<Option<Vector3<f64>>>) {
        self.oriented(self.points.len().div_ceil(ROUGH_POINTS).max(1))
    }

    /// The two directions along which it extends most.
    pub fn ground(&self) -> [Vector3<f64>; 2] {
        let (points, _) = self.sample();
        let mean = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let spread: Matrix3<f64> = points.iter().map(|point| (point - mean) * (point - mean).transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        [1, 2].map(|other| eigen.eigenvectors.column((least + other) % 3).into_owned())
    }

    /// Registers points of another place to the map of this one, from where this motion puts them.
    pub fn fit(
        &self,
        other: &Self,
        target: &CloudMap,
        (points, normals): &(Vec<Vector3<f64>>, Vec<Option<Vector3<f64>>>),
        guess: &Pose3,
        options: &CloudOptions,
    ) -> Fit {
        let source = Source { points, normals: Some(normals), sigmas: None };
        let ((first, finer), solver) = (options.stages(), options.motion.solver());
        let registration = register_in_space(options.metric, source, target, *guess, (&first, &finer), &solver);
        let T = registration.T_target_source;
        let mut tally = FreeSpaceTally::default();
        let tolerance = FREE_SPACE_TOLERANCE * options.voxel_size;
        for (sample, view, T) in [(&other.sample, &self.view, T), (&self.sample, &other.view, T.inverse())] {
            for point in sample {
                tally.add(&view.classify(&T.act(point), tolerance));
            }
        }
        Fit { registration, agreement: tally.agreement() }
    }

    /// The same with all points; `None` where the surfaces leave a direction open.
    pub fn refine(&self, other: &Self, target: &CloudMap, guess: &Pose3, options: &CloudOptions) -> Option<Fit> {
        let fit = self.fit(other, target, &other.oriented(1), guess, options);
        let tolerance = options.max_correspondence_distance;
        let is_open = DegenerateDirection::of(&fit.registration.correspondences, tolerance).is_some();
        (!is_open && !fit.registration.observability.is_undetermined()).then_some(fit)
    }
}
