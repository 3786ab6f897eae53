//! Laser logs: what is read from each kind, what is told of bad ones, and that nothing breaks on hostile ones.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fs;

use crate::common::shared_data;
use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::io::laser_log::stamps::stamps;
use scanstitch::io::laser_log::{Bearings, is_laser_log, read};
use scanstitch_scene::random::Random;

#[test]
fn the_freiburg_log_is_read_with_its_offset_and_its_limit() {
    let Some(file) = shared_data("laser/fr079/fr079.log") else { return };
    let bytes = fs::read(file).unwrap();
    assert!(is_laser_log(&bytes[..8192]));
    let log = read(&bytes).unwrap();
    assert_eq!(log.scans.len(), 1464);
    assert!((log.T_robot_laser.translation.x + 0.04).abs() < 1e-4, "{:?}", log.T_robot_laser);
    // A quarter of the circle in as many digits as the file has.
    let start = "-1.570796".parse().unwrap();
    for scan in &log.scans {
        assert_eq!((scan.ranges.len(), scan.max_range), (360, 50.0));
        assert_eq!(scan.bearings, Bearings::Even { start, step: 0.008_727 });
        assert!(scan.reference.is_some() && scan.time.is_some());
    }
    assert_eq!(log.scans[0].ranges[..3], [1.67, 1.65, 1.64]);
    let vertex = log.scans[1].reference.unwrap();
    assert!((vertex.translation.x - 0.344).abs() < 0.01, "{vertex}");
}

#[test]
fn csm_logs_are_read_with_null_readings_and_true_poses() {
    let Some(folder) = shared_data("laser/csm") else { return };
    let log = read(&fs::read(folder.join("raytracer_test01-scans.json")).unwrap()).unwrap();
    assert_eq!(log.scans[0].ranges.len(), 181);
    assert!(log.scans[0].reference.is_some() && log.scans[0].odometry.is_none());
    for (file, count) in [("stallo2_pair.json", 2), ("failure2.json", 2)] {
        let bytes = fs::read(folder.join(file)).unwrap();
        assert!(is_laser_log(&bytes[..bytes.len().min(8192)]), "{file}");
        assert_eq!(read(&bytes).unwrap().scans.len(), count, "{file}");
    }
}

#[test]
fn flaser_lines_tell_their_angles_by_their_number() {
    let line = |count: usize| format!("FLASER {count}{} 1 2 0.5 1 2 0.5 7.25 host 0.1\n", " 3.5".repeat(count));
    let first_and_step = |count| match read(line(count).as_bytes()).unwrap().scans[0].bearings {
        Bearings::Even { start, step } => (start, step.to_degrees()),
        Bearings::Listed(_) => unreachable!("FLASER lists no angles"),
    };
    for (count, step) in [(180, 1.0), (181, 1.0), (360, 0.5), (361, 0.5)] {
        let (start, found) = first_and_step(count);
        assert!((start + FRAC_PI_2).abs() < 1e-12 && (found - step).abs() < 1e-9, "{count}");
    }
    let log = read(line(180).as_bytes()).unwrap();
    let scan = &log.scans[0];
    assert_eq!((scan.time, scan.line), (Some(7.25), 1));
    let points = scan.points();
    assert!((points[0][1] + 3.5).abs() < 1e-5 && (points[90][0] - 3.5).abs() < 1e-5, "{:?}", points[0]);
    assert!((scan.odometry.unwrap().rotation.angle() - 0.5).abs() < 1e-12);
}

