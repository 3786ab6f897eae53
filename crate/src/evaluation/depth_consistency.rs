//! How well the depth images of a recording agree with each other at the poses of a trajectory; no reference is needed.
//!
//! For each pair of consecutive frames, every pixel with depth is projected into the second camera by the relative pose. Where
//! the second image has depth at that pixel, the point is visible in both frames and the two depths are compared.

use nalgebra::Vector3;
use serde::Serialize;

use super::associate::{MAX_TIME_DIFFERENCE, by_number, by_time};
use super::convention::{KnownConvention, PoseConvention, readings};
use crate::camera::Pinhole;
use crate::error::{Error, Result};
use crate::geometry::{Pose3, RigidMotion};
use crate::io::trajectory::{Contents, Trajectory};

/// Tolerances for two depths to agree, and for a step to agree.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct ConsistencyLimits {
    /// Constant part of the tolerance of a depth (m).
    pub absolute_tolerance: f64,
    /// Part of the tolerance proportional to the depth (1); the two parts are added.
    pub relative_tolerance: f64,
    /// Smallest share of agreeing pixels for which a step agrees.
    pub min_share: f64,
    /// Smallest share of the image's pixels that must be visible in both frames for a step to agree.
    pub min_visible: f64,
}

impl Default for ConsistencyLimits {
    /// 2 cm + 2 %, 85 % of the pixels, 1 % of the image.
    fn default() -> Self {
        Self { absolute_tolerance: 0.02, relative_tolerance: 0.02, min_share: 0.85, min_visible: 0.01 }
    }
}

/// A camera and the depths of its pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthView {
    /// The camera.
    pub camera: Pinhole,
    /// Depth of each pixel (m, along the optical axis), row by row; 0 where there is none.
    pub depths: Vec<f32>,
}

/// Agreement of one step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct StepConsistency {
    /// Index of the first frame in the recording, from 0; the second frame is the next one.
    pub frame: usize,
    /// Number of pixels visible in both frames.
    pub num_visible: usize,
    /// Number of visible pixels whose depths agree.
    pub num_agreeing: usize,
    /// Share of the visible pixels that agree, 0..=1; null where none is visible, or an image or a pose is missing.
    pub share: Option<f64>,
    /// Translation of the camera by the trajectory (m); null without poses.
    pub translation: Option<f64>,
    /// Rotation angle of the camera by the trajectory (rad); null without poses.
    pub rotation: Option<f64>,
    /// Whether the step agrees by the limits.
    pub agrees: bool,
}

/// The agreement of all steps.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct ConsistencyReport {
    /// Every step of the recording.
    pub steps: Vec<StepConsistency>,
    /// Number of steps that agree.
    pub num_agreeing: usize,
    /// Mean of the steps' shares, 0..=1, a missing share counted as 0.
    pub mean_share: f64,
    /// The pose convention of the file, in words.
    pub convention: String,
    /// The tolerances used.
    pub limits: ConsistencyLimits,
}

/// Compares consecutive frames as they are added; only the last image is kept.
pub struct DepthConsistency {
    limits: ConsistencyLimits,
    /// Index of each frame's pose in the trajectory.
    partners: Vec<Option<usize>>,
    /// The pose conventions that are still possible, the usual one first.
    readings: Vec<Reading>,
    last: Option<DepthView>,
    num_frames: usize,
}

struct Reading {
    convention: PoseConvention,
    poses: Vec<Pose3>,
    steps: Vec<StepConsistency>,
}

/// Number of steps after which pose conventions that agree clearly less than the best one are discarded.
const DECIDING_STEPS: usize = 10;
/// Difference of mean shares above which one pose convention agrees clearly less than another.
const CLEARLY_LESS: f64 = 0.1;

