//! Mapped pixels as results and as tables.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::ROUNDING;
use crate::error::{Error, Result};

/// The visibility of a marked pixel in the other view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevStatus {
    /// The other image shows it.
    Visible,
    /// It is in front of the other camera, but outside its image.
    OutsideImage,
    /// It is behind the other camera.
    BehindCamera,
    /// The marked pixel looks at or above the horizon: it sees no ground.
    NoGround,
}

/// A marked pixel and its projection into the other view.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct BevPoint {
    /// The pixel that was marked.
    pub marked: [f64; 2],
    /// The point of the ground that it sees (m, in the world of the scene).
    pub ground: Option<[f64; 3]>,
    /// The pixel of the other camera, in its image or not; null behind it.
    pub projected: Option<[f64; 2]>,
    /// Its visibility.
    pub status: BevStatus,
}

/// Rounding of the projected pixels before they are reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum WholePixels {
    /// Nothing.
    #[default]
    Exact,
    /// The fraction is cut off, as `int()` does.
    Truncated,
    /// To the nearest whole number, halves away from zero.
    Rounded,
}

impl WholePixels {
    /// A coordinate, treated so.
    pub fn apply(self, coordinate: f64) -> f64 {
        let nearest = coordinate.round();
        let whole = match self {
            Self::Exact => return coordinate,
            // 386.9999999999999 must not become 386.
            Self::Truncated if (coordinate - nearest).abs() > ROUNDING => coordinate.trunc(),
            Self::Truncated | Self::Rounded => nearest,
        };
        whole + 0.0 // no negative zero
    }
}

impl BevPoint {
    /// The same point with its projected pixel treated so.
    #[must_use]
    pub fn in_whole_pixels(mut self, whole: WholePixels) -> Self {
        self.projected = self.projected.map(|pixel| pixel.map(|coordinate| whole.apply(coordinate)));
        self
    }
}

/// The points as CSV with a header; `marked` and `projected` are the names of the two views, `top` and `front` or `front` and
/// `top`. Missing values are empty.
pub fn points_csv(points: &[BevPoint], marked: &str, projected: &str) -> String {
    let mut text = format!("number,{marked}_u,{marked}_v,x,y,z,{projected}_u,{projected}_v,status\n");
    for (index, point) in points.iter().enumerate() {
        let [u, v] = point.marked;
        let joined = |values: Option<Vec<f64>>, count: usize| {
            values.map_or_else(
                || ",".repeat(count - 1),
                |values| values.iter().map(ToString::to_string).collect::<Vec<_>>().join(","),
            )
        };
        let ground = joined(point.ground.map(Vec::from), 3);
        let pixel = joined(point.projected.map(Vec::from), 2);
        let status = match point.status {
            BevStatus::Visible => "visible",
            BevStatus::OutsideImage => "outside_image",
            BevStatus::BehindCamera => "behind_camera",
            BevStatus::NoGround => "no_ground",
        };
        let _ = writeln!(text, "{},{u},{v},{ground},{pixel},{status}", index + 1);
    }
    text
}

/// Pixels from a table: a line each, numbers separated by commas, semicolons, tabs or spaces, `#` before a comment. The first
/// line may name the columns: then those called `u` and `v` (or `x` and `y`, or `top_u` and `top_v`, ...) count, in
/// `columns` order; without names, the first ones.
///
/// # Errors
/// When a line lacks a number or has a word in its place, when a named column is missing, or when there is no line.
pub fn read_pixels<const N: usize>(bytes: &[u8], columns: [&[&str]; N]) -> Result<Vec<[f64; N]>> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        Error::byte(error.valid_up_to(), "This is not text", "Give a table of pixels, a line each: 120, 340")
    })?;
    let mut rows = Vec::new();
    let mut places: Option<[usize; N]> = None;
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let cells = cells_of(line);
        if places.is_none() {
            let named = cells.iter().any(|cell| cell.parse::<f64>().is_err());
            places = Some(if named { named_places(&cells, columns, index + 1)? } else { std::array::from_fn(|i| i) });
            if named {
                continue;
            }
        }
        let places = places.unwrap_or_else(|| std::array::from_fn(|i| i));
        let mut row = [0.0; N];
        for (value, place) in row.iter_mut().zip(places) {
            let cell = cells.get(place).copied().unwrap_or_default();
            *value = cell.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| {
                let problem = if cell.is_empty() {
                    format!("The line has {} of {N} numbers", cells.len().min(N))
                } else {
                    format!("\"{cell}\" is not a number")
                };
                Error::line(index + 1, problem, format!("Write {N} decimal numbers with points, a line for each point"))
            })?;
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(Error::whole("The table has no points", "Write a line for each point: 120, 340"));
    }
    Ok(rows)
}

/// Cells of a line. Commas, semicolons and tabs separate cells, which may be empty; in a line without any, spaces do.
fn cells_of(line: &str) -> Vec<&str> {
    if line.contains([',', ';', '\t']) {
        line.split([',', ';', '\t']).map(|cell| cell.trim().trim_matches('"')).collect()
    } else {
        line.split_whitespace().collect()
    }
}

fn named_places<const N: usize>(names: &[&str], columns: [&[&str]; N], line: usize) -> Result<[usize; N]> {
    let mut places = [0; N];
    for (place, wanted) in places.iter_mut().zip(columns) {
        let found = wanted.iter().find_map(|name| names.iter().position(|cell| cell.eq_ignore_ascii_case(name)));
        *place = found.ok_or_else(|| {
            let problem = format!("No column is called {}; there are: {}", wanted.join(" or "), names.join(", "));
            Error::line(line, problem, "Name the columns so, or leave the line of names away")
        })?;
    }
    Ok(places)
}

/// Names that columns of points may have.
pub const POINT_COLUMNS: [&[&str]; 2] = [&["u", "top_u", "x", "column"], &["v", "top_v", "y", "row"]];
/// Names that columns of points marked in the front view may have.
pub const FRONT_POINT_COLUMNS: [&[&str]; 2] = [&["u", "front_u", "x", "column"], &["v", "front_v", "y", "row"]];
/// Names that columns of point pairs may have.
pub const PAIR_COLUMNS: [&[&str]; 4] = [&["top_u"], &["top_v"], &["front_u"], &["front_v"]];
