//! The benchmarks, each a name and a function that prepares its input and returns the closure to time.

use std::fmt::Write as _;
use std::hint::black_box;

use glam::Vec3;

/// A named benchmark.
pub struct Benchmark {
    /// What `npm run bench -- NAME` calls it.
    pub name: &'static str,
    /// What one run does, in a few words.
    pub about: &'static str,
    /// Makes it ready to run, with the files given (name and bytes), which most benchmarks do without.
    pub prepare: fn(Files) -> Result<Prepared, String>,
}

/// Names and contents of the files a benchmark is given.
pub type Files = Vec<(String, Vec<u8>)>;

/// A benchmark with its input ready.
pub struct Prepared {
    /// How much one run works through, for a rate: amount and unit. Bytes give MB/s.
    pub work: Option<(f64, &'static str)>,
    /// One run.
    pub run: Box<dyn FnMut()>,
}

impl Prepared {
    /// What one run works through, as both harnesses print it: amount and unit, or `- -`.
    pub fn work_text(&self) -> String {
        self.work.map_or_else(|| "- -".into(), |(amount, unit)| format!("{amount} {unit}"))
    }
}

/// All benchmarks, in the order they are run and printed.
pub const BENCHMARKS: &[Benchmark] = &[
    Benchmark {
        name: "copy_binary",
        about: "copying the bytes of ply_binary: the pace it is judged by",
        prepare: |_| Ok(copy(binary_ply(&points_in_a_room(MILLION)))),
    },
    Benchmark {
        name: "copy_ascii",
        about: "copying the bytes of ply_ascii",
        prepare: |_| Ok(copy(ascii_ply(&points_in_a_room(MILLION)))),
    },
];

const MILLION: usize = 1_000_000;

/// Copies the bytes into a new vector.
fn copy(bytes: Vec<u8>) -> Prepared {
    Prepared {
        work: Some((bytes.len() as f64, "bytes")),
        run: Box::new(move || {
            black_box(black_box(&bytes).clone());
        }),
    }
}

/// Points (m) in a room of 10 x 8 x 3 m, the same at every run: a generator by Steele, Lea and Flood (splitmix64).
fn points_in_a_room(count: usize) -> Vec<Vec3> {
    let mut state = 0_u64;
    let mut uniform = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1_u64 << 24) as f32
    };
    (0..count).map(|_| Vec3::new(10.0 * uniform(), 8.0 * uniform(), 3.0 * uniform())).collect()
}

/// A PLY file of these points as little-endian floats.
fn binary_ply(points: &[Vec3]) -> Vec<u8> {
    let mut bytes = header("binary_little_endian", points.len()).into_bytes();
    bytes.extend(points.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes));
    bytes
}

/// A PLY file of these points as decimal numbers, to the micrometre.
fn ascii_ply(points: &[Vec3]) -> Vec<u8> {
    let mut text = header("ascii", points.len());
    for point in points {
        writeln!(text, "{:.6} {:.6} {:.6}", point.x, point.y, point.z).expect("writing into a String cannot fail");
    }
    text.into_bytes()
}

fn header(format: &str, count: usize) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {count}\n\
         property float x\nproperty float y\nproperty float z\nend_header\n"
    )
}
