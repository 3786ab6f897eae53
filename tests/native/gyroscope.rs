//! A gyroscope beside a lidar that spins between walls that look alike: a right one is used, and a wrong one does no harm.

use std::fmt::Write as _;

use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::{FrameLabel, PreparedFrame, SpatialReconstruction, SpatialSettings, Stage};
use scanstitch_scene::gyroscope::{Fault, corridor, readings, spinning};
use scanstitch_scene::moving_lidar::MovingLidar;
use scanstitch_scene::plaza::{around_the_plaza, plaza};
use scanstitch_scene::space::Space;

use crate::sweeps::pcd;

const NUM_SWEEPS: usize = 9;

/// Largest errors (m, degrees) of good sweeps, their number, and the notes of a drive with a gyroscope that has this fault, or without one. The
/// readings come as comments in the files, as those of a bag do.
fn errors(space: &Space, pose: impl Fn(f64) -> Pose3 + Copy, fault: Option<Fault>) -> ([f64; 2], usize, String) {
    let (lidar, count) = (MovingLidar::rings(16, 400), NUM_SWEEPS);
    let mut reconstruction = SpatialReconstruction::new(SpatialSettings::default()).unwrap();
    for index in 0..count {
        let start = lidar.period * index as f64;
        let mut bytes = String::new();
        for (time, rate) in fault.iter().flat_map(|fault| readings(pose, [start - 0.15, start + 0.25], *fault, 7)) {
            let _ = writeln!(bytes, "# gyro {} {} {} {}", time - start, rate.x, rate.y, rate.z);
        }
        let mut bytes = bytes.into_bytes();
        bytes.extend(pcd(&lidar.sweep(space, pose, start, index as u64)));
        let name = format!("{index}.pcd");
        let config = reconstruction.begin(&name, &bytes).unwrap().clone();
        let label = FrameLabel { name, index, time: Some(1e9 + start) };
        let frame = PreparedFrame::from_cloud(&config, label, &bytes).unwrap();
        reconstruction.add(PreparedFrame::from_bytes(&frame.to_bytes()).unwrap()).unwrap();
        while reconstruction.step().stage != Stage::Done {}
    }
    let off = |(index, found): (usize, &Pose3)| {
        let error = (pose(0.0).inverse() * pose(lidar.period * index as f64)).inverse() * found;
        [error.translation_norm(), error.rotation_angle().to_degrees()]
    };
    let worst = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].max(b[1])];
    let (poses, assessments) = (reconstruction.poses(), reconstruction.assessments());
    let is_good = |index: &usize| assessments[*index].status == Status::Good;
    let good: Vec<usize> = (0..count).filter(is_good).collect();
    let largest = good.iter().map(|&index| off((index, &poses[index]))).fold([0.0; 2], worst);
    (largest, good.len(), reconstruction.result().notes.join("\n"))
}

#[test]
fn no_good_sweep_is_turned_where_a_lidar_begins_to_spin_in_a_corridor_without_a_usable_gyroscope() {
    let (space, pose) = (corridor(), |time| spinning(8.0, time));
    for fault in [None, Some(Fault::Saturated), Some(Fault::Axes)] {
        let (off, num_good, notes) = errors(&space, pose, fault);
        // Turned by half a turn it would be off by metres; one is by 0.31 m, along the corridor.
        assert!(off[0] < 0.5 && off[1] < 1.5 && num_good > 6, "{fault:?}: {off:?}, {num_good}, {notes}");
    }
}

/// By 80 to 130 degrees a sweep: two sweeps fit one another as well at another rate of turn, by which the corridor has three ends or one.
#[test]
fn no_good_sweep_is_turned_where_a_lidar_spins_faster_than_sweeps_tell() {
    for rate in [14.0, 17.0, -17.0] {
        let (off, num_good, notes) = errors(&corridor(), |time| spinning(rate, time), None);
        assert!(off[0] < 0.3 && off[1] < 1.5, "{rate} rad/s: {off:?}, {num_good}, {notes}");
    }
}

#[test]
fn a_lidar_that_spins_in_a_corridor_is_followed_by_its_gyroscope() {
    let (space, pose) = (corridor(), |time| spinning(8.0, time));
    let (with, num_good, notes) = errors(&space, pose, Some(Fault::None));
    assert!(with[1] < 1.5 && num_good == NUM_SWEEPS, "{with:?}, {num_good}, {notes}");
    assert!(notes.contains("The gyroscope is used where clouds turn"), "{notes}");
}

#[test]
fn a_wrong_gyroscope_does_no_harm() {
    let (space, pose) = (plaza(1), |time| around_the_plaza(3.0, 1.5, time));
    let (without, num_good, notes) = errors(&space, pose, None);
    assert!(num_good == NUM_SWEEPS && !notes.contains("gyroscope"), "{notes}");
    for (name, fault) in Fault::ALL {
        let (with, num_good, notes) = errors(&space, pose, Some(fault));
        assert_eq!(num_good, NUM_SWEEPS, "{name}: {notes}");
        assert!(with[0] < without[0] + 0.01 && with[1] < without[1] + 0.1, "{name}: {with:?}, {without:?}");
        assert!(notes.contains("The gyroscope is"), "{name}: {notes}");
        let is_refuted = notes.contains("The gyroscope is not used");
        // Of a turn that stays the same another clock says the same.
        assert_eq!(is_refuted, !matches!(fault, Fault::None | Fault::Clock), "{name}: {notes}");
    }
}
