//! Renders a walk through a synthetic flat: `cargo measure render_apartment --out DIR [--seed N]
//! [--walk N] [--tour rooms|pier] [--step METRES] [--turn DEGREES] [--frames N] [--every N] [--depth 8|8-rounded|16]
//! [--noise PER_METRE] [--size PIXELS]`. The folder has the homework's layout: `rgb/N.jpg`, `depth/N.png`,
//! `GT_pose.npy`.

use std::error::Error;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Instant;

use scanstitch::camera::Pinhole;
use scanstitch_scene::apartment::{Apartment, Tour, WalkOptions};
use scanstitch_scene::space::DepthSensor;

use crate::apartment::recording;
use crate::arguments::arguments;

const OPTIONS: &str = "--out, --seed, --walk, --tour, --step, --turn, --frames, --every, --depth, --noise and --size";

pub fn main() -> Result<(), Box<dyn Error>> {
    let (mut seed, mut options, mut out) = (1u64, WalkOptions::default(), None);
    let (mut every, mut depth, mut noise, mut size) = (1usize, "8".to_owned(), 0.0, 512usize);
    let mut arguments = arguments().into_iter();
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
        match name.as_str() {
            "--out" => out = Some(PathBuf::from(value)),
            "--seed" => seed = number(&name, &value)?,
            "--walk" => options.seed = number(&name, &value)?,
            "--tour" => {
                options.tour = match value.as_str() {
                    "rooms" => Tour::AllRooms,
                    "pier" => Tour::Pier,
                    _ => return Err(format!("--tour is rooms or pier, not {value}").into()),
                }
            }
            "--step" => options.step = number(&name, &value)?,
            "--turn" => options.turn = number::<f64>(&name, &value)?.to_radians(),
            "--frames" => options.num_frames = Some(number(&name, &value)?),
            "--every" => every = number::<usize>(&name, &value)?.max(1),
            "--depth" => depth = value,
            "--noise" => noise = number(&name, &value)?,
            "--size" => size = number(&name, &value)?,
            _ => return Err(format!("{name} is no option; {OPTIONS} are").into()),
        }
    }
    let sensor = match depth.as_str() {
        "8" => DepthSensor::HOMEWORK,
        "8-rounded" => DepthSensor::EightBits { rounded: true, wraps: true },
        "16" => DepthSensor::Millimetres { square_noise: noise },
        _ => return Err(format!("--depth is 8, 8-rounded or 16, not {depth}").into()),
    };
    let out = out.ok_or("--out says where to put it")?;

    let start = Instant::now();
    let apartment = Apartment::generate(seed);
    let walk: Vec<_> = apartment.walk(&options).into_iter().step_by(every).collect();
    if walk.is_empty() {
        return Err("no walk was found: take a shorter step or a smaller turn".into());
    }
    println!(
        "{} rooms, {:.0} m2, {} solids; a walk of {} frames ({:.1} s)",
        apartment.plan.rooms.len(),
        apartment.plan.area(),
        apartment.space.solids().len(),
        walk.len(),
        start.elapsed().as_secs_f64()
    );
    let camera = Pinhole::from_field_of_view(size, size, std::f64::consts::FRAC_PI_2)?;
    let start = Instant::now();
    recording::write_recording(&out, &apartment, &camera, &walk, sensor, seed)?;
    println!("{} s a frame; in {}", start.elapsed().as_secs_f64() / walk.len() as f64, out.display());
    Ok(())
}

fn number<T: FromStr>(name: &str, value: &str) -> Result<T, String> {
    value.parse().map_err(|_| format!("{name} needs a number, not {value}"))
}
