//! How well the clouds of frames overlay at estimated poses, without a reference: the point-to-plane residual between
//! overlapping frames, and the map of all frames.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::geometry::{PointCloud, Pose3};
use crate::preprocess::beam_normals::beam_normals;
use crate::preprocess::depth_cloud::DEPTH_VOXEL;
use crate::preprocess::estimate_normals::estimate_normals;
use crate::preprocess::voxel_downsample::voxel_downsample;
use crate::search::{KdTree, Neighborhood};
use crate::{Error, Result};

/// Pairing distance and number of points of [`FrameClouds::residual`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(default, deny_unknown_fields)]
pub struct FrameResidualOptions {
    /// Largest distance between a point and the nearest one of another frame for which the frames overlap there (m).
    pub max_pair_distance: f64,
    /// Most points that are evaluated, evenly spread over all frames. 0: all.
    pub max_points: usize,
}

impl Default for FrameResidualOptions {
    /// 0.3 m, 20,000 points.
    fn default() -> Self {
        Self { max_pair_distance: 0.3, max_points: 20_000 }
    }
}

/// Distances of points from the surfaces of other frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct FrameResidual {
    /// Mean distance of a point from the plane (for planar scans: the line) at its partner (m); smaller is better.
    pub mean_residual: f64,
    /// Root mean square distance (m).
    pub rms_residual: f64,
    /// Number of pairs of a point and its partner in another frame.
    pub num_pairs: usize,
    /// Number of pairs of frames with such points.
    pub num_overlaps: usize,
}

/// One frame's downsampled points (m, sensor frame), with normals where neighbours span a surface.
struct FrameCloud {
    positions: Vec<[f32; 3]>,
    normals: Vec<Option<Vector3<f64>>>,
    tree: KdTree<3>,
    /// Centre and radius of a bounding sphere of all points (m).
    ball: (Point3<f64>, f64),
}

/// The clouds of the frames of a recording, each in its sensor frame. They are indexed once for the comparison of any number
/// of trajectories.
#[derive(Default)]
pub struct FrameClouds {
    frames: Vec<FrameCloud>,
}

impl FrameClouds {
    /// Without frames.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Adds the next frame. Normals are estimated from adjacent beams where the cloud is a planar scan, from the nearest
    /// neighbours otherwise.
    ///
    /// # Errors
    /// When the cloud has no finite point.
    pub fn push(&mut self, cloud: &PointCloud) -> Result<()> {
        let is_planar = cloud.is_planar();
        let finite: Vec<_> = cloud.positions.iter().copied().filter(|p| p.is_finite()).collect();
        let cloud = PointCloud { origin: cloud.origin, ..PointCloud::from_positions(finite) };
        // The few points of a planar scan are all kept, since their order gives the neighbours.
        let cloud = if is_planar { cloud } else { voxel_downsample(&cloud, DEPTH_VOXEL)? };
        if cloud.is_empty() {
            return Err(Error::whole("This frame has no point", "Leave it out, with its pose"));
        }
        let origin = cloud.origin.as_vec3();
        let points: Vec<_> = cloud.positions.iter().map(|p| *p + origin).collect();
        let positions: Vec<[f32; 3]> = points.iter().map(glam::Vec3::to_array).collect();
        let tree = KdTree::build(&positions);
        let normals = if is_planar {
            let flat: Vec<_> = points.iter().map(|p| nalgebra::Vector2::new(f64::from(p.x), f64::from(p.y))).collect();
            beam_normals(&flat).into_iter().map(|normal| normal.map(|n| Vector3::new(n.x, n.y, 0.0))).collect()
        } else {
            let neighborhood = Neighborhood { max_neighbors: 20, radius: 4.0 * DEPTH_VOXEL };
            estimate_normals(&points, &tree, neighborhood, glam::DVec3::ZERO)
        };
        let ball = ball_around(&positions);
        self.frames.push(FrameCloud { positions, normals, tree, ball });
        Ok(())
    }

