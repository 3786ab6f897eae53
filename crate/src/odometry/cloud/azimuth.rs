//! Whether clouds without times are sweeps of a spinning lidar that moved: each is registered to the one before it as they are, and straightened
//! by their azimuth for either direction of turning, until the data decide.

use nalgebra::Vector6;

use super::skew_test::{SkewTest, left_over};
use super::{CloudOptions, PreparedCloud, RegisteredCloud};
use crate::geometry::quantile::quantile;
use crate::geometry::{PointCloud, Pose3, RigidMotion};
use crate::preprocess::azimuth_clock::{AzimuthClock, TURN};
use crate::preprocess::deskew::deskew;

/// Clouds that decide at least: by chance one recording in 600 that is not bent has as much for either direction (Student's t, 7 degrees of
/// freedom, one side).
const MIN_COMPARED: usize = 8;
/// Clouds that are compared at most: where so many leave it open, the difference matters little.
const MAX_COMPARED: usize = 20;

/// The hypothesis that clouds are bent by the motion of the sensor during a turn, with what speaks for it and against it.
pub(crate) struct AzimuthGuess {
    clocks: [AzimuthClock; 2],
    tests: [SkewTest; 2],
    /// Whether the first clock leaves less over than the second one: straightened either way, clouds that are not bent may fit one another
    /// a hundredth better than as they are.
    is_first: SkewTest,
    last: Option<Last>,
    num_compared: usize,
    /// Velocities of the sensor during the clouds so far, by the number of the frame.
    velocities: Vec<(usize, Vector6<f64>)>,
}

/// The cloud before.
struct Last {
    /// Its registered points.
    cloud: PointCloud,
    T_world_cloud: Pose3,
    /// The time stamp (s).
    time: Option<f64>,
    frame: usize,
}

/// What is known of the hypothesis.
pub(crate) enum Guess {
    /// Nothing yet.
    Open,
    /// Clouds are bent, as this clock says, and these are the velocities.
    Confirmed(AzimuthClock, Vec<(usize, Vector6<f64>)>),
    /// They are left as they are; whether the data refute that they are bent.
    Dropped(bool),
}

impl AzimuthGuess {
    /// Of turns that begin at this azimuth (rad).
    pub fn new(seam: f64) -> Self {
        let clocks = [false, true].map(|is_clockwise| AzimuthClock { seam, is_clockwise });
        let (tests, is_first) = Default::default();
        Self { clocks, tests, is_first, last: None, num_compared: 0, velocities: Vec::new() }
    }

    /// Compares the cloud that was registered last, of the frame of this number and at this time (s), with the one before.
    pub fn add(
        &mut self,
        (frame, time): (usize, Option<f64>),
        registered: &RegisteredCloud<'_>,
        options: &CloudOptions,
    ) -> Guess {
        let (cloud, T_world_cloud) =
            (registered.cloud.cloud().selected(&registered.cloud.registered()), registered.T_world_cloud);
        let Some(last) = self.last.replace(Last { cloud: cloud.clone(), T_world_cloud, time, frame }) else {
            return Guess::Open;
        };
        let motion = last.T_world_cloud.inverse() * T_world_cloud;
        let interval = time.zip(last.time).map(|(time, last)| time - last).filter(|interval| *interval > 0.0);
        let velocity = motion.log() / interval.unwrap_or(TURN);
        if self.velocities.is_empty() {
            self.velocities.push((last.frame, velocity));
        }
        self.velocities.push((frame, velocity));
        if bend(&cloud, &velocity) >= options.voxel_size {
            self.compare([last.cloud, cloud], &velocity, &motion, options);
        }
        self.judged()
    }

    /// Normals turn with their points: neighbours were measured at about the same time, but at the seam.
    fn compare(&mut self, clouds: [PointCloud; 2], velocity: &Vector6<f64>, motion: &Pose3, options: &CloudOptions) {
        self.num_compared += 1;
        let left = |pair: [PointCloud; 2]| left_over(pair.map(PreparedCloud::from_cloud).each_ref(), motion, options);
        let straightened = |clock: &AzimuthClock| {
            clouds.clone().map(|cloud| {
                let times = Some(clock.times(&cloud.positions));
                deskew(PointCloud { times, ..cloud }, velocity, 0.0)
            })
        };
        let straight = self.clocks.each_ref().map(|clock| left(straightened(clock)));
        let bent = left(clouds);
        for (test, straight) in self.tests.iter_mut().zip(straight) {
            test.add(bent, straight);
        }
        self.is_first.add(straight[1], straight[0]);
    }

    fn judged(&mut self) -> Guess {
        if self.num_compared < MIN_COMPARED {
            return Guess::Open;
        }
        let verdicts = self.tests.each_ref().map(|test| test.verdict);
        let better = self.is_first.verdict.map(|is_first| usize::from(!is_first));
        if let Some(which) = better.filter(|&which| verdicts[which] == Some(true)) {
            return Guess::Confirmed(self.clocks[which], std::mem::take(&mut self.velocities));
        }
        let is_refuted = verdicts == [Some(false); 2];
        if is_refuted || self.num_compared >= MAX_COMPARED { Guess::Dropped(is_refuted) } else { Guess::Open }
    }
}

/// How far this velocity moves a point at the median range during a turn (m).
fn bend(cloud: &PointCloud, velocity: &Vector6<f64>) -> f64 {
    let mut ranges: Vec<f64> = cloud.positions.iter().map(|point| f64::from(point.length())).collect();
    let range = quantile(&mut ranges, 0.5).unwrap_or(0.0);
    TURN * (velocity.fixed_rows::<3>(0).norm() * range + velocity.fixed_rows::<3>(3).norm())
}
