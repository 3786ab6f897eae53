//! Descriptions of settings for users: label, unit, limits and explanation; and their validation.

use serde::Serialize;

use crate::error::{Error, Result};

/// The type and the limits of a setting.
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
        /// Step of an input field.
        step: f64,
    },
    /// A whole number within limits.
    Integer {
        /// Smallest value.
        min: u32,
        /// Largest value.
        max: u32,
    },
    /// One of several values.
    Choice {
        /// The values with their labels.
        choices: Vec<Choice>,
    },
}

/// One value of a choice.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Choice {
    /// The value in the settings.
    pub value: &'static str,
    /// Its label on the page.
    pub label: &'static str,
}

/// Settings for one purpose.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct Preset<S> {
    /// Name on the command line.
    pub name: &'static str,
    /// Its label on the page.
    pub label: &'static str,
    /// Its purpose, in one line.
    pub explanation: &'static str,
    /// The settings.
    pub settings: S,
}

/// The description of a setting for users.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct SettingDescription {
    /// Field of the settings.
    pub name: &'static str,
    /// Its label on the page.
    pub label: &'static str,
    /// Heading of its group.
    pub group: &'static str,
    /// `m`, `rad` or empty.
    pub unit: &'static str,
    /// Its effect and when to change it, in one line.
    pub explanation: &'static str,
    /// Its type and limits.
    pub kind: SettingKind,
}

impl SettingDescription {
    fn unit_suffix(&self) -> String {
        if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) }
    }
}

/// A setting of `S`: its description, and the function that reads its value.
pub(crate) struct Setting<S> {
    pub(crate) description: SettingDescription,
    /// Reads a number; `None` for a choice, whose type excludes invalid values.
    pub(crate) value: Option<fn(&S) -> f64>,
}

/// Checks all numbers of `settings`.
///
/// # Errors
/// Names the first setting out of its limits, with the value and the limits.
pub(crate) fn check_limits<S>(table: &[Setting<S>], settings: &S) -> Result<()> {
    for Setting { description, value } in table {
        let Some(value) = value.map(|value| value(settings)) else { continue };
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

/// Refuses a smallest range that is not below the largest (m).
pub(crate) fn check_range(min_range: f64, max_range: f64) -> Result<()> {
    if min_range < max_range {
        return Ok(());
    }
    let problem = format!("min_range = {min_range} is not below max_range = {max_range}");
    Err(Error::whole(problem, "Give a smaller min_range or a larger max_range"))
}

/// The table of a struct's settings, as a `Vec<Setting<_>>`. A row has the setting's kind, the name of its field, which is its name
/// everywhere, its label, one line of explanation, and its values or limits:
///
/// - `choice field: "Label", "Explanation.", ["value" => "Label", ...];`
/// - `integer field: "Label", "Explanation.", [min, max];`
/// - `number field: "Label", "Explanation.", "unit", [min, max], step step;`
macro_rules! settings_table {
    ($S:ty: $($group:literal { $($rows:tt)* })*) => {{
        let mut table: Vec<$crate::pipeline::settings::description::Setting<$S>> = Vec::new();
        $($crate::pipeline::settings::description::settings_rows! { table $S, $group: $($rows)* })*
        table
    }};
}

/// The rows of one group, one by one.
macro_rules! settings_rows {
    ($table:ident $S:ty, $group:literal:) => {};
    ($table:ident $S:ty, $group:literal: choice $field:ident: $label:literal, $explanation:literal,
        [$($value:literal => $choice:literal),+ $(,)?]; $($rest:tt)*) => {
        // Names the field, so that a row without one does not compile.
        let _ = |settings: &$S| { let _ = &settings.$field; };
        $crate::pipeline::settings::description::settings_rows! { @push $table $S, $group, $field, $label, $explanation, "",
            Choice { choices: vec![$($crate::pipeline::settings::Choice { value: $value, label: $choice }),+] }, None }
        $crate::pipeline::settings::description::settings_rows! { $table $S, $group: $($rest)* }
    };
    ($table:ident $S:ty, $group:literal: integer $field:ident: $label:literal, $explanation:literal,
        [$min:literal, $max:literal]; $($rest:tt)*) => {
        $crate::pipeline::settings::description::settings_rows! { @push $table $S, $group, $field, $label, $explanation, "",
            Integer { min: $min, max: $max }, Some(|settings| settings.$field as f64) }
        $crate::pipeline::settings::description::settings_rows! { $table $S, $group: $($rest)* }
    };
    ($table:ident $S:ty, $group:literal: number $field:ident: $label:literal, $explanation:literal,
        $unit:literal, [$min:expr, $max:expr], step $step:expr; $($rest:tt)*) => {
        $crate::pipeline::settings::description::settings_rows! { @push $table $S, $group, $field, $label, $explanation, $unit,
            Number { min: $min, max: $max, step: $step }, Some(|settings| settings.$field) }
        $crate::pipeline::settings::description::settings_rows! { $table $S, $group: $($rest)* }
    };
    (@push $table:ident $S:ty, $group:literal, $field:ident, $label:literal, $explanation:literal, $unit:literal,
        $kind:ident $limits:tt, $value:expr) => {
        $table.push($crate::pipeline::settings::description::Setting::<$S> {
            description: $crate::pipeline::settings::SettingDescription {
                name: stringify!($field),
                label: $label,
                group: $group,
                unit: $unit,
                explanation: $explanation,
                kind: $crate::pipeline::settings::SettingKind::$kind $limits,
            },
            value: $value,
        });
    };
}

pub(crate) use {settings_rows, settings_table};

/// Checks a table of settings: every field has one row, every choice is a value of its field, and the defaults are within their
/// limits.
#[cfg(test)]
pub(crate) fn assert_describes_all<S>(table: &[Setting<S>])
where
    S: Default + Serialize + serde::de::DeserializeOwned,
{
    let fields = serde_json::to_value(S::default()).unwrap();
    let mut fields: Vec<&str> = fields.as_object().unwrap().keys().map(String::as_str).collect();
    let mut described: Vec<&str> = table.iter().map(|setting| setting.description.name).collect();
    fields.sort_unstable();
    described.sort_unstable();
    assert_eq!(fields, described);
    for Setting { description, value } in table {
        let SettingKind::Choice { choices } = &description.kind else {
            assert!(value.unwrap()(&S::default()).is_finite(), "{}", description.name);
            continue;
        };
        assert!(value.is_none());
        for choice in choices {
            let json = serde_json::json!({ description.name: choice.value });
            let settings: S = serde_json::from_value(json).unwrap();
            assert_eq!(serde_json::to_value(&settings).unwrap()[description.name], choice.value);
        }
    }
    check_limits(table, &S::default()).unwrap();
}
