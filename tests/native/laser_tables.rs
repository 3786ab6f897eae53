//! Laser logs as tables, and those of courses: what is read against what NumPy and Python's csv read in the same files.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fs;

use crate::common::shared_data;
use scanstitch::geometry::RigidMotion;
use scanstitch::io::laser_log::table::{TableFormat, describe, read_as, read_given};
use scanstitch::io::laser_log::{Bearings, LaserLog, LaserScan, OdometryOrigin, is_laser_log, read};
use scanstitch::io::trajectory;

fn text_log(name: &str) -> Option<(Vec<u8>, LaserLog)> {
    let bytes = fs::read(shared_data(&format!("laser/text/{name}"))?).unwrap();
    assert!(is_laser_log(&bytes[..bytes.len().min(8192)]), "{name}");
    let log = read(&bytes).unwrap();
    Some((bytes, log))
}

/// Sum of the readings that are some (m).
fn sum(scan: &LaserScan) -> f64 {
    scan.ranges.iter().filter(|range| range.is_finite()).map(|&range| f64::from(range)).sum()
}

#[test]
fn the_log_of_cmus_course_is_read_in_centimetres_with_its_laser_ahead() {
    let Some((_, log)) = text_log("cmu_wean_robotdata1.log") else { return };
    assert_eq!(log.scans.len(), 713);
    assert!(log.losses.is_empty() && log.notes.is_empty());
    let offset = log.T_robot_laser.translation;
    assert!((offset.x - 0.25).abs() < 0.005 && offset.y.abs() < 0.005, "{offset}");
    let scan = &log.scans[100];
    assert_eq!(scan.ranges.len(), 180);
    assert_eq!(scan.bearings, Bearings::Even { start: -FRAC_PI_2, step: PI / 180.0 });
    assert!((sum(scan) - 515.65).abs() < 1e-3, "{}", sum(scan));
    assert!((log.scans[712].time.unwrap() - 134.872_838).abs() < 1e-9);
    let odometry = log.scans[0].odometry.unwrap();
    assert!((odometry.translation.x + 0.942_34).abs() < 1e-6 && (odometry.rotation.angle() + 1.342_158).abs() < 1e-9);
}

#[test]
fn readings_below_nothing_are_none_in_any_log() {
    let cmu = "L 10 2 0 30 0 0 300 -100 300 0.1\n".repeat(4);
    let csm =
        r#"{"nrays":3,"min_theta":-1,"max_theta":1,"min_range":-5,"readings":[3,-1,3],"theta":[-1,0,1]}"#.to_owned();
    let echo =
        "%time,field.angle_min,field.angle_increment,field.range_min,field.range_max,field.ranges0,field.ranges1,\
                field.ranges2\n1,-1,1,-5,9,3,-1,3\n"
            .to_owned();
    for text in [cmu, csm, echo] {
        for scan in read(text.as_bytes()).unwrap().scans {
            assert_eq!(
                scan.ranges.iter().map(|range| range.is_nan()).collect::<Vec<_>>(),
                [false, true, false],
                "{text}"
            );
            assert_eq!(scan.points().len(), 2);
        }
    }
}

#[test]
fn breezyslams_log_is_read_with_its_ticks_as_odometry() {
    let Some((_, log)) = text_log("breezyslam_exp1.dat") else { return };
    assert_eq!(log.scans.len(), 756);
    let scan = &log.scans[5];
    assert_eq!(scan.ranges.len(), 682);
    assert!((sum(scan) - 383.705).abs() < 1e-2, "{}", sum(scan));
    let Bearings::Even { start, step } = scan.bearings else { panic!("{:?}", scan.bearings) };
    assert!((start + TAU / 3.0).abs() < 1e-9 && (step - TAU / 1024.0).abs() < 1e-9);
    assert!((log.T_robot_laser.translation.x - 0.145).abs() < 1e-9);
    let way = log.scans.windows(2).map(|pair| {
        let step = pair[0].odometry.unwrap().inverse() * pair[1].odometry.unwrap();
        step.translation_norm()
    });
    let way: f64 = way.sum();
    assert!((5.0..60.0).contains(&way), "{way} m");
}

#[test]
fn rostopics_tables_are_read_by_the_names_of_their_columns() {
    let Some((_, log)) = text_log("rostopic_scan.csv") else { return };
    assert_eq!(log.scans.len(), 199);
    let scan = &log.scans[6];
    assert!((sum(scan) - 228.574).abs() < 1e-2, "{}", sum(scan));
    assert!((scan.time.unwrap() - 1_747_151_385.047_578_5).abs() < 1e-6);
    let bytes = fs::read(shared_data("laser/text/rostopic_odom.csv").unwrap()).unwrap();
    let odometry = trajectory::read(&bytes).unwrap();
    assert_eq!(odometry.len(), 1199);
    assert!((odometry.stamps.as_ref().unwrap()[9] - 1_747_151_383.929_859_9).abs() < 1e-6);
    assert!((odometry.positions[9].x - 0.000_218_268_905_882_723_63).abs() < 1e-12);
    assert!(odometry.orientations.is_some());
}

/// The clock of a simulation begins at zero.
#[test]
fn rostopics_times_are_nanoseconds_however_small() {
    let head = "%time,field.header.stamp,field.angle_min,field.angle_increment,field.ranges0,field.ranges1\n";
    let log = read(format!("{head}12600000000,12500000000,0,0.1,1,2\n").as_bytes()).unwrap();
    assert!((log.scans[0].time.unwrap() - 12.5).abs() < 1e-9);
    let head = "%time,field.angle_min,field.angle_increment,field.ranges0,field.ranges1\n";
    let log = read(format!("{head}12600000000,0,0.1,1,2\n").as_bytes()).unwrap();
    assert!((log.scans[0].time.unwrap() - 12.6).abs() < 1e-9);
    let head = "Time,header.stamp.secs,header.stamp.nsecs,angle_min,angle_increment,ranges_0,ranges_1\n";
    let log = read(format!("{head}12.6,12,500000000,0,0.1,1,2\n").as_bytes()).unwrap();
    assert!((log.scans[0].time.unwrap() - 12.5).abs() < 1e-9);
}

#[test]
fn a_step_and_its_range_a_line_is_one_scan() {
    let Some((bytes, log)) = text_log("lidar0f.csv") else { return };
    let [scan] = &log.scans[..] else { panic!("{} scans", log.scans.len()) };
    assert_eq!(scan.ranges.len(), 1081);
    assert_eq!(scan.ranges.iter().filter(|range| range.is_nan()).count(), 384, "1 mm is none");
    assert!((sum(scan) - 8_572.002).abs() < 0.1, "{}", sum(scan));
    let [note] = &log.notes[..] else { panic!("{:?}", log.notes) };
    assert!(note.contains("range=2,unit=mm,start=-135deg,step=0.25deg"), "{note}");
    let format = "range=2,unit=cm,start=-1,step=0.01".parse().unwrap();
    let scan = &read_as(&bytes, &format).unwrap().scans[0];
    assert_eq!(scan.bearings, Bearings::Even { start: -1.0, step: 0.01 });
    assert!((sum(scan) - 10.0 * 8_572.002).abs() < 1.0);
}