    /// Mean distance between overlapping frames at these `T_world_sensor`, one for each frame.
    ///
    /// In every other frame the partner of a point p is the nearest point q, if it is within `max_pair_distance` and has a
    /// normal n; the residual is |n . (p - q)|. (In the union of all frames the nearest of many displaced copies of a surface
    /// would always be near.)
    ///
    /// # Errors
    /// When the numbers of poses and frames differ, or no two frames overlap.
    pub fn residual(&self, poses: &[Pose3], options: &FrameResidualOptions) -> Result<FrameResidual> {
        self.check(poses)?;
        let reach = options.max_pair_distance;
        if !(reach > 0.0 && reach.is_finite()) {
            return Err(Error::whole(format!("max_pair_distance is {reach} m"), "Give a positive distance"));
        }
        let num_points: usize = self.frames.iter().map(|frame| frame.positions.len()).sum();
        let stride =
            if options.max_points == 0 { 1.0 } else { (num_points as f64 / options.max_points as f64).max(1.0) };
        let (mut sum, mut sum_of_squares, mut num_pairs, mut num_overlaps) = (0.0, 0.0, 0, 0);
        let mut seen = 0;
        for (frame, pose) in self.frames.iter().zip(poses) {
            let looked_at = strided(seen, frame.positions.len(), stride);
            seen += frame.positions.len();
            for (other, other_pose) in self.frames.iter().zip(poses) {
                let T_other_frame = other_pose.inverse() * pose;
                if std::ptr::eq(frame, other) || !balls_meet(frame.ball, other.ball, &T_other_frame, reach) {
                    continue;
                }
                let before = num_pairs;
                for &index in &looked_at {
                    let Some(residual) = other.residual_of(&(T_other_frame * frame.point(index)), reach) else {
                        continue;
                    };
                    sum += residual;
                    sum_of_squares += residual * residual;
                    num_pairs += 1;
                }
                num_overlaps += usize::from(num_pairs > before);
            }
        }
        if num_pairs == 0 {
            let problem = format!("No two of the {} frames overlap at these poses", self.frames.len());
            return Err(Error::whole(problem, "Give the poses of these frames, in their order"));
        }
        let count = num_pairs as f64;
        let (mean_residual, rms_residual) = (sum / count, (sum_of_squares / count).sqrt());
        // Each pair of frames was counted from both sides.
        Ok(FrameResidual { mean_residual, rms_residual, num_pairs, num_overlaps: num_overlaps.div_ceil(2) })
    }

    /// All points in the world frame (m), at these `T_world_sensor`.
    ///
    /// # Errors
    /// When the numbers of poses and frames differ.
    pub fn map(&self, poses: &[Pose3]) -> Result<Vec<[f32; 3]>> {
        self.check(poses)?;
        let placed = self.frames.iter().zip(poses);
        let points = placed.flat_map(|(frame, pose)| (0..frame.positions.len()).map(move |i| pose * frame.point(i)));
        Ok(points.map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect())
    }

    fn check(&self, poses: &[Pose3]) -> Result<()> {
        if poses.len() == self.frames.len() {
            return Ok(());
        }
        let problem = format!("There are {} frames and {} poses", self.frames.len(), poses.len());
        Err(Error::whole(problem, "Give one pose for each frame"))
    }
}

impl FrameCloud {
    fn point(&self, index: usize) -> Point3<f64> {
        Point3::from(self.positions[index].map(f64::from))
    }

    /// Distance of a point (m, this frame) from this frame's surface; `None` where there is none within `reach` (m).
    fn residual_of(&self, point: &Point3<f64>, reach: f64) -> Option<f64> {
        let query = [point.x as f32, point.y as f32, point.z as f32];
        let partner = self.tree.nearest(&query, reach as f32)?.index as usize;
        Some(self.normals[partner]?.dot(&(point - self.point(partner))).abs())
    }
}

/// Indices of every `stride`-th of all points within one frame of `count` points, with `before` points in earlier frames.
fn strided(before: usize, count: usize, stride: f64) -> Vec<usize> {
    let first = (before as f64 / stride).ceil() as usize;
    let place = |k: usize| (k as f64 * stride) as usize;
    (first..).map(place).skip_while(|&at| at < before).map(|at| at - before).take_while(|&at| at < count).collect()
}

fn ball_around(positions: &[[f32; 3]]) -> (Point3<f64>, f64) {
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for position in positions {
        let position = Vector3::from(position.map(f64::from));
        (low, high) = (low.inf(&position), high.sup(&position));
    }
    (Point3::from((low + high) / 2.0), (high - low).norm() / 2.0)
}

fn balls_meet(frame: (Point3<f64>, f64), other: (Point3<f64>, f64), T_other_frame: &Pose3, reach: f64) -> bool {
    (T_other_frame * frame.0 - other.0).norm() <= frame.1 + other.1 + reach
}

// The synthetic worlds link this crate once more, which the browser's linker refuses.
#[cfg(not(target_arch = "wasm32"))]
#[cfg(test)]
mod tests {
    use super::*;
    use scanstitch_scene::random::Random;

