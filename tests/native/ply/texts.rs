//! Small files in text, put together line by line.

/// A file in text of `header` lines and `body` lines.
pub fn text(header: &[&str], body: &[&str]) -> Vec<u8> {
    let lines = ["ply", "format ascii 1.0"].iter().chain(header).chain(&["end_header"]).chain(body);
    lines.flat_map(|line| [line, "\n"]).collect::<String>().into_bytes()
}

pub const XYZ: [&str; 4] = ["element vertex 1", "property float x", "property float y", "property float z"];
