//! Where the robot thought it was, in each line of a table.

use super::names::MIN_SCAN_NUMBERS;
use super::other_columns::OtherColumns;
use super::rows::Table;
use super::{LaserScan, OdometryColumns, Row, TableFormat};
use crate::geometry::{Embedding, Pose2};
use crate::io::trajectory::Trajectory;
use crate::{Error, Result};

/// The robot's path of a table that has the paths of its two wheels in named columns (`s_left`, `right wheel`), with `track` metres
/// between them; `None` where it is no such table.
pub fn read_wheel_paths(bytes: &[u8], track: f64) -> Option<Result<Trajectory>> {
    let table = Table::read(bytes, usize::MAX);
    let named = |word: &str| {
        let is_named = |name: &String| name.split(|c: char| !c.is_alphabetic()).any(|part| part == word);
        table.names.iter().position(is_named)
    };
    let columns = [named("left")?, named("right")?];
    if table.names.len() >= MIN_SCAN_NUMBERS || table.width() <= columns[0].max(columns[1]) {
        return None;
    }
    if track <= 0.0 {
        let problem = "The paths of the two wheels are no poses without the distance between them";
        return Some(Err(Error::whole(problem, "Set wheel_track to it (m), for example wheel_track=0.3")));
    }
    let time =
        OtherColumns::of(&table, &table.rows, (0..table.width()).filter(|column| !columns.contains(column))).time();
    let mut path = WheelPath::default();
    let mut trajectory = Trajectory::default();
    let (mut poses, mut stamps) = (Vec::new(), Vec::new());
    for row in &table.rows {
        let Some(pose) = path.advance(row, columns, 1.0, track) else { continue };
        poses.push(pose.in_space());
        stamps.extend(time.and_then(|(column, seconds)| Some(seconds * row.values.get(column)?)));
    }
    if !poses.is_empty() {
        trajectory = Trajectory::from_poses(&poses);
        trajectory.stamps = (stamps.len() == poses.len()).then_some(stamps);
    }
    Some(Ok(trajectory))
}

impl TableFormat {
    /// Gives each scan the odometry of its row.
    pub(super) fn add_poses(&self, scans: &mut [LaserScan], rows: &[&Row]) {
        let mut way = WheelPath::default();
        for (scan, row) in scans.iter_mut().zip(rows) {
            scan.odometry = match self.odometry {
                None => None,
                Some(OdometryColumns::Pose(columns)) => self.pose_of(row, columns),
                Some(OdometryColumns::Wheels { columns, metres_per_tick, track }) => {
                    way.advance(row, columns, metres_per_tick, track)
                }
            };
        }
    }
}

/// The way that two wheels have made.
#[derive(Default)]
struct WheelPath {
    T_world_robot: Pose2,
    /// Ticks of the left and the right wheel.
    before: Option<[f64; 2]>,
}

impl WheelPath {
    /// Where the robot is now; `None` where a wheel tells nothing.
    fn advance(&mut self, row: &Row, columns: [usize; 2], metres_per_tick: f64, track: f64) -> Option<Pose2> {
        let value = |column: usize| row.values.get(column).copied().filter(|value| value.is_finite());
        let now = [value(columns[0])?, value(columns[1])?];
        let [dl, dr] = self.before.replace(now).map_or([0.0; 2], |before| [now[0] - before[0], now[1] - before[1]]);
        let (way, turn) = (0.5 * metres_per_tick * (dl + dr), metres_per_tick * (dr - dl) / track);
        // On an arc, the chord leads half of the turn aside.
        let chord = nalgebra::Vector2::new(way * (0.5 * turn).cos(), way * (0.5 * turn).sin());
        self.T_world_robot *= Pose2::new(chord, turn);
        Some(self.T_world_robot)
    }
}
