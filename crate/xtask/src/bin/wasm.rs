//! Makes a compiled module ready for JavaScript: `wasm MODULE.wasm OUT_DIR NAME` writes `NAME.js`, `NAME.d.ts` and
//! `NAME_bg.wasm` into the folder, as `wasm-bindgen --target web` does.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let args: Vec<String> = env::args().skip(1).collect();
    let [module, out_dir, name] = args.as_slice() else {
        eprintln!("usage: wasm MODULE.wasm OUT_DIR NAME");
        return ExitCode::FAILURE;
    };
    let made = Path::new(module).with_extension("bindings");
    let out_dir = PathBuf::from(out_dir);
    let outcome = bind(Path::new(module), &made, name)
        .and_then(|()| replace_changed(&made, &out_dir).map_err(|error| format!("{}: {error}", out_dir.display())));
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("error: {problem}");
            ExitCode::FAILURE
        }
    }
}

/// Writes `<name>.js`, `<name>.d.ts` and `<name>_bg.wasm` into `out_dir`, which then holds nothing else.
fn bind(wasm: &Path, out_dir: &Path, name: &str) -> Result<(), String> {
    let generate = || {
        Bindgen::new()
            .input_path(wasm)
            .web(true)?
            .typescript(true)
            // A returned typed array is a copy with a buffer of its own, which Blob and transfer ask for:
            // Uint8Array<ArrayBuffer>.
            .ts_typed_array_buffers(true)
            // The names of functions are a tenth of the file; those of a panic's place stay.
            .remove_name_section(true)
            .out_name(name)
            .generate(out_dir)
    };
    if out_dir.exists() {
        fs::remove_dir_all(out_dir).map_err(|error| format!("{}: {error}", out_dir.display()))?;
    }
    generate().map_err(|error| format!("{error:#}"))?;
    check_arguments(&out_dir.join(name).with_extension("js"))
}

/// Brings the files of a folder into another one, each by renaming, so that whoever reads them meanwhile reads a whole one. Those
/// that are there as they are stay.
fn replace_changed(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let name = entry?.file_name();
        let bytes = fs::read(from.join(&name))?;
        let there = to.join(&name);
        if fs::read(&there).is_ok_and(|old| old == bytes) {
            continue;
        }
        // Beside it, for the target folder may be on another disk.
        let new = to.join(format!("{}.new", name.display()));
        fs::write(&new, bytes)?;
        fs::rename(&new, &there)?;
    }
    Ok(())
}

/// What hands strings and arrays over to the module, and what each takes. As generated they take whatever they are
/// given: an object without a length is written to an address that was never allotted.
const GUARDS: [(&str, &str, &str); 6] = [
    ("passStringToWasm0", "typeof arg === 'string'", "a string"),
    ("passArray8ToWasm0", "ArrayBuffer.isView(arg) && arg.BYTES_PER_ELEMENT === 1", "a Uint8Array"),
    ("passArray32ToWasm0", "ArrayBuffer.isView(arg) && arg.BYTES_PER_ELEMENT === 4", "a Uint32Array"),
    ("passArrayF32ToWasm0", "ArrayBuffer.isView(arg) && arg.BYTES_PER_ELEMENT === 4", "a Float32Array"),
    ("passArrayF64ToWasm0", "ArrayBuffer.isView(arg) && arg.BYTES_PER_ELEMENT === 8", "a Float64Array"),
    ("passArrayJsValueToWasm0", "Array.isArray(arg)", "an array"),
];

/// Makes the generated JavaScript check the arguments that would otherwise lead out of the module's memory.
fn check_arguments(script: &Path) -> Result<(), String> {
    let told = |error: std::io::Error| format!("{}: {error}", script.display());
    let mut text = fs::read_to_string(script).map_err(told)?;
    for (function, condition, wanted) in GUARDS {
        let start = format!("function {function}(arg, malloc");
        // A package without such arguments has no such function.
        let Some(found) = text.find(&start) else { continue };
        let Some(length) = text[found..].find("{\n") else {
            return Err(format!("{}: {function} is not as it is expected to be", script.display()));
        };
        let guard = format!(
            "    if (!({condition})) throw new TypeError(`expected {wanted}, not ${{Object.prototype.toString.call(arg).slice(8, -1)}}`);\n"
        );
        text.insert_str(found + length + 2, &guard);
    }
    fs::write(script, text).map_err(told)
}