#[test]
fn a_stated_field_of_view_is_in_degrees() {
    let log = read(b"PARAM particles 30\nLASER_READING 3 1 2 3 0.5 0.25 0.1 12.5\nODO_UPDATE 1 0 0 0 1\n").unwrap();
    let [scan] = &log.scans[..] else { panic!("{:?}", log.scans) };
    assert_eq!(
        (scan.ranges.len(), scan.time, scan.odometry),
        (3, Some(12.5), Some(Pose2::new([0.5, 0.25].into(), 0.1)))
    );
    let log = read(b"PARAM laser_front_laser_fov 240\nFLASER 4 1 2 3 4 1 2 0.5 1 2 0.5 7.25 host 0.1\n").unwrap();
    let Bearings::Even { start, step } = log.scans[0].bearings else { unreachable!("FLASER lists no angles") };
    assert!((start.to_degrees() + 120.0).abs() < 1e-9 && (step.to_degrees() - 60.0).abs() < 1e-9, "{start} {step}");
}

#[test]
fn corrected_poses_are_the_reference_and_the_wheels_the_odometry() {
    let text = "PARAM robot_front_laser_max 8.0\nODOM 0 0 0 0 0 0 1.0 h 1.0\n\
                FLASER 2 1.0 2.0 0.1 0 0 0 0 0 1 h 1\nFLASER 2 1.0 2.0 5.1 0 0 4 0 0 2 h 2\n";
    let log = read(text.as_bytes()).unwrap();
    let scan = &log.scans[1];
    assert!(log.T_robot_laser.translation_norm() < 1e-12, "the two disagree, so there is no offset");
    assert_eq!((scan.reference.unwrap().translation.x, scan.odometry.unwrap().translation.x), (5.1, 4.0));
    assert_eq!(scan.max_range, 8.0);
    let steady = text.replace("5.1 0 0 4", "5.1 0 0 5.0");
    let log = read(steady.as_bytes()).unwrap();
    assert!((log.T_robot_laser.translation.x - 0.1).abs() < 1e-9);
}

#[test]
fn a_stated_limit_beyond_which_the_laser_measures_is_none() {
    let log = |readings: &str| {
        let count = readings.split_whitespace().count();
        read(format!("PARAM robot_front_laser_max 10\nFLASER {count} {readings} 0 0 0 0 0 0 1 h 1\n").as_bytes())
            .unwrap()
    };
    let codes = log("1 2 3 4 5 6 81.8 81.91 81.91 81.91");
    assert!(codes.scans[0].max_range == 10.0 && codes.notes.is_empty(), "{:?}", codes.notes);
    let measured = log("1 2 3 4 5 6 12.5 17.1 31 50 50");
    assert!(measured.scans[0].max_range.is_infinite());
    assert!(measured.notes[0].contains("10 m") && measured.notes[0].contains("27 %"), "{:?}", measured.notes);
}

#[test]
fn errors_name_the_line_and_the_remedy() {
    for (text, line, words) in [
        ("FLASER 3 1 2 3 0 0 0 0 0 0\nFLASER 3 1 x 3 0 0 0 0 0 0\n# end\n", 2, "\"x\""),
        ("FLASER 99999999999 1 2\n", 1, "announces"),
        ("FLASER 2 1 2 0 0\n", 1, "2 of 6"),
        ("ROBOTLASER1 0 -1.57 3.14 0 50 0.1 0 2 1 1 0 0 0 0 0 0 0\n", 1, "from beam to beam"),
        ("ODOM 1 2\nFLASER 1 1 0 0 0 0 0 0\n", 1, "ends before"),
        ("{\"readings\": [1, 2], \"theta\": [0]}", 1, "bearings"),
        ("{\"readings\": [1, 2]}", 1, "neither theta"),
        (
            "[{\"theta\": [0], \"readings\": [1]},\n{\"theta\": [0], \"readings\":\n[\"a\"]}]\n",
            3,
            "invalid type: string",
        ),
        ("[{\"theta\": [0], \"readings\": [1]},\n{\"theta\": [0]}]", 2, "missing field `readings`"),
        ("{\"theta\": [0], \"readings\": [1]}\n{\"theta\": [0], \"readings\": [\"a\"]}\n", 2, "not a CSM scan"),
    ] {
        let error = read(text.as_bytes()).unwrap_err();
        let told = error.clone().in_file("drive.log").to_string();
        assert!(told.starts_with(&format!("drive.log, line {line}: ")) && told.contains(words), "{told}");
        assert!(!error.remedy.is_empty(), "{told}");
    }
    assert!(read(b"").is_err() && read(b"EDGE2 0 1 0 0 0 1 0 1 1 0 0\n").is_err());
}

