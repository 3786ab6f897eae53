//! A submap: what a few frames saw. Another frame is registered to it, and accepted or not.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::{Matrix6, Vector3};

use crate::geometry::Pose3;
use crate::odometry::depth::{
    ComparedSurfaces, FINE_TOLERANCE, LIMITS, MOSTLY_MAPPED_OVERLAP, fine_options, middle_options,
};
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::factors::PointToPlane;
use crate::registration::free_space::{DepthNoise, FreeSpaceTest};
use crate::registration::icp::{IcpOptions, Source, register_with};
use crate::registration::prepared_surfels::{PreparedSurfels, SUBMAP_POINTS, SurfelCloud};
use crate::registration::projective::{PackedSurfel, ProjectiveTarget, SurfelRasterizer};
use crate::registration::solver::Solver;
use crate::registration::spatial::SpatialRegistration;

/// A frame's surfaces for registration to submaps, and as part of submaps.
#[derive(Clone)]
pub(super) struct FrameSurfaces {
    pub(super) source: SurfelCloud,
    /// In the camera's own frame, at half the resolution.
    pub(super) view: ProjectiveTarget,
    /// The surfels of the view, each with its cell.
    pub(super) surfels: Arc<Vec<PackedSurfel>>,
}

/// What one frame of a submap saw.
pub(super) struct SubmapFrame<'a> {
    pub(super) view: Cow<'a, ProjectiveTarget>,
    /// The surfels of the view, in the camera's own frame.
    pub(super) surfels: &'a [PackedSurfel],
}

/// The accepted registration of a frame to a submap.
pub(super) struct SubmapRegistration {
    pub(super) T_submap_camera: Pose3,
    /// By a perturbation on the left of the pose, rotation first (1/rad^2, 1/m^2).
    pub(super) information: Matrix6<f64>,
}

/// A few frames, each with its pose in the submap.
pub(super) struct Submap<'a> {
    frames: Vec<(SubmapFrame<'a>, Pose3)>,
}

impl FrameSurfaces {
    pub(super) fn new(frame: &PreparedSurfels) -> Self {
        Self { source: frame.for_submap(), view: frame.coarse_view(), surfels: frame.coarse.clone() }
    }
}

impl<'a> Submap<'a> {
    /// From frames with their poses `T_submap_camera`.
    pub(super) fn new(frames: Vec<(SubmapFrame<'a>, Pose3)>) -> Self {
        Self { frames }
    }

    /// Registers a frame with wide limits for correspondences (a quarter of a metre), then with narrow ones in the view from the
    /// result; `None` where that is not accepted.
    pub(super) fn register_coarse_to_fine(&self, frame: &FrameSurfaces, guess: &Pose3) -> Option<SubmapRegistration> {
        let view = self.view_from(guess, frame);
        self.register_finely(frame, register(frame, &view, *guess, &middle_options()).T_target_source)
    }

    /// Registers a frame some centimetres from a guess; `None` where that is not accepted.
    pub(super) fn register_finely(&self, frame: &FrameSurfaces, guess: Pose3) -> Option<SubmapRegistration> {
        let view = self.view_from(&guess, frame);
        let registration = register(frame, &view, guess, &fine_options());
        let T_submap_camera = registration.T_target_source;
        let (overlap, agreement) = self.evidence(frame, &view, &T_submap_camera);
        let is_accepted = overlap > MOSTLY_MAPPED_OVERLAP / 2.0 && agreement > LIMITS.doubtful_agreement;
        (is_accepted && DegenerateDirection::of(&registration.correspondences, FINE_TOLERANCE).is_none())
            .then_some(SubmapRegistration { T_submap_camera, information: registration.information })
    }

    /// Overlap and agreement of a frame at a pose.
    pub(super) fn fit(&self, frame: &FrameSurfaces, T_submap_camera: &Pose3) -> (f64, f64) {
        self.evidence(frame, &self.view_from(T_submap_camera, frame), T_submap_camera)
    }

    fn view_from(&self, T_submap_view: &Pose3, frame: &FrameSurfaces) -> ProjectiveTarget {
        let mut rasterizer = SurfelRasterizer::new(frame.view.camera(), T_submap_view);
        for (seen, T_submap_camera) in &self.frames {
            rasterizer.add_moved(0, seen.surfels, T_submap_camera);
        }
        rasterizer.finish()
    }

    /// Overlap and agreement: the frame's surface compared with the submap's, where any of its frames saw free space, and the
    /// submap's surface compared with the frame's view.
    fn evidence(&self, frame: &FrameSurfaces, view: &ProjectiveTarget, T_submap_camera: &Pose3) -> (f64, f64) {
        let views: Vec<(&ProjectiveTarget, Pose3)> =
            self.frames.iter().map(|(seen, T)| (&*seen.view, T.inverse())).collect();
        let is_in_free_space = |point: &Vector3<f64>| {
            let saw_through = |(view, T): &(&ProjectiveTarget, Pose3)| {
                let point = T.transform_point(&(*point).into()).coords;
                matches!(view.classify_leniently(&point, FINE_TOLERANCE), FreeSpaceTest::InFreeSpace)
            };
            views.iter().any(saw_through)
        };
        let noise = DepthNoise::default(); // the tolerance is the same at every depth
        let frame_surfaces = (&frame.source, &frame.view);
        let compared =
            ComparedSurfaces::of(view, frame_surfaces, T_submap_camera, noise, SUBMAP_POINTS, is_in_free_space);
        let overlap = compared.frame_in_map.agreeing as f64 / frame.source.points.len().max(1) as f64;
        (overlap, compared.both().agreement())
    }
}

fn register(frame: &FrameSurfaces, view: &ProjectiveTarget, guess: Pose3, options: &IcpOptions) -> SpatialRegistration {
    // All count alike: what is far away tells the position along a corridor, however noisy it is.
    let source = Source { sigmas: None, ..frame.source.source() };
    register_with(source, view, guess, &PointToPlane, options, &Solver::default())
}