impl DepthConsistency {
    /// For a recording of `num_frames` frames, taken at `times` (s) where they are known.
    ///
    /// # Errors
    /// When the trajectory has no orientations, or the pose of each frame cannot be determined.
    pub fn new(
        trajectory: &Contents,
        num_frames: usize,
        times: Option<&[f64]>,
        known: KnownConvention,
        limits: ConsistencyLimits,
    ) -> Result<Self> {
        let partners = partners(&trajectory.trajectory, num_frames, times)?;
        let readings = readings(&trajectory.trajectory, trajectory.format, known, false).ok_or_else(|| {
            let problem = "The trajectory has positions alone, and depth cannot be carried from frame to frame by them";
            Error::whole(problem, "Give a trajectory with orientations")
        })?;
        let readings =
            readings.into_iter().map(|(convention, poses)| Reading { convention, poses, steps: Vec::new() }).collect();
        Ok(Self { limits, partners, readings, last: None, num_frames: 0 })
    }

    /// Adds the next frame of the recording; `None` where its image cannot be used.
    pub fn add(&mut self, view: Option<DepthView>) {
        if let Some(frame) = self.num_frames.checked_sub(1) {
            let partner = |frame: usize| self.partners.get(frame).copied().flatten();
            let partners = partner(frame).zip(partner(frame + 1));
            let views = self.last.as_ref().zip(view.as_ref());
            for reading in &mut self.readings {
                let T_next_frame = partners.map(|(a, b)| reading.poses[b].inverse() * reading.poses[a]);
                reading.steps.push(self.limits.step(frame, views, T_next_frame));
            }
            if frame + 1 == DECIDING_STEPS {
                self.give_up_readings();
            }
        }
        self.last = view;
        self.num_frames += 1;
    }

    fn give_up_readings(&mut self) {
        let best = self.readings.iter().map(Reading::mean_share).fold(0.0, f64::max);
        self.readings.retain(|reading| reading.mean_share() >= best - CLEARLY_LESS);
    }

    /// The steps so far, under the usual pose convention unless another one agrees clearly more.
    pub fn report(&self) -> ConsistencyReport {
        let better = |best: &'_ Reading, next: &Reading| next.mean_share() > best.mean_share() + CLEARLY_LESS;
        let best = self.readings.iter().reduce(|best, next| if better(best, next) { next } else { best });
        let steps = best.map(|reading| reading.steps.clone()).unwrap_or_default();
        ConsistencyReport {
            num_agreeing: steps.iter().filter(|step| step.agrees).count(),
            mean_share: best.map_or(0.0, Reading::mean_share),
            convention: best.map(|reading| reading.convention.words()).unwrap_or_default(),
            limits: self.limits,
            steps,
        }
    }
}

impl Reading {
    fn mean_share(&self) -> f64 {
        let sum: f64 = self.steps.iter().filter_map(|step| step.share).sum();
        sum / self.steps.len().max(1) as f64
    }
}

impl ConsistencyLimits {
    fn step(
        &self,
        frame: usize,
        views: Option<(&DepthView, &DepthView)>,
        T_next_frame: Option<Pose3>,
    ) -> StepConsistency {
        let (num_visible, num_agreeing) =
            views.zip(T_next_frame).map_or((0, 0), |((from, to), T)| self.compare(from, to, &T));
        let share = (num_visible > 0).then(|| num_agreeing as f64 / num_visible as f64);
        let least = views.map_or(0.0, |(_, to)| self.min_visible * to.depths.len() as f64);
        StepConsistency {
            frame,
            num_visible,
            num_agreeing,
            share,
            translation: T_next_frame.map(|T| T.translation_norm()),
            rotation: T_next_frame.map(|T| T.rotation_angle()),
            agrees: num_visible as f64 >= least && share.is_some_and(|share| share >= self.min_share),
        }
    }

    /// Number of pixels of `from` that are visible in `to` as well, and number of these whose depths agree.
    pub fn compare(&self, from: &DepthView, to: &DepthView, T_to_from: &Pose3) -> (usize, usize) {
        let rays = from.camera.ray_table();
        let (R, t) = (T_to_from.rotation.to_rotation_matrix().into_inner(), T_to_from.translation.vector);
        let (mut num_visible, mut num_agreeing) = (0, 0);
        for (row, y) in from.depths.chunks_exact(from.camera.width).zip(&rays.y) {
            for (&depth, x) in row.iter().zip(&rays.x).filter(|(depth, _)| **depth > 0.0) {
                let point = R * (Vector3::new(*x, *y, 1.0) * f64::from(depth)) + t;
                let Some(measured) = to.depth_at(&point) else { continue };
                num_visible += 1;
                let tolerance = self.absolute_tolerance + self.relative_tolerance * point.z;
                num_agreeing += usize::from((point.z - measured).abs() <= tolerance);
            }
        }
        (num_visible, num_agreeing)
    }
}

