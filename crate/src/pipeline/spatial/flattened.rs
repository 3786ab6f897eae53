//! The map of a run as a grid: what stands in a band of heights over its floor.

use nalgebra::{Matrix3, Vector3};

use super::SpatialReconstruction;
use crate::error::{Error, Result};
use crate::geometry::{Pose3, RigidMotion};
use crate::map::occupancy_grid::OccupancyGrid;

/// A level floor, in the world of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// Away from it.
    pub up: Vector3<f64>,
    /// Its height along `up` over the world's origin (m).
    pub height: f64,
}

impl Floor {
    /// The frame of its grids: z = 0 on the floor under the first sensor, x where that looks (along its z axis, or its x axis where z
    /// points up).
    ///
    /// # Errors
    /// When `up` is no direction or the height no number.
    pub fn T_floor_world(&self) -> Result<Pose3> {
        let up = self.up.try_normalize(0.0).filter(|up| up.iter().all(|value| value.is_finite()));
        let Some(up) = up.filter(|_| self.height.is_finite()) else {
            return Err(Error::whole("The floor has no direction upwards or no height", "Give finite numbers"));
        };
        let ahead = if up.z.abs() < up.x.abs().max(up.y.abs()) { Vector3::z() } else { Vector3::x() };
        let x = (ahead - up * up.dot(&ahead)).normalize();
        let R_world_floor = Matrix3::from_columns(&[x, up.cross(&x), up]);
        Ok(RigidMotion::from_parts(&R_world_floor.transpose(), &Vector3::new(0.0, 0.0, -self.height)))
    }
}

impl SpatialReconstruction {
    /// The map flattened to a grid by the frames whose pose is good, in the [frame](Floor::T_floor_world) of this floor: see
    /// [`OccupancyGrid::flattened`]. `band`: lowest and highest height over the floor (m). Its remark says how it lies in the
    /// coordinates of the trajectory.
    ///
    /// # Errors
    /// When the band does not begin over the floor or is empty, the resolution is not positive, or no frame has a good pose.
    pub fn flattened_grid(&self, floor: &Floor, band: [f64; 2], resolution: f64) -> Result<OccupancyGrid> {
        let T_floor_world = floor.T_floor_world()?;
        let [low, high] = band;
        if !(low > 0.0 && high > low && high.is_finite()) {
            let problem = format!("The band from {low} to {high} m is none over the floor");
            return Err(Error::whole(problem, "Give two heights over 0 m, the lower one first, such as 0.2 and 1.8"));
        }
        if !(resolution > 0.0 && resolution.is_finite()) {
            return Err(Error::whole(format!("Cells of {resolution} m are none"), "Give a side of more than 0 m"));
        }
        let frames = self.placed_clouds().map(|(cloud, pose)| (cloud, T_floor_world * pose));
        let mut grid = OccupancyGrid::flattened(frames, band, resolution);
        if grid.width == 0 {
            return Err(Error::whole(
                "No frame has a good pose, so there is no map",
                "Look at the notes of the frames",
            ));
        }
        grid.remark = self.remark(&T_floor_world, band);
        Ok(grid)
    }

    fn remark(&self, T_floor_world: &Pose3, [low, high]: [f64; 2]) -> String {
        let origin = self.origin();
        let T = T_floor_world * Pose3::translation(-origin.x, -origin.y, -origin.z);
        let rows = T.to_homogeneous();
        let row = |row: usize| rows.row(row).iter().map(|value| format!("{value:.6}")).collect::<Vec<_>>().join(", ");
        format!(
            "Flattened from {low} to {high} m over the floor. x, y and the height over the floor are [{}], [{}] and [{}] times (x, y, z, 1) of the trajectory.",
            row(0),
            row(1),
            row(2)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_floor_lies_under_the_first_sensor_with_x_ahead() {
        // A camera 1.2 m over the floor looks ahead along z with y down; a laser 0.5 m over it has z upwards.
        for (up, height, ahead) in [(-Vector3::y(), -1.2, Vector3::z()), (Vector3::z(), -0.5, Vector3::x())] {
            let T = Floor { up, height }.T_floor_world().unwrap();
            assert!((T.act(&ahead) - Vector3::new(1.0, 0.0, -height)).norm() < 1e-12);
            assert!((T.act(&(up * height)) - Vector3::zeros()).norm() < 1e-12);
        }
        assert!(Floor { up: Vector3::zeros(), height: 0.0 }.T_floor_world().is_err());
    }
}
