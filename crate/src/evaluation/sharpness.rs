//! Sharpness of a map of planar scans without a reference: the mean point-to-line residual between overlapping scans.

use std::rc::Rc;

use nalgebra::Vector2;
use serde::Serialize;

use crate::geometry::algebra::single;
use crate::geometry::{Pose2, RigidMotion};
use crate::preprocess::planar_scan::PlanarScan;
use crate::search::KdTree;

/// Largest range of a return that is compared (m).
pub const MAX_RANGE: f64 = 29.0;
/// Largest distance between a point and its nearest neighbour in the other scans for which the scans overlap there (m).
pub const MAX_PAIR_DISTANCE: f64 = 0.5;

/// Mean point-to-line residual between overlapping scans.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Sharpness {
    /// Mean absolute distance along the partner's normal (m): lower is sharper.
    pub mean_residual: f64,
    /// Pairs that the mean is taken over.
    pub num_pairs: usize,
}

/// Measures the sharpness of a map a number of points at a time.
///
/// Each point of a scan is paired with its nearest neighbour in the union of all other scans, in the world frame. Pairs within
/// [`MAX_PAIR_DISTANCE`] whose neighbour has a normal contribute their distance along that normal. Only returns within
/// [`MAX_RANGE`] are used. The nearest of many displaced copies of a surface is always near, so that the figure underestimates large
/// errors; [`FrameClouds::residual`](super::frame_clouds::FrameClouds::residual) pairs frame by frame.
pub struct SharpnessMeter {
    placed: Vec<(Rc<PlanarScan>, Pose2)>,
    /// Index of the scan of each point.
    scans: Vec<u32>,
    /// Index of the first point of each scan.
    firsts: Vec<u32>,
    /// The points within range, world frame (m).
    tree: KdTree<2>,
    /// Index of the next point to evaluate.
    next: usize,
    sum: f64,
    num_pairs: usize,
}

impl SharpnessMeter {
    /// A meter for scans at their `T_world_sensor`.
    pub fn new(placed: Vec<(Rc<PlanarScan>, Pose2)>) -> Self {
        let num_points = placed.iter().map(|(scan, _)| scan.points.len()).sum();
        let (mut scans, mut positions) = (Vec::with_capacity(num_points), Vec::with_capacity(num_points));
        let mut firsts = Vec::with_capacity(placed.len());
        for (index, (scan, T_world_sensor)) in placed.iter().enumerate() {
            firsts.push(scans.len() as u32);
            scans.extend(std::iter::repeat_n(index as u32, scan.points.len()));
            let position = |point| if is_near(point) { single(&T_world_sensor.act(point)) } else { NOWHERE };
            positions.extend(scan.points.iter().map(position));
        }
        Self { tree: KdTree::build(&positions), placed, scans, firsts, next: 0, sum: 0.0, num_pairs: 0 }
    }

    /// Evaluates this many more points.
    pub fn advance(&mut self, num_points: usize) {
        let end = self.scans.len().min(self.next.saturating_add(num_points));
        for point in self.next..end {
            if !is_near(self.point(point).1) {
                continue;
            }
            let (position, _) = self.surface(point);
            let of_others = |other: u32| self.scans[other as usize] != self.scans[point];
            let neighbor = self.tree.nearest_where(&single(&position), MAX_PAIR_DISTANCE as f32, of_others);
            let Some(neighbor) = neighbor else { continue };
            if let (partner, Some(normal)) = self.surface(neighbor.index as usize) {
                self.sum += normal.dot(&(position - partner)).abs();
                self.num_pairs += 1;
            }
        }
        self.next = end;
    }

    /// The pose of a point's scan, and the point and its normal in the sensor frame.
    fn point(&self, point: usize) -> (&Pose2, &Vector2<f64>, Option<&Vector2<f64>>) {
        let scan = self.scans[point] as usize;
        let number = point - self.firsts[scan] as usize;
        let (scan, T_world_sensor) = &self.placed[scan];
        (T_world_sensor, &scan.points[number], scan.normals[number].as_ref())
    }

    /// A point and its normal in the world frame.
    fn surface(&self, point: usize) -> (Vector2<f64>, Option<Vector2<f64>>) {
        let (T_world_sensor, point, normal) = self.point(point);
        (T_world_sensor.act(point), normal.map(|normal| T_world_sensor.rotate(normal)))
    }

    /// Number of points evaluated, and of all points.
    pub fn progress(&self) -> (usize, usize) {
        (self.next, self.scans.len())
    }

