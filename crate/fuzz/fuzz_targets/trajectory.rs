//! Any bytes: no panic, and poses that are read, written and read again are the same.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scanstitch::io::relations;
use scanstitch::io::trajectory::{read, read_lenient, read_times, read_tum, tum_text};

fuzz_target!(|bytes: &[u8]| {
    let _ = (relations::read(bytes), read_times(bytes), read_lenient(bytes, None));
    let Ok(trajectory) = read(bytes) else { return };
    assert!(trajectory.positions.iter().all(|position| position.iter().all(|value| value.is_finite())));
    if let Some(poses) = trajectory.poses() {
        let again = read_tum(tum_text(trajectory.stamps.as_deref(), &poses).as_bytes()).expect("written by us");
        assert_eq!(again.positions, trajectory.positions);
        assert!(trajectory.stamps.is_none() || again.stamps == trajectory.stamps);
    }
});
