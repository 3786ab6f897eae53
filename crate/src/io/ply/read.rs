//! From the bytes of a file to a point cloud.

use super::header::{self, Encoding};
use super::layout::Layout;
use super::{ascii, binary};
use crate::geometry::PointCloud;
use crate::io::text::refuse_pointer_and_utf16;
use crate::{Error, Result};

/// Reads the vertices of a PLY file, given as its bytes: positions (m) in the order of the file, normals and colours
/// where present. See the [module's documentation](super) for what is understood.
///
/// Coordinates over 10 km from zero, as map projections have them, are kept relative to [`PointCloud::origin`], which
/// is then the median of the first 1024 vertices, rounded to whole metres.
///
/// # Errors
/// No PLY file; a header that breaks the format's rules; vertices without x or y; a value that is not a number or does not
/// fit its type; a file that ends early. The error names the line or the byte.
pub fn read(bytes: &[u8]) -> Result<PointCloud> {
    refuse_pointer_and_utf16(bytes)?;
    let header = header::parse(bytes)?;
    let Some(index) = header.elements.iter().position(|element| element.name == "vertex") else {
        return Err(Error::whole("The file has no vertices: its header has no element called vertex", "Export points"));
    };
    let (before, vertex) = (&header.elements[..index], &header.elements[index]);
    let layout = Layout::of(vertex)?;
    match header.encoding {
        Encoding::Ascii => ascii::read(bytes, header.end, before, vertex, &layout),
        Encoding::LittleEndian => binary::read::<false>(bytes, header.end, before, vertex, &layout),
        Encoding::BigEndian => binary::read::<true>(bytes, header.end, before, vertex, &layout),
    }
}
