//! The whole run in the browser, on the samples that the page opens with.

use js_sys::{JSON, Object, Reflect};
use scanstitch_wasm::Reconstruction;
use wasm_bindgen::JsValue;
use wasm_bindgen_test::wasm_bindgen_test;

macro_rules! sample {
    ($name:literal) => {
        ($name, include_bytes!(concat!("../../www/samples/corridor/", $name)).as_slice())
    };
}

const SCANS: [(&str, &[u8]); 10] = [
    sample!("0.ply"),
    sample!("1.ply"),
    sample!("2.ply"),
    sample!("3.ply"),
    sample!("4.ply"),
    sample!("5.ply"),
    sample!("6.ply"),
    sample!("7.ply"),
    sample!("8.ply"),
    sample!("9.ply"),
];

/// The member of the value at the end of this path.
fn at(value: &JsValue, path: &[&str]) -> JsValue {
    path.iter().fold(value.clone(), |value, name| Reflect::get(&value, &(*name).into()).expect("an object"))
}

fn reconstruct() -> Reconstruction {
    let mut reconstruction = Reconstruction::new(None).expect("the default settings");
    for (name, bytes) in SCANS {
        reconstruction.add_scan(name, bytes).expect("a sound scan");
    }
    let (name, truth) = sample!("truth.tum");
    reconstruction.set_reference(name, truth).expect("a sound trajectory");
    while at(&reconstruction.step().expect("a step").into(), &["stage"]) != "done" {}
    reconstruction
}

#[wasm_bindgen_test]
fn the_samples_come_out_within_15_mm_of_the_truth() {
    let result = JsValue::from(reconstruct().result().expect("a result"));
    let matched = at(&result, &["comparison", "num_matched"]).as_f64();
    assert_eq!(matched, Some(10.0));
    let mean = at(&result, &["comparison", "mean"]).as_f64().expect("a distance");
    assert!(mean <= 0.015, "mean distance to the truth {mean} m");
}

#[wasm_bindgen_test]
fn the_report_says_what_the_result_says() {
    let reconstruction = reconstruct();
    let result = JsValue::from(reconstruction.result().expect("a result"));
    let report = JSON::parse(&reconstruction.report_json()).expect("JSON");
    let text = |value: &JsValue| String::from(JSON::stringify(value).expect("plain data"));
    assert!(Object::keys(&Object::from(result.clone())).length() > 3);
    assert_eq!(text(&report), text(&result));
}
