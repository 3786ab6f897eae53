//! The metrics of registrations of planar scans, chosen at run time.

use serde::{Deserialize, Serialize};

/// The distance that a correspondence between planar scans measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum PlanarMetric {
    /// Distance to the nearest point.
    PointToPoint,
    /// Distance to the line through the nearest point.
    PointToLine,
}