#[test]
fn a_format_reads_times_poses_and_units() {
    let format: TableFormat =
        "ranges=2:4,unit=cm,start=-90deg,step=90deg,time=1:ms,odometry=5:6:7,ahead=0.2".parse().unwrap();
    let log = read_as(b"t,a,b,c,x,y,h\n500 100 0 300 10 20 0.5\n600 101 1 301 11 21 0.6\n700 102", &format).unwrap();
    assert_eq!(log.scans.len(), 2);
    assert_eq!(log.losses, ["The last line is cut off and was left out."]);
    let scan = &log.scans[1];
    assert_eq!((scan.ranges[0], scan.ranges[1].is_nan(), scan.ranges[2]), (1.01, true, 3.01));
    assert_eq!(scan.time, Some(0.6));
    let odometry = scan.odometry.unwrap();
    assert!((odometry.translation.x - 0.11).abs() < 1e-12 && (odometry.rotation.angle() - 0.6).abs() < 1e-12);
    assert!((log.T_robot_laser.translation.x - 0.2).abs() < 1e-12);
    // What is written is what is read.
    assert_eq!(format.to_string().parse::<TableFormat>().unwrap(), format);
}

#[test]
fn wheels_make_the_way_of_an_arc() {
    // A quarter of a circle of 1 m: wheels 0.2 m apart roll 0.9 and 1.1 times pi / 2.
    let text = "0 0 1 2 3\n1413.7166941 1727.8759594 1 2 3\n";
    let format = "ranges=3:5,unit=m,start=0,step=0.1,wheels=1:2:0.001:0.2".parse().unwrap();
    let end = read_as(text.as_bytes(), &format).unwrap().scans[1].odometry.unwrap();
    assert!((end.rotation.angle() - FRAC_PI_2).abs() < 1e-6, "{end}");
    let (x, y) = (end.translation.x, end.translation.y);
    assert!(
        (x - y).abs() < 1e-6 && (x.hypot(y) - FRAC_PI_2).abs() < 1e-6,
        "one step is its own chord, as long as the arc"
    );
}

#[test]
fn guesses_follow_the_numbers() {
    let row = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let table = |beams: usize, scale: f64, with_time: bool| {
        let line = |scan: usize| {
            let mut values = if with_time { vec![0.1 * scan as f64] } else { Vec::new() };
            values.extend(
                (0..beams)
                    .map(|beam| (scale * (2.0 + 0.01 * beam.min(beams - beam) as f64)).round().max(1.0 + scale / 1e3)),
            );
            row(&values)
        };
        (0..5).map(line).collect::<Vec<_>>().join("\n") + "\n"
    };
    for (beams, scale, with_time, expected) in [
        (541, 1000.0, true, "ranges=2:542,unit=mm,start=-135deg,step=0.5deg,time=1:s"),
        (360, 1000.0, false, "ranges=1:360,unit=mm,start=0deg,step=1deg"),
        (181, 100.0, false, "ranges=1:181,unit=cm,start=-90deg,step=1deg"),
    ] {
        let text = table(beams, scale, with_time);
        assert_eq!(TableFormat::guess(text.as_bytes()).unwrap().format.to_string(), expected);
        assert!(is_laser_log(text.as_bytes()));
    }
    let error = read(table(333, 1000.0, false).as_bytes()).unwrap_err();
    assert!(error.problem.contains("333 readings") && error.remedy.contains("--table"), "{error}");
    // Trajectories are none, however long.
    for text in ["0 1 2 3 4 5 6 7\n1 2 3 4 5 6 7 8\n", "0 1 2\n1 2 3\n", "1 0 0 0 0 1 0 0 0 0 1 0\n"] {
        assert!(!is_laser_log(text.repeat(30).as_bytes()), "{text}");
    }
}

/// Readings from a bearing on, a step apart (rad), in a room of 6 x 4 m from a place in it.
fn in_room([x, y]: [f64; 2], heading: f64, start: f64, step: f64) -> Vec<String> {
    let range = |beam: usize| {
        let (dy, dx) = (heading + start + step * beam as f64).sin_cos();
        let along = |at: f64, direction: f64, half: f64| (half * direction.signum() - at) / direction;
        along(x, dx, 3.0).min(along(y, dy, 2.0))
    };
    (0..360).map(|beam| format!("{:.3}", range(beam))).collect()
}

#[test]
fn readings_that_do_not_meet_go_round_no_full_turn() {
    let guess = |start: f64, step: f64| {
        let line =
            |scan: usize| in_room([0.1 * scan as f64 - 1.0, 0.5], 0.02 * scan as f64, start, step).join(",") + "\n";
        TableFormat::guess((0..20).map(line).collect::<String>().as_bytes()).unwrap()
    };
    let round = guess(0.0, TAU / 360.0);
    assert_eq!((round.format.to_string(), round.doubt), ("ranges=1:360,unit=m,start=0deg,step=1deg".into(), None));
    let half = guess(-TAU / 4.0, TAU / 720.0);
    assert_eq!(half.format.to_string(), "ranges=1:360,unit=m,start=-90deg,step=0.5deg");
    assert!(half.doubt.is_some_and(|doubt| doubt.contains("does not meet the first")));
}

#[test]
fn recordings_over_a_half_turn_are_asked_about() {
    let Some(folder) = shared_data("laser") else { return };
    for name in ["fr079/fr079.log", "radish/freiburg-101.log"] {
        let log = read(&fs::read(folder.join(name)).unwrap()).unwrap();
        let line = |scan: &LaserScan| {
            let ranges = scan.ranges.iter().map(|range| if range.is_finite() { *range } else { 0.0 });
            ranges.map(|range| format!("{range:.2}")).collect::<Vec<_>>().join(",") + "\n"
        };
        let text: String = log.scans.iter().filter(|scan| scan.ranges.len() == 360).map(line).collect();
        let guess = TableFormat::guess(text.as_bytes()).unwrap();
        assert!(guess.doubt.is_some(), "{name}: {}", guess.format);
        assert!(guess.format.to_string().contains("start=-90deg,step=0.5deg"), "{name}: {}", guess.format);
    }
}

