//! What can be chosen of a strategy: names, defaults, limits and explanations, for the page, the command line and the API.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::settings::description::{SettingDescription, check_limits, choice, integer, number};

/// How the map is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum MapKind {
    /// Every point that is added stays. Partners come from a k-d tree, built anew for each frame.
    Whole,
    /// A few points in a cube of side `map_voxel_size`. Partners come from a hash table of cubes, which grows with the map.
    Voxels,
}

/// Which points a full voxel keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum KeptPoint {
    /// Those that came first, as KISS-ICP does.
    First,
    /// Those that came last.
    Newest,
    /// One point, the mean of all.
    Mean,
}

/// Which points of a frame the map is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum AddedPoints {
    /// All.
    All,
    /// Those that found no partner in the map within `partner_distance`: what is new ("golden data").
    Unmatched,
}

/// How the sensor may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum StrategyMotion {
    /// In every way.
    Free,
    /// On a floor; which axis stands upright is told from the first frame: y of depth images and of clouds that look like a
    /// camera's view, which lie wholly ahead along z, and z of all other clouds.
    Planar,
    /// In the x-z plane, turning about y: a camera on a floor.
    PlanarXz,
    /// In the x-y plane, turning about z: a robot's own frame.
    PlanarXy,
}

/// How the distance limit of partners is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ThresholdKind {
    /// `max_correspondence_distance`, always.
    Fixed,
    /// From how far off the predictions have been (Vizzo et al. 2023), with `max_correspondence_distance` to begin with.
    Adaptive,
}

/// What a pair of partners measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum StrategyMetric {
    /// Distance of the two points, as KISS-ICP does.
    PointToPoint,
    /// Distance to the plane through the map's point.
    PointToPlane,
}

/// In how many stages a frame is registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Stages {
    /// Partners within the threshold, to the end, as KISS-ICP does.
    One,
    /// Then once more from there, with partners close by alone: within three spacings of the frame's points, or one and a half
    /// voxels of the map, whichever is more.
    Two,
}

/// One strategy. The default is a map of voxels of 0.1 m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct StrategySettings {
    /// How the map is kept.
    pub map: MapKind,
    /// Side of a voxel of the map (m).
    pub map_voxel_size: f64,
    /// Points that a voxel of the map holds at most.
    pub points_per_voxel: usize,
    /// Which points a full voxel keeps.
    pub kept: KeptPoint,
    /// Which points of a frame the map is given.
    pub added: AddedPoints,
    /// A point of the map within this distance (m) is a partner: with it a point is not new.
    pub partner_distance: f64,
    /// How the sensor may move.
    pub motion: StrategyMotion,
    /// How the distance limit of partners is set.
    pub threshold: ThresholdKind,
    /// Points further apart are no partners (m).
    pub max_correspondence_distance: f64,
    /// Points of the map further from the sensor are forgotten (m); 0: none is.
    pub crop_distance: f64,
    /// The frame's points are thinned to one in a cube of this side before they are registered (m); 0: all are used. The
    /// map is given all in any case.
    pub source_voxel_size: f64,
    /// What a pair of partners measures.
    pub metric: StrategyMetric,
    /// In how many stages a frame is registered.
    pub stages: Stages,
    /// Most iterations of a stage.
    pub max_iterations: usize,
}

impl Default for StrategySettings {
    fn default() -> Self {
        Self {
            map: MapKind::Voxels,
            map_voxel_size: 0.1,
            points_per_voxel: 1,
            kept: KeptPoint::First,
            added: AddedPoints::All,
            partner_distance: 0.1,
            motion: StrategyMotion::Free,
            threshold: ThresholdKind::Fixed,
            max_correspondence_distance: 1.0,
            crop_distance: 0.0,
            source_voxel_size: 0.1,
            metric: StrategyMetric::PointToPlane,
            stages: Stages::Two,
            max_iterations: 50,
        }
    }
}

impl StrategySettings {
    /// Checks every value against the limits of its description.
    ///
    /// # Errors
    /// Names the first setting out of its limits, with the value and the limits.
    pub fn validate(&self) -> Result<()> {
        check_limits(&strategy_descriptions(), |name| self.number(name))
    }

    /// The value of a numeric setting by its name; NaN for a choice.
    fn number(&self, name: &str) -> f64 {
        match name {
            "map_voxel_size" => self.map_voxel_size,
            "points_per_voxel" => self.points_per_voxel as f64,
            "partner_distance" => self.partner_distance,
            "max_correspondence_distance" => self.max_correspondence_distance,
            "crop_distance" => self.crop_distance,
            "source_voxel_size" => self.source_voxel_size,
            "max_iterations" => self.max_iterations as f64,
            _ => f64::NAN,
        }
    }
}

