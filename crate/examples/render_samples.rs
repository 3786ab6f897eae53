//! Renders the samples of the page: `cargo run --release --example render_samples [--place corridor|office] [--out DIR]
//! [--seed N] [--scans N] [--beams N] [--noise METRES]`. Without options, the committed ones.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::str::FromStr;

use nalgebra::Vector2;
use scanstitch::io::trajectory::{in_space, tum_text};
use scanstitch::scene::corridor::{self, CorridorOptions};
use scanstitch::scene::laser::Laser;
use scanstitch::scene::office::{self, OfficeOptions};

const OPTIONS: &str = "--place, --out, --seed, --scans, --beams and --noise";

fn main() -> Result<(), Box<dyn Error>> {
    let mut place = "corridor".to_owned();
    let (mut seed, mut num_scans, mut laser, mut out) = (None, None, Laser::default(), None);
    let mut arguments = std::env::args().skip(1);
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

    let recording = match place.as_str() {
        "corridor" => {
            let default = CorridorOptions::default();
            let (seed, num_scans) = (seed.unwrap_or(default.seed), num_scans.unwrap_or(default.num_scans));
            corridor::generate(&CorridorOptions { seed, num_scans, laser })
        }
        "office" => {
            let default = OfficeOptions::default();
            let (seed, num_scans) = (seed.unwrap_or(default.seed), num_scans.unwrap_or(default.num_scans));
            office::generate(&OfficeOptions { seed, num_scans, laser })
        }
        _ => return Err(format!("--place is corridor or office, not {place}").into()),
    };
    let out = match (out, place.as_str()) {
        (Some(out), _) => out,
        (None, "corridor") => PathBuf::from("www/samples/corridor"),
        (None, _) => return Err(format!("an {place} is no committed sample: --out says where to put it").into()),
    };
    fs::create_dir_all(&out)?;
    for (index, scan) in recording.scans.iter().enumerate() {
        fs::write(out.join(format!("{index}.ply")), ply_of_doubles(scan))?;
    }
    let poses: Vec<_> = recording.T_world_sensor.iter().map(in_space).collect();
    fs::write(out.join("truth.tum"), tum_text(None, &poses))?;
    println!("{} scans and their true trajectory are in {}", recording.scans.len(), out.display());
    Ok(())
}

fn number<T: FromStr>(name: &str, value: &str) -> Result<T, String> {
    value.parse().map_err(|_| format!("{name} needs a number, not {value}"))
}

/// A scan the way the homework's files hold it: ASCII, doubles, z = 0.
fn ply_of_doubles(points: &[Vector2<f64>]) -> String {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", points.len());
    text += "property double x\nproperty double y\nproperty double z\nend_header\n";
    for point in points {
        let _ = writeln!(text, "{:.15} {:.15} {:.15}", point.x, point.y, 0.0);
    }
    text
}
