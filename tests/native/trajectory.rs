//! Trajectory files, real ones and broken ones.

use std::path::Path;

use crate::common::shared_data;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use scanstitch::geometry::{Pose2, Pose3, RigidMotion};
use scanstitch::io::trajectory::{
    Contents, Trajectory, TrajectoryFormat, in_space, matrix_text, read, read_frames, read_lenient, read_times,
    read_tum, tum_text, write,
};

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn real_tum_files_are_read() {
    let Some(folder) = shared_data("trajectories") else { return };
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
fn real_files_of_every_form_are_read() {
    let Some(folder) = shared_data("trajectories") else { return };
    let data = folder.join("..");
    for (name, num_poses, format) in [
        ("trajectories/freiburg1_xyz-rgbdslam.txt", 788, TrajectoryFormat::Tum),
        ("trajectories/KITTI_00_gt.txt", 4541, TrajectoryFormat::Kitti),
        ("trajectories/KITTI_00_ORB.txt", 4541, TrajectoryFormat::Kitti),
        ("trajectories/KITTI_00_SPTAM.txt", 4541, TrajectoryFormat::Kitti),
        ("rgbd/apartment_first_floor/GT_pose.npy", 80, TrajectoryFormat::Npy),
        ("rgbd/apartment_second_floor/GT_pose.npy", 123, TrajectoryFormat::Npy),
        ("rgbd/redwood5/odometry.log", 5, TrajectoryFormat::Matrices),
        ("bags/derived_depth_pointcloud/depth_gt_tum.txt", 0, TrajectoryFormat::Tum),
        ("laser/fr079/fr079.reference_posegraph.txt", 1464, TrajectoryFormat::Planar),
    ] {
        let path = data.join(name);
        let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        let contents = read_lenient(&bytes, None).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(contents.format, format, "{name}");
        assert!(num_poses == 0 || contents.trajectory.len() == num_poses, "{name}: {}", contents.trajectory.len());
        assert!(
            contents.trajectory.orientations.is_some() && contents.notes.is_empty(),
            "{name}: {:?}",
            contents.notes
        );
    }
    let times = std::fs::read(folder.join("KITTI_00_gt_times.txt")).unwrap();
    let poses = read(&std::fs::read(folder.join("KITTI_00_gt.txt")).unwrap()).unwrap();
    let timed = poses.with_stamps(read_times(&times).unwrap()).unwrap();
    assert_eq!(timed.stamps.unwrap()[1], 1.037_359e-1);
}

#[test]
fn every_form_comes_back_without_loss() {
    let poses: Vec<Pose3> = (0..40)
        .map(|i| {
            let s = f64::from(i) * 0.37;
            let rotation = UnitQuaternion::from_euler_angles(s.sin(), 0.5 * (2.0 * s).cos(), s);
            Pose3::from_parts(nalgebra::Translation3::new(s.cos() * 1e3, s / 7.0, -s * 1e-5), rotation)
        })
        .collect();
    let stamps: Vec<f64> = (0..40).map(|i| 1_403_636_579.0 + f64::from(i) * 0.05).collect();
    let trajectory = Trajectory::from_poses(&poses).with_stamps(stamps.clone()).unwrap();
    for format in [
        TrajectoryFormat::Tum,
        TrajectoryFormat::Kitti,
        TrajectoryFormat::Euroc,
        TrajectoryFormat::PoseTable,
        TrajectoryFormat::Matrices,
        TrajectoryFormat::Npy,
    ] {
        let bytes = write(&trajectory, format).unwrap();
        let again = read_lenient(&bytes, None).unwrap_or_else(|error| panic!("{format:?}: {error}"));
        assert_eq!(again.format, format);
        assert_eq!(again.trajectory.positions, trajectory.positions, "{format:?}");
        for (found, expected) in again.trajectory.orientations.as_ref().unwrap().iter().zip(&poses) {
            assert!(found.angle_to(&expected.rotation) < 1e-15, "{format:?}");
        }
        match format {
            TrajectoryFormat::Tum | TrajectoryFormat::PoseTable => {
                assert_eq!(again.trajectory.stamps, trajectory.stamps);
            }
            // A time of today in double precision is exact to 0.2 microseconds.
            TrajectoryFormat::Euroc => {
                let found = again.trajectory.stamps.clone().unwrap();
                assert!(found.iter().zip(&stamps).all(|(found, stamp)| (found - stamp).abs() < 3e-7));
            }
            _ => assert_eq!(again.trajectory.stamps, None),
        }
        // Written again, the file is the same; of quaternions, which reading makes unit ones, last digits may differ.
        if matches!(format, TrajectoryFormat::Kitti | TrajectoryFormat::Matrices) {
            assert_eq!(write(&again.trajectory, format).unwrap(), bytes);
        }
    }
    let flat: Vec<Pose3> =
        (0..5).map(|i| in_space(&Pose2::new(nalgebra::Vector2::new(f64::from(i), 2.0), 0.3))).collect();
    let flat = Trajectory::from_poses(&flat);
    let again = read(&write(&flat, TrajectoryFormat::Planar).unwrap()).unwrap();
    assert_eq!(again.positions, flat.positions);
    assert!((again.orientations.unwrap()[4].angle() - 0.3).abs() < 1e-15);
    let positions = read(&write(&flat, TrajectoryFormat::Positions).unwrap()).unwrap();
    assert_eq!((&positions.positions, &positions.orientations), (&flat.positions, &None));
    assert!(write(&positions, TrajectoryFormat::Tum).unwrap_err().to_string().contains("positions alone"));
    assert!(flat.with_stamps(vec![0.0]).unwrap_err().to_string().contains("1 times for 5 poses"));
}

#[test]
fn formats_are_detected() {
    let quarter = "0.7071067811865476";
    for (text, format, position) in [
        ("0 1 2 3 0 0 0 1\n".to_owned(), TrajectoryFormat::Tum, [1.0, 2.0, 3.0]),
        ("1403636579763555584,1,2,3,1,0,0,0\n".to_owned(), TrajectoryFormat::Euroc, [1.0, 2.0, 3.0]),
        (
            "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],v_x,b\n1403636579763555584,1,2,3,1,0,0,0,9,9\n".to_owned(),
            TrajectoryFormat::Euroc,
            [1.0, 2.0, 3.0],
        ),
        ("1 2 3 1 0 0 0\n".to_owned(), TrajectoryFormat::PoseTable, [1.0, 2.0, 3.0]),
        ("qx,qy,qz,qw,z,y,x\n0,0,0,1,3,2,1\n".to_owned(), TrajectoryFormat::PoseTable, [1.0, 2.0, 3.0]),
        (",frame,tx,ty,tz,rw,rx,ry,rz\n0,7,1,2,3,1,0,0,0\n".to_owned(), TrajectoryFormat::PoseTable, [1.0, 2.0, 3.0]),
        ("time,x,y\n0,1,2\n".to_owned(), TrajectoryFormat::Positions, [1.0, 2.0, 0.0]),
        ("1 0 0 1 0 1 0 2 0 0 1 3\n".to_owned(), TrajectoryFormat::Kitti, [1.0, 2.0, 3.0]),
        ("1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n".to_owned(), TrajectoryFormat::Matrices, [1.0, 2.0, 3.0]),
        ("1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n".to_owned(), TrajectoryFormat::Matrices, [1.0, 2.0, 3.0]),
        ("0 0 1\n1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n".to_owned(), TrajectoryFormat::Matrices, [1.0, 2.0, 3.0]),
        (format!("5 1 2 {quarter}\n"), TrajectoryFormat::Planar, [1.0, 2.0, 0.0]),
    ] {
        let contents = read_lenient(text.as_bytes(), None).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(contents.format, format, "{text}");
        assert_eq!(contents.trajectory.positions[0], Vector3::from(position), "{text}");
    }
    // The same columns, read as told.
    let told = read_lenient(b"7 1 2 3 1 0 0 0\n", Some(TrajectoryFormat::Euroc)).unwrap().trajectory;
    assert_eq!((told.stamps, told.orientations.unwrap()[0].angle()), (Some(vec![7e-9]), 0.0));
    assert!(read_lenient(b"1 2 3\n", Some(TrajectoryFormat::Kitti)).is_err());
    assert!(read_lenient(b"1 2 3\n", Some(TrajectoryFormat::Npy)).is_err());
}

#[test]
fn quaternions_of_another_length_are_mended_where_that_is_asked_for() {
    let text = b"0 0 0 0 0 0 0 2\n1 0 0 0 0 0 3 3\n2 0 0 0 0 0 0 1\n";
    assert!(read(text).is_err());
    let contents = read_lenient(text, None).unwrap();
    assert!((contents.trajectory.orientations.unwrap()[1].angle().to_degrees() - 90.0).abs() < 1e-12);
    assert_eq!(
        contents.notes,
        [
            "line 1: Columns 5 to 8 are not a rotation: a quaternion has length 1, and theirs is 2. The columns are t x y z qx \
          qy qz qw. 2 quaternions were made of length 1."
        ]
    );
    let huge = read_lenient(b"0 0 0 0 0 0 0 1e300\n", None).unwrap().trajectory;
    assert_eq!(huge.orientations.unwrap()[0].angle(), 0.0);
    assert!(read_lenient(b"0 0 0 0 0 0 0 0\n", None).unwrap_err().to_string().contains("theirs is 0"));
}

#[test]
fn a_quaternion_of_zeros_is_a_pose_that_was_lost() {
    let text = b"0 1 0 0 0 0 0 1\n1 1 0 0 0 0 0 0\n2 3 0 0 0 0 0 1\n";
    let contents = read_lenient(text, None).unwrap();
    assert_eq!((contents.trajectory.stamps, contents.trajectory.undefined), (Some(vec![0.0, 2.0]), vec![1]));
    assert!(contents.notes[0].starts_with("1 of its 3 poses"), "{:?}", contents.notes);
    assert!(read(text).unwrap_err().to_string().starts_with("line 2: Columns 5 to 8 are not a rotation"));
}

/// As `sec` and `usec` are printed with a point between.
#[test]
fn fractions_without_their_leading_zeros_are_told_by_times_that_go_back() {
    let line =
        |microseconds: u32| format!("{}.{} 1 2 3 0 0 0 1\n", 100 + microseconds / 1_000_000, microseconds % 1_000_000);
    let text: String = (0..60).map(|row| line(900_013 + 33_333 * row)).collect();
    let contents = read_lenient(text.as_bytes(), None).unwrap();
    let stamps = contents.trajectory.stamps.unwrap();
    assert!(stamps.windows(2).all(|pair| (pair[1] - pair[0] - 0.033_333).abs() < 1e-9), "{stamps:?}");
    assert!(contents.notes[0].contains("lack the leading zeros"), "{:?}", contents.notes);
    // Times that go back and would still do so, or whose fractions have their zeros, stay.
    let shuffled = "100.5 0 0 0 0 0 0 1\n100.05 0 0 0 0 0 0 1\n100.25 0 0 0 0 0 0 1\n";
    let kept = read_lenient(shuffled.as_bytes(), None).unwrap();
    assert_eq!((kept.trajectory.stamps, kept.notes), (Some(vec![100.5, 100.05, 100.25]), vec![]));
}

#[test]
fn matrices_by_columns_and_planar_poses_with_times() {
    let by_rows = "0 -1 0 4 1 0 0 5 0 0 1 6 0 0 0 1\n";
    let by_columns = "0 1 0 0 -1 0 0 0 0 0 1 0 4 5 6 1\n";
    let contents = read_lenient(by_columns.as_bytes(), None).unwrap();
    assert_eq!(contents.trajectory, read(by_rows.as_bytes()).unwrap());
    assert!(contents.notes[0].contains("read column by column"), "{:?}", contents.notes);
    assert!(read(by_columns.as_bytes()).unwrap_err().to_string().starts_with("line 1: The last row of the matrix is"));

    let planar = (0..12).map(|row| format!("{}.5 {row} 0 0.25\n", 1000 + row)).collect::<Vec<_>>().concat();
    let contents = read_lenient(planar.as_bytes(), None).unwrap();
    assert_eq!(contents.format, TrajectoryFormat::Planar);
    let trajectory = contents.trajectory;
    assert_eq!(trajectory.stamps.unwrap()[..2], [1000.5, 1001.5]);
    assert_eq!((trajectory.positions[3].x, trajectory.orientations.unwrap()[3].angle()), (3.0, 0.25));
}

#[test]
fn poses_of_frames_that_a_tracker_lost_are_left_out() {
    let matrix = |x: f64| format!("1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    let lost = "-inf -inf -inf -inf\n".repeat(4);
    // As ScanNet writes them, the first and the fourth.
    let frames = [&lost, &matrix(1.0), &matrix(2.0), &lost, &matrix(4.0)];
    let joined = frames.map(String::as_str).concat();
    let check = |contents: &Contents| {
        let trajectory = &contents.trajectory;
        assert_eq!(trajectory.positions.iter().map(|p| p.x).collect::<Vec<_>>(), [1.0, 2.0, 4.0]);
        assert_eq!(trajectory.orientations.as_ref().map(Vec::len), Some(3));
        assert_eq!((trajectory.undefined.as_slice(), trajectory.num_rows()), (&[0, 3][..], 5));
        let index_of = |row| trajectory.index_of_row(row);
        assert_eq!([0, 1, 2, 3, 4, 5].map(index_of), [None, Some(0), Some(1), None, Some(2), None]);
        assert!(contents.notes[0].starts_with("2 of its 5 poses have nan or inf"), "{:?}", contents.notes);
    };
    let contents = read_lenient(joined.as_bytes(), None).unwrap();
    assert_eq!(contents.format, TrajectoryFormat::Matrices);
    check(&contents);
    let named: Vec<(String, &String)> = (0..).map(|i| format!("{i}.txt")).zip(frames).collect();
    let files: Vec<(&str, &[u8])> = named.iter().map(|(name, text)| (name.as_str(), text.as_bytes())).collect();
    check(&read_frames(&files).unwrap());
    let stamped = contents.trajectory.clone().with_stamps(vec![0.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
    assert_eq!(stamped.stamps, Some(vec![1.0, 2.0, 4.0]));
    // A row a pose, with and without times.
    let kitti = "nan nan nan nan nan nan nan nan nan nan nan nan\n1 0 0 1 0 1 0 0 0 0 1 0\n";
    assert_eq!(read_lenient(kitti.as_bytes(), None).unwrap().trajectory.undefined, [0]);
    let tum = read_lenient(b"0 1 0 0 0 0 0 1\n1 nan nan nan nan nan nan nan\n2 3 0 0 0 0 0 1\n", None).unwrap();
    assert_eq!((tum.trajectory.stamps, tum.trajectory.undefined), (Some(vec![0.0, 2.0]), vec![1]));
    // Strictly read, or without any pose or with a time that is none, it is an error at the place.
    assert!(read(joined.as_bytes()).unwrap_err().to_string().starts_with("line 1: Column 1 is \"-inf\""));
    assert!(read_lenient(lost.as_bytes(), None).unwrap_err().to_string().contains("Column 1 is \"-inf\""));
    // A single value is damaged rather than lost.
    let damaged = read_lenient(b"0 1 0 0 0 0 0 1\n1 nan 2 0 0 0 0 1\n", None).unwrap_err().to_string();
    assert!(damaged.starts_with("line 2: Column 2 is \"nan\""), "{damaged}");
    let untimed = read_lenient(b"0 1 0 0 0 0 0 1\nnan 3 0 0 0 0 0 1\n", None).unwrap_err().to_string();
    assert!(untimed.starts_with("line 2: Column 1 is \"nan\""), "{untimed}");
}

#[test]
fn damaged_matrices_and_arrays_are_refused() {
    for (text, expected) in [
        ("1 0 0 0 0 1 0 0 0 0 -1 0\n", "line 1: The matrix mirrors: its determinant is -1."),
        ("1 0 0 0 0 1 0 0 0 0 2 0\n", "line 1: The matrix is not a rotation: R^T R is off the identity by 3."),
        ("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\n", "line 1: The last row of the matrix is [0.0, 0.0, 1.0, 1.0]."),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 0 0 0\n0 1 0 0\n", "line 6: The last matrix ends after 2 of 4 rows."),
        ("1 2 3 4 5\n", "line 1: The line has 5 columns."),
        ("1 0 0 0 0 1 0 0 0 0 1 nan\n", "line 1: Column 12 is \"nan\", not a finite number."),
        ("1.4e18,1,2,3,1,0,0,0,9\n1.4e18,1,x,3,1,0,0,0,9\n", "line 2: Column 3 is \"x\", not a finite number."),
        ("0 1 2 3 0 0 0 1\n0 1 2 3 0 0 0\n", "line 2: The line has 7 columns in place of 8."),
    ] {
        let told = read(text.as_bytes()).expect_err(text).to_string();
        assert!(told.starts_with(expected), "{told}");
    }
    let poses = Trajectory::from_poses(&[Pose3::translation(1.0, 2.0, 3.0), <Pose3 as RigidMotion>::identity()]);
    let good = write(&poses, TrajectoryFormat::Npy).unwrap();
    assert_eq!(good.len(), 128 + 2 * 7 * 8);
    assert_eq!(read(&good).unwrap().positions, poses.positions);
    for cut in 0..good.len() {
        assert!(read(&good[..cut]).is_err(), "cut after {cut} bytes");
    }
    let with_header = |from: &str, to: &str| {
        let mut bytes = good.clone();
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        bytes[at..at + from.len()].copy_from_slice(to.as_bytes());
        read(&bytes).map(|trajectory| trajectory.positions[0]).map_err(|error| error.to_string())
    };
    assert!(with_header("False", "True ").unwrap_err().contains("column by column"));
    assert!(with_header("(2, 7)", "(7, 2)").is_ok());
    assert!(with_header("(2, 7)", "(9, 7)").unwrap_err().contains("ends after 112 bytes"));
    assert!(with_header("<f8", "<c8").unwrap_err().contains("no numbers of 4 or 8 bytes"));
    assert!(with_header("(2, 7)", "(1, 5)").unwrap_err().contains("has the shape [1, 5]"));
    assert!(with_header("<f8", ">f8").is_err(), "numbers turned round are no rotation");
    let mut nan = good.clone();
    nan[128 + 56..128 + 64].copy_from_slice(&f64::NAN.to_le_bytes());
    assert!(read(&nan).unwrap_err().to_string().contains("Row 1: Column 1 is \"nan\""));
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
fn errors_give_line_and_column() {
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
            "line 2: Columns 5 to 8 are not a rotation: a quaternion has length 1, and theirs is 0. The columns are t x y z qx \
             qy qz qw.",
        ),
        (
            "0 0 0 0 0 0 0 1.02",
            "line 1: Columns 5 to 8 are not a rotation: a quaternion has length 1, and theirs is 1.02. The columns are t x y z \
             qx qy qz qw.",
        ),
        (
            "Dear reader,\nthis is no trajectory\n",
            "line 2: Column 1 is \"this\", not a finite number. Write decimal numbers, or remove the line.",
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
        tum_text(None, &[<Pose3 as RigidMotion>::identity(), Pose3::translation(1.0, 2.0, 3e-20)]),
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
