//! The benchmarks, each a name and a function that prepares its input and returns the closure to time.

use std::fmt::Write as _;
use std::hint::black_box;

use scanstitch::evaluation::alignment::Alignment;
use scanstitch::evaluation::evaluate::{EvaluationOptions, evaluate};
use scanstitch::evaluation::metrics::PoseRelation;
use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::io::ply;
use scanstitch::io::trajectory;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::settings::Settings;
use scanstitch::preprocess::planar_scan::PlanarScan;
use scanstitch::registration::factors::PointToPlane;
use scanstitch::registration::icp::{Source, register};
use scanstitch::registration::target::OrientedTarget;
use scanstitch::search::KdTree;
use scanstitch_scene::corridor::{self, CorridorOptions};

use crate::benchmark::{Benchmark, Files, Prepared};
#[cfg(feature = "peers")]
use crate::peers::PEER_BENCHMARKS;
use crate::spatial::{DEPTH_BENCHMARKS, PAIR_BENCHMARKS};

/// All benchmarks, in the order they are run and printed.
pub fn benchmarks() -> impl Iterator<Item = &'static Benchmark> {
    [PLANAR_BENCHMARKS, DEPTH_BENCHMARKS, PAIR_BENCHMARKS, PEER_BENCHMARKS].into_iter().flatten()
}

#[cfg(not(feature = "peers"))]
const PEER_BENCHMARKS: &[Benchmark] = &[];

const PLANAR_BENCHMARKS: &[Benchmark] = &[
    Benchmark {
        name: "copy_binary",
        about: "copying the bytes that ply_binary reads: the pace it is judged by",
        prepare: |_| Ok(copy(binary_ply(MILLION))),
    },
    Benchmark {
        name: "ply_binary",
        about: "reading a binary PLY file of 1 M points (float x, y, z)",
        prepare: |_| read(binary_ply(MILLION)),
    },
    Benchmark {
        name: "copy_ascii",
        about: "copying the bytes that ply_ascii reads",
        prepare: |_| Ok(copy(ascii_ply(MILLION))),
    },
    Benchmark {
        name: "ply_ascii",
        about: "reading an ASCII PLY file of 1 M points (to the micrometre)",
        prepare: |_| read(ascii_ply(MILLION)),
    },
    Benchmark {
        name: "evaluate",
        about: "comparing a trajectory of 100 k poses with the truth: Sim(3), full transformation, drift",
        prepare: |_| evaluate_poses(),
    },
    Benchmark {
        name: "index_build_2d",
        about: "building the index of 100 k points in the plane",
        prepare: |_| Ok(build_index::<2>()),
    },
    Benchmark {
        name: "index_query_2d",
        about: "the nearest of 100 k points in the plane for 100 k others",
        prepare: |_| Ok(query_index::<2>()),
    },
    Benchmark {
        name: "index_build_3d",
        about: "building the index of 100 k points in space",
        prepare: |_| Ok(build_index::<3>()),
    },
    Benchmark {
        name: "index_query_3d",
        about: "the nearest of 100 k points in space for 100 k others",
        prepare: |_| Ok(query_index::<3>()),
    },
    Benchmark {
        name: "icp_iteration",
        about: "one point-to-line iteration: a scan of 180 returns against five",
        prepare: |_| Ok(icp_iteration()),
    },
    Benchmark {
        name: "reconstruct_files",
        about: "the whole run, from the bytes of the files to trajectory and map",
        prepare: reconstruct,
    },
];

const MILLION: usize = 1_000_000;
const HUNDRED_THOUSAND: usize = 100_000;

/// Copies the bytes into a new vector.
fn copy(bytes: Vec<u8>) -> Prepared {
    Prepared {
        work: Some((bytes.len() as f64, "bytes")),
        run: Box::new(move || {
            black_box(black_box(&bytes).clone());
        }),
    }
}

/// Reads a PLY file.
fn read(bytes: Vec<u8>) -> Result<Prepared, String> {
    ply::read(&bytes).map_err(|error| error.to_string())?;
    Ok(Prepared {
        work: Some((bytes.len() as f64, "bytes")),
        run: Box::new(move || {
            black_box(ply::read(black_box(&bytes)).ok());
        }),
    })
}

