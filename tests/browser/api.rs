//! The API as JavaScript meets it: what is thrown, what comes back.

use js_sys::{Array, Error, Reflect};
use scanstitch_wasm::{PointCloud, Reconstruction, describe_settings, presets};
use wasm_bindgen::{JsCast, JsValue};
use wasm_bindgen_test::wasm_bindgen_test;

fn field(object: &JsValue, name: &str) -> JsValue {
    Reflect::get(object, &name.into()).expect("an object")
}

#[wasm_bindgen_test]
fn clouds_come_back_as_they_were_given() {
    let cloud = PointCloud::from_positions(&[1.0, 2.0, 0.0, 3.5, 4.0, -0.0], None).expect("two points");
    assert_eq!(cloud.length(), 2);
    assert!(cloud.is_planar());
    let ply = cloud.to_ply(JsValue::from("ascii").unchecked_ref()).expect("a format");
    let back = PointCloud::from_ply(&ply, "back.ply").expect("its own file");
    assert_eq!(back.positions(), cloud.positions());
    assert_eq!(back.normals(), None);
}

#[wasm_bindgen_test]
fn what_is_thrown_names_file_place_problem_and_remedy() {
    let bytes = include_bytes!("../data/cut_off.ply");
    let thrown = PointCloud::from_ply(bytes, "cut_off.ply").err().expect("the file is cut off");
    let error: &Error = thrown.dyn_ref().expect("an Error");
    assert_eq!(String::from(error.name()), "ScanstitchError");
    assert_eq!(field(&thrown, "file").as_string().as_deref(), Some("cut_off.ply"));
    assert!(field(&field(&thrown, "place"), "line").as_f64().is_some_and(|line| line > 1.0));
    let message = String::from(error.message());
    for part in ["problem", "remedy"] {
        let text = field(&thrown, part).as_string().expect("a text");
        assert!(!text.is_empty() && message.contains(&text), "{part}: {text:?} in {message:?}");
    }
}

#[wasm_bindgen_test]
fn a_bad_scan_leaves_the_others_in_place() {
    let mut reconstruction = Reconstruction::new(None).expect("the default settings");
    let scan = asymmetric_room();
    reconstruction.add_scan("0.ply", &scan).expect("a sound scan");
    assert!(reconstruction.add_scan("bad.ply", b"not a scan").is_err());
    reconstruction.add_scan("1.ply", &scan).expect("a sound scan");
    let mut stage = String::new();
    for _ in 0..1000 {
        let progress = JsValue::from(reconstruction.step().expect("a step"));
        stage = field(&progress, "stage").as_string().expect("a stage");
        if stage == "done" {
            break;
        }
    }
    assert_eq!(stage, "done");
    let result = JsValue::from(reconstruction.result().expect("a result"));
    assert_eq!(Array::from(&field(&result, "frames")).length(), 2);
    assert_eq!(reconstruction.map_points(None).len(), 2 * reconstruction.map_frames().len());
    assert_eq!(reconstruction.trajectory_matrices().len(), 2);
}

/// A scan of 90 returns in a room of 5 x 3 m, seen off its middle.
fn asymmetric_room() -> Vec<u8> {
    let points: Vec<f32> = (0_u8..90)
        .map(|beam| (2.0 * f32::from(beam)).to_radians())
        .flat_map(|angle| {
            let (sin, cos) = angle.sin_cos();
            let along = if cos > 0.0 { 3.0 } else { -2.0 } / cos;
            let range = along.min(2.0 / sin);
            [range * cos, range * sin, 0.0]
        })
        .collect();
    let cloud = PointCloud::from_positions(&points, None).expect("whole points");
    cloud.to_ply(JsValue::from("binary_little_endian").unchecked_ref()).expect("a format")
}

#[wasm_bindgen_test]
fn every_preset_and_setting_is_described() {
    assert!(describe_settings().expect("plain data").len() >= 15);
    assert!(presets().expect("plain data").len() >= 2);
}
