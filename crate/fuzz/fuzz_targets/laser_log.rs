//! Any bytes: no panic, and scans with as many readings at the most as there were bytes.
#![no_main]

mod peak;

use libfuzzer_sys::fuzz_target;
use peak::watched;
use scanstitch::io::laser_log::table::read_given;
use scanstitch::io::laser_log::{is_laser_log, read};

fuzz_target!(|bytes: &[u8]| watched(bytes, |bytes| {
    let _ = is_laser_log(bytes);
    for format in ["range=2,angle=1:deg", "ranges=1:2,start=0,step=1deg"] {
        let _ = read_given(bytes, format);
    }
    let Ok(log) = read(bytes) else { return };
    assert!(!log.scans.is_empty());
    assert!(log.scans.iter().map(|scan| scan.ranges.len()).sum::<usize>() <= bytes.len());
    for scan in &log.scans {
        assert!(scan.points().len() <= scan.ranges.len());
        assert!(scan.ranges.iter().all(|range| range.is_nan() || *range >= 0.0));
    }
}));
