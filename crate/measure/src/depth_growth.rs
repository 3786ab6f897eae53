//! Measures whether the time to register a frame grows with the map: the floors of ../shared/data/rgbd are walked to and fro, so
//! that the same images are registered to a growing map. `cargo measure depth_growth [--passes N] [--runs N]
//! [--open] [--color used|not_used] [--frames]` prints the time to register one frame (ms, the minimum of several runs for each
//! image), by pass, and for frames 20 to 40 and 100 to 120.

use std::time::Instant;

use scanstitch::pipeline::prepared_frame::{ColorFile, FrameLabel, PreparedFrame};
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::spatial::SpatialReconstruction;
use scanstitch::pipeline::spatial_settings::{ColorUse, LoopClosing, SpatialSettings};

use crate::arguments::{argument, flag};
use crate::depth::recordings::{self, Choice, Recording};

pub fn main() {
    if !recordings::are_there() {
        return;
    }
    let number = |name: &str, default: usize| argument(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let settings = SpatialSettings {
        loop_closing: if flag("--open") { LoopClosing::Off } else { LoopClosing::On },
        color: if argument("--color").as_deref() == Some("not_used") { ColorUse::NotUsed } else { ColorUse::Used },
        ..SpatialSettings::default()
    };
    let (passes, runs) = (number("--passes", 3), number("--runs", 3).max(1));
    for which in ["first", "second"] {
        let once = recordings::floor(which);
        let recording = Choice::ToAndFro(passes).apply(&once);
        let mut times = times(&recording, &settings);
        for _ in 1..runs {
            for (least, time) in times.iter_mut().zip(self::times(&recording, &settings)) {
                *least = least.min(time);
            }
        }
        report(&times, once.depth.len());
        if flag("--frames") {
            let of_image = |image: usize| {
                let times = (0..passes).map(|pass| times[place(image, pass, once.depth.len())]);
                times.map(|time| format!("{time:.1}")).collect::<Vec<_>>().join(" ")
            };
            (0..once.depth.len()).for_each(|image| println!("  image {image}: {}", of_image(image)));
        }
    }
}

/// Wall time to register each frame (ms).
fn times(recording: &Recording, settings: &SpatialSettings) -> Vec<f64> {
    let mut reconstruction = SpatialReconstruction::new(settings.clone()).expect("sound settings");
    let register = |(index, bytes): (usize, &Vec<u8>)| {
        let decode_config = reconstruction.begin("frame", bytes).expect("a depth image");
        let label = FrameLabel { name: index.to_string(), index, time: None };
        let color = recording.color.get(index).map(|bytes| ColorFile { name: "colours", bytes: Ok(bytes) });
        let frame = PreparedFrame::from_depth(decode_config, label, bytes, color).expect("a depth image");
        reconstruction.add(frame).expect("in order");
        let start = Instant::now();
        while reconstruction.step().stage != Stage::Done {}
        1000.0 * start.elapsed().as_secs_f64()
    };
    recording.depth.iter().enumerate().map(register).collect()
}

/// Index of an image in a pass.
fn place(image: usize, pass: usize, num_images: usize) -> usize {
    pass * num_images + if pass % 2 == 1 { num_images - 1 - image } else { image }
}

fn report(times: &[f64], num_images: usize) {
    let mean = |times: &mut dyn Iterator<Item = f64>| {
        let times: Vec<f64> = times.collect();
        times.iter().sum::<f64>() / times.len() as f64
    };
    let passes = times.len() / num_images;
    print!("{num_images} images, the same in every pass (ms a frame):");
    for pass in 0..passes {
        // The first images of a walk are registered with two ways of reading the depth.
        print!(" {:.2}", mean(&mut (20..num_images).map(|image| times[place(image, pass, num_images)])));
    }
    let window = |from: usize| mean(&mut times.get(from..from + 20).unwrap_or_default().iter().copied());
    println!("; frames 20 to 40: {:.2}, 100 to 120: {:.2}", window(20), window(100));
    // Where frames 100 to 120 of a walk to and fro show images seen before, those of the first pass are the measure.
    if passes > 1 && (num_images..2 * num_images).contains(&100) {
        let same = mean(&mut (100..120.min(2 * num_images)).map(|frame| times[2 * num_images - 1 - frame]));
        println!("  the images of frames 100 to 120 in the first pass: {same:.2}");
    }
}
