//! The shape of the crate: imports point one way, and only how an error is thrown knows of JavaScript; nothing knows of clocks or
//! printing.

use std::collections::{BTreeMap, BTreeSet};
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
];

/// Where the sources of the engine and those of the synthetic worlds are.
const ENGINE: &str = "crate/src";
const SCENE: &str = "crate/scene/src";

/// At most so many rooms stand beside `lib.rs` and `error.rs`.
const MAX_ROOMS: usize = 11;

/// How good a result is must be judged without knowing how it came about.
const EVALUATION_MUST_NOT_KNOW: &[&str] = &["registration", "pipeline"];

/// The one file that may name JavaScript: the bindings are a crate of their own.
const THROWN: &str = "error.rs";

/// What no module may do: talk to JavaScript, print, read a clock or files.
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
            faults.push(format!("{}: the module {} has no place in LAYERS", source.file, source.module));
            continue;
        };
        for (line, imported) in source.imports() {
            imports += 1;
            let allowed = imported == source.module
                || ranks.get(imported.as_str()).is_some_and(|&imported_rank| imported_rank < rank);
            let blind = source.module == "evaluation" && EVALUATION_MUST_NOT_KNOW.contains(&imported.as_str());
            if !allowed || blind {
                let path = &source.file;
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
    let entries =
        fs::read_dir(&root).expect("the folder of sources can be read").map(|entry| entry.expect("an entry").path());
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
fn no_files_import_each_other_in_a_ring() {
    for root in [ENGINE, SCENE] {
        let sources: BTreeMap<String, String> =
            sources_in(root).into_iter().map(|source| (source.file.clone(), source.text())).collect();
        let rings = files_in_a_ring(&sources);
        assert!(rings.is_empty(), "files of {root} import each other in a ring: {rings:?}");
    }
}

#[test]
fn rings_of_imports_are_found() {
    let of = |files: &[(&str, &str)]| {
        files_in_a_ring(&files.iter().map(|(file, text)| ((*file).to_owned(), (*text).to_owned())).collect())
    };
    let straight = [
        ("map/mod.rs", "pub mod local;\npub mod grid;\npub use local::Map;"),
        ("map/local.rs", "use super::grid::{self, Cell};\nuse crate::error::Result;"),
        ("map/grid.rs", "use glam::Vec3;\nfn f() { crate::geometry::turn(); }"),
        ("geometry.rs", ""),
        ("error.rs", ""),
    ];
    assert!(of(&straight).is_empty(), "{:?}", of(&straight));
    // A module and its parts are one: a part may use what its `mod.rs` defines.
    let part = [("map/mod.rs", "mod part;\nuse part::size;"), ("map/part.rs", "use super::Map;")];
    assert!(of(&part).is_empty());
    let between_rooms = [("a.rs", "use crate::b::c::D;"), ("b/mod.rs", ""), ("b/c.rs", "fn f() { crate::a::g(); }")];
    assert_eq!(of(&between_rooms), ["a.rs", "b/c.rs"]);
    // Through a name that `mod.rs` hands on, inside a group, over three files.
    let handed_on = [
        ("a/mod.rs", "mod x;\nmod y;\nmod z;\npub(crate) use self::x::{Other as Another, X};"),
        ("a/x.rs", "use super::y::Y;"),
        ("a/y.rs", "use crate::{error::E, a::{z::{Z, W}}};"),
        ("a/z.rs", "use super::{\n    Another,\n};"),
    ];
    assert_eq!(of(&handed_on), ["a/x.rs", "a/y.rs", "a/z.rs"]);
}

#[test]
fn bindings_clocks_and_printing_stay_out() {
    let mut faults = Vec::new();
    for source in sources().into_iter().filter(|source| source.file != THROWN) {
        for (number, line) in source.code() {
            faults.extend(
                FORBIDDEN
                    .iter()
                    .filter(|word| has_word(&line, word))
                    .map(|word| format!("{}:{number}: {word}", source.file)),
            );
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// A file that no module names would not run, and one beside the folders would be linked to a binary of its own.
#[test]
fn every_native_test_is_a_module_of_the_one_binary() {
    let files: Vec<String> = sources_in("tests").into_iter().map(|source| source.file).collect();
    let stray: Vec<&String> = files.iter().filter(|file| !file.contains('/')).collect();
    assert!(stray.is_empty(), "{stray:?}");
    for file in files.iter().filter(|file| !file.ends_with("/main.rs")) {
        let path = file.strip_suffix("/mod.rs").or(file.strip_suffix(".rs")).expect("a source");
        let (folder, name) = path.rsplit_once('/').expect("a folder");
        let texts = ["main.rs", "mod.rs"].map(|page| fs::read_to_string(format!("tests/{folder}/{page}")));
        let is_named = texts.iter().flatten().any(|text| text.lines().any(|line| line == format!("mod {name};")));
        assert!(is_named, "no module names tests/{file}");
    }
}

/// `wasm-pack test` compiles no others.
#[test]
fn tests_of_the_webassembly_build_are_in_tests_browser() {
    let attribute = concat!("#[wasm_", "bindgen_test");
    let with_such = |folder: &str| -> Vec<String> {
        let sources = sources_in(folder).into_iter().filter(|source| source.text.contains(attribute));
        sources.map(|source| source.file).collect()
    };
    let in_tests = with_such("tests");
    assert!(in_tests.iter().any(|file| file == "browser/api.rs"), "{in_tests:?}");
    assert!(in_tests.iter().all(|file| file.starts_with("browser/")), "{in_tests:?}");
    assert_eq!([with_such(ENGINE), with_such(SCENE)].concat(), [""; 0]);
}

#[test]
fn the_reader_of_sources_reads_them_rightly() {
    let source = Source {
        file: "odometry.rs".to_owned(),
        module: "odometry".into(),
        text: "//! crate::pipeline and println! in words\n\
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

/// A source file.
struct Source {
    /// Below the folder of sources, with `/` on every platform.
    file: String,
    /// The top-level module it belongs to.
    module: String,
    text: String,
}

impl Source {
    /// Its code without comments and tests.
    fn text(&self) -> String {
        self.code().map(|(_, line)| line + "\n").collect()
    }

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

/// The files that can be come back to by following imports, their own `mod.rs` apart. `sources` are texts by their files.
fn files_in_a_ring(sources: &BTreeMap<String, String>) -> Vec<String> {
    let modules: BTreeMap<Module, Imports> =
        sources.iter().map(|(file, text)| (module_path(file), Imports::of(text))).collect();
    let files: BTreeMap<Module, &String> = sources.keys().map(|file| (module_path(file), file)).collect();
    let imports_of = |module: &Module| -> BTreeSet<Module> {
        let paths = modules[module].used.iter();
        paths.filter_map(|path| resolve(&modules, module, path)).filter(|to| !module.starts_with(to)).collect()
    };
    let next: BTreeMap<&Module, BTreeSet<Module>> = modules.keys().map(|module| (module, imports_of(module))).collect();
    let comes_back = |start: &Module| {
        let (mut seen, mut waiting) = (BTreeSet::new(), vec![start]);
        while let Some(module) = waiting.pop() {
            waiting.extend(next[module].iter().filter(|to| seen.insert(*to)));
        }
        seen.contains(start)
    };
    files.iter().filter(|(module, _)| comes_back(module)).map(|(_, file)| (*file).clone()).collect()
}

/// The names of a module and of those around it, from the outermost.
type Module = Vec<String>;

/// `map/voxel/mod.rs` is `map::voxel`.
fn module_path(file: &str) -> Module {
    let path = file.trim_end_matches(".rs").trim_end_matches("mod").trim_end_matches('/');
    path.split('/').map(str::to_owned).collect()
}

/// What a file names of others.
struct Imports {
    /// Paths that are used, as they are written.
    used: Vec<Vec<String>>,
    /// Paths that are handed on, by the name they get.
    handed_on: BTreeMap<String, Vec<String>>,
}

impl Imports {
    fn of(code: &str) -> Self {
        let (mut used, mut handed_on) = (Vec::new(), BTreeMap::new());
        let mut statements = code.split_inclusive([';', '{', '}']).collect::<Vec<_>>().into_iter();
        while let Some(statement) = statements.next() {
            let words = statement.trim_start();
            let is_public = words.starts_with("pub");
            let visible = if is_public { words.trim_start_matches("pub").trim_start() } else { words };
            let tree =
                visible.strip_prefix('(').map_or(visible, |rest| rest.split_once(')').map_or("", |(_, rest)| rest));
            let Some(tree) = tree.trim_start().strip_prefix("use ") else {
                used.extend(paths_in(statement));
                continue;
            };
            let mut tree = tree.to_owned();
            while !tree.ends_with(';') {
                tree += statements.next().unwrap_or(";");
            }
            for (name, path) in paths_of(tree.trim_end_matches(';')) {
                if is_public {
                    handed_on.insert(name, path);
                } else {
                    used.push(path);
                }
            }
        }
        Self { used, handed_on }
    }
}

/// The paths that stand in an expression or a type and begin at the crate or at a module around.
fn paths_in(code: &str) -> impl Iterator<Item = Vec<String>> + '_ {
    let tokens = code.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
    let begins = |token: &&str| token.starts_with("crate::") || token.starts_with("super::");
    tokens.filter(begins).map(|token| token.split("::").map(str::to_owned).collect())
}

/// The paths of a `use` tree with the names they get: `a::{b, c::d as e}` gives `a::b` as `b` and `a::c::d` as `e`.
fn paths_of(tree: &str) -> Vec<(String, Vec<String>)> {
    let (prefix, group) = tree.split_once('{').map_or((tree, None), |(prefix, group)| (prefix, Some(group)));
    let (prefix, name) = prefix.split_once(" as ").map_or((prefix, None), |(path, name)| (path, Some(name.trim())));
    let prefix: Vec<String> =
        prefix.split("::").map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect();
    let Some(group) = group else {
        let name = name.map_or_else(|| prefix.last().cloned().unwrap_or_default(), str::to_owned);
        return vec![(name, prefix)];
    };
    let inside = top_level_names(group).into_iter().flat_map(paths_of);
    inside.map(|(name, path)| (name, [prefix.clone(), path].concat())).collect()
}

/// The module whose file defines what a path names in `module`; `None` for other crates.
fn resolve(modules: &BTreeMap<Module, Imports>, module: &[String], path: &[String]) -> Option<Module> {
    let (mut at, mut rest) = (module.to_vec(), path);
    match rest.first()?.as_str() {
        "crate" => (at, rest) = (Module::new(), &rest[1..]),
        "self" => rest = &rest[1..],
        "super" => {
            while rest.first().is_some_and(|part| part == "super") {
                at.pop();
                rest = &rest[1..];
            }
        }
        inner if modules.contains_key(&[at.clone(), vec![inner.to_owned()]].concat()) => {}
        _ => return None,
    }
    while let Some(part) = rest.first() {
        at.push(part.clone());
        if !modules.contains_key(&at) && !modules.keys().any(|known| known.starts_with(&at)) {
            at.pop();
            break;
        }
        rest = &rest[1..];
    }
    let handed_on = rest.first().and_then(|name| modules.get(&at)?.handed_on.get(name));
    match handed_on {
        Some(path) => resolve(modules, &at, path),
        None => modules.contains_key(&at).then_some(at),
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
    sources_in(ENGINE)
}

/// All sources of a package but its `lib.rs`.
fn sources_in(folder: &str) -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut found = Vec::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("the folder of sources can be read") {
            let path = entry.expect("the folder of sources can be read").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let inside = path.strip_prefix(&root).expect("it lies in that folder");
            let first = inside.components().next().expect("it has a name").as_os_str().to_string_lossy();
            let module = first.trim_end_matches(".rs").to_owned();
            if module != "lib" && path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).expect("a source is text");
                let file = inside.to_string_lossy().replace('\\', "/");
                found.push(Source { file, module, text });
            }
        }
    }
    assert!(found.len() > 10, "only {} sources were found", found.len());
    found
}
