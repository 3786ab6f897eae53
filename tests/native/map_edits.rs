//! Steps that edit the grid of a map, turn it and leave scans out, on an office whose walls run along the axes of its truth.

use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::io::laser_log;
use scanstitch::map::occupancy_grid::{Cell, OccupancyGrid};
use scanstitch::pipeline::planar::{Edit, KnownPlace, PlanPoint, Reconstruction};
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::settings::Settings;
use scanstitch_scene::drive::{Drive, DriveOptions};
use scanstitch_scene::office::{OfficeOptions, generate};
use scanstitch_scene::world::Obstacle;

const ROTATE: Edit = Edit::Rotate { angle: None };

/// A map, and the angle of the building's longest wall in it.
fn office() -> (Reconstruction, f64) {
    let recording = generate(&OfficeOptions { seed: 41, num_scans: 40, ..OfficeOptions::default() });
    let drive = Drive::new(&recording, &DriveOptions { seed: 41, step: 0.5, ..DriveOptions::default() });
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log("drive.log", &laser_log::read(drive.carmen().as_bytes()).unwrap());
    while reconstruction.step().stage != Stage::Done {}
    let walls = recording.world.obstacles.iter().filter_map(|obstacle| match obstacle {
        Obstacle::Wall { from, to } => Some(to - from),
        Obstacle::Pillar { .. } => None,
    });
    // The world is the first pose of the laser, which looks along y; that of the map looks along x, a right angle from it.
    let longest = walls.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap();
    (reconstruction, longest.y.atan2(longest.x))
}

fn edited(reconstruction: &mut Reconstruction, edits: &[Edit]) {
    assert_eq!(reconstruction.set_edits(edits).unwrap(), []);
    while reconstruction.step().stage != Stage::Done {}
}

fn at(grid: &OccupancyGrid, x: f64, y: f64) -> Cell {
    let [x, y] = [x - grid.origin.x, y - grid.origin.y].map(|along| (along / grid.resolution) as usize);
    grid.cell(x, y)
}

#[test]
fn shapes_are_painted_over_what_beams_say_and_undone_without_a_trace() {
    let (mut office, _) = office();
    let (before, report) = (office.occupancy_grid(0.05), office.result());
    assert_eq!(at(&before, 0.0, 0.0), Cell::Free);
    let line = Edit::PaintLine { cells: Cell::Occupied, ends: [[-0.5, 0.0], [0.5, 0.0]], width: 0.1 };
    let hole = Edit::PaintRectangle { cells: Cell::Unknown, corners: [[-0.1, -0.2], [0.1, 0.2]] };
    let crop = Edit::Crop { corners: [[-1.0, -1.0], [1.0, 1.0]] };
    edited(&mut office, &[line.clone(), hole, crop]);
    let grid = office.occupancy_grid(0.05);
    assert_eq!([at(&grid, 0.3, 0.0), at(&grid, 0.0, 0.0)], [Cell::Occupied, Cell::Unknown]);
    assert!(grid.width <= 40 && grid.height <= 40 && before.width > 100);
    assert!(
        office.result().notes.contains(&"The map was mended by hand: shapes painted 2; grid cropped 1.".to_owned())
    );
    edited(&mut office, std::slice::from_ref(&line));
    assert_eq!(at(&office.occupancy_grid(0.05), 0.0, 0.0), Cell::Occupied);
    edited(&mut office, &[]);
    assert!(office.occupancy_grid(0.05) == before && office.result() == report);
}

