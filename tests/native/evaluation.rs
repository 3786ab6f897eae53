//! Trajectory evaluation against evo's figures, and what it says of input that makes no sense.

use std::fs;
use std::path::Path;

use crate::common::shared_data;
use scanstitch::evaluation::alignment::Alignment;
use scanstitch::evaluation::evaluate::{ErrorMetric, Evaluation, EvaluationOptions, evaluate};
use scanstitch::io::trajectory::{Trajectory, read_lenient};
use serde_json::Value;

/// evo's figures and ours may differ by this share.
const RELATIVE: f64 = 1e-9;
/// An error smaller than this is rounding and nothing else: a few units in the last place of a rotation matrix.
const ROUNDING: f64 = 2e-14;

fn load(path: &Path) -> Trajectory {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    read_lenient(&bytes, None).unwrap_or_else(|error| panic!("{}: {error}", path.display())).trajectory
}

/// A value of evo's names for enumerations, as our own.
fn named<T: serde::de::DeserializeOwned>(name: &str) -> T {
    serde_json::from_value(Value::from(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn alignment_named(name: &str) -> Alignment {
    match name {
        "none" => Alignment::None,
        "-a" => Alignment::Se3,
        "-as" => Alignment::Sim3,
        "-s only" => Alignment::Scale,
        "origin" => Alignment::Origin,
        _ => panic!("{name} is no alignment"),
    }
}

/// The options that one of the oracle's keys tells of: `APE rotation_part`,
/// `RPE translation_part delta 1.0 meters rel_tol 0.1 all_pairs True`.
fn options_of(key: &str, base: EvaluationOptions) -> EvaluationOptions {
    let words: Vec<&str> = key.split(' ').collect();
    let mut options = EvaluationOptions { relation: named(words[1]), ..base };
    if words[0] == "RPE" {
        options.metric = ErrorMetric::Rpe;
        options.delta = words[3].parse().unwrap();
        options.delta_unit = named(words[4]);
        options.delta_tolerance = words[6].parse().unwrap();
        options.all_pairs = words[8] == "True";
        options.pairs_from_reference = words.get(10) == Some(&"True");
    }
    options
}

/// Compares one set of figures; returns the largest relative deviation.
fn compare(
    what: &str,
    expected: &Value,
    found: &Evaluation,
    faults: &mut Vec<String>,
    rounding: &mut Vec<String>,
) -> f64 {
    let mut worst: f64 = 0.0;
    let statistics = serde_json::to_value(found.summary.statistics).unwrap();
    let mut figures: Vec<(String, f64, f64)> = ["rmse", "mean", "median", "std", "min", "max", "sse"]
        .iter()
        .filter_map(|name| Some(((*name).to_owned(), expected[name].as_f64()?, statistics[name].as_f64()?)))
        .collect();
    assert!(figures.len() >= 3, "{what}: {expected}");
    for (index, value) in expected["first5"].as_array().into_iter().flatten().enumerate() {
        figures.push((format!("error {index}"), value.as_f64().unwrap(), found.errors[index]));
    }
    if let Some(n) = expected["n"].as_f64() {
        figures.push(("n".into(), n, found.errors.len() as f64));
    }
    for (name, expected, found) in figures {
        let deviation = if expected == found { 0.0 } else { (found - expected).abs() / expected.abs() };
        // An angle of nothing but the rounding of two equal rotations: no digit of it means anything.
        let is_rounding = deviation > RELATIVE && expected < ROUNDING && found < ROUNDING;
        if is_rounding {
            rounding.push(format!("{what} {name}"));
        } else {
            worst = worst.max(deviation);
        }
        if deviation > RELATIVE && !is_rounding {
            faults.push(format!("{what} {name}: {found:e} in place of {expected:e}, off by {deviation:e}"));
        }
    }
    worst
}

/// What comparing many cases found.
#[derive(Default)]
struct Tally {
    /// Sets of figures that were compared.
    compared: usize,
    /// Sets that evo refuses, and so do we.
    refused: usize,
    /// The largest relative deviation.
    worst: f64,
    faults: Vec<String>,
    /// Smallest errors that are rounding and cannot be compared.
    rounding: Vec<String>,
}

impl Tally {
    fn add(&mut self, case: &Value, folder: &Path) {
        let name = |key: &str| case[key].as_str().unwrap();
        let (reference, estimate) = (load(&folder.join(name("ref"))), load(&folder.join(name("est"))));
        let (align, align_first) = match name("align").rsplit_once(" 20") {
            Some((align, "")) => (align, 20),
            _ => (name("align"), 0),
        };
        let base = EvaluationOptions {
            alignment: alignment_named(align),
            align_first,
            max_diff: case["max_diff"].as_f64().unwrap_or(0.01),
            offset: case["offset"].as_f64().unwrap_or(0.0),
            ..EvaluationOptions::default()
        };
        for (key, expected) in case["results"].as_object().unwrap() {
            let what = format!("{} {} {key}", name("est"), name("align"));
            match (evaluate(&reference, &estimate, &options_of(key, base)), expected.get("error")) {
                (Ok(found), None) => {
                    assert_eq!(found.summary.num_matched as u64, case["num_pairs"].as_u64().unwrap(), "{what}");
                    let deviation = compare(&what, expected, &found, &mut self.faults, &mut self.rounding);
                    self.worst = self.worst.max(deviation);
                    self.compared += 1;
                }
                (Err(_), Some(_)) => self.refused += 1,
                (Ok(_), Some(_)) => self.faults.push(format!("{what}: evo refuses, we do not")),
                (Err(error), None) => self.faults.push(format!("{what}: {error}")),
            }
        }
        let found = evaluate(&reference, &estimate, &base).unwrap().summary;
        let mut figures = vec![
            ("path of the reference", &case["path_length_ref"], found.path_length_reference),
            ("path of the estimate", &case["path_length_est_after_align"], found.path_length_estimate),
        ];
        let fit = &case["alignment"];
        if fit.is_object() {
            figures.push(("scale", &fit["s"], found.alignment.scale));
        }
        if fit.is_object() && base.alignment != Alignment::Scale {
            for axis in 0..3 {
                let off = (fit["t"][axis].as_f64().unwrap() - found.alignment.translation[axis]).abs();
                assert!(off < 1e-10, "{}: translation is off by {off}", name("est"));
                for column in 0..3 {
                    let expected = fit["R"][axis][column].as_f64().unwrap();
                    assert!((expected - found.alignment.rotation[axis][column]).abs() < 1e-12);
                }
            }
        }
        for (what, expected, found) in figures {
            let expected = expected.as_f64().unwrap();
            assert!((found - expected).abs() <= RELATIVE * expected, "{}: {what} {found} {expected}", name("est"));
        }
    }

    /// Fails where anything differs.
    fn check(&self, path: &Path) {
        let Self { compared, refused, worst, faults, rounding } = self;
        println!("{}: {compared} sets of figures compared, {refused} refused as evo does", path.display());
        println!("largest relative deviation {worst:e}; smallest errors that are rounding: {rounding:#?}");
        assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    }
}

fn tally(path: &Path) -> Tally {
    let oracle: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    let mut tally = Tally::default();
    for case in oracle["cases"].as_array().unwrap() {
        tally.add(case, path.parent().unwrap());
    }
    tally.check(path);
    tally
}

/// All 480 sets. Two files begin with the very rotation that the reference begins with: the smallest angle between the
/// two is zero, and what evo and we find for it is rounding, 1e-18 to 3e-16 rad.
#[test]
fn every_case_of_the_oracle() {
    let Some(folder) = shared_data("trajectories") else { return };
    let tally = tally(&folder.join("evo_oracle.json"));
    assert_eq!((tally.compared, tally.refused), (456, 24));
    let mut expected = Vec::new();
    for name in ["KITTI_00_ORB.txt", "KITTI_00_SPTAM.txt"] {
        for align in ["none", "-s only"] {
            for relation in ["rotation_angle_deg", "rotation_angle_rad"] {
                expected.push(format!("{name} {align} APE {relation} min"));
            }
        }
    }
    assert_eq!(tally.rounding, expected);
}

/// What the stored cases leave out: deltas by angle, pairs from the reference, the ratio of point distances, alignment by
/// the first pose and by the first poses alone, offsets, tolerances that let poses be taken twice.
#[test]
fn cases_of_our_own_that_evo_computed() {
    let tally = tally(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/evaluation/evo.json"));
    assert!(tally.compared > 250 && tally.refused == 0);
    // The first poses are made equal.
    assert!(
        !tally.rounding.is_empty() && tally.rounding.iter().all(|what| what.starts_with("estimate.tum origin APE"))
    );
}

/// evo's stored results are zip files whose members are not compressed: the text and the numbers lie in them as they are.
#[test]
fn the_stored_absolute_errors_of_evo() {
    let Some(folder) = shared_data("trajectories") else { return };
    for (zip, estimate) in [("orb_ape.zip", "KITTI_00_ORB.txt"), ("sptam_ape.zip", "KITTI_00_SPTAM.txt")] {
        let bytes = fs::read(folder.join("res_files").join(zip)).unwrap();
        let find = |needle: &[u8]| bytes.windows(needle.len()).position(|window| window == needle).unwrap();
        let text = &bytes[find(b"{\"std\"")..];
        let text = &text[..=text.iter().position(|&byte| byte == b'}').unwrap()];
        let stored: Value = serde_json::from_slice(text).unwrap();
        let array = &bytes[find(b"\x93NUMPY")..];
        let header = 10 + usize::from(u16::from_le_bytes([array[8], array[9]]));
        let stored_errors: Vec<f64> = array[header..]
            .chunks_exact(8)
            .take(4541)
            .map(|value| f64::from_le_bytes(value.try_into().unwrap()))
            .collect();

        let (reference, estimate) = (load(&folder.join("KITTI_00_gt.txt")), load(&folder.join(estimate)));
        let options = EvaluationOptions { alignment: Alignment::Se3, ..EvaluationOptions::default() };
        let found = evaluate(&reference, &estimate, &options).unwrap();
        let mut tally = Tally::default();
        tally.worst = compare(zip, &stored, &found, &mut tally.faults, &mut tally.rounding);
        tally.check(Path::new(zip));
        assert_eq!(found.errors.len(), stored_errors.len());
        for (error, stored) in found.errors.iter().zip(&stored_errors) {
            assert!((error - stored).abs() <= 1e-9 * stored, "{zip}: {error} in place of {stored}");
        }
    }
}
