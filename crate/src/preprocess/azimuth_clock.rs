//! Times of points by their azimuth, for sweeps of a spinning lidar whose files have none (KITTI's).

use std::f64::consts::{PI, TAU};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::geometry::PointTimes;

/// Duration of a turn (s): lidars are set to ten turns a second unless somebody changes that.
pub const TURN: f64 = 0.1;
/// A lidar that spins sees something in as many sectors ...
const SECTORS: usize = 36;
/// ... of which so many may be empty: behind it is the vehicle or a person.
const MAX_EMPTY: usize = 9;
/// Turns of the azimuth from the first point to the last, where these are in the order of their measurement.
const ONE_TURN: std::ops::Range<f64> = 0.8..1.2;

/// How the azimuth about z tells the time: one turn a sweep, whose middle is the time stamp.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AzimuthClock {
    /// Where a turn begins (rad).
    pub seam: f64,
    /// Which way the lidar turns, seen from above.
    pub is_clockwise: bool,
}

impl AzimuthClock {
    /// Where a turn begins: at the first point, where the points are in the order of their measurement, and otherwise behind, as
    /// KITTI's ("Vision meets robotics: the KITTI dataset", IJRR 2013: the stamp is when the lidar faces forward). `None` where
    /// the points are not all around.
    #[inline(never)]
    pub fn seam_of(points: &[Vec3]) -> Option<f64> {
        let azimuths: Vec<f64> = points.iter().map(azimuth).filter(|azimuth| azimuth.is_finite()).collect();
        let mut is_seen = [false; SECTORS];
        for azimuth in &azimuths {
            is_seen[(((azimuth + PI) / TAU * SECTORS as f64) as usize).min(SECTORS - 1)] = true;
        }
        let num_empty = is_seen.iter().filter(|is_seen| !**is_seen).count();
        let step = |pair: &[f64]| pair[1] - pair[0] - TAU * ((pair[1] - pair[0]) / TAU).round();
        let turned = azimuths.windows(2).map(step).sum::<f64>() / TAU;
        let seam = if ONE_TURN.contains(&turned.abs()) { azimuths[0] } else { PI };
        (num_empty <= MAX_EMPTY).then_some(seam)
    }

    /// The times of points (s), from the time stamp.
    pub fn times(&self, points: &[Vec3]) -> PointTimes {
        let share = |point: &Vec3| ((azimuth(point) - self.seam) / TAU).rem_euclid(1.0);
        let forward = |share: f64| if self.is_clockwise { 1.0 - share } else { share };
        let offsets = points.iter().map(|point| (TURN * forward(share(point))) as f32).collect();
        PointTimes { origin: -0.5 * TURN, offsets }
    }
}

fn azimuth(point: &Vec3) -> f64 {
    f64::from(point.y).atan2(f64::from(point.x))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(azimuth: f64) -> Vec3 {
        Vec3::new(azimuth.cos() as f32, azimuth.sin() as f32, 0.3)
    }

    #[test]
    fn a_turn_begins_at_the_first_point_or_behind() {
        let turn: Vec<Vec3> = (0..720).map(|step| at(1.0 + TAU * f64::from(step) / 720.0)).collect();
        assert!((AzimuthClock::seam_of(&turn).unwrap() - 1.0).abs() < 1e-6);
        assert_eq!(AzimuthClock::seam_of(&[turn.clone(), turn.clone()].concat()), Some(PI), "ring after ring");
        assert_eq!(AzimuthClock::seam_of(&turn[..360]), None);
        assert_eq!(AzimuthClock::seam_of(&[]), None);
    }

    #[test]
    fn the_stamp_is_the_middle_of_the_turn() {
        for (is_clockwise, sign) in [(false, 1.0), (true, -1.0)] {
            let clock = AzimuthClock { seam: PI, is_clockwise };
            let times = clock.times(&[at(-3.1), at(0.0), at(1.5), at(3.1)]);
            let seconds = |index: usize| times.origin + f64::from(times.offsets[index]);
            assert!(seconds(1).abs() < 1e-6 && (seconds(2) - sign * TURN * 1.5 / TAU).abs() < 1e-6, "{times:?}");
            assert!((seconds(3) - seconds(0) - sign * TURN * 6.2 / TAU).abs() < 1e-6, "{times:?}");
        }
    }
}
