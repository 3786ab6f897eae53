//! Renders the samples of the page: `cargo run --release --example render_samples [--out DIR] [--seed N] [--scans N]
//! [--beams N] [--noise METRES]`. Without options, the committed ones.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use nalgebra::Vector2;
use scanstitch::io::trajectory::{in_space, tum_text};
use scanstitch::scene::corridor::{CorridorOptions, generate};

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = CorridorOptions::default();
    let mut out = PathBuf::from("www/samples/corridor");
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
        match name.as_str() {
            "--out" => out = value.into(),
            "--seed" => options.seed = value.parse()?,
            "--scans" => options.num_scans = value.parse()?,
            "--beams" => options.laser.num_beams = value.parse()?,
            "--noise" => options.laser.noise_sigma = value.parse()?,
            _ => return Err(format!("{name} is no option; --out, --seed, --scans, --beams and --noise are").into()),
        }
    }

    let recording = generate(&options);
    fs::create_dir_all(&out)?;
    for (index, scan) in recording.scans.iter().enumerate() {
        fs::write(out.join(format!("{index}.ply")), ply_of_doubles(scan))?;
    }
    let poses: Vec<_> = recording.T_world_sensor.iter().map(in_space).collect();
    fs::write(out.join("truth.tum"), tum_text(None, &poses))?;
    println!("{} scans and their true trajectory are in {}", recording.scans.len(), out.display());
    Ok(())
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
