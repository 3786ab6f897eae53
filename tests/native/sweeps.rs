//! Lidars that move while they turn: sweeps are straightened by the times of their points.

use nalgebra::{Matrix3, UnitQuaternion, Vector3, Vector6};
use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::cloud::{CloudOdometry, CloudOptions, GlobalRegistrationUse, PreparedCloud, SweepOdometry};
use scanstitch::pipeline::{FrameLabel, PreparedFrame, SpatialReconstruction, SpatialSettings, Stage};
use scanstitch::preprocess::deskew::deskew;
use scanstitch_scene::gyroscope::corridor;
use scanstitch_scene::moving_lidar::MovingLidar;
use scanstitch_scene::plaza::{around_the_plaza, plaza};
use scanstitch_scene::space::{Shape, Solid, Space};
use scanstitch_scene::spinning_lidar::SpinningLidar;
use scanstitch_scene::straight_corridor::{along, pillared, short_sighted};
use scanstitch_scene::streets::{drive, streets};

/// Half the sides of the room (m).
const HALF: [f64; 3] = [7.0, 5.0, 2.0];

/// A room about the origin, with two pillars.
fn room() -> Space {
    let solid = |half: Vector3<f64>, center| Solid {
        shape: Shape::Cuboid { half },
        R_world_solid: Matrix3::identity(),
        center,
        material: 0,
    };
    let wall = |number: usize| {
        let (axis, side) = (number / 2, if number.is_multiple_of(2) { 1.0 } else { -1.0 });
        let mut half = Vector3::from(HALF).add_scalar(1.0);
        half[axis] = 0.5;
        solid(half, Vector3::ith(axis, side * (HALF[axis] + 0.5)))
    };
    let pillar = |x, y| solid(Vector3::new(0.3, 0.2, 2.0), Vector3::new(x, y, 0.0));
    Space::new((0..6).map(wall).chain([pillar(3.5, 2.5), pillar(-4.0, -1.5)]).collect(), Vec::new(), Vec::new(), None)
}

/// On a circle of 1 m at 2 m/s and 2 rad/s.
fn pose(time: f64) -> Pose3 {
    let R = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.0 * time);
    Pose3::from_parts((R * -Vector3::y()).into(), R)
}

fn start(sweep: usize) -> f64 {
    0.1 * sweep as f64
}

/// In the room, or on the square, there with this speed (m/s) and rate of turn (rad/s).
#[derive(Clone, Copy)]
enum Place {
    Room,
    Square(f64, f64),
}

impl Place {
    fn pose(self, time: f64) -> Pose3 {
        match self {
            Self::Room => pose(time),
            Self::Square(speed, rate) => around_the_plaza(speed, rate, time),
        }
    }

    fn sweeps(self, lidar: &MovingLidar, count: usize, has_skew: bool) -> Vec<PointCloud> {
        let space = match self {
            Self::Room => room(),
            Self::Square(..) => plaza(1),
        };
        let sweep = |number: usize| {
            let place = |time| self.pose(if has_skew { time } else { start(number) });
            lidar.sweep(&space, place, start(number), number as u64)
        };
        (0..count).map(sweep).collect()
    }

    /// Largest error of a position (m) and of a turn (rad).
    fn errors(self, poses: &[Pose3]) -> (f64, f64) {
        let off = |(number, found): (usize, &Pose3)| {
            let error = (self.pose(0.0).inverse() * self.pose(start(number))).inverse() * found;
            (error.translation_norm(), error.rotation_angle())
        };
        poses.iter().enumerate().map(off).fold((0.0, 0.0), |(a, b), (c, d)| (f64::max(a, c), f64::max(b, d)))
    }
}

fn as_they_are(clouds: &[PointCloud], voxel_size: f64) -> Vec<Pose3> {
    let options = CloudOptions::new(voxel_size);
    let mut odometry = CloudOdometry::new(options).unwrap();
    let prepared = |cloud| PreparedCloud::new(cloud, &options).unwrap();
    clouds.iter().map(|cloud| odometry.register_frame(prepared(cloud)).T_world_sensor).collect()
}

