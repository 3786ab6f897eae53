//! All settings of a planar reconstruction: names, defaults, limits and explanations, for the page, the command line and
//! the API alike.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::preprocess::clean::RangeLimits;
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Weighting};
use crate::registration::robust_kernel::RobustKernel;

/// How scans are chained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Strategy {
    /// Each scan with the one before it.
    ScanToScan,
    /// Each scan with a local map of the scans before it.
    ScanToMap,
    /// As scan to map, then all poses together: each scan with the n before it.
    Joint,
}

/// What a registration starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum InitialGuess {
    /// Where the last scan was.
    Identity,
    /// The last motion once more.
    ConstantVelocity,
    /// The best pose in a window around constant velocity, by correlative search.
    Correlative,
}

/// Where measured motion between scans comes from, as a first guess.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum OdometrySource {
    /// From a file of its own, where one is given.
    File,
    /// From a file of its own, or else from the poses that the laser log holds.
    Log,
    /// From nowhere: scans alone.
    None,
}

/// What a correspondence measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum MetricName {
    /// Distance to the nearest point.
    PointToPoint,
    /// Distance to the line through the nearest point.
    PointToLine,
}

/// Settings of a planar reconstruction. The default works on whatever the samples and the homework's scans are like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Settings {
    /// Returns nearer than this are dropped (m).
    pub min_range: f64,
    /// Returns at or beyond this are dropped (m).
    pub max_range: f64,
    /// How scans are chained.
    pub strategy: Strategy,
    /// How many earlier scans form the local map.
    pub local_map_scans: usize,
    /// Joint: each scan is matched with the n before it and the n nearest before those; 0 means all.
    pub matched_scans: usize,
    /// What a registration starts from.
    pub initial_guess: InitialGuess,
    /// Where measured motion comes from; where there is some, it goes before `initial_guess`.
    pub odometry: OdometrySource,
    /// Half width of the correlative search in x and y (m).
    pub search_translation: f64,
    /// Half width of the correlative search in heading (rad).
    pub search_rotation: f64,
    /// What a correspondence measures.
    pub metric: MetricName,
    /// Pairs further apart are no correspondences (m).
    pub max_correspondence_distance: f64,
    /// Pairs whose normals differ by more are rejected (rad).
    pub max_normal_angle: f64,
    /// Share of the worst correspondences that is dropped.
    pub trim_fraction: f64,
    /// How far residuals count less.
    pub robust_kernel: RobustKernel,
    /// Residual at which the kernel sets in (m).
    pub robust_kernel_width: f64,
    /// Most iterations of a registration, and of the joint solution.
    pub max_iterations: usize,
    /// Converged when a step turns less (rad) and moves less than `translation_eps`.
    pub rotation_eps: f64,
    /// Converged when a step moves less (m) and turns less than `rotation_eps`.
    pub translation_eps: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            min_range: 0.05,
            max_range: 50.0,
            strategy: Strategy::Joint,
            local_map_scans: 5,
            matched_scans: 10,
            initial_guess: InitialGuess::Correlative,
            odometry: OdometrySource::File,
            search_translation: 1.5,
            search_rotation: 35f64.to_radians(),
            metric: MetricName::PointToLine,
            max_correspondence_distance: 0.5,
            max_normal_angle: 45f64.to_radians(),
            trim_fraction: 0.0,
            robust_kernel: RobustKernel::Cauchy,
            robust_kernel_width: 0.05,
            max_iterations: 50,
            rotation_eps: 1e-4,
            translation_eps: 1e-4,
        }
    }
}

impl Settings {
    /// Checks every value against the limits of its description.
    ///
    /// # Errors
    /// Names the first setting out of its limits, with the value and the limits.
    pub fn validate(&self) -> Result<()> {
        check_limits(&descriptions(), |name| self.number(name))?;
        if self.min_range >= self.max_range {
            return Err(Error::whole(
                format!("min_range = {} is not below max_range = {}", self.min_range, self.max_range),
                "Give a smaller min_range or a larger max_range",
            ));
        }
        Ok(())
    }

    /// The value of a numeric setting by its name; NaN for a choice.
    fn number(&self, name: &str) -> f64 {
        match name {
            "min_range" => self.min_range,
            "max_range" => self.max_range,
            "local_map_scans" => self.local_map_scans as f64,
            "matched_scans" => self.matched_scans as f64,
            "search_translation" => self.search_translation,
            "search_rotation" => self.search_rotation,
            "max_correspondence_distance" => self.max_correspondence_distance,
            "max_normal_angle" => self.max_normal_angle,
            "trim_fraction" => self.trim_fraction,
            "robust_kernel_width" => self.robust_kernel_width,
            "max_iterations" => self.max_iterations as f64,
            "rotation_eps" => self.rotation_eps,
            "translation_eps" => self.translation_eps,
            _ => f64::NAN,
        }
    }

