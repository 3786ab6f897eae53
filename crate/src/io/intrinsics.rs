//! Intrinsics of a pinhole camera in a file.
//!
//! Read are a 3 x 3 matrix (numbers separated by blanks, commas or semicolons, row by row), four numbers `fx fy cx cy`, and
//! JSON with the fields `fx fy cx cy`, or `intrinsic_matrix` of nine numbers, column by column as Open3D writes it, or in
//! three rows; and with `depth_scale`, if it has that field.

use serde_json::Value;

use super::text::{quote, refuse_pointer_and_utf16};
use crate::{Error, Result};

const REMEDY: &str = "Give a matrix fx 0 cx 0 fy cy 0 0 1, or fx fy cx cy, in pixels";

/// What a file says of a camera of depth images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Focal length along the rows (pixels).
    pub fx: f64,
    /// Focal length along the columns (pixels).
    pub fy: f64,
    /// Column of the optical axis (pixels).
    pub cx: f64,
    /// Row of the optical axis (pixels).
    pub cy: f64,
    /// Raw depth values per metre.
    pub depth_scale: Option<f64>,
}

/// Reads a camera.
///
/// # Errors
/// When the file holds no camera.
pub fn read(bytes: &[u8]) -> Result<Intrinsics> {
    refuse_pointer_and_utf16(bytes)?;
    let text =
        std::str::from_utf8(bytes).map_err(|error| Error::byte(error.valid_up_to(), "This is not text", REMEDY))?;
    let text = text.trim_start_matches('\u{feff}').trim();
    let (numbers, depth_scale) = if text.starts_with('{') { from_json(text)? } else { (from_text(text)?, None) };
    match numbers[..] {
        [fx, fy, cx, cy] => Ok([fx, fy, cx, cy]),
        [fx, skew, cx, zero, fy, cy, last_a, last_b, one] => {
            let is_matrix = skew == 0.0 && zero == 0.0 && last_a == 0.0 && last_b == 0.0 && one == 1.0;
            if is_matrix { Ok([fx, fy, cx, cy]) } else { Err(Error::whole("This is not a camera matrix", REMEDY)) }
        }
        _ => Err(Error::whole(format!("The file holds {} numbers", numbers.len()), REMEDY)),
    }
    .and_then(|camera| {
        let [fx, fy, cx, cy] = camera;
        // Renderers with a left-handed world write fy below zero.
        let fy = fy.abs();
        if !(fx > 0.0 && fy > 0.0 && camera.iter().all(|value| value.is_finite())) {
            return Err(Error::whole(
                format!("fx = {fx}, fy = {fy}, cx = {cx}, cy = {cy} is not a valid camera"),
                REMEDY,
            ));
        }
        if let Some(scale) = depth_scale.filter(|scale| !(*scale > 0.0 && scale.is_finite())) {
            return Err(Error::whole(
                format!("depth_scale = {scale} is not positive"),
                "Give the number of raw depth values per metre",
            ));
        }
        Ok(Intrinsics { fx, fy, cx, cy, depth_scale })
    })
}

fn from_text(text: &str) -> Result<Vec<f64>> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.split('#').next().unwrap_or_default()));
    let words = lines.flat_map(|(number, line)| {
        line.split(|c: char| c.is_whitespace() || matches!(c, ',' | ';' | '[' | ']'))
            .filter(|word| !word.is_empty())
            .map(move |word| (number, word))
    });
    words
        .map(|(line, word)| {
            let problem = || Error::line(line, format!("{} is not a number", quote(word.as_bytes())), REMEDY);
            word.parse().map_err(|_| problem())
        })
        .collect()
}

fn from_json(text: &str) -> Result<(Vec<f64>, Option<f64>)> {
    let json: Value = serde_json::from_str(text)
        .map_err(|error| Error::line(error.line(), "The JSON is broken here", "Write the file again"))?;
    let depth_scale = json.get("depth_scale").and_then(Value::as_f64);
    if let Some(matrix) = json.get("intrinsic_matrix").and_then(Value::as_array) {
        let rows: Vec<f64> = matrix.iter().filter_map(Value::as_array).flatten().filter_map(Value::as_f64).collect();
        let flat: Vec<f64> = matrix.iter().filter_map(Value::as_f64).collect();
        let matrix = match flat[..] {
            // Column by column.
            [fx, a, b, c, fy, d, cx, cy, e] => vec![fx, c, cx, a, fy, cy, b, d, e],
            _ => rows,
        };
        return Ok((matrix, depth_scale));
    }
    let parameters: Result<Vec<f64>> = ["fx", "fy", "cx", "cy"]
        .map(|name| {
            let missing = || Error::whole(format!("The JSON has no number \"{name}\""), REMEDY);
            json.get(name).and_then(Value::as_f64).ok_or_else(missing)
        })
        .into_iter()
        .collect();
    Ok((parameters?, depth_scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_gives_the_camera() {
        let expected = Intrinsics { fx: 585.0, fy: 580.0, cx: 320.0, cy: 240.0, depth_scale: None };
        for text in [
            "585 0 320\n0 580 240\n0 0 1\n",
            "5.85e+02\t 0.0e+00\t 320\n 0 580 240\n 0 0 1",
            "# camera\n585, 580, 320, 240",
            "{\"fx\": 585, \"fy\": 580, \"cx\": 320.0, \"cy\": 240}",
            "{\"width\": 640, \"intrinsic_matrix\": [585, 0, 0, 0, 580, 0, 320, 240, 1]}",
            "{\"intrinsic_matrix\": [[585, 0, 320], [0, 580, 240], [0, 0, 1]]}",
        ] {
            assert_eq!(read(text.as_bytes()), Ok(expected), "{text}");
        }
        let with_scale = br#"{"fx": 585, "fy": 580, "cx": 320, "cy": 240, "depth_scale": 5000}"#;
        assert_eq!(read(with_scale), Ok(Intrinsics { depth_scale: Some(5000.0), ..expected }));
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        let refused = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert!(refused("585 0 320\n0 abc 240\n0 0 1").contains("line 2: \"abc\" is not a number"));
        assert!(refused("1 2 3").contains("3 numbers"));
        assert!(refused("0 0 320\n0 580 240\n0 0 1").contains("not a valid camera"));
        assert!(refused("585 0 320\n0 580 240\n0 0 2").contains("not a camera matrix"));
        assert!(refused("{\"fx\": 585}").contains("\"fy\""));
        assert!(refused("{\"fx\": ").contains("line 1"));
        assert!(refused("585 580 NaN 240").contains("not a valid camera"));
        assert!(refused(r#"{"fx": 1, "fy": 1, "cx": 1, "cy": 1, "depth_scale": -1}"#).contains("depth_scale = -1"));
        assert!(refused("").contains("0 numbers"));
    }
}