fn straightened(clouds: &[PointCloud], voxel_size: f64) -> (Vec<Pose3>, SweepOdometry) {
    let options = CloudOptions::new(voxel_size);
    let mut odometry = SweepOdometry::new(options).unwrap();
    let mut poses = Vec::new();
    for (number, cloud) in clouds.iter().enumerate() {
        let cloud = PreparedCloud::downsampled(cloud, &options).unwrap();
        let found = odometry.register_sweep(cloud, Some(start(number))).estimate;
        assert_eq!(found.assessment.status, Status::Good, "{number}: {}", found.assessment.reason);
        poses.push(found.T_world_sensor);
    }
    (poses, odometry)
}

#[test]
fn a_sweep_that_is_straightened_is_as_good_as_one_without_skew() {
    for (place, lidar, voxel_size) in
        [(Place::Room, MovingLidar::rings(16, 600), 0.12), (Place::Square(2.0, 1.0), MovingLidar::rosette(), 0.5)]
    {
        let (still, skewed) = (place.sweeps(&lidar, 8, false), place.sweeps(&lidar, 8, true));
        let [without, left_in] = [&still, &skewed].map(|clouds| place.errors(&as_they_are(clouds, voxel_size)));
        let (poses, odometry) = straightened(&skewed, voxel_size);
        let found = place.errors(&poses);
        let about = format!("{found:?}, without skew {without:?}, with skew left in {left_in:?}");
        // Noise and places of the points differ between the two.
        assert!(found.0 < 0.01 + 1.2 * without.0 && found.0 < 0.05 && found.1 < 0.005, "{lidar:?}: {about}");
        assert!(left_in.0 > 3.0 * found.0, "{lidar:?}: {about}");
        assert!(odometry.notes()[0].contains("Sweeps are straightened"), "{:?}", odometry.notes());
    }
}

/// Its view is 70 degrees wide, and the second sweep is 11 degrees farther: neither rest nor features tell where that is.
#[test]
fn a_narrow_view_that_turns_quickly_is_followed_from_the_first_sweep_on() {
    let place = Place::Square(0.5, 2.0);
    let (poses, _) = straightened(&place.sweeps(&MovingLidar::rosette(), 3, true), 0.5);
    let found = place.errors(&poses);
    assert!(found.0 < 0.1 && found.1 < 0.01, "{found:?}");
}

/// Drivers straighten sweeps and keep the times: straightened once more they would be bent the other way.
#[test]
fn sweeps_that_are_straight_already_are_left_as_they_are() {
    let velocity = pose(0.0).inverse() * pose(0.1);
    let velocity = velocity.log() / 0.1;
    let straight = |cloud: PointCloud| PointCloud { times: cloud.times.clone(), ..deskew(cloud, &velocity, 0.0) };
    let clouds: Vec<PointCloud> =
        Place::Room.sweeps(&MovingLidar::rings(16, 600), 14, true).into_iter().map(straight).collect();
    let (poses, odometry) = straightened(&clouds, 0.12);
    assert!(odometry.is_refuted() && odometry.notes()[0].contains("straightened already"), "{:?}", odometry.notes());
    // Motions of the last sweeps, which are registered as they are.
    let step = |poses: &[Pose3]| poses[12].inverse() * poses[13];
    let truth: Vec<Pose3> = (0..14).map(|number| pose(start(number))).collect();
    let error = step(&truth).inverse() * step(&poses);
    assert!(error.translation_norm() < 0.02 && error.rotation_angle() < 0.005, "{error}");
    // Half a sweep of the motion that was thought to bend them is a decimetre.
    let (metres, _) = Place::Room.errors(&poses);
    assert!(metres < 0.06, "{metres} m");
    // Those before that was found are not left bent.
    assert_lies_on_walls(&mut reconstruct(SpatialSettings::default(), &clouds, |index| Some(start(index))), 0);
}

