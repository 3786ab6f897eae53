//! Everything that can be chosen of voxel odometry, with its defaults.

use serde::{Deserialize, Serialize};

/// How the map is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum MapKind {
    /// Every point that is added stays. Correspondences come from a k-d tree, built anew for each frame.
    Whole,
    /// A few points in a cube of side `map_voxel_size`. Correspondences come from a hash table of cubes, which grows with the map.
    Voxels,
}

/// Which points a full voxel keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum KeptPoint {
    /// Those that came first, as KISS-ICP does.
    First,
    /// Those that came last.
    Newest,
    /// One point, the mean of all.
    Mean,
}

/// Which points of a frame the map is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum AddedPoints {
    /// All.
    All,
    /// Those further than `partner_distance` from every point of the map: what is new ("golden data").
    Unmatched,
}

/// How the sensor may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum VoxelOdometryMotion {
    /// In every way.
    Free,
    /// On a floor; the upright axis is derived from the first frame: y of depth images and of clouds that look like a
    /// camera's view, which lie wholly ahead along z, and z of all other clouds.
    Planar,
    /// In the x-z plane, turning about y: a camera on a floor.
    PlanarXz,
    /// In the x-y plane, turning about z: a robot's own frame.
    PlanarXy,
}

/// How the largest distance of correspondences is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ThresholdKind {
    /// `max_correspondence_distance`, always.
    Fixed,
    /// From how far off the predictions have been (Vizzo et al. 2023), with `max_correspondence_distance` to begin with.
    Adaptive,
}

/// What a correspondence measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum VoxelOdometryMetric {
    /// Distance of the two points, as KISS-ICP does.
    PointToPoint,
    /// Distance to the plane through the map's point.
    PointToPlane,
}

/// In how many stages a frame is registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Stages {
    /// Correspondences within the threshold, to the end, as KISS-ICP does.
    One,
    /// Then once more from there, with near correspondences alone: within three spacings of the frame's points, or one and a half
    /// voxels of the map, whichever is more.
    Two,
}

/// Settings of voxel odometry. The default is a map of voxels of 0.1 m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct VoxelOdometrySettings {
    /// How the map is kept.
    pub map: MapKind,
    /// Side of a voxel of the map (m).
    pub map_voxel_size: f64,
    /// Points that a voxel of the map holds at most.
    pub points_per_voxel: usize,
    /// Which points a full voxel keeps.
    pub kept: KeptPoint,
    /// Which points of a frame the map is given.
    pub added: AddedPoints,
    /// A point within this distance (m) of a point of the map is not new.
    pub partner_distance: f64,
    /// How the sensor may move.
    pub motion: VoxelOdometryMotion,
    /// How the largest distance of correspondences is set.
    pub threshold: ThresholdKind,
    /// Largest distance of correspondences, or the first one if the threshold is adaptive (m).
    pub max_correspondence_distance: f64,
    /// Points of the map further from the sensor are forgotten (m); 0: none is.
    pub crop_distance: f64,
    /// The frame's points are thinned to one in a cube of this side before they are registered (m); 0: all are used. The
    /// map is given all in any case.
    pub source_voxel_size: f64,
    /// What a correspondence measures.
    pub metric: VoxelOdometryMetric,
    /// In how many stages a frame is registered.
    pub stages: Stages,
    /// Most iterations of a stage.
    pub max_iterations: usize,
}

impl Default for VoxelOdometrySettings {
    fn default() -> Self {
        Self {
            map: MapKind::Voxels,
            map_voxel_size: 0.1,
            points_per_voxel: 1,
            kept: KeptPoint::First,
            added: AddedPoints::All,
            partner_distance: 0.1,
            motion: VoxelOdometryMotion::Free,
            threshold: ThresholdKind::Fixed,
            max_correspondence_distance: 1.0,
            crop_distance: 0.0,
            source_voxel_size: 0.1,
            metric: VoxelOdometryMetric::PointToPlane,
            stages: Stages::Two,
            max_iterations: 50,
        }
    }
}