    /// The range limits of the cleaning.
    pub fn range_limits(&self) -> RangeLimits {
        RangeLimits { min_range: self.min_range, max_range: self.max_range }
    }

    /// How many scans the local map holds.
    pub fn map_capacity(&self) -> usize {
        if self.strategy == Strategy::ScanToScan { 1 } else { self.local_map_scans }
    }

    /// The options of the registration loop.
    pub fn icp_options(&self) -> IcpOptions {
        IcpOptions {
            rejection: Rejection {
                max_correspondence_distance: self.max_correspondence_distance,
                max_normal_angle: self.max_normal_angle,
                trim_fraction: self.trim_fraction,
            },
            weighting: Weighting { robust_kernel: self.robust_kernel, robust_kernel_width: self.robust_kernel_width },
            criteria: Criteria {
                max_iterations: self.max_iterations,
                rotation_eps: self.rotation_eps,
                translation_eps: self.translation_eps,
            },
        }
    }
}

/// What a setting may be.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum SettingKind {
    /// A number within limits.
    Number {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
        /// A step that makes sense by hand.
        step: f64,
    },
    /// A whole number within limits.
    Integer {
        /// Smallest value.
        min: u32,
        /// Largest value.
        max: u32,
    },
    /// One of a few names.
    Choice {
        /// The names with their labels.
        choices: Vec<Choice>,
    },
}

/// One value of a choice.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Choice {
    /// The value as the settings spell it.
    pub value: &'static str,
    /// What a person reads.
    pub label: &'static str,
}

/// What a person needs to know of a setting.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct SettingDescription {
    /// Field of [`Settings`].
    pub name: &'static str,
    /// What a person reads.
    pub label: &'static str,
    /// Heading it stands under.
    pub group: &'static str,
    /// `m`, `rad` or empty.
    pub unit: &'static str,
    /// One line on what it does and when to change it.
    pub explanation: &'static str,
    /// What it may be.
    pub kind: SettingKind,
}

impl SettingDescription {
    fn unit_suffix(&self) -> String {
        if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) }
    }
}

/// Settings for one purpose.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct Preset {
    /// Name on the command line.
    pub name: &'static str,
    /// What a person reads.
    pub label: &'static str,
    /// One line on what it is for.
    pub explanation: &'static str,
    /// Its settings.
    pub settings: Settings,
}

/// Checks the numeric settings among `descriptions`, whose values `value_of` tells by name.
///
/// # Errors
/// Names the first setting out of its limits, with the value and the limits.
pub(crate) fn check_limits(descriptions: &[SettingDescription], value_of: impl Fn(&str) -> f64) -> Result<()> {
    for description in descriptions {
        let value = value_of(description.name);
        let (min, max) = match description.kind {
            SettingKind::Number { min, max, .. } => (min, max),
            SettingKind::Integer { min, max } => (f64::from(min), f64::from(max)),
            SettingKind::Choice { .. } => continue,
        };
        if !(min..=max).contains(&value) {
            return Err(Error::whole(
                format!("{} = {value} is out of its limits", description.name),
                format!("Give a number from {min} to {max}{}", description.unit_suffix()),
            ));
        }
    }
    Ok(())
}