/// As an Ouster's driver writes it: nanoseconds from the stamp, in 32 bits.
#[test]
fn the_second_usable_sweep_tells_the_velocity_of_the_first_one() {
    let clouds = Place::Room.sweeps(&MovingLidar::rings(16, 720), 2, true);
    let options = CloudOptions::new(0.1);
    let mut odometry = SweepOdometry::new(options).unwrap();
    let nothing = PointCloud { positions: vec![glam::Vec3::X; 3], ..PointCloud::default() };
    let lost = odometry.register_sweep(nothing, Some(start(0)));
    assert_eq!((lost.estimate.assessment.status, lost.velocities.len()), (Status::Lost, 0));
    let mut numbers = Vec::new();
    for (number, cloud) in clouds.iter().enumerate() {
        let cloud = PreparedCloud::downsampled(cloud, &options).unwrap();
        let found = odometry.register_sweep(cloud, Some(start(number + 1)));
        assert_eq!(found.estimate.assessment.status, Status::Good, "{number}");
        numbers.push(found.velocities.iter().map(|(number, _)| *number).collect::<Vec<_>>());
    }
    assert_eq!(numbers, [vec![], vec![2, 1]]);
}

pub(crate) fn pcd(cloud: &PointCloud) -> Vec<u8> {
    let count = cloud.len();
    let (name, offsets) = match &cloud.times {
        Some(times) => ("t", times.offsets.clone()),
        None => ("ring", vec![0.0; count]),
    };
    let header = format!(
        "VERSION 0.7\nFIELDS x y z {name}\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {count}\nHEIGHT 1\nPOINTS {count}\nDATA binary\n"
    );
    let rows = cloud.positions.iter().zip(&offsets).flat_map(|(p, offset)| {
        [p.x, p.y, p.z].map(f32::to_le_bytes).into_iter().chain([((f64::from(*offset) * 1e9) as u32).to_le_bytes()])
    });
    [header.into_bytes(), rows.flatten().collect()].concat()
}

/// The clouds as files, each `time(number)` after the epoch.
fn reconstruct(
    settings: SpatialSettings,
    clouds: &[PointCloud],
    time: impl Fn(usize) -> Option<f64>,
) -> SpatialReconstruction {
    let mut reconstruction = SpatialReconstruction::new(settings).unwrap();
    for (index, cloud) in clouds.iter().enumerate() {
        let (name, bytes) = (format!("{index}.pcd"), pcd(cloud));
        let config = reconstruction.begin(&name, &bytes).unwrap().clone();
        let frame = PreparedFrame::from_cloud(&config, FrameLabel { name, index, time: time(index) }, &bytes).unwrap();
        reconstruction.add(PreparedFrame::from_bytes(&frame.to_bytes()).unwrap()).unwrap();
        while reconstruction.step().stage != Stage::Done {}
        // The map is stitched as it grows: the first sweep is in it before its velocity is known.
        reconstruction.map();
    }
    reconstruction
}

/// The second one is metres off and doubtful: the good ones that follow it are good relative to one another, and not to the first.
#[test]
fn clouds_on_two_sides_of_a_doubtful_one_are_not_both_good() {
    let place = Place::Square(0.5, 2.0);
    let clouds = place.sweeps(&MovingLidar::rosette(), 8, false);
    let clouds: Vec<_> = clouds.into_iter().map(|cloud| PointCloud { times: None, ..cloud }).collect();
    let settings = SpatialSettings {
        global_registration: GlobalRegistrationUse::Never,
        voxel_size: 0.5,
        ..SpatialSettings::default()
    };
    let reconstruction = reconstruct(settings, &clouds, |_| None);
    let (poses, assessments) = (reconstruction.poses(), reconstruction.assessments());
    let good: Vec<usize> = (0..8).filter(|&number| assessments[number].status == Status::Good).collect();
    assert!(good.len() >= 3, "{assessments:?}");
    assert!(
        assessments[0].reason.contains("most frames are certain relative to each other but not to it"),
        "{assessments:?}"
    );
    for pair in good.windows(2) {
        let truth = place.pose(start(pair[0])).inverse() * place.pose(start(pair[1]));
        let error = truth.inverse() * (poses[pair[0]].inverse() * poses[pair[1]]);
        assert!(error.translation_norm() < 0.15, "{pair:?}: {error}");
    }
}

