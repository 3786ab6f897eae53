//! Conversions between the engine's values and JavaScript's: plain objects, names of formats, errors.

use js_sys::{JSON, Object, Reflect};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tsify::{Ts, Tsify};
use wasm_bindgen::prelude::*;

use crate::error::{Error, Place};
use crate::geometry::PointCloud as Cloud;
use crate::io::ply;

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

pub(super) fn read_ply(name: &str, bytes: &[u8]) -> Result<Cloud, JsValue> {
    Ok(ply::read(bytes).map_err(|error| error.in_file(name))?)
}

/// Options from a plain object, by way of its JSON: serde then names unknown fields and wrong types.
pub(super) fn from_object<T: DeserializeOwned + Default>(object: Option<JsValue>) -> Result<T, JsValue> {
    let Some(object) = object.filter(|value| !value.is_undefined() && !value.is_null()) else {
        return Ok(T::default());
    };
    let refused = |reason: String| {
        let problem = format!("The options are not valid: {reason}");
        JsValue::from(Error::whole(problem, "Give only the options that the documentation names"))
    };
    // Functions and symbols have no JSON.
    let json = JsValue::from(JSON::stringify(&object)?).as_string();
    let json = json.ok_or_else(|| refused("they are not a plain object".to_owned()))?;
    serde_json::from_str(&json).map_err(|error| refused(error.to_string()))
}

/// Plain data as a plain object. Only maps whose keys are no text have none, and no result holds such a map.
///
/// Functions that return it are declared to return a `Result`, whether or not an input can cause an error: Node 20 aborts
/// ("unreachable code", in V8's deoptimizer) when code that it has compiled calls a function that returns an object alone and takes
/// long. Seen with `step` on a log of 1,464 scans.
pub(super) fn plain<T: Tsify + Serialize>(data: &T) -> Ts<T> {
    data.into_ts().expect_throw("plain data")
}

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
pub(super) fn set(object: &Object, name: &str, value: &JsValue) {
    let _ = Reflect::set(object, &JsValue::from_str(name), value);
}
