//! The options of voxel odometry as settings: limits, labels and explanations, for the page, the command line and the API.

use crate::error::Result;
use crate::odometry::voxel::VoxelOdometrySettings;
use crate::pipeline::settings::description::{SettingDescription, check_limits, choice, integer, number};

impl VoxelOdometrySettings {
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
    use crate::pipeline::settings::SettingKind;
    use crate::pipeline::strategies::strategy_presets;

    #[test]
    fn every_setting_is_described_once_and_every_preset_is_valid() {
        let fields = serde_json::to_value(VoxelOdometrySettings::default()).unwrap();
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
                    let settings: VoxelOdometrySettings = serde_json::from_value(json).unwrap();
                    assert_eq!(serde_json::to_value(&settings).unwrap()[description.name], choice.value);
                }
            } else {
                assert!(VoxelOdometrySettings::default().number(description.name).is_finite(), "{}", description.name);
            }
        }
        let error = VoxelOdometrySettings { map_voxel_size: 0.0, ..VoxelOdometrySettings::default() }.validate();
        assert!(error.unwrap_err().to_string().contains("map_voxel_size = 0"));
    }
}
