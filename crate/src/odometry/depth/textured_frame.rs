//! The textured points of a frame, and the keyframe images they are compared with.

use super::ColorUse;
use super::hypotheses::SAME_POSE_DISTANCE;
use super::reference_map::ReferenceMap;
use crate::geometry::Pose3;
use crate::map::keyframes::Keyframe;
use crate::registration::free_space::FreeSpaceTest;
use crate::registration::photometric::{MIN_POINTS, ReferenceKeyframe, TexturedPoint};
use crate::registration::prepared_surfels::PreparedSurfels;

/// Number of keyframe images that a frame is compared with. With all of those nearby, of the first floor with five strangers in a row 7
/// frames are doubtful and 13 lost (5 lost).
const MAX_REFERENCES: usize = 3;

/// A frame's points with texture.
pub(super) struct TexturedFrame<'a> {
    pub(super) points: &'a [TexturedPoint],
    /// Whether brightness is only used where surfaces do not constrain a direction.
    pub(super) is_for_degenerate_only: bool,
}

impl<'a> TexturedFrame<'a> {
    /// `None` where colours are not to be used, or too few points have texture.
    pub(super) fn new(frame: &'a PreparedSurfels, color: ColorUse) -> Option<Self> {
        let points = if color == ColorUse::NotUsed { &[] } else { &frame.textured[..] };
        let is_for_degenerate_only = color == ColorUse::WhereDegenerate;
        (points.len() >= MIN_POINTS).then_some(Self { points, is_for_degenerate_only })
    }

    /// The keyframe images that show most of the points from about this pose.
    pub(super) fn references<'r>(
        &self,
        reference: &'r ReferenceMap,
        T_world_camera: &Pose3,
    ) -> Vec<ReferenceKeyframe<'r>> {
        let keyframes = reference.keyframes.near(T_world_camera).into_iter();
        let with_visible_points = |keyframe: &'r Keyframe| {
            let picture = keyframe.picture()?;
            let T_keyframe_camera = keyframe.T_world_camera.inverse() * T_world_camera;
            let R = T_keyframe_camera.rotation.to_rotation_matrix().into_inner();
            let t = T_keyframe_camera.translation.vector;
            let is_visible = |&index: &u32| {
                let point = R * self.points[index as usize].point + t;
                // Surfaces are no farther apart than the two poses may be off.
                matches!(keyframe.view().classify(&point, SAME_POSE_DISTANCE), FreeSpaceTest::Agreeing(_))
            };
            let visible: Vec<u32> = (0..self.points.len() as u32).filter(is_visible).collect();
            let T_world_camera = keyframe.T_world_camera;
            (visible.len() >= MIN_POINTS).then_some(ReferenceKeyframe { picture, T_world_camera, visible })
        };
        keyframes.filter_map(with_visible_points).take(MAX_REFERENCES).collect()
    }
}
