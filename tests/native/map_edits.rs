//! Steps that edit the grid of a map, turn it and leave scans out, on an office whose walls run along the axes of its truth.

use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::io::laser_log;
use scanstitch::map::occupancy_grid::{Cell, OccupancyGrid};
use scanstitch::pipeline::planar::{Edit, Reconstruction};
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
