//! The evidence for and against a pose: surfaces that agree, and surfaces in space that was seen to be free.

use nalgebra::Vector3;

use super::reference_map::ReferenceMap;
use crate::geometry::Pose3;
use crate::geometry::rotation::rotation_and_translation;
use crate::map::surfel::SAME_SURFACE_DISTANCE;
use crate::odometry::assessment::Limits;
use crate::registration::free_space::{DepthNoise, FreeSpaceTally, FreeSpaceTest};
use crate::registration::prepared_surfels::SurfelCloud;
use crate::registration::projective::{PointBatch, ProjectiveTarget};

/// Distance along the normal up to which surfaces agree for an initial pose (m).
pub(super) const ROUGH_TOLERANCE: f64 = 0.1;
/// The same for a refined pose (m), as of surfels that are one surface of the map.
pub(crate) const FINE_TOLERANCE: f64 = SAME_SURFACE_DISTANCE;
/// Cosine between the normals of two surfaces above which they can agree.
const AGREEING_COSINE: f64 = 0.8;
/// Points of the first score of a pose: hundreds to thousands of poses are scored.
pub(super) const NUM_SCORED_POINTS: usize = 80;
/// Weight of a contradicting surface relative to an agreeing one: walls agree in many poses.
const CONTRADICTION_WEIGHT: f64 = 2.0;
/// Difference in agreement (0..=1) by which one position is told from another.
pub(crate) const MIN_AGREEMENT_DIFFERENCE: f64 = 0.01;
/// Photometric correlation (-1..=1) below which the light or the place differs.
pub(super) const MIN_NCC: f64 = 0.6;
/// The best position is distinct from another if it leaves less unexplained (1 - correlation) by this factor: images of one place
/// seldom differ as much.
const UNEXPLAINED_RATIO: f64 = 3.0;
/// A frame that hardly overlaps the map is lost. On recordings with up to three of four frames left out, correct registrations
/// agree by 0.95 to 1, and those that are off by half a metre mostly by less than 0.9. A doubtful frame is not added to the map.
pub(crate) const LIMITS: Limits =
    Limits { lost_overlap: 0.1, lost_agreement: 0.85, doubtful_agreement: 0.95, ..Limits::NONE };

/// The evidence for a pose.
pub(super) struct PoseEvidence {
    /// Agreeing less contradicting surface, as a share of all.
    pub(super) support: f64,
    /// Share of the frame's surface that lies on the map, 0..=1.
    pub(super) overlap: f64,
    /// Agreeing surface as a share of the agreeing and contradicting, 0..=1.
    pub(super) agreement: f64,
    /// Of the frame's points that lie on a surface of the map, the share (0..=1) whose normals agree with it.
    pub(super) normal_repeatability: f64,
}

impl PoseEvidence {
    /// Whether a frame at this pose is lost.
    pub(super) fn is_lost(&self) -> bool {
        self.overlap < LIMITS.lost_overlap || self.agreement < LIMITS.lost_agreement
    }

    /// Compares the frame's surface (`cloud`) with the view of the map and the keyframes' free space, and the view's surface
    /// with the frame's own view.
    pub(super) fn gather(
        reference: &ReferenceMap,
        view: &ProjectiveTarget,
        (cloud, own_view): (&SurfelCloud, &ProjectiveTarget),
        T_world_camera: &Pose3,
        noise: DepthNoise,
    ) -> Self {
        let keyframes = reference.keyframes.near(T_world_camera);
        let saw_through = |point: &Vector3<f64>| keyframes.iter().any(|keyframe| keyframe.saw_through(point, noise));
        let num_points = cloud.points.len();
        let compared = ComparedSurfaces::of(view, (cloud, own_view), T_world_camera, noise, num_points, saw_through);
        let ComparedSurfaces { frame_in_map, num_on_map, .. } = compared;
        let both = compared.both();
        let support =
            (both.agreeing as f64 - CONTRADICTION_WEIGHT * both.in_free_space as f64) / (2 * num_points.max(1)) as f64;
        let normal_repeatability = frame_in_map.agreeing as f64 / num_on_map.max(1) as f64;
        let overlap = frame_in_map.agreeing as f64 / num_points.max(1) as f64;
        Self { support, overlap, agreement: both.agreement(), normal_repeatability }
    }
}