    /// Whether all points have been evaluated.
    pub fn is_done(&self) -> bool {
        self.next == self.scans.len()
    }

    /// The sharpness from the points evaluated so far; `None` where no two scans overlap.
    pub fn sharpness(&self) -> Option<Sharpness> {
        let (num_pairs, mean_residual) = (self.num_pairs, self.sum / self.num_pairs as f64);
        (num_pairs > 0).then_some(Sharpness { mean_residual, num_pairs })
    }
}

/// Position of points out of range, which the tree leaves out.
const NOWHERE: [f32; 2] = [f32::NAN; 2];

fn is_near(point: &Vector2<f64>) -> bool {
    point.norm() <= MAX_RANGE
}

// The synthetic worlds link this crate once more, which the browser's linker refuses.
#[cfg(not(target_arch = "wasm32"))]
#[cfg(test)]
mod tests {
    use super::*;
    use scanstitch_scene::corridor::{CorridorOptions, generate};
    use scanstitch_scene::random::Random;
    use scanstitch_scene::recording::PlanarRecording;

    /// The definition, by brute force.
    fn by_brute_force(scans: &[(Rc<PlanarScan>, Pose2)]) -> Sharpness {
        let (mut sum, mut num_pairs) = (0.0, 0);
        for (index, (scan, pose)) in scans.iter().enumerate() {
            for point in scan.points.iter().filter(|point| point.norm() <= 29.0) {
                let query = pose.act(point);
                let mut best: Option<(f64, Option<f64>)> = None;
                for (_, (other, other_pose)) in scans.iter().enumerate().filter(|(other, _)| *other != index) {
                    for (q, normal) in other.points.iter().zip(&other.normals).filter(|(q, _)| q.norm() <= 29.0) {
                        let offset = query - other_pose.act(q);
                        if offset.norm() <= 0.5 && best.is_none_or(|(nearest, _)| offset.norm() < nearest) {
                            best = Some((offset.norm(), normal.map(|n| other_pose.rotate(&n).dot(&offset).abs())));
                        }
                    }
                }
                if let Some((_, Some(residual))) = best {
                    sum += residual;
                    num_pairs += 1;
                }
            }
        }
        Sharpness { mean_residual: sum / f64::from(num_pairs), num_pairs: num_pairs as usize }
    }

    /// Measured in two parts.
    fn sharpness(placed: &[(Rc<PlanarScan>, Pose2)]) -> Option<Sharpness> {
        let mut meter = SharpnessMeter::new(placed.to_vec());
        meter.advance(100);
        assert_eq!(meter.is_done(), meter.progress().1 <= 100);
        meter.advance(usize::MAX);
        assert!(meter.is_done());
        meter.sharpness()
    }

    fn scans_of(recording: &PlanarRecording) -> Vec<Rc<PlanarScan>> {
        let returns = |scan: &Vec<Vector2<f64>>| scan.iter().copied().filter(|p| p.norm() < 49.9).collect();
        recording.scans.iter().map(|scan| Rc::new(PlanarScan::new(returns(scan)))).collect()
    }

    #[test]
    fn agrees_with_the_definition() {
        let recording = generate(&CorridorOptions { num_scans: 4, ..CorridorOptions::default() });
        let scans = scans_of(&recording);
        let placed: Vec<_> = scans.into_iter().zip(recording.T_world_sensor.iter().copied()).collect();
        let (fast, slow) = (sharpness(&placed).unwrap(), by_brute_force(&placed));
        assert_eq!(fast.num_pairs, slow.num_pairs);
        assert!((fast.mean_residual - slow.mean_residual).abs() < 1e-6, "{fast:?} {slow:?}");
        assert!(sharpness(&placed[..1]).is_none());
        assert!(sharpness(&[]).is_none());
    }

    #[test]
    fn noise_on_the_poses_raises_the_residual() {
        let recording = generate(&CorridorOptions::default());
        let scans = scans_of(&recording);
        let shaken_by = |size: f64| {
            let mut random = Random::new(3);
            let mut shake = || Pose2::translation(size * random.normal(), size * random.normal());
            let placed: Vec<_> =
                scans.iter().cloned().zip(recording.T_world_sensor.iter().map(|T| T * shake())).collect();
            sharpness(&placed).unwrap().mean_residual
        };
        let residuals = [0.0, 0.01, 0.02, 0.05, 0.1].map(shaken_by);
        assert!(residuals.is_sorted_by(|a, b| a < b), "{residuals:?}");
        assert!((0.005..0.015).contains(&residuals[0]), "the noise is 1 cm: {residuals:?}");
    }
}
