//! The options of voxel odometry as settings: limits, labels and explanations, for the page, the command line and the API.

use crate::error::Result;
use crate::odometry::voxel::VoxelOdometrySettings;
use crate::pipeline::settings::description::{Setting, SettingDescription, check_limits, settings_table};

impl VoxelOdometrySettings {
    /// Checks every value against the limits of its description.
    ///
    /// # Errors
    /// Names the first setting out of its limits, with the value and the limits.
    pub fn validate(&self) -> Result<()> {
        check_limits(&table(), self)
    }
}

/// Every setting of a strategy, in the order of the help.
pub fn strategy_descriptions() -> Vec<SettingDescription> {
    table().into_iter().map(|setting| setting.description).collect()
}

fn table() -> Vec<Setting<VoxelOdometrySettings>> {
    settings_table! { VoxelOdometrySettings:
        "Map" {
            choice map: "Map", "Whole: every point stays, and the index is built anew for each frame. Voxels: a few points in a small cube.",
                ["whole" => "Whole", "voxels" => "Voxels"];
            number map_voxel_size: "Voxel", "Side of a voxel of the map.",
                "m", [0.01, 10.0], step 0.01;
            integer points_per_voxel: "Points a voxel", "A voxel holds so many points at most.",
                [1, 100];
            choice kept: "A full voxel keeps", "The points that came first, those that came last, or the mean of all as one point.",
                ["first" => "First", "newest" => "Newest", "mean" => "Mean"];
            choice added: "Points added", "All points of a frame, or only those without a partner in the map (golden data).",
                ["all" => "All", "unmatched" => "Without a partner"];
            number partner_distance: "Partner within", "A point of the map this near is a partner: golden data leave such points out.",
                "m", [0.0, 10.0], step 0.01;
            number crop_distance: "Map kept within", "What lies further from the sensor is forgotten. 0: nothing is.",
                "m", [0.0, 1000.0], step 1.0;
        }
        "Registration" {
            choice motion: "Motion", "Free, or on a floor: in the x-z plane for a camera, in the x-y plane for a robot's own frame.",
                [
                    "free" => "Free",
                    "planar" => "On a floor",
                    "planar_xz" => "In the x-z plane",
                    "planar_xy" => "In the x-y plane",
                ];
            choice threshold: "Threshold", "Fixed, or adapted to how far off the predictions have been (KISS-ICP).",
                ["fixed" => "Fixed", "adaptive" => "Adaptive"];
            number max_correspondence_distance: "Pair distance", "Points further apart are no partners; of an adaptive threshold, where it begins.",
                "m", [0.01, 100.0], step 0.05;
            number source_voxel_size: "Source voxel", "A frame is thinned to one point in a cube of this side before it is registered. 0: all points are used.",
                "m", [0.0, 10.0], step 0.01;
            choice metric: "Metric", "The distance to the plane through the map's point, or to the point itself, as KISS-ICP does.",
                ["point_to_point" => "Point to point", "point_to_plane" => "Point to plane"];
            choice stages: "Stages", "One: partners within the threshold to the end. Two: then once more, with partners close by alone.",
                ["one" => "One", "two" => "Two"];
            integer max_iterations: "Iterations", "Most iterations of a stage.",
                [1, 1000];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::settings::description::assert_describes_all;
    use crate::pipeline::strategies::strategy_presets;

    #[test]
    fn every_setting_is_described_once_and_every_preset_is_valid() {
        assert_describes_all(&table());
        for preset in strategy_presets() {
            preset.settings.validate().unwrap();
        }
    }

    #[test]
    fn values_out_of_their_limits_are_named() {
        let error = VoxelOdometrySettings { map_voxel_size: 0.0, ..VoxelOdometrySettings::default() }.validate();
        assert!(error.unwrap_err().to_string().contains("map_voxel_size = 0"));
    }
}
