//! What a binding throws: an error of the engine, or an exception of JavaScript itself.

use js_sys::{Object, Reflect};
use scanstitch::error::{Error, Place};
use wasm_bindgen::prelude::*;

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

/// What is thrown.
#[derive(Debug)]
pub enum Thrown {
    /// An error of the engine, as a `ScanstitchError`.
    Engine(Error),
    /// An exception of JavaScript, as it is.
    JavaScript(JsValue),
}

impl From<Error> for Thrown {
    fn from(error: Error) -> Self {
        Self::Engine(error)
    }
}

impl From<JsValue> for Thrown {
    fn from(exception: JsValue) -> Self {
        Self::JavaScript(exception)
    }
}

impl From<Thrown> for JsValue {
    fn from(thrown: Thrown) -> Self {
        match thrown {
            Thrown::Engine(error) => exception(&error),
            Thrown::JavaScript(exception) => exception,
        }
    }
}

fn exception(error: &Error) -> JsValue {
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

fn number_field(name: &str, value: usize) -> JsValue {
    let object = Object::new();
    set(&object, name, &JsValue::from_f64(value as f64));
    object.into()
}

/// Setting a field of a fresh object cannot fail.
pub(crate) fn set(object: &Object, name: &str, value: &JsValue) {
    let _ = Reflect::set(object, &JsValue::from_str(name), value);
}
