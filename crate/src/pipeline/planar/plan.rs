//! A building plan behind the map: a picture of one scale, laid on the map by points that are known in both.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::anchor::{ACCURACY, Fit, too_far};
use crate::geometry::{Pose2, RigidMotion};

/// A point of a plan, and where it is in the map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct PlanPoint {
    /// Right and down from the upper left corner of the picture (pixels).
    pub picture: [f64; 2],
    /// x and y in the map as the steps before have laid it (m).
    pub map: [f64; 2],
}

/// A building plan as it lies behind the map.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct PlacedPlan {
    /// Name of its picture.
    pub picture: String,
    /// Side of a pixel (m).
    pub pixel: f64,
    /// The upper left corner of the picture, x and y in the map (m).
    pub corner: [f64; 2],
    /// The direction of the picture's rows, from the map's x axis, counter-clockwise (rad).
    pub turn: f64,
    /// The points that it was laid by, with their places in the map as it is now.
    pub points: Vec<PlanPoint>,
    /// Distance of each point in the map from where the picture has it (m).
    pub residuals: Vec<f64>,
    /// What is wrong with points that do not fit each other, in a sentence; null where they fit.
    pub contradiction: Option<String>,
}

impl PlacedPlan {
    /// By the similarity that fits the points best in the sense of least squares; `None` where they coincide.
    pub(super) fn of(picture: &str, points: &[PlanPoint], accuracy: Option<f64>) -> Option<Self> {
        let pair = |point: &PlanPoint| [Vector2::new(point.picture[0], -point.picture[1]), point.map.into()];
        let fit = Fit::of(&points.iter().map(pair).collect::<Vec<_>>(), true)?;
        // A point is pointed at to a cell of the map, and to a pixel of the picture.
        let accuracy = accuracy.unwrap_or_else(|| ACCURACY.hypot(fit.scale));
        let contradiction = fit.worst_if_contradictory(accuracy).map(|(worst, residual)| {
            format!("The points do not fit each other to {accuracy:.3} m: point {worst} is off by {residual:.2} m.")
        });
        Some(Self {
            picture: picture.to_owned(),
            pixel: fit.scale,
            corner: fit.T.translation.vector.into(),
            turn: fit.T.rotation.angle(),
            points: points.to_vec(),
            residuals: fit.residuals,
            contradiction,
        })
    }

    /// As it lies where the map is moved.
    pub(super) fn moved(self, by: &Pose2) -> Self {
        let T = *by * Pose2::new(self.corner.into(), self.turn);
        let moved = |point: PlanPoint| PlanPoint { map: by.act(&point.map.into()).into(), ..point };
        let points = self.points.into_iter().map(moved).collect();
        Self { corner: T.translation.vector.into(), turn: T.rotation.angle(), points, ..self }
    }

    /// In words.
    pub(super) fn told(&self) -> String {
        let Self { picture, pixel, residuals, contradiction, .. } = self;
        let each: Vec<String> = residuals.iter().map(|residual| format!("{residual:.3}")).collect();
        let doubt = if contradiction.is_some() { ": its points do not fit each other" } else { "" };
        format!("building plan {picture} of {pixel:.4} m a pixel laid, off by {} m{doubt}", each.join(", "))
    }
}

/// What is wrong with the points of a plan, and what would be right.
pub(super) fn fault(points: &[PlanPoint], accuracy: Option<f64>) -> Option<(String, &'static str)> {
    if points.len() < 3 {
        let points = if points.len() == 1 { "1 point".to_owned() } else { format!("{} points", points.len()) };
        return Some((format!("the plan has {points}"), "Give three at least, far apart"));
    }
    if let Some(accuracy) = accuracy.filter(|&accuracy| accuracy <= 0.0) {
        return Some((format!("the accuracy is {accuracy} m"), "Give more than 0 m"));
    }
    too_far("map", points.iter().flat_map(|point| point.map)).or_else(|| {
        let remedy = "Give points that are apart, in the picture and in the map";
        let problem = || "the points are all at one place, which tells no direction".to_owned();
        PlacedPlan::of("", points, accuracy).is_none().then(|| (problem(), remedy))
    })
}