#[test]
fn what_stands_beside_the_ranges_is_told_from_them() {
    let wave = |scan: usize, beam: usize| 2.0 + (TAU / 120.0 * beam as f64).sin().abs() + 0.01 * scan as f64;
    let table = |line: &dyn Fn(usize) -> Vec<String>, head: &str| {
        (0..8).fold(head.to_owned(), |text, scan| text + &line(scan).join(",") + "\n")
    };
    let ranges = |scan: usize, beams: usize| (0..beams).map(move |beam| format!("{:.3}", wave(scan, beam)));
    // 180 readings behind a time are not the 181 of another laser.
    let timed =
        |scan: usize| [format!("{}", 1_700_000_000_000_u64 + 100 * scan as u64)].into_iter().chain(ranges(scan, 180));
    let guess = |text: &str| TableFormat::guess(text.as_bytes()).unwrap().format.to_string();
    assert_eq!(
        guess(&table(&|scan| timed(scan).collect(), "")),
        "ranges=2:181,unit=m,start=-90deg,step=1deg,time=1:ms"
    );
    // Names tell the pose; words stay in their columns.
    let named = |scan: usize| {
        let beside = [format!("{}", 0.1 * scan as f64), "laser".to_owned()];
        beside.into_iter().chain(ranges(scan, 360)).chain(["-1.5", "0.2", "0.1"].map(str::to_owned)).collect()
    };
    let names: Vec<String> = (0..360).map(|beam| format!("range_{beam}")).collect();
    let head = format!("time,frame,{},x,y,theta\n", names.join(","));
    let text = table(&named, &head);
    assert_eq!(guess(&text), "ranges=3:362,unit=m,start=0deg,step=1deg,time=1:s,poses=363:364:365");
    let log = read(text.as_bytes()).unwrap();
    assert!(log.odometry_origin == OdometryOrigin::Unknown && (log.scans[7].time.unwrap() - 0.7).abs() < 1e-9);
    assert!((log.scans[0].odometry.unwrap().translation.x + 1.5).abs() < 1e-12);
}

#[test]
fn scans_of_ros_2_without_names_are_read_by_their_angles() {
    let line = |scan: usize| {
        let head = format!("{scan},500000000,laser_frame,-1.57,1.57,0.0314,0.0,0.1,0.15,12.0");
        let ranges: String = (0..101).map(|beam| if beam == 3 { ",inf" } else { ",2.5" }).collect();
        format!("{head}{ranges}{}\n", ",0.0".repeat(101))
    };
    let text: String = (0..4).map(line).collect();
    let log = read(text.as_bytes()).unwrap();
    let scan = &log.scans[0];
    assert_eq!((scan.ranges.len(), scan.ranges[0], scan.ranges[100]), (101, 2.5, 2.5));
    assert_eq!(scan.bearings, Bearings::Even { start: -1.57, step: 0.0314 });
    assert_eq!(scan.points().len(), 100);

    // An increment so small that the ranges cannot be counted.
    let text = format!("-1,1,1e-300,0,0,0.1,10{}\n", ",2.5".repeat(30)).repeat(4);
    assert!(TableFormat::guess(text.as_bytes()).is_ok());
}

#[test]
fn labels_before_the_numbers_name_them() {
    let line = |beam: usize| {
        format!(
            "{} theta: {}.00 Dist: {:08.2} Q: 47 \n",
            if [0, 90].contains(&beam) { "S" } else { " " },
            4 * (beam % 90),
            2000
        )
    };
    let text: String = (0..180).map(line).collect();
    assert!(is_laser_log(text.as_bytes()));
    let log = read(text.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[1].ranges.len(), log.scans[1].ranges[89]), (2, 90, 2.0));
}

#[test]
fn decimal_commas_are_read() {
    let line = |scan: usize| (0..181).map(|beam| format!("{},{}", 2 + scan, 100 + beam)).collect::<Vec<_>>().join(";");
    let text = format!("{}\r\n{}\r\n", line(0), line(1));
    let log = read(text.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[1].ranges.len(), log.scans[1].ranges[5]), (2, 181, 3.105));
}

#[test]
fn dates_quotes_and_thousands_leave_numbers_what_they_are() {
    let scan = |cell: &dyn Fn(usize) -> String| (0..181).map(|beam| cell(900 + 7 * beam)).collect::<Vec<_>>();
    let german = |line: usize| {
        let cells = scan(&|mm| format!("\"{},{:03}\"", mm / 1000, mm % 1000));
        format!("03.05.2024;10:00:0{line},250;{}\n", cells.join(";"))
    };
    let grouped = |line: usize| {
        let cells = scan(&|mm| if mm < 1000 { mm.to_string() } else { format!("\"{},{:03}\"", mm / 1000, mm % 1000) });
        format!("{line},{}\n", cells.join(","))
    };
    let names = |stem: &str| (0..181).map(|beam| format!("{stem}{beam}")).collect::<Vec<_>>();
    for (text, time) in [
        (format!("Datum;Uhrzeit;{}\n{}{}", names("r").join(";"), german(1), german(2)), 36_002.25),
        (format!("t,{}\n{}{}", names("mm_").join(","), grouped(1), grouped(2)), 2.0),
    ] {
        assert!(is_laser_log(text.as_bytes()));
        let log = read(text.as_bytes()).unwrap();
        let scan = &log.scans[1];
        assert_eq!((log.scans.len(), scan.ranges.len(), scan.time), (2, 181, Some(time)), "{:?}", log.notes);
        assert!((f64::from(scan.ranges[100]) - 1.6).abs() < 1e-6, "{}", scan.ranges[100]);
    }
}

#[test]
fn what_stands_between_the_ranges_is_left_out_and_told() {
    let names: Vec<String> = (0..181).map(|beam| format!("range_{beam},intensity_{beam}")).collect();
    let cells: Vec<String> = (0..181).map(|beam| format!("{}.{beam:03},{}", 2 + beam / 100, beam * 37 % 50)).collect();
    let text = format!("time,{}\n0.1,{}\n0.2,{}\n", names.join(","), cells.join(","), cells.join(","));
    let log = read(text.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[1].ranges.len(), log.scans[1].ranges[3]), (2, 181, 2.003));
    assert!(log.notes.iter().any(|note| note.contains("intensity_0 and so on")), "{:?}", log.notes);
}

/// As pandas writes messages that a bag's reader gave it.
#[test]
fn lists_in_the_cells_of_messages_are_the_elements() {
    let head = "Time,header.frame_id,angle_min,angle_increment,range_min,range_max,ranges,intensities\n";
    for (open, close) in [("(", ")"), ("[", "]")] {
        let rows = format!(
            "1.5,laser,-1,0.5,0.1,30,\"{open}1.5, inf, 2.5{close}\",\"{open}{close}\"\n1.6,laser,-1,0.5,0.1,30,\"{open}1.5, 3.5{close}\",\"{open}{close}\"\n"
        );
        let log = read(format!("{head}{rows}").as_bytes()).unwrap();
        let ranges =
            |scan: usize| log.scans[scan].ranges.iter().filter(|range| range.is_finite()).copied().collect::<Vec<_>>();
        assert_eq!((ranges(0), ranges(1)), (vec![1.5, 2.5], vec![1.5, 3.5]));
        assert_eq!((log.scans[1].time, log.scans[0].ranges.len()), (Some(1.6), 3));
    }
}

