//! Poses, points and grid of a run, as the steps that mend its map have them.

use nalgebra::Vector2;

use super::Reconstruction;
use super::edit_faults::check_alone;
use super::edits::{Edit, RefusedEdit};
use super::map_edits::MapEdits;
use super::plan::PlacedPlan;
use super::run::Run;
use crate::error::Result;
use crate::geometry::{Pose2, RigidMotion};
use crate::map::occupancy_grid::{OccupancyGrid, RESOLUTION};
use crate::map::wall_direction::wall_direction;

impl Reconstruction {
    /// The steps of a run that is done which had no effect on the map or its grid, with the reason: those that lie outside.
    pub fn unused_edits(&self) -> Vec<RefusedEdit> {
        let Some(run) = self.run.as_ref().filter(|run| !run.map_edits.is_empty()) else { return Vec::new() };
        let mut unused = run.map_edits.aimless();
        if run.map_edits.edits_grid() {
            unused.extend(run.map_edits.edit(&mut run.unedited_grid(0, RESOLUTION)));
        }
        unused.sort_by_key(|unused| unused.index);
        unused
    }

    /// The building plan that steps have laid behind the map.
    pub fn plan(&self) -> Option<&PlacedPlan> {
        self.run.as_ref().and_then(|run| run.map_edits.plan())
    }

    /// Where a step would lay a plan in the map as it is; `None` for another step.
    ///
    /// # Errors
    /// Where the step is not valid.
    pub fn preview_plan(step: &Edit) -> Result<Option<PlacedPlan>> {
        check_alone(1, step)?;
        Ok(MapEdits::plan_of(step))
    }
}

impl Run {
    /// What is free and what is occupied by the frames of one piece, in cells of this side (m). Steps edit the grid of the main piece.
    pub fn occupancy_grid(&self, piece: usize, resolution: f64) -> OccupancyGrid {
        let mut grid = self.unedited_grid(piece, resolution);
        if piece == 0 {
            self.map_edits.edit(&mut grid);
        }
        grid
    }

    fn unedited_grid(&self, piece: usize, resolution: f64) -> OccupancyGrid {
        let frames: Vec<usize> = self.mapped().filter(|&frame| self.piece(frame) == piece).collect();
        let placed: Vec<_> =
            frames.iter().map(|&frame| (self.scans[frame].as_ref(), self.pose_in_map(frame))).collect();
        let of_laser = |stretch: &[usize]| stretch.iter().map(|&frame| self.pose_in_map(frame)).collect();
        let of_robot = |stretch: &[usize]| stretch.iter().map(|&frame| self.pose_of_robot(frame)).collect();
        // Where the way of the robot between frames is not known, it is not assumed.
        let drives: Vec<Vec<Pose2>> = frames
            .chunk_by(|before, after| before + 1 == *after)
            .flat_map(|stretch| [of_laser(stretch), of_robot(stretch)])
            .collect();
        let mut grid = OccupancyGrid::new(&placed, &drives, resolution);
        let pieces = self.sizes_of_pieces();
        if pieces.len() > 1 {
            let which = if piece == 0 { "the main piece".to_owned() } else { format!("piece {piece}") };
            let (count, all, num) = (frames.len(), pieces.iter().map(|(_, size)| size).sum::<usize>(), pieces.len());
            grid.remark = format!(
                "This is {which} of a map in {num} pieces that are not connected: {count} of {all} placed scans."
            );
        }
        grid
    }

    /// Indices of the frames that the map and its grid are made of: those that are placed and not left out.
    pub fn mapped(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.poses.len()).filter(|&frame| self.is_mapped(frame))
    }

    /// Whether it is one of these.
    pub fn is_mapped(&self, frame: usize) -> bool {
        self.is_placed(frame) && !self.map_edits.leaves_out(frame)
    }

    /// Pose of the laser at a scan, in the map.
    pub fn pose_in_map(&self, frame: usize) -> Pose2 {
        self.map_edits.in_map(self.poses[frame])
    }

    /// Pose of the robot at a scan, by that of its laser, in the map.
    pub fn pose_of_robot(&self, frame: usize) -> Pose2 {
        self.map_edits.in_map(self.poses[frame] * self.T_laser_robot[frame])
    }

    /// Lays the map out by its steps, once the poses are known.
    pub(super) fn lay_map(&mut self) {
        let walls = self.map_edits.needs_walls().then(|| self.wall_direction()).flatten();
        self.map_edits.lay(walls);
    }

    /// The direction of most walls of the main piece, by all returns. Returns of one wall are the further apart the further away it is.
    fn wall_direction(&self) -> Option<f64> {
        let normals = self.mapped().filter(|&frame| self.piece(frame) == 0).flat_map(|frame| {
            let scan = &self.scans[frame];
            let of_return = move |(point, normal): (&Vector2<f64>, &Option<Vector2<f64>>)| {
                Some(self.poses[frame].rotate(normal.as_ref()?) * point.norm())
            };
            scan.points.iter().zip(&scan.normals).filter_map(of_return)
        });
        wall_direction(normals)
    }

    /// What is said of a mended map; nothing where it is not.
    pub fn note_on_edits(&self) -> Option<String> {
        let applied = &self.before_mending.applied;
        let (added, removed) = (applied.num_added, applied.num_removed);
        let loops = (added + removed > 0).then(|| format!("loops put in {added}, taken out {removed}"));
        let parts: Vec<String> = loops.into_iter().chain(self.map_edits.told(self.poses.len())).collect();
        (!parts.is_empty()).then(|| format!("The map was mended by hand: {}.", parts.join("; ")))
    }
}