#[test]
fn millimetres_and_degrees_are_told_from_the_data() {
    let log = |unit: f64, last_angle: f64| {
        let readings: Vec<f64> = (0..90).map(|beam| unit * (2.0 + 0.01 * f64::from(beam))).collect();
        let first_angle = -last_angle;
        let scan = format!("{{\"min_theta\":{first_angle},\"max_theta\":{last_angle},\"readings\":{readings:?}}}\n");
        read(scan.repeat(3).as_bytes())
    };
    let right = log(1.0, 3.2).unwrap();
    let no_notes: [String; 0] = [];
    assert_eq!((right.scans.len(), &right.notes[..]), (3, &no_notes[..]));
    let millimetres = log(1000.0, 3.2).unwrap();
    assert_eq!(millimetres.scans, right.scans);
    assert!(millimetres.notes[0].contains("cannot be metres and are read as millimetres"), "{:?}", millimetres.notes);
    let degrees = log(1.0, 90.0).unwrap();
    assert!((degrees.scans[0].bearings.of(0) + PI / 2.0).abs() < 1e-12);
    assert!(degrees.notes[0].contains("its angles are read as degrees"), "{:?}", degrees.notes);
    // Bearings that fall are told as they are, but where the log does not keep to its format they may be clockwise.
    assert!(!log(1.0, -1.0).unwrap().may_be_mirrored && !degrees.may_be_mirrored);
    for falling in [log(1.0, -90.0), log(1000.0, -1.0)].map(Result::unwrap) {
        assert!(falling.may_be_mirrored, "{:?}", falling.notes);
    }
    let refused = log(1.0, 900.0).unwrap_err().to_string();
    assert!(refused.contains("line 1: The readings of a scan cover an angle of 1800 rad"), "{refused}");
}

/// Outdoors nearly all readings may stand for no return.
#[test]
fn a_log_with_few_returns_is_read() {
    let readings: Vec<f64> = (0..100).map(|beam| if beam < 3 { 5.0 } else { 81.91 }).collect();
    let scan = format!("{{\"min_theta\":-1.5,\"max_theta\":1.5,\"readings\":{readings:?}}}\n");
    assert_eq!(read(scan.repeat(3).as_bytes()).unwrap().scans.len(), 3);
}

#[test]
fn a_log_that_was_cut_off_gives_what_came_before() {
    let text = "FLASER 2 1.0 2.0 0 0 0 0 0 0 1 h 1\nFLASER 2 1.0";
    let log = read(text.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.losses.len()), (1, 1));
    let json = "{\"theta\": [0, 0.1], \"readings\": [1, null]}\n{\"theta\": [0, 0";
    let log = read(json.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.losses.len()), (1, 1));
    assert!(log.scans[0].ranges[1].is_nan());
}

#[test]
fn scans_of_a_list_and_of_messages_are_read_too() {
    let json = "[{\"min_theta\": -1, \"max_theta\": 1, \"readings\": [1, 5, 9], \"range_min\": 2, \"range_max\": 8,\
                 \"timestamp\": [3, 500000], \"true_pose\": [1, 2, 3.5], \"more\": {}}]";
    let scan = &read(json.as_bytes()).unwrap().scans[0];
    assert!(scan.ranges[0].is_nan() && scan.ranges[1] == 5.0 && scan.max_range == 8.0);
    assert_eq!((scan.bearings.of(2), scan.time), (1.0, Some(3.5)));
    assert!((scan.reference.unwrap().rotation.angle() - (3.5 - 2.0 * PI)).abs() < 1e-12);
}