#[test]
fn points_in_space_are_no_scans_of_a_plane() {
    let rows = |elevation: &dyn Fn(usize) -> f64| -> String {
        (0..360).map(|row| format!("{row},{},2.5\n", elevation(row))).collect::<Vec<_>>().concat()
    };
    let table = |text: String| read(format!("azimuth_deg,elevation_deg,range_m\n{text}").as_bytes());
    let problem = table(rows(&|row| (row % 16) as f64 - 8.0)).unwrap_err().to_string();
    assert!(
        problem.contains("points in space, with \"elevation_deg\"") && problem.contains("Write x, y and z"),
        "{problem}"
    );
    assert_eq!(table(rows(&|_| 0.0)).unwrap().scans.len(), 1);
}

#[test]
fn logs_of_words_may_have_decimal_commas() {
    let readings: Vec<String> = (0..181).map(|beam| format!("1,{beam:03}")).collect();
    let line = |time: usize| format!("FLASER 181 {} 0,5 0 0 0,5 0 0 {time},25 h 0,1\n", readings.join(" "));
    let log = read(format!("{}{}", line(1), line(2)).as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[1].ranges[180], log.scans[1].time), (2, 1.18, Some(2.25)));
}

#[test]
fn decimal_commas_are_told_wherever_the_beginning_of_a_table_ends() {
    let scan: Vec<String> = (0..60).map(|beam| format!("2,{beam:02}")).collect();
    let table = format!("{}\n", scan.join(";")).repeat(20);
    assert!((4000..4010).all(|length| is_laser_log(&table.as_bytes()[..length])));
}

#[test]
fn an_angle_and_a_range_a_line_are_scans_that_end_where_the_angle_jumps_back() {
    let range = |scan: usize, beam: usize| if beam == 7 { 0 } else { 1000 + scan };
    let line = |reading: usize| format!("{},{},15", 4 * (reading % 90), range(reading / 90, reading % 90));
    let lines: Vec<String> = (0..270).map(line).collect();
    let text = format!("angle,distance_mm,quality\n{}\n", lines.join("\n"));
    assert!(is_laser_log(text.as_bytes()));
    let log = read(text.as_bytes()).unwrap();
    assert_eq!(log.scans.len(), 3);
    let scan = &log.scans[2];
    assert!((scan.bearings.of(45) - PI).abs() < 1e-9 && scan.ranges[7].is_nan());
    assert!((scan.ranges[0] - 1.002).abs() < 1e-6);
    // Clockwise, as some lasers turn.
    let turned = read_given(text.as_bytes(), "range=2,angle=1:-1deg,unit=mm").unwrap();
    assert!((turned.scans[0].bearings.of(10) + 40f64.to_radians()).abs() < 1e-9);
}

#[test]
fn a_format_in_part_changes_the_guess_and_a_whole_one_replaces_it() {
    let line = |scan: usize| format!("{} {}\n", 0.1 * scan as f64, "1500 ".repeat(361));
    let text: String = (0..6).map(line).collect();
    let scan = |given: &str| read_given(text.as_bytes(), given).unwrap().scans.swap_remove(1);
    assert_eq!((scan("unit=cm").ranges[0], scan("unit=cm").time), (15.0, Some(0.1)));
    let whole = scan("ranges=2:100,start=0,step=1deg");
    assert_eq!((whole.ranges.len(), whole.time, whole.ranges[0]), (99, None, 1.5));
    assert_eq!(scan("time=none").time, None);
    // A comment says it in the file; what is given overrides it.
    let said = format!("# table: unit=cm,step=0.25deg\n{text}");
    let log = read(said.as_bytes()).unwrap();
    assert_eq!(log.scans[0].ranges[0], 15.0);
    assert!(log.notes[0].contains("step=0.25deg"), "{:?}", log.notes);
    assert_eq!(read_given(said.as_bytes(), "unit=mm").unwrap().scans[0].ranges[0], 1.5);
}

#[test]
fn plotjugglers_names_are_those_of_the_message() {
    let names: Vec<String> = (0..30).map(|beam| format!("/scan/ranges[{beam}]")).collect();
    let ranges = vec!["2.5"; 30].join(",");
    let text = format!(
        "__time,/scan/angle_increment,/scan/angle_min,/scan/range_max,/scan/range_min,{}\n1.5,0.1,-1.5,30,0.1,{ranges}\n",
        names.join(",")
    );
    assert!(is_laser_log(text.as_bytes()));
    let log = read(text.as_bytes()).unwrap();
    assert_eq!(log.scans[0].bearings, Bearings::Even { start: -1.5, step: 0.1 });
    assert_eq!((log.scans[0].ranges.len(), log.scans[0].time), (30, Some(1.5)));
    // An empty cell is no return; other names that count are ranges, too.
    let text = text.replacen("2.5,", ",", 1).replace("/scan/ranges", "r");
    let log = read(text.as_bytes()).unwrap();
    assert!(log.scans[0].ranges[0].is_nan() && log.scans[0].ranges.len() == 30 && log.scans[0].ranges[1] == 2.5);
}

#[test]
fn a_file_of_one_sweep_is_one_scan_wherever_its_view_has_a_gap() {
    let rows = |angles: &mut dyn Iterator<Item = i32>| {
        angles.fold("angle,distance\n".to_owned(), |text, angle| text + &format!("{angle},{}.5\n", 1 + angle % 7))
    };
    // From 0, with nothing behind the laser.
    let ahead = || (0..360).filter(|angle| !(91..270).contains(angle));
    let one = read(rows(&mut ahead()).as_bytes()).unwrap();
    assert_eq!(one.scans.iter().map(|scan| scan.ranges.len()).collect::<Vec<_>>(), [181]);
    // Of several sweeps each begins behind the gap.
    let several = read(rows(&mut ahead().chain(ahead()).chain(ahead())).as_bytes()).unwrap();
    assert_eq!(several.scans.iter().map(|scan| scan.ranges.len()).collect::<Vec<_>>(), [91, 181, 181, 90]);
}

#[test]
fn a_column_a_scan_beside_one_of_bearings_is_turned() {
    let row = |beam: i32| format!("{},{}.25,{}.5\n", beam - 90, 2 + beam % 5, 3 + beam % 4);
    let text = (0..181).fold("angle_deg,scan_1,scan_2\n".to_owned(), |text, beam| text + &row(beam));
    assert!(is_laser_log(&text.as_bytes()[..200]));
    let log = read(text.as_bytes()).unwrap();
    assert_eq!(log.scans.len(), 2);
    let Bearings::Even { start, step } = log.scans[1].bearings else { panic!("{:?}", log.scans[1].bearings) };
    assert!((start + FRAC_PI_2).abs() < 1e-9 && (step - PI / 180.0).abs() < 1e-9);
    assert_eq!((log.scans[0].ranges[3], log.scans[1].ranges[180]), (5.25, 3.5));
}

#[test]
fn a_thousand_columns_may_have_names() {
    let names = (0..1081).map(|beam| format!("ranges[{beam}]")).collect::<Vec<_>>().join(",");
    let row = vec!["2.503"; 1081].join(",");
    let log = read(format!("time,{names}\n0.0,{row}\n0.1,{row}\n").as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[1].ranges.len()), (2, 1081));
}

