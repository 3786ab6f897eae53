//! Triangle meshes as files: PLY, OBJ and STL.
//!
//! - PLY, binary, little endian: positions, normals, colours where there are any, and `deviation`, the standard deviation of a vertex
//!   along its normal (m). Where holes are filled, `filled` is 1 for the vertices of the filling.
//! - OBJ: positions with colours behind them, as most programs read them, and normals.
//! - STL, binary, for printing: **millimetres**, no colours.

use std::fmt::Write;

use crate::geometry::TriangleMesh;
use crate::io::length_unit::MILLIMETRE;
use crate::{Error, Result};

/// A file format of meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    /// Stanford's, binary.
    Ply,
    /// Wavefront's.
    Obj,
    /// Stereolithography's, binary, in millimetres.
    Stl,
}

impl MeshFormat {
    /// The format of this name: `ply`, `obj` or `stl`.
    ///
    /// # Errors
    /// When there is none.
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "ply" => Ok(Self::Ply),
            "obj" => Ok(Self::Obj),
            "stl" => Ok(Self::Stl),
            _ => Err(Error::whole(format!("There is no format {name:?} of meshes"), "Give ply, obj or stl")),
        }
    }
}

/// The mesh as a file.
pub fn write(mesh: &TriangleMesh, format: MeshFormat) -> Vec<u8> {
    match format {
        MeshFormat::Ply => ply(mesh),
        MeshFormat::Obj => obj(mesh),
        MeshFormat::Stl => stl(mesh),
    }
}

fn ply(mesh: &TriangleMesh) -> Vec<u8> {
    let has_colors = !mesh.colors.is_empty();
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.len());
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        let _ = writeln!(header, "property float {name}");
    }
    for name in ["red", "green", "blue"].into_iter().filter(|_| has_colors) {
        let _ = writeln!(header, "property uchar {name}");
    }
    let faces = mesh.triangles.len();
    header.push_str("property float deviation\n");
    if !mesh.filled.is_empty() {
        header.push_str("property uchar filled\n");
    }
    let _ = write!(header, "element face {faces}\nproperty list uchar int vertex_indices\n");
    header.push_str("end_header\n");
    let mut bytes = header.into_bytes();
    bytes.reserve(mesh.positions.len() * 31 + faces * 13);
    for (vertex, position) in mesh.positions.iter().enumerate() {
        for value in position.to_array().into_iter().chain(mesh.normals[vertex].to_array()) {
            bytes.extend(value.to_le_bytes());
        }
        if has_colors {
            bytes.extend(mesh.colors[vertex]);
        }
        bytes.extend(mesh.deviations[vertex].to_le_bytes());
        bytes.extend(mesh.filled.get(vertex).map(|&is_filled| u8::from(is_filled)));
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|vertex| vertex.to_le_bytes()));
    }
    bytes
}

fn obj(mesh: &TriangleMesh) -> Vec<u8> {
    let mut text = String::with_capacity(mesh.positions.len() * 80);
    for (vertex, position) in mesh.positions.iter().enumerate() {
        let _ = write!(text, "v {:.5} {:.5} {:.5}", position.x, position.y, position.z);
        if let Some(color) = mesh.colors.get(vertex) {
            let [red, green, blue] = color.map(|value| f32::from(value) / 255.0);
            let _ = write!(text, " {red:.4} {green:.4} {blue:.4}");
        }
        text.push('\n');
    }
    for normal in &mesh.normals {
        let _ = writeln!(text, "vn {:.4} {:.4} {:.4}", normal.x, normal.y, normal.z);
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| vertex + 1);
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    text.into_bytes()
}

fn stl(mesh: &TriangleMesh) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    let title = b"Surface in millimetres";
    bytes[..title.len()].copy_from_slice(title);
    bytes.reserve(4 + mesh.triangles.len() * 50);
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize] * MILLIMETRE.metres.recip() as f32);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for value in [normal, a, b, c].into_iter().flat_map(|vector| vector.to_array()) {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0, 0]);
    }
    bytes
}
