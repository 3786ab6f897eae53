//! What is wrong with a step of mending in itself, whatever the map.

use nalgebra::Vector2;

use super::anchor::{self, ACCURACY};
use super::edits::Edit;
use super::plan;
use super::run::Run;
use crate::error::{Error, Result};

/// What is wrong, and what would be right.
type Fault = (String, &'static str);

impl Run {
    /// Whether these steps can be given to this run.
    ///
    /// # Errors
    /// Where one is not valid, by its number from 1.
    pub fn check(&self, edits: &[Edit]) -> Result<()> {
        let num_scans = self.poses.len();
        for (number, edit) in (1..).zip(edits) {
            if let Some(scan) = named_scans(edit).into_iter().flatten().find(|&scan| scan >= num_scans) {
                let problem = format!("Step {number} names scan {scan}, and the recording has {num_scans}");
                return Err(Error::whole(problem, format!("Scans are counted from 0 to {}", num_scans - 1)));
            }
            check_alone(number, edit)?;
        }
        let leaves_out = |frame: usize| {
            edits.iter().any(|edit| matches!(edit, Edit::LeaveOut { first, last } if (*first..=*last).contains(&frame)))
        };
        if self.placed().next().is_some() && self.placed().all(leaves_out) {
            return Err(Error::whole("The steps leave no scan in the map", "Leave fewer out"));
        }
        Ok(())
    }
}

/// Whether a step is valid, whatever the map.
///
/// # Errors
/// Where it is not; `number` is counted from 1.
pub(super) fn check_alone(number: usize, edit: &Edit) -> Result<()> {
    fault(edit).map_or(Ok(()), |(problem, remedy)| Err(Error::whole(format!("Step {number}: {problem}"), remedy)))
}

fn named_scans(edit: &Edit) -> Option<[usize; 2]> {
    match *edit {
        Edit::LeaveOut { first, last } => Some([first, last]),
        _ => edit.scans(),
    }
}

fn fault(edit: &Edit) -> Option<Fault> {
    match edit {
        Edit::RemoveLoop { .. } | Edit::RemovePlan => None,
        Edit::AddLoop { T_target_source: T, .. } => not_finite("T_target_source", [T.x, T.y, T.theta]),
        Edit::PaintLine { ends, width, .. } => {
            let numbers = not_finite("ends", ends.iter().flatten().copied()).or_else(|| not_finite("width", [*width]));
            numbers.or_else(|| line_fault(ends, *width))
        }
        Edit::PaintRectangle { corners, .. } | Edit::Crop { corners } => {
            not_finite("corners", corners.iter().flatten().copied()).or_else(|| rectangle_fault(corners))
        }
        Edit::PaintPolygon { corners, .. } => {
            not_finite("corners", corners.iter().flatten().copied()).or_else(|| polygon_fault(corners))
        }
        Edit::Rotate { angle } => not_finite("angle", *angle),
        Edit::Anchor { pairs, accuracy } => {
            let numbers = pairs.iter().flat_map(|pair| pair.map.into_iter().chain(pair.world));
            let numbers = not_finite("pairs", numbers).or_else(|| not_finite("accuracy", *accuracy));
            numbers.or_else(|| anchor::fault(pairs, accuracy.unwrap_or(ACCURACY)))
        }
        Edit::LayPlan { points, accuracy, .. } => {
            let numbers = points.iter().flat_map(|point| point.picture.into_iter().chain(point.map));
            let numbers = not_finite("points", numbers).or_else(|| not_finite("accuracy", *accuracy));
            numbers.or_else(|| plan::fault(points, *accuracy))
        }
        Edit::LeaveOut { first, last } => (first > last).then(|| {
            (format!("the first scan, {first}, comes after the last, {last}"), "Give the smaller number first")
        }),
    }
}

fn not_finite(name: &str, numbers: impl IntoIterator<Item = f64>) -> Option<Fault> {
    let wrong = numbers.into_iter().find(|number| !number.is_finite())?;
    Some((format!("\"{name}\" has the number {wrong}"), "Give finite numbers, in metres and radians"))
}

fn line_fault([from, to]: &[[f64; 2]; 2], width: f64) -> Option<Fault> {
    if width <= 0.0 {
        return Some((format!("the line is {width} m wide"), "Give a width of more than 0 m"));
    }
    let [x, y] = from;
    (from == to)
        .then(|| (format!("the line has no length: it begins and ends at ({x}, {y})"), "Give two different ends"))
}

fn rectangle_fault([a, b]: &[[f64; 2]; 2]) -> Option<Fault> {
    let axis = (0..2).find(|&axis| a[axis] == b[axis])?;
    let name = ["x", "y"][axis];
    Some((format!("the rectangle has no size: both corners have {name} = {}", a[axis]), "Give two opposite corners"))
}

fn polygon_fault(corners: &[[f64; 2]]) -> Option<Fault> {
    if corners.len() < 3 {
        return Some((format!("the polygon has {} corners", corners.len()), "Give three at least"));
    }
    let first = Vector2::from(corners[0]);
    let from_first: Vec<Vector2<f64>> = corners.iter().map(|corner| Vector2::from(*corner) - first).collect();
    let is_flat = from_first.windows(2).all(|pair| pair[0].perp(&pair[1]) == 0.0);
    is_flat.then(|| ("the polygon has no size: its corners lie on one line".to_owned(), "Give corners around an area"))
}