#[test]
fn a_line_with_a_word_in_place_of_the_angle_is_no_reading() {
    // What a Neato prints.
    let readings: String =
        (0..360).fold(String::new(), |text, angle| text + &format!("{angle},{},1200,0\n", 1500 + angle));
    let text = format!("AngleInDegrees,DistInMM,Intensity,ErrorCodeHEX\n{readings}ROTATION_SPEED,5.01\n");
    let log = read(text.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[0].ranges.len()), (1, 360));
    assert!((log.scans[0].ranges[10] - 1.51).abs() < 1e-6);
}

#[test]
fn a_column_that_counts_the_ranges_behind_it_tells_where_they_are() {
    // As the log of a course on SLAM: S, a time, the count, the ranges in mm; a pose may follow.
    let beams: Vec<String> = (0..40).map(|beam| (2900 + 10 * beam).to_string()).collect();
    let line = |scan: usize, pose: &str| format!("S {} 40 {}{pose}\n", 1000 * scan, beams.join(" "));
    for pose in ["", " 0.5 0.25 0.1"] {
        let text = (0..4).map(|scan| line(scan, pose)).collect::<Vec<_>>().concat();
        let guess = TableFormat::guess(text.as_bytes()).unwrap();
        let written = guess.format.to_string();
        assert!(written.starts_with("ranges=4:43,unit=mm,") && written.contains("time=2"), "{written}");
    }
    // The same number in every line that is no such count is a range.
    let wall = format!("40 {}\n", vec!["2.5"; 180].join(" ")).repeat(4);
    assert!(TableFormat::guess(wall.as_bytes()).unwrap().format.to_string().starts_with("ranges=1:181"));
}

#[test]
fn damaged_lines_are_left_out_and_the_others_keep_their_numbers() {
    let line = |scan: usize| if scan == 20 { "1500 oops\n".to_owned() } else { format!("{}\n", "1500 ".repeat(181)) };
    let text: String = (0..60).map(line).collect();
    let log = read(text.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[19].number, log.scans[20].number), (59, 19, 21));
    assert!(log.losses[0].contains("Line 21"), "{:?}", log.losses);
}

#[test]
fn a_table_is_described_before_it_is_read() {
    let text = format!("a b\n{}", format!("{}\n", "1500 ".repeat(333)).repeat(3));
    let facts = describe(text.as_bytes(), None, 0).unwrap();
    assert_eq!((facts.num_rows, facts.num_columns, facts.num_scans, facts.points.len()), (3, 333, 3, 333));
    assert!(facts.doubt.contains("333 readings") && facts.problem.is_empty());
    assert_eq!(facts.names, ["a", "b"]);
    let facts = describe(text.as_bytes(), Some("ranges=1:400"), 0).unwrap();
    assert!(facts.problem.contains("333 numbers"), "{}", facts.problem);
    let facts = describe(text.as_bytes(), Some("ranges=1:9,unit=furlongs"), 0).unwrap();
    assert!(facts.problem.contains("not a value of unit") && facts.num_scans == 0);
    assert!(describe(b"no numbers\n", None, 0).is_err());
    let facts = describe("1500 ".repeat(2500).as_bytes(), None, 0).unwrap();
    assert_eq!((facts.num_columns, facts.cells[0].len()), (2500, 2500));
}

#[test]
fn bad_tables_are_told_with_line_and_remedy() {
    for (format, words) in [
        ("ranges=4:2,start=0,step=1", "is not a value of ranges"),
        ("ranges=0:9,start=0,step=1", "is not a value of ranges"),
        ("ranges=1:9,unit=furlongs,start=0,step=1", "is not a value of unit"),
        ("ranges=1:9,start=0", "needs ranges"),
        ("ranges=1:9,start=0,step=0", "is not a value of step"),
        ("rangers=1:9", "is nothing of a table's format"),
        ("wheels", "is not name=value"),
    ] {
        let error = format.parse::<TableFormat>().unwrap_err();
        assert!(error.problem.contains(words) && error.remedy.contains("ranges="), "{format}: {error}");
    }
    for (names, given) in [("angle,range\n", "range=2,angle=1:deg"), ("a,b\n", "ranges=1:2,start=0,step=1")] {
        let error = read_given(names.as_bytes(), given).unwrap_err();
        assert_eq!(error.problem, "The file holds no line of numbers", "{given}");
    }
    let format = "ranges=2:4,start=0,step=1".parse().unwrap();
    let error = read_as(b"1 2 3 4\n1 2 x 4\n1 2 3 4\n", &format).unwrap_err();
    assert!(error.to_string().contains("line 2"), "{error}");
    let error = read_as(b"1 2 3 4\n1 2\n1 2 3 4\n", &format).unwrap_err();
    assert!(error.to_string().contains("line 2") && error.problem.contains("2 numbers"), "{error}");
    let head = "%time,field.header.stamp,field.angle_min,field.angle_increment,field.ranges0,field.ranges1\n";
    let error = read(format!("{head}1,2,0,0.1,1,2\n1,2,0,0.1,1\n1,2,0,0.1,1,2\n").as_bytes()).unwrap_err();
    assert!(error.to_string().contains("line 3"), "{error}");
    let log = read(format!("{head}1,2,0,0.1,1,2\n1,2,0,0.1,1").as_bytes()).unwrap();
    assert!(log.scans.len() == 1 && log.losses[0].contains("Line 3"));
}

#[test]
fn every_length_of_a_cut_log_is_borne() {
    let logs = [
        "L 0 0 0 25 0 0 100 110 120 130 0.1\nO 1 2 0.1 0.2\nL 1 0 0 26 0 0 100 110 120 130 0.3\n".to_owned(),
        "%time,field.angle_min,field.angle_increment,field.ranges0,field.ranges1\n1,0,0.1,1,2\n2,0,0.1,1,2\n"
            .to_owned(),
        format!("{}\n", "1500 ".repeat(181)).repeat(3),
    ];
    for log in logs {
        for end in 0..log.len() {
            let _ = is_laser_log(&log.as_bytes()[..end]);
            if let Ok(log) = read(&log.as_bytes()[..end]) {
                assert!(!log.scans.is_empty() && log.scans.iter().all(|scan| scan.ranges.len() >= 2));
            }
        }
    }
}

