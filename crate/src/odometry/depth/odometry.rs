//! The odometry itself: the chain of frames, its rival, and the frames that wait for relocalization.

mod relocalize;
mod rival_chain;

use self::relocalize::RelocalizationRounds;
use self::rival_chain::RivalChain;
use super::chain::{Chain, Member, Proposal, UnresolvedFrames};
use super::estimate::{PoseUpdate, SpatialEstimate};
use super::unregistered_frames::UnregisteredFrames;
use super::{ColorUse, DepthOptions};
use crate::geometry::Pose3;
use crate::preprocess::color_registration::OutlineContrast;
use crate::registration::prepared_surfels::{PreparedSurfels, SPARSE_POINTS};

/// Frame-to-map odometry in space. The world frame is the frame of the first camera.
#[derive(Clone)]
pub struct DepthOdometry {
    /// As given; colours are left out from the frame on that shows that they do not belong to the depth's pixels.
    options: DepthOptions,
    /// Whether the colours belong to the depth's pixels, as all frames tell until they are found not to.
    outline_contrast: OutlineContrast,
    /// Frames registered so far; also the number of the next one.
    num_frames: u32,
    /// The frames that are in the map, and their map; `None` before the first frame with enough surfaces.
    chain: Option<Chain>,
    /// The frames since the last one of the chain that fit each other; fewer than in the chain, for as the majority they replace it.
    rival_chain: Option<RivalChain>,
    /// The latest frames that are not in the map, or may be removed from it.
    unregistered_frames: UnregisteredFrames,
    /// Changes of earlier frames that have not been taken yet, in the order in which they arose.
    pose_updates: Vec<PoseUpdate>,
    /// Relocalization after the last frame; `None` while frames follow.
    rounds: Option<RelocalizationRounds>,
}

impl DepthOdometry {
    /// Odometry without frames.
    pub fn new(options: DepthOptions) -> Self {
        Self {
            options,
            outline_contrast: OutlineContrast::default(),
            num_frames: 0,
            chain: None,
            rival_chain: None,
            unregistered_frames: UnregisteredFrames::default(),
            pose_updates: Vec::new(),
            rounds: None,
        }
    }

    /// Registers the next frame. A frame that is lost or contradicted is not added to the map; the next one is predicted from
    /// the last registered frame. This is the whole way of a frame: each step is in the file of its name, most in `chain`.
    ///
    /// [`take_pose_updates`](Self::take_pose_updates) then returns the consequences for earlier frames.
    pub fn register_frame(&mut self, frame: &PreparedSurfels) -> SpatialEstimate {
        let (number, num_surfels) = (self.num_frames, frame.image.surfels().count());
        (self.num_frames, self.rounds) = (number + 1, None);
        if num_surfels < SPARSE_POINTS {
            return self.too_few_surfels(num_surfels);
        }
        self.check_colors(frame);
        let Some(chain) = &mut self.chain else { return self.begin_chain(number, frame) };
        let matcher = chain.matcher(frame);

        // Predict, propose and register.
        let near = chain.search_near_prediction(&matcher);
        let proposal = if chain.needs_no_wider_search(&near) {
            Proposal::InMap(chain.apply_motion_prior(&matcher, near))
        } else if let Some(tracked) = chain.track(frame, &matcher, &near) {
            tracked
        } else if chain.goes_on(&near) {
            Proposal::InMap(near)
        } else {
            Proposal::InMap(chain.search_wider(&matcher, near))
        };

        let mut dropped = Vec::new();
        let decision = chain.assess(&matcher, proposal);
        let mut estimate = chain.conclude(number, frame, decision, &mut dropped);

        self.pose_updates.extend(dropped.iter().map(Member::pose_update));
        self.reassess(number, &mut estimate);
        if !estimate.is_in_map {
            self.unregistered_frames.push(number, frame, &estimate);
            return self.extend_rival_chain(number, frame, &estimate).unwrap_or(estimate);
        }
        self.note_unregistered(number, frame, &estimate);
        estimate
    }

    /// Whether the colours are not those of the depth's pixels; they are not used then.
    pub fn has_misaligned_colors(&self) -> bool {
        self.outline_contrast.is_misaligned()
    }

    /// The frames with uncertain positions that no later frame has resolved so far; the frames after them share their error.
    pub fn unresolved(&self) -> Option<UnresolvedFrames> {
        self.chain.as_ref().and_then(Chain::unresolved)
    }

