//! Renders the samples of the page: `cargo measure render_samples` renders all committed ones. One of them, or
//! another drive: `[--place corridor|office|apartment|bev] [--out DIR]`, and for the first two `[--seed N]
//! [--scans N] [--beams N] [--noise METRES]`. Other walks through other flats: the example `render_apartment`.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use nalgebra::Vector2;
use scanstitch::io::trajectory::{in_space, tum_text};
use scanstitch_scene::corridor::{self, CorridorOptions};
use scanstitch_scene::laser::Laser;
use scanstitch_scene::office::{self, OfficeOptions};
use scanstitch_scene::samples;
use scanstitch_scene::space::DepthSensor;

use crate::apartment::recording;
use crate::arguments::arguments;

const CORRIDOR: &str = "www/samples/corridor";
const APARTMENT: &str = "www/samples/apartment";
const BEV: &str = "www/samples/bev";
const OPTIONS: &str = "--place, --out, --seed, --scans, --beams and --noise";

pub fn main() -> Result<(), Box<dyn Error>> {
    if arguments().is_empty() {
        render_drive("corridor", None, None, Laser::default(), Path::new(CORRIDOR))?;
        render_apartment(Path::new(APARTMENT))?;
        return render_bev(Path::new(BEV));
    }
    let mut place = "corridor".to_owned();
    let (mut seed, mut num_scans, mut laser, mut out) = (None, None, Laser::default(), None);
    let mut arguments = arguments().into_iter();
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
        match name.as_str() {
            "--out" => out = Some(PathBuf::from(value)),
            "--place" => place = value,
            "--seed" => seed = Some(number(&name, &value)?),
            "--scans" => num_scans = Some(number(&name, &value)?),
            "--beams" => laser.num_beams = number(&name, &value)?,
            "--noise" => laser.noise_sigma = number(&name, &value)?,
            _ => return Err(format!("{name} is no option; {OPTIONS} are").into()),
        }
    }
    if !laser.noise_sigma.is_finite() || laser.noise_sigma < 0.0 {
        return Err(format!("--noise is a standard deviation in metres, 0 or more, not {}", laser.noise_sigma).into());
    }

    let out_or = |committed: &str| out.clone().unwrap_or_else(|| PathBuf::from(committed));
    match place.as_str() {
        "corridor" => render_drive(&place, seed, num_scans, laser, &out_or(CORRIDOR)),
        "office" => match &out {
            Some(out) => render_drive(&place, seed, num_scans, laser, out),
            None => Err("an office is no committed sample: --out says where to put it".into()),
        },
        "apartment" => render_apartment(&out_or(APARTMENT)),
        "bev" => render_bev(&out_or(BEV)),
        _ => Err(format!("--place is corridor, office, apartment or bev, not {place}").into()),
    }
}

/// A drive with a planar laser.
fn render_drive(
    place: &str,
    seed: Option<u64>,
    num_scans: Option<usize>,
    laser: Laser,
    out: &Path,
) -> Result<(), Box<dyn Error>> {
    let recording = if place == "corridor" {
        let default = CorridorOptions::default();
        let (seed, num_scans) = (seed.unwrap_or(default.seed), num_scans.unwrap_or(default.num_scans));
        corridor::generate(&CorridorOptions { seed, num_scans, laser })
    } else {
        let default = OfficeOptions::default();
        let (seed, num_scans) = (seed.unwrap_or(default.seed), num_scans.unwrap_or(default.num_scans));
        office::generate(&OfficeOptions { seed, num_scans, laser })
    };
    fs::create_dir_all(out)?;
    for (index, scan) in recording.scans.iter().enumerate() {
        fs::write(out.join(format!("{index}.ply")), ply_of_doubles(scan))?;
    }
    let poses: Vec<_> = recording.T_world_sensor.iter().map(in_space).collect();
    fs::write(out.join("truth.tum"), tum_text(None, &poses))?;
    println!("{} scans and their true trajectory are in {}", recording.scans.len(), out.display());
    Ok(())
}

/// A walk through the flat with the homework's camera.
fn render_apartment(out: &Path) -> Result<(), Box<dyn Error>> {
    let sample = samples::apartment()?;
    let walk = &sample.T_world_camera;
    recording::write_recording(out, &sample.apartment, &sample.camera, walk, DepthSensor::HOMEWORK, 0)?;
    println!("{} frames and their true poses are in {}", walk.len(), out.display());
    Ok(())
}

/// A top and a front view of one room.
fn render_bev(out: &Path) -> Result<(), Box<dyn Error>> {
    let sample = samples::bev()?;
    fs::create_dir_all(out)?;
    for (name, pose) in ["top", "front"].into_iter().zip(&sample.T_world_camera) {
        let frame = sample.apartment.space.render(pose, &sample.camera);
        fs::write(out.join(format!("{name}.jpg")), recording::jpeg(&frame)?)?;
    }
    let [top, front] = [&sample.T_world_camera[0], &sample.T_world_camera[1]];
    fs::write(out.join("scene.json"), recording::bev_scene(&sample.camera, [top, front]))?;
    println!("both views and their cameras are in {}", out.display());
    Ok(())
}

fn number<T: FromStr>(name: &str, value: &str) -> Result<T, String> {
    value.parse().map_err(|_| format!("{name} needs a number, not {value}"))
}

/// A scan the way the homework's files hold it: ASCII, doubles, z = 0; to a tenth of a millimetre, a hundredth of the noise.
fn ply_of_doubles(points: &[Vector2<f64>]) -> String {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", points.len());
    text += "property double x\nproperty double y\nproperty double z\nend_header\n";
    for point in points {
        let _ = writeln!(text, "{:.4} {:.4} {:.4}", point.x, point.y, 0.0);
    }
    text
}
