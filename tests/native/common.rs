//! What several files of tests have in common.

use std::io::Write;
use std::path::{Path, PathBuf};

/// A file or folder of the recordings in `../shared/data`. Where it is absent, the test that asks for it is to return:
/// it has been skipped, as a line on the standard error output says, which `npm test` counts.
pub fn shared_data(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(path);
    if found.exists() {
        return Some(found);
    }
    // Written directly: what a test prints with a macro is shown only where the test fails.
    let line = format!("skipped: ../shared/data/{path} is absent\n");
    std::io::stderr().write_all(line.as_bytes()).expect("the standard error output can be written");
    None
}