#[test]
fn names_tell_the_ranges_their_angles_and_the_units() {
    let wave = |scan: usize, beam: usize| 2.0 + (0.05 * beam as f64).sin().abs() + 0.01 * scan as f64;
    let joined = |cells: Vec<String>, gap: &str| cells.join(gap) + "\n";
    let ranges = |scan: usize, digits: usize, scale: f64| -> Vec<String> {
        (0..181).map(|beam| format!("{:.digits$}", scale * wave(scan, beam))).collect()
    };
    // A date of two words is one cell; the beams are named by their angles.
    let beams: Vec<String> = (0..181).map(|beam| format!("{} deg", beam - 90)).collect();
    let head = joined([vec!["Date".into(), "Battery (V)".into()], beams, vec!["Temp".into()]].concat(), ",");
    let row = |scan: usize| {
        let date = vec![format!("2024-03-01 10:00:0{scan}"), "12.4".into()];
        joined([date, ranges(scan, 0, 1000.0), vec!["21.5".into()]].concat(), ",")
    };
    let text = (0..8).fold(head, |text, scan| text + &row(scan));
    let guess = TableFormat::guess(text.as_bytes()).unwrap();
    assert_eq!(guess.format.to_string(), "ranges=3:183,unit=mm,start=-90deg,step=1deg,time=1:s");
    assert_eq!(guess.doubt, None);
    let log = read(text.as_bytes()).unwrap();
    assert_eq!(log.scans[3].time, Some(1_709_287_203.0), "seconds since 1970 of the date");
    assert_eq!((log.scans.len(), log.scans[0].ranges.len(), log.scans[0].ranges[0]), (8, 181, 2.0));

    // Semicolons and decimal commas; poses in metres and degrees beside ranges in millimetres.
    let names: Vec<String> = (0..181).map(|beam| format!("r{beam}")).collect();
    let head =
        joined([vec!["Zeit".into(), "X (m)".into(), "Y (m)".into(), "Winkel (deg)".into()], names].concat(), ";");
    let row = |scan: usize| {
        let pose = [0.1, 0.25, 0.5, 90.0].map(|part| format!("{:.2}", part * scan as f64)).to_vec();
        joined([pose, ranges(scan, 1, 1000.0)].concat(), ";").replace('.', ",")
    };
    let text = (0..8).fold(head, |text, scan| text + &row(scan));
    let format = TableFormat::guess(text.as_bytes()).unwrap().format;
    let expected = "ranges=5:185,unit=mm,start=-90deg,step=1deg,time=1:s,poses=2:3:4:m:deg";
    assert_eq!(format.to_string(), expected);
    assert_eq!(format.to_string().parse::<TableFormat>().unwrap().to_string(), expected);
    let third = &read(text.as_bytes()).unwrap().scans[2];
    let pose = third.odometry.unwrap();
    assert!(
        (pose.translation.x - 0.5).abs() < 1e-12 && (pose.rotation.angle().abs() - std::f64::consts::PI).abs() < 1e-12
    );

    // Positions with fractions beside whole millimetres are metres.
    let row = |scan: usize| {
        let pose = [0.1, 0.123, 0.5, 0.2].map(|part| format!("{:.3}", part * scan as f64)).to_vec();
        joined([pose, ranges(scan, 0, 1000.0)].concat(), ",")
    };
    let names: Vec<String> = (0..181).map(|beam| format!("r{beam}")).collect();
    let head = joined([["t", "x", "y", "theta"].map(str::to_owned).to_vec(), names].concat(), ",");
    let format = TableFormat::guess((0..8).fold(head, |text, scan| text + &row(scan)).as_bytes()).unwrap().format;
    assert!(format.to_string().ends_with("unit=mm,start=-90deg,step=1deg,time=1:s,poses=2:3:4:m"), "{format}");

    // Without names, one more column before the ranges may be one of them.
    let text = (0..8).map(|scan| joined([vec!["7.5".into()], ranges(scan, 3, 1.0)].concat(), ",")).collect::<String>();
    let doubt = read(text.as_bytes()).unwrap_err();
    assert!(doubt.problem.contains("may begin at column 1"), "{doubt}");

    // A clock that passes the size of the ranges is told from twenty lines, unless the ranges grow as evenly.
    let timed = |lines: usize, noise: f64| {
        let range = |scan: usize, beam: usize| {
            1.0 + 0.05 * scan as f64 + 0.3 * (0.1 * beam as f64).sin().abs() + noise * ((7 * scan + beam) % 5) as f64
        };
        let row = |scan: usize| {
            let ranges = (0..181).map(|beam| format!("{:.3}", range(scan, beam))).collect();
            joined([vec![format!("{:.1}", 0.1 * scan as f64)], ranges].concat(), ",")
        };
        read((0..lines).map(row).collect::<String>().as_bytes())
    };
    let log = timed(30, 0.004).unwrap();
    assert_eq!((log.scans[1].ranges.len(), log.scans[1].time, log.scans[0].ranges[0]), (181, Some(0.1), 1.0));
    for (lines, noise) in [(19, 0.004), (30, 0.0)] {
        assert!(timed(lines, noise).unwrap_err().problem.contains("may begin at column 1"));
    }
}

#[test]
fn a_reading_a_line_has_times_and_odometry() {
    let line = |scan: usize, beam: usize| {
        let dist = 100.0 * (2.0 + 0.01 * beam as f64);
        format!("{},{scan},{},{dist:.1},{},{},{}\n", 100 * scan, beam as f64 - 30.0, 25 * scan, 0, 10 * scan)
    };
    let lines = (0..5).flat_map(|scan| (0..61).map(move |beam| (scan, beam)));
    let head = "ms,scan_no,bearing_deg,dist_cm,odo_x,odo_y,odo_heading_deg\n".to_owned();
    let text = lines.fold(head, |text, (scan, beam)| text + &line(scan, beam));
    let format = TableFormat::guess(text.as_bytes()).unwrap().format.to_string();
    assert_eq!(format, "range=4,angle=3:1deg,unit=cm,start=0deg,time=1:ms,poses=5:6:7:deg");
    let log = read(text.as_bytes()).unwrap();
    assert_eq!(log.scans.len(), 5);
    assert!(log.notes[1].contains("give angle=3:-1deg"), "{:?}", log.notes);
    let LaserScan { time, odometry, .. } = &log.scans[4];
    let pose = odometry.unwrap();
    assert!((time.unwrap() - 0.4).abs() < 1e-12 && (pose.translation.x - 1.0).abs() < 1e-12);
    assert!((pose.rotation.angle() - 40f64.to_radians()).abs() < 1e-12);
}

#[test]
fn which_way_a_laser_turns_is_open_where_nothing_tells() {
    let table = |head: &str, first: i32, step: i32| {
        let line = |beam: i32| format!("{},{}\n", first + step * (beam % 180), 2000 + beam);
        (0..360).fold(head.to_owned(), |text, beam| text + &line(beam))
    };
    let is_open = |text: &str| read(text.as_bytes()).unwrap().may_be_mirrored;
    assert!(is_open(&table("angle,distance\n", 0, 2)));
    assert!(is_open(&table("# table: range=2,angle=1:deg\n# direction: unknown\nangle,range\n", 0, 2)));
    // Told: by the format, by what wrote it, by angles of both signs; and half a turn is that of a sensor on a servo.
    assert!(!is_open(&table("# table: range=2,angle=1:deg\nangle,range\n", 0, 2)));
    assert!(!read_given(table("angle,distance\n", 0, 2).as_bytes(), "angle=1:deg").unwrap().may_be_mirrored);
    assert!(!is_open(&table("theta,dist,q\n", 0, 2)));
    assert!(!is_open(&table("angle,distance\n", -180, 2)));
    assert!(!is_open(&table("angle,distance\n", 0, 1)));
    // A full turn a line from ahead on, whose columns nothing names.
    let turns = |head: &str| {
        let reading = |beam: usize| format!("{:.3}", 3.0 + (beam as f64).to_radians().sin());
        let line = (0..360).map(reading).collect::<Vec<_>>().join(",") + "\n";
        head.to_owned() + &line.repeat(3)
    };
    let named = |word: &str| (0..360).map(|beam| format!("{word}{beam}")).collect::<Vec<_>>().join(",") + "\n";
    for open in ["", &named("d"), &named("range_")] {
        assert!(is_open(&turns(open)), "{open:.20}");
    }
    assert!(!is_open(&turns(&named("ranges_"))));
    let scan = |word: &str| format!("{{\"readings\":[1,2,3],\"theta\":[0,2,4]{word}}}\n");
    assert!(is_open(&[scan(""), scan(",\"may_be_mirrored\":true")].concat()) && !is_open(&scan("")));
}

