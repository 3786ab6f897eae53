//! The settings of a planar reconstruction in the order of the page, and sets of them for one purpose.

use std::f64::consts::PI;

use super::description::{Preset, Setting, SettingDescription, settings_table};
use super::{InitialGuess, MetricName, Settings, Strategy};
use crate::registration::robust_kernel::RobustKernel;

/// The presets; the first is the default.
pub fn presets() -> Vec<Preset<Settings>> {
    vec![
        Preset {
            name: "sharpest",
            label: "Sharpest map",
            explanation: "Every scan against its neighbours, all poses solved together. The default.",
            settings: Settings::default(),
        },
        Preset {
            name: "scan_to_map",
            label: "Scan to map",
            explanation: "Each scan against the last few, one pass: what a robot can do while it drives.",
            settings: Settings { strategy: Strategy::ScanToMap, ..Settings::default() },
        },
        Preset {
            name: "homework",
            label: "Homework ICP",
            explanation: "Point-to-point ICP of each scan with the one before it, from the last motion: the textbook method.",
            settings: Settings {
                strategy: Strategy::ScanToScan,
                initial_guess: InitialGuess::ConstantVelocity,
                metric: MetricName::PointToPoint,
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

/// Where limits, labels and values stand.
pub(super) fn table() -> Vec<Setting<Settings>> {
    settings_table! { Settings:
        "Chain" {
            choice strategy: "Strategy", "What a scan is matched with. Joint goes over all poses together at the end, so that errors do not add up.",
                ["joint" => "Joint", "scan_to_map" => "Scan to map", "scan_to_scan" => "Scan to scan"];
            integer local_map_scans: "Local map", "How many earlier scans a new scan is matched with.",
                [1, 100];
            integer matched_scans: "Matched scans", "Joint: each scan is matched with this many before it, and as many near it where the path comes back. 0: all with all.",
                [0, 1000];
        }
        "First guess" {
            choice initial_guess: "First guess", "Where ICP starts. ICP finds the nearest fit, not the best: a search first keeps it from the wrong one.",
                [
                    "correlative" => "Search",
                    "constant_velocity" => "Constant velocity",
                    "identity" => "Last pose",
                ];
            choice odometry: "Odometry", "Motion that the robot measured. Measured: from its file, or from the log where its poses are the wheels' own and not corrected by a program.",
                ["auto" => "Measured", "file" => "From its file", "log" => "Also from the log", "none" => "Never"];
            number search_translation: "Search distance", "How far from the predicted position the search looks, in x and y.",
                "m", [0.1, 10.0], step 0.1;
            number search_rotation: "Search turn", "How far from the predicted heading the search looks.",
                "rad", [0.01, PI], step 0.05;
        }
        "Registration" {
            choice metric: "Metric", "Point to line lets walls slide along themselves, so it needs fewer and better steps.",
                ["point_to_line" => "Point to line", "point_to_point" => "Point to point"];
            number max_correspondence_distance: "Pair distance", "Points further apart than this are no pair. Larger finds home from further away, smaller trusts less.",
                "m", [0.01, 10.0], step 0.05;
            number max_normal_angle: "Normal angle", "Pairs whose surfaces face directions further apart than this are rejected.",
                "rad", [0.01, PI], step 0.05;
            number trim_fraction: "Trimmed share", "Share of the worst pairs that is dropped in every iteration.",
                "", [0.0, 0.9], step 0.05;
            choice robust_kernel: "Robust kernel", "How pairs that fit badly lose weight.",
                [
                    "cauchy" => "Cauchy",
                    "huber" => "Huber",
                    "geman_mcclure" => "Geman-McClure",
                    "tukey" => "Tukey",
                    "none" => "None",
                ];
            number robust_kernel_width: "Kernel width", "Residual at which pairs begin to lose weight: a few times the sensor's noise.",
                "m", [0.001, 5.0], step 0.01;
            integer max_iterations: "Iterations", "The most steps before ICP gives up.",
                [1, 1000];
            number rotation_eps: "Smallest turn", "ICP has converged when a step turns less than this and moves less than the smallest move.",
                "rad", [1e-9, 0.1], step 1e-5;
            number translation_eps: "Smallest move", "ICP has converged when a step moves less than this and turns less than the smallest turn.",
                "m", [1e-9, 0.1], step 1e-5;
        }
        "Scans" {
            number min_range: "Nearest return", "Nearer returns are dropped: the robot itself, or dust.",
                "m", [0.0, 100.0], step 0.05;
            number max_range: "Range limit", "Returns at or beyond this are dropped: many sensors write their limit where nothing came back.",
                "m", [0.1, 1000.0], step 1.0;
        }
    }
}