#[test]
fn a_map_is_made_of_straightened_sweeps_the_first_one_included() {
    let clouds = Place::Room.sweeps(&MovingLidar::rings(16, 720), 5, true);
    let mut reconstruction = reconstruct(SpatialSettings::default(), &clouds, |index| Some(1.7e9 + start(index)));
    let (metres, radians) = Place::Room.errors(&reconstruction.poses());
    assert!(metres < 0.02 && radians < 0.005, "{metres} m, {radians} rad");
    let notes = reconstruction.result().notes;
    assert!(notes.iter().any(|note| note.contains("in nanoseconds from the time stamp")), "{notes:?}");
    assert!(notes.iter().any(|note| note.contains("Sweeps are straightened")), "{notes:?}");
    assert_lies_on_walls(&mut reconstruction, 0);
}

/// Whether what a sweep gave to the map lies on the walls of the room. A tenth are pillars; bent, a sweep is a decimetre off at its end.
fn assert_lies_on_walls(reconstruction: &mut SpatialReconstruction, sweep: u32) {
    assert_lies_on_walls_from(reconstruction, sweep, pose(0.0));
}

/// The same where the world's origin is at this pose in the room.
fn assert_lies_on_walls_from(reconstruction: &mut SpatialReconstruction, sweep: u32, first: Pose3) {
    let off_walls = |point: &glam::Vec3| {
        let point = (first * nalgebra::Point3::new(point.x, point.y, point.z).cast::<f64>()).coords;
        (0..3).map(|axis| (HALF[axis] - point[axis].abs()).abs()).fold(f64::INFINITY, f64::min)
    };
    let (points, frames) = (reconstruction.map().cloud().positions, reconstruction.map().frames());
    let of_sweep = points.iter().zip(&frames).filter(|(_, frame)| **frame == sweep);
    let mut off: Vec<f64> = of_sweep.map(|(point, _)| off_walls(point)).collect();
    off.sort_by(f64::total_cmp);
    let most = off[off.len() * 8 / 10];
    assert!(off.len() > 1000 && most < 0.05, "{} points, {most} m", off.len());
}

/// Sweeps without times; `is_kitti`: ring after ring, from behind, and clockwise, in a room that is mirrored.
fn without_times(clouds: Vec<PointCloud>, is_kitti: bool) -> Vec<PointCloud> {
    let ring_by_ring = |points: Vec<glam::Vec3>| -> Vec<glam::Vec3> {
        let mut points: Vec<_> = points.iter().map(|p| glam::Vec3::new(-p.x, p.y, p.z)).collect();
        let elevation = |p: &glam::Vec3| (p.z / p.truncate().length()).atan().to_degrees().round() as i32;
        points.sort_by_key(elevation);
        points
    };
    let file = |cloud: PointCloud| {
        PointCloud::from_positions(if is_kitti { ring_by_ring(cloud.positions) } else { cloud.positions })
    };
    clouds.into_iter().map(file).collect()
}

/// Largest errors (m, rad) of the motions from cloud to cloud, from this one on, of sensors that are seen in the middle of a sweep.
fn errors_of_steps(poses: &[Pose3], first: usize, is_mirrored: bool) -> (f64, f64) {
    let truth = |number: usize| {
        let step = (pose(start(number) + 0.05).inverse() * pose(start(number + 1) + 0.05)).log();
        let sign = if is_mirrored { -1.0 } else { 1.0 };
        // Mirrored along x: turns about y and z, and the way along x.
        Pose3::exp(&Vector6::new(step[0], sign * step[1], sign * step[2], sign * step[3], step[4], step[5]))
    };
    let off = |number: usize| {
        let error = truth(number).inverse() * (poses[number].inverse() * poses[number + 1]);
        (error.translation_norm(), error.rotation_angle())
    };
    (first..poses.len() - 1).map(off).fold((0.0, 0.0), |(a, b), (c, d)| (f64::max(a, c), f64::max(b, d)))
}

