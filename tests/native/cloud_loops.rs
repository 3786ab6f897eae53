//! Loops of clouds: a lidar that comes back to a street is recognised there, and the drift of its path is distributed.

use nalgebra::{Matrix6, Vector6};
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::graph::loops::clouds::CloudLoops;
use scanstitch::odometry::cloud::{CloudOptions, PreparedCloud, RegisteredCloud};
use scanstitch_scene::spinning_lidar::SpinningLidar;
use scanstitch_scene::streets::{drive, streets};

/// Distance of the poses (m).
const STEP: f64 = 4.0;
/// The first street is driven through twice: from the beginning of the way, and from this pose on, ...
const REVISIT: usize = 98;
/// ... for so many poses.
const NUM_POSES: usize = 18;

/// The poses at which the drive is measured: all of both visits, and a few between.
fn measured() -> Vec<(usize, Pose3)> {
    let is_measured = |index: usize| !(NUM_POSES..REVISIT).contains(&index) || index.is_multiple_of(6);
    drive(STEP).into_iter().enumerate().take(REVISIT + NUM_POSES).filter(|(index, _)| is_measured(*index)).collect()
}

/// Drives with an odometry that drifts by this motion between the visits; how many loops there are after each pose, and the error (m) of the
/// last pose relative to the one of the first visit at the same place.
fn close_loops(drift: &Vector6<f64>) -> (Vec<usize>, f64) {
    let (space, options) = (streets(1, false), CloudOptions::new(0.3));
    let lidar = SpinningLidar { azimuth_step: 1.5f64.to_radians(), max_range: 60.0, ..SpinningLidar::default() };
    let mut loops = CloudLoops::new(options);
    let (mut counts, mut poses) = (Vec::new(), Vec::new());
    // Standard deviations of a step: 10 mrad and 0.3 m, as such a drift has.
    let step_information = Matrix6::from_diagonal(&Vector6::new(1e4, 1e4, 1e4, 11.0, 11.0, 11.0));
    let way = measured();
    for (number, (index, truth)) in way.iter().enumerate() {
        let cloud = PreparedCloud::new(&lidar.scan(&space, truth, *index as u64), &options).unwrap();
        let share = (*index as f64 - NUM_POSES as f64) / (REVISIT - NUM_POSES) as f64;
        let T_world_cloud = Pose3::exp(&(drift * share.clamp(0.0, 1.0))) * truth;
        loops.add(number as u32, &RegisteredCloud { cloud: &cloud, T_world_cloud, number, step_information });
        poses.push(loops.correction() * T_world_cloud);
        for (frame, motion) in loops.close().into_iter().flatten() {
            poses[frame as usize] = motion * poses[frame as usize];
        }
        counts.push(loops.report().num_closed);
    }
    let (first, last) = (NUM_POSES - 1, way.len() - 1);
    let truth = way[first].1.inverse() * way[last].1;
    (counts, (truth.inverse() * poses[first].inverse() * poses[last]).translation_norm())
}

#[test]
fn a_street_that_is_driven_through_again_is_recognised_and_its_drift_taken_out() {
    let drift = Vector6::new(0.0, 0.0, 0.005, 2.2, -1.4, 0.0);
    let (counts, error) = close_loops(&drift);
    // 2.6 m, and 0.35 m for the turn, as far as the street is long.
    assert!(error < 0.7, "{error} m, {counts:?}");
    let first = counts.iter().find(|count| **count > 0);
    assert!(first.is_some_and(|count| *count >= 2), "a single place is confirmed by another one: {counts:?}");
}

/// The same scans farther away than the path can have drifted are those of a place that looks alike: a parallel street, the next floor.
#[test]
fn a_place_that_looks_alike_beyond_any_drift_closes_no_loop() {
    for apart in [[60.0, 30.0, 0.0], [0.0, 0.0, 4.8], [4.0, -4.0, 0.0]] {
        let (counts, _) = close_loops(&Vector6::new(0.0, 0.0, 0.0, apart[0], apart[1], apart[2]));
        assert_eq!(counts.last(), Some(&0), "{apart:?}");
    }
}
