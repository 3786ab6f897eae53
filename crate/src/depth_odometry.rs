//! The chain of depth frames: each is registered to the map of the frames before it.
//!
//! What starts a registration is chosen by evidence: many guesses are scored by what the map's view says of the frame,
//! the best few refined, and the result looked at once more before it is believed. No motion model is trusted: robots
//! stop and turn.

use nalgebra::{Isometry3, Vector3};

use crate::camera::surfel_image::SurfelImage;
use crate::geometry::Pose3;
use crate::registration::factors::PointToSurfel;
use crate::registration::icp::{Criteria, IcpOptions, Registration, Rejection, Source, Weighting, register};
use crate::registration::projective::{ProjectiveTarget, Sight};
use crate::registration::robust_kernel::RobustKernel;
use crate::surfel_map::SurfelMap;

/// A registration in space.
pub type SpatialRegistration = Registration<3, 6, Pose3>;

/// Where a frame was found.
pub struct DepthEstimate {
    /// Pose of the camera in the frame of the first one.
    pub T_world_camera: Pose3,
    /// The registration to the map; `None` for the first frame.
    pub registration: Option<SpatialRegistration>,
    /// Share of the frame's visible surface that agrees with the map, 0..=1.
    pub agreement: f64,
}

/// Frame-to-map odometry in space. The world frame is the frame of the first camera.
pub struct DepthOdometry {
    map: SurfelMap,
    T_world_last: Pose3,
    last_motion: Pose3,
}

impl Default for DepthOdometry {
    fn default() -> Self {
        Self { map: SurfelMap::new(), T_world_last: Pose3::identity(), last_motion: Pose3::identity() }
    }
}

impl DepthOdometry {
    /// Registers the next frame.
    pub fn register_frame(&mut self, frame: &SurfelImage) -> DepthEstimate {
        let estimate = if self.map.is_empty() {
            DepthEstimate { T_world_camera: self.T_world_last, registration: None, agreement: 1.0 }
        } else {
            self.register_to_map(frame)
        };
        self.last_motion = self.T_world_last.inverse() * estimate.T_world_camera;
        let view = self.map.view(frame, &estimate.T_world_camera);
        self.map.insert(frame, &estimate.T_world_camera, &view);
        self.T_world_last = estimate.T_world_camera;
        estimate
    }

    /// The map so far.
    pub fn map(&self) -> &SurfelMap {
        &self.map
    }

    fn register_to_map(&self, frame: &SurfelImage) -> DepthEstimate {
        let cloud = SourceCloud::new(frame);
        let sparse = cloud.every(cloud.points.len().div_ceil(SEARCH_POINTS));
        let middle = cloud.every(cloud.points.len().div_ceil(COARSE_POINTS));

        let view = self.map.view(frame, &self.T_world_last);
        let mut guesses: Vec<(f64, Pose3)> =
            self.guesses().map(|guess| (support(&view, &sparse, &guess, COARSE_TOLERANCE), guess)).collect();
        guesses.sort_by(|a, b| b.0.total_cmp(&a.0));
        guesses.truncate(REFINED_GUESSES);
        guesses.extend([self.T_world_last, self.T_world_last * self.last_motion].map(|guess| (0.0, guess)));
        let refined = guesses.iter().map(|(_, guess)| {
            let refined = register::<3, 6, Pose3, PointToSurfel>(middle.source(), &view, *guess, &coarse_options())
                .T_target_source;
            (support(&view, &middle, &refined, FINE_TOLERANCE), refined)
        });
        let (_, best) = refined
            .fold((f64::NEG_INFINITY, self.T_world_last), |best, next| if next.0 > best.0 { next } else { best });

        let view = self.map.view(frame, &best);
        let fine = cloud.every(cloud.points.len().div_ceil(FINE_POINTS));
        let registration = register::<3, 6, Pose3, PointToSurfel>(fine.source(), &view, best, &fine_options());
        let agreement = support(&view, &fine, &registration.T_target_source, FINE_TOLERANCE);
        DepthEstimate { T_world_camera: registration.T_target_source, agreement, registration: Some(registration) }
    }

