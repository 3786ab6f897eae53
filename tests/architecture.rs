//! The shape of the crate: imports point one way, and only the `wasm` module knows of JavaScript, clocks or printing.
#![cfg(not(target_arch = "wasm32"))] // it reads the sources

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms of the crate from the ground up. A room may import from those before its own, and from itself.
const LAYERS: &[&[&str]] = &[
    &["error"],
    &["geometry"],
    &["search", "camera"],
    &["io"],
    &["preprocess"],
    &["registration", "evaluation"],
    &["map"],
    &["odometry"],
    &["graph"],
    &["pipeline"],
    &["wasm"],
];

/// At most so many rooms stand beside `lib.rs` and `error.rs`.
const MAX_ROOMS: usize = 12;

/// How good a result is must be judged without knowing how it came about.
const EVALUATION_MUST_NOT_KNOW: &[&str] = &["registration", "pipeline"];

/// What no module below `wasm` may do: talk to JavaScript, print, read a clock or files.
const FORBIDDEN: &[&str] = &[
    "wasm_bindgen",
    "web_sys",
    "js_sys",
    "println!",
    "eprintln!",
    "print!",
    "eprint!",
    "dbg!",
    "Instant",
    "SystemTime",
    "std::fs",
    "std::env::",
];

#[test]
fn imports_point_one_way() {
    let ranks: BTreeMap<&str, usize> =
        LAYERS.iter().enumerate().flat_map(|(rank, layer)| layer.iter().map(move |name| (*name, rank))).collect();
    let mut faults = Vec::new();
    let mut imports = 0;
    for source in sources() {
        let Some(&rank) = ranks.get(source.module.as_str()) else {
            faults.push(format!("{}: the module {} has no place in LAYERS", source.path.display(), source.module));
            continue;
        };
        for (line, imported) in source.imports() {
            imports += 1;
            let allowed = imported == source.module
                || ranks.get(imported.as_str()).is_some_and(|&imported_rank| imported_rank < rank);
            let blind = source.module == "evaluation" && EVALUATION_MUST_NOT_KNOW.contains(&imported.as_str());
            if !allowed || blind {
                let path = source.path.display();
                faults.push(format!("{path}:{line}: {} must not import from {imported}", source.module));
            }
        }
    }
    assert!(imports > 20, "only {imports} imports were found: are they read rightly?");
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn every_room_has_a_page_that_introduces_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("crate/src");
    let entries = fs::read_dir(&root).expect("crate/src can be read").map(|entry| entry.expect("an entry").path());
    let (rooms, files): (Vec<PathBuf>, Vec<PathBuf>) = entries.partition(|path| path.is_dir());
    assert!(rooms.len() <= MAX_ROOMS, "{} rooms in crate/src, at most {MAX_ROOMS} are meant", rooms.len());
    for room in rooms {
        let page = fs::read_to_string(room.join("mod.rs")).unwrap_or_default();
        let introduction = page.lines().take_while(|line| line.starts_with("//!")).count();
        assert!(
            introduction >= 3,
            "{}/mod.rs does not say what comes in, what goes out and what to read first",
            room.display()
        );
    }
    let loose: Vec<_> = files.iter().filter(|path| !path.ends_with("lib.rs") && !path.ends_with("error.rs")).collect();
    assert!(loose.is_empty(), "loose files in crate/src: {loose:?}");
}

#[test]
fn bindings_clocks_and_printing_stay_in_wasm() {
    let mut faults = Vec::new();
    for source in sources().into_iter().filter(|source| source.module != "wasm") {
        for (number, line) in source.code() {
            faults.extend(
                FORBIDDEN
                    .iter()
                    .filter(|word| has_word(&line, word))
                    .map(|word| format!("{}:{number}: {word}", source.path.display())),
            );
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_reader_of_sources_reads_them_rightly() {
    let source = Source {
        path: PathBuf::from("odometry.rs"),
        module: "odometry".into(),
        text: "//! crate::wasm and println! in words\n\
               use crate::{Error, geometry::{Pose2,\n PointCloud}, map};\n\
               fn f() { crate::search::KdTree::build(); } // js_sys\n\
               let a = \"// no comment\"; eprintln!(\"{a}\");\n\
               #[cfg(test)]\n\
               mod tests { use crate::scene; }\n"
            .into(),
    };
    let imports: Vec<(usize, String)> = source.imports();
    let expected = [(2, "error"), (2, "geometry"), (2, "map"), (4, "search")];
    assert_eq!(imports, expected.map(|(line, name)| (line, name.to_owned())));
    let words: Vec<usize> = source.code().filter(|(_, line)| has_word(line, "eprintln!")).map(|(n, _)| n).collect();
    assert_eq!(words, [5]);
    assert!(source.code().all(|(_, line)| !has_word(&line, "js_sys") && !has_word(&line, "print!")));
}

/// A source file of the crate.
struct Source {
    path: PathBuf,
    /// The top-level module it belongs to.
    module: String,
    text: String,
}

impl Source {
    /// Its lines without comments, numbered from 1, up to its tests: they may use what they like.
    fn code(&self) -> impl Iterator<Item = (usize, String)> + '_ {
        let tests = self.text.find("#[cfg(test)]\nmod ").unwrap_or(self.text.len());
        self.text[..tests].lines().enumerate().map(|(index, line)| (index + 1, without_comment(line)))
    }

    /// The top-level modules it names after `crate::`, with the lines. What the root re-exports belongs to `error`.
    fn imports(&self) -> Vec<(usize, String)> {
        let code: Vec<String> = self.code().map(|(_, line)| line).collect();
        let code = code.join("\n");
        let mut imports = Vec::new();
        for (start, word) in code.match_indices("crate::") {
            let number = 1 + code[..start].matches('\n').count();
            let rest = &code[start + word.len()..];
            let names = rest.strip_prefix('{').map_or_else(|| vec![rest], top_level_names);
            imports.extend(names.into_iter().map(|name| (number, module_of(name))));
        }
        imports
    }
}

/// The parts of `a, b::{c, d}, e};` that are not inside further braces.
fn top_level_names(group: &str) -> Vec<&str> {
    let mut depth = 0;
    let parts = group.split(|character| {
        depth += i32::from(character == '{') - i32::from(character == '}');
        (character == ',' && depth == 0) || depth < 0
    });
    parts.map(str::trim).take_while(|part| !part.starts_with(';') && !part.is_empty()).collect()
}

fn module_of(path: &str) -> String {
    let name: String = path.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    let reexported = matches!(name.as_str(), "Error" | "Place" | "Result");
    if reexported { "error".into() } else { name }
}

/// The line up to `//`, unless that stands in a string.
fn without_comment(line: &str) -> String {
    let comment = line.match_indices("//").find(|(at, _)| line[..*at].matches('"').count().is_multiple_of(2));
    line[..comment.map_or(line.len(), |(at, _)| at)].to_owned()
}

/// Whether the word stands in the line and is not the end of a longer one.
fn has_word(line: &str, word: &str) -> bool {
    line.match_indices(word).any(|(at, _)| !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("crate/src");
    let mut found = Vec::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("crate/src can be read") {
            let path = entry.expect("crate/src can be read").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let inside = path.strip_prefix(&root).expect("it lies in crate/src");
            let first = inside.components().next().expect("it has a name").as_os_str().to_string_lossy();
            let module = first.trim_end_matches(".rs").to_owned();
            if module != "lib" && path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).expect("a source is text");
                found.push(Source { path, module, text });
            }
        }
    }
    assert!(found.len() > 10, "only {} sources were found", found.len());
    found
}
