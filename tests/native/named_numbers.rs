//! Named numbers of the laser path, of the depth path and of surfaces: each says what it decides, and they do not become more.

use std::fs;
use std::path::{Path, PathBuf};

/// The sources that turn planar scans and odometry into poses, and say how sure these are.
const LASER_PATH: &[&str] =
    &["odometry/planar", "odometry/planar.rs", "pipeline/planar", "pipeline/odometry_check", "graph/loops/planar"];
/// The sources that turn depth images into poses, and say how sure these are.
const DEPTH_PATH: &[&str] = &["odometry/depth", "graph/loops/spatial"];
/// The sources that turn depth images and clouds into a surface.
const SURFACES: &[&str] = &["map/surface"];

/// So many are named there, of 124 once. A new one has to take the place of another, or to be derived from those there are.
#[test]
fn each_number_of_the_laser_path_says_what_it_decides_and_they_do_not_become_more() {
    check(LASER_PATH, 71);
}

/// Of 86 once.
#[test]
fn each_number_of_the_depth_path_says_what_it_decides_and_they_do_not_become_more() {
    check(DEPTH_PATH, 30);
}

/// Of 43 once.
#[test]
fn each_number_of_surfaces_says_what_it_decides_and_they_do_not_become_more() {
    check(SURFACES, 31);
}

fn check(paths: &[&str], most: usize) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("crate/src");
    let mut files = Vec::new();
    for path in paths {
        collect(&root.join(path), &mut files);
    }
    let (mut numbers, mut silent) = (Vec::new(), Vec::new());
    for file in files {
        let text = fs::read_to_string(&file).expect("a source is text");
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
        let lines: Vec<&str> = code.lines().collect();
        for (index, line) in lines.iter().enumerate().filter(|(_, line)| names_a_number(line)) {
            let at = format!("{}:{}: {}", file.display(), index + 1, line.trim());
            let before = index.checked_sub(1).map_or("", |before| lines[before].trim_start());
            if !before.starts_with("///") {
                silent.push(at.clone());
            }
            numbers.push(at);
        }
    }
    assert!(silent.is_empty(), "no reason stands before\n{}", silent.join("\n"));
    assert!(numbers.len() <= most, "{} named numbers, not {most}:\n{}", numbers.len(), numbers.join("\n"));
}

#[test]
fn numbers_are_told_from_what_follows_from_them() {
    for number in
        ["const A: f64 = 0.5;", "    pub const B: (f64, f64) = (0.6, 1.5);", "pub(super) const C: [i32; 2] = ["]
    {
        assert!(names_a_number(number), "{number}");
    }
    for other in ["const D: f64 = OTHER;", "const E: &str = \"1 m\";", "let a = 0.5;", "/// const F: f64 = 0.5;"] {
        assert!(!names_a_number(other), "{other}");
    }
}

/// Whether a line begins a constant of numbers that does not only hand on another one.
fn names_a_number(line: &str) -> bool {
    let line = line.trim_start();
    let Some((before, rest)) = line.split_once("const ") else { return false };
    let Some((kind, value)) = rest.split_once(": ").and_then(|(_, rest)| rest.split_once(" =")) else { return false };
    let is_public = before.starts_with("pub") && !before.contains("fn ");
    let is_number = ["f64", "f32", "usize", "i32", "u32", "SearchWindow"].iter().any(|name| kind.contains(name));
    let is_literal = value.replace("f64", "").contains(|c: char| c.is_ascii_digit()) || value.trim() == "[";
    (before.is_empty() || is_public) && is_number && is_literal
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    if path.is_file() {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.extension().is_some_and(|extension| extension == "rs") && name != "tests.rs" {
            files.push(path.to_owned());
        }
        return;
    }
    for entry in fs::read_dir(path).expect("the folder of sources can be read") {
        collect(&entry.expect("an entry of the folder can be read").path(), files);
    }
}
