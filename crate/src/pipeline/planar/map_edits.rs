//! The map of a run as steps lay it out: turned, anchored, painted, cropped, without some of its scans.
//!
//! The run's own poses stay. The motion is applied wherever poses and points leave it, and the grid is traced anew in the frame of the map:
//! no cell is ever resampled. Shapes that were painted before are moved with the map.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{UnitComplex, Vector2};

use super::anchor::{Fit, anchor};
use super::edits::{Edit, RefusedEdit};
use super::plan::PlacedPlan;
use crate::evaluation::trajectory_error::PlanarPoint;
use crate::geometry::Pose2;
use crate::map::occupancy_grid::{Cell, OccupancyGrid, Shape};

/// What the steps that are not about loops make of the map of a run.
#[derive(Default)]
pub struct MapEdits {
    /// All steps, those about loops too: the others keep their numbers.
    steps: Vec<Edit>,
    /// The direction of most walls before any turn (rad), where a step asked for it and there are walls.
    walls: Option<f64>,
    /// From the run to the map.
    motion: Motion,
    /// In the map as it is laid.
    shapes: Vec<PlacedShape>,
    plan: Option<PlacedPlan>,
}

/// A turn about the origin, more than once round where steps say so, and a shift after it.
#[derive(Default, Clone, Copy, PartialEq)]
struct Motion {
    /// rad.
    turn: f64,
    /// m.
    shift: Vector2<f64>,
}

impl Motion {
    fn then(self, turn: f64, shift: Vector2<f64>) -> Self {
        Self { turn: self.turn + turn, shift: UnitComplex::new(turn) * self.shift + shift }
    }

    fn pose(self) -> Pose2 {
        Pose2::new(self.shift, self.turn)
    }
}

/// A shape that a step paints or crops to.
struct PlacedShape {
    /// The number of its step.
    index: usize,
    shape: Shape,
    /// What it paints; `None` where the grid is cropped to it.
    cells: Option<Cell>,
}

