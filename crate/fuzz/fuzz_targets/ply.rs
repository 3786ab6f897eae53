//! Any bytes: no panic, and what is read, written and read again is the same.
#![no_main]

mod cloud_bits;
mod peak;

use cloud_bits::bits;
use libfuzzer_sys::fuzz_target;
use peak::watched;
use scanstitch::io::ply::{Format, read, write};

fuzz_target!(|bytes: &[u8]| watched(bytes, |bytes| {
    let Ok(cloud) = read(bytes) else { return };
    // Values take a byte each at the least, so a point of x and y takes two.
    assert!(cloud.len() <= bytes.len() / 2);
    for format in [Format::Ascii, Format::BinaryLittleEndian] {
        let again = read(&write(&cloud, format)).expect("a file written by us is read");
        // Reading far coordinates rounds them to single precision once more.
        if again.origin == cloud.origin {
            assert_eq!(bits(&again), bits(&cloud));
        }
    }
}));
