//! Renders walks through synthetic flats and registers their depth images: `cargo measure render_and_register
//! [--seeds N] [--frames N] [--tour rooms|pier] [--step METRES] [--turn DEGREES] [--every N]
//! [--depth 8|16] [--noise PER_METRE] [--each]`. Prints one line per seed: how difficult the recording is, and the error of the
//! estimate.

use std::error::Error;

use scanstitch::camera::Pinhole;
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::pipeline::spatial::SpatialReconstruction;
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch::preprocess::depth_surfels::{DepthModel, depth_surfels};
use scanstitch::preprocess::wrap_around::usable_pixels;
use scanstitch_scene::apartment::{Apartment, Tour, WalkOptions};
use scanstitch_scene::random::Random;
use scanstitch_scene::space::DepthSensor;

use crate::apartment::registering;
use crate::arguments::{argument, flag};

pub fn main() -> Result<(), Box<dyn Error>> {
    let number = |name: &str, default: f64| argument(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let each = flag("--each");
    let options = WalkOptions {
        tour: if argument("--tour").as_deref() == Some("pier") { Tour::Pier } else { Tour::AllRooms },
        step: number("--step", 0.25),
        turn: number("--turn", 10.0).to_radians(),
        num_frames: Some(number("--frames", 1e6) as usize),
        ..WalkOptions::default()
    };
    let sensor = if number("--depth", 8.0) > 8.0 {
        DepthSensor::Millimetres { square_noise: number("--noise", 0.0) }
    } else {
        DepthSensor::HOMEWORK
    };
    let camera = Pinhole::from_field_of_view(512, 512, std::f64::consts::FRAC_PI_2)?;
    let first = number("--first", 1.0) as u64;
    for seed in first..first + number("--seeds", 10.0) as u64 {
        let apartment = Apartment::generate(seed);
        let walk = apartment.walk(&options);
        let walk: Vec<Pose3> = walk.into_iter().step_by(number("--every", 1.0) as usize).collect();
        let mut images = Vec::new();
        let (mut usable_share, mut surfel_share) = (0.0, 0.0);
        for (index, pose) in walk.iter().enumerate() {
            let depth = apartment.space.depth(pose, &camera);
            let image = sensor.measure(&depth, camera.width, &mut Random::new(seed * 1000 + index as u64));
            let usable = usable_pixels(&image);
            let model = if image.bits == 8 {
                DepthModel { step: 10.0 / 255.0, offset: 0.5, square_noise: 0.0, min_range: 0.1, max_range: 10.0 }
            } else {
                DepthModel { step: 1e-3, offset: 0.0, square_noise: 2e-3, min_range: 0.1, max_range: 10.0 }
            };
            let surfels = depth_surfels(&image, &usable, &camera, &model);
            usable_share += usable.iter().filter(|usable| **usable).count() as f64 / usable.len() as f64;
            surfel_share += surfels.surfels().count() as f64 / surfels.cells.len() as f64;
            images.push(image);
        }
        let reconstruction = registering::reconstruct(SpatialSettings::default(), &images)?;
        report(seed, &walk, &reconstruction, [usable_share, surfel_share], each);
    }
    Ok(())
}

/// Prints one line, and with `each` one for every frame.
fn report(seed: u64, walk: &[Pose3], reconstruction: &SpatialReconstruction, shares: [f64; 2], each: bool) {
    let (poses, count) = (reconstruction.poses(), walk.len() as f64);
    let truth: Vec<Pose3> = walk.iter().map(|pose| walk[0].inverse() * pose).collect();
    let error = |index: usize| (poses[index].translation.vector - truth[index].translation.vector).norm();
    let mut counts = [0; 3];
    let (mut overlap, mut worst) = (0.0, [(0.0f64, 0), (0.0f64, 0)]);
    for (index, estimate) in reconstruction.estimates().iter().enumerate() {
        counts[estimate.assessment.status as usize] += 1;
        overlap += estimate.overlap / count;
        let before = index.saturating_sub(1);
        let (step, true_step) = (poses[before].inverse() * poses[index], truth[before].inverse() * truth[index]);
        let off = true_step.inverse() * step;
        for (worst, off) in worst.iter_mut().zip([off.translation_norm(), off.rotation_angle().to_degrees()]) {
            if off > worst.0 {
                *worst = (off, index);
            }
        }
        if each {
            println!(
                "  {index:3} error {:.3} m, step off {:.3} m {:.2} deg; {:?} agreement {:.2} overlap {:.2} {}",
                error(index),
                off.translation_norm(),
                off.rotation_angle().to_degrees(),
                estimate.assessment.status,
                estimate.assessment.agreement,
                estimate.overlap,
                estimate.assessment.reason
            );
        }
    }
    println!(
        "seed {seed}: {} frames, mean L2 {:.3} m, last {:.3} m, worst step {:.3} m (frame {}) {:.2} deg (frame {}); good, \
         doubtful, lost {counts:?}; usable pixels {:.3}, cells with a surfel {:.3}, overlap {overlap:.3}, {:?}",
        walk.len(),
        (0..walk.len()).map(error).sum::<f64>() / count,
        error(walk.len() - 1),
        worst[0].0,
        worst[0].1,
        worst[1].0,
        worst[1].1,
        shares[0] / count,
        shares[1] / count,
        reconstruction.quantisation()
    );
}