#[test]
fn what_stands_before_the_ranges_is_none_of_them() {
    let ranges = |scan: usize, count: usize| {
        let range = |beam: usize| format!("{:.3}", 3.0 + 0.01 * beam as f64 + 0.02 * scan as f64);
        (0..count).map(range).collect::<Vec<_>>().join(",")
    };
    let table = |before: &dyn Fn(usize) -> String, count: usize| {
        (0..6).fold(String::new(), |text, scan| text + &format!("{},{}\n", before(scan), ranges(scan, count)))
    };
    let guess = |text: &str| TableFormat::guess(text.as_bytes()).unwrap();
    let time = |scan: usize| 1_227_796_083.0 + 0.013 * scan as f64;
    // A count, and the angle of the first reading, or of the first and the last.
    let counted = guess(&table(&|scan| format!("{:.3},181,-1.570796", time(scan)), 181));
    assert_eq!(counted.format.to_string(), "ranges=4:184,unit=m,start=-90deg,step=1deg,time=1:s");
    let spanned = guess(&table(&|scan| format!("{:.3},181,-45,135", time(scan)), 181));
    assert_eq!(spanned.format.to_string(), "ranges=5:185,unit=m,start=-45deg,step=1deg,time=1:s");
    assert!(counted.doubt.is_none() && spanned.doubt.is_none());
    // A pose and a speed before 1,080 readings, which could be 1,081: asked about.
    let moving = guess(&table(&|scan| format!("0.{scan},0.0,-0.1,1.{scan}"), 1080));
    assert!(moving.format.to_string().starts_with("ranges=5:1084,unit=m,start=-135deg,step=0.25deg"));
    assert!(
        moving.doubt.unwrap().contains("The 1080 ranges may begin at column 5, as is assumed, or one column before")
    );
}

#[test]
fn a_sensor_that_sweeps_to_and_fro_makes_a_scan_of_each_sweep() {
    let beams = |sweep: usize| (0..=120).map(move |beam| if sweep.is_multiple_of(2) { beam } else { 120 - beam });
    let line = |sweep: usize, beam: usize| format!("Angle: {} Distance: {} cm\n", 30 + beam, 100 + beam + sweep);
    let text: String = (0..5).flat_map(|sweep| beams(sweep).map(move |beam| line(sweep, beam))).collect();
    let log = read(text.as_bytes()).unwrap();
    assert_eq!(log.scans.iter().map(|scan| scan.ranges.len()).collect::<Vec<_>>(), [121; 5]);
    for (sweep, scan) in log.scans.iter().enumerate() {
        for (at, beam) in beams(sweep).enumerate() {
            assert!((scan.bearings.of(at) - (30.0 + beam as f64).to_radians()).abs() < 1e-9);
            assert!((f64::from(scan.ranges[at]) - 0.01 * (100 + beam + sweep) as f64).abs() < 1e-6);
        }
    }
    // A laser that turns on and jitters a little is none of it.
    let jitter = |at: usize| 3.0 * (at % 90) as f64 + if at.is_multiple_of(7) { -3.5 } else { 0.0 };
    let turning = (0..270).fold(String::new(), |text, at| text + &format!("{} {}\n", jitter(at), 1500 + at));
    let scans = read_given(turning.as_bytes(), "range=2,angle=1:deg,unit=mm").unwrap().scans;
    assert_eq!(scans.iter().map(|scan| scan.ranges.len()).collect::<Vec<_>>(), [90; 3]);
}

#[test]
fn the_bearing_is_the_angle_that_changes_with_every_reading() {
    for (head, expected) in [
        ("t,x,y,theta,angle_deg,range_m", "range=6,angle=5:1deg,unit=m,start=0deg,time=1:s,poses=2:3:4"),
        (
            "stop,x_cm,y_cm,heading_deg,sensor_deg,distance_cm",
            "range=6,angle=5:1deg,unit=cm,start=0deg,poses=2:3:4:cm:deg",
        ),
        ("t,x,y,theta,servo,distance (in)", "range=6,angle=5:1deg,unit=in,start=0deg,time=1:s,poses=2:3:4:m"),
    ] {
        let line = |scan: usize, beam: usize| format!("{scan},0.{scan},1,0.0{scan},{},{}.5\n", 2 * beam, 3 + scan);
        let lines = (0..4).flat_map(|scan| (0..90).map(move |beam| (scan, beam)));
        let text = lines.fold(format!("{head}\n"), |text, (scan, beam)| text + &line(scan, beam));
        assert!(is_laser_log(text.as_bytes()), "{head}");
        assert_eq!(TableFormat::guess(text.as_bytes()).unwrap().format.to_string(), expected);
        assert_eq!(read(text.as_bytes()).unwrap().scans.len(), 4, "{head}");
    }
}

#[test]
fn positions_in_different_units_are_not_used_and_a_growing_x_is_no_time() {
    let beams: Vec<String> = (-45..=45).map(|degrees| format!("{degrees} deg (mm)")).collect();
    let table = |y: &str| {
        let row = |scan: usize| format!("0.{scan},{},{},{}\n", 3 * scan, 2 * scan, vec!["1500"; 91].join(","));
        format!("x (m),y ({y}),heading_deg,{}\n{}{}{}{}", beams.join(","), row(1), row(2), row(3), row(4))
    };
    let format = |y: &str| TableFormat::guess(table(y).as_bytes()).unwrap().format.to_string();
    assert_eq!(format("m"), "ranges=4:94,unit=mm,start=-45deg,step=1deg,poses=1:2:3:m:deg");
    assert_eq!(format("cm"), "ranges=4:94,unit=mm,start=-45deg,step=1deg");
    assert_eq!(read(table("m").as_bytes()).unwrap().losses, Vec::<String>::new());
    let losses = read(table("cm").as_bytes()).unwrap().losses;
    assert!(losses[0].contains("different units (x (m), y (cm))"), "{losses:?}");
}