/// Scans of 180 and 181 beams in turn, one laser's; `others` stands between them.
fn drive(count: usize, others: impl Fn(usize) -> String) -> String {
    let line = |scan: usize| {
        let (beams, x) = (180 + scan % 2, 0.1 * scan as f64);
        format!("FLASER {beams}{} {x} 0 0 {x} 0 0 {}.5 h 0.1\n{}", " 3.5".repeat(beams), 7 + scan, others(scan))
    };
    (0..count).map(line).collect()
}

#[test]
fn one_laser_of_several_is_kept_and_the_others_are_told() {
    let steady = read(drive(40, |_| String::new()).as_bytes()).unwrap();
    assert_eq!(
        (steady.scans.len(), steady.notes.len() + steady.losses.len()),
        (40, 0),
        "180 and 181 readings are one laser's"
    );
    let rear = |scan: usize| format!("RLASER 2 1 2 {scan} 0 3.14 {scan} 0 0 1 h 1\n");
    let log = read(drive(40, rear).as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.notes.len(), log.losses.len()), (40, 1, 0));
    assert!(log.notes[0].starts_with("40 scans of another laser (RLASER"), "{:?}", log.notes);

    // Another laser under the same word: as many readings tell it apart.
    let other = |scan: usize| format!("FLASER 361{} 0 0 0 0 0 0 {}.75 h 0.1\n", " 2".repeat(361), 7 + scan);
    let log = read(drive(40, |scan| if scan % 3 == 1 { other(scan) } else { String::new() }).as_bytes()).unwrap();
    assert_eq!(log.scans.len(), 40);
    assert!(log.scans.iter().all(|scan| scan.ranges.len() < 200));
    // The scans keep their numbers in the log.
    assert_eq!(log.scans.iter().take(5).map(|scan| scan.number).collect::<Vec<_>>(), [0, 1, 3, 4, 5]);
    assert!(
        log.losses[0].contains("13 of 53 were left out and those with about 180 readings were kept"),
        "{:?}",
        log.losses
    );
    // A laser that was set up anew is the same laser.
    let changed: String = (0..40).map(|scan| if scan < 20 { rear(scan) } else { other(scan) }).collect();
    assert_eq!(read((drive(20, |_| String::new()) + &changed).as_bytes()).unwrap().scans.len(), 40);

    // Two that are alike, but sit elsewhere on the robot: the one that looks ahead is kept.
    let mounted = |scan: usize| {
        let (ahead, heading) = if scan.is_multiple_of(2) { (-0.2, PI) } else { (0.3, 0.0) };
        let x = 0.1 * scan as f64;
        format!(
            "ROBOTLASER1 0 -1.57 3.14 0.0174 50 0.1 0 4 1 2 3 4 0 {} 0 {heading} {x} 0 0 0 0 0 0 0 {scan} h 1\n",
            x + ahead
        )
    };
    let log = read((0..30).map(mounted).collect::<String>().as_bytes()).unwrap();
    assert_eq!(log.scans.len(), 15);
    assert!((log.T_robot_laser.translation.x - 0.3).abs() < 1e-9, "{:?}", log.T_robot_laser);
    assert!(log.losses[0].contains("15 of 30 were left out and the front one's were kept"), "{:?}", log.losses);
}

