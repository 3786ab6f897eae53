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

/// A rigid motion fitted to known places.
pub(super) struct Anchor {
    /// Maps the map's coordinates to the world's.
    pub T_world_map: Pose2,
    /// Distance of each place from where the fit lays it (m).
    pub residuals: Vec<f64>,
    /// By how much further the places lie apart in the world than in the map.
    scale: f64,
}

/// Standard deviation of a coordinate of a known place (m) where a step does not state it: a cell, as exact as a place is pointed at.
pub(super) const ACCURACY: f64 = RESOLUTION;

impl Anchor {
    /// The least-squares fit; `None` where the places coincide.
    pub fn fit(places: &[KnownPlace]) -> Option<Self> {
        let mean = |of: fn(&KnownPlace) -> [f64; 2]| {
            places.iter().map(|place| Vector2::from(of(place))).sum::<Vector2<f64>>() / places.len() as f64
        };
        let (mean_map, mean_world) = (mean(|place| place.map), mean(|place| place.world));
        let (mut covariance, mut spread_map, mut spread_world) = (Matrix2::zeros(), 0.0, 0.0);
        for place in places {
            let (from, to) = (Vector2::from(place.map) - mean_map, Vector2::from(place.world) - mean_world);
            covariance += to * from.transpose();
            (spread_map, spread_world) = (spread_map + from.norm_squared(), spread_world + to.norm_squared());
        }
        if spread_map == 0.0 || spread_world == 0.0 {
            return None;
        }
        let rotation = Pose2::best_rotation(&covariance)?;
        let T_world_map: Pose2 = RigidMotion::from_parts(&rotation, &(mean_world - rotation * mean_map));
        let residual = |place: &KnownPlace| (T_world_map.act(&place.map.into()) - Vector2::from(place.world)).norm();
        let residuals = places.iter().map(residual).collect();
        Some(Self { T_world_map, residuals, scale: (spread_world / spread_map).sqrt() })
    }

    /// Root mean square of the residuals (m).
    pub fn rms(&self) -> f64 {
        (self.residuals.iter().map(|residual| residual * residual).sum::<f64>() / self.residuals.len() as f64).sqrt()
    }

    /// What is wrong with places that fit worse than this standard deviation of their coordinates (m) allows.
    fn contradiction(&self, accuracy: f64) -> Option<String> {
        let chi_squared = self.residuals.iter().map(|residual| (residual / accuracy).powi(2)).sum::<f64>();
        if chi_squared <= one_in_thousand_of(2 * self.residuals.len() - 3) {
            return None;
        }
        let (worst, residual) =
            self.residuals.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or((1, 0.0), |(i, r)| (i + 1, *r));
        let percent = 100.0 * (self.scale - 1.0);
        let apart = if percent < 0.0 { "less far apart" } else { "further apart" };
        Some(format!(
            "the pairs do not fit each other to {accuracy} m: pair {worst} is off by {residual:.2} m, and the places lie {:.1} % {apart} in the world than in the map",
            percent.abs()
        ))
    }
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
    // Points of the map are in single precision: beyond, they are off by a quarter of a cell.
    let limit = RESOLUTION / (4.0 * f64::from(f32::EPSILON));
    if let Some(far) = pairs.iter().flat_map(|pair| pair.world).find(|value| value.abs() > limit) {
        let problem = format!("the world's coordinate {far} m is further than {:.0} km from its origin", limit / 1e3);
        return Some((problem, "Take the same round number of metres off all of them"));
    }
    let Some(anchor) = Anchor::fit(pairs) else {
        let remedy = "Give places that are apart, in the map and in the world";
        return Some(("the pairs are all at one place, which tells no direction".to_owned(), remedy));
    };
    let remedy = "Correct the pair, give metres in both, or state a larger \"accuracy\"";
    anchor.contradiction(accuracy).map(|problem| (problem, remedy))
}