/// KITTI's raw sweeps have no times: their azimuth tells them, whichever way the lidar turns, if the data confirm that.
#[test]
fn sweeps_without_times_are_straightened_by_their_azimuth_where_the_data_confirm_it() {
    for (is_kitti, told) in [(false, "turns counterclockwise"), (true, "turns clockwise")] {
        let clouds = Place::Room.sweeps(&MovingLidar::rings(16, 600), 16, true);
        let clouds = without_times(clouds, is_kitti);
        let mut reconstruction = reconstruct(SpatialSettings::default(), &clouds, |index| Some(start(index)));
        let notes = reconstruction.result().notes.join("\n");
        assert!(notes.contains(told) && notes.contains("Sweeps are straightened"), "{notes}");
        // The map begins anew with the decision: the first sweeps after it have no more to rest on than the one before.
        let (metres, radians) = errors_of_steps(&reconstruction.poses(), 11, is_kitti);
        assert!(metres < 0.02 && radians < 0.01, "{metres} m, {radians} rad");
        if !is_kitti {
            // Sweeps before the decision are straight, too, as seen from where they were found.
            let first = pose(start(3) + 0.05) * reconstruction.poses()[3].inverse();
            assert_lies_on_walls_from(&mut reconstruction, 3, first);
        }
    }
}

/// Those of KITTI's odometry benchmark are straight.
#[test]
fn straight_sweeps_without_times_are_left_as_they_are() {
    let clouds = without_times(Place::Room.sweeps(&MovingLidar::rings(16, 600), 12, false), true);
    let reconstruction = reconstruct(SpatialSettings::default(), &clouds, |index| Some(start(index)));
    let notes = reconstruction.result().notes.join("\n");
    assert!(notes.contains("Clouds fit one another better as they are") && !notes.contains("Sweeps are"), "{notes}");
    let (metres, radians) = errors_of_steps(&reconstruction.poses(), 0, true);
    assert!(metres < 0.02 && radians < 0.005, "{metres} m, {radians} rad");
}

/// Straightened either way they fit one another a hundredth better than as they are, which says nothing of either.
#[test]
fn scans_of_a_street_without_times_are_not_taken_for_sweeps() {
    let lidar = SpinningLidar { azimuth_step: 1f64.to_radians(), max_range: 60.0, ..SpinningLidar::default() };
    let (space, truth) = (streets(2, false), drive(2.0));
    let scan = |(pose, seed)| lidar.scan(&space, pose, seed);
    let clouds: Vec<PointCloud> = truth.iter().zip(20_000..).take(20).map(scan).collect();
    let reconstruction = reconstruct(SpatialSettings::default(), &clouds, |_| None);
    let notes = reconstruction.result().notes.join("\n");
    assert!(!notes.contains("Sweeps are"), "{notes}");
    let off = |(truth_now, pose): (&Pose3, &Pose3)| (truth_now.inverse() * truth[0] * pose).translation_norm();
    let largest = truth.iter().zip(&reconstruction.poses()).map(off).fold(0.0, f64::max);
    assert!(largest < 0.1, "{largest} m");
}

/// Good sweeps after the first of a straight drive, and the largest error of their positions (m).
fn good_along(space: &Space, pose: impl Fn(f64) -> Pose3) -> (usize, f64) {
    let (lidar, options) = (short_sighted(MovingLidar::rings(16, 1800)), CloudOptions::new(0.05));
    let mut odometry = SweepOdometry::new(options).unwrap();
    let (mut num_good, mut largest) = (0, 0.0);
    for number in 0..8 {
        let sweep = lidar.sweep(space, &pose, start(number), number as u64);
        let cloud = PreparedCloud::downsampled(&sweep, &options).unwrap();
        let found = odometry.register_sweep(cloud, Some(start(number))).estimate;
        if number > 0 && found.assessment.status == Status::Good {
            let truth = pose(0.0).inverse() * pose(start(number));
            num_good += 1;
            largest = f64::max(largest, (truth.inverse() * found.T_world_sensor).translation_norm());
        }
    }
    (num_good, largest)
}

#[test]
fn no_sweep_is_good_in_a_bare_corridor_and_each_is_between_pillars() {
    let (bare, _) = good_along(&corridor(), along(1.0, 1));
    let (with_pillars, largest) = good_along(&pillared(1), along(1.0, 1));
    assert_eq!(bare, 0, "nothing measures the motion along a bare corridor");
    assert!(with_pillars == 7 && largest < 0.05, "{with_pillars}, {largest}");
}
