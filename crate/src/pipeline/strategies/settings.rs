//! The options of voxel odometry as settings: limits, labels and explanations, for the page, the command line and the API.

use crate::error::Result;
use crate::odometry::voxel::VoxelOdometrySettings;
use crate::pipeline::settings::description::{Setting, SettingDescription, check_limits, settings_table};

impl VoxelOdometrySettings {
    /// Checks every value against the limits of its description.
    ///
    /// # Errors
    /// Names the first setting out of its limits, with the value and the limits.
    pub(crate) fn validate(&self) -> Result<()> {
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
            choice map: "Map", "Selects the map. Whole: keeps every point and rebuilds the index for each frame. Voxels: keeps a few points per voxel.",
                ["whole" => "Whole", "voxels" => "Voxels"];
            number map_voxel_size: "Voxel", "Side of a voxel of the map.",
                "m", [0.01, 10.0], step 0.01;
            integer points_per_voxel: "Points per voxel", "Largest number of points that a voxel holds.",
                [1, 100];
            choice kept: "Points kept", "Selects what a full voxel keeps: the first points, the newest points, or the mean of all as one point.",
                ["first" => "First", "newest" => "Newest", "mean" => "Mean"];
            choice added: "Points added", "Selects which points of a frame enter the map: all, or only those without a correspondence (golden data).",
                ["all" => "All", "unmatched" => "Unmatched"];
            number partner_distance: "Duplicate distance", "Golden data: points this near to a point of the map are not added.",
                "m", [0.0, 10.0], step 0.01;
            number crop_distance: "Map radius", "Points further from the sensor are removed from the map. 0: none are.",
                "m", [0.0, 1000.0], step 1.0;
        }
        "Registration" {
            choice motion: "Motion", "Selects the degrees of freedom: free, or in a plane: x-z for a camera, x-y for a robot's own frame.",
                [
                    "free" => "Free",
                    "planar" => "On a floor",
                    "planar_xz" => "In the x-z plane",
                    "planar_xy" => "In the x-y plane",
                ];
            choice threshold: "Threshold", "Selects a fixed correspondence distance, or one adapted to the error of the predictions so far (KISS-ICP).",
                ["fixed" => "Fixed", "adaptive" => "Adaptive"];
            number max_correspondence_distance: "Correspondence distance", "Largest distance between corresponding points; initial value of an adaptive threshold.",
                "m", [0.01, 100.0], step 0.05;
            number source_voxel_size: "Source voxel", "Side of the voxels to which a frame is downsampled before registration. 0: all points are used.",
                "m", [0.0, 10.0], step 0.01;
            choice metric: "Metric", "Selects the residual: the distance to the plane through the map's point, or to the point itself, as in KISS-ICP.",
                ["point_to_point" => "Point to point", "point_to_plane" => "Point to plane"];
            choice stages: "Stages", "One: a single correspondence distance. Two: a second stage with a shorter one follows.",
                ["one" => "One", "two" => "Two"];
            integer max_iterations: "Iterations", "Largest number of iterations per stage.",
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