/// A frame's surfaces compared with a map's at a pose, and the map's with the frame's.
pub(crate) struct ComparedSurfaces {
    /// The frame's surfaces in the map and its free space.
    pub(crate) frame_in_map: FreeSpaceTally,
    /// The map's surfaces in the frame's own view.
    map_in_frame: FreeSpaceTally,
    /// Points of the frame on a surface of the map, whichever way that faces.
    num_on_map: usize,
}

impl ComparedSurfaces {
    /// Of the frame's `cloud` with the `view` of the map, and of about `num_of_map` surfaces of that view with the frame's own view.
    /// `saw_through` says of a point in the world whether the map has seen that it is in free space.
    pub(crate) fn of(
        view: &ProjectiveTarget,
        (cloud, own_view): (&SurfelCloud, &ProjectiveTarget),
        T_world_camera: &Pose3,
        noise: DepthNoise,
        num_of_map: usize,
        saw_through: impl Fn(&Vector3<f64>) -> bool,
    ) -> Self {
        let (mut frame_in_map, mut map_in_frame, mut num_on_map) =
            (FreeSpaceTally::default(), FreeSpaceTally::default(), 0);
        let (R, t) = rotation_and_translation(T_world_camera);
        for (point, normal) in cloud.points.iter().zip(&cloud.normals) {
            let tolerance = noise.tolerance(FINE_TOLERANCE, point.z);
            let (point, normal) = (R * point + t, R * normal);
            let test = view.classify_leniently(&point, tolerance);
            num_on_map += usize::from(matches!(test, FreeSpaceTest::Agreeing(_)));
            match test.facing(&normal, AGREEING_COSINE) {
                FreeSpaceTest::Agreeing(_) => frame_in_map.agreeing += 1,
                _ if saw_through(&point) => frame_in_map.in_free_space += 1,
                _ => {}
            }
        }
        let (R, t) = rotation_and_translation(&T_world_camera.inverse());
        for surfel in view.surfels().step_by(view.len().div_ceil(num_of_map.max(1)).max(1)) {
            let point = R * surfel.point + t;
            let test = own_view.classify_leniently(&point, noise.tolerance(FINE_TOLERANCE, point.z));
            map_in_frame.add(&test.facing(&(R * surfel.normal), AGREEING_COSINE));
        }
        Self { frame_in_map, map_in_frame, num_on_map }
    }

    /// Both ways together.
    pub(crate) fn both(&self) -> FreeSpaceTally {
        let mut both = self.frame_in_map;
        both += self.map_in_frame;
        both
    }
}

/// A fast score of a pose, -1..=1: the share of points that agree with the view less the share in its free space.
pub(super) fn score(view: &ProjectiveTarget, point_batch: &PointBatch, T_world_camera: &Pose3) -> f64 {
    score_within(view, point_batch, T_world_camera, ROUGH_TOLERANCE)
}

/// The same where surfaces agree when they are within `tolerance` (m).
pub(super) fn score_within(
    view: &ProjectiveTarget,
    point_batch: &PointBatch,
    T_world_camera: &Pose3,
    tolerance: f64,
) -> f64 {
    let counts = view.tally(point_batch, T_world_camera, tolerance, AGREEING_COSINE as f32);
    (counts.agreeing as f64 - counts.in_free_space as f64) / point_batch.len().max(1) as f64
}

/// Whether a photometric correlation tells a place from others.
pub(super) fn is_same_place(ncc: f64) -> bool {
    is_distinct(ncc, MIN_NCC)
}

/// Whether a correlation distinguishes a position from another one with a correlation nearly as high.
pub(super) fn is_distinct(ncc: f64, other_ncc: f64) -> bool {
    1.0 - other_ncc > UNEXPLAINED_RATIO * (1.0 - ncc)
}
