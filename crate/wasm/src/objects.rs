//! Conversions between the engine's values and JavaScript's: plain objects, names of formats, errors.

use js_sys::JSON;
use serde::Serialize;
use serde::de::DeserializeOwned;
use tsify::{Ts, Tsify};
use wasm_bindgen::prelude::*;

use scanstitch::error::Error;
use scanstitch::geometry::PointCloud as Cloud;
use scanstitch::io::ply;

pub(crate) fn read_ply(name: &str, bytes: &[u8]) -> Result<Cloud, JsValue> {
    Ok(ply::read(bytes).map_err(|error| error.in_file(name))?)
}

/// Options from a plain object, by way of its JSON: serde then names unknown fields and wrong types.
pub(crate) fn from_object<T: DeserializeOwned + Default>(object: Option<JsValue>) -> Result<T, JsValue> {
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
pub(crate) fn plain<T: Tsify + Serialize>(data: &T) -> Ts<T> {
    data.into_ts().expect_throw("plain data")
}