#[test]
fn a_turn_to_the_walls_turns_poses_points_and_grid_together_and_what_was_painted_with_them() {
    let (mut office, truth) = office();
    let (poses, points) = (office.poses(), office.map().points);
    let grid = office.occupancy_grid(0.05);
    let line = Edit::PaintLine { cells: Cell::Occupied, ends: [[0.0, 0.0], [0.4, 0.0]], width: 0.1 };
    edited(&mut office, &[Edit::Rotate { angle: Some(0.4) }, line, ROTATE]);
    let turned = office.poses();
    let turn = turned[0].rotation.angle() - poses[0].rotation.angle();
    let off = (turn + truth).rem_euclid(std::f64::consts::FRAC_PI_2);
    let off = off.min(std::f64::consts::FRAC_PI_2 - off).to_degrees();
    assert!(off < 0.3, "{off} degrees from the walls");
    let T = Pose2::new(nalgebra::Vector2::zeros(), turn);
    for (before, after) in poses.iter().zip(&turned) {
        let off = ((T * *before).inverse() * *after).log().norm();
        assert!(off < 1e-9, "{off}");
    }
    for (before, after) in points.iter().zip(&office.map().points).step_by(97) {
        let moved = T.act(&nalgebra::Vector2::new(f64::from(before[0]), f64::from(before[1])));
        assert!((moved.x - f64::from(after[0])).hypot(moved.y - f64::from(after[1])) < 1e-4);
    }
    let turned = office.occupancy_grid(0.05);
    assert_eq!(turned.yaw, 0.0, "readers that leave the yaw out read it right");
    assert!(turned.width * turned.height < grid.width * grid.height * 11 / 10);
    let along = nalgebra::UnitComplex::new(turn - 0.4) * nalgebra::Vector2::new(0.3, 0.0);
    assert_eq!(at(&turned, along.x, along.y), Cell::Occupied);
    let errors = |office: &Reconstruction| office.result().comparison.map(|compared| compared.mean);
    let with_turn = errors(&office);
    edited(&mut office, &[]);
    assert_eq!(office.poses(), poses);
    let difference = with_turn.zip(errors(&office)).map_or(0.0, |(a, b)| (a - b).abs());
    assert!(difference < 1e-9, "a turn changes no error: {difference}");
}

/// Places of the map that lie in the world where this motion takes them, off by these distances along x (m).
fn known<const N: usize>(T_world_map: &Pose2, off: [f64; N]) -> Vec<KnownPlace> {
    let corners = [[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]];
    let place = |(map, off): (&[f64; 2], f64)| {
        let world = T_world_map.act(&(*map).into());
        KnownPlace { map: *map, world: [world.x + off, world.y] }
    };
    corners.iter().zip(off).map(place).collect()
}

#[test]
fn an_anchor_lays_poses_points_graph_and_grid_on_known_places_and_is_undone_without_a_trace() {
    let (mut office, _) = office();
    let (poses, points, report) = (office.poses(), office.map().points, office.result());
    let T = Pose2::new(nalgebra::Vector2::new(420.0, -37.5), 2.0);
    let line = Edit::PaintLine { cells: Cell::Occupied, ends: [[0.0, 0.0], [0.4, 0.0]], width: 0.1 };
    // Pairs are places of the map as the step before has turned it.
    let anchor = |off| Edit::Anchor { pairs: known(&T, off), accuracy: None };
    edited(&mut office, &[Edit::Rotate { angle: Some(0.4) }, line, anchor([0.0; 4])]);
    let T_world_run = T * Pose2::rotation(0.4);
    for (before, after) in poses.iter().zip(&office.poses()) {
        let off = ((T_world_run * *before).inverse() * *after).log().norm();
        assert!(off < 1e-9, "{off}");
    }
    for (before, after) in points.iter().zip(&office.map().points).step_by(97) {
        let moved = T_world_run.act(&nalgebra::Vector2::new(f64::from(before[0]), f64::from(before[1])));
        assert!((moved.x - f64::from(after[0])).hypot(moved.y - f64::from(after[1])) < 1e-4);
    }
    let grid = office.occupancy_grid(0.05);
    let painted = T.act(&nalgebra::Vector2::new(0.3, 0.0));
    assert_eq!((grid.yaw, at(&grid, painted.x, painted.y)), (0.0, Cell::Occupied));
    let later = office.poses()[20].translation;
    assert_eq!(at(&grid, later.x, later.y), Cell::Free);
    let note = "The map was mended by hand: shapes painted 1; turned by 137.51°; anchored to known places, off by 0.000, 0.000, 0.000, \
                0.000 m (0.000 m rms).";
    let anchored = office.result();
    assert!(anchored.notes.contains(&note.to_owned()), "{:?}", anchored.notes);
    for (before, after) in report.frames.iter().zip(&anchored.frames) {
        let trace = |std: Option<scanstitch::pipeline::report::PlanarPose>| std.map(|std| std.x.hypot(std.y));
        let pair = trace(before.std).zip(trace(after.std));
        assert!(pair.is_none_or(|(before, after)| (before - after).abs() < 1e-9 * before), "a shift is no uncertainty");
    }
    // Errors of the places are averaged: 0.04 m at one of four.
    edited(&mut office, &[anchor([0.0, 0.04, 0.0, 0.0])]);
    let note = office.result().notes.iter().find(|note| note.contains("anchored")).cloned().unwrap();
    assert!(note.contains("off by 0.01") && note.contains("rms"), "{note}");
    edited(&mut office, &[]);
    assert!(office.poses() == poses && office.result() == report);
}

