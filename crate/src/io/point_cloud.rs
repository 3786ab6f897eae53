//! Point clouds in whichever of the formats that are read.

use super::text::refuse_pointer_and_utf16;
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
    refuse_pointer_and_utf16(bytes)?;
    if bytes.trim_ascii_start().starts_with(b"ply") {
        return ply::read(bytes);
    }
    if is_cloud(bytes) { pcd::read(bytes) } else { Err(Error::byte(0, "This is neither a PLY nor a PCD file", REMEDY)) }
}

/// A format that clouds are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CloudFormat {
    /// PLY.
    Ply(ply::Format),
    /// PCD.
    Pcd(pcd::Format),
}

impl CloudFormat {
    /// Every format by its name, in the words of the files' own headers; the short names `ply` and `pcd` are their binary forms.
    pub const NAMES: [(&str, Self); 7] = [
        ("ply", Self::Ply(ply::Format::BinaryLittleEndian)),
        ("ply_ascii", Self::Ply(ply::Format::Ascii)),
        ("ply_binary", Self::Ply(ply::Format::BinaryLittleEndian)),
        ("pcd", Self::Pcd(pcd::Format::Binary)),
        ("pcd_ascii", Self::Pcd(pcd::Format::Ascii)),
        ("pcd_binary", Self::Pcd(pcd::Format::Binary)),
        ("pcd_binary_compressed", Self::Pcd(pcd::Format::BinaryCompressed)),
    ];

    /// The format of this name.
    ///
    /// # Errors
    /// When there is none; the error lists those there are.
    pub fn named(name: &str) -> Result<Self> {
        let known = Self::NAMES.iter().find(|(known, _)| *known == name);
        known.map(|(_, format)| *format).ok_or_else(|| {
            let names = Self::NAMES.map(|(name, _)| name).join(", ");
            Error::whole(format!("{name:?} is not a format of clouds"), format!("Use one of {names}"))
        })
    }
}

/// The bytes of a file with this cloud: positions (m), then normals and colours where the cloud has them.
pub fn write(cloud: &PointCloud, format: CloudFormat) -> Vec<u8> {
    match format {
        CloudFormat::Ply(format) => ply::write(cloud, format),
        CloudFormat::Pcd(format) => pcd::write(cloud, format),
    }
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
        for (name, format) in CloudFormat::NAMES {
            assert_eq!(CloudFormat::named(name).unwrap(), format);
            assert_eq!(read(&write(&cloud, format)).unwrap(), cloud, "{name}");
        }
        assert!(CloudFormat::named("pcd_lzf").unwrap_err().to_string().contains("pcd_binary_compressed"));
        assert!(read(b"\x89PNG\r\n\x1a\n").is_err() && !is_cloud(b"P5 1 1 255\n"));
    }
}