#[test]
fn a_log_that_was_cut_in_mid_scan_gives_the_rest() {
    let text = drive(60, |_| String::new());
    // At the end, wherever the cut is: within the readings, the poses or what follows them.
    let last = text[..text.len() - 1].rfind('\n').unwrap() + 1;
    for end in [last + 40, text.len() - 30, text.len() - 16, text.len() - 8] {
        let log = read(&text.as_bytes()[..end]).unwrap();
        assert_eq!((log.scans.len(), log.losses.len()), (59, 1), "{:?}", &text[end - 10..end]);
        assert!(log.losses[0].starts_with("Line 60, the last one, is cut off"), "{:?}", log.losses);
    }
    assert_eq!(read(&text.as_bytes()[..text.len() - 1]).unwrap().scans.len(), 60);
    // In the middle: the line is told, and the others keep their numbers.
    let (start, end) = (text.match_indices('\n').nth(19).unwrap().0, text.match_indices('\n').nth(20).unwrap().0);
    let spliced = format!("{}{}", &text[..start + 300], &text[end..]);
    let log = read(spliced.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[20].number, log.losses.len()), (59, 21, 1));
    assert!(log.losses[0].starts_with("A line was left out. Line 21: The line announces 180"), "{:?}", log.losses);
    // A file that is damaged all over is refused.
    assert!(read(text.replace(" 0 0 ", " x 0 ").as_bytes()).unwrap_err().to_string().starts_with("line 1: "));

    let list =
        "[{\"theta\": [0, 0.1], \"readings\": [1, null]}, {\"theta\": [0, 0.1], \"readings\": [1, 2]}, {\"theta\": [0,";
    let log = read(list.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.losses.len()), (2, 1));
    assert!(read(b"[{\"theta\": [0], \"readings\": [\"a\"]}]").is_err() && read(b"[{\"theta\": [0").is_err());
}

#[test]
fn a_log_that_was_cut_between_scans_says_so() {
    let line = |index: usize| format!("ODOM {index}.25 0.50 0.75 0 0 0 {index}.5 h {index}.5\n");
    let text = drive(60, line) + &line(60);
    let is_told = |text: &str| {
        let log = read(text.as_bytes()).unwrap();
        assert_eq!(log.scans.len(), 60, "{:?}", log.losses);
        match &log.losses[..] {
            [] => false,
            [loss] => loss.starts_with("Line 121, the last one, is cut off"),
            several => panic!("{several:?}"),
        }
    };
    let last = text[..text.len() - 1].rfind('\n').unwrap() + 1;
    // Within the word, within its pose, and within what follows that.
    for end in [last + 1, last + 3, last + 4, last + 9, last + 16, last + 20, last + 26] {
        assert!(is_told(&text[..end]), "{:?}", &text[last..end]);
    }
    assert!(!is_told(&text) && !is_told(&text[..text.len() - 1]) && !is_told(&text[..last]));
    assert!(!is_told(&format!("{text}# REF")) && !is_told(&format!("{text}MARKER 12")));
}

#[test]
fn a_gap_between_lines_of_odometry_is_told_where_scans_have_their_poses_from_them() {
    let scan = "RAWLASER1 0 -1 2 0.5 30 0.1 0 2 1 2 0 1.5 h 2\n";
    let with_gap = |gap: std::ops::Range<usize>| {
        let line =
            |index: usize| if gap.contains(&index) { String::new() } else { format!("ODOM {index} 0 0 0 0 0 1 h 1\n") };
        let text: String = (0..100).map(|index| line(index) + scan).collect();
        read(text.as_bytes()).unwrap().notes
    };
    let notes = with_gap(40..46);
    assert!(notes[0].contains("no line of odometry (ODOM) between scans 39 and 45: for 6 scans"), "{notes:?}");
    assert!(notes[0].ends_with("or place its scans without odometry (odometry=none)."), "{notes:?}");
    assert!(with_gap(0..0).is_empty() && with_gap(40..42).is_empty());
    // Lines that come more rarely than scans are no gap; poses in the scans' own lines need none.
    let rare: String = (0..100)
        .map(|index| if index % 4 == 0 { format!("ODOM {index} 0 0 0 0 0 1 h 1\n") } else { String::new() } + scan)
        .collect();
    assert!(read(rare.as_bytes()).unwrap().notes.is_empty());
    let own =
        drive(
            60,
            |index| if (20..40).contains(&index) { String::new() } else { format!("ODOM {index} 0 0 0 0 0 1 h 1\n") },
        );
    assert!(read(own.as_bytes()).unwrap().notes.iter().all(|note| !note.contains("ODOM")));
}