    /// Turns about the camera's vertical and moves ahead and aside, around the last pose.
    fn guesses(&self) -> impl Iterator<Item = Pose3> {
        let last = self.T_world_last;
        (-6..=6).flat_map(move |turn| {
            (-2..=2).flat_map(move |ahead| {
                (-1..=1).map(move |aside| {
                    let angle = f64::from(turn) * 5f64.to_radians();
                    let translation = Vector3::new(f64::from(aside) * 0.25, 0.0, f64::from(ahead) * 0.25);
                    last * Isometry3::new(translation, Vector3::y() * angle)
                })
            })
        })
    }
}

const SEARCH_POINTS: usize = 250;
const COARSE_POINTS: usize = 800;
const FINE_POINTS: usize = 3000;
const REFINED_GUESSES: usize = 3;
const COARSE_TOLERANCE: f64 = 0.1;
const FINE_TOLERANCE: f64 = 0.03;

fn coarse_options() -> IcpOptions {
    IcpOptions {
        rejection: Rejection { max_correspondence_distance: 0.4, max_normal_angle: 0.7, trim_fraction: 0.0 },
        weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width: 0.1 },
        criteria: Criteria { max_iterations: 15, rotation_eps: 1e-3, translation_eps: 2e-3 },
    }
}

fn fine_options() -> IcpOptions {
    IcpOptions {
        rejection: Rejection { max_correspondence_distance: 0.15, max_normal_angle: 0.5, trim_fraction: 0.0 },
        weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width: 0.03 },
        criteria: Criteria { max_iterations: 30, rotation_eps: 1e-4, translation_eps: 1e-4 },
    }
}

/// What speaks for a pose: the share of the points that agree with the view, less those in its free space.
fn support(view: &ProjectiveTarget, cloud: &SourceCloud, T_world_camera: &Pose3, tolerance: f64) -> f64 {
    let R = T_world_camera.rotation.to_rotation_matrix().into_inner();
    let t = T_world_camera.translation.vector;
    let (mut agreeing, mut against) = (0.0, 0.0);
    for (point, normal) in cloud.points.iter().zip(&cloud.normals) {
        match view.look_at(&(R * point + t), tolerance) {
            Sight::Agreeing(surfel) => {
                let cosine = normal.map_or(0.0, |normal| surfel.normal.dot(&(R * normal)));
                if cosine > 0.8 {
                    agreeing += 1.0;
                } else {
                    against += 0.5;
                }
            }
            Sight::InFreeSpace => against += 1.0,
            Sight::Hidden | Sight::Unknown => {}
        }
    }
    (agreeing - against) / cloud.points.len().max(1) as f64
}

/// A frame's pieces of surface, column by column.
struct SourceCloud {
    points: Vec<Vector3<f64>>,
    normals: Vec<Option<Vector3<f64>>>,
    deviations: Vec<f64>,
}

impl SourceCloud {
    fn new(frame: &SurfelImage) -> Self {
        let points = frame.surfels().map(|surfel| surfel.point).collect();
        let normals = frame.surfels().map(|surfel| Some(surfel.normal)).collect();
        let deviations = frame.surfels().map(|surfel| surfel.deviation).collect();
        Self { points, normals, deviations }
    }

    fn every(&self, stride: usize) -> Self {
        let stride = stride.max(1);
        Self {
            points: self.points.iter().copied().step_by(stride).collect(),
            normals: self.normals.iter().copied().step_by(stride).collect(),
            deviations: self.deviations.iter().copied().step_by(stride).collect(),
        }
    }

    fn source(&self) -> Source<'_, 3> {
        Source { points: &self.points, normals: Some(&self.normals), deviations: Some(&self.deviations) }
    }
}