/// Every setting of a strategy, in the order of the help.
pub fn strategy_descriptions() -> Vec<SettingDescription> {
    vec![
        choice(
            "map",
            "Map",
            "Map",
            "Whole: every point stays, and the index is built anew for each frame. Voxels: a few points in a small cube.",
            &[("whole", "Whole"), ("voxels", "Voxels")],
        ),
        number("map_voxel_size", "Voxel", "Map", "m", "Side of a voxel of the map.", (0.01, 10.0, 0.01)),
        integer("points_per_voxel", "Points a voxel", "Map", "A voxel holds so many points at most.", 1, 100),
        choice(
            "kept",
            "A full voxel keeps",
            "Map",
            "The points that came first, those that came last, or the mean of all as one point.",
            &[("first", "First"), ("newest", "Newest"), ("mean", "Mean")],
        ),
        choice(
            "added",
            "Points added",
            "Map",
            "All points of a frame, or only those without a partner in the map (golden data).",
            &[("all", "All"), ("unmatched", "Without a partner")],
        ),
        number(
            "partner_distance",
            "Partner within",
            "Map",
            "m",
            "A point of the map this near is a partner: golden data leave such points out.",
            (0.0, 10.0, 0.01),
        ),
        number(
            "crop_distance",
            "Map kept within",
            "Map",
            "m",
            "What lies further from the sensor is forgotten. 0: nothing is.",
            (0.0, 1000.0, 1.0),
        ),
        choice(
            "motion",
            "Motion",
            "Registration",
            "Free, or on a floor: in the x-z plane for a camera, in the x-y plane for a robot's own frame.",
            &[
                ("free", "Free"),
                ("planar", "On a floor"),
                ("planar_xz", "In the x-z plane"),
                ("planar_xy", "In the x-y plane"),
            ],
        ),
        choice(
            "threshold",
            "Threshold",
            "Registration",
            "Fixed, or adapted to how far off the predictions have been (KISS-ICP).",
            &[("fixed", "Fixed"), ("adaptive", "Adaptive")],
        ),
        number(
            "max_correspondence_distance",
            "Pair distance",
            "Registration",
            "m",
            "Points further apart are no partners; of an adaptive threshold, where it begins.",
            (0.01, 100.0, 0.05),
        ),
        number(
            "source_voxel_size",
            "Source voxel",
            "Registration",
            "m",
            "A frame is thinned to one point in a cube of this side before it is registered. 0: all points are used.",
            (0.0, 10.0, 0.01),
        ),
        choice(
            "metric",
            "Metric",
            "Registration",
            "The distance to the plane through the map's point, or to the point itself, as KISS-ICP does.",
            &[("point_to_point", "Point to point"), ("point_to_plane", "Point to plane")],
        ),
        choice(
            "stages",
            "Stages",
            "Registration",
            "One: partners within the threshold to the end. Two: then once more, with partners close by alone.",
            &[("one", "One"), ("two", "Two")],
        ),
        integer("max_iterations", "Iterations", "Registration", "Most iterations of a stage.", 1, 1000),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SettingKind;
    use crate::strategies::strategy_presets;

    #[test]
    fn every_setting_is_described_once_and_every_preset_is_valid() {
        let fields = serde_json::to_value(StrategySettings::default()).unwrap();
        let mut fields: Vec<String> = fields.as_object().unwrap().keys().cloned().collect();
        let mut described: Vec<String> = strategy_descriptions().iter().map(|d| d.name.to_owned()).collect();
        fields.sort();
        described.sort();
        assert_eq!(fields, described);
        for preset in strategy_presets() {
            preset.settings.validate().unwrap();
        }
    }

    #[test]
    fn every_choice_is_a_value_and_every_number_has_its_limits() {
        for description in strategy_descriptions() {
            if let SettingKind::Choice { choices } = &description.kind {
                for choice in choices {
                    let json = serde_json::json!({ description.name: choice.value });
                    let settings: StrategySettings = serde_json::from_value(json).unwrap();
                    assert_eq!(serde_json::to_value(&settings).unwrap()[description.name], choice.value);
                }
            } else {
                assert!(StrategySettings::default().number(description.name).is_finite(), "{}", description.name);
            }
        }
        let error = StrategySettings { map_voxel_size: 0.0, ..StrategySettings::default() }.validate();
        assert!(error.unwrap_err().to_string().contains("map_voxel_size = 0"));
    }
}