    /// A corner of three walls, as seen by one sensor.
    fn corner(random: &mut Random, sensor: &Pose3) -> PointCloud {
        let points = (0..3000).map(|i| {
            let (u, v) = (random.uniform(0.0, 2.0), random.uniform(0.0, 2.0));
            let point = [[u, v, 0.0], [u, 0.0, v], [0.0, u, v]][i % 3];
            let p = sensor.inverse() * Point3::from(point);
            glam::Vec3::new(p.x as f32, p.y as f32, p.z as f32)
        });
        PointCloud::from_positions(points.collect())
    }

    fn sensors() -> Vec<Pose3> {
        let turn = |angle: f64| Vector3::new(0.3 * angle, -angle, 0.2 * angle);
        (0..4).map(|i| Pose3::new(Vector3::new(1.0, 1.0 + 0.1 * f64::from(i), 1.2), turn(0.2 * f64::from(i)))).collect()
    }

    #[test]
    fn a_shift_across_the_walls_is_the_residual_of_its_frame() {
        let mut random = Random::new(3);
        let mut clouds = FrameClouds::new();
        let poses = sensors();
        for pose in &poses {
            clouds.push(&corner(&mut random, pose)).unwrap();
        }
        let options = FrameResidualOptions { max_points: 0, ..FrameResidualOptions::default() };
        let exact = clouds.residual(&poses, &options).unwrap();
        // Cubes across an edge hold points of two walls; all else fits.
        assert!(exact.mean_residual < 0.004 && exact.num_overlaps == 6, "{exact:?}");
        let mut last = exact;
        for shift in [0.01, 0.02, 0.05] {
            let mut shaken = poses.clone();
            shaken[1].translation.vector += Vector3::repeat(shift);
            let found = clouds.residual(&shaken, &options).unwrap();
            assert!(found.mean_residual > last.mean_residual && found.rms_residual > last.rms_residual);
            last = found;
        }
        // Half of the pairs contain the shifted frame and have the shift as residual, slightly less at the edges.
        assert!((0.02..0.03).contains(&last.mean_residual), "{last:?}");
    }

    #[test]
    fn a_sample_of_points_gives_the_residual_of_all_and_distant_frames_do_not_overlap() {
        let mut random = Random::new(4);
        let mut clouds = FrameClouds::new();
        let mut poses = sensors();
        for pose in &poses {
            clouds.push(&corner(&mut random, pose)).unwrap();
        }
        poses[2].translation.vector.x += 0.02;
        let with = |max_points: usize| {
            clouds.residual(&poses, &FrameResidualOptions { max_points, ..Default::default() }).unwrap()
        };
        let (all, some) = (with(0), with(1500));
        assert!(some.num_pairs * 3 < all.num_pairs && some.num_pairs > 1000);
        assert!((some.mean_residual / all.mean_residual - 1.0).abs() < 0.1, "{all:?} {some:?}");
        assert_eq!(clouds.map(&poses).unwrap().len(), clouds.frames.iter().map(|f| f.positions.len()).sum::<usize>());

        for (i, pose) in poses.iter_mut().enumerate() {
            pose.translation.vector.y += 100.0 * i as f64;
        }
        let alone = clouds.residual(&poses, &FrameResidualOptions::default()).unwrap_err().to_string();
        assert!(alone.contains("No two of the 4 frames overlap"), "{alone}");
        let short = clouds.residual(&poses[..3], &FrameResidualOptions::default()).unwrap_err().to_string();
        assert!(short.contains("4 frames and 3 poses"), "{short}");
        let wrong = FrameResidualOptions { max_pair_distance: 0.0, ..Default::default() };
        assert!(clouds.residual(&poses, &wrong).unwrap_err().to_string().contains("max_pair_distance is 0 m"));
        assert!(clouds.push(&PointCloud::default()).is_err());
    }

    #[test]
    fn a_stride_samples_every_frame_in_proportion_to_its_points() {
        for stride in [1.0, 2.0, 2.5, 7.3] {
            let counts = [10, 1, 0, 25, 3];
            let mut before = 0;
            let mut taken = Vec::new();
            for count in counts {
                taken.extend(strided(before, count, stride).into_iter().map(|at| at + before));
                before += count;
            }
            let all = (0..before).map(|k| (k as f64 * stride) as usize);
            let expected: Vec<usize> = all.take_while(|&at| at < before).collect();
            assert_eq!(taken, expected);
        }
    }
}
