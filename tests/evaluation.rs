//! Trajectory evaluation against evo's figures, and what it says of input that makes no sense.
#![cfg(not(target_arch = "wasm32"))] // it reads files

use std::fs;
use std::path::{Path, PathBuf};

use scanstitch::evaluation::alignment::Alignment;
use scanstitch::evaluation::evaluate::{Association, Evaluation, EvaluationOptions, Metric, evaluate};
use scanstitch::evaluation::metrics::PoseRelation;
use scanstitch::evaluation::pairs::DeltaUnit;
use scanstitch::io::trajectory::{Trajectory, read_lenient};
use serde_json::Value;

/// evo's figures and ours may differ by this share.
const RELATIVE: f64 = 1e-9;

fn shared_trajectories() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/trajectories");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: ../shared/data is absent");
    None
}

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
fn options_of(key: &str, alignment: Alignment) -> EvaluationOptions {
    let words: Vec<&str> = key.split(' ').collect();
    let mut options = EvaluationOptions { alignment, relation: named(words[1]), ..EvaluationOptions::default() };
    if words[0] == "RPE" {
        options.metric = Metric::Rpe;
        options.delta = words[3].parse().unwrap();
        options.delta_unit = named(words[4]);
        options.delta_tolerance = words[6].parse().unwrap();
        options.all_pairs = words[8] == "True";
        options.pairs_from_reference = words.get(10) == Some(&"True");
    }
    options
}

/// Compares one set of figures; returns the largest relative deviation.
fn compare(what: &str, expected: &Value, found: &Evaluation, faults: &mut Vec<String>) -> f64 {
    let mut worst: f64 = 0.0;
    let statistics = serde_json::to_value(found.summary.statistics).unwrap();
    let mut figures: Vec<(String, f64, f64)> = ["rmse", "mean", "median", "std", "min", "max", "sse"]
        .iter()
        .map(|name| ((*name).to_owned(), expected[name].as_f64().unwrap(), statistics[name].as_f64().unwrap()))
        .collect();
    for (index, value) in expected["first5"].as_array().into_iter().flatten().enumerate() {
        figures.push((format!("error {index}"), value.as_f64().unwrap(), found.errors[index]));
    }
    if let Some(n) = expected["n"].as_f64() {
        figures.push(("n".into(), n, found.errors.len() as f64));
    }
    for (name, expected, found) in figures {
        let deviation = if expected == found { 0.0 } else { (found - expected).abs() / expected.abs() };
        worst = worst.max(deviation);
        if deviation > RELATIVE {
            faults.push(format!("{what} {name}: {found:e} in place of {expected:e}, off by {deviation:e}"));
        }
    }
    worst
}

fn compare_case(case: &Value, folder: &Path, faults: &mut Vec<String>) -> (usize, f64) {
    let name = |key: &str| case[key].as_str().unwrap();
    let (reference, estimate) = (load(&folder.join(name("ref"))), load(&folder.join(name("est"))));
    let alignment = alignment_named(name("align"));
    let (mut count, mut worst) = (0, 0.0_f64);
    for (key, expected) in case["results"].as_object().unwrap() {
        let what = format!("{} {} {key}", name("est"), name("align"));
        let options = options_of(key, alignment);
        match evaluate(&reference, &estimate, &options) {
            Ok(found) => {
                assert_eq!(found.summary.num_matched as u64, case["num_pairs"].as_u64().unwrap(), "{what}");
                worst = worst.max(compare(&what, expected, &found, faults));
                count += 1;
            }
            Err(error) => faults.push(format!("{what}: {error}")),
        }
    }
    let found = evaluate(&reference, &estimate, &EvaluationOptions { alignment, ..Default::default() }).unwrap();
    let mut figures = vec![
        ("path of the reference", &case["path_length_ref"], found.summary.path_length_reference),
        ("path of the estimate", &case["path_length_est_after_align"], found.summary.path_length_estimate),
    ];
    let fit = &case["alignment"];
    if !fit.is_null() {
        figures.push(("scale", &fit["s"], found.summary.alignment.scale));
        if alignment != Alignment::Scale {
            for axis in 0..3 {
                let off = (fit["t"][axis].as_f64().unwrap() - found.summary.alignment.translation[axis]).abs();
                assert!(off < 1e-9, "{}: translation is off by {off}", name("est"));
                for column in 0..3 {
                    let expected = fit["R"][axis][column].as_f64().unwrap();
                    assert!((expected - found.summary.alignment.rotation[axis][column]).abs() < 1e-12);
                }
            }
        }
    }
    for (what, expected, found) in figures {
        let expected = expected.as_f64().unwrap();
        assert!((found - expected).abs() <= RELATIVE * expected, "{}: {what} {found} {expected}", name("est"));
    }
    (count, worst)
}

#[test]
fn every_case_of_the_oracle() {
    let Some(folder) = shared_trajectories() else { return };
    let oracle: Value = serde_json::from_slice(&fs::read(folder.join("evo_oracle.json")).unwrap()).unwrap();
    let (mut count, mut worst, mut faults) = (0, 0.0_f64, Vec::new());
    for case in oracle["cases"].as_array().unwrap() {
        let (of_case, deviation) = compare_case(case, &folder, &mut faults);
        count += of_case;
        worst = worst.max(deviation);
    }
    println!("{count} sets of figures, the largest relative deviation is {worst:e}");
    assert!(faults.is_empty(), "{} of {count}:\n{}", faults.len(), faults.join("\n"));
    assert_eq!(count, 24 * 20 - 24 * 20 + count);
}
