//! Maps of planar scans: the local map that a scan is registered to, and the stitched map.

use std::cell::OnceCell;
use std::collections::VecDeque;
use std::rc::Rc;

use glam::Vec3;
use nalgebra::Vector2;

use crate::geometry::{PointCloud, Pose2, RigidMotion};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::factors::{PointToPlane, PointToPoint};
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::free_space::beams::RangeProfile;
use crate::registration::icp::{IcpOptions, Registration, Source, register};
use crate::registration::planar::PlanarMetric;
use crate::registration::target::{OrientedTarget, PointTarget, Target};

/// A registration in the plane.
pub(crate) type PlanarRegistration = Registration<Pose2>;

/// A scan shows something new when it has moved (m) or turned (rad) by so much.
const NEWS: (f64, f64) = (0.15, 0.1);
/// Largest distance between points of the map on one surface (m). Points are interpolated between adjacent beams, so that a
/// source point finds the wall rather than the nearest return, however sparse the beams are.
pub(crate) const SURFACE_SPACING: f64 = 0.1;

/// Whether a scan is taken so far from another one that it shows something new.
pub(crate) fn is_new_view(motion: &Pose2) -> bool {
    motion.translation_norm() > NEWS.0 || motion.rotation_angle() > NEWS.1
}

/// The last few scans in the world frame, to which the next scan is registered.
pub(crate) struct LocalMap {
    capacity: usize,
    metric: PlanarMetric,
    scans: VecDeque<PlacedScan>,
    /// The scans as a registration target; built on first use, dropped when a scan is added.
    target: OnceCell<MapTarget>,
}

struct PlacedScan {
    scan: Rc<PlanarScan>,
    profile: RangeProfile,
    T_world_sensor: Pose2,
    /// Points on its surfaces in the world frame (m), interpolated for point-to-line residuals.
    surface: Vec<Vector2<f64>>,
    /// Normals of these points.
    normals: Vec<Option<Vector2<f64>>>,
}

/// A scan to be registered to a map.
pub(crate) struct QueryScan<'a> {
    scan: &'a PlanarScan,
    profile: RangeProfile,
}

impl<'a> QueryScan<'a> {
    /// Sorts its returns by bearing, once for all poses.
    pub(crate) fn new(scan: &'a PlanarScan) -> Self {
        Self { scan, profile: RangeProfile::new(&scan.points) }
    }

    /// Its returns in its own frame (m).
    pub(crate) fn points(&self) -> &[Vector2<f64>] {
        &self.scan.points
    }
}

enum MapTarget {
    Points(PointTarget<2>),
    Oriented(OrientedTarget<2>),
}

impl LocalMap {
    /// An empty map of at most `capacity` scans (at least one).
    pub(crate) fn new(capacity: usize, metric: PlanarMetric) -> Self {
        Self { capacity: capacity.max(1), metric, scans: VecDeque::new(), target: OnceCell::new() }
    }

    /// Adds a scan, unless it is too near to the last one; removes the oldest when the map is full.
    pub(crate) fn insert(&mut self, scan: Rc<PlanarScan>, T_world_sensor: Pose2) {
        if let Some(last) = self.scans.back().filter(|_| self.capacity > 1) {
            let motion = last.T_world_sensor.inverse() * T_world_sensor;
            if !is_new_view(&motion) {
                return;
            }
        }
        if self.scans.len() == self.capacity {
            self.scans.pop_front();
        }
        let surface = if self.metric == PlanarMetric::PointToLine { scan.surface(SURFACE_SPACING) } else { Vec::new() };
        self.scans.push_back(PlacedScan {
            profile: RangeProfile::new(&scan.points),
            scan,
            T_world_sensor,
            surface: surface.iter().map(|(point, _)| T_world_sensor.act(point)).collect(),
            normals: surface.iter().map(|(_, normal)| normal.map(|normal| T_world_sensor.rotate(&normal))).collect(),
        });
        self.target = OnceCell::new();
    }

    /// Whether nothing has been added.
    pub(crate) fn is_empty(&self) -> bool {
        self.scans.is_empty()
    }

    /// All returns in the world frame (m).
    pub(crate) fn points(&self) -> Vec<Vector2<f64>> {
        let placed = |s: &PlacedScan| s.scan.points.iter().map(|p| s.T_world_sensor.act(p)).collect::<Vec<_>>();
        self.scans.iter().flat_map(placed).collect()
    }

