//! What a person needs to know of a setting: its name, unit, limits and what it is for.

use serde::Serialize;

use crate::error::{Error, Result};

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
    /// Field of the settings.
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
