//! Point clouds in PLY files, read and written.
//!
//! The format: Greg Turk, "The PLY Polygon File Format", Stanford 1994, with the later type names (`float32`).
//! Read are the vertices: positions, and normals and colours where present. Everything else is stepped over.
//!
//! - ASCII, little and big endian; every scalar type; properties in any order; other properties, elements and lists
//!   anywhere. LF, CRLF or lone CR; trailing blanks; a byte order mark.
//! - `x y` without `z` is a scan in the plane, z = 0.
//! - Normals are `nx ny nz`. They are made unit length; a zero one stays zero, and a file in which all are zero has none.
//! - Colours are `red green blue`, `diffuse_red ...` or `r g b`. Their full intensity is 255 for bytes; for the wider
//!   types the smallest of 1 (floats alone), 255 and 65535 that no value exceeds.
//! - Coordinates that are not finite are kept: [`preprocess::clean`](crate::preprocess::clean) counts and drops them.
//! - Map coordinates (over 10 km from zero) are kept relative to an origin, see [`read`].
//! - What is not used is not judged: a value outside its type's range in a column that is stepped over, or a file that
//!   ends within the faces that follow its vertices, is no error.

mod ascii;
mod binary;
mod header;
mod layout;
mod read;
mod write;

pub use read::read;
pub use write::{Format, write};
