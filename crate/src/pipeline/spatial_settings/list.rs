//! The settings in space in the order of the page, and sets of them for one purpose.

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
            explanation: "Each frame against the map of all before it; every result is checked before it is believed. The default.",
            settings: SpatialSettings::default(),
        },
        Preset {
            name: "course",
            label: "Course pipeline",
            explanation: "As courses teach it with Open3D: voxels of 5 cm, FPFH, RANSAC, point-to-plane ICP, each frame with the one before it.",
            settings: SpatialSettings {
                method: Method::Course,
                // Courses take the raw value for the depth, whatever it is.
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
            explanation: "Fewer points, and fewer places where a frame is looked for, unless that is doubtful; a map of 5 cm.",
            settings: SpatialSettings { effort: Effort::Quick, map_voxel_size: 0.05, ..SpatialSettings::default() },
        },
    ]
}

/// Every setting, in the order of the page.
pub fn spatial_descriptions() -> Vec<SettingDescription> {
    table().into_iter().map(|setting| setting.description).collect()
}

/// Where limits, labels and values stand.
pub(super) fn table() -> Vec<Setting<SpatialSettings>> {
    settings_table! { SpatialSettings:
        "Registration" {
            choice method: "Method", "What a frame is matched with. Surfaces in depth images are known best; clouds of other sensors use voxels in any case.",
                [
                    "surfel_map" => "Surfaces with the map",
                    "cloud_map" => "Cloud with the map",
                    "cloud_to_cloud" => "Cloud with the one before",
                    "course" => "Course pipeline",
                ];
            choice effort: "Search", "Surfaces: thorough looks for every frame in hundreds of places, quick in a few dozen unless that is doubtful.",
                ["thorough" => "Thorough", "quick" => "Quick"];
            choice color: "Colours", "Surfaces: what is painted on walls tells where along them the camera is. Colours count by how well they fit, so that changing light does no harm.",
                [
                    "used" => "Used where they fit",
                    "where_open" => "Where surfaces leave it open",
                    "not_used" => "For the map only",
                ];
            choice loop_closing: "Loops", "Surfaces: where the path comes back to a place and does not quite meet it, the error is spread over the way round.",
                ["on" => "Closed", "off" => "Left as they are"];
            choice motion: "Motion", "Free, or on a floor with a level sensor: then height and tilt stay as they were in the first frame.",
                ["free" => "Free", "planar" => "On a floor"];
            choice global_registration: "Global search", "Clouds: features are matched over both clouds, without a first guess. Slow and sure, so mostly for doubtful frames.",
                ["when_doubtful" => "When doubtful", "always" => "Always", "never" => "Never"];
            choice metric: "Metric", "Clouds: point to plane lets walls slide along themselves; GICP knows surfaces on both sides.",
                ["point_to_plane" => "Point to plane", "gicp" => "GICP"];
            number voxel_size: "Voxel", "Clouds: one point is kept in a cube of this side. Outdoors 0.25 to 1 m, in rooms 0.02 to 0.1 m. 0: told from the first cloud.",
                "m", [0.0, 10.0], step 0.01;
            number max_correspondence_distance: "Pair distance", "Clouds: points further apart than this are no pair. 0: three voxels.",
                "m", [0.0, 100.0], step 0.05;
        }
        "Camera" {
            number fx: "Focal length", "Along the rows, in pixels. 0: from the field of view.",
                "", [0.0, 1e5], step 1.0;
            number fy: "Focal length, columns", "Along the columns, in pixels. 0: as along the rows.",
                "", [0.0, 1e5], step 1.0;
            number cx: "Optical axis, column", "In pixels; counts where a focal length is given.",
                "", [0.0, 1e5], step 1.0;
            number cy: "Optical axis, row", "In pixels; counts where a focal length is given.",
                "", [0.0, 1e5], step 1.0;
            number field_of_view: "Field of view", "The angle that a row of pixels spans. 0: a RealSense's where the depth shows its steps, a Kinect's for other 16-bit images of 4 : 3, 90 degrees otherwise.",
                "rad", [0.0, 0.99 * PI], step 0.05;
        }
        "Depth" {
            number depth_scale: "Depth scale", "Raw values a metre: 1000 for millimetres, 5000 for TUM, 6553.5 for 16 bits over 10 m, 25.5 for 8 bits. 0: estimated from the first image.",
                "", [0.0, 1e6], step 1.0;
            choice quantisation: "Rounding", "8-bit depth has steps of centimetres. Cut off to whole steps, the true depth lies half a step further.",
                ["told_from_data" => "Told from the data", "truncated" => "Cut off", "rounded" => "Rounded"];
            number min_range: "Nearest depth", "Nearer depths are dropped.",
                "m", [0.0, 100.0], step 0.05;
            number max_range: "Farthest depth", "Farther points are dropped. 0: beyond 10 m in depth images, nothing in clouds.",
                "m", [0.0, 1000.0], step 0.5;
        }
        "Map" {
            number max_height: "Height of the map", "What lies further above the first sensor is left out of the map: ceilings hide the floor plan.",
                "m", [-100.0, 1000.0], step 0.1;
            number map_voxel_size: "Map voxel", "The map holds one point in a cube of this side. 0: 2 cm, for clouds half their voxel.",
                "m", [0.0, 10.0], step 0.01;
        }
        "True poses" {
            choice reference_quaternions: "Quaternions", "How the file of true poses orders its quaternions. It is used to compare only, never to estimate.",
                [
                    "told_from_data" => "Told from the data",
                    "real_part_last" => "qx qy qz qw",
                    "real_part_first" => "qw qx qy qz",
                ];
            choice reference_axes: "Camera axes", "Where the camera's axes point in the file of true poses.",
                [
                    "told_from_data" => "Told from the data",
                    "opencv" => "x right, y down, z forward",
                    "opengl" => "x right, y up, z backward",
                    "robotics" => "x forward, y left, z up",
                ];
            choice reference_direction: "Direction", "What a true pose turns into what: mostly camera coordinates into those of the world.",
                [
                    "told_from_data" => "Told from the data",
                    "sensor_to_world" => "Camera to world",
                    "world_to_sensor" => "World to camera",
                ];
        }
    }
}
