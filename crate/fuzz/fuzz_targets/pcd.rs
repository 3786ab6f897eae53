//! Any bytes: no panic, and what is read, written and read again is the same, packed or not.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scanstitch::geometry::PointCloud;
use scanstitch::io::pcd::{Format, read, write};

/// The bits of the positions with the origin in them, of normals and of colours: NaN equals itself.
fn bits(cloud: &PointCloud) -> Vec<u64> {
    let bits = |value: f64| if value.is_nan() { u64::MAX } else { value.to_bits() };
    let positions = cloud.positions.iter().flat_map(|p| (p.as_dvec3() + cloud.origin).to_array());
    let normals = cloud.normals.iter().flatten().flat_map(|n| n.as_dvec3().to_array());
    let colors = cloud.colors.iter().flatten().flatten().map(|&channel| u64::from(channel));
    positions.chain(normals).map(bits).chain(colors).collect()
}

fuzz_target!(|bytes: &[u8]| {
    let Ok(cloud) = read(bytes) else { return };
    for format in [Format::Ascii, Format::Binary, Format::BinaryCompressed] {
        let again = read(&write(&cloud, format)).expect("a file written by us is read");
        assert_eq!(again.len(), cloud.len());
        // Far coordinates are written in single precision, and read apart from an origin.
        if cloud.origin == glam::DVec3::ZERO && again.origin == glam::DVec3::ZERO {
            assert_eq!(bits(&again), bits(&cloud));
        }
    }
});
