//! Point clouds in whichever of the formats that are read.

use super::{pcd, ply};
use crate::geometry::PointCloud;
use crate::{Error, Result};

/// Whether these bytes, the beginning of a file at least, are meant for a cloud rather than for an image.
pub fn is_cloud(bytes: &[u8]) -> bool {
    let bytes = bytes.trim_ascii_start();
    bytes.starts_with(b"ply") || [b"#".as_slice(), b"VERSION", b"FIELDS"].iter().any(|start| bytes.starts_with(start))
}

/// Reads a PLY or PCD file, given as its bytes.
///
/// # Errors
/// When it is neither, or broken.
pub fn read(bytes: &[u8]) -> Result<PointCloud> {
    if bytes.trim_ascii_start().starts_with(b"ply") {
        return ply::read(bytes);
    }
    if is_cloud(bytes) { pcd::read(bytes) } else { Err(Error::byte(0, "This is neither a PLY nor a PCD file", REMEDY)) }
}

const REMEDY: &str = "Clouds are PLY or PCD files";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_is_told_from_the_first_bytes() {
        let cloud = PointCloud::from_positions(vec![glam::Vec3::new(1.0, 2.0, 3.0)]);
        assert_eq!(read(&ply::write(&cloud, ply::Format::Ascii)).unwrap(), cloud);
        assert_eq!(read(&pcd::write(&cloud, pcd::Format::Binary)).unwrap(), cloud);
        assert!(read(b"\x89PNG\r\n\x1a\n").is_err() && !is_cloud(b"P5 1 1 255\n"));
    }
}
