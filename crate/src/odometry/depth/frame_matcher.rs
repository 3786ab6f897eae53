//! Registration of one frame to the map from an initial pose, by ICP against the map as seen from there.

use nalgebra::Vector6;

use super::DepthOptions;
use super::evidence::{FINE_TOLERANCE, PoseEvidence};
use super::pose_hypothesis::PoseHypothesis;
use super::reference_map::ReferenceMap;
use super::textured_frame::TexturedFrame;
use crate::geometry::Pose3;
use crate::geometry::quantile::quantile;
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::factors::PointToPlane;
use crate::registration::free_space::DepthNoise;
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Weighting, register_with};
use crate::registration::prepared_surfels::{PreparedSurfels, SPARSE_POINTS, SurfelCloud};
use crate::registration::projective::ProjectiveTarget;
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::Solver;
use crate::registration::spatial::SpatialRegistration;

/// A frame that is registered to a reference map.
///
/// This file holds the registration from one initial pose. [`resolve_degeneracy`](super::resolve_degeneracy),
/// [`color`](super::color) and [`register`](super::register) build on it, in this order.
pub(super) struct FrameMatcher<'a> {
    pub(super) reference: &'a ReferenceMap,
    pub(super) frame: &'a PreparedSurfels,
    /// The frame as its own camera sees it: the map's surfaces are compared with it.
    own_view: ProjectiveTarget,
    /// Few points, for scores and rough registrations.
    pub(super) sparse: SurfelCloud,
    /// More points, for evidence and refinement.
    pub(super) middle: SurfelCloud,
    /// The points of the final registration.
    pub(super) fine: SurfelCloud,
    pub(super) solver: Solver<Pose3>,
    noise: DepthNoise,
    /// `None` where colours are not used.
    pub(super) textured: Option<TexturedFrame<'a>>,
}

impl<'a> FrameMatcher<'a> {
    pub(super) fn new(reference: &'a ReferenceMap, frame: &'a PreparedSurfels, options: DepthOptions) -> Self {
        Self {
            reference,
            frame,
            own_view: ProjectiveTarget::of_frame(&frame.image, 1),
            sparse: frame.sparse(),
            middle: frame.middle(),
            fine: frame.fine(),
            solver: options.motion.solver(),
            noise: options.noise,
            textured: TexturedFrame::new(frame, options.color),
        }
    }

    /// The map as seen from a pose.
    pub(super) fn view_from(&self, T_world_view: &Pose3) -> ProjectiveTarget {
        self.reference.map.view(&self.frame.image, T_world_view)
    }

    /// The evidence for a pose.
    pub(super) fn evidence(
        &self,
        view: &ProjectiveTarget,
        cloud: &SurfelCloud,
        T_world_camera: &Pose3,
    ) -> PoseEvidence {
        PoseEvidence::gather(self.reference, view, (cloud, &self.own_view), T_world_camera, self.noise)
    }

    /// A registration of some of the points.
    pub(super) fn register(
        &self,
        view: &ProjectiveTarget,
        cloud: &SurfelCloud,
        guess: Pose3,
        options: &IcpOptions,
    ) -> SpatialRegistration {
        register_with(cloud.source(), view, guess, &PointToPlane, options, &self.solver)
    }

    /// The final registration, with its evidence.
    pub(super) fn register_finely(&self, guess: Pose3) -> PoseHypothesis {
        self.register_finely_by(&self.solver, guess)
    }

    /// The same without motion along a direction.
    pub(super) fn register_across(&self, fixed: &DegenerateDirection, guess: Pose3) -> PoseHypothesis {
        // A rotation about the world's origin translates the camera as well.
        let (rotation, translation) = (guess.translation.vector.cross(&fixed.direction), fixed.direction);
        let along = Vector6::new(rotation.x, rotation.y, rotation.z, translation.x, translation.y, translation.z);
        self.register_finely_by(&self.solver.holding(&along), guess)
    }

    fn register_finely_by(&self, solver: &Solver<Pose3>, guess: Pose3) -> PoseHypothesis {
        let (view, fine) = (self.view_from(&guess), self.fine.source());
        let registration = register_with(fine, &view, guess, &PointToPlane, &self.final_options(), solver);
        let weakest = DegenerateDirection::weakest(&registration.correspondences, &view, FINE_TOLERANCE);
        self.with_evidence(registration, weakest, view)
    }

    /// A registration, perhaps to another reference, with the evidence of this one, whose `view` is from about its pose.
    pub(super) fn with_evidence(
        &self,
        registration: SpatialRegistration,
        weakest: DegenerateDirection,
        view: ProjectiveTarget,
    ) -> PoseHypothesis {
        let evidence = self.evidence(&view, &self.middle, &registration.T_target_source);
        PoseHypothesis::new(registration, weakest, view, &evidence, self.reference.expected_normal_repeatability())
    }

    /// Options of the final registration. It has converged once its steps are smaller than what noise leaves uncertain: no more errors than
    /// those of the sparse points are independent, for stereo matching errs alike over patches of about 20 pixels.
    fn final_options(&self) -> IcpOptions {
        let mut options = fine_options();
        let mut depths: Vec<f64> = self.middle.points.iter().map(|point| point.z).collect();
        if let Some(depth) = quantile(&mut depths, 0.5) {
            let noise = self.noise.square_noise * depth * depth / (SPARSE_POINTS as f64).sqrt();
            let Criteria { rotation_eps, translation_eps, .. } = &mut options.criteria;
            (*rotation_eps, *translation_eps) = (rotation_eps.max(noise / depth), translation_eps.max(noise));
        }
        options
    }
}

/// Options from an initial pose.
pub(super) fn rough_options() -> IcpOptions {
    options((0.4, 0.7), 0.15, Criteria { max_iterations: 8, rotation_eps: 3e-3, translation_eps: 5e-3 })
}

/// Options from a rough registration.
pub(crate) fn middle_options() -> IcpOptions {
    options((0.3, 0.6), 0.08, Criteria { max_iterations: 15, rotation_eps: 1e-3, translation_eps: 2e-3 })
}

/// Options of the final registration.
pub(crate) fn fine_options() -> IcpOptions {
    options((0.15, 0.5), 0.03, Criteria { max_iterations: 30, rotation_eps: 1e-4, translation_eps: 1e-4 })
}

/// With the largest distance (m) and angle (rad) of correspondences, the kernel's width (m), and the stopping criteria.
fn options(
    (max_correspondence_distance, max_normal_angle): (f64, f64),
    robust_kernel_width: f64,
    criteria: Criteria,
) -> IcpOptions {
    IcpOptions {
        rejection: Rejection { max_correspondence_distance, max_normal_angle, trim_fraction: 0.0 },
        weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width },
        criteria,
    }
}
