//! Any bytes: no panic, and poses that are read, written and read again are the same.
#![no_main]

mod peak;

use libfuzzer_sys::fuzz_target;
use peak::watched;
use scanstitch::io::trajectory::{read, read_lenient, read_times, read_tum, tum_text};
use scanstitch::io::{intrinsics, relations};

fuzz_target!(|bytes: &[u8]| watched(bytes, |bytes| {
    let _ = (intrinsics::read(bytes), relations::read(bytes), read_times(bytes), read_lenient(bytes, None));
    let Ok(trajectory) = read(bytes) else { return };
    assert!(trajectory.positions.iter().all(|position| position.iter().all(|value| value.is_finite())));
    if let Some(poses) = trajectory.poses() {
        let again = read_tum(tum_text(trajectory.stamps.as_deref(), &poses).as_bytes()).expect("written by us");
        assert_eq!(again.positions, trajectory.positions);
        assert!(trajectory.stamps.is_none() || again.stamps == trajectory.stamps);
    }
}));
