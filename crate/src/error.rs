//! What went wrong, where, and what would be right.

use std::fmt;

/// Result of everything in this crate that can be given bad input.
pub type Result<T> = std::result::Result<T, Error>;

/// Where in an input the fault lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The input as a whole.
    Whole,
    /// A line of a text file, counted from 1.
    Line(usize),
    /// A byte, counted from 0.
    Byte(usize),
}

/// Bad input: the file, the place in it, what is wrong and what would be right.
///
/// Not converging is no error: a registration says so in its result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// Name of the file, when the input came from one. Set by the layer that knows it, with [`Error::in_file`].
    pub file: Option<String>,
    /// Where in the file.
    pub place: Place,
    /// What is wrong, with the offending value: "vertex 17 of 180 is cut off".
    pub problem: String,
    /// What the user can do: "export the file again". Empty where nothing more can be said.
    pub remedy: String,
}

impl Error {
    /// An error about the input as a whole.
    pub fn whole(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::at(Place::Whole, problem, remedy)
    }

    /// An error at a line of a text, counted from 1.
    pub fn line(line: usize, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::at(Place::Line(line), problem, remedy)
    }

    /// An error at a byte offset, counted from 0.
    pub fn byte(offset: usize, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::at(Place::Byte(offset), problem, remedy)
    }

    /// An error that the parser of JSON found, at its line.
    pub(crate) fn json(error: &serde_json::Error, remedy: impl Into<String>) -> Self {
        // The parser's message ends with the position, which `place` has.
        let text = error.to_string();
        let problem = text.split(" at line ").next().unwrap_or(&text);
        let place = if error.line() > 0 { Place::Line(error.line()) } else { Place::Whole };
        Self::at(place, problem, remedy)
    }

    fn at(place: Place, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { file: None, place, problem: problem.into(), remedy: remedy.into() }
    }

    /// The same error with the name of the file it was found in.
    #[must_use]
    pub fn in_file(mut self, file: &str) -> Self {
        self.file = Some(file.to_owned());
        self
    }
}

/// One sentence or two: `scan.ply, line 12: "abc" is not a number. Write x, y and z as decimal numbers.`
impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = match self.place {
            Place::Whole => String::new(),
            Place::Line(line) => format!("line {line}"),
            Place::Byte(offset) => format!("byte {offset}"),
        };
        let separator = if self.file.is_some() && !place.is_empty() { ", " } else { "" };
        let located = format!("{}{separator}{place}", self.file.as_deref().unwrap_or_default());
        if !located.is_empty() {
            write!(f, "{located}: ")?;
        }
        write!(f, "{}.", self.problem)?;
        if !self.remedy.is_empty() {
            write!(f, " {}.", self.remedy)?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}

/// An error as JavaScript catches it.
#[cfg(target_arch = "wasm32")]
mod thrown {
    use js_sys::{Object, Reflect};
    use wasm_bindgen::prelude::*;

    use super::{Error, Place};

    #[wasm_bindgen(typescript_custom_section)]
    const TYPES: &str = "
/** Every error that the engine throws. */
export interface ScanstitchError extends Error {
  name: 'ScanstitchError';
  file: string | null;
  place: { line: number } | { byte: number } | null;
  problem: string;
  remedy: string;
}
";

    /// The JavaScript exception of an error.
    impl From<Error> for JsValue {
        fn from(error: Error) -> Self {
            let place = match error.place {
                Place::Whole => JsValue::NULL,
                Place::Line(line) => number_field("line", line),
                Place::Byte(offset) => number_field("byte", offset),
            };
            let thrown = js_sys::Error::new(&error.to_string());
            thrown.set_name("ScanstitchError");
            let file = error.file.as_deref().map_or(JsValue::NULL, JsValue::from_str);
            let fields = [
                ("file", file),
                ("place", place),
                ("problem", error.problem.as_str().into()),
                ("remedy", error.remedy.as_str().into()),
            ];
            for (name, value) in fields {
                set(&thrown, name, &value);
            }
            thrown.into()
        }
    }

    fn number_field(name: &str, value: usize) -> JsValue {
        let object = Object::new();
        set(&object, name, &JsValue::from_f64(value as f64));
        object.into()
    }

    /// Setting a field of a fresh object cannot fail.
    fn set(object: &Object, name: &str, value: &JsValue) {
        let _ = Reflect::set(object, &JsValue::from_str(name), value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_names_file_place_problem_and_remedy() {
        let error = Error::line(12, "\"abc\" is not a number", "Write x, y and z as decimal numbers");
        assert_eq!(error.to_string(), "line 12: \"abc\" is not a number. Write x, y and z as decimal numbers.");
        assert_eq!(
            error.in_file("scan.ply").to_string(),
            "scan.ply, line 12: \"abc\" is not a number. Write x, y and z as decimal numbers."
        );
        assert_eq!(Error::whole("The file is empty", "").to_string(), "The file is empty.");
        assert_eq!(Error::whole("The file is empty", "").in_file("a.ply").to_string(), "a.ply: The file is empty.");
    }
}
