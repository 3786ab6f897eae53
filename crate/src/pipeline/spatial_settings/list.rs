//! The settings of a reconstruction in space in the order of the page, and presets.

use std::f64::consts::PI;

use super::{Method, Quantisation, SpatialSettings};
use crate::odometry::cloud::GlobalRegistrationUse;
use crate::odometry::depth::Effort;
use crate::pipeline::settings::description::{Preset, Setting, SettingDescription, settings_table};

/// The presets; the first is the default.
pub fn spatial_presets() -> Vec<Preset<SpatialSettings>> {
    vec![
        Preset {
            name: "best",
            label: "Best",
            explanation: "Registers each frame to the map of all earlier frames and checks every result before accepting it. The default.",
            settings: SpatialSettings::default(),
        },
        Preset {
            name: "course",
            label: "Course pipeline",
            explanation: "The pipeline taught in courses with Open3D: voxels of 5 cm, FPFH, RANSAC and point-to-plane ICP, each frame to the previous one.",
            settings: SpatialSettings {
                method: Method::Course,
                // Courses use the raw value as the depth.
                quantisation: Quantisation::Rounded,
                min_range: 0.0,
                voxel_size: 0.05,
                max_correspondence_distance: 0.02,
                global_registration: GlobalRegistrationUse::Always,
                ..SpatialSettings::default()
            },
        },
        Preset {
            name: "fast",
            label: "Fast",
            explanation: "Uses fewer points, tries fewer pose hypotheses unless the result is doubtful, and makes a map with voxels of 5 cm.",
            settings: SpatialSettings { effort: Effort::Quick, map_voxel_size: 0.05, ..SpatialSettings::default() },
        },
    ]
}

/// Every setting, in the order of the page.
pub fn spatial_descriptions() -> Vec<SettingDescription> {
    table().into_iter().map(|setting| setting.description).collect()
}

/// Labels, explanations and limits of all settings.
pub(super) fn table() -> Vec<Setting<SpatialSettings>> {
    settings_table! { SpatialSettings:
        "Registration" {
            choice method: "Method", "Selects what a frame is registered to. Surfels need depth images; point clouds always use voxels.",
                [
                    "surfel_map" => "Surfels to map",
                    "cloud_map" => "Cloud to map",
                    "cloud_to_cloud" => "Cloud to previous cloud",
                    "course" => "Course pipeline",
                ];
            choice effort: "Effort", "Surfels: thorough registers about 3,000 points of a frame in the last step, quick about 1,200.",
                ["thorough" => "Thorough", "quick" => "Quick"];
            choice color: "Colours", "Surfels: texture constrains the position along flat walls. Its weight falls where the colours do not match, so that changing light does no harm.",
                [
                    "used" => "Used where they match",
                    "where_open" => "Where the geometry is degenerate",
                    "not_used" => "For the map only",
                ];
            choice loop_closing: "Loop closing", "Where the path returns to a known place, the accumulated drift is distributed over the loop (surfels, and clouds registered to their map).",
                ["on" => "On", "off" => "Off"];
            choice motion: "Motion", "Selects the degrees of freedom. On a floor: height and tilt stay as in the first frame.",
                ["free" => "Free", "planar" => "On a floor"];
            choice global_registration: "Global search", "Clouds: selects when features are matched without an initial guess. Global registration is slow, so it mostly serves doubtful frames.",
                ["when_doubtful" => "When doubtful", "always" => "Always", "never" => "Never"];
            choice metric: "Metric", "Clouds: selects the residual. Point to plane uses the normals of the target; GICP uses those of both clouds.",
                ["point_to_plane" => "Point to plane", "gicp" => "GICP"];
            number cloud_unit: "Unit", "Clouds: metres in a unit of their coordinates, 0.001 for millimetres. 0: told from the file and the size of the first cloud.",
                "m", [0.0, 1000.0], step 0.001;
            number voxel_size: "Voxel", "Clouds: side of the voxels, each reduced to one point. Outdoors 0.25 to 1 m, in rooms 0.02 to 0.1 m. 0: derived from the first cloud.",
                "m", [0.0, 10.0], step 0.01;
            number max_correspondence_distance: "Correspondence distance", "Clouds: largest distance between corresponding points. 0: three voxels.",
                "m", [0.0, 100.0], step 0.05;
        }
        "Camera" {
            number fx: "Focal length fx", "Horizontal focal length in pixels. 0: from the field of view.",
                "", [0.0, 1e5], step 1.0;
            number fy: "Focal length fy", "Vertical focal length in pixels; its sign does not count. 0: the same as fx.",
                "", [-1e5, 1e5], step 1.0;
            number cx: "Principal point cx", "Column of the principal point in pixels. 0: the middle of the image.",
                "", [0.0, 1e5], step 1.0;
            number cy: "Principal point cy", "Row of the principal point in pixels. 0: the middle of the image.",
                "", [0.0, 1e5], step 1.0;
            number field_of_view: "Field of view", "Horizontal field of view. 0: a RealSense's where the depth shows its steps, a Kinect's for other 16-bit images of 4 : 3, 90 degrees otherwise.",
                "rad", [0.0, 0.99 * PI], step 0.05;
        }
        "Depth" {
            number depth_scale: "Depth scale", "Raw values per metre: 1000 for millimetres, 5000 for TUM, 6553.5 for 16 bits over 10 m, 25.5 for 8 bits. 0: estimated from the first image.",
                "", [0.0, 1e6], step 1.0;
            choice depth_values: "Depth values", "What the images hold. Inverted: near is bright.",
                [
                    "told_from_data" => "Detected from the data",
                    "depth" => "Depth",
                    "swapped_bytes" => "Depth, low byte first",
                    "inverted" => "Inverted depth",
                ];
            choice quantisation: "Quantisation", "8-bit depth has steps of centimetres. Where depth was truncated to whole steps, the true depth lies half a step further on average.",
                ["told_from_data" => "Detected from the data", "truncated" => "Truncated", "rounded" => "Rounded"];
            number min_range: "Minimum depth", "Smaller depths are dropped.",
                "m", [0.0, 100.0], step 0.05;
            number max_range: "Maximum depth", "Points further away are dropped. 0: 10 m for depth images, no limit for clouds.",
                "m", [0.0, 1000.0], step 0.5;
        }
        "Map" {
            number max_height: "Map height", "Points higher than this above the first sensor are left out of the map: ceilings hide the floor plan.",
                "m", [-100.0, 1000.0], step 0.1;
            number map_voxel_size: "Map voxel", "Side of the map's voxels, each of which holds one point. 0: 2 cm for depth images, half the voxel of clouds.",
                "m", [0.0, 10.0], step 0.01;
        }
        "Ground truth" {
            choice reference_quaternions: "Quaternions", "Order of the quaternions in the ground truth, which serves for comparison only, never for the estimate.",
                [
                    "told_from_data" => "Detected from the data",
                    "real_part_last" => "qx qy qz qw",
                    "real_part_first" => "qw qx qy qz",
                ];
            choice reference_axes: "Camera axes", "Directions of the camera's axes in the ground truth.",
                [
                    "told_from_data" => "Detected from the data",
                    "opencv" => "x right, y down, z forward",
                    "opengl" => "x right, y up, z backward",
                    "robotics" => "x forward, y left, z up",
                ];
            choice reference_direction: "Direction", "Transformation that a ground-truth pose gives: mostly from camera to world coordinates.",
                [
                    "told_from_data" => "Detected from the data",
                    "sensor_to_world" => "Camera to world",
                    "world_to_sensor" => "World to camera",
                ];
        }
    }
}
