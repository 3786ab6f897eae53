//! A frame that is looked for in what a few other frames saw: where it stands among them, and whether that is believed.

use std::borrow::Cow;

use nalgebra::{Matrix3, Matrix6, Vector3};

use crate::geometry::Pose3;
use crate::odometry::depth::{
    AGREEING_COSINE, FINE_TOLERANCE, best_distinct, fine_options, grid_around, middle_options, score,
};
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::factors::PointToPlane;
use crate::registration::free_space::{FreeSpaceTally, FreeSpaceTest};
use crate::registration::icp::{IcpOptions, register_with};
use crate::registration::prepared_surfels::{PreparedSurfels, SUBMAP_POINTS, SurfelCloud};
use crate::registration::projective::{PackedSurfel, ProjectiveTarget, SurfelRasterizer};
use crate::registration::solver::Solver;
use crate::registration::spatial::SpatialRegistration;

/// Guesses that are refined where it is not known where to look.
const MAX_HYPOTHESES: usize = 4;
/// A frame that lies on what others saw with less than this share of its surface is not held by them, ...
const MIN_OVERLAP: f64 = 0.35;
/// ... nor one of which less than this share agrees where both see it.
const MIN_AGREEMENT: f64 = 0.96;

/// What is kept of a frame to be matched with others.
#[derive(Clone)]
pub(super) struct FrameSurfaces {
    pub(super) source: SurfelCloud,
    pub(super) sparse: SurfelCloud,
    /// In the camera's own frame. Of four neighbouring pieces one is enough.
    pub(super) view: ProjectiveTarget,
    /// The pieces of the view, each with its cell.
    pub(super) pieces: Vec<PackedSurfel>,
}

/// What one of the frames of a place saw.
pub(super) struct SubmapFrame<'a> {
    pub(super) view: Cow<'a, ProjectiveTarget>,
    /// The same in the camera's own frame, to be drawn.
    pub(super) pieces: &'a [PackedSurfel],
}

/// How far a frame may be from a guess.
#[derive(Debug, Clone, Copy)]
pub(super) enum Search {
    /// Some centimetres.
    Here,
    /// A step of the search.
    Near,
    /// Three quarters of a metre and 15 degrees.
    Wide,
}

/// Where a frame stands among others, in the frame of one of them.
pub(super) struct SubmapRegistration {
    pub(super) T_submap_camera: Pose3,
    /// By a perturbation on the left of that, rotation first (1/rad^2, 1/m^2).
    pub(super) information: Matrix6<f64>,
    /// Share of its surface that lies on theirs.
    pub(super) overlap: f64,
    /// Share of what agrees of all that agrees or stands in free space.
    pub(super) agreement: f64,
}

/// Frames that saw a place, each with its pose there.
pub(super) struct Submap<'a> {
    frames: Vec<(SubmapFrame<'a>, Pose3)>,
}

impl FrameSurfaces {
    pub(super) fn new(frame: &PreparedSurfels) -> Self {
        Self {
            source: frame.for_submap(),
            sparse: frame.sparse(),
            view: frame.coarse_view(),
            pieces: frame.coarse.clone(),
        }
    }
}

