//! Where the robot thought it was, in each line of a table.

use super::{LaserScan, OdometryColumns, Row, TableFormat};
use crate::geometry::Pose2;

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
