//! Programs that score the engine on recordings and on generated worlds, and that render the samples of the page:
//! `cargo measure PROGRAM [ARGUMENT]...`, or, built in seconds and nearly as fast, `cargo run --profile quick --package
//! scanstitch-measure -- PROGRAM [ARGUMENT]...`. The file of each says what it does and what it takes.
#![allow(non_snake_case)]

mod apartment;
mod arguments;
mod bare_corridor;
mod cloud_scores;
mod cloud_surfaces;
mod course_pipeline;
mod depth;
mod depth_camera;
mod depth_growth;
mod depth_odometry;
mod depth_scores;
mod depth_values;
mod global;
mod global_pairs;
mod gyro;
mod hand_held;
mod kitti_pair;
mod laser_log;
mod laser_scores;
mod lidar_sweeps;
mod localize;
mod moving;
mod render_and_register;
mod render_apartment;
mod render_laser_log;
mod render_samples;
mod streets;
mod surface_scores;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1).unwrap_or_default().as_str() {
        "bare_corridor" => bare_corridor::main(),
        "cloud_scores" => cloud_scores::main(),
        "cloud_surfaces" => cloud_surfaces::main()?,
        "course_pipeline" => course_pipeline::main(),
        "depth_camera" => depth_camera::main(),
        "depth_growth" => depth_growth::main(),
        "depth_odometry" => depth_odometry::main(),
        "depth_scores" => depth_scores::main(),
        "depth_values" => depth_values::main(),
        "global_pairs" => global_pairs::main(),
        "gyro" => gyro::main(),
        "hand_held" => hand_held::main(),
        "kitti_pair" => kitti_pair::main(),
        "laser_log" => laser_log::main(),
        "laser_scores" => laser_scores::main(),
        "lidar_sweeps" => lidar_sweeps::main(),
        "localize" => localize::main(),
        "moving" => moving::main(),
        "render_and_register" => render_and_register::main()?,
        "render_apartment" => render_apartment::main()?,
        "render_laser_log" => render_laser_log::main()?,
        "render_samples" => render_samples::main()?,
        "streets" => streets::main(),
        "surface_scores" => surface_scores::main()?,
        other => return Err(format!("no program is called {other:?}; there are those of crate/measure/src").into()),
    }
    Ok(())
}