impl<'a> Submap<'a> {
    /// `T_submap_camera` of each frame: in the frame of the place, whichever that is.
    pub(super) fn new(frames: Vec<(SubmapFrame<'a>, Pose3)>) -> Self {
        Self { frames }
    }

    /// Where a frame stands, if these frames hold it.
    pub(super) fn find(&self, frame: &FrameSurfaces, guess: &Pose3, search: Search) -> Option<SubmapRegistration> {
        match search {
            Search::Here => return self.settle(frame, *guess),
            Search::Near => return self.settle_near(frame, guess),
            Search::Wide => {}
        }
        let view = self.seen_from(guess, frame);
        let (hypotheses, sparse) = (grid_around(guess, -2..=2, 7.5f64.to_radians(), 3, 3), frame.sparse.point_batch());
        let scored = hypotheses.map(|guess| (score(&view, &sparse, &guess), guess)).collect();
        let found =
            best_distinct(scored, MAX_HYPOTHESES).into_iter().filter_map(|guess| self.settle_near(frame, &guess));
        found.max_by(|a, b| (a.overlap * a.agreement).total_cmp(&(b.overlap * b.agreement)))
    }

    /// First with all that might be partners, then, seen from where that leads, with the near ones.
    fn settle_near(&self, frame: &FrameSurfaces, guess: &Pose3) -> Option<SubmapRegistration> {
        let view = self.seen_from(guess, frame);
        self.settle(frame, register(frame, &view, *guess, &middle_options()).T_target_source)
    }

    fn settle(&self, frame: &FrameSurfaces, guess: Pose3) -> Option<SubmapRegistration> {
        let view = self.seen_from(&guess, frame);
        let registration = register(frame, &view, guess, &fine_options());
        let T_submap_camera = registration.T_target_source;
        let (overlap, agreement) = self.evidence(frame, &view, &T_submap_camera);
        let is_supported = overlap > MIN_OVERLAP && agreement > MIN_AGREEMENT && registration.fitness > MIN_OVERLAP;
        (is_supported && DegenerateDirection::of(&registration.correspondences, FINE_TOLERANCE).is_none()).then_some(
            SubmapRegistration { T_submap_camera, information: registration.information, overlap, agreement },
        )
    }

    /// How a frame at a pose fits: the overlap and the agreement.
    pub(super) fn fit(&self, frame: &FrameSurfaces, T_submap_camera: &Pose3) -> (f64, f64) {
        self.evidence(frame, &self.seen_from(T_submap_camera, frame), T_submap_camera)
    }

    fn seen_from(&self, T_submap_view: &Pose3, frame: &FrameSurfaces) -> ProjectiveTarget {
        let mut rasterizer = SurfelRasterizer::new(frame.view.camera(), T_submap_view);
        for (seen, T_submap_camera) in &self.frames {
            rasterizer.add_moved(0, seen.pieces, T_submap_camera);
        }
        rasterizer.finish()
    }

    /// The frame's surfaces held against theirs, free space being what one of them looked through, and theirs against it.
    fn evidence(&self, frame: &FrameSurfaces, view: &ProjectiveTarget, T_submap_camera: &Pose3) -> (f64, f64) {
        let references: Vec<(&ProjectiveTarget, Pose3)> =
            self.frames.iter().map(|(seen, T)| (&*seen.view, T.inverse())).collect();
        let is_seen_through = |point: &Vector3<f64>| {
            let looks = |(view, T): &(&ProjectiveTarget, Pose3)| {
                let point = T.transform_point(&(*point).into()).coords;
                matches!(view.classify_leniently(&point, FINE_TOLERANCE), FreeSpaceTest::InFreeSpace)
            };
            references.iter().any(looks)
        };
        let mut tally = FreeSpaceTally::default();
        let (R, t) = parts(T_submap_camera);
        for (point, normal) in frame.source.points.iter().zip(&frame.source.normals) {
            let (point, normal) = (R * point + t, R * normal);
            match view.classify_leniently(&point, FINE_TOLERANCE).facing(&normal, AGREEING_COSINE) {
                FreeSpaceTest::Agreeing(_) => tally.agreeing += 1,
                _ if is_seen_through(&point) => tally.in_free_space += 1,
                _ => {}
            }
        }
        let overlap = tally.agreeing as f64 / frame.source.points.len().max(1) as f64;
        let (R, t) = parts(&T_submap_camera.inverse());
        for surfel in view.surfels().step_by(view.len().div_ceil(SUBMAP_POINTS).max(1)) {
            let test = frame.view.classify_leniently(&(R * surfel.point + t), FINE_TOLERANCE);
            tally.add(&test.facing(&(R * surfel.normal), AGREEING_COSINE));
        }
        (overlap, tally.agreement())
    }
}

fn register(frame: &FrameSurfaces, view: &ProjectiveTarget, guess: Pose3, options: &IcpOptions) -> SpatialRegistration {
    let solver = Solver { subspace: None, damping: None };
    register_with(frame.source.source(), view, guess, &PointToPlane, options, &solver)
}

fn parts(T: &Pose3) -> (Matrix3<f64>, Vector3<f64>) {
    (T.rotation.to_rotation_matrix().into_inner(), T.translation.vector)
}