    /// Whether a frame fitted about as well at another position within reach of the camera.
    pub fn surfaces_repeat(&self) -> bool {
        self.chain.as_ref().is_some_and(Chain::surfaces_repeat)
    }

    /// The changes of earlier frames since the last call, in the order in which they arose.
    pub fn take_pose_updates(&mut self) -> Vec<PoseUpdate> {
        std::mem::take(&mut self.pose_updates)
    }

    /// Moves each frame's content by `motion` (of the world) of its number, frames being counted from 0. The prediction for
    /// the next frame moves with the last one.
    pub fn apply_corrections(&mut self, motion: impl Fn(u32) -> Pose3) {
        if let Some(chain) = &mut self.chain {
            chain.apply_corrections(&motion);
        }
        if let Some(rival_chain) = &mut self.rival_chain {
            rival_chain.apply_corrections(&motion);
        }
        self.unregistered_frames.apply_corrections(&motion);
    }

    /// Assesses the members anew, of which this frame may be one.
    fn reassess(&mut self, number: u32, estimate: &mut SpatialEstimate) {
        for member in self.chain.iter_mut().flat_map(Chain::reassess) {
            if member.number == number {
                estimate.assessment = member.assessment;
            } else {
                self.pose_updates.push(member.pose_update());
            }
        }
    }

    /// Leaves colours out once they turn out not to belong to the depth's pixels.
    fn check_colors(&mut self, frame: &PreparedSurfels) {
        if self.has_misaligned_colors() {
            // Frames after the decision have been prepared without colours, or ahead of it with them.
            return;
        }
        self.outline_contrast += frame.outline_contrast;
        if self.has_misaligned_colors() {
            self.options.color = ColorUse::NotUsed;
            let rival_chain = self.rival_chain.as_mut().map(|rival| &mut rival.chain);
            for chain in self.chain.iter_mut().chain(rival_chain) {
                chain.disregard_colors();
            }
        }
    }

    fn begin_chain(&mut self, number: u32, frame: &PreparedSurfels) -> SpatialEstimate {
        let (chain, estimate) = Chain::new(self.options, number, frame);
        self.chain = Some(chain);
        estimate
    }

    fn too_few_surfels(&mut self, num_surfels: usize) -> SpatialEstimate {
        let reason = format!("it has {num_surfels} surface elements (surfels), too few to register it");
        let rival_chain = self.rival_chain.as_mut().map(|rival| &mut rival.chain);
        for chain in self.chain.iter_mut().chain(rival_chain) {
            chain.count_rejected();
        }
        match &self.chain {
            Some(chain) => chain.lost(reason, 0.0),
            None => SpatialEstimate::lost(Pose3::identity(), reason, 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{DepthImage, Pinhole};
    use crate::odometry::assessment::Status;
    use crate::preprocess::depth_surfels::{DepthModel, depth_surfels};

    /// A wavy wall 2 m away, of which the camera sees this share from the left.
    fn wall(share: f64) -> PreparedSurfels {
        let camera = Pinhole::from_field_of_view(320, 240, 1.2).unwrap();
        let depth = |pixel: usize| {
            let (column, row) = ((pixel % 320) as f64, (pixel / 320) as f64);
            let depth = 2000.0 + 200.0 * (column / 50.0).sin() + 150.0 * (row / 40.0).cos();
            if column < share * 320.0 { depth as u16 } else { 0 }
        };
        let image = DepthImage { width: 320, height: 240, bits: 16, values: (0..320 * 240).map(depth).collect() };
        let model = DepthModel { step: 1e-3, offset: 0.0, square_noise: 1e-3, min_range: 0.1, max_range: 10.0 };
        let usable = vec![true; image.values.len()];
        DepthOptions::default().prepared(depth_surfels(&image, &usable, &camera, &model))
    }

    #[test]
    fn a_covered_camera_may_have_moved_until_it_sees_again() {
        let mut odometry = DepthOdometry::new(DepthOptions::default());
        let gap = |odometry: &DepthOdometry| odometry.chain.as_ref().map(Chain::num_rejected);
        assert!(odometry.register_frame(&wall(1.0)).is_in_map);
        for num_covered in 1..=3 {
            let covered = odometry.register_frame(&wall(0.02));
            assert_eq!((covered.assessment.status, gap(&odometry)), (Status::Lost, Some(num_covered)));
        }
        assert!(odometry.register_frame(&wall(1.0)).is_in_map);
        assert_eq!(gap(&odometry), Some(0));
    }
}
