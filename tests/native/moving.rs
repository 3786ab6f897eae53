//! Cars and people that move are no part of the map, and what rests stays in it.

use nalgebra::Vector3;
use scanstitch::geometry::RigidMotion;
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::{FrameLabel, PreparedFrame, SpatialReconstruction, SpatialSettings, Stage};
use scanstitch_scene::spinning_lidar::SpinningLidar;
use scanstitch_scene::streets::{drive, streets};
use scanstitch_scene::traffic::{is_of_traffic, with_traffic};

use crate::sweeps::pcd;

/// Seconds from sweep to sweep.
const PERIOD: f64 = 0.1;

/// A finished run along a street, and the points of its map before and after that: of what moves, and at rest.
fn driven(moves: bool, num_sweeps: usize) -> (SpatialReconstruction, [[usize; 2]; 2]) {
    let lidar = SpinningLidar { azimuth_step: 0.4f64.to_radians(), max_range: 50.0, ..SpinningLidar::default() };
    let (space, truth) = (streets(1, false), drive(1.0));
    let mut reconstruction = SpatialReconstruction::new(SpatialSettings::default()).unwrap();
    for (index, pose) in truth.iter().enumerate().take(num_sweeps) {
        let space = if moves { with_traffic(&space, PERIOD * index as f64) } else { space.clone() };
        let (name, bytes) = (format!("{index}.pcd"), pcd(&lidar.scan(&space, pose, index as u64)));
        let config = reconstruction.begin(&name, &bytes).unwrap().clone();
        let frame = PreparedFrame::from_cloud(&config, FrameLabel { name, index, time: None }, &bytes).unwrap();
        reconstruction.add(frame).unwrap();
        while reconstruction.step().stage != Stage::Done {}
    }
    let counted = |reconstruction: &mut SpatialReconstruction| {
        let (points, frames) = (reconstruction.map().cloud().positions, reconstruction.map().frames());
        let mut counts = [0; 2];
        for (point, frame) in points.iter().zip(frames) {
            let point = truth[0].act(&Vector3::from(point.as_dvec3().to_array()));
            counts[usize::from(!is_of_traffic(&point, PERIOD * f64::from(frame), 0.25))] += 1;
        }
        counts
    };
    let before = counted(&mut reconstruction);
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    assert!(reconstruction.assessments().iter().all(|one| one.status == Status::Good));
    let after = counted(&mut reconstruction);
    (reconstruction, [before, after])
}

#[test]
fn what_later_sweeps_see_through_leaves_the_map_and_is_counted() {
    let (reconstruction, [before, after]) = driven(true, 30);
    assert!(before[0] > 2000 && 2 * after[0] < before[0], "{before:?}, {after:?}");
    assert!(before[1] - after[1] < before[1] / 500, "{before:?}, {after:?}");
    let result = reconstruction.result();
    assert!(result.num_moved_points > 1000, "{}", result.num_moved_points);
    let said = format!("What moved is left out of the map: {} points", result.num_moved_points);
    assert!(result.notes.iter().any(|note| note.starts_with(&said)), "{:?}", result.notes);
    let sizes = reconstruction.map_sizes(&[reconstruction.result().settings.map_voxel_size]);
    assert_eq!(sizes[0].num_points, after[0] + after[1], "sizes of the map count what is left");
}

#[test]
fn of_a_street_where_nothing_moves_nothing_is_taken() {
    let (reconstruction, [before, after]) = driven(false, 12);
    let num_taken = (before[0] + before[1]) - (after[0] + after[1]);
    assert!(num_taken * 2000 < before[1], "{num_taken} of {before:?}, {:?}", reconstruction.result().notes);
}
