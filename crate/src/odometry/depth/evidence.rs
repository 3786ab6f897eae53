//! What speaks for a pose and against it: surfaces that agree, and surfaces that stand in free space.

use nalgebra::{Matrix3, Vector3};

use super::reference_map::ReferenceMap;
use crate::geometry::Pose3;
use crate::registration::free_space::{FreeSpaceTally, FreeSpaceTest};
use crate::registration::prepared_surfels::SurfelCloud;
use crate::registration::projective::{PointBatch, ProjectiveTarget};

/// Surfaces agree with a rough guess when they are this near (m), ...
const ROUGH_TOLERANCE: f64 = 0.1;
/// ... and with a refined one when they are this near.
pub(crate) const FINE_TOLERANCE: f64 = 0.03;
/// Surfaces that agree face the same way (cosine).
pub(crate) const AGREEING_COSINE: f64 = 0.8;

/// The evidence for a pose.
pub(super) struct Evidence {
    /// What agrees less what is contradicted, as a share of all.
    pub(super) support: f64,
    /// Share of the frame's surface that lies on the map, 0..=1.
    pub(super) overlap: f64,
    /// Share of what agrees of all that agrees or is contradicted, 0..=1.
    pub(super) agreement: f64,
}

impl Evidence {
    /// The frame's surface (`cloud`) held against the map's view, and the map's against the frame's own view.
    pub(super) fn gather(
        seen: &ReferenceMap,
        view: &ProjectiveTarget,
        cloud: &SurfelCloud,
        own_view: &ProjectiveTarget,
        T_world_camera: &Pose3,
    ) -> Self {
        let (R, t) = parts(T_world_camera);
        let mut frame_in_map = FreeSpaceTally::default();
        let references = seen.keyframes.near(T_world_camera);
        for (point, normal) in cloud.points.iter().zip(&cloud.normals) {
            let (point, normal) = (R * point + t, R * normal);
            match view.classify_leniently(&point, FINE_TOLERANCE).facing(&normal, AGREEING_COSINE) {
                FreeSpaceTest::Agreeing(_) => frame_in_map.agreeing += 1,
                _ if references.iter().any(|reference| reference.saw_through(&point)) => {
                    frame_in_map.in_free_space += 1;
                }
                _ => {}
            }
        }
        let (R, t) = parts(&T_world_camera.inverse());
        let mut map_in_frame = FreeSpaceTally::default();
        for surfel in view.surfels().step_by(view.len().div_ceil(cloud.points.len()).max(1)) {
            let test = own_view.classify_leniently(&(R * surfel.point + t), FINE_TOLERANCE);
            map_in_frame.add(&test.facing(&(R * surfel.normal), AGREEING_COSINE));
        }
        let overlap = frame_in_map.agreeing as f64 / cloud.points.len().max(1) as f64;
        let mut both = frame_in_map;
        both += map_in_frame;
        // What is contradicted counts against a pose more than what fits counts for it: walls fit in many ways.
        let support = (both.agreeing as f64 - 2.0 * both.in_free_space as f64) / (2 * cloud.points.len().max(1)) as f64;
        Self { support, overlap, agreement: both.agreement() }
    }
}

/// What speaks for a guess, cheaply: the share of the points that agree with the view, less those in its free space.
pub(crate) fn score(view: &ProjectiveTarget, point_batch: &PointBatch, T_world_camera: &Pose3) -> f64 {
    let counts = view.tally(point_batch, T_world_camera, ROUGH_TOLERANCE, AGREEING_COSINE as f32);
    (counts.agreeing as f64 - counts.in_free_space as f64) / point_batch.len().max(1) as f64
}

/// The same for points and normals that have been turned already and are moved by `shift`, for many moves with one turn.
/// Surfaces agree when they are within `tolerance` (m).
pub(super) fn score_turned(
    view: &ProjectiveTarget,
    points: &[Vector3<f64>],
    normals: &[Vector3<f64>],
    shift: &Vector3<f64>,
    tolerance: f64,
) -> f64 {
    let mut tally = FreeSpaceTally::default();
    for (point, normal) in points.iter().zip(normals) {
        tally.add(&view.classify(&(point + shift), tolerance).facing(normal, AGREEING_COSINE));
    }
    (tally.agreeing as f64 - tally.in_free_space as f64) / points.len().max(1) as f64
}

fn parts(T: &Pose3) -> (Matrix3<f64>, Vector3<f64>) {
    (T.rotation.to_rotation_matrix().into_inner(), T.translation.vector)
}
