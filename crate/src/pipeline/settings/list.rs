//! The settings of a planar reconstruction in the order of the page, and presets.

use std::f64::consts::PI;

use super::description::{Preset, Setting, SettingDescription, settings_table};
use super::{InitialGuess, PlanarMetric, Settings, Strategy};
use crate::registration::robust_kernel::RobustKernel;

/// The presets; the first is the default.
pub fn presets() -> Vec<Preset<Settings>> {
    vec![
        Preset {
            name: "sharpest",
            label: "Sharpest map",
            explanation: "Registers every scan to its neighbours and optimises all poses jointly. The default.",
            settings: Settings::default(),
        },
        Preset {
            name: "scan_to_map",
            label: "Scan to map",
            explanation: "Registers each scan to the last few in a single pass, as a robot does online.",
            settings: Settings { strategy: Strategy::ScanToMap, ..Settings::default() },
        },
        Preset {
            name: "homework",
            label: "Homework ICP",
            explanation: "Point-to-point ICP of each scan to the previous one, started from the last motion: the textbook method.",
            settings: Settings {
                strategy: Strategy::ScanToScan,
                initial_guess: InitialGuess::ConstantVelocity,
                metric: PlanarMetric::PointToPoint,
                robust_kernel: RobustKernel::None,
                trim_fraction: 0.1,
                max_correspondence_distance: 1.0,
                max_iterations: 100,
                ..Settings::default()
            },
        },
    ]
}

/// Every setting, in the order of the page.
pub fn descriptions() -> Vec<SettingDescription> {
    table().into_iter().map(|setting| setting.description).collect()
}

/// Labels, explanations and limits of all settings.
pub(super) fn table() -> Vec<Setting<Settings>> {
    settings_table! { Settings:
        "Chain" {
            choice strategy: "Strategy", "Selects what a scan is registered to. Joint also optimises all poses together at the end, so that drift does not accumulate.",
                ["joint" => "Joint", "scan_to_map" => "Scan to map", "scan_to_scan" => "Scan to scan"];
            integer local_map_scans: "Local map", "Number of earlier scans that a new scan is registered to.",
                [1, 100];
            integer matched_scans: "Matched scans", "Joint, fewer than 100 scans: each scan is matched with this many scans before it and, where the path returns to a place, with as many of the nearest there. 0: all pairs. Longer sequences choose their pairs themselves.",
                [0, 1000];
        }
        "Initial guess" {
            choice initial_guess: "Initial guess", "Selects the pose that ICP starts from. ICP converges to the nearest local minimum; a search beforehand avoids the wrong one.",
                [
                    "correlative" => "Search",
                    "constant_velocity" => "Constant velocity",
                    "identity" => "Last pose",
                ];
            choice odometry: "Odometry", "Selects the source of wheel odometry. Measured: the odometry file, or the log where its poses are raw wheel odometry rather than corrected by a program.",
                ["auto" => "Measured", "file" => "Odometry file only", "log" => "File or log", "none" => "Not used"];
            number wheel_track: "Wheel track", "Distance between the two wheels, for odometry that has their paths and no poses. 0: not known.",
                "m", [0.0, 10.0], step 0.01;
            number search_translation: "Search distance", "Largest distance from the predicted position, in x and in y, that the search covers.",
                "m", [0.1, 10.0], step 0.1;
            number search_rotation: "Search rotation", "Largest deviation from the predicted heading that the search covers.",
                "rad", [0.01, PI], step 0.05;
        }
        "Registration" {
            choice metric: "Metric", "Selects the residual. Point to line leaves sliding along a wall free, so it converges in fewer iterations.",
                ["point_to_line" => "Point to line", "point_to_point" => "Point to point"];
            number max_correspondence_distance: "Correspondence distance", "Largest distance between corresponding points. Larger values converge from worse guesses; smaller values reject more outliers.",
                "m", [0.01, 10.0], step 0.05;
            number max_normal_angle: "Normal angle", "Rejects correspondences whose normals differ by more than this angle.",
                "rad", [0.01, PI], step 0.05;
            number trim_fraction: "Trim fraction", "Fraction of the correspondences with the largest residuals that each iteration drops.",
                "", [0.0, 0.9], step 0.05;
            choice robust_kernel: "Robust kernel", "Selects how the weight of a correspondence falls with its residual.",
                [
                    "cauchy" => "Cauchy",
                    "huber" => "Huber",
                    "geman_mcclure" => "Geman-McClure",
                    "tukey" => "Tukey",
                    "none" => "None",
                ];
            number robust_kernel_width: "Kernel width", "Residual from which a correspondence loses weight: a few times the sensor's noise.",
                "m", [0.001, 5.0], step 0.01;
            integer max_iterations: "Iterations", "Largest number of ICP iterations.",
                [1, 1000];
            number rotation_eps: "Rotation tolerance", "ICP has converged when a step rotates by less than this and translates by less than the translation tolerance.",
                "rad", [1e-9, 0.1], step 1e-5;
            number translation_eps: "Translation tolerance", "ICP has converged when a step translates by less than this and rotates by less than the rotation tolerance.",
                "m", [1e-9, 0.1], step 1e-5;
        }
        "Scans" {
            number min_range: "Minimum range", "Nearer returns are dropped: they show the robot itself, or dust.",
                "m", [0.0, 100.0], step 0.05;
            number scan_unit: "Unit", "Metres in a unit of scans that are a file each, 0.001 for millimetres. 0: told from the first scan.",
                "m", [0.0, 1000.0], step 0.001;
            choice laser_direction: "Direction of readings", "Mirrored: for a laser that turns clockwise or hangs upside down, where the recording does not say so. The map is a mirror image otherwise.",
                ["as_recorded" => "As recorded", "mirrored" => "Mirrored"];
            number max_range: "Maximum range", "Returns at or beyond this range are dropped: many sensors report their limit for a beam without a return.",
                "m", [0.1, 1000.0], step 1.0;
        }
    }
}
