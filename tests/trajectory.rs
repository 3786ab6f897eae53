//! Trajectory files, real ones and broken ones.

use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use scanstitch::geometry::{Pose2, Pose3, RigidMotion};
use scanstitch::io::trajectory::{Trajectory, in_space, matrix_text, read, read_tum, tum_text};

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn shared_trajectories() -> Option<PathBuf> {
    Some(project().join("../shared/data/trajectories")).filter(|folder| folder.is_dir())
}

#[test]
fn real_tum_files_are_read() {
    let Some(folder) = shared_trajectories() else {
        eprintln!("skipped: ../shared/data is absent");
        return;
    };
    // Lines that hold numbers, counted with grep.
    for (name, num_poses) in [
        ("freiburg1_xyz-groundtruth.txt", 3000),
        ("freiburg1_xyz-rgbdslam.txt", 788),
        ("freiburg1_xyz-rgbdslam_drift.txt", 788),
        ("freiburg1_xyz-rgbdslam_drift_short.txt", 40),
        ("freiburg1_xyz-ORB_kf_mono.txt", 32),
    ] {
        let trajectory =
            read(&std::fs::read(folder.join(name)).unwrap()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(trajectory.len(), num_poses, "{name}");
        let (stamps, poses) = (trajectory.stamps.clone().unwrap(), trajectory.poses().unwrap());
        assert_eq!(stamps.len(), num_poses);
        for pose in &poses {
            assert!((pose.rotation.norm() - 1.0).abs() < 1e-12, "{name}");
        }

        let again = read_tum(tum_text(Some(&stamps), &poses).as_bytes()).unwrap();
        assert_eq!((&again.stamps, &again.positions), (&trajectory.stamps, &trajectory.positions), "{name}");
        for (orientation, expected) in again.orientations.unwrap().iter().zip(trajectory.orientations.unwrap()) {
            assert!((orientation.coords - expected.coords).norm() < 1e-15, "{name}");
        }
    }
    let truth = read_tum(&std::fs::read(folder.join("freiburg1_xyz-groundtruth.txt")).unwrap()).unwrap();
    assert_eq!(truth.stamps.unwrap()[1], 1_305_031_098.675_8);
    assert_eq!(truth.positions[1], Vector3::new(1.3543, 0.6306, 1.6360));
    // qx qy qz qw of the file, rounded there to four decimals.
    let expected = UnitQuaternion::new_normalize(Quaternion::new(-0.3980, 0.6129, 0.5966, -0.3316));
    assert_eq!(truth.orientations.unwrap()[1], expected);
}

#[test]
fn files_of_other_forms_are_refused_by_their_columns() {
    let Some(folder) = shared_trajectories() else {
        eprintln!("skipped: ../shared/data is absent");
        return;
    };
    let error = read(&std::fs::read(folder.join("KITTI_00_gt.txt")).unwrap()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 1: The line has 12 columns. A trajectory has 8 (t x y z qx qy qz qw), 3 (x y z) or 2 (x y) on every line."
    );
}

#[test]
fn our_own_files_agree() {
    let read_own = |name: &str| read(&std::fs::read(project().join("tests/data").join(name)).unwrap()).unwrap();
    let (poses, positions) = (read_own("trajectory.tum"), read_own("positions.csv"));
    assert_eq!(poses.positions, positions.positions);
    assert_eq!((poses.stamps, positions.stamps), (Some(vec![0.0, 0.5, 1.0]), None));
    assert!(positions.orientations.is_none());
    let heading = poses.orientations.unwrap()[2].euler_angles().2;
    assert!((heading.to_degrees() - 20.0).abs() < 1e-4, "{heading}");
}

#[test]
fn separators_comments_and_line_endings() {
    let expected = vec![Vector3::new(1.0, 2.0, 3.0), Vector3::new(4.0, 5.0, 6.0)];
    for text in [
        "1 2 3\n4 5 6\n",
        "1,2,3\r\n4,5,6",
        "\u{FEFF}1\t2\t3\r4; 5 ;6\r",
        "# a comment\n\n  1 2 3 # another\n#\n4 5 6\n\n",
        "x, y, z\n1, 2, 3\n4, 5, 6\n",
        "+1e0 2. 3.0\n4 5 6",
    ] {
        assert_eq!(read(text.as_bytes()).unwrap().positions, expected, "{text:?}");
    }
    assert_eq!(read(b"1 2\n").unwrap().positions, [Vector3::new(1.0, 2.0, 0.0)]);
    // Times may go back: order is the business of whoever associates.
    let stamps = read(b"2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").unwrap().stamps.unwrap();
    assert_eq!(stamps, [2.0, 1.0]);
}

#[test]
fn broken_lines_are_told_by_line_and_column() {
    for (text, expected) in [
        ("", "The file has no line with numbers. A trajectory has one pose or position a line."),
        ("# nothing\n\n", "The file has no line with numbers. A trajectory has one pose or position a line."),
        (
            "1 2 3\n\n1 2\n",
            "line 3: The line has 2 columns in place of 3. Every line needs the same columns: correct or remove this one.",
        ),
        (
            "1 2 3\r\n1 abc 3\r\n",
            "line 2: Column 2 is \"abc\", not a finite number. Write decimal numbers, or remove the line.",
        ),
        ("1 2 nan", "line 1: Column 3 is \"nan\", not a finite number. Write decimal numbers, or remove the line."),
        ("1 inf", "line 1: Column 2 is \"inf\", not a finite number. Write decimal numbers, or remove the line."),
        (
            "0 0 0 0 0 0 0 1\r1 0 0 0 0 0 0 0",
            "line 2: Columns 5 to 8 are no rotation: a quaternion has length 1, and theirs is 0. The columns are t x y z qx \
             qy qz qw.",
        ),
        (
            "0 0 0 0 0 0 0 1.02",
            "line 1: Columns 5 to 8 are no rotation: a quaternion has length 1, and theirs is 1.02. The columns are t x y z \
             qx qy qz qw.",
        ),
        (
            "Dear reader,\nthis is no trajectory\n",
            "line 2: The line has 4 columns. A trajectory has 8 (t x y z qx qy qz qw), 3 (x y z) or 2 (x y) on every line.",
        ),
    ] {
        assert_eq!(read(text.as_bytes()).expect_err(text).to_string(), expected);
    }
    assert_eq!(
        read_tum(b"1 2 3\n").unwrap_err().to_string(),
        "line 1: The line has 3 columns in place of 8. Every line needs the same columns: correct or remove this one."
    );
    assert!(read_tum(b"").is_err());
}

#[test]
fn poses_are_written_and_lifted() {
    let turn = std::f64::consts::FRAC_PI_2;
    let pose = Pose2::new(nalgebra::Vector2::new(1.5, -2.0), turn);
    let lifted = in_space(&pose);
    let point = nalgebra::Point2::new(3.0, 4.0);
    let flat = pose * point;
    assert!(
        (lifted * nalgebra::Point3::new(3.0, 4.0, 7.0) - nalgebra::Point3::new(flat.x, flat.y, 7.0)).norm() < 1e-15
    );
    assert!((lifted.rotation_angle() - turn).abs() < 1e-15);

    assert_eq!(
        tum_text(None, &[<Pose3 as RigidMotion<3, 6>>::identity(), Pose3::translation(1.0, 2.0, 3e-20)]),
        "# timestamp tx ty tz qx qy qz qw\n0.0 0.0 0.0 0.0 0.0 0.0 0.0 1.0\n1.0 1.0 2.0 3e-20 0.0 0.0 0.0 1.0\n"
    );
    assert_eq!(tum_text(Some(&[1_305_031_098.675_8]), &[lifted]).lines().nth(1).unwrap().split(' ').count(), 8);
    assert_eq!(
        matrix_text(&Pose3::translation(1.0, -2.0, 0.5)),
        "1.0 0.0 0.0 1.0\n0.0 1.0 0.0 -2.0\n0.0 0.0 1.0 0.5\n0.0 0.0 0.0 1.0\n"
    );
    let text = matrix_text(&lifted);
    let numbers: Vec<f64> = text.split_ascii_whitespace().map(|number| number.parse().unwrap()).collect();
    assert_eq!(nalgebra::Matrix4::from_row_slice(&numbers), lifted.to_homogeneous());

    let trajectory = Trajectory::from_poses(&[lifted, lifted]);
    assert_eq!((trajectory.len(), trajectory.is_empty(), trajectory.poses()), (2, false, Some(vec![lifted, lifted])));
}
