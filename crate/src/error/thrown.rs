//! An error as JavaScript catches it.

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
