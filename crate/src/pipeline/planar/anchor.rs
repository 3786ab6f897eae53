//! The motion that lays a map on places whose coordinates are known: survey points, corners of a building plan.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

use crate::geometry::mahalanobis::one_in_thousand_of;
use crate::geometry::{Pose2, RigidMotion};
use crate::map::occupancy_grid::RESOLUTION;

/// A place of the map with known coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct KnownPlace {
    /// x and y in the map as the steps before have laid it (m).
    pub map: [f64; 2],
    /// x and y in the world (m).
    pub world: [f64; 2],
}

/// The motion that lays points of one frame on the same points of another with the least sum of squared distances
/// (Umeyama, PAMI 13 (1991), in the plane).
pub(super) struct Fit {
    /// Of lengths, before the motion: 1 where it is rigid.
    pub scale: f64,
    /// Maps what is scaled to the other frame.
    pub T: Pose2,
    /// Distance of each point from where the fit lays it (m).
    pub residuals: Vec<f64>,
    has_scale: bool,
    /// How many times as far the points lie apart in the other frame, in the mean of squares.
    stretch: f64,
}

/// Standard deviation of a coordinate of a known place (m) where a step does not state it: a cell, as exact as a place is pointed at.
pub(super) const ACCURACY: f64 = RESOLUTION;

impl Fit {
    /// Of pairs of a point and where it is in the other frame (m), with a scale or rigid; `None` where the points coincide in a frame.
    pub fn of(pairs: &[[Vector2<f64>; 2]], has_scale: bool) -> Option<Self> {
        let mean = |side: usize| pairs.iter().map(|pair| pair[side]).sum::<Vector2<f64>>() / pairs.len() as f64;
        let (mean_from, mean_to) = (mean(0), mean(1));
        let (mut covariance, mut spread_from, mut spread_to) = (Matrix2::zeros(), 0.0, 0.0);
        for pair in pairs {
            let (from, to) = (pair[0] - mean_from, pair[1] - mean_to);
            covariance += to * from.transpose();
            (spread_from, spread_to) = (spread_from + from.norm_squared(), spread_to + to.norm_squared());
        }
        if spread_from == 0.0 || spread_to == 0.0 {
            return None;
        }
        let rotation = Pose2::best_rotation(&covariance)?;
        let scale = if has_scale { (rotation.transpose() * covariance).trace() / spread_from } else { 1.0 };
        let T: Pose2 = RigidMotion::from_parts(&rotation, &(mean_to - scale * (rotation * mean_from)));
        let residuals = pairs.iter().map(|[from, to]| (T.act(&(scale * from)) - to).norm()).collect();
        (scale > 0.0).then(|| Self { scale, T, residuals, has_scale, stretch: (spread_to / spread_from).sqrt() })
    }

    /// Root mean square of the residuals (m).
    pub fn rms(&self) -> f64 {
        (self.residuals.iter().map(|residual| residual * residual).sum::<f64>() / self.residuals.len() as f64).sqrt()
    }

    /// The residuals in words.
    pub fn told(&self) -> String {
        let each: Vec<String> = self.residuals.iter().map(|residual| format!("{residual:.3}")).collect();
        format!("off by {} m ({:.3} m rms)", each.join(", "), self.rms())
    }

    /// The number of the pair with the largest residual, from 1, and the residual (m), where the pairs fit worse than this standard
    /// deviation of a coordinate (m) allows.
    pub fn worst_if_contradictory(&self, accuracy: f64) -> Option<(usize, f64)> {
        // A turn, a shift, and a scale where there is one.
        let num_unknowns = 3 + usize::from(self.has_scale);
        let chi_squared = self.residuals.iter().map(|residual| (residual / accuracy).powi(2)).sum::<f64>();
        if chi_squared <= one_in_thousand_of(2 * self.residuals.len() - num_unknowns) {
            return None;
        }
        (1..).zip(self.residuals.iter().copied()).max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The rigid motion onto known places.
pub(super) fn anchor(pairs: &[KnownPlace]) -> Option<Fit> {
    let pairs: Vec<_> = pairs.iter().map(|pair| [pair.map.into(), pair.world.into()]).collect();
    Fit::of(&pairs, false)
}

/// What is wrong with places that fit worse than this standard deviation of their coordinates (m) allows.
fn contradiction(fit: &Fit, accuracy: f64) -> Option<String> {
    let (worst, residual) = fit.worst_if_contradictory(accuracy)?;
    let percent = 100.0 * (fit.stretch - 1.0);
    let apart = if percent < 0.0 { "less far apart" } else { "further apart" };
    Some(format!(
        "the pairs do not fit each other to {accuracy} m: pair {worst} is off by {residual:.2} m, and the places lie {:.1} % {apart} in the world than in the map",
        percent.abs()
    ))
}

/// What is wrong with a coordinate that is too large for the points of the map, which are in single precision: beyond, they are off by
/// a quarter of a cell.
pub(super) fn too_far(frame: &str, coordinates: impl IntoIterator<Item = f64>) -> Option<(String, &'static str)> {
    let limit = RESOLUTION / (4.0 * f64::from(f32::EPSILON));
    let far = coordinates.into_iter().find(|value| value.abs() > limit)?;
    let problem = format!("the {frame}'s coordinate {far} m is further than {:.0} km from its origin", limit / 1e3);
    Some((problem, "Take the same round number of metres off all of them"))
}

/// What is wrong with the pairs of an anchor, and what would be right.
pub(super) fn fault(pairs: &[KnownPlace], accuracy: f64) -> Option<(String, &'static str)> {
    if pairs.len() < 2 {
        let pairs = if pairs.len() == 1 { "1 pair".to_owned() } else { format!("{} pairs", pairs.len()) };
        return Some((format!("the anchor has {pairs}"), "Give two at least, far apart"));
    }
    if accuracy <= 0.0 {
        return Some((format!("the accuracy is {accuracy} m"), "Give more than 0 m"));
    }
    if let Some(fault) = too_far("world", pairs.iter().flat_map(|pair| pair.world)) {
        return Some(fault);
    }
    let Some(fit) = anchor(pairs) else {
        let remedy = "Give places that are apart, in the map and in the world";
        return Some(("the pairs are all at one place, which tells no direction".to_owned(), remedy));
    };
    let remedy = "Correct the pair, give metres in both, or state a larger standard deviation (\"accuracy\")";
    contradiction(&fit, accuracy).map(|problem| (problem, remedy))
}
