//! Clouds in E57 and LAZ, and files packed by bzip2, unpacked: a part of the engine of its own, which is fetched when such a file
//! comes.
//!
//! E57 is read by the crate `e57`, scan by scan, each in the frame of its scanner; LAZ is unpacked by the crate `laz` into the LAS that
//! it was packed from.

use std::io::Cursor;

use e57::{CartesianCoordinate, E57Reader};
use laz::{LasZipDecompressor, LazVlr};

pub mod bzip2;
#[cfg(target_arch = "wasm32")]
mod wasm;

/// A scan of an E57 file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scan {
    /// x y z, point by point (m), in the frame of the scanner.
    pub positions: Vec<f64>,
    /// Red, green, blue, point by point; empty where the scan has none.
    pub colors: Vec<u8>,
    /// Points without coordinates, which are left out.
    pub num_invalid: usize,
}

/// The scans of an E57 file.
///
/// # Errors
/// When the file is damaged, in the words of the crate `e57`.
pub fn read_e57(bytes: &[u8]) -> Result<Vec<Scan>, String> {
    let words = |error: e57::Error| error.to_string();
    E57Reader::validate_crc(Cursor::new(bytes)).map_err(words)?;
    let mut reader = E57Reader::new(Cursor::new(bytes)).map_err(words)?;
    let mut scans = Vec::new();
    for cloud in reader.pointclouds() {
        let mut points = reader.pointcloud_simple(&cloud).map_err(words)?;
        points.apply_pose(false);
        points.intensity_to_color(false);
        let mut scan = Scan::default();
        for point in points {
            let point = point.map_err(words)?;
            let CartesianCoordinate::Valid { x, y, z } = point.cartesian else {
                scan.num_invalid += 1;
                continue;
            };
            scan.positions.extend([x, y, z]);
            if cloud.has_color() {
                let color = point.color.map_or([0.0; 3], |color| [color.red, color.green, color.blue]);
                scan.colors.extend(color.map(|value| (255.0 * value).round() as u8));
            }
        }
        scans.push(scan);
    }
    Ok(scans)
}

/// Points that are unpacked at a time: what a header claims is not believed.
const POINTS_AT_ONCE: usize = 1 << 14;
/// Of a variable length record: reserved, user, number, length, description.
const RECORD_HEADER: usize = 54;
/// What says how the points were packed.
const PACKING: (&[u8], u16) = (b"laszip encoded", 22_204);
/// The bits of a point's format that say that it is packed.
const PACKED: u8 = 0xc0;

/// The LAS that a LAZ was packed from: its header and its points, as far as they can be unpacked.
///
/// # Errors
/// When it is no LAZ, or damaged before its first point.
pub fn unpack_laz(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let short = || "The file ends within its header".to_owned();
    let number = |at: usize, length: usize| -> Result<usize, String> {
        let part = bytes.get(at..at + length).ok_or_else(short)?;
        Ok(part.iter().rev().fold(0, |value, &byte| value << 8 | usize::from(byte)))
    };
    let (header, start, num_records) = (number(94, 2)?, number(96, 4)?, number(100, 4)?);
    let (size, legacy_count) = (number(105, 2)?, number(107, 4)?);
    let count = if legacy_count == 0 && number(25, 1)? >= 4 { number(247, 8)? } else { legacy_count };
    let mut at = header;
    let mut packing = None;
    for _ in 0..num_records {
        let length = number(at + 20, 2)?;
        let record = bytes.get(at..at + RECORD_HEADER + length).ok_or_else(short)?;
        if record[2..].starts_with(PACKING.0) && number(at + 18, 2)? == usize::from(PACKING.1) {
            packing = Some(LazVlr::read_from(&record[RECORD_HEADER..]).map_err(|error| error.to_string())?);
        }
        at += RECORD_HEADER + length;
    }
    let packing = packing.ok_or("It does not say how its points are packed")?;
    let mut las = bytes.get(..start).ok_or_else(short)?.to_vec();
    las[104] &= !PACKED;
    let mut source = Cursor::new(bytes);
    source.set_position(start as u64);
    let mut points = LasZipDecompressor::new(source, packing).map_err(|error| error.to_string())?;
    for first in (0..count).step_by(POINTS_AT_ONCE) {
        let mut some = vec![0; size * POINTS_AT_ONCE.min(count - first)];
        match points.decompress_many(&mut some) {
            Ok(()) => las.extend(some),
            Err(error) if first == 0 => return Err(error.to_string()),
            // The number of points tells what is missing.
            Err(_) => break,
        }
    }
    Ok(las)
}