#[test]
fn names_may_stand_in_a_comment() {
    let readings = (0..360).fold(String::new(), |text, beam| text + &format!("{beam}.0000\t{}.00\t47\n", 1500 + beam));
    let grabbed = format!("#RPLIDAR SCAN DATA\n#COUNT=360\n#Angule\tDistance\tQuality\n{readings}");
    assert!(is_laser_log(grabbed.as_bytes()));
    let log = read(grabbed.as_bytes()).unwrap();
    assert_eq!((log.scans.len(), log.scans[0].ranges.len(), log.scans[0].ranges[10]), (1, 360, 1.51));
    assert!((log.scans[0].bearings.of(90) + std::f64::consts::FRAC_PI_2).abs() < 1e-9, "it turns clockwise");
    let row = |scan: usize| format!("0.{scan} 0.1 0.2 0.{scan} {}\n", "2.5 ".repeat(181));
    let names: Vec<String> = (0..181).map(|beam| format!("r{beam}")).collect();
    let saved = format!("# t x y theta {}\n{}{}{}", names.join(" "), row(1), row(2), row(3));
    assert_eq!(
        TableFormat::guess(saved.as_bytes()).unwrap().format.to_string(),
        "ranges=5:185,unit=m,start=-90deg,step=1deg,time=1:s,poses=2:3:4"
    );
}

#[test]
fn ranges_in_inches_and_feet_are_read_as_such() {
    for (unit, metres, told) in
        [("in", 0.0254, "in"), ("inches", 0.0254, "in"), ("ft", 0.3048, "ft"), ("feet", 0.3048, "ft")]
    {
        let names: Vec<String> = (-90..=90).map(|degrees| format!("{degrees} deg ({unit})")).collect();
        let row = |scan: usize| vec![format!("{}.5", 20 + scan); 181].join(",");
        let text = format!("{}\n{}\n{}\n", names.join(","), row(0), row(1));
        let format = TableFormat::guess(text.as_bytes()).unwrap().format;
        assert_eq!(format.to_string(), format!("ranges=1:181,unit={told},start=-90deg,step=1deg"));
        assert!((f64::from(read(text.as_bytes()).unwrap().scans[1].ranges[0]) - 21.5 * metres).abs() < 1e-6);
    }
}

#[test]
fn what_the_sdk_of_an_rplidar_prints_turns_clockwise() {
    let line = |beam: usize| format!("   theta: {:06.2} Dist: {:08.2} Q: 47 \n", beam as f64, 2000.0 + beam as f64);
    let text: String = (0..2).flat_map(|_| (0..360).map(line)).collect();
    let log = read(text.as_bytes()).unwrap();
    assert_eq!(log.scans.len(), 2);
    assert!(!log.notes.iter().any(|note| note.contains("counter-clockwise")), "{:?}", log.notes);
    assert!((log.scans[0].bearings.of(90) + std::f64::consts::FRAC_PI_2).abs() < 1e-9);
}

/// Scans as others write them: clocks, bars, lists in cells, names in other languages, numbers of beams.
#[test]
fn tables_of_other_habits_are_read() {
    let range = |scan: usize, beam: usize| 2.0 + (0.05 * beam as f64).sin().abs() + 0.01 * scan as f64;
    let table =
        |head: String, row: &dyn Fn(usize) -> String| (0..6).fold(head + "\n", |text, scan| text + &row(scan) + "\n");
    let list = |scan: usize, gap: &str| -> String {
        (0..181).map(|beam| format!("{:.4}", range(scan, beam))).collect::<Vec<_>>().join(gap)
    };
    let names = |stem: &str, gap: &str| (0..181).map(|beam| format!("{stem}{beam}")).collect::<Vec<_>>().join(gap);
    let readings = |head: &str, line: &dyn Fn(usize, usize) -> String| {
        let lines = (0..6).flat_map(|scan| (0..181).map(move |beam| (scan, beam)));
        lines.fold(head.to_owned() + "\n", |text, (scan, beam)| text + &line(scan, beam) + "\n")
    };
    let german = table(format!("Uhrzeit;Odo X [cm];Odo Y [cm];Gier [Grad];{}", names("Strahl ", ";")), &|scan| {
        let cells = [10.0 * scan as f64, 0.0, 5.0 * scan as f64].map(|value| format!("{value:.2}")).join(";");
        format!("14:03:1{scan}.500;{cells};{}", list(scan, ";")).replace('.', ",")
    });
    let spanish = table(format!("tiempo(ms)|pos_x(mm)|pos_y(mm)|ang(°)|{}", names("d", "|")), &|scan| {
        format!("{}|{}|0.5|{}|{}", 250 * scan, 100 * scan, 9 * scan, list(scan, "|"))
    });
    let pandas = table(",time,ranges,odom".to_owned(), &|scan| {
        format!("{scan},{:.2},\"[{}]\",\"({:.3}, 0.0, 0.1)\"", 0.25 * scan as f64, list(scan, ", "), 0.1 * scan as f64)
    });
    let beams = readings("scan;beam;range;x;y;theta", &|scan, beam| {
        format!("{scan};{beam};{:.4};{:.3};0;0.1", range(scan, beam), 0.1 * scan as f64)
    });
    let japanese = readings("時刻,角度,距離", &|scan, beam| {
        format!("2024-05-03T10:00:0{scan}.25,{},{:.3}", beam as f64 - 90.0, range(scan, beam))
    });
    let half = "start=-90deg,step=1deg";
    for (text, expected) in [
        (&german, format!("ranges=5:185,unit=m,{half},time=1:s,poses=2:3:4:cm:deg")),
        (&spanish, format!("ranges=5:185,unit=m,{half},time=1:ms,poses=2:3:4:mm:deg")),
        (&pandas, format!("ranges=3:183,unit=m,{half},time=2:s,poses=184:185:186")),
        (&beams, "range=3,angle=2:1deg,unit=m,start=-90deg,poses=4:5:6".to_owned()),
        (&japanese, "range=3,angle=2:1deg,unit=m,start=0deg,time=1:s".to_owned()),
    ] {
        assert!(is_laser_log(&text.as_bytes()[..text.len().min(8192)]), "{expected}");
        let guess = TableFormat::guess(text.as_bytes()).unwrap();
        assert_eq!((guess.format.to_string(), guess.doubt), (expected.clone(), None));
        let log = read(text.as_bytes()).unwrap();
        assert_eq!(log.scans.len(), 6, "{expected}");
        for (number, scan) in log.scans.iter().enumerate() {
            let wanted: f64 = (0..181).map(|beam| range(number, beam)).sum();
            assert!((sum(scan) - wanted).abs() < 0.1 && scan.ranges.len() == 181, "{expected}");
        }
    }
    assert_eq!(read(german.as_bytes()).unwrap().scans[2].time, Some(50_592.5));
    assert_eq!(read(japanese.as_bytes()).unwrap().scans[2].time, Some(1_714_730_402.25));
    let pose = read(spanish.as_bytes()).unwrap().scans[5].odometry.unwrap();
    assert!((pose.translation.x - 0.5).abs() < 1e-12 && (pose.rotation.angle() - 45f64.to_radians()).abs() < 1e-12);
}
