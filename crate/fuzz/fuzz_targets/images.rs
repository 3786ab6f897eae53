//! Any bytes as a depth image and as a colour image: no panic, and as many pixels as the size says.
#![no_main]

mod peak;

use libfuzzer_sys::fuzz_target;
use peak::watched;
use scanstitch::io::{color_image, depth_image};

fuzz_target!(|bytes: &[u8]| watched(bytes, |bytes| {
    if let Ok(depth) = depth_image::read(bytes) {
        assert_eq!(depth.values.len(), depth.width * depth.height);
    }
    if let Ok(color) = color_image::read(bytes) {
        assert_eq!(color.pixels.len(), color.width * color.height);
    }
}));
