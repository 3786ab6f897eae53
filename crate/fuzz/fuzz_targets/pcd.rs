//! Any bytes: no panic, and what is read, written and read again is the same, packed or not.
#![no_main]

mod cloud_bits;
mod peak;

use cloud_bits::bits;
use libfuzzer_sys::fuzz_target;
use peak::watched;
use scanstitch::io::pcd::{Format, read, write};

fuzz_target!(|bytes: &[u8]| watched(bytes, |bytes| {
    let Ok(cloud) = read(bytes) else { return };
    for format in [Format::Ascii, Format::Binary, Format::BinaryCompressed] {
        let again = read(&write(&cloud, format)).expect("a file written by us is read");
        assert_eq!(again.len(), cloud.len());
        // Far coordinates are written in single precision, and read apart from an origin.
        if cloud.origin == glam::DVec3::ZERO && again.origin == glam::DVec3::ZERO {
            assert_eq!(bits(&again), bits(&cloud));
        }
    }
}));