impl MapEdits {
    /// Those of a map without scans: its shapes. The steps that need the scans are told.
    pub fn of_grid(steps: &[Edit]) -> (Self, Vec<RefusedEdit>) {
        let reason =
            || "it needs the scans that the map was made of: give the recording in place of the grid".to_owned();
        let (mut unused, mut shapes) = (Vec::new(), Vec::new());
        for (index, step) in steps.iter().enumerate() {
            match shape_of(step) {
                Some((shape, cells)) => shapes.push(PlacedShape { index, shape, cells }),
                None => unused.push(RefusedEdit { index, reason: reason() }),
            }
        }
        (Self { shapes, ..Self::default() }, unused)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Whether one asks for the direction of the walls.
    pub fn needs_walls(&self) -> bool {
        self.steps.iter().any(|edit| matches!(edit, Edit::Rotate { angle: None }))
    }

    /// Whether one changes the grid.
    pub fn edits_grid(&self) -> bool {
        !self.shapes.is_empty()
    }

    /// Takes these steps in place of those before. They are of effect once the map is laid out.
    pub fn set(&mut self, steps: &[Edit]) {
        self.steps = steps.to_vec();
    }

    /// A pose of the run, in the map.
    pub fn in_map(&self, pose: Pose2) -> Pose2 {
        // What is not moved stays as it is to the bit.
        if self.is_moved() { self.T_map_run() * pose } else { pose }
    }

    fn is_moved(&self) -> bool {
        self.motion != Motion::default()
    }

    /// The motion of the map.
    pub fn T_map_run(&self) -> Pose2 {
        self.motion.pose()
    }

    /// Its turn alone.
    pub fn R_map_run(&self) -> Pose2 {
        Pose2::rotation(self.motion.turn)
    }

    /// A place of the run, in the map.
    pub fn point_in_map(&self, point: &PlanarPoint) -> PlanarPoint {
        let T = self.in_map(Pose2::new(Vector2::new(point.x, point.y), point.heading.unwrap_or(0.0)));
        let heading = point.heading.map(|heading| if self.is_moved() { T.rotation.angle() } else { heading });
        PlanarPoint { x: T.translation.x, y: T.translation.y, heading }
    }

    /// Whether a step leaves this scan out.
    pub fn leaves_out(&self, frame: usize) -> bool {
        self.steps
            .iter()
            .any(|edit| matches!(edit, Edit::LeaveOut { first, last } if (*first..=*last).contains(&frame)))
    }

    /// Lays the map out. `walls`: the direction of most walls before any turn (rad), where there are walls and it is needed.
    pub fn lay(&mut self, walls: Option<f64>) {
        self.walls = walls;
        let (mut motion, mut shapes, mut plan) = (Motion::default(), Vec::new(), None);
        for (index, edit) in self.steps.iter().enumerate() {
            if let Edit::Rotate { angle } = edit {
                let to_walls = || walls.map_or(0.0, |walls| -off_axis(walls + motion.turn));
                motion = motion.then(angle.unwrap_or_else(to_walls), Vector2::zeros());
            } else if let Some(Fit { T, .. }) = anchor_of(edit) {
                motion = motion.then(T.rotation.angle(), T.translation.vector);
            } else if let Some((shape, cells)) = shape_of(edit) {
                shapes.push((motion, PlacedShape { index, shape, cells }));
            } else if matches!(edit, Edit::LayPlan { .. } | Edit::RemovePlan) {
                plan = Self::plan_of(edit).map(|placed| (motion, placed));
            }
        }
        // What moved the map after a step moves what the step has laid.
        let rest = |before: Motion| (motion != before).then(|| motion.pose() * before.pose().inverse());
        let moved = |(before, placed): (Motion, PlacedShape)| match rest(before) {
            Some(rest) => PlacedShape { shape: placed.shape.moved(&rest), ..placed },
            None => placed,
        };
        self.shapes = shapes.into_iter().map(moved).collect();
        self.plan = plan.map(|(before, placed)| match rest(before) {
            Some(rest) => placed.moved(&rest),
            None => placed,
        });
        self.motion = motion;
    }

    /// The building plan, as it lies.
    pub fn plan(&self) -> Option<&PlacedPlan> {
        self.plan.as_ref()
    }

    /// Where a step lays a plan; `None` for another one.
    pub fn plan_of(edit: &Edit) -> Option<PlacedPlan> {
        let Edit::LayPlan { picture, points, accuracy } = edit else { return None };
        PlacedPlan::of(picture, points, *accuracy)
    }

    /// Edits the grid; the steps that find no cell in it, with the reason.
    pub fn edit(&self, grid: &mut OccupancyGrid) -> Vec<RefusedEdit> {
        let mut unused = Vec::new();
        for PlacedShape { index, shape, cells } in &self.shapes {
            let is_used = match cells {
                Some(cells) => grid.paint(shape, *cells),
                None => grid.crop(shape),
            };
            if !is_used {
                let (low, cells) = (grid.origin, Vector2::new(grid.width as f64, grid.height as f64));
                let high = low + cells * grid.resolution;
                let reaches = format!("({:.2}, {:.2}) to ({:.2}, {:.2}) m", low.x, low.y, high.x, high.y);
                let reason = format!("no cell of the map lies in it: the map reaches from {reaches}");
                unused.push(RefusedEdit { index: *index, reason });
            }
        }
        unused
    }

    /// The turns to the walls of a map that shows none.
    pub fn aimless(&self) -> Vec<RefusedEdit> {
        let asks = |(_, edit): &(usize, &Edit)| self.walls.is_none() && matches!(edit, Edit::Rotate { angle: None });
        let reason = || "the map shows no wall to be turned to".to_owned();
        self.steps.iter().enumerate().filter(asks).map(|(index, _)| RefusedEdit { index, reason: reason() }).collect()
    }

    /// What they do, in words.
    pub fn told(&self, num_scans: usize) -> impl Iterator<Item = String> {
        let num_crops = self.shapes.iter().filter(|placed| placed.cells.is_none()).count();
        let num_painted = self.shapes.len() - num_crops;
        let num_left_out = (0..num_scans).filter(|&frame| self.leaves_out(frame)).count();
        let parts = [
            (num_painted > 0).then(|| format!("shapes painted {num_painted}")),
            (num_crops > 0).then(|| format!("grid cropped {num_crops}")),
            (self.motion.turn != 0.0).then(|| format!("turned by {:.2}°", self.motion.turn.to_degrees())),
            self.steps.iter().rev().find_map(anchor_of).map(|fit| format!("anchored to known places, {}", fit.told())),
            self.plan.as_ref().map(PlacedPlan::told),
            (num_left_out > 0).then(|| format!("scans left out {num_left_out}")),
        ];
        parts.into_iter().flatten()
    }
}

/// The angle from the nearest axis (rad).
fn off_axis(angle: f64) -> f64 {
    angle - (angle / FRAC_PI_2).round() * FRAC_PI_2
}

fn anchor_of(edit: &Edit) -> Option<Fit> {
    if let Edit::Anchor { pairs, .. } = edit { anchor(pairs) } else { None }
}

/// The shape of a step, and what it paints.
fn shape_of(edit: &Edit) -> Option<(Shape, Option<Cell>)> {
    let points = |points: &[[f64; 2]; 2]| points.map(Vector2::from);
    match edit {
        Edit::PaintLine { cells, ends, width } => {
            Some((Shape::Line { ends: points(ends), width: *width }, Some(*cells)))
        }
        Edit::PaintRectangle { cells, corners } => Some((Shape::rectangle(points(corners)), Some(*cells))),
        Edit::PaintPolygon { cells, corners } => {
            Some((Shape::Polygon(corners.iter().copied().map(Vector2::from).collect()), Some(*cells)))
        }
        Edit::Crop { corners } => Some((Shape::rectangle(points(corners)), None)),
        _ => None,
    }
}