#[test]
fn pairs_that_coincide_or_contradict_each_other_are_refused_with_the_figure() {
    let (mut office, _) = office();
    let T = Pose2::new(nalgebra::Vector2::new(10.0, 20.0), 1.0);
    let place = KnownPlace { map: [1.0, 2.0], world: [3.0, 4.0] };
    let far = KnownPlace { map: [0.0, 0.0], world: [0.0, 4.5e6] };
    let scaled: Vec<KnownPlace> = known(&Pose2::identity(), [0.0; 2])
        .iter()
        .map(|p| KnownPlace { world: p.world.map(|x| 1.1 * x), ..*p })
        .collect();
    for (pairs, accuracy, expected) in [
        (vec![place], None, "Step 1: the anchor has 1 pair"),
        (vec![place, place], None, "Step 1: the pairs are all at one place"),
        (vec![place, KnownPlace { world: [9.0, 9.0], ..place }], None, "Step 1: the pairs are all at one place"),
        (vec![place, far], None, "Step 1: the world's coordinate 4500000 m is further than 105 km from its origin"),
        (vec![place, KnownPlace { map: [f64::NAN, 0.0], ..place }], None, "Step 1: \"pairs\" has the number NaN"),
        (known(&T, [0.0; 3]), Some(0.0), "Step 1: the accuracy is 0 m"),
        (scaled.clone(), None, "the places lie 10.0 % further apart in the world than in the map"),
        (
            known(&T, [0.0, 1.0, 0.0, 0.0]),
            None,
            "Step 1: the pairs do not fit each other to 0.05 m: pair 2 is off by 0.",
        ),
    ] {
        let edits = [Edit::Anchor { pairs, accuracy }];
        let error = office.set_edits(&edits).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    edited(&mut office, &[Edit::Anchor { pairs: scaled, accuracy: Some(0.2) }]);
}

/// A plan of 2 cm a pixel whose picture is turned by `turn`, with its upper left corner at `corner`: four of its points.
fn on_plan(corner: [f64; 2], turn: f64) -> Vec<PlanPoint> {
    let T = Pose2::new(nalgebra::Vector2::from(corner), turn);
    let point = |picture: [f64; 2]| {
        let at = T.act(&nalgebra::Vector2::new(0.02 * picture[0], -0.02 * picture[1]));
        PlanPoint { picture, map: at.into() }
    };
    [[100.0, 40.0], [900.0, 60.0], [880.0, 700.0], [150.0, 650.0]].map(point).to_vec()
}

fn lay(points: Vec<PlanPoint>, accuracy: Option<f64>) -> Edit {
    Edit::LayPlan { picture: "plan.png".to_owned(), points, accuracy }
}

#[test]
fn a_plan_lies_where_its_points_fit_best_is_moved_with_the_map_and_taken_off_and_changes_nothing_else() {
    let (mut office, _) = office();
    let (report, grid) = (office.result(), office.occupancy_grid(0.05));
    edited(&mut office, &[lay(on_plan([-3.0, 9.0], 0.3), None)]);
    let placed = office.plan().cloned().unwrap();
    assert!((placed.pixel - 0.02).abs() < 1e-12 && (placed.turn - 0.3).abs() < 1e-12, "{placed:?}");
    assert!((placed.corner[0] + 3.0).hypot(placed.corner[1] - 9.0) < 1e-9 && placed.contradiction.is_none());
    assert!(placed.residuals.len() == 4 && placed.residuals.iter().all(|&residual| residual < 1e-9), "{placed:?}");
    let laid = office.result();
    assert!(laid.frames == report.frames && office.occupancy_grid(0.05) == grid);
    let note = "The map was mended by hand: building plan plan.png of 0.0200 m a pixel laid, off by 0.000, 0.000, 0.000, 0.000 m.";
    assert!(laid.notes.contains(&note.to_owned()), "{:?}", laid.notes);
    // A map that is turned afterwards takes it along; another plan takes its place.
    edited(&mut office, &[lay(on_plan([-3.0, 9.0], 0.3), None), Edit::Rotate { angle: Some(0.5) }]);
    let turned = office.plan().cloned().unwrap();
    let corner = Pose2::rotation(0.5).act(&nalgebra::Vector2::new(-3.0, 9.0));
    assert!((turned.corner[0] - corner.x).hypot(turned.corner[1] - corner.y) < 1e-9, "{turned:?}");
    assert!((turned.turn - 0.8).abs() < 1e-12);
    let point = Pose2::rotation(0.5).act(&placed.points[2].map.into());
    assert!((turned.points[2].map[0] - point.x).hypot(turned.points[2].map[1] - point.y) < 1e-9);
    edited(&mut office, &[lay(on_plan([5.0, 5.0], 0.0), None), lay(on_plan([-3.0, 9.0], 0.3), None)]);
    assert_eq!(office.plan(), Some(&placed));
    edited(&mut office, &[lay(on_plan([-3.0, 9.0], 0.3), None), Edit::RemovePlan]);
    assert_eq!((office.plan(), office.result()), (None, report));
}

#[test]
fn points_of_a_plan_that_contradict_each_other_are_told_with_the_residual_of_each() {
    let mut points = on_plan([0.0, 0.0], 1.0);
    points[1].map[0] += 1.5;
    let placed = Reconstruction::preview_plan(&lay(points.clone(), None)).unwrap().unwrap();
    let told = placed.contradiction.unwrap();
    assert!(told.contains("point 2 is off by 0.75 m") && placed.residuals.len() == 4, "{told} {:?}", placed.residuals);
    assert_eq!(Reconstruction::preview_plan(&lay(points.clone(), Some(1.0))).unwrap().unwrap().contradiction, None);
    assert_eq!(Reconstruction::preview_plan(&Edit::RemovePlan).unwrap(), None);
    // The report says so as well; the plan is laid all the same, for a building is not always as it was drawn.
    let (mut office, _) = office();
    edited(&mut office, &[lay(points.clone(), None)]);
    let notes = office.result().notes;
    assert!(notes.iter().any(|note| note.contains("its points do not fit each other")), "{notes:?}");
    let same = PlanPoint { picture: [1.0, 1.0], map: [0.0, 0.0] };
    for (points, accuracy, expected) in [
        (points[..2].to_vec(), None, "Step 1: the plan has 2 points"),
        (vec![same; 3], None, "Step 1: the points are all at one place"),
        (vec![PlanPoint { picture: [f64::NAN, 0.0], ..same }; 3], None, "Step 1: \"points\" has the number NaN"),
        (points.clone(), Some(-1.0), "Step 1: the accuracy is -1 m"),
        (
            points.iter().map(|p| PlanPoint { map: [4.5e6, 0.0], ..*p }).collect(),
            None,
            "Step 1: the map's coordinate 4500000 m",
        ),
    ] {
        let error = office.set_edits(&[lay(points, accuracy)]).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn the_scans_that_saw_a_place_are_those_whose_beams_ended_there_or_passed() {
    let (mut office, _) = office();
    let seen = |office: &Reconstruction, x: f64, y: f64| office.scans_at([x, y], 0.05);
    // A return of a scan in the middle of the drive: that scan's beams end there; and nobody saw a place outside.
    let sizes = office.map_sizes_from(0);
    let first: u32 = sizes[..20].iter().sum();
    let [x, y] = office.map_points_from(0)[first as usize + 40].map(f64::from);
    let at_wall = seen(&office, x, y);
    assert!(at_wall.iter().any(|at| at.scan == 20 && at.num_ended > 0), "{at_wall:?}");
    assert!(at_wall.is_sorted_by(|a, b| a.scan < b.scan));
    assert_eq!(seen(&office, 500.0, 0.0), []);
    // Halfway to the return the beams of that scan pass, from where its laser was.
    let laser = office.poses()[20].translation;
    let halfway = seen(&office, f64::midpoint(x, laser.x), f64::midpoint(y, laser.y));
    let of_scan = halfway.iter().find(|at| at.scan == 20).unwrap();
    assert!(of_scan.num_passed > 0 && (of_scan.laser[0] - laser.x).abs() < 1e-12, "{of_scan:?}");
    // Scans that are left out are told no more, and a turn of the map takes the place with it.
    edited(&mut office, &[Edit::LeaveOut { first: 20, last: 20 }]);
    assert!(seen(&office, x, y).iter().all(|at| at.scan != 20));
    edited(&mut office, &[Edit::Rotate { angle: Some(std::f64::consts::FRAC_PI_2) }]);
    let turned = seen(&office, -y, x);
    assert!(turned.iter().any(|at| at.scan == 20 && at.num_ended > 0), "{turned:?}");
}

#[test]
fn scans_that_are_left_out_are_in_no_map_and_keep_their_poses() {
    let (mut office, _) = office();
    let (poses, sizes) = (office.poses(), office.map_sizes_from(0));
    edited(&mut office, &[Edit::LeaveOut { first: 10, last: 19 }]);
    let left = office.map_sizes_from(0);
    assert!(left[10..20].iter().all(|&size| size == 0));
    assert_eq!((&left[..10], &left[20..]), (&sizes[..10], &sizes[20..]));
    assert_eq!(office.map_points_from(0).len(), left.iter().sum::<u32>() as usize);
    assert_eq!(office.poses(), poses);
}

#[test]
fn wrong_steps_are_named_with_what_is_wrong_and_change_nothing() {
    let (mut office, _) = office();
    let report = office.result();
    let num_scans = office.num_scans();
    let line = |ends, width| Edit::PaintLine { cells: Cell::Free, ends, width };
    let crop = |corners| Edit::Crop { corners };
    for (edit, expected) in [
        (line([[0.0, f64::NAN], [1.0, 1.0]], 0.1), "Step 2: \"ends\" has the number NaN"),
        (line([[0.0, 0.0], [1.0, 1.0]], f64::INFINITY), "Step 2: \"width\" has the number inf"),
        (line([[1.0, 2.0], [1.0, 2.0]], 0.1), "Step 2: the line has no length: it begins and ends at (1, 2)"),
        (line([[0.0, 0.0], [1.0, 0.0]], -1.0), "Step 2: the line is -1 m wide"),
        (crop([[3.0, 0.0], [3.0, 5.0]]), "Step 2: the rectangle has no size: both corners have x = 3"),
        (
            Edit::PaintPolygon { cells: Cell::Free, corners: vec![[0.0, 0.0], [1.0, 1.0]] },
            "Step 2: the polygon has 2 corners",
        ),
        (
            Edit::PaintPolygon { cells: Cell::Free, corners: vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]] },
            "Step 2: the polygon has no size: its corners lie on one line",
        ),
        (Edit::Rotate { angle: Some(f64::NAN) }, "Step 2: \"angle\" has the number NaN"),
        (Edit::LeaveOut { first: 5, last: 3 }, "Step 2: the first scan, 5, comes after the last, 3"),
        (Edit::LeaveOut { first: 5, last: num_scans }, "Step 2 names scan "),
        (Edit::LeaveOut { first: 0, last: num_scans - 1 }, "The steps leave no scan in the map"),
    ] {
        let error = office.set_edits(&[ROTATE, edit]).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
        assert!(office.result() == report);
    }
    edited(&mut office, &[crop([[500.0, 500.0], [501.0, 501.0]])]);
    let unused = office.unused_edits();
    assert!(unused.len() == 1 && unused[0].reason.starts_with("no cell of the map lies in it: the map reaches from ("));
}