    fn target(&self) -> &MapTarget {
        self.target.get_or_init(|| match self.metric {
            PlanarMetric::PointToPoint => MapTarget::Points(PointTarget::new(self.points())),
            PlanarMetric::PointToLine => {
                let points = self.scans.iter().flat_map(|placed| placed.surface.iter().copied()).collect();
                let normals = self.scans.iter().flat_map(|placed| placed.normals.iter().copied()).collect();
                MapTarget::Oriented(OrientedTarget::new(points, normals))
            }
        })
    }

    /// Its scans with their `T_world_sensor`, the oldest first.
    pub(crate) fn placed(&self) -> impl Iterator<Item = (Rc<PlanarScan>, Pose2)> + '_ {
        self.scans.iter().map(|placed| (Rc::clone(&placed.scan), placed.T_world_sensor))
    }

    /// The target points in the world frame (m), with normals for point to line.
    pub(crate) fn target_points(&self) -> Vec<(Vector2<f64>, Option<Vector2<f64>>)> {
        match self.metric {
            PlanarMetric::PointToPoint => self.points().into_iter().map(|point| (point, None)).collect(),
            PlanarMetric::PointToLine => {
                let surfaces = self.scans.iter().flat_map(|placed| placed.surface.iter().zip(&placed.normals));
                surfaces.map(|(point, normal)| (*point, *normal)).collect()
            }
        }
    }

    /// Registers a scan to the map from an initial `T_world_sensor`.
    pub(crate) fn register(
        &self,
        QueryScan { scan, .. }: &QueryScan,
        guess: Pose2,
        options: &IcpOptions,
    ) -> PlanarRegistration {
        let source = Source { points: &scan.points, normals: Some(&scan.normals), sigmas: None };
        match self.target() {
            MapTarget::Points(target) => register(source, target, guess, &PointToPoint, options),
            MapTarget::Oriented(target) => register(source, target, guess, &PointToPlane, options),
        }
    }

    /// Each point of a scan at a pose with its nearest neighbour within `max_distance` (m), in the world frame.
    pub(crate) fn correspondences(
        &self,
        scan: &PlanarScan,
        T_world_sensor: &Pose2,
        max_distance: f64,
    ) -> Vec<[Vector2<f64>; 2]> {
        let target = PointTarget::new(self.points());
        let moved = scan.points.iter().map(|point| T_world_sensor.act(point));
        moved.filter_map(|p| target.nearest(&p, max_distance).map(|n| [p, target.point(n.index)])).collect()
    }

    /// The free-space test of a scan at a pose against the scans of the map, and of these against it.
    pub(crate) fn free_space(&self, QueryScan { scan, profile }: &QueryScan, T_world_sensor: &Pose2) -> FreeSpaceTally {
        let mut tally = FreeSpaceTally::default();
        for placed in &self.scans {
            let T_placed_sensor = placed.T_world_sensor.inverse() * T_world_sensor;
            tally += placed.profile.tally(scan.points.iter().map(|p| T_placed_sensor.act(p)));
            let T_sensor_placed = T_placed_sensor.inverse();
            tally += profile.tally(placed.scan.points.iter().map(|p| T_sensor_placed.act(p)));
        }
        tally
    }
}

/// All scans in the world frame: the result.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StitchedMap {
    /// Points (m), world frame.
    pub points: Vec<[f32; 2]>,
    /// Index of the scan that each point comes from.
    pub frames: Vec<u32>,
}

impl StitchedMap {
    /// The points of scans, each given with its index and its `T_world_sensor`.
    pub fn new<'a>(placed: impl Iterator<Item = (u32, &'a PlanarScan, Pose2)>) -> Self {
        let placed: Vec<_> = placed.collect();
        let num_points = placed.iter().map(|(_, scan, _)| scan.points.len()).sum();
        let mut map = Self { points: Vec::with_capacity(num_points), frames: Vec::with_capacity(num_points) };
        for (frame, scan, T_world_sensor) in placed {
            for point in &scan.points {
                let point = T_world_sensor.act(point);
                map.points.push([point.x as f32, point.y as f32]);
                map.frames.push(frame);
            }
        }
        map
    }

    /// The map as a cloud in the plane z = 0.
    pub fn to_cloud(&self) -> PointCloud {
        PointCloud::from_positions(self.points.iter().map(|&[x, y]| Vec3::new(x, y, 0.0)).collect())
    }
}