#[test]
fn the_times_of_the_radish_logs_are_those_of_the_relations() {
    let Some(folder) = shared_data("laser/radish") else { return };
    let log = read(&fs::read(folder.join("aces.clf")).unwrap()).unwrap();
    let times: Vec<Option<f64>> = log.scans.iter().map(|scan| scan.time).collect();
    let stamps = stamps(&times);
    assert_eq!((log.scans.len(), stamps.note), (7374, None));
    let times = stamps.times.unwrap();
    assert_eq!((times[0], times[1]), (70.2899, 70.410_399));
    let known = scanstitch::io::relations::read(&fs::read(folder.join("aces.relations")).unwrap()).unwrap();
    assert_eq!(known.len(), 1279);
    let is_scan = |time: f64| times.binary_search_by(|other| other.total_cmp(&time)).is_ok();
    assert!(known.iter().flat_map(|relation| relation.times().unwrap()).all(is_scan));
    // All of one time, to the digits that were written.
    let log = read(&fs::read(folder.join("belgioioso.log")).unwrap()).unwrap();
    let times: Vec<Option<f64>> = log.scans.iter().map(|scan| scan.time).collect();
    let stamps = scanstitch::io::laser_log::stamps::stamps(&times);
    assert!(stamps.times.is_none() && stamps.note.unwrap().contains("394 of 395 scans are not later"));
}

/// Bytes of good logs, changed, cut and mixed: an answer or an error, never a panic.
#[test]
fn hostile_logs_are_refused_or_read_and_never_break_anything() {
    let good = [
        "FLASER 4 1.0 2.0 81.83 nan 1 2 3 4 5 6 1.5 host 2.5\n".repeat(3),
        "VERTEX2 0 1 2 3\nROBOTLASER1 0 -1.57 3.14 0.01 50 0.1 0 3 1 2 3 1 7 1 2 3 4 5 6 0 0 0 0 0 9.5 h 1\n".repeat(3),
        "{\"nrays\":2,\"min_theta\":0,\"max_theta\":1,\"theta\":[0,1],\"readings\":[1,null],\"odometry\":[0,0,null]}\n"
            .repeat(3),
        "PARAM laser_front_laser_fov 100\nODOM 1 2 3 0 0 0 1 h 1\nRAWLASER1 0 -1 2 0.5 30 0.1 0 2 1 2 0 1.5 h 2\n"
            .repeat(2),
    ];
    let pieces: [&[u8]; 12] = [
        b"1e999",
        b"-1",
        b"nan",
        b"4294967296",
        b"18446744073709551615",
        b"null",
        b"[[[[",
        b"{",
        b"\0",
        b"\xff\xfe",
        b"FLASER",
        b"\r",
    ];
    let mut random = Random::new(11);
    let pick = |random: &mut Random, count: usize| (random.uniform(0.0, count as f64) as usize).min(count - 1);
    for text in &good {
        assert!(read(text.as_bytes()).is_ok(), "{text}");
        for _ in 0..3000 {
            let mut bytes = text.clone().into_bytes();
            for _ in 0..=pick(&mut random, 4) {
                let at = pick(&mut random, bytes.len());
                match pick(&mut random, 4) {
                    0 => bytes[at] = random.uniform(0.0, 256.0) as u8,
                    1 => bytes.truncate(at.max(1)),
                    2 => {
                        let piece = pieces[pick(&mut random, pieces.len())];
                        bytes.splice(at..at, piece.iter().copied());
                    }
                    _ => {
                        bytes.remove(at);
                        bytes.push(b' ');
                    }
                }
            }
            if let Ok(log) = read(&bytes) {
                let readings: usize = log.scans.iter().map(|scan| scan.ranges.len()).sum();
                assert!(!log.scans.is_empty() && readings <= bytes.len());
                assert!(log.scans.iter().all(|scan| scan.points().len() <= scan.ranges.len()));
            }
        }
    }
    let deep = [b"[".repeat(200_000), b"{\"readings\":".repeat(50_000)].concat();
    assert!(read(&deep).is_err());
}