impl DepthView {
    /// The depth measured at the pixel that a point (m, camera frame) projects to.
    fn depth_at(&self, point: &Vector3<f64>) -> Option<f64> {
        let pixel = self.camera.project(point)?;
        let (column, row) = (pixel.x.round(), pixel.y.round());
        let is_inside =
            column >= 0.0 && row >= 0.0 && column < self.camera.width as f64 && row < self.camera.height as f64;
        let depth = is_inside.then(|| self.depths[row as usize * self.camera.width + column as usize])?;
        (depth > 0.0).then(|| f64::from(depth))
    }
}

/// Index of each frame's pose in the trajectory: by time, where both have times; by order, where there are equally many; by
/// number, where the trajectory's times are frame numbers.
fn partners(trajectory: &Trajectory, num_frames: usize, times: Option<&[f64]>) -> Result<Vec<Option<usize>>> {
    let placed = |pairs: &mut dyn Iterator<Item = (usize, usize)>| {
        let mut partners = vec![None; num_frames];
        for (frame, pose) in pairs {
            partners[frame] = Some(pose);
        }
        partners
    };
    if let (Some(stamps), Some(times)) = (&trajectory.stamps, times)
        && let Ok(pairs) = by_time(stamps, times, MAX_TIME_DIFFERENCE, 0.0)
    {
        return Ok(placed(&mut pairs.iter().map(|pair| (pair.estimate, pair.reference))));
    }
    if trajectory.num_rows() == num_frames {
        return Ok((0..num_frames).map(|frame| trajectory.index_of_row(frame)).collect());
    }
    // Halves are no numbers of poses, so that only the trajectory's times can be numbers of frames.
    let halves: Vec<f64> = (0..num_frames).map(|frame| frame as f64 + 0.5).collect();
    if let Some(stamps) = &trajectory.stamps
        && let Some((_, pairs)) = by_number(&halves, stamps)
    {
        return Ok(placed(&mut pairs.iter().map(|pair| (pair.reference, pair.estimate))));
    }
    let problem = format!("The trajectory has {} poses, but the recording has {num_frames} frames", trajectory.len());
    Err(Error::whole(problem, "Give one pose for each frame, or a trajectory with the times or numbers of the frames"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::trajectory::TrajectoryFormat;

    /// Depth of a wavy wall, 2 to 3 m.
    fn wall(x: f64, y: f64) -> f64 {
        2.5 + 0.4 * (1.3 * x).sin() + 0.1 * (2.0 * y).cos()
    }

    /// The wall from (x, 0, z), with the identity as rotation.
    fn view(x: f64, z: f64) -> DepthView {
        let camera = Pinhole::from_field_of_view(64, 48, 1.2).unwrap();
        let table = camera.ray_table();
        let depth = |ray: Vector3<f64>| {
            let march = |depth: f64| depth + 0.5 * (wall(x + ray.x * depth, ray.y * depth) - z - depth);
            (0..60).fold(2.0, |depth, _| march(depth)) as f32
        };
        let depths = table.y.iter().flat_map(|&y| table.x.iter().map(move |&x| Vector3::new(x, y, 1.0))).map(depth);
        DepthView { camera, depths: depths.collect() }
    }

    fn contents(trajectory: Trajectory) -> Contents {
        Contents { trajectory, format: TrajectoryFormat::Tum, notes: Vec::new() }
    }

    fn walk(places: &[(f64, f64)]) -> Trajectory {
        Trajectory::from_poses(&places.iter().map(|&(x, z)| Pose3::translation(x, 0.0, z)).collect::<Vec<_>>())
    }

    const PLACES: [(f64, f64); 4] = [(0.0, 0.0), (0.1, 0.05), (0.2, 0.2), (0.15, 0.3)];

    fn compared(trajectory: Trajectory, times: Option<&[f64]>) -> ConsistencyReport {
        let (known, limits) = (KnownConvention::default(), ConsistencyLimits::default());
        let mut consistency = DepthConsistency::new(&contents(trajectory), PLACES.len(), times, known, limits).unwrap();
        for (x, z) in PLACES {
            consistency.add(Some(view(x, z)));
        }
        consistency.report()
    }

    #[test]
    fn true_poses_agree_and_a_wrong_one_spoils_its_steps() {
        let report = compared(walk(&PLACES), None);
        assert_eq!((report.num_agreeing, report.steps.len()), (3, 3), "{report:?}");
        assert!(report.mean_share > 0.98 && report.steps.iter().all(|step| step.num_visible > 2000));
        assert!((report.steps[1].translation.unwrap() - 0.1f64.hypot(0.15)).abs() < 1e-12);
        assert_eq!(report.steps[1].rotation, Some(0.0));

        let mut wrong = PLACES;
        wrong[3].1 += 0.2;
        let report = compared(walk(&wrong), None);
        assert_eq!(report.steps.iter().map(|step| step.agrees).collect::<Vec<_>>(), [true, true, false]);
    }

    #[test]
    fn depths_agree_up_to_the_tolerance() {
        let camera = Pinhole::from_field_of_view(4, 3, 1.0).unwrap();
        let view = |depth: f32| DepthView { camera, depths: vec![depth; 12] };
        let limits = ConsistencyLimits::default();
        let compare = |depth: f32| limits.compare(&view(2.0), &view(depth), &Pose3::identity());
        // 2 cm + 2 % of 2 m.
        assert_eq!(
            [compare(2.059), compare(2.061), compare(1.941), compare(1.939)],
            [(12, 12), (12, 0), (12, 12), (12, 0)]
        );
        assert_eq!(compare(0.0), (0, 0), "no depth, nothing visible");
        let behind = Pose3::translation(0.0, 0.0, -3.0);
        assert_eq!(limits.compare(&view(2.0), &view(2.0), &behind), (0, 0));
    }

    #[test]
    fn frames_find_their_poses_by_time_by_order_or_by_number() {
        let stamped = |stamps: &[f64]| {
            let poses = stamps.iter().map(|_| Pose3::identity()).collect::<Vec<_>>();
            Trajectory::from_poses(&poses).with_stamps(stamps.to_vec()).unwrap()
        };
        let times = [10.0, 11.0, 12.0, 13.0];
        let by_time = partners(&stamped(&[9.0, 10.01, 13.0]), 4, Some(&times)).unwrap();
        assert_eq!(by_time, [Some(1), None, None, Some(2)]);
        assert_eq!(partners(&stamped(&[7.0, 8.0, 9.0, 9.5]), 4, None).unwrap(), [0, 1, 2, 3].map(Some));
        assert_eq!(partners(&stamped(&[0.0, 1.0, 3.0]), 4, None).unwrap(), [Some(0), Some(1), None, Some(2)]);
        let refused = partners(&stamped(&[0.5, 1.0]), 4, None).unwrap_err().to_string();
        assert!(refused.starts_with("The trajectory has 2 poses, but the recording has 4 frames"), "{refused}");
    }

    #[test]
    fn steps_without_image_or_pose_do_not_agree() {
        let (known, limits) = (KnownConvention::default(), ConsistencyLimits::default());
        let mut consistency = DepthConsistency::new(&contents(walk(&PLACES)), 4, None, known, limits).unwrap();
        for (index, &(x, z)) in PLACES.iter().enumerate() {
            consistency.add((index != 1).then(|| view(x, z)));
        }
        let steps = consistency.report().steps;
        assert_eq!(steps.iter().map(|step| step.share.is_some()).collect::<Vec<_>>(), [false, false, true]);
        assert_eq!(steps.iter().map(|step| step.agrees).collect::<Vec<_>>(), [false, false, true]);
        let positions = Trajectory { orientations: None, ..walk(&PLACES) };
        let refused = DepthConsistency::new(&contents(positions), 4, None, known, limits).err().unwrap();
        assert!(refused.problem.contains("positions alone"));
    }
}