/// The presets; the first is the default.
pub fn presets() -> Vec<Preset> {
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
#[allow(clippy::too_many_lines)] // a list: one entry a setting
pub fn descriptions() -> Vec<SettingDescription> {
    vec![
        choice(
            "strategy",
            "Strategy",
            "Chain",
            "What a scan is matched with. Joint goes over all poses together at the end, so that errors do not add up.",
            &[("joint", "Joint"), ("scan_to_map", "Scan to map"), ("scan_to_scan", "Scan to scan")],
        ),
        integer("local_map_scans", "Local map", "Chain", "How many earlier scans a new scan is matched with.", 1, 100),
        integer(
            "matched_scans",
            "Matched scans",
            "Chain",
            "Joint: each scan is matched with this many before it, and as many near it where the path comes back. 0: all with all.",
            0,
            1000,
        ),
        choice(
            "initial_guess",
            "First guess",
            "First guess",
            "Where ICP starts. ICP finds the nearest fit, not the best: a search first keeps it from the wrong one.",
            &[("correlative", "Search"), ("constant_velocity", "Constant velocity"), ("identity", "Last pose")],
        ),
        choice(
            "odometry",
            "Odometry",
            "First guess",
            "Motion that the robot measured, as a first guess. The poses inside a laser log are often corrected ones: they are used only if asked for.",
            &[("file", "From its file"), ("log", "Also from the log"), ("none", "Never")],
        ),
        number(
            "search_translation",
            "Search distance",
            "First guess",
            "m",
            "How far from the predicted position the search looks, in x and y.",
            (0.1, 10.0, 0.1),
        ),
        number(
            "search_rotation",
            "Search turn",
            "First guess",
            "rad",
            "How far from the predicted heading the search looks.",
            (0.01, std::f64::consts::PI, 0.05),
        ),
        choice(
            "metric",
            "Metric",
            "Registration",
            "Point to line lets walls slide along themselves, so it needs fewer and better steps.",
            &[("point_to_line", "Point to line"), ("point_to_point", "Point to point")],
        ),
        number(
            "max_correspondence_distance",
            "Pair distance",
            "Registration",
            "m",
            "Points further apart than this are no pair. Larger finds home from further away, smaller trusts less.",
            (0.01, 10.0, 0.05),
        ),
        number(
            "max_normal_angle",
            "Normal angle",
            "Registration",
            "rad",
            "Pairs whose surfaces face directions further apart than this are rejected.",
            (0.01, std::f64::consts::PI, 0.05),
        ),
        number(
            "trim_fraction",
            "Trimmed share",
            "Registration",
            "",
            "Share of the worst pairs that is dropped in every iteration.",
            (0.0, 0.9, 0.05),
        ),
        choice(
            "robust_kernel",
            "Robust kernel",
            "Registration",
            "How pairs that fit badly lose weight.",
            &[
                ("cauchy", "Cauchy"),
                ("huber", "Huber"),
                ("geman_mcclure", "Geman-McClure"),
                ("tukey", "Tukey"),
                ("none", "None"),
            ],
        ),
        number(
            "robust_kernel_width",
            "Kernel width",
            "Registration",
            "m",
            "Residual at which pairs begin to lose weight: a few times the sensor's noise.",
            (0.001, 5.0, 0.01),
        ),
        integer("max_iterations", "Iterations", "Registration", "The most steps before ICP gives up.", 1, 1000),
        number(
            "rotation_eps",
            "Smallest turn",
            "Registration",
            "rad",
            "ICP has converged when a step turns less than this and moves less than the smallest move.",
            (1e-9, 0.1, 1e-5),
        ),
        number(
            "translation_eps",
            "Smallest move",
            "Registration",
            "m",
            "ICP has converged when a step moves less than this and turns less than the smallest turn.",
            (1e-9, 0.1, 1e-5),
        ),
        number(
            "min_range",
            "Nearest return",
            "Scans",
            "m",
            "Nearer returns are dropped: the robot itself, or dust.",
            (0.0, 100.0, 0.05),
        ),
        number(
            "max_range",
            "Range limit",
            "Scans",
            "m",
            "Returns at or beyond this are dropped: many sensors write their limit where nothing came back.",
            (0.1, 1000.0, 1.0),
        ),
    ]
}

pub(crate) fn number(
    name: &'static str,
    label: &'static str,
    group: &'static str,
    unit: &'static str,
    explanation: &'static str,
    (min, max, step): (f64, f64, f64),
) -> SettingDescription {
    SettingDescription { name, label, group, unit, explanation, kind: SettingKind::Number { min, max, step } }
}

pub(crate) fn integer(
    name: &'static str,
    label: &'static str,
    group: &'static str,
    explanation: &'static str,
    min: u32,
    max: u32,
) -> SettingDescription {
    SettingDescription { name, label, group, unit: "", explanation, kind: SettingKind::Integer { min, max } }
}

pub(crate) fn choice(
    name: &'static str,
    label: &'static str,
    group: &'static str,
    explanation: &'static str,
    choices: &[(&'static str, &'static str)],
) -> SettingDescription {
    let choices = choices.iter().map(|&(value, label)| Choice { value, label }).collect();
    SettingDescription { name, label, group, unit: "", explanation, kind: SettingKind::Choice { choices } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_described_once_and_every_preset_is_valid() {
        let fields = serde_json::to_value(Settings::default()).unwrap();
        let mut fields: Vec<String> = fields.as_object().unwrap().keys().cloned().collect();
        let mut described: Vec<String> = descriptions().iter().map(|d| d.name.to_owned()).collect();
        fields.sort();
        described.sort();
        assert_eq!(fields, described);
        for preset in presets() {
            preset.settings.validate().unwrap();
        }
        assert_eq!(presets()[0].settings, Settings::default());
    }

    #[test]
    fn every_choice_is_a_value_of_its_setting() {
        for description in descriptions() {
            let SettingKind::Choice { choices } = &description.kind else { continue };
            for choice in choices {
                let json = serde_json::json!({ description.name: choice.value });
                let settings: Settings = serde_json::from_value(json).unwrap();
                assert_eq!(serde_json::to_value(&settings).unwrap()[description.name], choice.value);
            }
        }
    }

    #[test]
    fn values_out_of_their_limits_are_named() {
        let error = Settings { trim_fraction: 1.5, ..Settings::default() }.validate().unwrap_err();
        assert!(error.to_string().contains("trim_fraction = 1.5"), "{error}");
        assert!(Settings { max_range: f64::NAN, ..Settings::default() }.validate().is_err());
        assert!(Settings { min_range: 60.0, ..Settings::default() }.validate().is_err());
        assert!(serde_json::from_str::<Settings>("{\"max_rnage\": 3}").is_err());
    }
}