/// A path with as many poses as other benchmarks have points, and an estimate with an error of a centimetre.
fn evaluate_poses() -> Result<Prepared, String> {
    let path = |noise: f64| {
        let mut text = String::new();
        for index in 0..HUNDRED_THOUSAND {
            let s = index as f64 / 4000.0;
            let off = noise * (index as f64 * 0.37).sin();
            let (x, y, z) = (30.0 * s.sin() + off, 20.0 * (0.6 * s).sin(), 2.0 * s.cos() - off);
            let (sin, cos) = (s / 2.0).sin_cos();
            let _ = writeln!(text, "{} {x} {y} {z} 0 0 {sin} {cos}", index as f64 / 100.0);
        }
        trajectory::read(text.as_bytes()).map_err(|error| error.to_string())
    };
    let (reference, estimate) = (path(0.0)?, path(0.01)?);
    let relation = PoseRelation::FullTransformation;
    let options = EvaluationOptions { alignment: Alignment::Sim3, relation, ..EvaluationOptions::default() };
    Ok(Prepared {
        work: Some((HUNDRED_THOUSAND as f64, "poses")),
        run: Box::new(move || {
            let found = evaluate(black_box(&reference), black_box(&estimate), &options);
            assert!(black_box(found).is_ok());
        }),
    })
}

fn build_index<const D: usize>() -> Prepared {
    let points = points::<D>(HUNDRED_THOUSAND, 0);
    Prepared {
        work: Some((points.len() as f64, "points")),
        run: Box::new(move || {
            black_box(KdTree::build(black_box(&points)));
        }),
    }
}

fn query_index<const D: usize>() -> Prepared {
    let tree = KdTree::build(&points::<D>(HUNDRED_THOUSAND, 0));
    let queries = points::<D>(HUNDRED_THOUSAND, 1);
    Prepared {
        work: Some((queries.len() as f64, "queries")),
        run: Box::new(move || {
            for query in &queries {
                black_box(tree.nearest(black_box(query), f32::INFINITY));
            }
        }),
    }
}

/// Registers the last of six scans along a corridor to the five before it, from a guess with an error of 3 cm.
fn icp_iteration() -> Prepared {
    let recording = corridor::generate(&CorridorOptions { num_scans: 6, ..CorridorOptions::default() });
    let scans: Vec<(Pose2, PlanarScan)> =
        recording.T_world_sensor.into_iter().zip(recording.scans.into_iter().map(PlanarScan::new)).collect();
    let (last, earlier) = (&scans[5], &scans[..5]);
    let points = earlier.iter().flat_map(|(pose, scan)| scan.points.iter().map(|p| pose.act(p))).collect();
    let normals =
        earlier.iter().flat_map(|(pose, scan)| scan.normals.iter().map(|n| n.map(|n| pose.rotate(&n)))).collect();
    let target = OrientedTarget::new(points, normals);
    let guess = Pose2::translation(0.03, 0.0) * last.0;
    let source = last.1.clone();
    let options = Settings { max_iterations: 1, ..Settings::default() }.icp_options();
    Prepared {
        work: None,
        run: Box::new(move || {
            let source = Source { points: &source.points, normals: Some(&source.normals), sigmas: None };
            black_box(register(black_box(source), &target, guess, &PointToPlane, &options));
        }),
    }
}

/// Reads the scans and runs the reconstruction with its default settings to the end.
fn reconstruct(files: Files) -> Result<Prepared, String> {
    let run = |files: &Files| {
        let mut reconstruction = Reconstruction::new(Settings::default())?;
        for (name, bytes) in files {
            reconstruction.add_scan(name, ply::read(bytes).map_err(|error| error.in_file(name))?)?;
        }
        while reconstruction.step().stage != Stage::Done {}
        Ok::<_, scanstitch::Error>(reconstruction.result())
    };
    run(&files).map_err(|error| error.to_string())?;
    Ok(Prepared {
        work: Some((files.len() as f64, "scans")),
        run: Box::new(move || {
            black_box(run(black_box(&files)).ok());
        }),
    })
}

/// Points (m) in a room of 10 x 8 x 3 m, the same at every run: a generator by Steele, Lea and Flood (splitmix64).
fn points<const D: usize>(count: usize, seed: u64) -> Vec<[f32; D]> {
    let mut state = seed;
    let mut uniform = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1_u64 << 24) as f32
    };
    (0..count).map(|_| std::array::from_fn(|axis| [10.0, 8.0, 3.0][axis] * uniform())).collect()
}

/// A PLY file of points as little-endian floats.
fn binary_ply(count: usize) -> Vec<u8> {
    let mut bytes = header("binary_little_endian", count).into_bytes();
    bytes.extend(points::<3>(count, 0).into_iter().flatten().flat_map(f32::to_le_bytes));
    bytes
}

/// A PLY file of points as decimal numbers, to the micrometre.
fn ascii_ply(count: usize) -> Vec<u8> {
    let mut text = header("ascii", count);
    for [x, y, z] in points::<3>(count, 0) {
        writeln!(text, "{x:.6} {y:.6} {z:.6}").expect("writing into a String cannot fail");
    }
    text.into_bytes()
}

fn header(format: &str, count: usize) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {count}\n\
         property float x\nproperty float y\nproperty float z\nend_header\n"
    )
}
